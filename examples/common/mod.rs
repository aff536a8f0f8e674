//! What the examples, the viewer and the tests share.
#![allow(dead_code, reason = "every example uses a part of it")]

pub mod adapter;
pub mod capture;
pub mod controls;
pub mod headless;
pub mod reference;
pub mod scenes;
