//! The scene under construction: meshes, instances, cameras and lights.

use glam::{Quat, Vec2, Vec3};

use super::materials::Mat;
use super::mesh::{Mesh, Soup};

/// One drawable piece: a geometry with a material.
pub struct Primitive {
    /// Index into [`Scene::geometries`].
    pub geometry: usize,
    /// Its material.
    pub mat: Mat,
}

/// A named group of primitives that nodes share.
pub struct MeshDef {
    /// Name in the file.
    pub name: String,
    /// Its primitives.
    pub primitives: Vec<Primitive>,
}

/// One instance of a mesh.
pub struct Node {
    /// Name in the file.
    pub name: String,
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// Position of the mesh origin.
    pub translation: Vec3,
    /// Its orientation.
    pub rotation: Quat,
    /// Uniform, positive scale.
    pub scale: f32,
}

/// A named view.
pub struct Camera {
    /// Name in the file.
    pub name: &'static str,
    /// Eye position.
    pub eye: Vec3,
    /// Point looked at.
    pub target: Vec3,
}

/// Handle of a mesh in a scene.
#[derive(Clone, Copy)]
pub struct MeshId(usize);

/// Handle of a geometry in a scene.
#[derive(Clone, Copy)]
pub struct GeometryId(usize);

/// Everything the file will hold, apart from the textures.
#[derive(Default)]
pub struct Scene {
    /// Unique geometries.
    pub geometries: Vec<Mesh>,
    /// Unique meshes.
    pub meshes: Vec<MeshDef>,
    /// Instances.
    pub nodes: Vec<Node>,
    /// Views; the first is the default one.
    pub cameras: Vec<Camera>,
    /// Soups of solids that must be closed, kept for the tests.
    #[cfg(test)]
    pub solids: Vec<(String, Soup)>,
}

impl Scene {
    /// Registers a geometry whose texture coordinates suit `mat`'s tile size.
    pub fn geometry(&mut self, soup: Soup, crease_deg: f32, mat: Mat) -> GeometryId {
        let mut mesh = soup.finish(crease_deg);
        let scale = 1.0 / mat.tile_metres();
        // Whole tiles are taken off so the coordinates stay small and precise.
        let low = mesh
            .uvs
            .iter()
            .fold(Vec2::splat(f32::MAX), |a, &b| a.min(b * scale));
        let shift = if mesh.uvs.is_empty() {
            Vec2::ZERO
        } else {
            low.floor()
        };
        for uv in &mut mesh.uvs {
            *uv = *uv * scale - shift;
        }
        self.geometries.push(mesh);
        GeometryId(self.geometries.len() - 1)
    }

    /// Registers a mesh of several soups, each with its own material.
    pub fn mesh(&mut self, name: &str, parts: Vec<(Soup, f32, Mat)>) -> MeshId {
        let primitives = parts
            .into_iter()
            .map(|(soup, crease, mat)| Primitive {
                geometry: self.geometry(soup, crease, mat).0,
                mat,
            })
            .collect();
        self.meshes.push(MeshDef {
            name: name.to_owned(),
            primitives,
        });
        MeshId(self.meshes.len() - 1)
    }

    /// Registers a mesh made of closed, opaque solids of one material.
    pub fn solid(&mut self, name: &str, soup: Soup, crease_deg: f32, mat: Mat) -> MeshId {
        #[cfg(test)]
        self.solids.push((name.to_owned(), soup.clone()));
        self.mesh(name, vec![(soup, crease_deg, mat)])
    }

    /// Registers a mesh that shares an existing geometry.
    pub fn shared(&mut self, name: &str, geometry: GeometryId, mat: Mat) -> MeshId {
        self.meshes.push(MeshDef {
            name: name.to_owned(),
            primitives: vec![Primitive {
                geometry: geometry.0,
                mat,
            }],
        });
        MeshId(self.meshes.len() - 1)
    }

    /// Adds primitives that share an existing geometry to a mesh.
    pub fn extend(&mut self, mesh: MeshId, geometry: GeometryId, mat: Mat) {
        self.meshes[mesh.0].primitives.push(Primitive {
            geometry: geometry.0,
            mat,
        });
    }

    /// Places an instance turned about the vertical by `yaw` radians.
    pub fn place(&mut self, name: &str, mesh: MeshId, translation: Vec3, yaw: f32) {
        self.place_scaled(name, mesh, translation, yaw, 1.0);
    }

    /// [`Scene::place`] with a uniform scale.
    pub fn place_scaled(&mut self, name: &str, mesh: MeshId, t: Vec3, yaw: f32, scale: f32) {
        self.nodes.push(Node {
            name: name.to_owned(),
            mesh: mesh.0,
            translation: t,
            rotation: Quat::from_rotation_y(yaw),
            scale,
        });
    }

    /// Registers a solid that occurs once, in place.
    pub fn fixed(&mut self, name: &str, soup: Soup, crease_deg: f32, mat: Mat) {
        let id = self.solid(name, soup, crease_deg, mat);
        self.place(name, id, Vec3::ZERO, 0.0);
    }

    /// Triangles over all instances.
    #[cfg(test)]
    pub fn triangles(&self) -> usize {
        self.nodes
            .iter()
            .flat_map(|n| &self.meshes[n.mesh].primitives)
            .map(|p| self.geometries[p.geometry].triangles())
            .sum()
    }
}
