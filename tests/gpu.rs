//! Tests that render: one binary, so that Bevy is linked once. They run on any adapter, Mesa's
//! software driver included, one at a time.

use bevy_gi_tools as common;

#[path = "gpu/bad_input.rs"]
mod bad_input;
#[path = "gpu/bulbs.rs"]
mod bulbs;
#[path = "gpu/cameras.rs"]
mod cameras;
#[path = "gpu/casters.rs"]
mod casters;
#[path = "gpu/composite.rs"]
mod composite;
#[path = "gpu/cornell.rs"]
mod cornell;
#[path = "gpu/custom.rs"]
mod custom;
#[path = "../examples/custom_technique.rs"]
#[allow(dead_code)]
mod custom_technique;
#[path = "gpu/custom_view.rs"]
mod custom_view;
#[path = "gpu/debug.rs"]
mod debug;
#[path = "gpu/files.rs"]
mod files;
#[path = "gpu/forward.rs"]
mod forward;
#[path = "gpu/hints.rs"]
mod hints;
#[path = "gpu/inspector.rs"]
mod inspector;
#[path = "gpu/lights.rs"]
mod lights;
#[path = "gpu/many.rs"]
mod many;
#[path = "gpu/off.rs"]
mod off;
#[path = "gpu/outside.rs"]
mod outside;
#[path = "gpu/probes.rs"]
mod probes;
#[path = "gpu/quality.rs"]
mod quality;
#[path = "gpu/reflectance.rs"]
mod reflectance;
#[path = "gpu/rooms.rs"]
mod rooms;
#[path = "gpu/rsm.rs"]
mod rsm;
#[path = "gpu/shared.rs"]
mod shared;
#[path = "gpu/strength.rs"]
mod strength;
#[path = "gpu/support.rs"]
mod support;
#[path = "gpu/time.rs"]
mod time;
#[path = "gpu/voxels.rs"]
mod voxels;
#[path = "gpu/webgpu.rs"]
mod webgpu;
#[path = "gpu/world.rs"]
mod world;
