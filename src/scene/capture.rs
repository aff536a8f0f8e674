//! Drawing the scene from views that are no cameras: the voxelizer's three axes, and lights.
//!
//! Geometry goes through Bevy's own batching, skinning, morphing and material pipelines. A *capture
//! view* is a persistent entity of the render world with an [`ExtractedView`] and a list of meshes;
//! a [`CaptureKind`] says with which pipeline meshes are drawn from it. Captures are rare: views
//! are extracted each frame, which costs little, but their GPU work runs only for the views in
//! [`CaptureQueue`].

use std::{any::TypeId, collections::HashMap, marker::PhantomData, ops::Range, sync::Arc};

use bevy::{
    app::{App, Plugin},
    asset::{AssetId, UntypedAssetId},
    camera::visibility::RenderLayers,
    core_pipeline::prepass::{OpaqueNoLightmap3dBatchSetKey, OpaqueNoLightmap3dBinKey},
    ecs::{
        prelude::*,
        schedule::IntoScheduleConfigs,
        system::{ReadOnlySystemParam, StaticSystemParam, SystemParam, SystemParamItem},
    },
    material::{
        AlphaMode, MaterialProperties,
        key::{ErasedMaterialPipelineKey, ErasedMeshPipelineKey},
    },
    math::{Mat4, UVec2, UVec4},
    mesh::{Mesh, Mesh3d, MeshVertexBufferLayoutRef},
    pbr::{
        MeshPipeline, MeshPipelineKey, PreparedMaterial, PrepassFragmentShader, PrepassPipeline,
        PrepassPipelineSpecializer, PrepassVertexShader, PreprocessPipelines,
        RenderMaterialInstances, RenderMeshInstances, early_gpu_preprocess,
    },
    platform::collections::HashSet,
    render::{
        Render, RenderApp, RenderSystems,
        batching::gpu_preprocessing::{GpuPreprocessingMode, GpuPreprocessingSupport},
        camera::{DirtySpecializations, PendingQueues},
        erased_render_asset::ErasedRenderAssets,
        mesh::{RenderMesh, allocator::MeshAllocator},
        render_asset::RenderAssets,
        render_phase::*,
        render_resource::*,
        renderer::{CurrentView, RenderGraph},
        sync_world::{MainEntity, MainEntityHashMap},
        view::{
            ExtractedView, NoIndirectDrawing, RenderExtractedVisibleEntities,
            RenderVisibleEntities, RetainedViewEntity,
        },
    },
    transform::components::{GlobalTransform, Transform},
};

use crate::{gpu::caps::supported, schedule::GiSystems};

/// How meshes are drawn from a kind of capture view.
pub(crate) trait CaptureKind: Send + Sync + Sized + 'static {
    /// What [`specialize`](Self::specialize) needs.
    type Param: SystemParam + 'static;
    /// Bits of the pipeline key that are the same for all meshes.
    const KEY: MeshPipelineKey;

    /// The pipeline for a mesh; `None` if such a mesh is not drawn.
    fn specialize(
        param: &mut SystemParamItem<Self::Param>,
        cache: &PipelineCache,
        key: ErasedMaterialPipelineKey,
        mesh_key: MeshPipelineKey,
        material: &Arc<MaterialProperties>,
        layout: &MeshVertexBufferLayoutRef,
    ) -> Option<CapturePipeline>;
}

/// How one mesh is drawn.
pub(crate) struct CapturePipeline {
    pub pipeline: CachedRenderPipelineId,
    pub draw: DrawFunctionId,
    /// Whether the material's bind group is read.
    pub reads_material: bool,
}

/// Bevy's own prepass as the pipeline of a capture.
#[derive(SystemParam)]
pub(crate) struct PrepassPipelines<'w> {
    prepass: Res<'w, PrepassPipeline>,
    pipelines: ResMut<'w, SpecializedMeshPipelines<PrepassPipelineSpecializer>>,
}

impl PrepassPipelines<'_> {
    /// The pipeline for a mesh with a material.
    pub fn specialize(
        &mut self,
        cache: &PipelineCache,
        key: ErasedMaterialPipelineKey,
        material: &Arc<MaterialProperties>,
        layout: &MeshVertexBufferLayoutRef,
    ) -> Option<CachedRenderPipelineId> {
        let specializer = PrepassPipelineSpecializer {
            pipeline: self.prepass.clone(),
            properties: material.clone(),
        };
        let pipeline = self.pipelines.specialize(cache, &specializer, key, layout);
        pipeline.ok()
    }
}

/// A mesh in a capture view.
pub(crate) struct CapturePhase<K> {
    key: OpaqueNoLightmap3dBatchSetKey,
    entity: (Entity, MainEntity),
    batch_range: Range<u32>,
    extra_index: PhaseItemExtraIndex,
    kind: PhantomData<K>,
}

impl<K: CaptureKind> PhaseItem for CapturePhase<K> {
    fn entity(&self) -> Entity {
        self.entity.0
    }
    fn main_entity(&self) -> MainEntity {
        self.entity.1
    }
    fn draw_function(&self) -> DrawFunctionId {
        self.key.draw_function
    }
    fn batch_range(&self) -> &Range<u32> {
        &self.batch_range
    }
    fn batch_range_mut(&mut self) -> &mut Range<u32> {
        &mut self.batch_range
    }
    fn extra_index(&self) -> PhaseItemExtraIndex {
        self.extra_index.clone()
    }
    fn batch_range_and_extra_index_mut(&mut self) -> (&mut Range<u32>, &mut PhaseItemExtraIndex) {
        (&mut self.batch_range, &mut self.extra_index)
    }
}

impl<K: CaptureKind> BinnedPhaseItem for CapturePhase<K> {
    type BatchSetKey = OpaqueNoLightmap3dBatchSetKey;
    type BinKey = OpaqueNoLightmap3dBinKey;

    fn new(
        key: Self::BatchSetKey,
        _: Self::BinKey,
        entity: (Entity, MainEntity),
        batch_range: Range<u32>,
        extra_index: PhaseItemExtraIndex,
    ) -> Self {
        Self {
            key,
            entity,
            batch_range,
            extra_index,
            kind: PhantomData,
        }
    }
}

impl<K: CaptureKind> CachedRenderPipelinePhaseItem for CapturePhase<K> {
    fn cached_pipeline(&self) -> CachedRenderPipelineId {
        self.key.pipeline
    }
}

pub(crate) type CapturePhases<K> = ViewBinnedRenderPhases<CapturePhase<K>>;

/// Marks the view entities of one kind.
#[derive(Component)]
pub(crate) struct CaptureView<K>(PhantomData<K>);

/// A view that a kind wants this frame.
pub(crate) struct WantedView {
    /// What the view belongs to: a volume or a light.
    pub owner: Entity,
    /// Which of the owner's views.
    pub index: u32,
    pub clip_from_view: Mat4,
    pub world_from_view: Transform,
    pub size: UVec2,
    /// Main-world meshes, sorted.
    pub meshes: Vec<Entity>,
}

/// All that decides how a mesh is drawn in a view. Bevy queues meshes again whenever one of their components
/// was written, be it with the same value: as long as this stays the same, so does the picture.
#[derive(PartialEq)]
struct Drawn {
    material: UntypedAssetId,
    /// Group and slot.
    binding: (u32, u32),
    mesh: AssetId<Mesh>,
    key: OpaqueNoLightmap3dBatchSetKey,
}

/// The view entities of one kind, by owner and index.
#[derive(Resource)]
pub(crate) struct CaptureViews<K: CaptureKind> {
    views: HashMap<(Entity, u32), Entity>,
    /// How each mesh is drawn, by view entity.
    drawn: HashMap<Entity, MainEntityHashMap<Drawn>>,
    /// View entities in which a mesh came, went, or is drawn in another way this frame;
    changed: HashSet<Entity>,
    /// those in which one waits for an asset.
    waiting: HashSet<Entity>,
    pipelines: HashSet<CachedRenderPipelineId>,
    /// Whether Bevy's pass that computes the transforms of instances is compiled.
    places_instances: bool,
    kind: PhantomData<K>,
}

impl<K: CaptureKind> Default for CaptureViews<K> {
    fn default() -> Self {
        Self {
            views: HashMap::new(),
            drawn: HashMap::new(),
            changed: HashSet::default(),
            waiting: HashSet::default(),
            pipelines: HashSet::default(),
            places_instances: false,
            kind: PhantomData,
        }
    }
}

impl<K: CaptureKind> CaptureViews<K> {
    pub fn get(&self, owner: Entity, index: u32) -> Option<Entity> {
        self.views.get(&(owner, index)).copied()
    }

    /// Whether a view shows something else than before: this frame a mesh came, went, or is drawn in another
    /// way.
    pub fn changed(&self, owner: Entity, index: u32) -> bool {
        let view = self.get(owner, index);
        view.is_some_and(|view| self.changed.contains(&view))
    }

    /// Whether a mesh of a view waits for an asset: until then it is missing.
    pub fn waits(&self, owner: Entity, index: u32) -> bool {
        let view = self.get(owner, index);
        view.is_some_and(|view| self.waiting.contains(&view))
    }

    /// Whether every pipeline is compiled: until then, meshes would be missing.
    pub fn ready(&self, cache: &PipelineCache) -> bool {
        let mut pipelines = self.pipelines.iter();
        self.places_instances
            && pipelines.all(|id| {
                matches!(
                    cache.get_render_pipeline_state(*id),
                    CachedPipelineState::Ok(_) | CachedPipelineState::Err(_)
                )
            })
    }
}

/// Bevy numbers the shadow views of a light from 0; these are ours.
const SUBVIEW_BASE: u32 = 0x6769_0000;

fn retained(owner: Entity, index: u32) -> RetainedViewEntity {
    RetainedViewEntity::new(owner.into(), None, SUBVIEW_BASE + index)
}

/// Makes the view entities those that are `wanted`. Called while extracting.
pub(crate) fn sync_views<K: CaptureKind>(
    commands: &mut Commands,
    views: &mut CaptureViews<K>,
    phases: &mut CapturePhases<K>,
    support: &GpuPreprocessingSupport,
    wanted: Vec<WantedView>,
) {
    let keys: HashSet<_> = wanted.iter().map(|w| (w.owner, w.index)).collect();
    let CaptureViews { views, drawn, .. } = views;
    views.retain(|key, view| {
        let keep = keys.contains(key);
        if !keep {
            phases.remove(&retained(key.0, key.1));
            drawn.remove(view);
            commands.entity(*view).despawn();
        }
        keep
    });
    for want in wanted {
        let retained_view_entity = retained(want.owner, want.index);
        let view = *views.entry((want.owner, want.index)).or_insert_with(|| {
            let base = (
                RenderVisibleEntities::default(),
                NoIndirectDrawing,
                // Bevy gives every view the meshes with `NoCpuCulling` that share a layer with it.
                RenderLayers::none(),
                CaptureView::<K>(PhantomData),
            );
            commands.spawn(base).id()
        });
        phases.prepare_for_new_frame(
            retained_view_entity,
            support.min(GpuPreprocessingMode::PreprocessingOnly),
        );
        let mut visible = RenderExtractedVisibleEntities::default();
        visible
            .classes
            .entry(TypeId::of::<Mesh3d>())
            .or_default()
            .entities = want
            .meshes
            .iter()
            .map(|mesh| (Entity::PLACEHOLDER, MainEntity::from(*mesh)))
            .collect();
        commands.entity(view).insert((
            visible,
            ExtractedView {
                retained_view_entity,
                clip_from_view: want.clip_from_view,
                world_from_view: GlobalTransform::from(want.world_from_view),
                clip_from_world: None,
                target_format: TextureFormat::R8Unorm,
                viewport: UVec4::new(0, 0, want.size.x, want.size.y),
                color_grading: Default::default(),
                invert_culling: false,
            },
        ));
    }
}

/// Adds a kind of capture view, drawn by the render command `C`.
pub(crate) struct CaptureKindPlugin<K, C>(PhantomData<(K, C)>);

impl<K, C> Default for CaptureKindPlugin<K, C> {
    fn default() -> Self {
        Self(PhantomData)
    }
}

impl<K, C> Plugin for CaptureKindPlugin<K, C>
where
    K: CaptureKind,
    C: RenderCommand<CapturePhase<K>, Param: ReadOnlySystemParam> + Send + Sync + 'static,
{
    fn build(&self, app: &mut App) {
        app.add_plugins(
            BinnedRenderPhasePlugin::<CapturePhase<K>, MeshPipeline>::new(Default::default()),
        );
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .init_resource::<DrawFunctions<CapturePhase<K>>>()
            .init_resource::<CaptureViews<K>>()
            .init_resource::<PendingCaptures<K>>()
            .add_render_command::<CapturePhase<K>, C>()
            .add_systems(
                Render,
                queue_captures::<K>
                    .in_set(RenderSystems::QueueMeshes)
                    .run_if(supported),
            );
    }
}

#[derive(Resource)]
struct PendingCaptures<K: CaptureKind>(PendingQueues, PhantomData<K>);

impl<K: CaptureKind> Default for PendingCaptures<K> {
    fn default() -> Self {
        Self(PendingQueues::default(), PhantomData)
    }
}

/// Adds meshes that are new in a view to its phase, and removes those that left.
///
/// Long, as it follows Bevy's `queue_prepass_material_meshes` step by step.
#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
fn queue_captures<K: CaptureKind>(
    views: Query<(Entity, &ExtractedView, &RenderVisibleEntities), With<CaptureView<K>>>,
    mut capture: ResMut<CaptureViews<K>>,
    mut phases: ResMut<CapturePhases<K>>,
    mut pending: ResMut<PendingCaptures<K>>,
    param: StaticSystemParam<K::Param>,
    (cache, preprocess): (Res<PipelineCache>, Option<Res<PreprocessPipelines>>),
    (support, allocator, dirty): (
        Res<GpuPreprocessingSupport>,
        Res<MeshAllocator>,
        Res<DirtySpecializations>,
    ),
    meshes: Res<RenderAssets<RenderMesh>>,
    mesh_instances: Res<RenderMeshInstances>,
    material_instances: Res<RenderMaterialInstances>,
    materials: Res<ErasedRenderAssets<PreparedMaterial>>,
) {
    let mut param = param.into_inner();
    let capture = capture.bypass_change_detection();
    capture.changed.clear();
    capture.waiting.clear();
    // Without the resource, Bevy computes transforms on the CPU.
    capture.places_instances = preprocess.is_none_or(|preprocess| {
        let pass = preprocess.direct_preprocess.pipeline_id;
        pass.is_some_and(|id| cache.get_compute_pipeline(id).is_some())
    });
    let all_views = views.iter().map(|(_, view, _)| view.retained_view_entity);
    pending.0.expire_stale_views(&all_views.collect());
    for (id, view, visible) in &views {
        let retained = view.retained_view_entity;
        let (Some(class), Some(phase)) = (visible.get::<Mesh3d>(), phases.get_mut(&retained))
        else {
            continue;
        };
        let drawn = capture.drawn.entry(id).or_default();
        // Those that are queued again below leave this list.
        let mut dequeued = MainEntityHashMap::default();
        for &entity in dirty.iter_to_dequeue(retained, class) {
            phase.remove(entity);
            dequeued.extend(drawn.remove(&entity).map(|drawn| (entity, drawn)));
        }
        let queue = pending.0.prepare_for_new_frame(retained);
        for (render_entity, main_entity) in dirty.iter_to_queue(retained, class, &queue.prev_frame)
        {
            // Without a material of Bevy's a mesh is not drawn; it is queued again should it get one.
            let Some(material_instance) = material_instances.instances.get(main_entity) else {
                continue;
            };
            let prepare = || {
                let mesh_instance = mesh_instances.render_mesh_queue_data(*main_entity)?;
                let material = materials.get(material_instance.asset_id)?;
                let mesh = meshes.get(mesh_instance.mesh_asset_id())?;
                let slabs = allocator.mesh_slabs(&mesh_instance.mesh_asset_id())?;
                Some((mesh_instance, material, mesh, slabs))
            };
            let Some((mesh_instance, material, mesh, slabs)) = prepare() else {
                queue.current_frame.insert((*render_entity, *main_entity));
                capture.waiting.insert(id);
                continue;
            };
            let mut mesh_key = K::KEY | MeshPipelineKey::from_bits_retain(mesh.key_bits.bits());
            match material.properties.alpha_mode {
                AlphaMode::Opaque => {}
                AlphaMode::Mask(_) | AlphaMode::AlphaToCoverage => {
                    mesh_key |= MeshPipelineKey::MAY_DISCARD;
                }
                // What is see-through neither blocks nor bounces.
                _ => continue,
            }
            // Bevy asks the same of a material before it binds it (`prepass_reads_material`).
            let shaders = &material.properties;
            if shaders.get_shader(PrepassVertexShader).is_some()
                || shaders.get_shader(PrepassFragmentShader).is_some()
            {
                mesh_key |= MeshPipelineKey::PREPASS_READS_MATERIAL;
            }
            if mesh_instance.lightmap_slab_index().is_some() {
                mesh_key |= MeshPipelineKey::LIGHTMAPPED;
            }
            let key = ErasedMaterialPipelineKey {
                type_id: material_instance.asset_id.type_id(),
                mesh_key: ErasedMeshPipelineKey::new(mesh_key),
                material_key: material.properties.material_key.clone(),
            };
            let Some(pipeline) = K::specialize(
                &mut param,
                &cache,
                key,
                mesh_key,
                &material.properties,
                &mesh.layout,
            ) else {
                continue;
            };
            capture.pipelines.insert(pipeline.pipeline);
            let key = OpaqueNoLightmap3dBatchSetKey {
                pipeline: pipeline.pipeline,
                draw_function: pipeline.draw,
                material_bind_group_index: pipeline
                    .reads_material
                    .then_some(material.binding.group.0),
                slabs,
            };
            let now = Drawn {
                material: material_instance.asset_id,
                binding: (material.binding.group.0, material.binding.slot.0),
                mesh: mesh_instance.mesh_asset_id(),
                key: key.clone(),
            };
            let before = dequeued.remove(main_entity);
            // One that was waiting and has changed comes twice.
            let before = before.or_else(|| drawn.remove(main_entity));
            if before.as_ref() != Some(&now) {
                capture.changed.insert(id);
            }
            drawn.insert(*main_entity, now);
            phase.add(
                key,
                OpaqueNoLightmap3dBinKey {
                    asset_id: mesh_instance.mesh_asset_id().into(),
                },
                (*render_entity, *main_entity),
                mesh_instance.current_uniform_index,
                BinnedRenderPhaseType::mesh(mesh_instance.should_batch(), &support),
            );
        }
        if !dequeued.is_empty() {
            capture.changed.insert(id);
        }
    }
}

/// Views whose meshes are drawn this frame. Filled while preparing.
#[derive(Resource, Default)]
pub(crate) struct CaptureQueue(pub Vec<Entity>);

pub(crate) struct CapturePlugin;

impl Plugin for CapturePlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app.init_resource::<CaptureQueue>().add_systems(
            RenderGraph,
            preprocess_captures.in_set(GiSystems::CaptureScene),
        );
    }
}

/// Lets Bevy compute the instance transforms of each queued view, as it does for its cameras.
pub(crate) fn preprocess_captures(world: &mut World) {
    let queue = std::mem::take(&mut world.resource_mut::<CaptureQueue>().0);
    if queue.is_empty() || !world.contains_resource::<PreprocessPipelines>() {
        return;
    }
    for view in queue {
        world.insert_resource(CurrentView(view));
        if let Err(error) = world.run_system_cached(early_gpu_preprocess) {
            bevy::log::error!("mesh preprocessing of a capture view failed: {error}");
        }
    }
    world.remove_resource::<CurrentView>();
}
