//! The parts of the document `docs/quality.md`.

use bevy_gi_tools::document::Part;

/// Title of the document.
pub const TITLE: &str = "# Quality";

/// What is of random scenes. It comes before what may be tuned to.
pub const RANDOM: Part = Part {
    name: "the random scenes",
    is_first: true,
};

/// What is of the scenes of the table: bundled ones, and files.
pub const BUNDLED: Part = Part {
    name: "the bundled scenes",
    is_first: false,
};
