//! Textures of pictures that do not change: those that were kept, and marks over pictures.

use std::sync::Arc;

use egui::{ColorImage, Context, TextureHandle, TextureId, TextureOptions};

/// What a texture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Still {
    /// A picture that was kept.
    Kept(u64),
    /// Marks over a picture that was kept.
    MarksOfKept(u64),
    /// Marks over the live picture of that serial number.
    MarksOfLive(u64),
}

/// The textures that are on the screen.
#[derive(Default)]
pub struct Stills(Vec<(Still, TextureHandle, bool)>);

impl Stills {
    /// The texture of `still`, made where it was not on the screen before.
    pub fn texture(
        &mut self,
        ctx: &Context,
        still: Still,
        make: impl FnOnce() -> Arc<ColorImage>,
    ) -> TextureId {
        if let Some((_, texture, used)) = self.0.iter_mut().find(|(known, ..)| *known == still) {
            *used = true;
            return texture.id();
        }
        let texture = ctx.load_texture("still", make(), TextureOptions::NEAREST);
        let id = texture.id();
        self.0.push((still, texture, true));
        id
    }

    /// Lets those go that were not asked for since the last time.
    pub fn forget_unused(&mut self) {
        self.0.retain_mut(|(_, _, used)| std::mem::take(used));
    }
}
