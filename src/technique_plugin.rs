//! [`TechniquePlugin`]: all that is the same for every technique.

use std::marker::PhantomData;

use bevy::{
    app::{App, Plugin},
    asset::AssetServer,
    camera::Camera,
    ecs::{prelude::*, system::SystemParam},
    render::{
        Extract, ExtractSchedule, Render, RenderApp, RenderStartup,
        render_resource::PipelineCache,
        renderer::{RenderContext, RenderDevice, RenderGraph, RenderQueue},
    },
};

use crate::{
    apply::{export::TechniqueExportPlugin, gather::GatherPlugin},
    camera::{ExtractedGiCamera, GiCamera},
    debug::GiDebugSettings,
    gpu::{caps::GiSupport, compute::Recorder, statistics::GiStatistics},
    scene::{
        bind_group::{LightingVersion, SceneBindGroup},
        light_maps::SceneLightMaps,
        needs::{NeedsKnown, SceneNeeds},
        probes::{LookAgain, SceneProbes},
        units::LightUnits,
        volume::{ExtractedVolume, with_volume},
        voxels::SceneVoxels,
    },
    schedule::{GiPrepare, GiSystems},
    settings::{
        GiCaptureSettings, GiHistory, GiSettings, GiTechnique, GiTechniques,
        SettingsResourcePlugin, TechniqueEntry,
    },
    surface::depth::CameraDepth,
    technique::{Cache, Frame, Inputs, Pipelines, Settling, Technique, possible},
};

/// Adds a [`Technique`] to an app: cameras can use it, the inspector lists it, and its settings are a resource.
///
/// [`GiPlugins`](crate::GiPlugins) adds one for each technique of this crate. Add one for a technique of your
/// own after it.
pub struct TechniquePlugin<T>(PhantomData<T>);

impl<T> Default for TechniquePlugin<T> {
    fn default() -> Self {
        Self(PhantomData)
    }
}

impl<T: Technique> Plugin for TechniquePlugin<T> {
    fn build(&self, app: &mut App) {
        let technique = GiTechnique::of::<T>();
        let entry = TechniqueEntry {
            technique,
            title: T::TITLE,
            device: T::DEVICE,
            views: T::VIEWS,
        };
        let mut techniques = app.world_mut().get_resource_or_init::<GiTechniques>();
        techniques.add(entry);
        app.add_plugins(SettingsResourcePlugin::<T::Settings>::of(technique));
        T::build(app);
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            render_app
                .add_observer(with_volume::<T::Cache>)
                .add_systems(RenderStartup, init_pipelines::<T>.run_if(possible::<T>))
                .add_systems(ExtractSchedule, extract_needs::<T>.in_set(NeedsKnown))
                .add_systems(
                    Render,
                    update_caches::<T>
                        .in_set(GiPrepare::Caches)
                        .run_if(possible::<T>),
                )
                .add_systems(RenderGraph, record::<T>.in_set(GiSystems::UpdateCaches));
        }
        app.add_plugins((
            GatherPlugin::<T>::default(),
            TechniqueExportPlugin::<T>::default(),
        ));
    }
}

fn init_pipelines<T: Technique>(
    mut commands: Commands,
    server: Res<AssetServer>,
    cache: Res<PipelineCache>,
) {
    commands.insert_resource(T::Pipelines::new(&server, &cache));
}

/// Says what the technique needs, if some camera uses it.
fn extract_needs<T: Technique>(
    gi: Extract<Res<GiSettings>>,
    settings: Extract<Res<T::Settings>>,
    support: Extract<Res<GiSupport>>,
    cameras: Extract<Query<(&Camera, &GiCamera)>>,
    mut needs: ResMut<SceneNeeds>,
) {
    let uses = |(camera, own): (&Camera, &GiCamera)| {
        camera.is_active && own.active_technique(&gi, &support) == GiTechnique::of::<T>()
    };
    if cameras.iter().any(uses) {
        needs.add(T::needs(&settings));
    }
}

type VolumeData<'a, T> = (
    Entity,
    &'a ExtractedVolume,
    Option<&'a SceneVoxels>,
    Option<&'a SceneProbes>,
    Option<&'a mut <T as Technique>::Cache>,
);

/// What all caches of a frame have in common.
#[derive(SystemParam)]
struct Surroundings<'w> {
    gi: Res<'w, GiSettings>,
    capture: Res<'w, GiCaptureSettings>,
    debug: Res<'w, GiDebugSettings>,
    history: Res<'w, GiHistory>,
    light_maps: Res<'w, SceneLightMaps>,
    lighting: Res<'w, LightingVersion>,
    units: Res<'w, LightUnits>,
    camera_depth: Option<Res<'w, CameraDepth>>,
    cache: Res<'w, PipelineCache>,
    device: Res<'w, RenderDevice>,
    queue: Res<'w, RenderQueue>,
    statistics: Res<'w, GiStatistics>,
}

impl Surroundings<'_> {
    /// `None` before there are pipelines.
    fn frame<'a, T: Technique>(
        &'a self,
        settings: &'a T::Settings,
        pipelines: Option<&'a T::Pipelines>,
        volume: &'a ExtractedVolume,
        voxels: Option<&'a SceneVoxels>,
        probes: Option<&'a SceneProbes>,
    ) -> Option<Frame<'a, T>> {
        Some(Frame {
            settings,
            gi: &self.gi,
            capture: &self.capture,
            debug: &self.debug,
            history: self.history.epoch(),
            volume,
            voxels,
            probes,
            light_maps: &self.light_maps,
            lighting: *self.lighting,
            units: &self.units,
            camera_depth: self.camera_depth.as_ref()?,
            pipelines: pipelines?,
            cache: &self.cache,
            device: &self.device,
            queue: &self.queue,
            statistics: &self.statistics,
        })
    }
}

/// Makes, updates and removes the caches of all volumes.
fn update_caches<T: Technique>(
    mut commands: Commands,
    mut volumes: Query<VolumeData<T>>,
    cameras: Query<&ExtractedGiCamera>,
    settings: Res<T::Settings>,
    pipelines: Option<Res<T::Pipelines>>,
    surroundings: Surroundings,
) {
    let technique = GiTechnique::of::<T>();
    let wanted = cameras.iter().any(|camera| camera.technique == technique);
    for (entity, volume, voxels, probes, cache) in &mut volumes {
        let mut entity = commands.entity(entity);
        let pipelines = pipelines.as_deref();
        let frame = surroundings.frame::<T>(&settings, pipelines, volume, voxels, probes);
        let Some(frame) = frame.filter(|_| wanted) else {
            if cache.is_some() {
                // Nobody looks: the memory is given back.
                entity.remove::<(T::Cache, Settling)>();
            }
            continue;
        };
        let ready = frame.pipelines.ready(frame.cache);
        let Some(mut cache) = cache else {
            if let Some(new) = ready.then(|| T::Cache::new(&frame)).flatten() {
                entity.insert(new);
            }
            continue;
        };
        if !cache.fits(&frame) {
            match T::Cache::new(&frame) {
                Some(new) => *cache = new,
                None => {
                    entity.remove::<(T::Cache, Settling)>();
                    continue;
                }
            }
        }
        let activity = cache.update(&frame);
        match activity.settling {
            Some(settling) => entity.insert(settling),
            None => entity.remove::<Settling>(),
        };
        match activity.look_again {
            true => entity.insert(LookAgain),
            false => entity.remove::<LookAgain>(),
        };
    }
}

type RecordData<'a, T> = (
    Option<&'a SceneVoxels>,
    Option<&'a SceneProbes>,
    &'a SceneBindGroup,
    &'a <T as Technique>::Cache,
);

/// Records what the caches of all volumes compute in this frame.
fn record<T: Technique>(
    volumes: Query<RecordData<T>>,
    light_maps: Res<SceneLightMaps>,
    pipelines: Option<Res<T::Pipelines>>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let Some(pipelines) = pipelines else { return };
    let diagnostics = ctx.diagnostic_recorder();
    for (voxels, probes, scene, technique) in &volumes {
        let inputs = Inputs {
            voxels,
            probes,
            light_maps: &light_maps,
            scene: &scene.0,
        };
        let mut recorder = Recorder {
            encoder: ctx.command_encoder(),
            cache: &cache,
            diagnostics: diagnostics.as_deref(),
        };
        technique.record(&pipelines, inputs, &mut recorder);
    }
}
