//! Colours of pixels that are stored with fewer: behind a Bayer filter, or with one pair of differences of colour for two pixels.

/// Samples in rows, each of a whole number of bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows<'a> {
    pub(super) data: &'a [u8],
    /// Bytes from one row to the next.
    pub(super) step: usize,
    pub(super) width: usize,
    pub(super) height: usize,
}

impl<'a> Rows<'a> {
    /// The first bytes of a row.
    pub(super) fn row(&self, y: usize, bytes: usize) -> &'a [u8] {
        &self.data[y * self.step..][..bytes]
    }
}

/// Samples behind a Bayer filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Mosaic {
    /// Column and row, 0 or 1, of the red sample among the first four.
    pub(super) red: [usize; 2],
    /// Bytes of a sample, 1 or 2.
    pub(super) bytes: usize,
}

impl Mosaic {
    /// Red, green and blue of every pixel: its own sample and the means of the nearest of the others, as the bilinear rule of OpenCV and
    /// `image_proc` has it but for the outermost pixels, where samples are mirrored. Both sides are at least 2 pixels.
    pub(super) fn colours(self, rows: &Rows<'_>, is_bigendian: bool) -> Vec<u16> {
        let samples = |y: usize| self.samples(rows.row(y, rows.width * self.bytes), is_bigendian);
        let mut colours = Vec::with_capacity(3 * rows.width * rows.height);
        let mut here = samples(0);
        let mut below = samples(1);
        let mut above = below.clone();
        for y in 0..rows.height {
            let is_red_row = y % 2 == self.red[1];
            for x in 0..rows.width {
                let [left, right] = [
                    x.checked_sub(1).unwrap_or(1),
                    if x + 1 < rows.width { x + 1 } else { x - 1 },
                ];
                let beside = [here[left], here[right]];
                let over = [above[x], below[x]];
                let is_red_column = x % 2 == self.red[0];
                let own = here[x];
                // The colour of this row at this pixel, green, and the colour of the rows beside.
                let [of_row, green, of_others] = match is_red_column == is_red_row {
                    true => {
                        let corners = [above[left], above[right], below[left], below[right]];
                        [
                            own,
                            mean(&[beside[0], beside[1], over[0], over[1]]),
                            mean(&corners),
                        ]
                    }
                    false => [mean(&beside), own, mean(&over)],
                };
                colours.extend(match is_red_row {
                    true => [of_row, green, of_others],
                    false => [of_others, green, of_row],
                });
            }
            above = std::mem::replace(&mut here, below);
            below = match y + 2 < rows.height {
                true => samples(y + 2),
                false => above.clone(),
            };
        }
        colours
    }

    fn samples(self, row: &[u8], is_bigendian: bool) -> Vec<u16> {
        match (self.bytes, is_bigendian) {
            (1, _) => row.iter().map(|&sample| sample.into()).collect(),
            (_, true) => pairs(row).map(u16::from_be_bytes).collect(),
            (_, false) => pairs(row).map(u16::from_le_bytes).collect(),
        }
    }
}

fn pairs(row: &[u8]) -> impl Iterator<Item = [u8; 2]> {
    row.chunks_exact(2).map(|pair| [pair[0], pair[1]])
}

/// Rounded to the nearest.
fn mean(samples: &[u16]) -> u16 {
    let count = samples.len() as u32;
    let sum: u32 = samples.iter().map(|&sample| u32::from(sample)).sum();
    ((sum + count / 2) / count) as u16
}

/// Luma of two pixels with one pair of differences of colour (4:2:2), 8 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Chroma {
    /// Whether luma is before chroma (YUYV) or behind it (UYVY).
    pub(super) luma_first: bool,
}

impl Chroma {
    /// Red, green and blue of every pixel by ITU-R BT.601 with luma from 16 to 235, as OpenCV has it. The width is even.
    pub(super) fn colours(self, rows: &Rows<'_>) -> Vec<u8> {
        let mut colours = Vec::with_capacity(3 * rows.width * rows.height);
        for y in 0..rows.height {
            for pair in rows.row(y, 2 * rows.width).chunks_exact(4) {
                let [first, u, second, v] = match self.luma_first {
                    true => [pair[0], pair[1], pair[2], pair[3]],
                    false => [pair[1], pair[0], pair[3], pair[2]],
                };
                for luma in [first, second] {
                    colours.extend(of_luma(luma, u, v));
                }
            }
        }
        colours
    }
}

fn of_luma(luma: u8, u: u8, v: u8) -> [u8; 3] {
    let light = 255.0 / 219.0 * (f32::from(luma) - 16.0).max(0.0);
    let [u, v] = [u, v].map(|difference| f32::from(difference) - 128.0);
    let (to_blue, to_red) = (2.018 * u, 1.596 * v);
    // `as` keeps to 0 and 255.
    [
        light + to_red,
        light - 0.391 * u - 0.813 * v,
        light + to_blue,
    ]
    .map(|value| value.round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATTERNS: [[usize; 2]; 4] = [[0, 0], [1, 1], [1, 0], [0, 1]];

    /// Red, green and blue of a picture that is even along lines.
    fn plane(x: usize, y: usize) -> [u16; 3] {
        let [x, y] = [x as u16, y as u16];
        [400 + 6 * x + 2 * y, 900 + 4 * y, 1200 - 4 * x + 8 * y]
    }

    fn behind_filter(red: [usize; 2], width: usize, height: usize) -> Vec<u16> {
        let mut samples = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let colour = match (x % 2 == red[0], y % 2 == red[1]) {
                    (true, true) => 0,
                    (false, false) => 2,
                    _ => 1,
                };
                samples.push(plane(x, y)[colour]);
            }
        }
        samples
    }

    #[test]
    fn a_filter_gives_back_what_is_even_between_its_samples() {
        let (width, height) = (7, 6);
        for red in PATTERNS {
            for is_bigendian in [false, true] {
                let samples = behind_filter(red, width, height);
                let bytes = samples.iter().flat_map(|sample| match is_bigendian {
                    true => sample.to_be_bytes(),
                    false => sample.to_le_bytes(),
                });
                let rows = Rows {
                    data: &bytes.collect::<Vec<u8>>(),
                    step: 2 * width,
                    width,
                    height,
                };
                let colours = Mosaic { red, bytes: 2 }.colours(&rows, is_bigendian);
                assert_eq!(colours.len(), 3 * width * height);
                for y in 1..height - 1 {
                    for x in 1..width - 1 {
                        let found = &colours[3 * (y * width + x)..][..3];
                        assert_eq!(found, plane(x, y), "{red:?}: {x}, {y}");
                    }
                }
            }
        }
    }

    #[test]
    fn edges_take_the_neighbours_that_there_are() {
        // Red at the upper left: its green is of the pixels to the right and below, its blue of the one across.
        let rows = Rows {
            data: &[10, 20, 40, 80],
            step: 2,
            width: 2,
            height: 2,
        };
        let mosaic = Mosaic {
            red: [0, 0],
            bytes: 1,
        };
        let colours = mosaic.colours(&rows, false);
        let expected = [[10, 30, 80], [10, 20, 80], [10, 40, 80], [10, 30, 80]];
        assert_eq!(colours, expected.concat());
    }

    #[test]
    fn luma_and_differences_make_colours() {
        // Black, white and the primaries as colour bars of ITU-R BT.601 have them, and what is below black.
        let pairs = [
            ([16, 128, 128], [0, 0, 0]),
            ([235, 128, 128], [255, 255, 255]),
            ([81, 90, 240], [255, 0, 0]),
            ([145, 54, 34], [0, 255, 0]),
            ([41, 240, 110], [0, 0, 255]),
            ([0, 128, 128], [0, 0, 0]),
        ];
        for ([luma, u, v], expected) in pairs {
            for luma_first in [false, true] {
                let data = match luma_first {
                    true => [luma, u, 235, v],
                    false => [u, luma, v, 235],
                };
                let rows = Rows {
                    data: &data,
                    step: 4,
                    width: 2,
                    height: 1,
                };
                let colours = Chroma { luma_first }.colours(&rows);
                for (found, expected) in colours.iter().zip(expected) {
                    assert!(found.abs_diff(expected) <= 1, "{expected:?}: {colours:?}");
                }
                assert!(
                    colours[3..]
                        .iter()
                        .zip(&colours)
                        .all(|(light, own)| light >= own)
                );
            }
        }
    }
}
