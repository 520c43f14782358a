//! Contact sheets: what the methods saw, as JPEG (a sheet of noisy pictures is megabytes as PNG).

use std::path::Path;

use image::codecs::jpeg::JpegEncoder;
use plotters::prelude::*;
use uw_render::image::{Counts, Frame};

use crate::error::EvalError;
use crate::files::write_bytes;

/// Width of the labels left of the rows and height of those above the columns, pixels.
const LABEL_PX: (u32, u32) = (150, 22);
/// White between pictures, pixels.
const GAP_PX: u32 = 3;
/// Quality of the JPEG, 1 to 100.
const QUALITY: u8 = 85;

/// Pictures in rows and columns.
pub struct Sheet {
    /// Labels above the columns.
    pub columns: Vec<String>,
    /// Label and pictures of each row; a row has as many pictures as there are columns, all of one size.
    pub rows: Vec<(String, Vec<Frame>)>,
}

impl Sheet {
    /// Writes the sheet as JPEG.
    pub fn write(&self, path: &Path) -> Result<(), EvalError> {
        let Some(first) = self.rows.first().and_then(|(_, frames)| frames.first()) else {
            return Ok(());
        };
        let (tile_width, tile_height) = (first.width + GAP_PX, first.height + GAP_PX);
        let width = LABEL_PX.0 + tile_width * self.columns.len() as u32;
        let height = LABEL_PX.1 + tile_height * self.rows.len() as u32;
        let mut pixels = vec![255_u8; 3 * width as usize * height as usize];
        self.write_labels(&mut pixels, (width, height), (tile_width, tile_height))
            .map_err(|reason| EvalError::output(path, reason))?;
        for (row, (_, frames)) in self.rows.iter().enumerate() {
            for (column, frame) in frames.iter().enumerate() {
                let left = LABEL_PX.0 + tile_width * column as u32;
                let top = LABEL_PX.1 + tile_height * row as u32;
                paste(frame, &mut pixels, width, left, top);
            }
        }
        let mut bytes = Vec::new();
        let colour = image::ExtendedColorType::Rgb8;
        JpegEncoder::new_with_quality(&mut bytes, QUALITY)
            .encode(&pixels, width, height, colour)
            .map_err(|e| EvalError::output(path, e))?;
        write_bytes(path, &bytes)
    }

    fn write_labels(
        &self,
        pixels: &mut [u8],
        size: (u32, u32),
        (tile_width, tile_height): (u32, u32),
    ) -> Result<(), String> {
        uw_plot::use_font()?;
        let area = BitMapBackend::with_buffer(pixels, size).into_drawing_area();
        let font = ("sans-serif", 14).into_font();
        let write = |text: &str, left: u32, top: u32| {
            let corner = (left as i32, top as i32);
            let label = Text::new(text.to_owned(), corner, font.clone());
            area.draw(&label).map_err(|e| e.to_string())
        };
        for (column, name) in self.columns.iter().enumerate() {
            write(name, LABEL_PX.0 + tile_width * column as u32, 4)?;
        }
        for (row, (name, _)) in self.rows.iter().enumerate() {
            let top = LABEL_PX.1 + tile_height * row as u32 + tile_height / 2 - 8;
            write(name, 4, top)?;
        }
        area.present().map_err(|e| e.to_string())
    }
}

fn paste(frame: &Frame, pixels: &mut [u8], width: u32, left: u32, top: u32) {
    let line = 3 * frame.width as usize;
    let counts = match &frame.counts {
        Counts::Bits8(counts) => counts.clone(),
        Counts::Bits16(counts) => counts.iter().map(|v| (v / 257) as u8).collect(),
    };
    for (y, row) in counts.chunks_exact(line).enumerate() {
        let start = 3 * ((top as usize + y) * width as usize + left as usize);
        pixels[start..start + line].copy_from_slice(row);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_stand_where_their_labels_say() {
        let frame = |grey: u8| Frame {
            width: 30,
            height: 20,
            counts: Counts::Bits8(vec![grey; 3 * 600]),
        };
        let sheet = Sheet {
            columns: vec!["left".into(), "right".into()],
            rows: vec![
                ("one".into(), vec![frame(10), frame(20)]),
                ("two".into(), vec![frame(30), frame(40)]),
            ],
        };
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("sheet.jpg");
        sheet.write(&path).expect("written");
        let picture = image::open(&path).expect("picture").to_rgb8();
        assert_eq!(picture.dimensions(), (150 + 2 * 33, 22 + 2 * 23));
        let at = |column: u32, row: u32| picture.get_pixel(165 + 33 * column, 32 + 23 * row).0[0];
        let got = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
        // JPEG keeps even areas to a few counts.
        let near = |(got, wanted): (&u8, u8)| got.abs_diff(wanted) <= 4;
        assert!(got.iter().zip([10, 20, 30, 40]).all(near), "{got:?}");
    }
}
