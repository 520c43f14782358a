//! What all plots share.

use plotters::coord::Shift;
use plotters::prelude::{BitMapBackend, DrawingArea, IntoDrawingArea};
use plotters::style::{FontStyle, register_font};
use uw_render::image::{Counts, Frame};

/// Makes the embedded font (DejaVu Sans) known as "sans-serif", so that plots need no font on the system.
pub fn use_font() -> Result<(), String> {
    register_font("sans-serif", FontStyle::Normal, dejavu::sans::regular())
        .map_err(|_| "the embedded font cannot be read".to_owned())
}

/// What `draw` draws on an area of `width` times `height` pixels, as a picture with 8 bits a channel.
///
/// # Errors
/// Those of `draw`.
pub fn bitmap(
    (width, height): (u32, u32),
    draw: impl FnOnce(&DrawingArea<BitMapBackend<'_>, Shift>) -> Result<(), String>,
) -> Result<Frame, String> {
    let mut counts = vec![0; 3 * width as usize * height as usize];
    draw(&BitMapBackend::with_buffer(&mut counts, (width, height)).into_drawing_area())?;
    Ok(Frame {
        width,
        height,
        counts: Counts::Bits8(counts),
    })
}
