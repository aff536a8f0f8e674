//! Numbers that tell whether a picture must be traced again.

use std::{
    fmt::{self, Debug, Write},
    hash::{DefaultHasher, Hasher},
};

/// What is hashed besides: another path tracer makes another picture.
const SOURCES: [&str; 8] = [
    include_str!("bsdf.rs"),
    include_str!("film.rs"),
    include_str!("geometry.rs"),
    include_str!("integrator.rs"),
    include_str!("lights.rs"),
    include_str!("sampler.rs"),
    include_str!("scene.rs"),
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
    use super::*;

    #[test]
    fn every_bit_counts() {
        assert_eq!(of(&[1.0f32, 2.0]), of(&[1.0f32, 2.0]));
        assert_ne!(of(&[1.0f32, 2.0]), of(&[1.0f32, 2.0f32.next_up()]));
    }
}
