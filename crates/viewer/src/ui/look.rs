//! What the vehicle's camera sees.

use std::sync::Arc;

use egui::{ColorImage, Image, TextureHandle, TextureOptions, Ui};

use crate::guidance::Look;

/// Most height of the picture, points.
const HEIGHT: f32 = 92.0;
/// Of the noise of its pixels.
const SEED: u64 = 1;

/// Shows the image at a lamp level.
pub fn show(ui: &mut Ui, look: &Arc<Look>, light_pct: f64) {
    let texture = texture(ui, look, light_pct);
    ui.add(Image::from_texture(&texture).max_height(HEIGHT))
        .on_hover_text("What the vehicle's camera stores from here at this lamp level");
}

/// The image as a texture, made once per look and lamp level.
fn texture(ui: &Ui, look: &Arc<Look>, light_pct: f64) -> TextureHandle {
    type KeptLook = (Arc<Look>, f64, TextureHandle);
    let id = egui::Id::unique("look");
    let kept: Option<Arc<KeptLook>> = ui.data(|d| d.get_temp(id));
    if let Some(kept) = kept
        && Arc::ptr_eq(&kept.0, look)
        && kept.1 == light_pct
    {
        return kept.2.clone();
    }
    let counts = look.thumbnail.stored(light_pct, SEED);
    let bytes: Vec<u8> = counts.pixels.iter().flatten().map(|c| *c as u8).collect();
    let image = ColorImage::from_rgb([counts.width, counts.height], &bytes);
    let texture = ui.ctx().load_texture("look", image, TextureOptions::LINEAR);
    let kept = Arc::new((Arc::clone(look), light_pct, texture.clone()));
    ui.data_mut(|d| d.insert_temp(id, kept));
    texture
}
