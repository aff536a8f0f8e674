//! What the examples, the viewer and the tests share.
#![allow(dead_code, reason = "every example uses a part of it")]

pub mod adapter;
pub mod capture;
pub mod controls;
pub mod figures;
pub mod headless;
pub mod live;
pub mod meter;
pub mod open;
pub mod options;
pub mod overlay;
pub mod plot;
pub mod projector;
pub mod quality;
pub mod reference;
pub mod scenes;
pub mod studio;
pub mod truth;
pub mod window;
