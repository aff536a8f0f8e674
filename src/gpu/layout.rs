//! Bind group layouts whose entries have names: those of the variables in WGSL.
//!
//! Shaders declare again what they read of a layout; `shader_tests.rs` compares the two. Bind groups are made by name,
//! so that two buffers of the same type cannot change places.

use std::any::type_name;

use bevy::render::{
    render_resource::{binding_types::*, *},
    renderer::RenderDevice,
};

/// What kind of resource an entry binds. Bevy's `binding_types` convert into it; those of buffers are here, as they
/// know what the buffer holds.
#[derive(Clone, Debug)]
pub struct Binding {
    ty: BindingType,
    /// Rust type of a buffer's content.
    content: Option<&'static str>,
}

impl From<BindGroupLayoutEntryBuilder> for Binding {
    fn from(builder: BindGroupLayoutEntryBuilder) -> Self {
        Self {
            ty: builder.build(0, ShaderStages::NONE).ty,
            content: None,
        }
    }
}

impl Binding {
    fn buffer<T>(builder: BindGroupLayoutEntryBuilder) -> Self {
        Self {
            content: Some(type_name::<T>()),
            ..builder.into()
        }
    }
}

/// `var<uniform>`. A Rust type `GpuX` is `X` in WGSL.
pub fn uniform<T: ShaderType>() -> Binding {
    Binding::buffer::<T>(uniform_buffer::<T>(false))
}

/// `var<uniform>` at a dynamic offset.
pub fn dynamic_uniform<T: ShaderType>() -> Binding {
    Binding::buffer::<T>(uniform_buffer::<T>(true))
}

/// `var<storage, read>`. A Rust type `Vec<GpuX>` is `array<X>` in WGSL.
pub fn storage_read<T: ShaderType>() -> Binding {
    Binding::buffer::<T>(storage_buffer_read_only::<T>(false))
}

/// `var<storage, read_write>`. Atomics are words: `Vec<u32>`.
pub fn storage_write<T: ShaderType>() -> Binding {
    Binding::buffer::<T>(storage_buffer::<T>(false))
}

/// `texture_2d<f32>` and the like that is only loaded from, not sampled.
pub fn loaded() -> TextureSampleType {
    TextureSampleType::Float { filterable: false }
}

/// `texture_2d<f32>` and the like that is sampled with a filter.
pub fn filtered() -> TextureSampleType {
    TextureSampleType::Float { filterable: true }
}

/// The layout of a bind group.
#[derive(Clone, Debug)]
pub struct GroupLayout {
    descriptor: BindGroupLayoutDescriptor,
    stages: ShaderStages,
    /// Of each entry: its name, and the Rust type of a buffer's content.
    names: Vec<(&'static str, Option<&'static str>)>,
}

impl GroupLayout {
    /// A layout without entries. Its bind groups have the same label.
    pub fn new(label: &'static str, stages: ShaderStages) -> Self {
        Self {
            descriptor: BindGroupLayoutDescriptor::new(label, &[]),
            stages,
            names: Vec::new(),
        }
    }

    /// Adds an entry behind the last one.
    pub fn with(self, name: &'static str, binding: impl Into<Binding>) -> Self {
        let last = self.descriptor.entries.last();
        let index = last.map_or(0, |last| last.binding + 1);
        self.with_at(index, name, binding)
    }

    /// Adds an entry with the number that a shader library gives it.
    pub fn with_at(mut self, index: u32, name: &'static str, binding: impl Into<Binding>) -> Self {
        let Binding { ty, content } = binding.into();
        self.descriptor.entries.push(BindGroupLayoutEntry {
            binding: index,
            visibility: self.stages,
            ty,
            count: None,
        });
        self.names.push((name, content));
        self
    }

    /// As Bevy has it, for pipelines.
    pub fn descriptor(&self) -> BindGroupLayoutDescriptor {
        #[cfg(test)]
        made::layout(self);
        self.descriptor.clone()
    }

    /// Begins a bind group.
    pub fn bind<'a>(&'a self, device: &'a RenderDevice, cache: &PipelineCache) -> GroupBuilder<'a> {
        GroupBuilder {
            layout: self,
            device,
            handle: cache.get_bind_group_layout(&self.descriptor),
            entries: Vec::with_capacity(self.names.len()),
        }
    }

    /// What a shader declares to read it as group `group`: a line of WGSL for each entry, such as
    /// `@group(1) @binding(0) var<uniform> volume: Volume;`.
    pub fn declarations(&self, group: u32) -> Vec<String> {
        let entries = self.descriptor.entries.iter().zip(&self.names);
        let declare = |(entry, (name, content)): (&BindGroupLayoutEntry, &(&str, Option<&str>))| {
            let index = entry.binding;
            let content = content.map_or("?".into(), wgsl_type);
            let (space, kind) = match entry.ty {
                BindingType::Buffer { ty, .. } => (address_space(ty), content),
                other => ("var", wgsl_handle(other)),
            };
            format!("@group({group}) @binding({index}) {space} {name}: {kind};")
        };
        entries.map(declare).collect()
    }
}

/// A bind group that is being made.
pub struct GroupBuilder<'a> {
    layout: &'a GroupLayout,
    device: &'a RenderDevice,
    handle: BindGroupLayout,
    entries: Vec<BindGroupEntry<'a>>,
}

impl<'a> GroupBuilder<'a> {
    /// Binds a resource to the entry of that name.
    ///
    /// # Panics
    ///
    /// If the layout has none.
    pub fn with(mut self, name: &str, resource: impl IntoBinding<'a>) -> Self {
        let GroupLayout {
            descriptor, names, ..
        } = self.layout;
        let Some(at) = names.iter().position(|(own, _)| *own == name) else {
            panic!("the layout {} has no entry {name}", descriptor.label);
        };
        self.entries.push(BindGroupEntry {
            binding: descriptor.entries[at].binding,
            resource: resource.into_binding(),
        });
        self
    }

    /// The bind group, once all entries have a resource.
    pub fn build(self) -> BindGroup {
        let label: &str = &self.layout.descriptor.label;
        self.device
            .create_bind_group(label, &self.handle, &self.entries)
    }
}

fn address_space(ty: BufferBindingType) -> &'static str {
    match ty {
        BufferBindingType::Uniform => "var<uniform>",
        BufferBindingType::Storage { read_only: true } => "var<storage, read>",
        BufferBindingType::Storage { read_only: false } => "var<storage, read_write>",
    }
}

/// The WGSL type of a buffer with a Rust type.
fn wgsl_type(rust: &str) -> String {
    let element = rust.strip_prefix("alloc::vec::Vec<");
    if let Some(element) = element.and_then(|rest| rest.strip_suffix('>')) {
        return format!("array<{}>", wgsl_type(element));
    }
    match rust.rsplit("::").next().unwrap_or(rust) {
        "UVec2" => "vec2<u32>",
        "Vec4" => "vec4<f32>",
        // Bevy's own.
        "ViewUniform" => "View",
        own => own.trim_start_matches("Gpu"),
    }
    .into()
}

/// The WGSL type of a texture or a sampler.
fn wgsl_handle(ty: BindingType) -> String {
    let dimension = |dimension| match dimension {
        TextureViewDimension::D1 => "1d",
        TextureViewDimension::D2 => "2d",
        TextureViewDimension::D2Array => "2d_array",
        TextureViewDimension::Cube => "cube",
        TextureViewDimension::CubeArray => "cube_array",
        TextureViewDimension::D3 => "3d",
    };
    match ty {
        BindingType::Sampler(SamplerBindingType::Comparison) => "sampler_comparison".into(),
        BindingType::Sampler(_) => "sampler".into(),
        BindingType::Texture {
            sample_type,
            view_dimension,
            ..
        } => {
            let dimension = dimension(view_dimension);
            match sample_type {
                TextureSampleType::Depth => format!("texture_depth_{dimension}"),
                TextureSampleType::Float { .. } => format!("texture_{dimension}<f32>"),
                TextureSampleType::Uint => format!("texture_{dimension}<u32>"),
                TextureSampleType::Sint => format!("texture_{dimension}<i32>"),
            }
        }
        BindingType::StorageTexture {
            access,
            format,
            view_dimension,
        } => {
            let dimension = dimension(view_dimension);
            let format = format!("{format:?}").to_lowercase();
            let access = match access {
                StorageTextureAccess::ReadOnly => "read",
                StorageTextureAccess::WriteOnly => "write",
                StorageTextureAccess::ReadWrite => "read_write",
                StorageTextureAccess::Atomic => "atomic",
            };
            format!("texture_storage_{dimension}<{format}, {access}>")
        }
        other => format!("{other:?}"),
    }
}

/// All that pipelines were made with, for `shader_tests.rs`: Bevy keeps neither names nor the size of workgroups.
#[cfg(test)]
pub(crate) mod made {
    use std::{collections::BTreeMap, sync::Mutex};

    use bevy::math::UVec3;

    use super::GroupLayout;

    /// By label.
    pub static LAYOUTS: Mutex<BTreeMap<String, GroupLayout>> = Mutex::new(BTreeMap::new());
    /// Threads in a workgroup, by the name of a pass.
    pub static BLOCKS: Mutex<BTreeMap<&str, UVec3>> = Mutex::new(BTreeMap::new());

    pub(super) fn layout(layout: &GroupLayout) {
        let label = layout.descriptor.label.to_string();
        let mut layouts = LAYOUTS.lock().unwrap();
        if let Some(other) = layouts.insert(label, layout.clone()) {
            // A label stands for one layout.
            assert_eq!(other.declarations(0), layout.declarations(0));
        }
    }

    pub fn block(pass: &'static str, block: UVec3) {
        let before = BLOCKS.lock().unwrap().insert(pass, block);
        assert!(before.is_none_or(|before| before == block), "{pass}");
    }
}

#[cfg(test)]
mod tests {
    use bevy::math::{UVec2, Vec4};

    use super::*;

    #[derive(ShaderType)]
    struct GpuThing {
        number: u32,
    }

    #[test]
    fn layouts_say_what_shaders_declare() {
        let layout = GroupLayout::new("things", ShaderStages::COMPUTE)
            .with("thing", uniform::<GpuThing>())
            .with("pairs", storage_read::<Vec<UVec2>>())
            .with_at(4, "things", storage_write::<Vec<GpuThing>>())
            .with("colors", storage_write::<Vec<Vec4>>())
            .with("cells", texture_3d(filtered()))
            .with("depth", texture_2d_array(TextureSampleType::Depth))
            .with("taps", sampler(SamplerBindingType::Filtering))
            .with(
                "target_",
                texture_storage_2d(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly),
            );
        let expected = [
            "@group(2) @binding(0) var<uniform> thing: Thing;",
            "@group(2) @binding(1) var<storage, read> pairs: array<vec2<u32>>;",
            "@group(2) @binding(4) var<storage, read_write> things: array<Thing>;",
            "@group(2) @binding(5) var<storage, read_write> colors: array<vec4<f32>>;",
            "@group(2) @binding(6) var cells: texture_3d<f32>;",
            "@group(2) @binding(7) var depth: texture_depth_2d_array;",
            "@group(2) @binding(8) var taps: sampler;",
            "@group(2) @binding(9) var target_: texture_storage_2d<rgba16float, write>;",
        ];
        assert_eq!(layout.declarations(2), expected);
    }
}
