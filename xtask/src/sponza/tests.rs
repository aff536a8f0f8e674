//! Whole-scene checks; they build the real geometry with small textures.

use std::collections::BTreeMap;

use super::mesh::{Soup, position_key};
use super::{build, generate_with};

/// File size limit in bytes, at full texture size.
const MAX_BYTES: usize = 12_000_000;

#[test]
fn triangle_budget() {
    let count = build().triangles();
    assert!((150_000..=300_000).contains(&count), "{count} triangles");
}

#[test]
fn meshes_are_sound() {
    for (i, m) in build().geometries.iter().enumerate() {
        assert!(!m.indices.is_empty(), "geometry {i} is empty");
        assert_eq!(m.positions.len(), m.normals.len());
        assert_eq!(m.positions.len(), m.uvs.len());
        for (p, (n, uv)) in m.positions.iter().zip(m.normals.iter().zip(&m.uvs)) {
            assert!(
                p.is_finite() && n.is_finite() && uv.is_finite(),
                "geometry {i}"
            );
            assert!(
                (n.length() - 1.0).abs() < 1.0e-3,
                "geometry {i}: normal {n}"
            );
            assert!(uv.abs().max_element() < 64.0, "geometry {i}: uv {uv}");
        }
        let (mut flat_uv, mut inverted) = (0, 0);
        for t in m.indices.chunks_exact(3) {
            let [a, b, c] = [t[0], t[1], t[2]].map(|v| v as usize);
            assert!(a.max(b).max(c) < m.positions.len(), "geometry {i}: index");
            let p = &m.positions;
            let n = (p[b] - p[a]).cross(p[c] - p[a]);
            assert!(n.length() > 1.0e-8, "geometry {i}: triangle without area");
            if n.dot(m.normals[a] + m.normals[b] + m.normals[c]) <= 0.0 {
                inverted += 1;
            }
            let (du, dv) = (m.uvs[b] - m.uvs[a], m.uvs[c] - m.uvs[a]);
            if du.perp_dot(dv).abs() < 1.0e-10 {
                flat_uv += 1;
            }
        }
        let count = m.indices.len() / 3;
        assert!(
            inverted == 0,
            "geometry {i}: {inverted} inverted of {count}"
        );
        assert!(
            flat_uv * 100 <= count,
            "geometry {i}: {flat_uv} of {count} flat in uv"
        );
    }
}

/// Edges that are not matched by exactly one opposite edge.
fn open_edges(soup: &Soup) -> usize {
    let mut edges: BTreeMap<_, i32> = BTreeMap::new();
    for t in &soup.tris {
        let k = t.map(|c| position_key(c.p));
        if k[0] == k[1] || k[1] == k[2] || k[2] == k[0] {
            continue;
        }
        for i in 0..3 {
            let (a, b) = (k[i], k[(i + 1) % 3]);
            *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
    }
    edges.values().filter(|&&n| n != 0).count()
}

/// Six times the signed volume.
fn volume(soup: &Soup) -> f64 {
    soup.tris
        .iter()
        .map(|t| f64::from(t[0].p.dot(t[1].p.cross(t[2].p))))
        .sum()
}

#[test]
fn solids_are_closed_and_face_outward() {
    let scene = build();
    assert!(scene.solids.len() > 40);
    let mut bad = Vec::new();
    for (name, soup) in &scene.solids {
        let open = open_edges(soup);
        let v = volume(soup);
        if open > 0 || v <= 0.0 {
            bad.push(format!("{name}: {open} open edges, volume {v:.4}"));
        }
    }
    assert!(bad.is_empty(), "{}", bad.join("\n"));
}

#[test]
fn same_bytes_twice() {
    let (a, b) = (generate_with(16), generate_with(16));
    assert_eq!(a.ok(), b.ok());
}

#[test]
#[ignore = "paints all textures at full size, which is slow"]
fn file_is_small_enough() {
    let full = super::generate().map(|b| b.len()).unwrap_or(usize::MAX);
    assert!(full < MAX_BYTES, "{full} bytes");
}

#[test]
fn geometry_leaves_room_for_textures() {
    // The full-size textures take about half of the limit.
    let small = generate_with(16).map(|b| b.len()).unwrap_or(usize::MAX);
    assert!(small < MAX_BYTES / 2, "{small} bytes without textures");
}
