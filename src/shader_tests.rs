//! Shaders and Rust agree: every entry point, composed as Bevy composes it, declares what its pipeline binds, and has
//! workgroups as large as its pass says. Without a GPU.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use bevy::{
    asset::{AssetId, Assets, Handle},
    math::UVec3,
    render::{
        render_resource::{BindingType, CachedPipeline, PipelineDescriptor},
        settings::WgpuLimits,
    },
    shader::{
        Shader, ShaderCache, ShaderCacheError, ShaderCacheSource, ShaderDefVal, ValidateShader,
    },
};
use wgpu::naga::{
    AddressSpace, GlobalVariable, Module, ShaderStage, StorageAccess,
    common::wgsl::TypeContext,
    valid::{Capabilities, ModuleInfo, ValidationFlags, Validator},
};

use crate::{
    device_tests::{Idle, layouts},
    gpu::{
        caps::WORKGROUP,
        layout::{GroupLayout, made},
    },
};

/// A shader with all that it imports.
struct Composed {
    module: Module,
    /// Which variables each entry point uses.
    info: ModuleInfo,
}

impl Composed {
    fn new(
        _: &(),
        source: ShaderCacheSource,
        _: &ValidateShader,
    ) -> Result<Self, ShaderCacheError> {
        let ShaderCacheSource::Naga(module) = source else {
            panic!("WGSL becomes a module of naga");
        };
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
        let info = validator.validate(&module).expect("wgpu has compiled it");
        Ok(Self { module, info })
    }

    /// The number of an entry point. Without a name, it is the only one of its stage.
    fn entry(&self, name: Option<&str>, stage: ShaderStage) -> usize {
        let mut entries = self.module.entry_points.iter();
        let found = entries
            .position(|entry| entry.stage == stage && name.is_none_or(|name| name == entry.name));
        found.expect("wgpu has compiled it")
    }

    /// What an entry point uses of what its module declares: group, binding, declaration, and size of a buffer.
    fn declarations(&self, entry: usize) -> Vec<(u32, u32, String, u64)> {
        let used = self.info.get_entry_point(entry);
        let variables = self.module.global_variables.iter();
        let bound = variables.filter_map(|(handle, variable)| {
            let binding = variable.binding?;
            let (group, index) = (binding.group, binding.binding);
            let size = self.module.types[variable.ty]
                .inner
                .size(self.module.to_ctx());
            let declaration = format!(
                "@group({group}) @binding({index}) {}",
                self.declaration(variable)
            );
            (!used[handle].is_empty()).then_some((group, index, declaration, size.into()))
        });
        bound.collect()
    }

    fn declaration(&self, variable: &GlobalVariable) -> String {
        let space = match variable.space {
            AddressSpace::Uniform => "var<uniform>",
            AddressSpace::Storage { access } if access.contains(StorageAccess::STORE) => {
                "var<storage, read_write>"
            }
            AddressSpace::Storage { .. } => "var<storage, read>",
            _ => "var",
        };
        let name = plain(variable.name.as_deref().unwrap_or_default());
        let ty = plain(&self.module.to_ctx().type_to_string(variable.ty));
        // What is a word to Rust.
        let ty = ty
            .replace("atomic<u32>", "u32")
            .replace(",write", ", write");
        format!("{space} {name}: {ty};")
    }
}

/// A name, or a type, without the modules that naga_oil writes behind what they import.
fn plain(name: &str) -> String {
    let mut parts = name.split("X_naga_oil_mod_X");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |all, part| {
        all + part.trim_start_matches(|c: char| c.is_ascii_uppercase() || c.is_ascii_digit())
    })
}

/// An entry point in a pipeline.
struct Stage<'a> {
    shader: &'a Handle<Shader>,
    defs: &'a [ShaderDefVal],
    entry: Option<&'a str>,
    stage: ShaderStage,
}

impl Stage<'_> {
    /// The file below `src`, if it is one of the crate.
    fn path(&self) -> Option<String> {
        let path = self.shader.path()?.path().strip_prefix("bevy_gi").ok()?;
        Some(path.display().to_string())
    }
}

fn stages(pipeline: &CachedPipeline) -> Vec<Stage<'_>> {
    match &pipeline.descriptor {
        PipelineDescriptor::ComputePipelineDescriptor(compute) => vec![Stage {
            shader: &compute.shader,
            defs: &compute.shader_defs,
            entry: compute.entry_point.as_deref(),
            stage: ShaderStage::Compute,
        }],
        PipelineDescriptor::RenderPipelineDescriptor(render) => {
            let vertex = &render.vertex;
            let vertex = Stage {
                shader: &vertex.shader,
                defs: &vertex.shader_defs,
                entry: vertex.entry_point.as_deref(),
                stage: ShaderStage::Vertex,
            };
            let fragment = render.fragment.iter().map(|fragment| Stage {
                shader: &fragment.shader,
                defs: &fragment.shader_defs,
                entry: fragment.entry_point.as_deref(),
                stage: ShaderStage::Fragment,
            });
            std::iter::once(vertex).chain(fragment).collect()
        }
    }
}

/// Bevy's cache of shaders, with all shaders of an app.
fn shaders(idle: &Idle) -> ShaderCache<Composed, ()> {
    let limits = WgpuLimits::defaults();
    let mut cache = ShaderCache::new(
        (),
        wgpu::Features::empty(),
        wgpu::DownlevelFlags::all(),
        Composed::new,
    );
    // As `PipelineCache` adds it to all of them.
    let buffers = ShaderDefVal::UInt(
        "AVAILABLE_STORAGE_BUFFER_BINDINGS".into(),
        limits.max_storage_buffers_per_shader_stage,
    );
    let shaders: Vec<(AssetId<Shader>, Shader)> = {
        let assets = idle.app.world().resource::<Assets<Shader>>();
        assets
            .iter()
            .map(|(id, shader)| (id, shader.clone()))
            .collect()
    };
    for (id, mut shader) in shaders {
        shader.shader_defs.push(buffers.clone());
        cache.set_shader(id, shader);
    }
    cache
}

/// Entry points of all files below `src`, as `path: name`.
fn all_entry_points(folder: &Path, out: &mut BTreeSet<String>) {
    for file in std::fs::read_dir(folder).unwrap() {
        let path = file.unwrap().path();
        if path.is_dir() {
            all_entry_points(&path, out);
            continue;
        }
        if path.extension().is_none_or(|extension| extension != "wgsl") {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        let path = path.strip_prefix("src").unwrap().display();
        let mut stage = false;
        for line in text.lines() {
            stage |= ["@compute", "@vertex", "@fragment"]
                .iter()
                .any(|attribute| line.starts_with(attribute));
            if let Some(name) = line.strip_prefix("fn ").filter(|_| stage) {
                let name = name.split('(').next().unwrap();
                out.insert(format!("{path}: {name}"));
                stage = false;
            }
        }
    }
}

/// What differs between shaders and Rust.
#[derive(Default)]
struct Comparison {
    layouts: BTreeMap<String, GroupLayout>,
    blocks: BTreeMap<&'static str, UVec3>,
    differences: BTreeSet<String>,
    /// Entry points that were compared, as `path: name`.
    compared: BTreeSet<String>,
    /// Entries of layouts that some shader reads, by label and number.
    read: BTreeSet<(String, u32)>,
}

impl Comparison {
    fn compare(
        &mut self,
        label: &str,
        pipeline: &CachedPipeline,
        path: &str,
        shader: &Composed,
        entry: usize,
    ) {
        let point = &shader.module.entry_points[entry];
        let name = format!("{path}: {}", point.name);
        if point.stage == ShaderStage::Compute {
            let block = UVec3::from(point.workgroup_size);
            let stated = self.blocks.get(label).copied();
            if stated != Some(block) || block.element_product() > WORKGROUP {
                let difference = format!("{name} has workgroups of {block}, {label} of {stated:?}");
                self.differences.insert(difference);
            }
        }
        for (group, index, declared, size) in shader.declarations(entry) {
            let Some(layout) = layouts(pipeline).get(group as usize) else {
                let difference = format!("{name} declares `{declared}`, {label} has no such group");
                self.differences.insert(difference);
                continue;
            };
            // The others are Bevy's.
            if !layout.label.starts_with("gi/") {
                continue;
            }
            let entry = layout.entries.iter().position(|e| e.binding == index);
            let named = self.layouts.get(&*layout.label);
            let bound = entry.zip(named).map(|(entry, named)| {
                let ty = layout.entries[entry].ty;
                (named.declarations(group).swap_remove(entry), ty)
            });
            let Some((bound, ty)) = bound else {
                let difference = format!("{name} declares `{declared}`, {} has none", layout.label);
                self.differences.insert(difference);
                continue;
            };
            self.read.insert((layout.label.to_string(), index));
            let same_size = match ty {
                BindingType::Buffer {
                    min_binding_size, ..
                } => min_binding_size.is_some_and(|bytes| bytes.get() == size),
                _ => true,
            };
            if bound != declared || !same_size {
                let of_size = if same_size { "" } else { " of another size" };
                let difference = format!(
                    "{name} declares `{declared}`,\n    {} has `{bound}`{of_size}",
                    layout.label
                );
                self.differences.insert(difference);
            }
        }
        self.compared.insert(name);
    }
}

/// Groups, bindings, names, types, access and sizes of what shaders declare are those of the layouts; workgroups are as
/// large as passes say. No entry point is without a pipeline, and no entry of a layout without a reader.
#[test]
fn shaders_declare_what_is_bound() {
    let mut idle = Idle::new(WgpuLimits::defaults());
    idle.make_all_pipelines();
    let mut shaders = shaders(&idle);
    let mut comparison = Comparison {
        layouts: made::LAYOUTS.lock().unwrap().clone(),
        blocks: made::BLOCKS.lock().unwrap().clone(),
        ..Default::default()
    };
    for (number, (label, pipeline)) in idle.own_pipelines().enumerate() {
        for stage in stages(pipeline) {
            let Some(path) = stage.path() else { continue };
            let shader = shaders.get(number, stage.shader.id(), stage.defs);
            let shader = shader.unwrap_or_else(|error| panic!("{path}: {error}"));
            let entry = shader.entry(stage.entry, stage.stage);
            comparison.compare(label, pipeline, &path, &shader, entry);
        }
    }
    let Comparison {
        layouts,
        mut differences,
        compared,
        read,
        ..
    } = comparison;
    let mut all = BTreeSet::new();
    all_entry_points(Path::new("src"), &mut all);
    assert!(all.len() > 40, "only {} were found", all.len());
    differences.extend(
        all.difference(&compared)
            .map(|entry| format!("{entry} is in no pipeline")),
    );
    for (label, layout) in layouts {
        let entries = layout.descriptor().entries;
        for (entry, declaration) in entries.iter().zip(layout.declarations(0)) {
            if !read.contains(&(label.clone(), entry.binding)) {
                let declaration = declaration.trim_start_matches("@group(0) ");
                differences.insert(format!("no shader reads `{declaration}` of {label}"));
            }
        }
    }
    let differences: Vec<_> = differences.into_iter().collect();
    assert!(differences.is_empty(), "\n{}", differences.join("\n"));
}
