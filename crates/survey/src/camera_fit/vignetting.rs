//! Vignetting from pictures of an evenly lit board: an even polynomial of the distance from the picture's middle.

use uw_calib::Encoding;
use uw_render::image::Frame;

use super::solve::solve;
use uw_calib::vehicle::Vignetting;

/// Blocks along the longer side of a picture.
const BLOCKS: usize = 64;
/// Share of clipped pixels that is refused.
const MOST_CLIPPED: f64 = 0.01;
/// Root mean square of what the blocks' light is off the fit, over it, that is refused.
const MOST_UNEVEN: f64 = 0.03;
/// Unknowns of a fit: level, three powers of the squared radius, and a slope along the rows and columns.
const TERMS: usize = 6;

/// Columns and rows from the middle, -1 to 1 at the edges, and squared radius over that of the corner.
type Place = (f64, f64, f64);

/// What pictures of an even board say of a lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VignettingFit {
    /// The polynomial.
    pub vignetting: Vignetting,
    /// Standard errors of its three coefficients.
    pub errors: [f64; 3],
    /// Standard error of what is left of the light in the corner.
    pub corner_error: f64,
    /// Rise of the board's light from the middle to the right edge and to the lower edge over that in the middle, which was removed.
    pub slope: [f64; 2],
    /// Root mean square of what blocks of pixels are off the fit.
    pub uneven: f64,
}

/// Pictures that say nothing of vignetting.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VignettingError {
    /// No picture.
    #[error("vignetting needs a picture of an evenly lit board, got none")]
    None,
    /// Sizes differ.
    #[error(
        "picture {picture} has {got} pixels, picture 1 has {first}; all must be of one camera and size"
    )]
    Size {
        /// Which picture, from 1.
        picture: usize,
        /// Its size.
        got: String,
        /// That of the first.
        first: String,
    },
    /// Too small.
    #[error("{0} pixels are too few; at least 32 x 18 are needed")]
    Small(String),
    /// Black or full scale.
    #[error("{:.1} % of picture {picture} are black or at full scale (at most {:.0} % can be); expose for a board of about half of full scale", 100.0 * share, 100.0 * MOST_CLIPPED)]
    Clipped {
        /// Which picture, from 1.
        picture: usize,
        /// Share of pixels of channels.
        share: f64,
    },
    /// Not an even board.
    #[error("the board is not even: its light is off a vignetted one by {:.1} % (at most {:.0} %); fill the view with a plain board in even light (a clouded sky), out of focus", 100.0 * uneven, 100.0 * MOST_UNEVEN)]
    Uneven {
        /// Root mean square.
        uneven: f64,
    },
    /// No lens has it.
    #[error("the fit is no vignetting: {0}; is the board's light even?")]
    Absurd(String),
}

/// Fits the vignetting to pictures of an evenly lit board, all channels alike. Boards or lights that slope are allowed for; what falls
/// off towards all edges alike cannot be told from vignetting.
///
/// # Errors
/// Sizes that differ, clipped pictures, a board that is not even.
pub fn fit(frames: &[Frame], encoding: Encoding) -> Result<VignettingFit, VignettingError> {
    let first = frames.first().ok_or(VignettingError::None)?;
    let size = |frame: &Frame| format!("{} x {}", frame.width, frame.height);
    if let Some(i) = frames.iter().position(|frame| size(frame) != size(first)) {
        return Err(VignettingError::Size {
            picture: i + 1,
            got: size(&frames[i]),
            first: size(first),
        });
    }
    if first.width < 32 || first.height < 18 {
        return Err(VignettingError::Small(size(first)));
    }
    let blocks = blocks(frames, encoding)?;
    let (mut matrix, mut right) = (vec![vec![0.0; TERMS]; TERMS], vec![0.0; TERMS]);
    for (place, light) in &blocks {
        let row = terms(*place);
        for i in 0..TERMS {
            right[i] += row[i] * light;
            for j in 0..TERMS {
                matrix[i][j] += row[i] * row[j];
            }
        }
    }
    let singular = || VignettingError::Absurd("no solution".to_owned());
    let (found, inverse) = solve(&matrix, &right).ok_or_else(singular)?;
    let level = found[0];
    let squares = blocks.iter().map(|(place, light)| {
        let fitted: f64 = terms(*place).iter().zip(&found).map(|(t, f)| t * f).sum();
        (light - fitted).powi(2)
    });
    let variance = squares.sum::<f64>() / (blocks.len() - TERMS) as f64;
    let uneven = variance.sqrt() / level;
    // Not `>`: what is no number is refused.
    if !(uneven <= MOST_UNEVEN) {
        return Err(VignettingError::Uneven { uneven });
    }
    // Gradients for the errors of k = c / c0 and of the corner, 1 + the sum of k.
    let k: [f64; 3] = std::array::from_fn(|i| found[i + 1] / level);
    let error = |gradient: [f64; 4]| {
        let terms = (0..4).flat_map(|i| (0..4).map(move |j| (i, j)));
        let sum: f64 = terms
            .map(|(i, j)| gradient[i] * inverse[i][j] * gradient[j])
            .sum();
        (variance * sum).sqrt() / level
    };
    let errors = std::array::from_fn(|i| {
        let mut gradient = [-k[i], 0.0, 0.0, 0.0];
        gradient[i + 1] = 1.0;
        error(gradient)
    });
    let corner_error = error([-k.iter().sum::<f64>(), 1.0, 1.0, 1.0]);
    Ok(VignettingFit {
        vignetting: Vignetting::new(k).map_err(VignettingError::Absurd)?,
        errors,
        corner_error,
        slope: [found[4] / level, found[5] / level],
        uneven,
    })
}

fn terms((x, y, square): Place) -> [f64; TERMS] {
    [1.0, square, square * square, square.powi(3), x, y]
}

/// Places and mean light of blocks, each picture and channel at a mean of 1.
fn blocks(frames: &[Frame], encoding: Encoding) -> Result<Vec<(Place, f64)>, VignettingError> {
    let (width, height) = (frames[0].width as usize, frames[0].height as usize);
    let edge = width.max(height).div_ceil(BLOCKS);
    let (across, down) = (width / edge, height / edge);
    let mut all = Vec::new();
    for (picture, frame) in frames.iter().enumerate() {
        let counts = frame.in_8_bit_counts();
        let clipped = counts.iter().flatten().filter(|c| **c < 0.5 || **c > 254.5);
        let share = clipped.count() as f64 / (3 * counts.len()) as f64;
        if share > MOST_CLIPPED {
            return Err(VignettingError::Clipped {
                picture: picture + 1,
                share,
            });
        }
        for k in 0..3 {
            let light: Vec<f64> = counts
                .iter()
                .map(|pixel| encoding.light(pixel[k]))
                .collect();
            let mean = light.iter().sum::<f64>() / light.len() as f64;
            for block in 0..across * down {
                let (column, row) = (edge * (block % across), edge * (block / across));
                let rows = light.chunks_exact(width).skip(row).take(edge);
                let sum: f64 = rows
                    .map(|r| r[column..column + edge].iter().sum::<f64>())
                    .sum();
                let middle = |start: usize| start as f64 + 0.5 * edge as f64;
                let (x, y) = (
                    middle(column) - 0.5 * width as f64,
                    middle(row) - 0.5 * height as f64,
                );
                let (half_x, half_y) = (0.5 * width as f64, 0.5 * height as f64);
                let square = (x * x + y * y) / (half_x * half_x + half_y * half_y);
                all.push((
                    (x / half_x, y / half_y, square),
                    sum / (edge * edge) as f64 / mean,
                ));
            }
        }
    }
    Ok(all)
}
