//! The texture of the picture: uploaded from the host, or the renderer's own where window and renderer share an adapter.

use std::sync::Arc;

use eframe::egui_wgpu::RenderState;
use eframe::wgpu::{FilterMode, Texture, TextureViewDescriptor};
use egui::{Context, TextureHandle, TextureId, TextureOptions};

use crate::model::display::Pixels;
use crate::worker::Frame;

/// What shows pictures.
pub struct Canvas {
    /// What draws the window.
    window: Option<RenderState>,
    uploaded: Option<TextureHandle>,
    /// The renderer's texture under its name in the window. Holding it keeps the renderer from writing to it.
    native: Option<(TextureId, Arc<Texture>)>,
    serial: u64,
}

impl Canvas {
    /// For a window; `None` where renderer and window share no adapter.
    pub fn new(window: Option<RenderState>) -> Self {
        Self {
            window,
            uploaded: None,
            native: None,
            serial: 0,
        }
    }

    /// The texture of `frame`; `None` for one on the adapter of another window.
    pub fn texture(&mut self, ctx: &Context, frame: &Frame) -> Option<TextureId> {
        let is_new = self.serial != frame.serial;
        self.serial = frame.serial;
        // Pixel for pixel there is nothing between texels to be found.
        let is_full = frame.coarseness == 1;
        match &frame.shown.pixels {
            Pixels::Image(image) => {
                self.native_off();
                let options = if is_full {
                    TextureOptions::NEAREST
                } else {
                    TextureOptions::LINEAR
                };
                let texture = match self.uploaded.take() {
                    Some(mut texture) => {
                        if is_new {
                            texture.set(image.clone(), options);
                        }
                        texture
                    }
                    None => ctx.load_texture("picture", image.clone(), options),
                };
                Some(self.uploaded.insert(texture).id())
            }
            Pixels::Texture(texture, _) => {
                self.uploaded = None;
                let filter = if is_full {
                    FilterMode::Nearest
                } else {
                    FilterMode::Linear
                };
                self.native(texture, filter, is_new)
            }
        }
    }

    /// Names the renderer's texture to the window.
    fn native(
        &mut self,
        texture: &Arc<Texture>,
        filter: FilterMode,
        is_new: bool,
    ) -> Option<TextureId> {
        let window = self.window.as_ref()?;
        if let Some((id, _)) = &self.native
            && !is_new
        {
            return Some(*id);
        }
        let view = texture.create_view(&TextureViewDescriptor::default());
        let mut renderer = window.renderer.write();
        let id = match &self.native {
            Some((id, _)) => {
                renderer.update_egui_texture_from_wgpu_texture(&window.device, &view, filter, *id);
                *id
            }
            None => renderer.register_native_texture(&window.device, &view, filter),
        };
        self.native = Some((id, Arc::clone(texture)));
        Some(id)
    }

    /// Lets go of the renderer's texture.
    fn native_off(&mut self) {
        if let (Some(window), Some((id, _))) = (&self.window, self.native.take()) {
            window.renderer.write().free_texture(&id);
        }
    }
}
