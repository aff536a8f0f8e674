//! [`CaptureViews`]: the view entities of one kind, made and removed as they are wanted.

use std::{any::TypeId, collections::HashMap, marker::PhantomData};

use bevy::{
    asset::{AssetId, UntypedAssetId},
    camera::visibility::RenderLayers,
    core_pipeline::prepass::OpaqueNoLightmap3dBatchSetKey,
    ecs::prelude::*,
    math::{Mat4, UVec2, UVec4},
    mesh::{Mesh, Mesh3d},
    platform::collections::HashSet,
    render::{
        batching::gpu_preprocessing::{GpuPreprocessingMode, GpuPreprocessingSupport},
        render_resource::*,
        sync_world::{MainEntity, MainEntityHashMap},
        view::{
            ExtractedView, NoIndirectDrawing, RenderExtractedVisibleEntities,
            RenderVisibleEntities, RetainedViewEntity,
        },
    },
    shader::ShaderCacheError,
    transform::components::{GlobalTransform, Transform},
};

use super::kind::{CaptureKind, CapturePhases};

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
pub(super) struct Drawn {
    pub material: UntypedAssetId,
    /// Group and slot.
    pub binding: (u32, u32),
    pub mesh: AssetId<Mesh>,
    pub key: OpaqueNoLightmap3dBatchSetKey,
}

/// The view entities of one kind, by owner and index.
#[derive(Resource)]
pub(crate) struct CaptureViews<K: CaptureKind> {
    views: HashMap<(Entity, u32), Entity>,
    /// How each mesh is drawn, by view entity.
    pub(super) drawn: HashMap<Entity, MainEntityHashMap<Drawn>>,
    /// View entities in which a mesh came, went, or is drawn in another way this frame;
    pub(super) changed: HashSet<Entity>,
    /// those in which one waits for an asset.
    pub(super) waiting: HashSet<Entity>,
    pub(super) pipelines: HashSet<CachedRenderPipelineId>,
    /// Whether Bevy's pass that computes the transforms of instances is compiled.
    pub(super) places_instances: bool,
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
        let states = self.pipelines.iter();
        let mut states = states.map(|id| cache.get_render_pipeline_state(*id));
        self.places_instances && states.all(is_settled)
    }
}

/// Whether a pipeline is compiled, or never will be. Bevy tries those again whose shader is not loaded yet.
fn is_settled(state: &CachedPipelineState) -> bool {
    match state {
        CachedPipelineState::Ok(_) => true,
        CachedPipelineState::Queued | CachedPipelineState::Creating(_) => false,
        CachedPipelineState::Err(error) => !matches!(
            error,
            ShaderCacheError::ShaderNotLoaded(_) | ShaderCacheError::ShaderImportNotYetAvailable
        ),
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A capture that is drawn before would stay without these meshes for ever.
    #[test]
    fn shaders_that_are_still_loading_are_waited_for() {
        let missing = ShaderCacheError::ShaderNotLoaded(AssetId::invalid());
        let waiting = [
            CachedPipelineState::Queued,
            CachedPipelineState::Err(missing),
            CachedPipelineState::Err(ShaderCacheError::ShaderImportNotYetAvailable),
        ];
        assert!(!waiting.iter().any(is_settled));
        let broken = ShaderCacheError::CreateShaderModule("broken".into());
        assert!(is_settled(&CachedPipelineState::Err(broken)));
    }
}
