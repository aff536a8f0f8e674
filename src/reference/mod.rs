//! The reference: a path tracer on the CPU over the same Bevy world (feature `reference`).
//!
//! It reads the world as it stands, and computes what the techniques approximate: light along all paths, with
//! Bevy's own materials (see `bsdf.rs`), lights and sky. Errors of techniques are measured against it.
//!
//! # Method
//!
//! Unidirectional path tracing with next-event estimation to every light, to emissive triangles and to image
//! skies, weighted against sampling of the material (Veach 1997, balance heuristic); Russian roulette from the
//! second bounce on; Owen-scrambled Sobol points (Burley 2020). The result depends only on the scene, the
//! camera, the settings and the number of samples, not on threads or time.
//!
//! # Direct and indirect light
//!
//! *Direct* light is what a camera shows with the technique off: visible emission, plus one reflection of
//! Bevy's lights. All other light is *indirect*, including the light of emissive surfaces and of the sky.
//!
//! # Limits
//!
//! Transparent materials are left out, as in the capture of the techniques. Clearcoat, anisotropy,
//! transmission, fog and ambient occlusion maps are ignored. Lights have no radius, and always cast shadows.
//! [`GiLight`](crate::GiLight) is ignored: it sets how a technique shows a light, not how the light is. Rect
//! lights reflect like all other lights; Bevy's own shader uses Lambert's law for them.

mod bsdf;
mod distribution;
mod emitters;
mod film;
mod fingerprint;
mod geometry;
mod integrator;
mod lights;
mod material;
mod picture;
mod sampler;
mod scene;
mod settings;
mod sky;
mod texture;

pub use film::ReferenceView;
pub use integrator::ReferenceCamera;
pub use picture::Reference;
pub use scene::ReferenceScene;
pub use settings::{DiffuseModel, ReferenceSettings, SpecularModel};
