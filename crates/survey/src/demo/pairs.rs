//! Before and after beside each other, with distance, lamps and contrast written above each picture.

use std::path::Path;

use image::RgbImage;
use image::imageops::{FilterType, overlay, resize};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use uw_render::image::{Counts, Frame, read_frame, write_frame};

use super::{DemoError, Visit};

/// Width of one picture, pixels.
const WIDTH: u32 = 640;
/// Space around the pictures, pixels.
const MARGIN: u32 = 12;
/// Height of the lines above a picture, pixels.
const HEAD: u32 = 64;
/// Sizes of the two lines, pixels.
const LINES: [u32; 2] = [22, 17];

/// Writes `png` from the pictures before and after of a visit.
pub(super) fn write(
    png: &Path,
    before: &Path,
    after: &Path,
    visit: &Visit,
) -> Result<(), DemoError> {
    let failed = |path: &Path, reason: String| DemoError::Output {
        path: path.display().to_string(),
        reason,
    };
    uw_plot::use_font().map_err(|reason| failed(png, reason))?;
    let mut pictures = Vec::new();
    for path in [before, after] {
        let picture = rgb8(&read_frame(path)?)
            .ok_or_else(|| failed(path, "the picture has the wrong size".into()))?;
        let height = (WIDTH * picture.height()).div_ceil(picture.width().max(1));
        pictures.push(resize(&picture, WIDTH, height.max(1), FilterType::Triangle));
    }
    let height = pictures.iter().map(RgbImage::height).max().unwrap_or(0);
    let size = (2 * WIDTH + 3 * MARGIN, HEAD + height + MARGIN);
    let mut buffer = vec![0; 3 * size.0 as usize * size.1 as usize];
    draw_heads(&mut buffer, size, visit).map_err(|e| failed(png, e))?;
    let mut sheet = RgbImage::from_raw(size.0, size.1, buffer)
        .ok_or_else(|| failed(png, "the picture has the wrong size".into()))?;
    for (picture, x) in pictures.iter().zip(columns()) {
        overlay(&mut sheet, picture, i64::from(x), i64::from(HEAD));
    }
    let (width, height) = sheet.dimensions();
    let counts = Counts::Bits8(sheet.into_raw());
    Ok(write_frame(
        png,
        &Frame {
            width,
            height,
            counts,
        },
    )?)
}

/// A frame with eight bits per channel.
fn rgb8(frame: &Frame) -> Option<RgbImage> {
    let counts = match &frame.counts {
        Counts::Bits8(counts) => counts.clone(),
        Counts::Bits16(counts) => counts.iter().map(|count| (count >> 8) as u8).collect(),
    };
    RgbImage::from_raw(frame.width, frame.height, counts)
}

/// Left edges of the two pictures.
fn columns() -> [u32; 2] {
    [MARGIN, WIDTH + 2 * MARGIN]
}

fn draw_heads(buffer: &mut [u8], size: (u32, u32), visit: &Visit) -> Result<(), String> {
    let area = BitMapBackend::with_buffer(buffer, size).into_drawing_area();
    area.fill(&WHITE).map_err(|e| e.to_string())?;
    let suggestion = &visit.suggestion;
    let heads = [
        (
            "before",
            visit.distance_m,
            visit.light_pct,
            visit.contrast_before,
        ),
        (
            "after",
            suggestion.distance_m,
            suggestion.light_pct,
            visit.contrast_after,
        ),
    ];
    for ((when, distance_m, light_pct, [r, g, b]), x) in heads.into_iter().zip(columns()) {
        let lines = [
            format!("{when}: {distance_m:.2} m away, lamps {light_pct:.0} %"),
            format!(
                "{} m deep; contrast {r:.1} red, {g:.1} green, {b:.1} blue, {:.1} on average",
                visit.depth_m,
                (r + g + b) / 3.0
            ),
        ];
        for ((line, pixels), y) in lines.into_iter().zip(LINES).zip([8, 36]) {
            let style = ("sans-serif", pixels)
                .into_font()
                .color(&BLACK)
                .pos(Pos::new(HPos::Left, VPos::Top));
            area.draw_text(&line, &style, (x as i32, y))
                .map_err(|e| e.to_string())?;
        }
    }
    area.present().map_err(|e| e.to_string())
}
