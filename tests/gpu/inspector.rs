//! The real panel, drawn by the GPU into a picture, and driven by a pointer.

use bevy::{
    prelude::*,
    reflect::{
        PartialReflect, ReflectMut, ReflectRef, TypeInfo,
        enums::{DynamicEnum, VariantInfo},
    },
    render::render_resource::TextureFormat,
};
use bevy_gi::{
    GatherResolution, GiSettingsRegistry,
    inspector::{
        GiInspector, GiInspectorPlugin, Tab,
        bevy_egui::{EguiPlugin, PrimaryEguiContext, egui, input::EguiInputEvent},
        from_ron, to_ron,
    },
    prelude::*,
};

use crate::{
    common::{
        capture,
        headless::{Headless, image_target},
        scenes::cornell,
    },
    shared::{Pool, SharedApp},
    support::{CONES, assert_sane, spawn_coarse_cornell},
};

/// The Cornell box with a panel before it.
fn open(size: UVec2) -> (SharedApp, Entity, Handle<Image>) {
    static APPS: Pool = Pool::new(|| {
        Headless::new(|app| {
            app.add_plugins((
                GiPlugins,
                EguiPlugin::default(),
                GiInspectorPlugin {
                    open: true,
                    ..default()
                },
            ))
            .insert_resource(GlobalAmbientLight::NONE);
        })
    });
    let mut headless = APPS.take();
    headless.app.insert_resource(GiSettings {
        technique: CONES,
        sky: GiSky::Black,
        ..default()
    });
    let mut inspector = GiInspector::default();
    inspector.open = true;
    headless.app.insert_resource(inspector);
    let target = headless.target(size, TextureFormat::Rgba8UnormSrgb);
    // Few voxels and probes: the panel is what is looked at.
    spawn_coarse_cornell(&mut headless, 48, 8);
    let world = headless.app.world_mut();
    let view = cornell::view();
    let camera = world
        .spawn((
            Camera3d::default(),
            GiCamera::default(),
            image_target(&target),
            bevy::camera::Exposure { ev100: view.ev100 },
            Projection::from(PerspectiveProjection {
                fov: view.fov.to_radians(),
                ..default()
            }),
            Transform::from_translation(view.eye).looking_at(view.look, Vec3::Y),
        ))
        .id();
    headless.step();
    // Egui makes the first camera of an app the primary one; this may be a later one.
    let world = headless.app.world_mut();
    if !world.entity(camera).contains::<PrimaryEguiContext>() {
        world.entity_mut(camera).insert(PrimaryEguiContext);
    }
    assert!(headless.wait_until(|_| true));
    (headless, camera, target)
}

fn point_at(headless: &mut Headless, at: egui::Pos2, pressed: Option<bool>) {
    let world = headless.app.world_mut();
    let mut contexts = world.query_filtered::<Entity, With<PrimaryEguiContext>>();
    // Whoever clicks everywhere may have removed the camera.
    let Ok(context) = contexts.single(world) else {
        return;
    };
    let event = match pressed {
        None => egui::Event::PointerMoved(at),
        Some(pressed) => egui::Event::PointerButton {
            pos: at,
            button: egui::PointerButton::Primary,
            pressed,
            modifiers: egui::Modifiers::NONE,
        },
    };
    world.write_message(EguiInputEvent { context, event });
}

/// Moves, presses and releases within a frame, and draws what comes of it in the next.
fn click(headless: &mut Headless, at: egui::Pos2) {
    for pressed in [None, Some(true), Some(false)] {
        point_at(headless, at, pressed);
    }
    headless.steps(2);
}

/// Every tab is drawn, and looks as in the README: the pictures are in `out/inspector`.
#[test]
fn the_panel_is_drawn_and_answers_to_clicks() {
    let (mut headless, camera, target) = open(UVec2::new(960, 640));
    let world = headless.app.world_mut();
    world.get_mut::<GiCamera>(camera).unwrap().resolution = GatherResolution::Quarter;
    let mut pictures = Vec::new();
    // Buttons of the tabs are in a row at the top; what is clicked is what is shown.
    let mut x = 30.0;
    for tab in Tab::ALL {
        while headless.app.world().resource::<GiInspector>().tab != tab {
            click(&mut headless, egui::pos2(x, 18.0));
            x += 25.0;
            assert!(x < 400.0, "no button of {tab:?} was hit");
        }
        if tab == Tab::Scene {
            let world = headless.app.world_mut();
            let mut volumes = world.query_filtered::<Entity, With<GiVolume>>();
            let volume = volumes.single(world).ok();
            world.resource_mut::<GiInspector>().selected = volume;
        }
        // What it costs is drawn over time.
        headless.steps(if tab == Tab::Cost { 30 } else { 8 });
        let picture = headless.picture(&target);
        let name = format!("out/inspector/{}.png", tab.name().to_lowercase());
        capture::write(&picture, name.as_ref()).expect("pictures can be written");
        // The panel covers the left third, and the box is beside it.
        let at = |x: u32, y: u32| picture.pixels[(y * picture.size.x + x) as usize];
        let plain = (0..100).all(|i| at(20 + 3 * i, 300) == at(20, 300));
        assert!(!plain, "{tab:?} is empty");
        pictures.push(picture);
    }
    let differs = |a: usize, b: usize| pictures[a].pixels != pictures[b].pixels;
    assert!(differs(0, 1) && differs(1, 2) && differs(2, 3));
    assert_eq!(headless.pipeline_errors(), Vec::<String>::new());

    // Closed, there is nothing of it left in the picture.
    headless.app.world_mut().resource_mut::<GiInspector>().open = false;
    headless.steps(4);
    let picture = headless.picture(&target);
    let at = |x: u32, y: u32| Vec4::from_array(picture.pixels[(y * picture.size.x + x) as usize]);
    // The box is in the middle: the background is left and right of it, but for dithering.
    let same = |y: u32| (at(8, y) - at(picture.size.x - 10, y)).abs().max_element() < 0.02;
    assert!((0..picture.size.y).all(same), "the panel is still there");
}

/// Presses at a point, pulls to another, and lets go.
fn drag(headless: &mut Headless, from: Vec2, to: Vec2) {
    let mut event = |point: Vec2, pressed| {
        point_at(headless, egui::pos2(point.x, point.y), pressed);
        headless.step();
    };
    event(from, None);
    event(from, Some(true));
    for i in 1..=4 {
        event(from.lerp(to, i as f32 / 4.0), None);
    }
    event(to, Some(false));
    headless.step();
}

/// Where the camera shows a point of the world.
fn on_screen(headless: &Headless, camera: Entity, point: Vec3) -> Vec2 {
    let world = headless.app.world();
    let shown = world
        .get::<Camera>(camera)
        .zip(world.get::<GlobalTransform>(camera))
        .and_then(|(camera, place)| camera.world_to_viewport(place, point).ok());
    shown.expect("the point is before the camera")
}

/// Handles of the selected volume: its sides resize it, its arrows move it, as far as they were pulled.
#[test]
fn handles_in_the_viewport_move_and_resize_a_volume() {
    let (mut headless, camera, _) = open(UVec2::new(1000, 500));
    let world = headless.app.world_mut();
    world.resource_mut::<GiSettings>().technique = GiTechnique::OFF;
    let mut volumes = world.query_filtered::<Entity, With<GiVolume>>();
    let volume = volumes.single(world).expect("the scene has a volume");
    world.resource_mut::<GiInspector>().selected = Some(volume);
    headless.steps(4);
    let state = |headless: &Headless| {
        let world = headless.app.world();
        let place = world.get::<Transform>(volume).expect("it has a place");
        let extent = world.get::<GiVolume>(volume).expect("it is there").extent;
        (place.translation, extent)
    };

    // The upper side, up by a tenth of a metre: the lower one stays where it is.
    let (center, extent) = state(&headless);
    let top = center + 0.5 * extent * Vec3::Y;
    let from = on_screen(&headless, camera, top);
    let to = on_screen(&headless, camera, top + 0.1 * Vec3::Y);
    drag(&mut headless, from, to);
    let (moved, grown) = state(&headless);
    // A pixel is 2.4 mm here; perspective bends what is taken to be straight.
    let near = |a: Vec3, b: Vec3| (a - b).abs().max_element() < 0.02;
    assert!(near(grown, extent + 0.1 * Vec3::Y), "{extent} to {grown}");
    let bottom = |center: Vec3, extent: Vec3| center - 0.5 * extent * Vec3::Y;
    assert!(
        (bottom(moved, grown) - bottom(center, extent)).length() < 1e-4,
        "{moved}"
    );

    // The arrow to the right lies somewhere on the axis through the centre.
    let (center, extent) = state(&headless);
    let mut found = false;
    let eye = headless.app.world().get::<GlobalTransform>(camera);
    let distance = eye.expect("it is placed").translation().distance(center);
    for i in 4..17 {
        // A knob is 14 pixels wide, 0.02 of the distance.
        let tip = center + 0.015 * i as f32 * distance * Vec3::X;
        let from = on_screen(&headless, camera, tip);
        let to = on_screen(&headless, camera, tip + 0.1 * Vec3::X);
        drag(&mut headless, from, to);
        let (moved, same) = state(&headless);
        assert_eq!(same, extent);
        if moved != center {
            assert!(near(moved, center + 0.1 * Vec3::X), "{center} to {moved}");
            found = true;
            break;
        }
    }
    assert!(found, "there is no arrow");
    assert_eq!(headless.pipeline_errors(), Vec::<String>::new());
}

#[test]
fn settings_survive_a_file() {
    let (mut headless, ..) = open(UVec2::splat(64));
    let world = headless.app.world_mut();
    world.resource_mut::<GiCaptureSettings>().rsm_updates = 17;
    world.resource_mut::<VoxelConeTracingSettings>().cones = 9;
    world.resource_mut::<GiDebugSettings>().view = GiView::VoxelNormal;
    let saved = to_ron(world).expect("settings can be written");
    *world.resource_mut::<GiCaptureSettings>() = default();
    *world.resource_mut::<VoxelConeTracingSettings>() = default();
    *world.resource_mut::<GiDebugSettings>() = default();
    from_ron(world, &saved).unwrap_or_else(|error| panic!("{error} in\n{saved}"));
    assert_eq!(world.resource::<GiCaptureSettings>().rsm_updates, 17);
    assert_eq!(world.resource::<VoxelConeTracingSettings>().cones, 9);
    assert_eq!(
        world.resource::<GiDebugSettings>().view,
        GiView::VoxelNormal
    );
    // What a file does not have is left as it is, what it does not know changes nothing.
    from_ron(
        world,
        r#"{"Nothing": (), "GiCaptureSettings": (rsm_updates: 5)}"#,
    )
    .expect("a part is enough, and what other apps have is left out");
    assert_eq!(world.resource::<GiCaptureSettings>().rsm_updates, 5);
    assert_eq!(world.resource::<VoxelConeTracingSettings>().cones, 9);
    for bad in [
        "",
        "{",
        r#"{"GiSettings": (nothing: 1)}"#,
        r#"{"GiCaptureSettings": (rsm_updates: "many")}"#,
    ] {
        assert!(from_ron(world, bad).is_err(), "{bad}");
    }
    assert_eq!(world.resource::<GiCaptureSettings>().rsm_updates, 5);
}

/// A generator of numbers that are the same each time.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn float(&mut self) -> f32 {
        let plain = (self.next() % 20_001) as f32 / 100.0 - 100.0;
        match self.next() % 12 {
            0 => f32::NAN,
            1 => f32::INFINITY,
            2 => f32::NEG_INFINITY,
            3 => f32::MAX,
            4 => -0.0,
            5 => f32::MIN_POSITIVE,
            _ => plain,
        }
    }
}

/// Puts anything at all into a value.
fn randomize(value: &mut dyn PartialReflect, random: &mut Random) {
    if let Some(x) = value.try_downcast_mut::<f32>() {
        *x = random.float();
    } else if let Some(x) = value.try_downcast_mut::<u32>() {
        *x = match random.next() % 4 {
            0 => u32::MAX,
            1 => 0,
            _ => (random.next() % 300) as u32,
        };
    } else if let Some(x) = value.try_downcast_mut::<bool>() {
        *x = random.next().is_multiple_of(2);
    } else if let Some(x) = value.try_downcast_mut::<GiSky>() {
        *x = match random.next() % 3 {
            0 => GiSky::Camera,
            1 => GiSky::Black,
            _ => GiSky::Constant(LinearRgba::new(
                random.float(),
                random.float(),
                random.float(),
                random.float(),
            )),
        };
    } else if let Some(TypeInfo::Enum(info)) = value.get_represented_type_info()
        && info
            .iter()
            .all(|variant| matches!(variant, VariantInfo::Unit(_)))
    {
        let names = info.variant_names();
        let name = names[random.next() as usize % names.len()];
        value.apply(&DynamicEnum::new(name, ()));
    } else {
        match value.reflect_mut() {
            ReflectMut::Struct(fields) => {
                for i in 0..fields.field_len() {
                    randomize(fields.field_at_mut(i).unwrap(), random);
                }
            }
            ReflectMut::Enum(variant) => {
                for i in 0..variant.field_len() {
                    randomize(variant.field_at_mut(i).unwrap(), random);
                }
            }
            _ => {}
        }
    }
}

/// A component of an entity with everything in it at random; it comes where it is not yet.
fn randomize_component<
    C: Component<Mutability = bevy::ecs::component::Mutable> + Default + PartialReflect,
>(
    world: &mut World,
    entity: Entity,
    random: &mut Random,
) {
    let mut entity = world.entity_mut(entity);
    randomize(&mut *entity.entry::<C>().or_default().into_mut(), random);
}

fn type_text(headless: &mut Headless, text: &str) {
    let world = headless.app.world_mut();
    let mut contexts = world.query_filtered::<Entity, With<PrimaryEguiContext>>();
    let Ok(context) = contexts.single(world) else {
        return;
    };
    for event in [
        egui::Event::Text(text.into()),
        egui::Event::Key {
            key: egui::Key::Enter,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers: egui::Modifiers::NONE,
        },
    ] {
        world.write_message(EguiInputEvent { context, event });
    }
    headless.step();
}

/// What is only slow stays within what a test can wait for.
fn limit_work(world: &mut World) {
    let mut vct = world.resource_mut::<VoxelConeTracingSettings>();
    vct.cones = vct.cones.min(4);
    vct.bounce_cones = vct.bounce_cones.min(2);
    vct.bounces = vct.bounces.min(1);
    vct.diffuse_steps = vct.diffuse_steps.min(16);
    vct.specular_steps = vct.specular_steps.min(16);
    let mut cameras = world.query::<&mut GiCamera>();
    for mut camera in cameras.iter_mut(world) {
        camera.resolution = GatherResolution::Quarter;
    }
    let mut settings = world.resource_mut::<GiCaptureSettings>();
    settings.shadow_map_size = settings.shadow_map_size.min(128);
    settings.vpls = settings.vpls.min(256);
    let mut hints = world.resource_mut::<RadianceHintsSettings>();
    hints.samples = hints.samples.min(16);
    hints.bounces = hints.bounces.min(3);
    let mut volumes = world.query::<&mut GiVolume>();
    for mut volume in volumes.iter_mut(world) {
        volume.resolution = volume.resolution.min(32);
    }
    let mut cascades = world.query::<&mut GiCascades>();
    for mut cascades in cascades.iter_mut(world) {
        cascades.levels = cascades.levels.min(2);
        cascades.resolution = cascades.resolution.min(32);
    }
    let mut probes = world.query::<&mut ProbeSet>();
    for mut probes in probes.iter_mut(world) {
        probes.resolution = probes.resolution.min(8);
        probes.rays = probes.rays.min(36);
    }
}

/// Clicks everywhere, and types into whatever was hit.
#[test]
fn clicks_and_keys_anywhere_break_nothing() {
    let (mut headless, _, target) = open(UVec2::new(480, 400));
    let file = std::env::temp_dir().join("bevy_gi_clicks.ron");
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    for round in 0..24 {
        let world = headless.app.world_mut();
        let mut inspector = world.resource_mut::<GiInspector>();
        inspector.open = true;
        inspector.file = file.to_string_lossy().into_owned();
        inspector.tab = Tab::ALL[round % Tab::ALL.len()];
        // Below the row that closes and moves the panel.
        let at = egui::pos2(
            10.0 + (random.next() % 370) as f32,
            30.0 + (random.next() % 360) as f32,
        );
        click(&mut headless, at);
        limit_work(headless.app.world_mut());
        let text = ["nan", "-1e39", "0", "inf", "x"][random.next() as usize % 5];
        type_text(&mut headless, text);
        limit_work(headless.app.world_mut());
    }
    assert_eq!(headless.pipeline_errors(), Vec::<String>::new());
    assert_sane(&headless.picture(&target), "after all clicks");
    let _ = std::fs::remove_file(file);
}

/// Whatever a field is set to: no panic, no error of a shader, no NaN in the picture.
#[test]
fn nothing_that_is_set_breaks_anything() {
    let (mut headless, camera, target) = open(UVec2::new(48, 32));
    let world = headless.app.world_mut();
    let mut volumes = world.query_filtered::<Entity, With<GiVolume>>();
    let volume = volumes.single(world).expect("the scene has a volume");
    let mut lights = world.query_filtered::<Entity, With<PointLight>>();
    let light = lights.iter(world).next().expect("the scene has a lamp");
    let cascades = world.spawn_empty().id();
    let registry = world.resource::<GiSettingsRegistry>().clone();
    let entries: Vec<_> = registry.iter().collect();
    // Every field of resources and of the camera three times, and after each third one a component of the scene, all of it
    // at once.
    let mut fields = Vec::new();
    for entry in &entries {
        if entry.get(world).is_some()
            && let ReflectRef::Struct(value) = entry.default_value().reflect_ref()
        {
            fields.extend((0..value.field_len()).map(|field| (*entry, field)));
        }
    }
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    // In another order, so that what belongs together is not changed together.
    fields.sort_by_cached_key(|_| random.next());
    for frame in 0..4 * fields.len() {
        let world = headless.app.world_mut();
        let tabs = Tab::ALL;
        let mut inspector = world.resource_mut::<GiInspector>();
        inspector.tab = tabs[random.next() as usize % tabs.len()];
        inspector.selected =
            [None, Some(volume), Some(camera), Some(cascades)][random.next() as usize % 4];
        if frame % 4 < 3 {
            let (entry, field) = fields[(frame / 4 * 3 + frame % 4) % fields.len()];
            if let Some(mut value) = entry.get_mut(world)
                && let ReflectMut::Struct(fields) = value.reflect_mut()
            {
                randomize(fields.field_at_mut(field).unwrap(), &mut random);
            }
        } else {
            match random.next() % 5 {
                0 => randomize_component::<GiVolume>(world, volume, &mut random),
                1 => randomize_component::<ProbeSet>(world, volume, &mut random),
                // Cascades come and go.
                2 if random.next().is_multiple_of(3) => {
                    world.entity_mut(cascades).remove::<GiCascades>();
                }
                2 => randomize_component::<GiCascades>(world, cascades, &mut random),
                3 => randomize_component::<GiCamera>(world, camera, &mut random),
                _ => randomize_component::<GiLight>(world, light, &mut random),
            }
        }
        limit_work(world);
        headless.step();
        if frame % 50 == 49 {
            let picture = headless.picture(&target);
            assert_sane(&picture, &format!("frame {frame}"));
            assert_eq!(headless.pipeline_errors(), Vec::<String>::new());
        }
    }
    // And back: the picture is what it was without all this.
    let world = headless.app.world_mut();
    for entry in &entries {
        if let Some(mut value) = entry.get_mut(world) {
            value.apply(entry.default_value().as_partial_reflect());
        }
    }
    world.resource_mut::<GiInspector>().open = false;
    headless.steps(8);
    let picture = headless.picture(&target);
    assert_sane(&picture, "the defaults");
    let mean = crate::support::mean(&picture);
    assert!(mean > 0.02, "the picture stays dark: {mean}");
}
