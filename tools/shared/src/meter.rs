//! Figures of two pictures that are being shown, a few times a minute.

use std::sync::{Arc, Mutex};

use bevy::{
    camera::visibility::RenderLayers,
    prelude::*,
    render::{
        gpu_readback::{Readback, ReadbackComplete},
        render_resource::TextureFormat,
    },
};

use crate::{
    figures::{self, Errors},
    headless::{Picture, decode, readable_target},
    overlay::{self, Overlay, OverlaySettings},
    projector,
};

/// Measures the left picture against the right one.
#[derive(Resource, Default)]
pub struct Meter {
    /// The pictures.
    pub sides: [Handle<Image>; 2],
    /// Which of them are path-traced, and have no texture that can be read.
    pub traced: [bool; 2],
    /// Factors from their values to exposed ones.
    pub scale: [f32; 2],
    /// The path tracer's picture.
    pub truth: Option<Arc<Picture>>,
    latest: Arc<Mutex<Option<Measured>>>,
    busy: Option<Measuring>,
}

/// Errors, if there is anything to compare, and FLIP.
type Measured = (Option<Errors>, f32);

/// Pictures on their way from the GPU: linear ones and those as seen, left and right.
struct Measuring {
    pictures: Arc<Mutex<[Option<Picture>; 4]>>,
    entities: Vec<Entity>,
    /// Frames since they were asked for.
    frames: u32,
}

pub struct MeterPlugin;

impl Plugin for MeterPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Meter>().add_systems(
            Last,
            (
                start.run_if(bevy::time::common_conditions::on_timer(
                    std::time::Duration::from_secs(2),
                )),
                finish,
            ),
        );
    }
}

impl Meter {
    /// The latest figures.
    pub fn text(&self) -> String {
        let latest = self.latest.lock().unwrap();
        let Some((errors, flip)) = &*latest else {
            return "measuring".into();
        };
        let errors = errors.as_ref().map_or("nothing to compare".into(), |e| {
            format!(
                "mean ratio {:.3}   relative RMSE {:.3}   median error {:.3}",
                e.mean_ratio, e.relative_rmse, e.median_error
            )
        });
        format!("left over right, 8x8 pixels: {errors}   FLIP {flip:.3}")
    }
}

/// First layer of the cameras that show what is seen of either side.
const SEEN: usize = 2;

fn start(world: &mut World) {
    world.resource_scope(|world, mut meter: Mut<Meter>| {
        let is_traced = meter.traced.contains(&true);
        if meter.busy.is_some() || (is_traced && meter.truth.is_none()) {
            return;
        }
        let images = world.resource::<Assets<Image>>();
        let sizes = [0, 1].map(|i| images.get(&meter.sides[i]).map(Image::size));
        let [Some(size), Some(other)] = sizes else {
            return;
        };
        if size != other {
            return;
        }
        let pictures = Arc::new(Mutex::new([const { None }; 4]));
        let mut entities = Vec::new();
        let mut read = |world: &mut World, slot: usize, image: Handle<Image>, format| {
            let pictures = pictures.clone();
            let entity = world
                .spawn(Readback::texture(image))
                .observe(move |complete: On<ReadbackComplete>| {
                    let picture = decode(&complete.data, (size, format));
                    pictures.lock().unwrap()[slot] = Some(picture);
                })
                .id();
            entities.push(entity);
        };
        for side in 0..2 {
            if meter.traced[side] {
                let truth = meter.truth.as_deref().cloned();
                pictures.lock().unwrap()[side] = truth;
            } else {
                let image = meter.sides[side].clone();
                read(world, side, image, TextureFormat::Rgba16Float);
            }
        }
        let mut cameras = Vec::new();
        for side in 0..2 {
            let image = readable_target(size, TextureFormat::Rgba8UnormSrgb);
            let target = world.resource_mut::<Assets<Image>>().add(image);
            let overlay = Overlay {
                settings: OverlaySettings::left(meter.scale[side]),
                left: meter.sides[side].clone(),
                right: meter.sides[side].clone(),
            };
            let overlay = world.resource_mut::<Assets<Overlay>>().add(overlay);
            let bundle = overlay::bundle(&mut world.resource_mut::<Assets<Mesh>>(), overlay);
            let layer = RenderLayers::layer(SEEN + side);
            cameras.push(world.spawn((bundle, layer.clone())).id());
            let camera = projector::camera(&target, 4 + side as isize, layer);
            cameras.push(world.spawn(camera).id());
            read(world, 2 + side, target, TextureFormat::Rgba8UnormSrgb);
        }
        entities.extend(cameras);
        meter.busy = Some(Measuring {
            pictures,
            entities,
            frames: 0,
        });
    });
}

/// Computes the figures on a thread of its own, once all pictures have come.
fn finish(mut commands: Commands, mut meter: ResMut<Meter>) {
    let Some(measuring) = &mut meter.busy else {
        return;
    };
    measuring.frames += 1;
    let pictures = {
        let mut pictures = measuring.pictures.lock().unwrap();
        // What comes first may have been read before it was drawn.
        if measuring.frames < 8 || pictures.iter().any(Option::is_none) {
            return;
        }
        std::mem::take(&mut *pictures)
    };
    for entity in &measuring.entities {
        commands.entity(*entity).despawn();
    }
    meter.busy = None;
    let (scale, latest) = (meter.scale, meter.latest.clone());
    std::thread::spawn(move || {
        let [Some(left), Some(right), Some(left_seen), Some(right_seen)] = pictures else {
            return;
        };
        let left = figures::blocks(&left.scaled(scale[0]));
        let right = figures::blocks(&right.scaled(scale[1]));
        let errors = Errors::new(&left, &right);
        let (flip, _) = figures::flip_of(&left_seen, &right_seen);
        *latest.lock().unwrap() = Some((errors, flip));
    });
}
