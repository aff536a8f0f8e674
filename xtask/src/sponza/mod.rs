//! A two-storey arcaded palace court, generated from scratch.
//!
//! [`generate`] returns a self-contained GLB: geometry, painted PBR textures,
//! three cameras and a sun. The same bytes come out on every run.

mod arcades;
mod arches;
mod cloth;
mod columns;
mod dims;
mod gltf;
mod lamps;
mod materials;
mod mesh;
mod plants;
mod reliefs;
mod rng;
mod roof;
mod scene;
mod shapes;
mod shell;
#[cfg(test)]
mod tests;
mod textures;
mod vaults;

use glam::vec3;

use scene::{Camera, Scene};

/// Generates the scene and returns it as a binary glTF file.
pub fn generate() -> anyhow::Result<Vec<u8>> {
    generate_with(1)
}

/// [`generate`] with all textures reduced by `texture_divisor`, for quick
/// tests and previews.
pub fn generate_with(texture_divisor: u32) -> anyhow::Result<Vec<u8>> {
    let images = textures::paint_all(texture_divisor)?;
    gltf::write(&build(), &images)
}

/// Assembles the geometry, cameras and lights.
fn build() -> Scene {
    let mut scene = Scene::default();
    arcades::build(&mut scene);
    shell::build(&mut scene);
    roof::build(&mut scene);
    reliefs::build(&mut scene);
    cloth::build(&mut scene);
    plants::build(&mut scene);
    lamps::build(&mut scene);
    scene.cameras = vec![
        // Standing at the west end, slightly off the axis.
        Camera {
            name: "Atrium",
            eye: vec3(-11.6, 1.75, 0.55),
            target: vec3(0.0, 4.05, -0.25),
        },
        // Between the columns of the western gallery, looking across the court.
        Camera {
            name: "Gallery",
            eye: vec3(-12.45, 8.5, 0.85),
            target: vec3(-3.0, 4.3, -0.9),
        },
        // In the north aisle behind the curtains.
        Camera {
            name: "Aisle",
            eye: vec3(-13.9, 1.7, 5.6),
            target: vec3(0.0, 2.5, 4.7),
        },
    ];
    scene
}
