//! What scenes are built with.

use bevy::{camera::Exposure, prelude::*};
use bevy_gi::prelude::*;

/// A world to put meshes, lights and volumes into.
pub struct Stage<'w>(pub &'w mut World);

/// Perfectly diffuse, of a linear albedo. At this roughness Bevy's diffuse lobe reflects as much as
/// Lambert's, which other path tracers have.
pub fn diffuse(color: [f32; 3]) -> StandardMaterial {
    StandardMaterial {
        base_color: Color::linear_rgb(color[0], color[1], color[2]),
        perceptual_roughness: 0.65,
        reflectance: 0.0,
        ..default()
    }
}

/// A lamp's surface: black, and shining with so many nits, seen with an exposure of `ev100`.
///
/// Bevy's deferred renderer takes emission for exposed already, whatever `emissive_exposure_weight` says.
pub fn shining(nits: [f32; 3], ev100: f32) -> StandardMaterial {
    let [r, g, b] = nits.map(|nits| nits * Exposure { ev100 }.exposure());
    StandardMaterial {
        emissive: LinearRgba::rgb(r, g, b),
        ..diffuse([0.0; 3])
    }
}

impl Stage<'_> {
    pub fn material(&mut self, material: StandardMaterial) -> Handle<StandardMaterial> {
        let mut materials = self.0.resource_mut::<Assets<StandardMaterial>>();
        materials.add(material)
    }

    /// A material from [`diffuse`].
    pub fn paint(&mut self, color: [f32; 3]) -> Handle<StandardMaterial> {
        self.material(diffuse(color))
    }

    pub fn mesh(
        &mut self,
        mesh: impl Into<Mesh>,
        material: &Handle<StandardMaterial>,
        at: Transform,
    ) -> Entity {
        let mesh = self.0.resource_mut::<Assets<Mesh>>().add(mesh.into());
        let bundle = (Mesh3d(mesh), MeshMaterial3d(material.clone()), at);
        self.0.spawn(bundle).id()
    }

    /// A box between two corners.
    pub fn slab(&mut self, min: Vec3, max: Vec3, material: &Handle<StandardMaterial>) -> Entity {
        let at = Transform::from_translation(0.5 * (min + max));
        self.mesh(Cuboid::from_size(max - min), material, at)
    }

    /// A box that stands on the floor, turned about its vertical axis.
    pub fn block(
        &mut self,
        at: Vec2,
        size: Vec3,
        degrees: f32,
        material: &Handle<StandardMaterial>,
    ) -> Entity {
        let at = Transform::from_xyz(at.x, 0.5 * size.y, at.y)
            .with_rotation(Quat::from_rotation_y(degrees.to_radians()));
        self.mesh(Cuboid::from_size(size), material, at)
    }

    /// Six slabs around the inside of a room: floor and ceiling, and two walls each across x and z.
    pub fn room(&mut self, min: Vec3, max: Vec3, wall: f32, paint: &Handle<StandardMaterial>) {
        let (lo, hi) = (min - wall, max + wall);
        for axis in 0..3 {
            let mut below = hi;
            below[axis] = min[axis];
            self.slab(lo, below, paint);
            let mut above = lo;
            above[axis] = max[axis];
            self.slab(above, hi, paint);
        }
    }

    /// A bare bulb without a body, which casts shadows.
    pub fn bulb(&mut self, at: Vec3, candela: f32) -> Entity {
        let light = PointLight {
            intensity: candela * 4.0 * std::f32::consts::PI,
            range: 1000.0,
            shadow_maps_enabled: true,
            ..default()
        };
        self.0.spawn((light, Transform::from_translation(at))).id()
    }

    /// A volume around everything between two corners, and a little more.
    pub fn volume(&mut self, min: Vec3, max: Vec3) {
        let at = Transform::from_translation(0.5 * (min + max));
        self.0.spawn((GiVolume::new(max - min + 0.2), at));
    }
}
