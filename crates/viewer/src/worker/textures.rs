//! Textures on the window's adapter: those that are no longer shown take the next pictures.

use std::sync::Arc;

use eframe::wgpu::Texture;
use uw_render::gpu::{Gpu, GpuError};

/// The textures of pictures.
#[derive(Default)]
pub struct Textures {
    all: Vec<Arc<Texture>>,
}

impl Textures {
    /// A texture of this size, pixels, that nobody looks at.
    ///
    /// # Errors
    /// The adapter has none.
    pub fn take(&mut self, gpu: &Gpu, [width, height]: [u32; 2]) -> Result<Arc<Texture>, GpuError> {
        // Whoever shows a picture holds its texture.
        let is_free = |texture: &Arc<Texture>| Arc::strong_count(texture) == 1;
        let fits = |texture: &Arc<Texture>| (texture.width(), texture.height()) == (width, height);
        self.all
            .retain(|texture| fits(texture) || !is_free(texture));
        if let Some(texture) = self.all.iter().find(|t| fits(t) && is_free(t)) {
            return Ok(Arc::clone(texture));
        }
        let texture = Arc::new(gpu.texture([width, height])?);
        self.all.push(Arc::clone(&texture));
        Ok(texture)
    }
}
