//! What tools, examples and tests of bevy_gi share.
//!
//! | for | modules |
//! |---|---|
//! | examples | [`adapter`], [`controls`], [`scenes`] |
//! | what opens a scene by name | [`open`], [`options`], [`window`] |
//! | the path tracer | [`mod@reference`], [`live`] beside a running app, [`truth`] at the press of a key |
//! | programs without a window | [`headless`], [`studio`], [`capture`], [`projector`] |
//! | comparisons | [`overlay`], [`figures`], [`meter`], [`quality`], [`plot`], [`document`] |

pub mod adapter;
pub mod capture;
pub mod controls;
pub mod document;
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
