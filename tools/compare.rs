//! Two techniques, or a technique and the truth, in one picture: behind a line that can be dragged, side
//! by side, or as a map of errors; with figures of how far they are apart. `--help` lists the options.

use std::process::ExitCode;

use bevy::{
    camera::{Exposure, Hdr, visibility::RenderLayers},
    camera_controller::free_camera::FreeCameraPlugin,
    core_pipeline::tonemapping::Tonemapping,
    prelude::*,
    render::render_resource::TextureFormat,
    window::PrimaryWindow,
};
use bevy_gi::{GiTechniques, ViewEntry, prelude::*};
use bevy_gi_tools::{
    adapter,
    controls::{next, panel},
    headless::{image_target, readable_target},
    live::{LiveReference, watch_scene},
    meter::{Meter, MeterPlugin},
    open::{self, OpenPlugin, SceneOptions},
    options::{self, SettingsOptions, Technique, size, technique, view},
    overlay::{self, Layout, Overlay, OverlayPlugin, OverlaySettings},
    reference, window,
};
use clap::{Parser, ValueEnum};

/// Compares two techniques, or a technique with the path tracer.
#[derive(Parser, Clone, Debug)]
#[command(name = "compare", allow_negative_numbers = true)]
struct Options {
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    settings: SettingsOptions,
    /// The technique at the left: off, vct, hints, reference.
    #[arg(long, default_value = "hints", value_parser = technique)]
    left: Technique,
    /// The technique at the right, which the left is measured against.
    #[arg(long, default_value = "reference", value_parser = technique)]
    right: Technique,
    /// How the two are shown.
    #[arg(long, default_value = "wipe")]
    layout: LayoutName,
    /// What is shown; --list names all.
    #[arg(long, value_parser = view)]
    view: Option<ViewEntry>,
    /// Width x height, pixels.
    #[arg(long, default_value = "1280x720", value_parser = size)]
    size: UVec2,
    /// Lists techniques, views, scenes and settings.
    #[arg(long)]
    list: bool,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum LayoutName {
    Wipe,
    SideBySide,
    Heat,
}

/// All layouts, in the order in which a key goes through them.
const LAYOUTS: [Layout; 5] = [
    Layout::Wipe,
    Layout::SideBySide,
    Layout::Heat,
    Layout::Left,
    Layout::Right,
];

/// What is compared.
#[derive(Resource)]
struct Comparison {
    sides: [Side; 2],
    layout: Layout,
    split: f32,
    overlay: Handle<Overlay>,
    /// The pictures have become other textures.
    resized: bool,
}

/// The left or the right picture.
struct Side {
    technique: Technique,
    camera: Entity,
    /// What the camera draws into.
    live: Handle<Image>,
    /// The path tracer's latest picture.
    trace: Handle<Image>,
    /// Its paths a pixel, once there is one.
    paths: Option<u32>,
}

impl Side {
    /// What is shown of it.
    fn image(&self) -> Handle<Image> {
        match self.technique {
            Technique::Reference => self.trace.clone(),
            Technique::Gi(_) => self.live.clone(),
        }
    }

    fn label(&self) -> String {
        match (self.technique, self.paths) {
            (Technique::Reference, None) => "reference, starting".into(),
            (Technique::Reference, Some(0)) => "reference, first sketch".into(),
            (Technique::Reference, Some(paths)) => format!("reference, {paths} paths a pixel"),
            (technique, _) => technique.name().into(),
        }
    }
}

/// The camera that shows the comparison.
#[derive(Component)]
struct Screen;

#[derive(Component)]
struct Caption;

/// Layer of the comparison, which the scene's cameras do not see.
const SCREEN: usize = 1;

fn main() -> ExitCode {
    let options = Options::parse();
    if options.list {
        options::list();
        return ExitCode::SUCCESS;
    }
    match adapter::find().and_then(|_| run(options)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("compare: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: Options) -> Result<(), String> {
    let mut app = window::app("bevy_gi compare", options.size);
    app.add_plugins((GiPlugins, FreeCameraPlugin, OverlayPlugin, MeterPlugin))
        .init_resource::<LiveReference>();
    options.settings.apply(app.world_mut(), None)?;
    for side in [options.left, options.right] {
        side.check(app.world().resource::<GiTechniques>())?;
    }
    if let Some(shown) = options.view {
        app.world_mut().resource_mut::<GiDebugSettings>().view = shown.view;
    }
    app.add_plugins(OpenPlugin::new(options.scene.clone())?)
        .add_systems(Startup, move |world: &mut World| setup(world, &options))
        .add_systems(Update, (resize, keys))
        .add_systems(Last, (watch_scene, trace, show, caption).chain());
    app.run();
    Ok(())
}

fn setup(world: &mut World, options: &Options) {
    let trace = world
        .resource_mut::<Assets<Image>>()
        .add(target(options.size));
    let sides = [options.left, options.right].map(|technique| {
        let live = world
            .resource_mut::<Assets<Image>>()
            .add(target(options.size));
        let camera = world
            .spawn((open::camera(), image_target(&live), Tonemapping::None))
            .id();
        Side {
            technique,
            camera,
            live,
            trace: trace.clone(),
            paths: None,
        }
    });
    // The second camera goes where the first one flies.
    world
        .entity_mut(sides[1].camera)
        .remove::<bevy::camera_controller::free_camera::FreeCamera>();
    let overlay = world.resource_mut::<Assets<Overlay>>().add(Overlay {
        settings: OverlaySettings::default(),
        left: default(),
        right: default(),
    });
    let bundle = overlay::bundle(&mut world.resource_mut::<Assets<Mesh>>(), overlay.clone());
    world.spawn((bundle, RenderLayers::layer(SCREEN)));
    world.spawn((
        Screen,
        Camera3d::default(),
        Camera {
            order: 10,
            ..default()
        },
        IsDefaultUiCamera,
        Hdr,
        Msaa::Off,
        RenderLayers::layer(SCREEN),
    ));
    world.spawn((Caption, panel()));
    world.insert_resource(Comparison {
        sides,
        layout: match options.layout {
            LayoutName::Wipe => Layout::Wipe,
            LayoutName::SideBySide => Layout::SideBySide,
            LayoutName::Heat => Layout::Heat,
        },
        split: 0.5,
        overlay,
        resized: false,
    });
}

/// A camera's target: luminances times its exposure, in half precision.
fn target(size: UVec2) -> Image {
    readable_target(size, TextureFormat::Rgba16Float)
}

/// Targets are as large as the window.
fn resize(
    window: Single<&Window, (With<PrimaryWindow>, Changed<Window>)>,
    mut comparison: ResMut<Comparison>,
    mut images: ResMut<Assets<Image>>,
) {
    let size = window.physical_size().max(UVec2::ONE);
    let [left, right] = &comparison.sides;
    let mut resized = false;
    for image in [&left.live, &right.live, &left.trace] {
        if images.get(image).is_some_and(|i| i.size() != size) {
            let _ = images.insert(image, target(size));
            resized = true;
        }
    }
    comparison.resized |= resized;
}

fn keys(
    keys: Res<ButtonInput<KeyCode>>,
    mouse: Res<ButtonInput<MouseButton>>,
    window: Single<&Window, With<PrimaryWindow>>,
    mut comparison: ResMut<Comparison>,
    techniques: Res<GiTechniques>,
    mut debug: ResMut<GiDebugSettings>,
    mut caption: Single<&mut Visibility, With<Caption>>,
) {
    for (key, side) in [(KeyCode::Digit1, 0), (KeyCode::Digit2, 1)] {
        if keys.just_pressed(key) {
            let all = Technique::all(&techniques);
            let side = &mut comparison.sides[side];
            side.technique = next(&all, side.technique);
            side.paths = None;
        }
    }
    if keys.just_pressed(KeyCode::KeyC) {
        comparison.layout = next(&LAYOUTS, comparison.layout);
    }
    if keys.just_pressed(KeyCode::KeyV) {
        debug.view = next(&GiView::ALL, debug.view);
    }
    if keys.just_pressed(KeyCode::KeyH) {
        caption.toggle_visible_hidden();
    }
    if mouse.pressed(MouseButton::Left)
        && let Some(at) = window.cursor_position()
    {
        comparison.split = (at.x / window.width()).clamp(0.0, 1.0);
    }
}

/// Cameras go together; what is path-traced needs none.
fn trace(world: &mut World) {
    world.resource_scope(|world, mut comparison: Mut<Comparison>| {
        let first = comparison.sides[0].camera;
        let place = (
            world.get::<Transform>(first).copied(),
            world.get::<Projection>(first).cloned(),
            world.get::<Exposure>(first).copied(),
        );
        if let (Some(transform), Some(projection), Some(exposure)) = place {
            let mut second = world.entity_mut(comparison.sides[1].camera);
            if second.get::<Transform>() != Some(&transform) {
                second.insert((transform, projection, exposure));
            }
        }
        for (order, side) in comparison.sides.iter().enumerate() {
            let technique = match side.technique {
                Technique::Gi(technique) => technique,
                Technique::Reference => GiTechnique::OFF,
            };
            // Only what changes is written: a changed camera costs a frame.
            let mut camera = world.entity_mut(side.camera);
            if let Some(mut gi) = camera.get_mut::<GiCamera>() {
                gi.set_if_neq(GiCamera::with_technique(technique));
            }
            if let Some(mut camera) = camera.get_mut::<Camera>() {
                let wanted = (side.technique != Technique::Reference, order as isize);
                if (camera.is_active, camera.order) != wanted {
                    (camera.is_active, camera.order) = wanted;
                }
            }
        }
        let traced = |side: &Side| side.technique == Technique::Reference;
        if !comparison.sides.iter().any(traced) {
            world.resource_mut::<LiveReference>().stop();
            return;
        }
        let size = world
            .resource::<Assets<Image>>()
            .get(&comparison.sides[0].live)
            .map_or(UVec2::ONE, Image::size);
        let place = (
            world.get::<GlobalTransform>(first),
            world.get::<Projection>(first),
        );
        let (Some(transform), Some(projection)) = place else {
            return;
        };
        let camera = reference::camera(transform, projection, size);
        let Some(latest) = LiveReference::trace(world, camera, size) else {
            return;
        };
        let is_new = |side: &Side| side.paths != Some(latest.samples) || latest.samples == 0;
        if comparison
            .sides
            .iter()
            .filter(|side| traced(side))
            .any(is_new)
        {
            // Into the same texture, as long as the size stays.
            let image = overlay::texture(&latest.picture);
            let mut images = world.resource_mut::<Assets<Image>>();
            let _ = images.insert(&comparison.sides[0].trace, image);
        }
        world.resource_mut::<Meter>().truth = (latest.samples > 0).then_some(latest.picture);
        for side in comparison.sides.iter_mut().filter(|side| traced(side)) {
            side.paths = Some(latest.samples);
        }
    });
}

/// Shows both sides, and tells the meter what to measure.
fn show(
    mut comparison: ResMut<Comparison>,
    (debug, views): (Res<GiDebugSettings>, Res<GiViews>),
    exposures: Query<&Exposure>,
    mut overlays: ResMut<Assets<Overlay>>,
    mut screen: Single<&mut Tonemapping, With<Screen>>,
    mut meter: ResMut<Meter>,
) {
    let is_luminance = views.get(debug.view).is_luminance;
    let exposure = exposures.get(comparison.sides[0].camera);
    let exposure = exposure.copied().unwrap_or_default().exposure();
    // Factors from the sides' values to those of the screen: cameras have exposed theirs.
    let scale = [0, 1].map(|i| match comparison.sides[i].technique {
        Technique::Reference if is_luminance => exposure,
        _ => 1.0,
    });
    meter.sides = [0, 1].map(|i| comparison.sides[i].image());
    meter.traced = [0, 1].map(|i| comparison.sides[i].technique == Technique::Reference);
    meter.scale = scale;
    let wanted = Overlay {
        settings: OverlaySettings {
            scale: Vec2::from_array(scale),
            split: comparison.split,
            mode: comparison.layout as u32,
        },
        left: comparison.sides[0].image(),
        right: comparison.sides[1].image(),
    };
    let resized = std::mem::take(&mut comparison.resized);
    let shown = overlays.get(&comparison.overlay);
    if (resized || shown != Some(&wanted))
        && let Some(mut overlay) = overlays.get_mut(&comparison.overlay)
    {
        *overlay = wanted;
    }
    let wanted = match (comparison.layout, is_luminance) {
        (Layout::Heat, _) | (_, false) => Tonemapping::None,
        _ => Tonemapping::TonyMcMapface,
    };
    if **screen != wanted {
        **screen = wanted;
    }
}

fn caption(
    comparison: Res<Comparison>,
    debug: Res<GiDebugSettings>,
    meter: Res<Meter>,
    time: Res<Time>,
    mut text: Single<&mut Text, With<Caption>>,
) {
    let [left, right] = [0, 1].map(|i| comparison.sides[i].label());
    let layout = match comparison.layout {
        Layout::Left => "left only",
        Layout::Wipe => "wipe",
        Layout::SideBySide => "side by side",
        Layout::Heat => "error of the left: blue too dark, red too bright",
        Layout::Right => "right only",
    };
    text.0 = format!(
        "left: {left}   right: {right}   {layout}   view: {}   {:.0} ms\n{}\n\
         1, 2: technique at the left, right   C: layout   V: view   H: this help\n\
         left mouse button: drag the line   WASD, E, Q: fly   right mouse button: look",
        debug.view.name(),
        time.delta_secs() * 1000.0,
        meter.text(),
    );
}
