//! Square tiles of any power of two in the pages of a texture array, and how large each may be.

use std::{
    cmp::{Ordering, Reverse},
    collections::{BTreeSet, BinaryHeap},
};

use bevy::math::UVec2;

/// Texels along the side of the smallest tile.
pub(crate) const SMALLEST: u32 = 16;

/// A square of texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Tile {
    pub page: u32,
    /// Texels, a multiple of `size`.
    pub origin: UVec2,
    /// Texels along a side, a power of two.
    pub size: u32,
}

/// Which texels of the pages are free: a buddy allocator over quadtrees, one a page.
///
/// Tiles that stay are never moved, so that what is drawn into them stays valid.
#[derive(Debug, Default)]
pub(crate) struct Atlas {
    side: u32,
    pages: u32,
    /// Free squares by level, `SMALLEST << level` texels wide: page, and place along the Morton curve in
    /// smallest tiles.
    free: Vec<BTreeSet<(u32, u32)>>,
}

fn level(size: u32) -> usize {
    (size / SMALLEST).ilog2() as usize
}

/// Smallest tiles in a square of a level.
fn area(level: usize) -> u32 {
    1 << (2 * level)
}

/// Every second bit of a number, from bit `first` on.
fn every_second_bit(bits: u32, first: u32) -> u32 {
    (0..16).fold(0, |sum, i| sum | ((bits >> (2 * i + first)) & 1) << i)
}

fn morton(at: UVec2) -> u32 {
    (0..16).fold(0, |sum, i| {
        sum | ((at.x >> i) & 1) << (2 * i) | ((at.y >> i) & 1) << (2 * i + 1)
    })
}

impl Atlas {
    /// Pages of `side` texels, a power of two; none yet.
    pub fn new(side: u32) -> Self {
        let side = side.max(SMALLEST).next_power_of_two();
        Self {
            side,
            pages: 0,
            free: vec![BTreeSet::new(); level(side) + 1],
        }
    }

    /// Texels along the side of a page.
    pub fn side(&self) -> u32 {
        self.side
    }

    /// Number of pages.
    pub fn pages(&self) -> u32 {
        self.pages
    }

    /// A tile of `size` texels, in a new page if there are fewer than `most`; `None` where no place is left.
    pub fn allocate(&mut self, size: u32, most: u32) -> Option<Tile> {
        let wanted = level(size.clamp(SMALLEST, self.side));
        let found = (wanted..self.free.len()).find(|l| !self.free[*l].is_empty());
        let mut l = match found {
            Some(level) => level,
            None if self.pages < most => {
                let top = self.free.len() - 1;
                self.free[top].insert((self.pages, 0));
                self.pages += 1;
                top
            }
            None => return None,
        };
        let (page, place) = self.free[l].pop_first()?;
        while l > wanted {
            l -= 1;
            self.free[l].extend((1..4).map(|quarter| (page, place + quarter * area(l))));
        }
        let at = UVec2::new(every_second_bit(place, 0), every_second_bit(place, 1));
        Some(Tile {
            page,
            origin: at * SMALLEST,
            size: SMALLEST << wanted,
        })
    }

    /// Gives a tile's texels back.
    pub fn release(&mut self, tile: Tile) {
        let mut l = level(tile.size);
        let mut place = morton(tile.origin / SMALLEST);
        while l + 1 < self.free.len() {
            let first = place - place % area(l + 1);
            let quarters = (0..4).map(|quarter| (tile.page, first + quarter * area(l)));
            let others: Vec<_> = quarters.filter(|q| q.1 != place).collect();
            if !others.iter().all(|other| self.free[l].contains(other)) {
                break;
            }
            for other in others {
                self.free[l].remove(&other);
            }
            place = first;
            l += 1;
        }
        self.free[l].insert((tile.page, place));
    }
}

/// Some tiles of one size.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Request {
    pub tiles: u32,
    /// Texels along the side of each, a power of two, where there is room for all.
    pub wanted: u32,
    /// What they have now; 0: nothing.
    pub now: u32,
    /// What they are worth, in any unit.
    pub importance: f32,
}

impl Request {
    fn texels(&self, size: u32) -> u64 {
        u64::from(self.tiles) * u64::from(size) * u64::from(size)
    }
}

/// A request in the order in which it gives texels up: first whoever has the most for what it is worth.
#[derive(PartialEq)]
struct Worth {
    importance: f32,
    number: usize,
}

impl Eq for Worth {}

impl Ord for Worth {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_importance = self.importance.total_cmp(&other.importance);
        by_importance.then(other.number.cmp(&self.number))
    }
}

impl PartialOrd for Worth {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The side of each request's tiles, so that all together have at most `budget` texels: texels in proportion to
/// importance, within the powers of two. 0 for those that have no room even in the smallest tiles: the least
/// important.
pub(crate) fn share(requests: &[Request], budget: u64) -> Vec<u32> {
    let mut sizes: Vec<_> = requests.iter().map(|r| r.wanted.max(SMALLEST)).collect();
    let mut total: u64 = requests.iter().zip(&sizes).map(|(r, s)| r.texels(*s)).sum();
    let worth = |number: usize, size: u32| {
        let texels = requests[number].texels(size).max(1) as f32;
        let importance = requests[number].importance / texels;
        Reverse(Worth { importance, number })
    };
    let mut heap: BinaryHeap<_> = (0..sizes.len()).map(|i| worth(i, sizes[i])).collect();
    while total > budget
        && let Some(Reverse(Worth { number, .. })) = heap.pop()
    {
        let size = sizes[number];
        let smaller = size / 2;
        if smaller >= SMALLEST {
            total -= requests[number].texels(size) - requests[number].texels(smaller);
            sizes[number] = smaller;
            heap.push(worth(number, smaller));
        }
    }
    if total > budget {
        let mut by_worth: Vec<_> = (0..sizes.len()).collect();
        let importance = |i: &usize| requests[*i].importance;
        by_worth.sort_by(|a, b| importance(b).total_cmp(&importance(a)).then(a.cmp(b)));
        total = 0;
        for i in by_worth {
            let texels = requests[i].texels(sizes[i]);
            if total + texels > budget {
                sizes[i] = 0;
            } else {
                total += texels;
            }
        }
        return sizes;
    }
    // A step more or less is not worth drawing everything again.
    for (request, size) in requests.iter().zip(&mut sizes) {
        let near = request.now == *size / 2 || request.now == *size * 2;
        let crowded = *size < request.wanted;
        let kept = total - request.texels(*size) + request.texels(request.now);
        if near && crowded && kept <= budget {
            *size = request.now;
            total = kept;
        }
    }
    sizes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn overlap(a: &Tile, b: &Tile) -> bool {
        let apart = (a.origin + a.size).cmple(b.origin) | (b.origin + b.size).cmple(a.origin);
        a.page == b.page && !apart.any()
    }

    /// Whatever comes and goes, no two tiles overlap, and all of a page can be had again in the end.
    #[test]
    fn tiles_do_not_overlap_and_come_back() {
        let mut atlas = Atlas::new(256);
        let mut tiles: Vec<Tile> = Vec::new();
        let mut random = 1_u32;
        for _ in 0..2000 {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let size = SMALLEST << ((random >> 8) % 5);
            if random >> 31 == 0 {
                if let Some(tile) = atlas.allocate(size, 3) {
                    assert_eq!(tile.size, size);
                    assert!((tile.origin + size).max_element() <= 256 && tile.page < 3);
                    assert!(tiles.iter().all(|other| !overlap(&tile, other)));
                    tiles.push(tile);
                }
            } else if !tiles.is_empty() {
                let i = (random >> 4) as usize % tiles.len();
                atlas.release(tiles.swap_remove(i));
            }
        }
        for tile in tiles {
            atlas.release(tile);
        }
        for _ in 0..atlas.pages() {
            assert_eq!(atlas.allocate(256, 3).map(|tile| tile.size), Some(256));
        }
        assert_eq!(atlas.pages(), 3);
        assert_eq!(atlas.allocate(SMALLEST, 3), None);
    }

    fn request(tiles: u32, wanted: u32, importance: f32) -> Request {
        Request {
            tiles,
            wanted,
            now: 0,
            importance,
        }
    }

    #[test]
    fn where_all_fit_all_have_what_they_want() {
        let requests = [request(6, 256, 1.0), request(1, 512, 1e-6)];
        assert_eq!(share(&requests, 6 * 256 * 256 + 512 * 512), [256, 512]);
    }

    #[test]
    fn texels_go_by_importance_and_nobody_is_left_out() {
        // Two hundred lamps in the room of eight; four of them are near.
        let near = |i: usize| if i < 4 { 100.0 } else { 1.0 };
        let requests: Vec<_> = (0..200).map(|i| request(6, 256, near(i))).collect();
        let budget = 48 * 256 * 256;
        let sizes = share(&requests, budget);
        let texels = requests.iter().zip(&sizes).map(|(r, s)| r.texels(*s));
        assert!(texels.sum::<u64>() <= budget);
        assert_eq!(sizes[..4], [256; 4]);
        assert!(sizes.iter().all(|s| *s >= 32), "{:?}", sizes.iter().min());
    }

    #[test]
    fn the_least_important_go_without_where_even_the_smallest_do_not_fit() {
        let requests: Vec<_> = (0..4).map(|i| request(1, 64, i as f32)).collect();
        assert_eq!(share(&requests, 2 * 16 * 16), [0, 0, 16, 16]);
    }

    #[test]
    fn a_small_change_of_importance_changes_no_size() {
        let requests = |importance: f32, now: [u32; 2]| {
            [(1.0, now[0]), (importance, now[1])].map(|(importance, now)| Request {
                tiles: 1,
                wanted: 256,
                now,
                importance,
            })
        };
        let budget = 256 * 256 + 128 * 128;
        let first = share(&requests(0.9, [0; 2]), budget);
        assert_eq!(first, [256, 128]);
        let [a, b] = [first[0], first[1]];
        assert_eq!(share(&requests(0.9, [a, b]), budget), first);
    }
}
