//! A folder of frames of one still view as one picture: their mean in linear light, with less noise.

use std::path::{Path, PathBuf};

use super::lights::{FULL, Lights};
use crate::picture;
use crate::planes::Planes;
use crate::stats::StatsError;

/// Endings of frames' names.
const ENDINGS: [&str; 5] = ["png", "jpg", "jpeg", "tif", "tiff"];
/// A shift from which frames are told to have moved, pixels.
const MOVED_PX: f64 = 0.3;
/// Standard errors that it must have.
const MOVED_ERRORS: f64 = 4.0;
/// Sides of the squares whose means are compared, pixels: for small shifts and for large.
const SQUARES_PX: [usize; 2] = [1, 8];
/// Fewest squares along a side.
const FEWEST_SQUARES: usize = 6;
/// A frame's light off the mean's that is told, as a share.
const FLICKER: f64 = 0.03;
/// Names that are told at most.
const MOST_NAMES: usize = 4;

/// The picture of a file or of a folder of frames, in 8-bit counts.
pub(crate) struct Still {
    pub(crate) planes: Planes,
    /// Counts from one stored value to the next.
    pub(crate) step: f64,
    /// How many frames it is the mean of.
    pub(crate) frames: usize,
    /// What should be known of it, a sentence each.
    pub(crate) told: Vec<String>,
}

/// The pictures of a row of a manifest: the file itself, or the frames of a folder, by name.
///
/// # Errors
/// A folder that cannot be read or holds no picture.
pub fn files(path: &Path) -> Result<Vec<PathBuf>, StatsError> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let name = path.display().to_string();
    let unreadable = |source| StatsError::Read {
        name: name.clone(),
        source,
    };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path).map_err(unreadable)? {
        let file = entry.map_err(unreadable)?.path();
        let ending = file
            .extension()
            .map(|ending| ending.to_string_lossy().to_lowercase());
        let hidden = file
            .file_name()
            .is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if file.is_file() && !hidden && ending.is_some_and(|e| ENDINGS.contains(&e.as_str())) {
            files.push(file);
        }
    }
    files.sort();
    match files.is_empty() {
        true => Err(StatsError::NoFrames { name }),
        false => Ok(files),
    }
}

/// The picture of a file, or the mean of a folder's frames.
pub(crate) fn still(path: &Path, lights: &Lights) -> Result<Still, StatsError> {
    let files = files(path)?;
    let (mut first, step) = planes(&files[0])?;
    if files.len() == 1 {
        return Ok(Still {
            planes: first,
            step,
            frames: 1,
            told: Vec::new(),
        });
    }
    let reference = SQUARES_PX.map(|side| Squares::new(&first, side));
    let mut told = Told::default();
    let mut levels = vec![level(&first, lights)];
    let in_light = |counts: f64| match counts >= FULL {
        true => f64::INFINITY,
        false => lights.light(counts),
    };
    let mut sums = std::mem::take(&mut first.channels)
        .map(|plane| plane.into_iter().map(in_light).collect::<Vec<f64>>());
    for file in &files[1..] {
        let (frame, _) = planes(file)?;
        if [frame.width, frame.height] != [first.width, first.height] {
            return Err(StatsError::FrameSize {
                name: file.display().to_string(),
                first: [first.width, first.height],
                got: [frame.width, frame.height],
            });
        }
        told.shift(file, moved_px(&reference, &frame));
        levels.push(level(&frame, lights));
        for (sum, plane) in sums.iter_mut().zip(&frame.channels) {
            for (sum, counts) in sum.iter_mut().zip(plane) {
                *sum += in_light(*counts);
            }
        }
    }
    let n = files.len() as f64;
    // A pixel that was at full scale in one frame is unknown.
    let counts = |sum: f64| lights.counts(sum / n);
    Ok(Still {
        planes: Planes {
            channels: sums.map(|plane| plane.into_iter().map(counts).collect()),
            ..first
        },
        step,
        frames: files.len(),
        told: told.sentences(files.len(), &levels),
    })
}

fn planes(path: &Path) -> Result<(Planes, f64), StatsError> {
    let (image, name) = picture::of_file(path)?;
    let planes = Planes::of_image(&image, &name, &|count| count)?;
    Ok((planes, picture::step(&image)))
}

/// Mean light of all channels.
fn level(planes: &Planes, lights: &Lights) -> f64 {
    let all = planes.channels.iter().flatten();
    let sum: f64 = all.map(|counts| lights.light(*counts)).sum();
    sum / (3 * planes.width * planes.height) as f64
}

/// What frames show of a vehicle that was not still.
#[derive(Default)]
struct Told {
    most_px: f64,
    moved: Vec<String>,
}

impl Told {
    fn shift(&mut self, file: &Path, shift_px: f64) {
        if shift_px > MOVED_PX {
            self.most_px = self.most_px.max(shift_px);
            let name = file.file_name().unwrap_or_default();
            self.moved.push(name.to_string_lossy().into_owned());
        }
    }

    fn sentences(self, frames: usize, levels: &[f64]) -> Vec<String> {
        let mut told = Vec::new();
        if !self.moved.is_empty() {
            let named = self.moved.len().min(MOST_NAMES);
            let more = match self.moved.len() - named {
                0 => String::new(),
                n => format!(" and {n} more"),
            };
            told.push(format!(
                "{} of {frames} frames moved against the first, by about {:.1} pixels at most, which takes detail off their mean; take them out: {}{more}",
                self.moved.len(),
                self.most_px,
                self.moved[..named].join(", ")
            ));
        }
        let mean = levels.iter().sum::<f64>() / frames as f64;
        let off = levels.iter().map(|level| (level / mean - 1.0).abs());
        let most = off.fold(0.0, f64::max);
        if most > FLICKER {
            told.push(format!(
                "the light of the {frames} frames differs by up to {:.0} % from their mean: waves above, an automatic exposure or a lamp that flickers",
                100.0 * most
            ));
        }
        told
    }
}

/// By how many pixels a frame moved: by large squares where that is more than half of one, else by small ones.
fn moved_px([small, large]: &[Squares; 2], frame: &Planes) -> f64 {
    let by_large = large.shift_of(frame);
    let is_far = |shift: &f64| *shift > 0.5 * large.side as f64;
    let moved = by_large.filter(is_far).or_else(|| small.shift_of(frame));
    moved.or(by_large).unwrap_or(0.0)
}

/// Means of squares of pixels, over all channels.
struct Squares {
    side: usize,
    size: [usize; 2],
    values: Vec<f64>,
}

impl Squares {
    fn new(planes: &Planes, side: usize) -> Self {
        let size = [planes.width / side, planes.height / side];
        let mut values = vec![0.0; size[0] * size[1]];
        for plane in &planes.channels {
            for (row, of_row) in plane
                .chunks_exact(planes.width)
                .take(size[1] * side)
                .enumerate()
            {
                let into = &mut values[row / side * size[0]..][..size[0]];
                for (value, pixels) in into.iter_mut().zip(of_row.chunks_exact(side)) {
                    *value += pixels.iter().sum::<f64>();
                }
            }
        }
        Self { side, size, values }
    }

    /// By how many pixels another picture is shifted against this (Lucas and Kanade's least squares over all squares); `None` where that is
    /// not told from none.
    fn shift_of(&self, other: &Planes) -> Option<f64> {
        let [width, height] = self.size;
        if width.min(height) < FEWEST_SQUARES {
            return None;
        }
        let other = Self::new(other, self.side);
        let total = |values: &[f64]| values.iter().sum::<f64>();
        let gain = total(&self.values) / total(&other.values).max(f64::MIN_POSITIVE);
        let at = |x: usize, y: usize| self.values[y * width + x];
        let (mut normal, mut right, mut squares, mut n) = ([0.0; 3], [0.0; 2], 0.0, 0.0);
        for y in 1..height - 1 {
            for x in 1..width - 1 {
                let across = 0.5 * (at(x + 1, y) - at(x - 1, y));
                let down = 0.5 * (at(x, y + 1) - at(x, y - 1));
                let change = gain * other.values[y * width + x] - at(x, y);
                normal[0] += across * across;
                normal[1] += across * down;
                normal[2] += down * down;
                right[0] += across * change;
                right[1] += down * change;
                squares += change * change;
                n += 1.0;
            }
        }
        let determinant = normal[0] * normal[2] - normal[1] * normal[1];
        if !(determinant > 1e-9 * normal[0] * normal[2]) {
            return None;
        }
        let across = (normal[2] * right[0] - normal[1] * right[1]) / determinant;
        let down = (normal[0] * right[1] - normal[1] * right[0]) / determinant;
        let left = (squares - across * right[0] - down * right[1]).max(0.0) / n;
        let error = (left * (normal[0] + normal[2]) / determinant).sqrt();
        let shift = across.hypot(down);
        (shift > MOVED_ERRORS * error).then_some(shift * self.side as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Encoding;
    use crate::normal::Normal;

    const SIZE: [u32; 2] = [160, 96];

    /// A texture shifted by `x` pixels, with noise of `deviation` counts.
    fn frame(x: f64, deviation: f64, seed: u64) -> image::RgbImage {
        let mut normal = Normal::new(seed);
        image::RgbImage::from_fn(SIZE[0], SIZE[1], |i, j| {
            let (u, v) = (f64::from(i) - x, f64::from(j));
            let texture = 110.0
                + 25.0 * (0.21 * u + 0.05 * v).sin()
                + 15.0 * (0.37 * v).cos() * (0.06 * u).sin();
            image::Rgb([0; 3].map(|_: u8| (texture + deviation * normal.next()).round() as u8))
        })
    }

    fn folder(frames: &[image::RgbImage]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (i, frame) in frames.iter().enumerate() {
            frame
                .save(folder.path().join(format!("f{i:03}.png")))
                .unwrap();
        }
        folder
    }

    #[test]
    fn frames_of_a_still_view_have_less_noise_and_nothing_is_told() {
        let frames: Vec<_> = (0..9).map(|seed| frame(0.0, 6.0, seed)).collect();
        let folder = folder(&frames);
        std::fs::write(folder.path().join("notes.txt"), "").unwrap();
        let still = still(folder.path(), &Lights::new(Encoding::Srgb)).unwrap();
        assert_eq!((still.frames, &still.told), (9, &Vec::new()));
        let clean = frame(0.0, 0.0, 1);
        let off = still.planes.channels[1].iter().zip(clean.pixels());
        let square: f64 = off
            .map(|(got, right)| (got - f64::from(right[1])).powi(2))
            .sum();
        let deviation = (square / f64::from(SIZE[0] * SIZE[1])).sqrt();
        assert!((deviation - 2.0).abs() < 0.15, "{deviation}");
    }

    #[test]
    fn frames_that_moved_or_flicker_are_told() {
        for (shift, told) in [(0.0, None), (0.8, Some(0.8)), (6.0, Some(6.0))] {
            let frames = [frame(0.0, 2.0, 1), frame(0.0, 2.0, 2), frame(shift, 2.0, 3)];
            let folder = folder(&frames);
            let still = still(folder.path(), &Lights::new(Encoding::Linear)).unwrap();
            match told {
                None => assert_eq!(still.told, Vec::<String>::new()),
                Some(px) => {
                    let words = &still.told[0];
                    assert!(
                        words.contains("1 of 3 frames moved") && words.contains("f002.png"),
                        "{words}"
                    );
                    let by: f64 = words
                        .split("by about ")
                        .nth(1)
                        .unwrap()
                        .split(' ')
                        .next()
                        .unwrap()
                        .parse()
                        .unwrap();
                    assert!((by / px - 1.0).abs() < 0.35, "{words}");
                }
            }
        }
        let mut dark = frame(0.0, 1.0, 5);
        dark.pixels_mut()
            .for_each(|pixel| pixel.0 = pixel.0.map(|c| c - c / 8));
        let folder = folder(&[frame(0.0, 1.0, 1), dark]);
        let still = still(folder.path(), &Lights::new(Encoding::Linear)).unwrap();
        assert!(
            still.told[0].contains("light of the 2 frames differs"),
            "{:?}",
            still.told
        );
    }

    #[test]
    fn a_pixel_at_full_scale_in_one_frame_stays_there() {
        let mut bright = frame(0.0, 0.0, 1);
        bright.put_pixel(7, 5, image::Rgb([255; 3]));
        let folder = folder(&[frame(0.0, 0.0, 1), bright]);
        let still = still(folder.path(), &Lights::new(Encoding::Srgb)).unwrap();
        assert_eq!(still.planes.channels[0][5 * SIZE[0] as usize + 7], 255.0);
    }

    #[test]
    fn folders_without_frames_and_frames_of_two_sizes_are_refused() {
        let empty = tempfile::tempdir().unwrap();
        let lights = Lights::new(Encoding::Srgb);
        let error = still(empty.path(), &lights).err().unwrap().to_string();
        assert!(error.contains("holds no picture"), "{error}");
        let folder = folder(&[frame(0.0, 0.0, 1), image::RgbImage::new(40, 40)]);
        let error = still(folder.path(), &lights).err().unwrap().to_string();
        assert!(
            error.contains("f001.png") && error.contains("160 x 96"),
            "{error}"
        );
    }
}
