//! Numbers that tell whether a picture must be traced again.

use std::{
    fmt::{self, Debug, Write},
    hash::{DefaultHasher, Hasher},
};

/// What is hashed besides: another path tracer makes another picture.
const SOURCES: [&str; 19] = [
    include_str!("bsdf.rs"),
    include_str!("distribution.rs"),
    include_str!("emitters.rs"),
    include_str!("film.rs"),
    include_str!("geometry.rs"),
    include_str!("integrator.rs"),
    include_str!("lights.rs"),
    include_str!("material.rs"),
    include_str!("picture.rs"),
    include_str!("sampler.rs"),
    include_str!("scene/layers.rs"),
    include_str!("scene/lights.rs"),
    include_str!("scene/materials.rs"),
    include_str!("scene/meshes.rs"),
    include_str!("scene/mod.rs"),
    include_str!("scene/sky.rs"),
    include_str!("scene/warnings.rs"),
    include_str!("sky.rs"),
    include_str!("texture.rs"),
];

/// Text that goes into a hash.
struct Text(DefaultHasher);

impl Write for Text {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.write(text.as_bytes());
        Ok(())
    }
}

/// Hashes what `Debug` shows of a value, which no field is left out of.
pub(super) fn of(value: &impl Debug) -> u64 {
    let mut text = Text(DefaultHasher::new());
    for source in SOURCES {
        text.0.write(source.as_bytes());
    }
    write!(text, "{value:?}").expect("a hash takes any text");
    text.0.finish()
}

#[cfg(test)]
mod tests {
    use std::{fs, path::Path};

    use super::*;

    /// All but those whose values are hashed anyway, or that say nothing about light.
    #[test]
    fn every_source_counts() {
        const OTHERS: [&str; 3] = ["fingerprint.rs", "mod.rs", "settings.rs"];
        let folder = Path::new("src/reference");
        let read = |path: &Path| {
            fs::read_dir(path)
                .unwrap()
                .map(|entry| entry.unwrap().path())
        };
        let top = read(folder).filter(|path| {
            let name = path.file_name().unwrap().to_str().unwrap();
            path.is_file() && !OTHERS.contains(&name)
        });
        for path in top.chain(read(&folder.join("scene"))) {
            let text = fs::read_to_string(&path).unwrap();
            assert!(
                SOURCES.contains(&&text[..]),
                "{} is left out",
                path.display()
            );
        }
    }

    #[test]
    fn every_bit_counts() {
        assert_eq!(of(&[1.0f32, 2.0]), of(&[1.0f32, 2.0]));
        assert_ne!(of(&[1.0f32, 2.0]), of(&[1.0f32, 2.0f32.next_up()]));
    }
}
