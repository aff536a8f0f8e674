//! Walls, floors and ceilings: what is near a space and not in one.

use bevy::prelude::*;

/// A box of air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Space {
    pub min: Vec3,
    pub max: Vec3,
}

impl Space {
    pub fn new(min: Vec3, max: Vec3) -> Self {
        Self { min, max }
    }

    pub fn size(&self) -> Vec3 {
        self.max - self.min
    }

    /// Square metres of its floor.
    pub fn floor_area(&self) -> f32 {
        self.size().x * self.size().z
    }

    /// Square metres of all six sides.
    pub fn surface(&self) -> f32 {
        let s = self.size();
        2.0 * (s.x * s.y + s.y * s.z + s.z * s.x)
    }

    pub fn contains(&self, point: Vec3) -> bool {
        point.cmpge(self.min).all() && point.cmple(self.max).all()
    }

    /// The same, larger on all sides; smaller, if `by` is below 0.
    pub fn grown(&self, by: f32) -> Self {
        Self::new(self.min - by, self.max + by)
    }

    pub fn overlaps(&self, other: &Self) -> bool {
        self.min.cmplt(other.max).all() && other.min.cmplt(self.max).all()
    }
}

/// Which part of a building a box belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    Floor,
    Wall,
    Ceiling,
}

/// A grid whose planes are those of all boxes.
struct Grid {
    planes: [Vec<f32>; 3],
}

impl Grid {
    fn new(boxes: impl Iterator<Item = Space> + Clone) -> Self {
        let planes = [0, 1, 2].map(|axis| {
            let mut planes: Vec<f32> = boxes
                .clone()
                .flat_map(|b| [b.min[axis], b.max[axis]])
                .collect();
            planes.sort_by(f32::total_cmp);
            // What was meant to be the same plane differs by roundings, and nothing is as thin as a millimetre.
            planes.dedup_by(|a, b| *a - *b < 1e-3);
            planes
        });
        Self { planes }
    }

    fn dims(&self) -> [usize; 3] {
        [0, 1, 2].map(|axis| self.planes[axis].len() - 1)
    }

    /// The box of cells from one to before another.
    fn span(&self, from: [usize; 3], to: [usize; 3]) -> Space {
        let corner = |at: [usize; 3]| {
            Vec3::new(
                self.planes[0][at[0]],
                self.planes[1][at[1]],
                self.planes[2][at[2]],
            )
        };
        Space::new(corner(from), corner(to))
    }
}

/// Boxes without overlap that fill all within `wall` metres of a space and in no space or opening. There is at
/// least one space.
pub fn carve(spaces: &[Space], openings: &[Space], wall: f32) -> Vec<(Space, Part)> {
    let grown = spaces.iter().map(|space| space.grown(wall));
    let boxes = spaces.iter().copied().chain(grown);
    let grid = Grid::new(boxes.chain(openings.iter().copied()));
    let dims = grid.dims();
    let index = |at: [usize; 3]| (at[1] * dims[2] + at[2]) * dims[0] + at[0];
    let mut cells = Vec::with_capacity(dims.iter().product());
    for y in 0..dims[1] {
        for z in 0..dims[2] {
            for x in 0..dims[0] {
                let cell = grid.span([x, y, z], [x + 1, y + 1, z + 1]);
                cells.push(part(0.5 * (cell.min + cell.max), spaces, openings, wall));
            }
        }
    }
    let mut carved = Vec::new();
    for y in 0..dims[1] {
        for z in 0..dims[2] {
            for x in 0..dims[0] {
                let from = [x, y, z];
                let Some(part) = cells[index(from)] else {
                    continue;
                };
                let to = largest(&cells, &index, dims, from, part);
                for_cells(from, to, |at| cells[index(at)] = None);
                carved.push((grid.span(from, to), part));
            }
        }
    }
    carved
}

/// What is at a point; `None` is air.
fn part(p: Vec3, spaces: &[Space], openings: &[Space], wall: f32) -> Option<Part> {
    let is_solid = spaces.iter().any(|space| space.grown(wall).contains(p));
    let is_air = spaces.iter().chain(openings).any(|air| air.contains(p));
    if !is_solid || is_air {
        return None;
    }
    let lowest = spaces.iter().map(|space| space.min.y);
    if p.y < lowest.fold(f32::INFINITY, f32::min) {
        return Some(Part::Floor);
    }
    let is_over = |space: &Space| {
        let level = Vec3::new(p.x, space.min.y, p.z);
        space.contains(level) && p.y > space.max.y
    };
    Some(match spaces.iter().any(is_over) {
        true => Part::Ceiling,
        false => Part::Wall,
    })
}

/// Where a box of the same part ends that starts at a cell: as long as possible along x, then z, then y.
fn largest(
    cells: &[Option<Part>],
    index: &impl Fn([usize; 3]) -> usize,
    dims: [usize; 3],
    from: [usize; 3],
    part: Part,
) -> [usize; 3] {
    let mut to = from.map(|i| i + 1);
    for axis in [0, 2, 1] {
        while to[axis] < dims[axis] {
            let (mut start, mut end) = (from, to);
            start[axis] = to[axis];
            end[axis] = to[axis] + 1;
            let mut same = true;
            for_cells(start, end, |at| same &= cells[index(at)] == Some(part));
            if !same {
                break;
            }
            to[axis] += 1;
        }
    }
    to
}

/// Calls `visit` for all cells from one to before another.
fn for_cells(from: [usize; 3], to: [usize; 3], mut visit: impl FnMut([usize; 3])) {
    for y in from[1]..to[1] {
        for z in from[2]..to[2] {
            for x in from[0]..to[0] {
                visit([x, y, z]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(carved: &[(Space, Part)]) -> f32 {
        carved
            .iter()
            .map(|(solid, _)| solid.size().element_product())
            .sum()
    }

    /// A cube of 2 m with walls of 0.5 m: 3^3 - 2^3; a window of 1 x 1 m takes 0.5.
    #[test]
    fn what_is_carved_has_the_volume_of_the_walls() {
        let room = Space::new(Vec3::ZERO, Vec3::splat(2.0));
        let closed = carve(&[room], &[], 0.5);
        assert!((volume(&closed) - 19.0).abs() < 1e-3);
        let window = Space::new(Vec3::new(2.0, 0.5, 0.5), Vec3::new(2.5, 1.5, 1.5));
        let open = carve(&[room], &[window], 0.5);
        assert!((volume(&open) - 18.5).abs() < 1e-3);
        for (solid, _) in &open {
            assert!(!solid.grown(-1e-3).overlaps(&window));
            assert!(!solid.grown(-1e-3).overlaps(&room));
        }
    }

    /// Rooms 0.2 m apart share the wall between them.
    #[test]
    fn rooms_share_a_wall() {
        let a = Space::new(Vec3::ZERO, Vec3::splat(2.0));
        let b = Space::new(Vec3::new(2.2, 0.0, 0.0), Vec3::new(4.2, 2.0, 2.0));
        let carved = carve(&[a, b], &[], 0.3);
        // The whole is 4.8 x 2.6 x 2.6.
        assert!((volume(&carved) - (4.8 * 2.6 * 2.6 - 16.0)).abs() < 1e-3);
        let floors = carved.iter().filter(|(_, part)| *part == Part::Floor);
        assert!(floors.clone().count() > 0);
        assert!(floors.clone().all(|(solid, _)| solid.max.y <= 1e-4));
    }
}
