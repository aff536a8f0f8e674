//! What could not be taken over from the world.

/// Warnings in words, each once.
#[derive(Debug, Default)]
pub(super) struct Warnings(pub Vec<String>);

impl Warnings {
    pub fn add(&mut self, warning: String) {
        if !self.0.contains(&warning) {
            self.0.push(warning);
        }
    }
}
