//! Which maps there are, where in the atlas each lies, and which are drawn in a frame.

use std::collections::HashMap;

use bevy::{ecs::prelude::*, math::Mat4, render::render_resource::PipelineCache};

use super::{
    atlas::{self, Atlas, Request, Tile},
    views::{LightView, LitScene},
};
use crate::{
    scene::{
        needs::SceneNeeds,
        views::{CaptureKind, CaptureQueue, CaptureViews, WantedView},
        world::lights::{GpuLight, SceneLight},
    },
    settings::GiCaptureSettings,
};

/// Layers that every adapter's texture arrays may have (WebGPU's `maxTextureArrayLayers`).
const MAX_PAGES: u32 = 256;

/// As many as a virtual point light can name (`pack_vpl_normal` in `types.wgsl`).
const MAX_MAPS: usize = (1 << 12) - 1;

/// New maps that are drawn in a frame, besides the most important light's: all of those of an ordinary scene.
const NEW_A_FRAME: usize = 48;

/// Maps of depth alone that are drawn again in the time of one with surfaces: no material is shaded, and nothing is
/// resolved and summed up.
const DEPTH_UPDATES: u32 = 4;

/// Most times that the side of a map may be halved for its surfaces: those of the smallest tile are a texel then.
const MAX_REDUCTION: u32 = atlas::SMALLEST.ilog2();

/// Frames for which the view of a map stays after it was drawn: what is prepared late is noticed there.
const LINGER: u32 = 3;

/// One map.
#[derive(Debug)]
pub(crate) struct LightMap {
    pub light: Entity,
    /// Of the light, in [`SceneLights`](super::lights::SceneLights).
    pub number: u32,
    /// The light as it is now.
    pub now: GpuLight,
    /// What the light looks at.
    pub view: LightView,
    /// Texels along the side that it should have; 0: it has no room.
    pub size: u32,
    /// Where it is.
    pub tile: Option<Tile>,
    /// What the tile shows.
    pub drawn: Option<Drawn>,
    /// Whether a mesh has come into view or left it since.
    in_doubt: bool,
    /// Whether it was drawn before all pipelines were compiled.
    incomplete: bool,
    /// Whether a mesh was missing then, as its assets were.
    waits: bool,
    /// Frames since it was last drawn.
    age: u32,
    importance: f32,
    /// Whether it is drawn in this frame.
    pub draw_now: bool,
}

/// Everything whose change makes a map wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Drawn {
    /// Without its colour, which is in no map.
    pub light: GpuLight,
    pub clip_from_view: Mat4,
    pub clip_from_world: Mat4,
    content: u64,
    /// Whether surfaces were drawn, and not depth alone.
    pub surfaces: bool,
}

impl Drawn {
    /// Whether it is as good as what is wanted.
    fn serves(&self, wanted: &Self) -> bool {
        let surfaces = self.surfaces || !wanted.surfaces;
        surfaces
            && *self
                == Self {
                    surfaces: self.surfaces,
                    ..*wanted
                }
    }
}

impl LightMap {
    fn new(light: &SceneLight, view: LightView) -> Self {
        Self {
            light: light.entity,
            number: 0,
            now: light.gpu,
            view,
            size: 0,
            tile: None,
            drawn: None,
            in_doubt: false,
            incomplete: false,
            waits: false,
            age: u32::MAX,
            importance: 0.0,
            draw_now: false,
        }
    }

    fn wanted(&self, surfaces: bool) -> Drawn {
        Drawn {
            surfaces,
            light: self.now.without_color(),
            clip_from_view: self.view.view.clip_from_view,
            clip_from_world: self.view.clip_from_world,
            content: self.view.content,
        }
    }

    /// What the tile shows once this frame's maps are drawn, and where; `None` until it is drawn at all.
    pub fn shown(&self) -> Option<(Drawn, Tile)> {
        Some((self.drawn?, self.tile?))
    }

    /// What is drawn, if it has what is asked for at all.
    fn drawn_with(&self, surfaces: bool) -> Option<Drawn> {
        self.drawn.filter(|drawn| drawn.surfaces || !surfaces)
    }

    /// Whether what is drawn is what is wanted, in however many texels.
    fn shows(&self, wanted: &Drawn) -> bool {
        let lacking = self.in_doubt || self.incomplete;
        self.drawn.is_some_and(|drawn| drawn.serves(wanted)) && !lacking
    }

    /// Whether its view is needed in this frame.
    fn looks(&self) -> bool {
        self.draw_now
            || self.tile.is_some() && (self.age <= LINGER || self.incomplete || self.waits)
    }
}

/// What the settings and those who read the maps ask for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Limits {
    /// Whether surfaces are drawn, and not depth alone.
    pub surfaces: bool,
    /// How often the side of a map is halved for its surfaces. Not 0 only where both are read, and depth is to be
    /// finer.
    pub reduction: u32,
    /// Texels along the side of the maps of lights that say nothing themselves.
    size: u32,
    /// Maps of `size` for which there is memory.
    maps: u32,
    /// Maps that are drawn again in a frame at most.
    updates: u32,
    /// Whether what is drawn stays as it is.
    frozen: bool,
}

impl Limits {
    pub fn new(settings: &GiCaptureSettings, needs: &SceneNeeds) -> Self {
        let (depth, surfaces) = (settings.shadow_map_size, settings.rsm_size);
        let [depth, surfaces] = [depth, surfaces].map(u32::next_power_of_two);
        let reduction = match (needs.shadows, needs.rsm) {
            (true, true) => (depth / surfaces).max(1).ilog2().min(MAX_REDUCTION),
            _ => 0,
        };
        Self {
            surfaces: needs.rsm,
            reduction,
            size: if needs.rsm {
                surfaces << reduction
            } else {
                depth
            },
            maps: settings.max_shadow_maps,
            updates: settings.rsm_updates * if needs.rsm { 1 } else { DEPTH_UPDATES },
            frozen: settings.freeze,
        }
    }

    /// Texels along the side of a light's maps.
    fn size_of(&self, light: &SceneLight) -> u32 {
        let own = light.rsm_size.filter(|_| self.surfaces);
        let own = own.map(|size| size.next_power_of_two() << self.reduction);
        own.unwrap_or(self.size).max(atlas::SMALLEST)
    }

    /// Whether a light has maps.
    fn wants(&self, light: &SceneLight) -> bool {
        self.surfaces || light.shadows
    }
}

/// All maps.
#[derive(Default)]
pub(crate) struct LightMaps {
    /// Those of a light follow each other, in the order of its views.
    pub maps: Vec<LightMap>,
    pub atlas: Atlas,
    /// Grows whenever all tiles have changed place, and nothing is drawn any more.
    pub layout: u64,
    /// Whether a map that is drawn in this frame shows something else than before, and not only in more or fewer texels.
    pub changes: bool,
    /// First map by number of the light, or -1.
    first: Vec<i32>,
    /// Lights that go without, for lack of memory,
    without: usize,
    /// and for lack of numbers.
    nameless: usize,
    /// What the maps were made of.
    seen: Option<Seen>,
}

/// What decides which maps there are.
struct Seen {
    /// [`LitScene::content`].
    scene: u64,
    lights: Vec<SceneLight>,
    surfaces: bool,
}

impl LightMaps {
    /// First map of a light by its number, or -1 if nothing casts shadows in its light.
    pub fn first_shadow(&self, number: usize) -> i32 {
        let first = self.first.get(number).copied().unwrap_or(-1);
        let map = usize::try_from(first).ok().and_then(|i| self.maps.get(i));
        map.filter(|map| map.view.blocks).map_or(-1, |_| first)
    }

    /// Lights that go without, for lack of room.
    pub fn without(&self) -> usize {
        self.without + self.nameless
    }

    /// Nobody looks.
    pub fn clear(&mut self) {
        *self = Self {
            layout: self.layout + 1,
            ..Default::default()
        };
    }

    /// The maps of a frame: which there are, how large, and which of them are drawn. Returns the views that
    /// this needs.
    pub fn update(
        &mut self,
        scene: &LitScene,
        lights: &[SceneLight],
        limits: &Limits,
    ) -> Vec<WantedView> {
        let seen = self.seen.as_ref();
        let same_scene =
            seen.is_some_and(|s| (s.scene, s.surfaces) == (scene.content, limits.surfaces));
        if !same_scene || seen.is_some_and(|seen| seen.lights != lights) {
            self.look_around(scene, same_scene, lights, limits);
            self.seen = Some(Seen {
                scene: scene.content,
                lights: lights.to_vec(),
                surfaces: limits.surfaces,
            });
        }
        for map in &mut self.maps {
            map.age = map.age.saturating_add(1);
            map.draw_now = false;
        }
        self.share(scene, lights, limits);
        self.choose(lights, limits);
        let looking = self.maps.iter().filter(|map| map.looks());
        let wanted = looking.filter_map(|map| Some(map.view.wanted(map.light, map.tile?.size)));
        wanted.collect()
    }

    /// Maps that are drawn in this frame: their number, and where.
    pub fn drawn_now(&self) -> impl Iterator<Item = (usize, &LightMap, Tile)> {
        let drawn = self.maps.iter().enumerate();
        drawn.filter_map(|(i, map)| Some((i, map, map.tile.filter(|_| map.draw_now)?)))
    }

    /// The memory of surfaces is gone: what was drawn before this frame has none any more.
    pub fn forget_surfaces(&mut self) {
        let before = self.maps.iter_mut().filter(|map| !map.draw_now);
        for drawn in before.filter_map(|map| map.drawn.as_mut()) {
            drawn.surfaces = false;
        }
    }

    /// Makes the maps those that the lights want, and keeps what is known of them.
    fn look_around(
        &mut self,
        scene: &LitScene,
        same_scene: bool,
        lights: &[SceneLight],
        limits: &Limits,
    ) {
        let lights_before = self.seen.take().map_or(Vec::new(), |seen| seen.lights);
        let mut old = HashMap::<Entity, Vec<LightMap>>::new();
        for map in self.maps.drain(..) {
            old.entry(map.light).or_default().push(map);
        }
        self.first.clear();
        self.nameless = 0;
        for (number, light) in lights.iter().enumerate() {
            let first = self.maps.len();
            let mut before = old.remove(&light.entity).unwrap_or_default();
            let stays = |map: &LightMap| {
                let layers = lights_before.get(map.number as usize).map(|l| &l.layers);
                map.now.without_color() == light.gpu.without_color()
                    && layers == Some(&light.layers)
            };
            if limits.wants(light) && same_scene && before.first().is_some_and(stays) {
                self.maps.append(&mut before);
            } else if limits.wants(light) {
                let views = scene.views(light);
                let room = self.maps.len() + views.len() <= MAX_MAPS;
                self.nameless += usize::from(!room);
                for view in views.into_iter().filter(|_| room) {
                    let known = before.iter().position(|map| map.view.face == view.face);
                    let map = match known.map(|i| before.swap_remove(i)) {
                        Some(map) => LightMap { view, ..map },
                        None => LightMap::new(light, view),
                    };
                    self.maps.push(map);
                }
            }
            old.insert(light.entity, before);
            for map in &mut self.maps[first..] {
                map.number = number as u32;
                map.now = light.gpu;
            }
            self.first.push(match self.maps.len() > first {
                true => first as i32,
                false => -1,
            });
        }
        for tile in old.into_values().flatten().filter_map(|map| map.tile) {
            self.atlas.release(tile);
        }
    }

    /// How large each tile should be.
    fn share(&mut self, scene: &LitScene, lights: &[SceneLight], limits: &Limits) {
        let own_size = |light: &SceneLight| limits.size_of(light);
        let largest = self
            .maps
            .iter()
            .map(|map| own_size(&lights[map.number as usize]));
        let side = largest.max().unwrap_or(atlas::SMALLEST);
        let texels: u64 = self
            .maps
            .iter()
            .filter_map(|map| map.tile)
            .map(|t| u64::from(t.size).pow(2))
            .sum();
        let pages = u64::from(self.atlas.pages());
        // Most of the pages are empty: the memory is given back.
        let sparse = pages > 4 && 4 * texels < pages * u64::from(side).pow(2) && texels > 0;
        if side != self.atlas.side() || sparse {
            self.start_anew(side);
        }
        for map in &mut self.maps {
            map.importance = scene.importance(&lights[map.number as usize], map.view.face);
        }
        // The faces of a cube are as large as each other; the maps of a sun are not.
        let mut groups: Vec<std::ops::Range<usize>> = Vec::new();
        for i in 0..self.maps.len() {
            let (map, before) = (&self.maps[i], i.checked_sub(1).map(|b| &self.maps[b]));
            let same = before.is_some_and(|b| b.light == map.light) && !map.now.is_directional();
            match groups.last_mut().filter(|_| same) {
                Some(group) => group.end = i + 1,
                None => groups.push(i..i + 1),
            }
        }
        let requests: Vec<_> = groups
            .iter()
            .map(|group| {
                let map = &self.maps[group.start];
                Request {
                    tiles: group.len() as u32,
                    wanted: own_size(&lights[map.number as usize]),
                    now: map.tile.map_or(0, |tile| tile.size),
                    importance: map.importance,
                }
            })
            .collect();
        let sizes = atlas::share(&requests, budget(side, limits));
        self.without = sizes.iter().filter(|size| **size == 0).count();
        for (group, size) in groups.into_iter().zip(sizes) {
            for map in &mut self.maps[group] {
                map.size = size;
                if size == 0 {
                    map.drawn = None;
                    map.tile
                        .take()
                        .into_iter()
                        .for_each(|tile| self.atlas.release(tile));
                }
            }
        }
    }

    /// Which maps are drawn in this frame, and where.
    fn choose(&mut self, lights: &[SceneLight], limits: &Limits) {
        let surfaces = limits.surfaces;
        self.changes = false;
        let mut stale: Vec<usize> = (0..self.maps.len())
            .filter(|i| {
                let map = &self.maps[*i];
                let interval = lights[map.number as usize].rsm_interval;
                match map.drawn_with(surfaces) {
                    _ if map.size == 0 => false,
                    None => true,
                    // What was missing has come, or may have.
                    Some(_) if map.incomplete || (map.waits && map.in_doubt) => true,
                    Some(_) if limits.frozen || map.age < interval => false,
                    Some(_) => {
                        let resized = map.tile.is_none_or(|tile| tile.size != map.size);
                        !map.shows(&map.wanted(surfaces)) || resized
                    }
                }
            })
            .collect();
        let maps = &self.maps;
        let is_new = |map: &LightMap| map.drawn_with(surfaces).is_none();
        // The longest waiting first; what has never been drawn before all others, as nothing stands in for it.
        stale.sort_by(|a, b| {
            let (a, b) = (&maps[*a], &maps[*b]);
            (is_new(b).cmp(&is_new(a)))
                .then(b.age.cmp(&a.age))
                .then(b.importance.total_cmp(&a.importance))
        });
        let new = stale.iter().filter(|i| is_new(&maps[**i])).count();
        stale.truncate((limits.updates as usize).max(new.min(NEW_A_FRAME)));
        let pages = most_pages(self.atlas.side(), limits);
        let mut crowded = false;
        for i in stale {
            let map = &mut self.maps[i];
            if map.tile.is_none_or(|tile| tile.size != map.size) {
                match (self.atlas.allocate(map.size, pages), map.tile) {
                    (Some(new), old) => {
                        map.tile = Some(new);
                        old.into_iter().for_each(|old| self.atlas.release(old));
                    }
                    // As large as before, until there is room.
                    (None, Some(_)) => {}
                    (None, None) => {
                        crowded = true;
                        continue;
                    }
                }
            }
            self.changes |= !map.shows(&map.wanted(surfaces));
            map.draw_now = true;
            map.age = 0;
            map.drawn = Some(map.wanted(surfaces));
            map.in_doubt = false;
        }
        // There are texels enough, but not in one place, or maps that are to shrink still have them.
        let shrinking = |map: &LightMap| map.tile.is_some_and(|tile| tile.size > map.size);
        if crowded && !self.maps.iter().any(shrinking) {
            self.start_anew(self.atlas.side());
        }
    }

    fn start_anew(&mut self, side: u32) {
        self.atlas = Atlas::new(side);
        self.layout += 1;
        for map in &mut self.maps {
            map.tile = None;
            map.drawn = None;
            map.draw_now = false;
            map.age = u32::MAX;
        }
    }

    /// Once meshes are queued: has this frame's maps drawn by `queue`, and notes what is still missing in them. `ready`:
    /// whether all that draws them is compiled. Returns their number.
    pub fn finish<K: CaptureKind>(
        &mut self,
        views: &CaptureViews<K>,
        cache: &PipelineCache,
        ready: bool,
        queue: &mut CaptureQueue,
    ) -> usize {
        let ready = ready && views.ready(cache);
        let mut drawn = 0;
        for map in &mut self.maps {
            let face = map.view.face;
            if !map.draw_now {
                map.in_doubt |= views.changed(map.light, face);
                continue;
            }
            drawn += 1;
            map.incomplete = !ready;
            map.waits = views.waits(map.light, face);
            queue.0.extend(views.get(map.light, face));
        }
        drawn
    }
}

/// Texels that all tiles together may have.
fn budget(side: u32, limits: &Limits) -> u64 {
    let texels = u64::from(limits.maps) * u64::from(limits.size) * u64::from(limits.size);
    texels.min(u64::from(MAX_PAGES) * u64::from(side) * u64::from(side))
}

/// Pages for the budget, and one in which tiles can be exchanged.
fn most_pages(side: u32, limits: &Limits) -> u32 {
    let page = u64::from(side) * u64::from(side);
    (budget(side, limits).div_ceil(page) as u32 + 1).min(MAX_PAGES)
}

#[cfg(test)]
mod tests {
    use bevy::{
        camera::visibility::RenderLayers,
        math::{Vec3, bounding::Aabb3d},
    };

    use super::*;
    use crate::scene::world::{casters::Caster, lights::LightKind};

    const LIMITS: Limits = Limits {
        surfaces: true,
        reduction: 0,
        size: 64,
        maps: 48,
        updates: 4,
        frozen: false,
    };

    fn entity(number: u32) -> Entity {
        Entity::from_raw_u32(number).unwrap()
    }

    /// A lamp that reaches 5 metres.
    fn lamp(number: u32, x: f32) -> SceneLight {
        SceneLight {
            entity: entity(number),
            layers: RenderLayers::default(),
            gpu: GpuLight {
                position: Vec3::new(x, 0.0, 0.0),
                kind: LightKind::Point as u32,
                color: Vec3::ONE,
                range: 5.0,
                near: 0.1,
                shadow: -1,
                ..Default::default()
            },
            shadows: true,
            rsm_size: None,
            rsm_interval: 1,
        }
    }

    /// A small box, as it was when `changed` was the version of the scene.
    fn caster(number: u32, x: f32, changed: u64) -> Caster {
        Caster {
            entity: entity(number),
            bounds: Aabb3d::new(Vec3::new(x, 0.0, 0.0), Vec3::splat(0.2)),
            shadow: true,
            layers: RenderLayers::default(),
            changed,
        }
    }

    /// A scene of two lamps, three metres apart, with a box between them and one far away.
    struct Scene {
        lights: Vec<SceneLight>,
        casters: [Caster; 2],
        limits: Limits,
        maps: LightMaps,
    }

    impl Scene {
        /// All maps are drawn.
        fn new() -> Self {
            let mut scene = Self {
                lights: vec![lamp(1, -1.5), lamp(2, 1.5)],
                casters: [caster(10, 0.0, 1), caster(11, 9.0, 1)],
                limits: LIMITS,
                maps: LightMaps::default(),
            };
            assert_eq!(scene.frame(), [6, 6], "new maps have no budget");
            assert_eq!(scene.frame(), [0, 0], "nothing has changed");
            scene
        }

        /// Maps of each light that a frame draws.
        fn frame(&mut self) -> Vec<usize> {
            let volume = (entity(20), Aabb3d::new(Vec3::ZERO, Vec3::splat(8.0)));
            let lit = self.limits.surfaces;
            let scene = LitScene::of(volume, &self.casters, lit);
            self.maps.update(&scene, &self.lights, &self.limits);
            let drawn: Vec<_> = self.maps.drawn_now().map(|(_, map, _)| map.light).collect();
            let of = |light: &SceneLight| drawn.iter().filter(|d| **d == light.entity).count();
            self.lights.iter().map(of).collect()
        }
    }

    #[test]
    fn what_changes_decides_which_maps_are_drawn() {
        type Change = fn(&mut Scene);
        let cases: [(&str, Change, &[usize]); 9] = [
            ("a colour", |s| s.lights[0].gpu.color *= 2.0, &[0, 0]),
            (
                "what two of twelve faces see",
                |s| s.casters[0].changed = 2,
                &[1, 1],
            ),
            (
                "what no lamp reaches",
                |s| s.casters[1].changed = 2,
                &[0, 0],
            ),
            ("a lamp", |s| s.lights[0] = lamp(1, -1.4), &[4, 0]),
            (
                "a lamp that comes first",
                |s| s.lights.insert(0, lamp(0, 0.5)),
                &[6, 0, 0],
            ),
            ("a lamp that goes", |s| _ = s.lights.remove(0), &[0]),
            (
                "nobody reads surfaces",
                |s| s.limits.surfaces = false,
                &[0, 0],
            ),
            ("larger maps", |s| s.limits.size = 128, &[6, 6]),
            (
                "all, but nothing may be drawn",
                |s| {
                    s.limits.frozen = true;
                    s.casters[0].changed = 2;
                },
                &[0, 0],
            ),
        ];
        for (what, change, drawn) in cases {
            let mut scene = Scene::new();
            change(&mut scene);
            assert_eq!(scene.frame(), drawn, "{what}");
        }
    }

    #[test]
    fn a_map_of_another_size_shows_the_same() {
        let mut scene = Scene::new();
        scene.limits.maps = 3;
        assert!(scene.frame().iter().sum::<usize>() > 0 && !scene.maps.changes);
        scene.casters[0].changed = 2;
        assert!(scene.frame().iter().sum::<usize>() > 0 && scene.maps.changes);
    }

    #[test]
    fn maps_wait_for_their_turn_within_the_budget() {
        let mut scene = Scene::new();
        scene.lights = vec![lamp(1, -1.4), lamp(2, 1.4)];
        let frames: Vec<usize> = (0..5).map(|_| scene.frame().iter().sum()).collect();
        assert_eq!(frames, [4, 4, 4, 0, 0]);
        // Depth alone costs a quarter.
        let settings = GiCaptureSettings::default();
        let updates = |rsm| {
            let needs = SceneNeeds {
                shadows: true,
                rsm,
                ..Default::default()
            };
            Limits::new(&settings, &needs).updates
        };
        assert_eq!(updates(false), DEPTH_UPDATES * updates(true));
    }

    #[test]
    fn surfaces_that_are_asked_for_are_drawn_as_new_maps_are() {
        let mut scene = Scene::new();
        scene.limits.surfaces = false;
        scene.frame();
        scene.maps.forget_surfaces();
        scene.limits.frozen = true;
        assert_eq!(scene.frame(), [0, 0], "depth is there");
        scene.limits.surfaces = true;
        assert_eq!(scene.frame(), [6, 6]);
    }

    #[test]
    fn a_light_that_updates_rarely_waits() {
        let mut scene = Scene::new();
        scene.lights[0].rsm_interval = 4;
        let mut drawn = Vec::new();
        for frame in 0..6 {
            scene.casters[0].changed = 2 + frame;
            drawn.push(scene.frame()[0]);
        }
        // It was drawn two frames before.
        assert_eq!(drawn, [0, 0, 1, 0, 0, 0]);
    }

    #[test]
    fn depth_is_finer_than_surfaces_only_where_both_are_read() {
        let settings = GiCaptureSettings::default();
        let [depth, surfaces] = [settings.shadow_map_size, settings.rsm_size];
        let limits = |shadows, rsm| {
            let needs = SceneNeeds {
                shadows,
                rsm,
                ..Default::default()
            };
            let limits = Limits::new(&settings, &needs);
            (limits.size, limits.size >> limits.reduction)
        };
        assert_eq!(limits(true, false).0, depth);
        assert_eq!(limits(false, true), (surfaces, surfaces));
        assert_eq!(limits(true, true), (depth, surfaces));
    }
}
