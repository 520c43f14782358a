//! What of a picture is not the target: parts of the vehicle, a cable. Left out of all that is measured.

use std::path::Path;

use serde::Deserialize;

use crate::picture;
use crate::planes::Planes;

/// The value of the field `format`.
const FORMAT: &str = "uw-mask/1";
/// Counts of a mask's picture from which a pixel is of the target.
const TARGET: f64 = 127.5;
/// Longest side, pixels, as of pictures.
const MAX_SIDE_PX: u32 = 32_768;

/// A mask cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {message}")]
pub struct MaskError {
    /// File.
    pub file: String,
    /// Field, value and what would be right.
    pub message: String,
}

/// The pixels of a camera's pictures that are left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Mask {
    /// File that it is from, for messages.
    pub name: String,
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// Whether a pixel is left out, row by row from the top left.
    left_out: Vec<bool>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    width: u32,
    height: u32,
    polygon: Vec<Polygon>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Polygon {
    points: Vec<[f64; 2]>,
}

impl Mask {
    /// Reads a mask: polygons (`*.toml`, uw-mask/1), or a picture whose dark pixels are left out.
    ///
    /// # Errors
    /// A file that is neither, a point outside of the picture, a mask that leaves nothing out or nothing over.
    pub fn read(path: &Path) -> Result<Self, MaskError> {
        let name = path.display().to_string();
        let wrong = |message: String| MaskError {
            file: name.clone(),
            message,
        };
        if path.extension().is_some_and(|ending| ending == "toml") {
            let text = std::fs::read_to_string(path)
                .map_err(|error| wrong(format!("cannot be read: {error}")))?;
            return Self::parse(&text, &name);
        }
        let unusable = |error| MaskError {
            file: "--mask".to_owned(),
            message: format!(
                "{error}; a mask is a picture or a file *.toml of format \"{FORMAT}\""
            ),
        };
        let (image, _) = picture::of_file(path).map_err(unusable)?;
        let planes = Planes::of_image(&image, &name, &|count| count).map_err(unusable)?;
        let dark = |i: usize| planes.channels.iter().all(|plane| plane[i] < TARGET);
        let left_out = (0..planes.width * planes.height).map(dark).collect();
        Self::new(name.clone(), [planes.width, planes.height], left_out).map_err(wrong)
    }

    /// Polygons of a text of format uw-mask/1; `name` is for messages.
    ///
    /// # Errors
    /// As of [`Mask::read`].
    pub fn parse(text: &str, name: &str) -> Result<Self, MaskError> {
        let wrong = |message: String| MaskError {
            file: name.to_owned(),
            message,
        };
        let file: File =
            toml::from_str(text).map_err(|error| wrong(error.to_string().trim().to_owned()))?;
        if file.format != FORMAT {
            return Err(wrong(format!(
                "format must be \"{FORMAT}\", got {:?}",
                file.format
            )));
        }
        for (field, side) in [("width", file.width), ("height", file.height)] {
            if !(1..=MAX_SIDE_PX).contains(&side) {
                return Err(wrong(format!(
                    "{field} must be 1 to {MAX_SIDE_PX} pixels, got {side}"
                )));
            }
        }
        let size = [file.width as usize, file.height as usize];
        let mut left_out = vec![false; size[0] * size[1]];
        for (i, polygon) in file.polygon.iter().enumerate() {
            check(&polygon.points, size)
                .map_err(|what| wrong(format!("polygon {}: {what}", i + 1)))?;
            fill(&polygon.points, size, &mut left_out);
        }
        Self::new(name.to_owned(), size, left_out).map_err(wrong)
    }

    fn new(name: String, [width, height]: [usize; 2], left_out: Vec<bool>) -> Result<Self, String> {
        match left_out.iter().filter(|out| **out).count() {
            0 => Err("the mask leaves nothing out".to_owned()),
            n if n == left_out.len() => {
                Err("the mask leaves nothing of the picture over".to_owned())
            }
            _ => Ok(Self {
                name,
                width,
                height,
                left_out,
            }),
        }
    }

    /// Share of the pixels that are left out, in (0, 1).
    pub fn share(&self) -> f64 {
        let out = self.left_out.iter().filter(|out| **out).count();
        out as f64 / self.left_out.len() as f64
    }

    /// Leaves the pixels out of a picture; what would be right where it has another size.
    pub(crate) fn apply(&self, planes: &mut Planes) -> Result<(), String> {
        if [planes.width, planes.height] != [self.width, self.height] {
            return Err(format!(
                "must have the mask's {} x {} pixels ({}), got {} x {}",
                self.width, self.height, self.name, planes.width, planes.height
            ));
        }
        for plane in &mut planes.channels {
            let pixels = plane.iter_mut().zip(&self.left_out);
            pixels
                .filter(|(_, out)| **out)
                .for_each(|(value, _)| *value = f64::NAN);
        }
        Ok(())
    }
}

fn check(points: &[[f64; 2]], [width, height]: [usize; 2]) -> Result<(), String> {
    if points.len() < 3 {
        return Err(format!("must have 3 points or more, got {}", points.len()));
    }
    let inside = |p: &[f64; 2]| {
        (0.0..=width as f64).contains(&p[0]) && (0.0..=height as f64).contains(&p[1])
    };
    match points.iter().position(|p| !inside(p)) {
        Some(i) => Err(format!(
            "point {} must be in 0 .. {width} across and 0 .. {height} down (pixels from the top left corner), got [{}, {}]",
            i + 1,
            points[i][0],
            points[i][1]
        )),
        None => Ok(()),
    }
}

/// Marks the pixels whose middles are inside of a polygon (an odd number of edges to their left).
fn fill(points: &[[f64; 2]], [width, height]: [usize; 2], left_out: &mut [bool]) {
    for (row, pixels) in left_out.chunks_exact_mut(width).enumerate().take(height) {
        let y = row as f64 + 0.5;
        let next = points.iter().cycle().skip(1);
        let mut crossings: Vec<f64> = (points.iter().zip(next))
            .filter(|(from, to)| (from[1] <= y) != (to[1] <= y))
            .map(|(from, to)| from[0] + (y - from[1]) / (to[1] - from[1]) * (to[0] - from[0]))
            .collect();
        crossings.sort_by(f64::total_cmp);
        for pair in crossings.chunks_exact(2) {
            // Pixels whose middles lie between.
            let first = (pair[0] - 0.5).ceil().max(0.0) as usize;
            let end = ((pair[1] - 0.5).ceil().max(0.0) as usize).min(width);
            pixels[first.min(end)..end].fill(true);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(points: &str) -> String {
        format!("format = \"uw-mask/1\"\nwidth = 20\nheight = 12\n[[polygon]]\npoints = {points}\n")
    }

    #[test]
    fn pixels_inside_of_a_polygon_are_left_out() {
        let mask = Mask::parse(&text("[[2, 3], [6, 3], [6, 8], [2, 8]]"), "m.toml").unwrap();
        let out = |x: usize, y: usize| mask.left_out[y * 20 + x];
        assert_eq!(mask.share(), 20.0 / 240.0);
        assert!(out(2, 3) && out(5, 7) && !out(6, 5) && !out(1, 5) && !out(3, 8));
        // A triangle has half of its square, whichever way its points go.
        for points in ["[[0, 0], [12, 0], [0, 12]]", "[[0, 12], [12, 0], [0, 0]]"] {
            let mask = Mask::parse(&text(points), "m.toml").unwrap();
            assert!(
                (mask.share() * 240.0 - 72.0).abs() <= 6.0,
                "{}",
                mask.share()
            );
        }
    }

    #[test]
    fn what_cannot_be_used_is_named() {
        for (given, words) in [
            (
                text("[[2, 3], [26, 3], [6, 8]]"),
                "polygon 1: point 2 must be in 0 .. 20 across",
            ),
            (text("[[2, 3], [6, nan], [6, 8]]"), "point 2 must be"),
            (text("[[2, 3], [6, 3]]"), "3 points or more, got 2"),
            (text("[[1, 1], [1, 1], [1, 1]]"), "leaves nothing out"),
            (
                text("[[0, 0], [20, 0], [20, 12], [0, 12]]"),
                "nothing of the picture over",
            ),
            (text("3").replace("mask/1", "mask/2"), "points"),
            (
                text("[]").replace("width = 20", "width = 0"),
                "width must be 1 to",
            ),
            (text("[]").replace("width", "widht"), "widht"),
        ] {
            let message = Mask::parse(&given, "m.toml").unwrap_err().to_string();
            assert!(
                message.starts_with("m.toml: ") && message.contains(words),
                "{message}"
            );
        }
    }
}
