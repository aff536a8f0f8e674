//! The voxelizer against the exact overlap of triangle and box, and against a flood.

use bevy::prelude::*;
use bevy_gi::{prelude::*, scene::volume::Grid};

use crate::{
    common::scenes::stage::diffuse,
    support::{Voxels, app, camera, material, read_voxels, settle},
};

/// Voxelizes a mesh in a volume of 64 voxels over 6.4 m; and its triangles in voxels.
fn voxelize(mesh: Mesh, transform: Transform) -> (Voxels, Vec<[Vec3; 3]>) {
    let mut headless = app();
    let white = material(&mut headless, diffuse([0.5; 3]));
    let triangles: Vec<[Vec3; 3]> = mesh.triangles().unwrap().map(|t| t.vertices).collect();
    let world = headless.app.world_mut();
    let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh);
    world.spawn((Mesh3d(mesh), MeshMaterial3d(white), transform));
    world.spawn(GiVolume::new(Vec3::splat(6.4)).with_resolution(64));
    camera(
        &mut headless,
        UVec2::splat(16),
        Vec3::new(0.0, 0.0, 9.0),
        Vec3::ZERO,
        45.0,
    );
    settle(&mut headless, 3);
    let voxels = read_voxels(&mut headless);
    let grid = voxels.grid;
    let in_voxels = |p: Vec3| (transform.transform_point(p) - grid.origin) / grid.voxel;
    let triangles = triangles.iter().map(|t| t.map(in_voxels)).collect();
    (voxels, triangles)
}

/// Separating axis test of a triangle and the unit voxel at `v`, grown by `margin` (Akenine-Moeller
/// 2001).
fn overlaps(triangle: &[Vec3; 3], v: IVec3, margin: f32) -> bool {
    let center = v.as_vec3() + 0.5;
    let half = 0.5 + margin;
    let t = triangle.map(|p| p - center);
    let edges = [t[1] - t[0], t[2] - t[1], t[0] - t[2]];
    let separated = |axis: Vec3| {
        let p = t.map(|v| v.dot(axis));
        let r = half * axis.abs().element_sum();
        p[0].min(p[1]).min(p[2]) > r || p[0].max(p[1]).max(p[2]) < -r
    };
    let axes = [Vec3::X, Vec3::Y, Vec3::Z];
    if axes.iter().any(|a| separated(*a)) || separated(edges[0].cross(edges[1])) {
        return false;
    }
    !edges
        .iter()
        .any(|e| axes.iter().any(|a| separated(e.cross(*a))))
}

fn coordinates(grid: &Grid) -> impl Iterator<Item = IVec3> {
    let d = grid.dims.as_ivec3();
    (0..d.z)
        .flat_map(move |z| (0..d.y).flat_map(move |y| (0..d.x).map(move |x| IVec3::new(x, y, z))))
}

/// Whether a flood from a corner reaches `inside`, from voxel to face-adjacent empty voxel.
fn flood_reaches(o: &Voxels, inside: IVec3) -> bool {
    let d = o.grid.dims.as_ivec3();
    let mut seen = vec![false; o.records.len()];
    let index = |v: IVec3| ((v.z * d.y + v.y) * d.x + v.x) as usize;
    let mut stack = vec![IVec3::ZERO];
    while let Some(v) = stack.pop() {
        if v.cmplt(IVec3::ZERO).any() || v.cmpge(d).any() || seen[index(v)] || o.at(v) {
            continue;
        }
        seen[index(v)] = true;
        for step in [IVec3::X, IVec3::Y, IVec3::Z] {
            stack.extend([v + step, v - step]);
        }
    }
    seen[index(inside)]
}

#[test]
fn closed_surfaces_have_no_holes_and_nothing_stray() {
    let turned = Transform::from_rotation(Quat::from_euler(EulerRot::XYZ, 0.6, 0.4, 0.2))
        .with_translation(Vec3::new(0.013, -0.021, 0.037));
    let shapes: [(&str, Mesh, Transform); 4] = [
        (
            "sphere",
            Sphere::new(2.3).mesh().ico(6).unwrap(),
            Transform::default(),
        ),
        ("turned box", Cuboid::from_length(3.0).into(), turned),
        ("turned cone", Cone::new(2.0, 3.4).into(), turned),
        ("turned cylinder", Cylinder::new(1.4, 3.3).into(), turned),
    ];
    for (name, mesh, transform) in shapes {
        let (o, triangles) = voxelize(mesh, transform);
        let inside = ((transform.translation - o.grid.origin) / o.grid.voxel).as_ivec3();
        assert!(!o.at(inside), "{name}: hollow");
        assert!(!flood_reaches(&o, inside), "{name}: a flood finds a hole");

        let (mut set, mut stray, mut exact, mut missed) = (0, 0, 0, 0);
        for v in coordinates(&o.grid) {
            let touches = |margin: f32| triangles.iter().any(|t| overlaps(t, v, margin));
            if o.at(v) {
                set += 1;
                // Rasterization may round a sample by a hundredth of a voxel.
                stray += u32::from(!touches(0.02));
            }
            // What every surface passes well inside of, and not just by a corner.
            if touches(-0.3) {
                exact += 1;
                missed += u32::from(!o.at(v));
            }
        }
        println!("{name}: {set} voxels, {stray} stray; {missed} of {exact} deep overlaps missed");
        assert!(set > 500, "{name}");
        assert_eq!(stray, 0, "{name}: voxels that no triangle touches");
        // A surface that comes within 0.2 of a voxel's centre crosses more than a sample's spacing.
        assert_eq!(missed, 0, "{name}: voxels that a triangle passes through");
    }
}
