//! Which meshes stand in the way of which lights.

use bevy::camera::visibility::RenderLayers;

/// The different sets of render layers that meshes have.
#[derive(Default)]
pub(super) struct LayerSets(Vec<RenderLayers>);

impl LayerSets {
    /// The number of a set.
    pub fn number(&mut self, layers: &RenderLayers) -> u32 {
        let known = self.0.iter().position(|known| known == layers);
        known.unwrap_or_else(|| {
            self.0.push(layers.clone());
            self.0.len() - 1
        }) as u32
    }

    /// Sets, a bit each, that share no layer with a light's.
    pub fn passes(&self, light: &RenderLayers) -> u64 {
        let sets = self.0.iter().take(64).enumerate();
        let passing = sets.filter(|(_, layers)| !layers.intersects(light));
        passing.fold(0, |bits, (i, _)| bits | 1 << i)
    }
}
