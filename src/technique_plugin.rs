//! [`TechniquePlugin`]: all that is the same for every technique.

use std::{any::TypeId, marker::PhantomData};

use bevy::{
    app::{App, Plugin},
    asset::AssetServer,
    camera::Camera,
    core_pipeline::schedule::Core3d,
    ecs::{component::Mutable, prelude::*, system::SystemParam},
    render::{
        Extract, ExtractSchedule, Render, RenderApp, RenderStartup,
        render_resource::PipelineCache,
        renderer::{RenderContext, RenderDevice, RenderGraph, RenderQueue, ViewQuery},
        view::{ExtractedView, ViewUniformOffset},
    },
};

use crate::{
    apply::{
        export::{ExportAgain, TechniqueExportPlugin, exported_technique},
        gather::{GatherPlugin, ViewIndirect},
    },
    camera::{ExtractedGiCamera, GiCamera},
    debug::{GiViews, Painter, ViewEntry},
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
    surface::{ViewSurface, depth::CameraDepth},
    technique::{
        Activity, Cache, Frame, Inputs, NoCache, NoDebug, Pipelines, Settling, Technique,
        ViewCache, ViewFrame, ViewInputs, ViewSettling, possible,
    },
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
        let mut techniques = app.world_mut().get_resource_or_init::<GiTechniques>();
        techniques.add(TechniqueEntry {
            technique,
            title: T::TITLE,
            device: T::DEVICE,
            lookup: T::LOOKUP,
        });
        let mut views = app.world_mut().get_resource_or_init::<GiViews>();
        for view in T::VIEWS {
            let painter = match view.shader {
                Some(_) => Painter::Gather,
                None => Painter::Cells,
            };
            views.add(ViewEntry {
                view: view.view,
                legend: view.legend,
                is_luminance: view.is_luminance,
                technique: Some(technique),
                painter,
            });
        }
        app.add_plugins(SettingsResourcePlugin::<T::Settings>::of(technique));
        if is::<T::Debug, NoDebug>() {
            app.init_resource::<NoDebug>();
        } else {
            app.add_plugins(SettingsResourcePlugin::<T::Debug>::debug(Some(technique)));
        }
        T::build(app);
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            render_app
                .init_resource::<T::Debug>()
                .add_observer(with_volume::<(T::Cache, CacheActivity<T>)>)
                .add_systems(RenderStartup, init_pipelines::<T>.run_if(possible::<T>))
                .add_systems(ExtractSchedule, extract_needs::<T>.in_set(NeedsKnown))
                .add_systems(
                    Render,
                    settle_views::<T>
                        .in_set(GiPrepare::Caches)
                        .run_if(possible::<T>),
                );
            if !is::<T::Cache, NoCache>() {
                let caches = update_caches::<T>.before(settle_views::<T>);
                render_app
                    .add_systems(
                        Render,
                        caches.in_set(GiPrepare::Caches).run_if(possible::<T>),
                    )
                    .add_systems(RenderGraph, record::<T>.in_set(GiSystems::UpdateCaches));
            }
            if !is::<T::ViewCache, NoCache>() {
                let caches = update_view_caches::<T>.before(settle_views::<T>);
                let record = record_view::<T>.in_set(GiSystems::UpdateViewCaches);
                render_app
                    .add_systems(
                        Render,
                        caches.in_set(GiPrepare::Caches).run_if(possible::<T>),
                    )
                    .add_systems(Core3d, record);
            }
        }
        app.add_plugins((
            GatherPlugin::<T>::default(),
            TechniqueExportPlugin::<T>::default(),
        ));
    }
}

fn is<A: 'static, B: 'static>() -> bool {
    TypeId::of::<A>() == TypeId::of::<B>()
}

/// What the cache of a volume does in this frame. A component of the volume's entity.
#[derive(Component)]
struct CacheActivity<T: Technique>(Activity, PhantomData<T>);

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
struct Surroundings<'w, T: Technique> {
    settings: Res<'w, <T as Technique>::Settings>,
    debug: Res<'w, <T as Technique>::Debug>,
    pipelines: Option<Res<'w, <T as Technique>::Pipelines>>,
    gi: Res<'w, GiSettings>,
    capture: Res<'w, GiCaptureSettings>,
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

impl<T: Technique> Surroundings<'_, T> {
    /// `None` before there are pipelines.
    fn frame<'a>(
        &'a self,
        volume: &'a ExtractedVolume,
        voxels: Option<&'a SceneVoxels>,
        probes: Option<&'a SceneProbes>,
    ) -> Option<Frame<'a, T>> {
        Some(Frame {
            settings: &self.settings,
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
            pipelines: self.pipelines.as_ref()?,
            cache: &self.cache,
            device: &self.device,
            queue: &self.queue,
            statistics: &self.statistics,
        })
    }

    /// The same for a camera.
    fn view_frame<'a>(
        &'a self,
        view: &'a ExtractedView,
        camera: &'a ExtractedGiCamera,
        surface: &ViewSurface,
    ) -> Option<ViewFrame<'a, T>> {
        Some(ViewFrame {
            settings: &self.settings,
            gi: &self.gi,
            capture: &self.capture,
            debug: &self.debug,
            history: self.history.epoch(),
            view,
            camera: &camera.settings,
            size: surface.size,
            light_maps: &self.light_maps,
            lighting: *self.lighting,
            units: &self.units,
            pipelines: self.pipelines.as_ref()?,
            cache: &self.cache,
            device: &self.device,
            queue: &self.queue,
            statistics: &self.statistics,
        })
    }
}

/// A cache that is to be updated in this frame, if it has memory. One that is missing is made for the next frame, one
/// that does not fit any more is made anew, and one that cannot be made goes, with its `Activity`.
fn kept<'a, Cache: Component<Mutability = Mutable>, Activity: Component>(
    entity: &mut EntityCommands,
    cache: Option<Mut<'a, Cache>>,
    ready: bool,
    new: impl Fn() -> Option<Cache>,
    fits: impl Fn(&Cache) -> bool,
) -> Option<Mut<'a, Cache>> {
    let Some(mut cache) = cache else {
        if let Some(new) = ready.then(new).flatten() {
            entity.insert(new);
        }
        return None;
    };
    if !fits(&cache) {
        let Some(new) = new() else {
            entity.remove::<(Cache, Activity)>();
            return None;
        };
        *cache = new;
    }
    Some(cache)
}

/// Makes, updates and removes the caches of all volumes.
fn update_caches<T: Technique>(
    mut commands: Commands,
    mut volumes: Query<VolumeData<T>>,
    cameras: Query<&ExtractedGiCamera>,
    surroundings: Surroundings<T>,
) {
    let technique = GiTechnique::of::<T>();
    let wanted = cameras.iter().any(|camera| camera.technique == technique);
    for (entity, volume, voxels, probes, cache) in &mut volumes {
        let mut entity = commands.entity(entity);
        let frame = surroundings.frame(volume, voxels, probes);
        let Some(frame) = frame.filter(|_| wanted) else {
            if cache.is_some() {
                // Nobody looks: the memory is given back.
                entity.remove::<(T::Cache, CacheActivity<T>)>();
            }
            continue;
        };
        let ready = frame.pipelines.ready(frame.cache);
        let new = || T::Cache::new(&frame);
        let fits = |cache: &T::Cache| cache.fits(&frame);
        let cache = kept::<_, CacheActivity<T>>(&mut entity, cache, ready, new, fits);
        let Some(mut cache) = cache else { continue };
        let activity = cache.update(&frame);
        entity.insert(CacheActivity::<T>(activity, PhantomData));
        if activity.look_again {
            entity.insert(LookAgain);
        }
    }
}

/// A camera that shows global illumination.
type Showing<'a> = (&'a ExtractedView, &'a ViewSurface, &'a ExtractedGiCamera);

type ViewData<'a, T> = (
    Entity,
    Option<Showing<'a>>,
    Option<&'a mut <T as Technique>::ViewCache>,
);

/// What the cache of a camera does in this frame. A component of the camera's entity.
#[derive(Component)]
struct ViewActivity<T: Technique>(Option<Settling>, PhantomData<T>);

/// Makes, updates and removes the caches of all cameras.
fn update_view_caches<T: Technique>(
    mut commands: Commands,
    mut views: Query<ViewData<T>>,
    surroundings: Surroundings<T>,
) {
    let technique = GiTechnique::of::<T>();
    for (entity, showing, cache) in &mut views {
        let mut entity = commands.entity(entity);
        let showing = showing.filter(|(.., camera)| camera.technique == technique);
        let frame = showing
            .and_then(|(view, surface, camera)| surroundings.view_frame(view, camera, surface));
        let Some(frame) = frame else {
            if cache.is_some() {
                entity.remove::<(T::ViewCache, ViewActivity<T>)>();
            }
            continue;
        };
        let ready = frame.pipelines.ready(frame.cache);
        let new = || T::ViewCache::new(&frame);
        let fits = |cache: &T::ViewCache| cache.fits(&frame);
        let cache = kept::<_, ViewActivity<T>>(&mut entity, cache, ready, new, fits);
        let Some(mut cache) = cache else { continue };
        let settling = cache.update(&frame);
        entity.insert(ViewActivity::<T>(settling, PhantomData));
    }
}

/// Says how cameras treat their history, and which volumes are exported anew, by what the caches do.
fn settle_views<T: Technique>(
    mut commands: Commands,
    volumes: Query<(Entity, &CacheActivity<T>)>,
    views: Query<(Entity, &ExtractedGiCamera, Option<&ViewActivity<T>>)>,
    settings: Res<GiSettings>,
) {
    let technique = GiTechnique::of::<T>();
    let cameras = views.iter().map(|(_, camera, _)| camera);
    if exported_technique(cameras, &settings) == Some(technique) {
        for (volume, activity) in &volumes {
            match activity.0.settling {
                Some(_) => commands.entity(volume).insert(ExportAgain),
                None => commands.entity(volume).remove::<ExportAgain>(),
            };
        }
    }
    let of_volumes = volumes
        .iter()
        .filter_map(|(_, activity)| activity.0.settling);
    let of_volumes = of_volumes.reduce(Settling::with);
    for (view, _, own) in views
        .iter()
        .filter(|(_, camera, _)| camera.technique == technique)
    {
        let own = own.and_then(|own| own.0);
        let all = of_volumes.into_iter().chain(own).reduce(Settling::with);
        commands.entity(view).insert(ViewSettling(all));
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

type ViewRecordData<'a, T> = (
    &'a ViewSurface,
    &'a ViewIndirect,
    &'a ViewUniformOffset,
    &'a <T as Technique>::ViewCache,
);

/// Records what the cache of a camera computes in this frame.
fn record_view<T: Technique>(
    view: ViewQuery<ViewRecordData<T>>,
    scenes: Query<&SceneBindGroup>,
    light_maps: Res<SceneLightMaps>,
    pipelines: Option<Res<T::Pipelines>>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (surface, indirect, offset, technique) = view.into_inner();
    let Some(pipelines) = pipelines else { return };
    let scenes: Vec<_> = scenes
        .iter_many(&indirect.volumes)
        .map(|scene| &scene.0)
        .collect();
    let diagnostics = ctx.diagnostic_recorder();
    let mut recorder = Recorder {
        encoder: ctx.command_encoder(),
        cache: &cache,
        diagnostics: diagnostics.as_deref(),
    };
    let inputs = ViewInputs {
        surface: &surface.bind_group,
        offset: offset.offset,
        scenes: &scenes,
        light_maps: &light_maps,
    };
    technique.record(&pipelines, inputs, &mut recorder);
}
