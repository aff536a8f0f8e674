//! The path tracer beside a running app: it refines on a thread of its own while nothing changes.

use std::sync::{
    Arc, Mutex,
    atomic::{AtomicBool, Ordering},
};

use bevy::prelude::*;
use bevy_gi::{
    GiView,
    prelude::{GiDebugSettings, GiSettings},
    reference::{Reference, ReferenceCamera, ReferenceScene, ReferenceSettings},
};

use crate::{headless::Picture, overlay::Overlay, reference};

/// What a picture depends on, besides the scene.
#[derive(Clone, Copy, PartialEq)]
struct Request {
    camera: ReferenceCamera,
    size: UVec2,
    view: GiView,
    settings: ReferenceSettings,
}

/// The latest picture of a request.
#[derive(Clone)]
pub struct Refined {
    /// Luminances in nits.
    pub picture: Arc<Picture>,
    /// Paths a pixel; 0 for the coarse picture that comes first.
    pub samples: u32,
}

struct Job {
    request: Request,
    stop: Arc<AtomicBool>,
    latest: Arc<Mutex<Option<Refined>>>,
}

impl Drop for Job {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// The tracer. What it is asked for it goes on refining, until asked for something else.
#[derive(Resource, Default)]
pub struct LiveReference {
    scene: Option<Arc<ReferenceScene>>,
    job: Option<Job>,
}

/// Least number of pixels between two of the picture that comes first.
const COARSE: u32 = 8;
/// Paths a pixel after which there is nothing left to see.
const ENOUGH: u32 = 1 << 14;

impl LiveReference {
    /// Traces what a camera sees, in the view and with the settings of the world, and tells what has come
    /// of it so far. The world is taken over anew if it has changed.
    pub fn trace(world: &mut World, camera: ReferenceCamera, size: UVec2) -> Option<Refined> {
        let request = Request {
            camera,
            size,
            view: world.resource::<GiDebugSettings>().view,
            settings: *world.resource::<ReferenceSettings>(),
        };
        world.resource_scope(|world, mut live: Mut<Self>| {
            live.ask(world, request);
            live.latest()
        })
    }

    fn ask(&mut self, world: &mut World, request: Request) {
        if self.job.as_ref().is_some_and(|j| j.request == request) && self.scene.is_some() {
            return;
        }
        self.job = None;
        let scene = self
            .scene
            .get_or_insert_with(|| Arc::new(ReferenceScene::new(world)))
            .clone();
        let stop = Arc::new(AtomicBool::new(false));
        let latest = Arc::new(Mutex::new(None));
        self.job = Some(Job {
            request,
            stop: stop.clone(),
            latest: latest.clone(),
        });
        std::thread::spawn(move || refine(scene, request, &stop, &latest));
    }

    /// Rests.
    pub fn stop(&mut self) {
        self.job = None;
    }

    fn latest(&self) -> Option<Refined> {
        self.job.as_ref()?.latest.lock().unwrap().clone()
    }
}

fn refine(
    scene: Arc<ReferenceScene>,
    request: Request,
    stop: &AtomicBool,
    latest: &Mutex<Option<Refined>>,
) {
    let Request {
        camera,
        size,
        view,
        settings,
    } = request;
    let publish = |reference: &Reference, samples| {
        // Views that the path tracer does not have show the picture.
        let picture = reference::picture(reference, view)
            .or_else(|_| reference::picture(reference, GiView::Full));
        if let Ok(picture) = picture {
            let picture = enlarged(picture, size);
            *latest.lock().unwrap() = Some(Refined {
                picture: Arc::new(picture),
                samples,
            });
        }
    };
    let coarse = (size / COARSE).max(UVec2::ONE);
    let mut first = Reference::new(scene.clone(), camera, coarse, settings);
    first.render(1, stop, || {});
    publish(&first, 0);
    let mut reference = Reference::new(scene, camera, size, settings);
    while reference.samples() < ENOUGH && !stop.load(Ordering::Relaxed) {
        // Ever more at a time: the picture changes ever less.
        let pass = (reference.samples() / 4).clamp(1, 16);
        reference.render(pass, stop, || {});
        if !stop.load(Ordering::Relaxed) {
            publish(&reference, reference.samples());
        }
    }
}

/// A picture with each pixel repeated.
fn enlarged(picture: Picture, size: UVec2) -> Picture {
    if picture.size == size {
        return picture;
    }
    let pixels = (0..size.element_product())
        .map(|i| {
            let at = UVec2::new(i % size.x, i / size.x) * picture.size / size;
            picture.pixels[(at.y * picture.size.x + at.x) as usize]
        })
        .collect();
    Picture { size, pixels }
}

type AnyLight = Or<(
    With<PointLight>,
    With<SpotLight>,
    With<DirectionalLight>,
    With<RectLight>,
)>;
type Moved = (
    Or<(Changed<GlobalTransform>, Changed<InheritedVisibility>)>,
    Or<(With<Mesh3d>, AnyLight)>,
    Without<MeshMaterial3d<Overlay>>,
);
type ChangedLight = Or<(
    Changed<PointLight>,
    Changed<SpotLight>,
    Changed<DirectionalLight>,
    Changed<RectLight>,
)>;

/// Lights that are gone.
type GoneLights<'w, 's> = (
    RemovedComponents<'w, 's, PointLight>,
    RemovedComponents<'w, 's, SpotLight>,
    RemovedComponents<'w, 's, DirectionalLight>,
    RemovedComponents<'w, 's, RectLight>,
);

/// Forgets the scene once anything in it has changed.
#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub fn watch_scene(
    mut live: ResMut<LiveReference>,
    settings: Res<GiSettings>,
    moved: Query<(), Moved>,
    lights: Query<(), ChangedLight>,
    mut materials: MessageReader<AssetEvent<StandardMaterial>>,
    mut meshes: MessageReader<AssetEvent<Mesh>>,
    mut gone_meshes: RemovedComponents<Mesh3d>,
    mut gone_lights: GoneLights,
) {
    // New meshes come with new entities.
    let is_modified = |event: &AssetEvent<Mesh>| matches!(event, AssetEvent::Modified { .. });
    // All of them are read: what is left unread would count in the next frame.
    let events = materials.read().count() + meshes.read().filter(|e| is_modified(e)).count();
    let changed = !moved.is_empty() || !lights.is_empty() || settings.is_changed();
    let (points, spots, suns, rects) = &mut gone_lights;
    let gone = gone_meshes.read().count()
        + points.read().count()
        + spots.read().count()
        + suns.read().count()
        + rects.read().count();
    if changed || events + gone > 0 {
        live.scene = None;
    }
}
