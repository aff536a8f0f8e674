//! What passes need of a device, and the sentences that say what one lacks: before any pipeline is made, which would
//! end the app.

use bevy::{
    app::App,
    ecs::prelude::*,
    log::{error, warn},
    render::{
        RenderApp,
        render_resource::{TextureFormat, TextureUsages},
        renderer::{RenderAdapter, RenderDevice},
        settings::{WgpuFeatures, WgpuLimits},
    },
};

/// Whether global illumination can run on this device, and with which techniques. Inserted into both worlds.
///
/// Cameras whose technique cannot run render as with [`GiTechnique::OFF`](crate::GiTechnique::OFF).
#[derive(Resource, Clone, Debug, Default, PartialEq, Eq)]
pub struct GiSupport {
    /// Why none of them runs.
    missing: Option<String>,
    /// Names of the techniques, each with the reason why it does not run, if it does not. Empty until the device is there.
    techniques: Vec<(&'static str, Option<String>)>,
}

impl GiSupport {
    /// Whether the device has everything that all techniques need.
    pub fn is_supported(&self) -> bool {
        self.missing.is_none()
    }

    /// If no technique can run: what the device lacks, and how to get it, in one sentence.
    pub fn reason(&self) -> Option<&str> {
        self.missing.as_deref()
    }

    /// The same for the technique of that name.
    pub(crate) fn reason_of(&self, name: &str) -> Option<&str> {
        let own = self.techniques.iter().find(|(own, _)| *own == name);
        let own = match own {
            Some((_, why)) => why.as_deref(),
            None if self.techniques.is_empty() => None,
            None => Some("the app has no technique of that name"),
        };
        self.reason().or(own)
    }

    /// Nothing runs.
    fn without(why: String) -> Self {
        Self {
            missing: Some(format!("bevy_gi is off: {why}")),
            techniques: Vec::new(),
        }
    }

    /// The same, but for one technique.
    #[cfg(all(test, feature = "inspector"))]
    pub(crate) fn all_but<'a>(&self, name: &'static str, why: impl Into<Option<&'a str>>) -> Self {
        let mut support = self.clone();
        support.techniques.retain(|(own, _)| *own != name);
        let why = why.into().map(str::to_owned);
        support.techniques.push((name, why));
        support
    }

    /// What runs on a device of that name.
    fn of(offer: &DeviceOffer, device: &str, techniques: &[TechniqueNeeds]) -> Self {
        let common = offer.lacks_capability().or_else(|| COMMON.missing(offer));
        if let Some(what) = common {
            return Self::without(format!(
                "the device '{device}' lacks {what}; a newer driver may have it, and Vulkan, Metal or \
                 DX12 rather than OpenGL do"
            ));
        }
        let techniques = techniques.iter().map(|technique| {
            let TechniqueNeeds { name, title, needs } = technique;
            let why = needs.missing(offer).map(|what| {
                format!(
                    "{title} is off: the device '{device}' lacks {what}; cameras with it show no indirect light"
                )
            });
            (*name, why)
        });
        Self {
            missing: None,
            techniques: techniques.collect(),
        }
    }
}

/// A technique, and what it needs of a device.
pub(crate) struct TechniqueNeeds {
    /// Short name.
    pub name: &'static str,
    /// For people to read.
    pub title: &'static str,
    /// What it needs beyond [`COMMON`].
    pub needs: DeviceNeeds,
}

/// Run condition of every pass.
pub(crate) fn supported(support: Option<Res<GiSupport>>) -> bool {
    support.is_some_and(|support| support.is_supported())
}

/// What passes need of a device, of the limits that not every device has. The numbers are those of their bind
/// group layouts, which `device_tests.rs` counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeviceNeeds {
    /// Storage buffers in all layouts of a pipeline together, per shader stage.
    pub storage_buffers: u32,
    /// Storage textures in all layouts of a pipeline together, per shader stage.
    pub storage_textures: u32,
    /// Texels along the longest side of its 3D textures, at the highest settings.
    pub texture_3d: u32,
}

/// What all techniques need: surfaces, the scene's capture, and what brings the light to the picture.
pub(crate) const COMMON: DeviceNeeds = DeviceNeeds {
    storage_buffers: 6,
    storage_textures: 3,
    // Irradiance volumes: 64 probes, of three axes.
    texture_3d: 192,
};

/// Threads in the largest workgroup.
pub(crate) const WORKGROUP: u32 = 64;

/// Formats that compute shaders write.
pub(crate) const WRITTEN: [TextureFormat; 4] = [
    TextureFormat::Rgba8Unorm,
    TextureFormat::Rgba16Float,
    TextureFormat::R32Float,
    TextureFormat::Rgba32Uint,
];

/// Flags of wgpu by their names, since Bevy does not name their type, and what is missing without each.
const CAPABILITIES: [(&str, &str); 4] = [
    ("COMPUTE_SHADERS", "compute shaders"),
    (
        "FRAGMENT_WRITABLE_STORAGE",
        "storage buffers that fragment shaders can write",
    ),
    (
        "VERTEX_STORAGE",
        "storage buffers that vertex shaders can read",
    ),
    ("INDIRECT_EXECUTION", "indirect dispatch"),
];

impl DeviceNeeds {
    /// Nothing.
    pub const NONE: Self = Self {
        storage_buffers: 0,
        storage_textures: 0,
        texture_3d: 0,
    };

    /// The first thing that is not there.
    fn missing(&self, offer: &DeviceOffer) -> Option<String> {
        let limits = &offer.limits;
        [
            (
                limits.max_storage_buffers_per_shader_stage,
                self.storage_buffers,
                "storage buffers per shader stage",
            ),
            (
                limits.max_storage_textures_per_shader_stage,
                self.storage_textures,
                "storage textures per shader stage",
            ),
            (
                limits.max_texture_dimension_3d,
                self.texture_3d,
                "texels along a side of a 3D texture",
            ),
        ]
        .into_iter()
        .find(|(has, needs, _)| has < needs)
        .map(|(has, needs, what)| format!("{needs} {what} (it has {has})"))
    }
}

/// What a device has of that.
#[derive(Clone, Debug)]
struct DeviceOffer {
    limits: WgpuLimits,
    /// Names of wgpu's downlevel flags.
    capabilities: Vec<&'static str>,
    /// Those of [`WRITTEN`] that it can write.
    written: Vec<TextureFormat>,
}

impl DeviceOffer {
    fn new(device: &RenderDevice, adapter: &RenderAdapter) -> Self {
        let flags = adapter.get_downlevel_capabilities().flags;
        let features = device.features();
        // As wgpu decides it: without that feature, a device has what WebGPU guarantees.
        let own = features.contains(WgpuFeatures::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES);
        let can_write = |format: &TextureFormat| {
            let features = match own {
                true => adapter.get_texture_format_features(*format),
                false => format.guaranteed_format_features(features),
            };
            features
                .allowed_usages
                .contains(TextureUsages::STORAGE_BINDING)
        };
        Self {
            limits: device.limits(),
            capabilities: flags.iter_names().map(|(name, _)| name).collect(),
            written: WRITTEN.into_iter().filter(can_write).collect(),
        }
    }

    /// What is missing whose number does not matter.
    fn lacks_capability(&self) -> Option<String> {
        let flag = CAPABILITIES
            .into_iter()
            .find(|(flag, _)| !self.capabilities.contains(flag))
            .map(|(_, what)| what.into());
        let threads = self.limits.max_compute_invocations_per_workgroup;
        let threads = (threads < WORKGROUP).then(|| format!("workgroups of {WORKGROUP} threads"));
        let format = WRITTEN
            .into_iter()
            .find(|format| !self.written.contains(format))
            .map(|format| format!("{format:?} storage textures"));
        flag.or(threads).or(format)
    }
}

/// Inspects the device. Called once, when there is one.
pub(crate) fn detect(app: &mut App, techniques: &[TechniqueNeeds]) {
    let support = match app.get_sub_app(RenderApp) {
        None => GiSupport::without(
            "the app has no renderer (RenderPlugin is missing, or no graphics adapter was found; \
             on Linux install `mesa-vulkan-drivers`)"
                .into(),
        ),
        Some(render_app) => match (
            render_app.world().get_resource::<RenderDevice>(),
            render_app.world().get_resource::<RenderAdapter>(),
        ) {
            (Some(device), Some(adapter)) => {
                let offer = DeviceOffer::new(device, adapter);
                let name = adapter.get_info().name;
                GiSupport::of(&offer, &name, techniques)
            }
            _ => GiSupport::without("there is no graphics device".into()),
        },
    };
    if let Some(why) = support.reason() {
        error!("{why}");
    }
    for why in support
        .techniques
        .iter()
        .filter_map(|(_, why)| why.as_ref())
    {
        warn!("{why}");
    }
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        render_app.insert_resource(support.clone());
    }
    app.insert_resource(support);
}

#[cfg(test)]
mod tests {
    use wgpu::DownlevelFlags;

    use super::*;

    /// Of two made-up techniques, one needs more than [`COMMON`] of each number.
    const TECHNIQUES: [TechniqueNeeds; 2] = [
        TechniqueNeeds {
            name: "greedy",
            title: "Greedy",
            needs: DeviceNeeds {
                storage_buffers: 8,
                storage_textures: 4,
                texture_3d: 1536,
            },
        },
        TechniqueNeeds {
            name: "modest",
            title: "Modest",
            needs: COMMON,
        },
    ];

    /// A device with everything, and these limits.
    fn offer(limits: WgpuLimits) -> DeviceOffer {
        DeviceOffer {
            limits,
            capabilities: DownlevelFlags::all()
                .iter_names()
                .map(|(name, _)| name)
                .collect(),
            written: WRITTEN.into(),
        }
    }

    fn support(offer: &DeviceOffer) -> GiSupport {
        GiSupport::of(offer, "toaster", &TECHNIQUES)
    }

    /// All is off, and says so.
    #[track_caller]
    fn assert_off(offer: &DeviceOffer, what: &str) {
        let support = support(offer);
        assert!(!support.is_supported());
        let why = support.reason().unwrap();
        let says = ["bevy_gi is off", "toaster", what].map(|part| why.contains(part));
        assert!(says.iter().all(|says| *says), "{what}: {why}");
        for technique in TECHNIQUES {
            assert_eq!(support.reason_of(technique.name), Some(why));
        }
    }

    #[test]
    fn what_webgpu_guarantees_is_enough() {
        let support = support(&offer(WgpuLimits::defaults()));
        assert!(support.is_supported());
        assert_eq!(support.reason_of("greedy"), None);
        // A name that none has.
        assert!(support.reason_of("greed").is_some());
        assert_eq!(GiSupport::default().reason_of("greed"), None);
    }

    #[test]
    fn what_all_techniques_need_turns_all_of_them_off() {
        assert_off(
            &offer(WgpuLimits::downlevel_defaults()),
            "6 storage buffers per shader stage (it has 4)",
        );
        assert_off(
            &offer(WgpuLimits::downlevel_webgl2_defaults()),
            "workgroups of 64 threads",
        );
        for (flag, what) in CAPABILITIES {
            let mut without = offer(WgpuLimits::defaults());
            without.capabilities.retain(|name| *name != flag);
            assert_off(&without, what);
        }
        for format in WRITTEN {
            let mut without = offer(WgpuLimits::defaults());
            without.written.retain(|written| *written != format);
            assert_off(&without, &format!("{format:?} storage textures"));
        }
    }

    #[test]
    fn what_one_technique_needs_turns_that_one_off() {
        type Change = fn(&mut WgpuLimits);
        let changes: [(Change, &str); 3] = [
            (
                |limits| limits.max_storage_buffers_per_shader_stage = 7,
                "8 storage buffers per shader stage (it has 7)",
            ),
            (
                |limits| limits.max_storage_textures_per_shader_stage = 3,
                "4 storage textures per shader stage (it has 3)",
            ),
            (
                |limits| limits.max_texture_dimension_3d = 1024,
                "1536 texels along a side of a 3D texture (it has 1024)",
            ),
        ];
        for (change, what) in changes {
            let mut limits = WgpuLimits::defaults();
            change(&mut limits);
            let support = support(&offer(limits));
            assert!(support.is_supported() && support.reason().is_none());
            let why = support.reason_of("greedy").unwrap();
            let says = ["Greedy is off", "toaster", what].map(|part| why.contains(part));
            assert!(says.iter().all(|says| *says), "{what}: {why}");
            assert_eq!(support.reason_of("modest"), None);
        }
    }
}
