//! Opens any glTF, or a bundled scene by name, with global illumination; in a window, or headless
//! for pictures, luminances and statistics. `--help` lists the options.

use std::{path::PathBuf, process::ExitCode};

use bevy::prelude::*;
use bevy_gi::{ViewEntry, prelude::*, reference::ReferenceSettings};
use bevy_gi_tools::{
    adapter, capture,
    controls::{self, ControlsPlugin},
    open::{self, OpenPlugin, SceneOptions},
    options::{self, SettingsOptions, Technique, size, technique, view},
    projector::Projector,
    reference, scenes,
    studio::{Film, Studio},
    truth::ShowTruth,
    window,
};
use clap::Parser;

/// Opens a glTF file or a bundled scene with global illumination.
#[derive(Parser, Clone, Debug)]
#[command(name = "viewer", allow_negative_numbers = true)]
struct Options {
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    settings: SettingsOptions,
    /// How indirect light is computed: off, vct, hints, reference. Default: hints; in a bundled scene, what shows it
    /// best.
    #[arg(long, value_parser = technique)]
    technique: Option<Technique>,
    /// No window: render, write, exit.
    #[arg(long)]
    headless: bool,
    /// Width x height, pixels.
    #[arg(long, default_value = "1280x720", value_parser = size)]
    size: UVec2,
    /// Frames rendered before the capture, 1/60 s each; with the reference, paths a pixel.
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
    /// What is shown; --list names all.
    #[arg(long, value_parser = view)]
    view: Option<ViewEntry>,
    /// Writes what the colours of the view mean into a headless picture, which has it beside it otherwise.
    #[arg(long, requires = "headless")]
    legend: bool,
    /// Picture: .png as seen, .exr luminances in nits before exposure and tone mapping.
    #[arg(long, value_parser = picture_path)]
    out: Option<PathBuf>,
    /// Adapter, passes, memory and settings as JSON.
    #[arg(long)]
    stats: Option<PathBuf>,
    /// Lists techniques, views, scenes and settings.
    #[arg(long)]
    list: bool,
}

fn picture_path(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let known =
        |e: &std::ffi::OsStr| e.eq_ignore_ascii_case("png") || e.eq_ignore_ascii_case("exr");
    match path.extension() {
        Some(extension) if known(extension) => Ok(path),
        _ => Err("a .png or .exr file is wanted".into()),
    }
}

fn main() -> ExitCode {
    let options = Options::parse();
    if options.list {
        options::list();
        return ExitCode::SUCCESS;
    }
    let result = adapter::find().and_then(|_| match options.headless {
        true => headless(options),
        false => window(options),
    });
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("viewer: {error}");
            ExitCode::FAILURE
        }
    }
}

fn configure(world: &mut World, options: &Options) -> Result<(), String> {
    let scene = options.scene.scene.as_deref().and_then(scenes::find);
    // A file of settings has a technique of its own.
    let usual = scene.filter(|_| options.settings.settings.is_none());
    let usual = usual.and_then(|scene| scene.technique).map(Technique::Gi);
    options.settings.apply(world, options.technique.or(usual))?;
    if let Some(shown) = options.view {
        world.resource_mut::<GiDebugSettings>().view = shown.view;
    }
    Ok(())
}

fn window(options: Options) -> Result<(), String> {
    if options.out.is_some() || options.stats.is_some() {
        return Err("--out and --stats need --headless".into());
    }
    let mut app = window::app("bevy_gi viewer", options.size);
    app.add_plugins((GiPlugins, ControlsPlugin { help: "" }))
        .insert_resource(ShowTruth(options.technique == Some(Technique::Reference)));
    configure(app.world_mut(), &options)?;
    app.add_plugins(OpenPlugin::new(options.scene)?);
    app.world_mut().spawn(open::camera());
    app.run();
    Ok(())
}

fn headless(options: Options) -> Result<(), String> {
    let is_exr = |path: &PathBuf| {
        path.extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("exr"))
    };
    let exr = options.out.as_ref().is_some_and(is_exr);
    let shown = options
        .view
        .unwrap_or_else(|| *GiViews::default().get(GiView::Full));
    let view = shown.view;
    let film = match (exr, shown.is_luminance) {
        (true, _) => Film::Linear,
        (false, true) => Film::Seen,
        (false, false) => Film::Encoded,
    };
    let mut studio = Studio::open(options.scene.clone(), options.size, film, |world| {
        configure(world, &options)
    })?;
    let scale = if shown.is_luminance {
        studio.exposure
    } else {
        1.0
    };
    let picture = if options.technique == Some(Technique::Reference) {
        let (camera, size) = (studio.camera, studio.size);
        let settings = *studio.world().resource::<ReferenceSettings>();
        let mut traced = reference::prepare(studio.world(), camera, size, settings)?;
        reference::refine(&mut traced, options.frames);
        let picture = reference::picture(&traced, view)?;
        match film {
            Film::Linear => picture,
            Film::Encoded => picture.encoded(),
            Film::Seen => {
                let projector = Projector::new(&mut studio.headless, size);
                projector.picture(&mut studio.headless, &picture, scale)
            }
        }
    } else {
        if options.legend {
            let camera = studio.camera;
            let mut legend = studio
                .world()
                .spawn((controls::panel(), UiTargetCamera(camera)));
            legend.insert(Text(format!("{view}: {}", shown.legend)));
        }
        studio.settle(options.frames);
        let picture = studio.picture();
        if exr {
            picture.scaled(1.0 / scale)
        } else {
            picture
        }
    };
    if let Some(path) = &options.out {
        capture::write(&picture, path)?;
        match view {
            GiView::Full => println!("{}", path.display()),
            _ => println!("{}: {view}, {}", path.display(), shown.legend),
        }
    }
    if let Some(path) = &options.stats {
        let stats = capture::statistics(&studio.headless);
        let text = serde_json::to_string_pretty(&stats).map_err(|e| e.to_string())?;
        std::fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))?;
        println!("{}", path.display());
    }
    Ok(())
}
