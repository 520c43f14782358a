//! The curve between light and counts, from pictures of one still view at known relative light.
//!
//! Debevec and Malik's method (SIGGRAPH 1997): the logarithm of a place's light plus that of the exposure is a function of the count,
//! one for all places, with a penalty on its bends. The unknown here is the logarithm of that function over the sRGB curve, which is
//! flat where the camera keeps to sRGB; places are blocks of pixels, so that noise is small beside a count.

use uw_calib::Encoding;
use uw_media::{CurveError, ResponseCurve};
use uw_render::image::Frame;

use super::solve::solve;

/// Pixels along the edge of a block.
const BLOCK: usize = 4;
/// Counts between the nodes of the curve.
const STEP: f64 = 5.0;
/// Nodes, from 0 to 255 counts.
const NODES: usize = 52;
/// Counts between which block means are used.
const USED: (f64, f64) = (15.0, 245.0);
/// Counts at and beyond which a pixel is clipped.
const CLIPPED: (f64, f64) = (2.0, 252.0);
/// Block means that a node needs to count.
const LEAST_AT_NODE: f64 = 20.0;
/// Nodes that a verdict needs: counts from dark to bright, half of the range.
const LEAST_NODES: usize = 25;
/// Weight of the bends over the mean weight of a node's own data.
const SMOOTH: f64 = 1e-3;
/// Root mean square of ln(light) by which a curve may be off sRGB or the straight line to be called that.
pub const MOST_OFF: f64 = 0.05;
/// Root mean square of ln(light) by which pictures may contradict each other.
const MOST_CONTRADICTION: f64 = 0.05;
/// Root mean square scatter of block means about one curve, counts.
const MOST_SCATTER: f64 = 4.0;

/// What a camera's curve is off an encoding, in the logarithm of light, over the counts that were seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// The encoding.
    pub encoding: Encoding,
    /// Root mean square, after the best common factor.
    pub rms: f64,
    /// The largest, with its sign: positive where the camera needs more light for a count than the encoding says.
    pub most: f64,
    /// 8-bit counts of the largest.
    pub at_counts: f64,
}

/// What pictures at known relative light say of the curve.
#[derive(Clone, Debug, PartialEq)]
pub struct ResponseFit {
    /// The nearer of the two named encodings where it is off by at most [`MOST_OFF`], else the curve.
    pub encoding: Encoding,
    /// The curve: 8-bit counts, light over that at the brightest count seen, standard error of its logarithm.
    pub curve: Vec<[f64; 3]>,
    /// What the curve is off sRGB and linear.
    pub off: [Deviation; 2],
    /// Root mean square contradiction between pictures, in the logarithm of light: what a wrong factor of light makes.
    pub contradiction: f64,
    /// Root mean square scatter of block means about the curve, counts.
    pub scatter_counts: f64,
    /// Block means used.
    pub blocks: usize,
}

impl ResponseFit {
    /// What the curve is off the nearer of the two.
    pub fn nearer(&self) -> Deviation {
        let [srgb, linear] = self.off;
        if srgb.rms <= linear.rms { srgb } else { linear }
    }
}

/// Pictures do not go together, or say nothing of a curve.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ResponseError {
    /// As many factors as pictures, at least two.
    #[error(
        "a response needs two or more pictures and a factor of light for each; got {pictures} pictures and {factors} factors"
    )]
    Count {
        /// Pictures.
        pictures: usize,
        /// Factors.
        factors: usize,
    },
    /// A factor out of its range.
    #[error("the light of picture {picture} must be finite and above 0, got {light}")]
    Light {
        /// Which picture, from 1.
        picture: usize,
        /// Its factor.
        light: f64,
    },
    /// All pictures have about the same light.
    #[error(
        "the light of the pictures must differ by a factor of 1.5 or more, got {0:.3}; exposures two to four times apart serve best"
    )]
    Alike(f64),
    /// Sizes differ.
    #[error(
        "picture {picture} has {got} pixels, picture 1 has {first}; all must show one view in one size"
    )]
    Size {
        /// Which picture, from 1.
        picture: usize,
        /// Its size.
        got: String,
        /// That of the first.
        first: String,
    },
    /// The counts that were seen are too few.
    #[error(
        "only {seen} of {NODES} levels of counts, side by side, are seen in two pictures neither black nor at full scale; at least {LEAST_NODES} are needed: a view with dark and bright parts, more exposures between the darkest and the brightest"
    )]
    TooLittle {
        /// Levels of counts with enough blocks.
        seen: usize,
    },
    /// No one curve fits the pictures.
    #[error("no one curve fits the pictures: they contradict each other by {:.1} % of light (at most {:.0} % can be noise), scatter {scatter_counts:.1} counts (at most {MOST_SCATTER}); --light is wrong, the exposure was automatic, or the view or its light changed", 100.0 * contradiction, 100.0 * MOST_CONTRADICTION)]
    Contradiction {
        /// Root mean square in the logarithm of light.
        contradiction: f64,
        /// Scatter about the curve, counts.
        scatter_counts: f64,
    },
    /// What was found is no curve that a camera can have.
    #[error("{0}; the pictures say too little or do not go together")]
    NoCurve(#[from] CurveError),
}

/// A block's mean count in one picture.
#[derive(Clone, Copy)]
struct Seen {
    picture: usize,
    counts: f64,
}

/// Fits the curve to `frames` of one still view (R, G, B) at relative `light`: exposure times, or reflectances of cards that fill the
/// view one after another in light that falls off across them and stays as it is.
///
/// # Errors
/// Pictures that do not go together or contradict each other, and too few counts seen.
pub fn fit(frames: &[Frame], light: &[f64]) -> Result<ResponseFit, ResponseError> {
    check(frames, light)?;
    let places = places(frames);
    let start = |seen: &Seen| Encoding::Srgb.light(seen.counts).ln() - light[seen.picture].ln();
    let (mut matrix, mut right) = (vec![vec![0.0; NODES]; NODES], vec![0.0; NODES]);
    let mut data = vec![0.0; NODES];
    for place in &places {
        add(place, &start, &mut matrix, &mut right, &mut data);
    }
    let seen: Vec<usize> = (0..NODES).filter(|&k| data[k] >= LEAST_AT_NODE).collect();
    let nodes = longest_run(&seen).to_vec();
    let too_little = ResponseError::TooLittle { seen: nodes.len() };
    if nodes.len() < LEAST_NODES {
        return Err(too_little);
    }
    let unit = (0..NODES).map(|k| matrix[k][k]).sum::<f64>() / NODES as f64;
    for k in 1..NODES - 1 {
        let bend = [(k - 1, 1.0), (k, -2.0), (k + 1, 1.0)];
        for (i, a) in bend {
            for (j, b) in bend {
                matrix[i][j] += SMOOTH * unit * a * b;
            }
        }
    }
    // The common factor is free: it is held by one node.
    matrix[NODES / 2][NODES / 2] += unit;
    let (over_srgb, inverse) = solve(&matrix, &right).ok_or(too_little)?;
    let (contradiction, scatter_counts, variance, blocks) =
        residuals(&places, &start, &over_srgb, frames.len());
    if contradiction > MOST_CONTRADICTION || scatter_counts > MOST_SCATTER {
        return Err(ResponseError::Contradiction {
            contradiction,
            scatter_counts,
        });
    }
    let log_light = |k: usize| Encoding::Srgb.light(node(k)).ln() + over_srgb[k];
    let brightest = nodes.last().map_or(0.0, |&k| log_light(k));
    let curve = nodes.iter().map(|&k| {
        let error = (variance * inverse[k][k]).sqrt();
        [node(k), (log_light(k) - brightest).exp(), error]
    });
    let mut found = ResponseFit {
        encoding: Encoding::Srgb,
        curve: curve.collect(),
        off: [Encoding::Srgb, Encoding::Linear]
            .map(|encoding| deviation(encoding, &nodes, log_light)),
        contradiction,
        scatter_counts,
        blocks,
    };
    let nearer = found.nearer();
    found.encoding = match nearer.rms <= MOST_OFF {
        true => nearer.encoding,
        false => Encoding::Curve(measured(&found.curve)?),
    };
    Ok(found)
}

/// The curve as vehicles state it.
fn measured(curve: &[[f64; 3]]) -> Result<ResponseCurve, CurveError> {
    let points: Vec<[f64; 2]> = curve.iter().map(|row| [row[0], row[1]]).collect();
    ResponseCurve::new(&points)
}

fn check(frames: &[Frame], light: &[f64]) -> Result<(), ResponseError> {
    if frames.len() < 2 || frames.len() != light.len() {
        return Err(ResponseError::Count {
            pictures: frames.len(),
            factors: light.len(),
        });
    }
    let wrong = |light: &f64| !(*light > 0.0 && light.is_finite());
    if let Some(i) = light.iter().position(wrong) {
        return Err(ResponseError::Light {
            picture: i + 1,
            light: light[i],
        });
    }
    let most = light.iter().copied().fold(0.0, f64::max);
    let ratio = most / light.iter().copied().fold(f64::MAX, f64::min);
    if ratio < 1.5 {
        return Err(ResponseError::Alike(ratio));
    }
    let size = |frame: &Frame| format!("{} x {}", frame.width, frame.height);
    let first = size(&frames[0]);
    match frames.iter().position(|frame| size(frame) != first) {
        Some(i) => Err(ResponseError::Size {
            picture: i + 1,
            got: size(&frames[i]),
            first,
        }),
        None => Ok(()),
    }
}

/// The longest run of neighbours: across a gap nothing says how much more light one side has.
fn longest_run(seen: &[usize]) -> &[usize] {
    let runs = seen.chunk_by(|a, b| b - a == 1);
    runs.max_by_key(|run| run.len()).unwrap_or_default()
}

fn node(k: usize) -> f64 {
    STEP * k as f64
}

/// The two nodes about a count and their shares.
fn shares(counts: f64) -> [(usize, f64); 2] {
    let k = ((counts / STEP) as usize).min(NODES - 2);
    let share = counts / STEP - k as f64;
    [(k, 1.0 - share), (k + 1, share)]
}

/// Debevec and Malik's hat: counts near black and full scale say less.
fn weight(counts: f64) -> f64 {
    counts.min(255.0 - counts) / 127.5
}

/// By block and channel: its mean counts in the pictures where it is even and not clipped, two at least.
fn places(frames: &[Frame]) -> Vec<Vec<Seen>> {
    let (width, height) = (frames[0].width as usize, frames[0].height as usize);
    let counts: Vec<Vec<[f64; 3]>> = frames.iter().map(Frame::in_8_bit_counts).collect();
    let mut places = Vec::new();
    for row in (0..(height / BLOCK) * BLOCK).step_by(BLOCK) {
        for column in (0..(width / BLOCK) * BLOCK).step_by(BLOCK) {
            for k in 0..3 {
                let seen = counts.iter().enumerate().filter_map(|(picture, pixels)| {
                    let at = |i: usize| pixels[(row + i / BLOCK) * width + column + i % BLOCK][k];
                    block_mean(at).map(|counts| Seen { picture, counts })
                });
                let seen: Vec<Seen> = seen.collect();
                if seen.len() > 1 {
                    places.push(seen);
                }
            }
        }
    }
    places
}

/// The mean of a block that is even (so that the mean of its counts is that of its light within 2 %) and not clipped.
fn block_mean(at: impl Fn(usize) -> f64) -> Option<f64> {
    let n = BLOCK * BLOCK;
    let (mut sum, mut squares) = (0.0, 0.0);
    for i in 0..n {
        let counts = at(i);
        if counts <= CLIPPED.0 || counts >= CLIPPED.1 {
            return None;
        }
        sum += counts;
        squares += counts * counts;
    }
    let mean = sum / n as f64;
    let deviation = (squares / n as f64 - mean * mean).max(0.0).sqrt();
    (mean >= USED.0 && mean <= USED.1 && deviation <= 0.1 * mean + 1.0).then_some(mean)
}

/// Adds a place with its own light taken out.
fn add(
    place: &[Seen],
    start: &impl Fn(&Seen) -> f64,
    matrix: &mut [Vec<f64>],
    right: &mut [f64],
    data: &mut [f64],
) {
    let all: f64 = place.iter().map(|seen| weight(seen.counts)).sum();
    let mean = place
        .iter()
        .map(|s| weight(s.counts) * start(s))
        .sum::<f64>()
        / all;
    let mut mean_row: Vec<(usize, f64)> = Vec::with_capacity(2 * place.len());
    for seen in place {
        let w = weight(seen.counts);
        let row = shares(seen.counts);
        for (i, a) in row {
            for (j, b) in row {
                matrix[i][j] += w * a * b;
            }
            right[i] -= w * a * (start(seen) - mean);
            data[i] += a;
            mean_row.push((i, w * a));
        }
    }
    for &(i, a) in &mean_row {
        for &(j, b) in &mean_row {
            matrix[i][j] -= a * b / all;
        }
    }
}

/// Contradiction of the pictures, scatter in counts, variance of unit weight in ln(light), and block means.
fn residuals(
    places: &[Vec<Seen>],
    start: &impl Fn(&Seen) -> f64,
    over_srgb: &[f64],
    pictures: usize,
) -> (f64, f64, f64, usize) {
    let value = |seen: &Seen| {
        let over: f64 = shares(seen.counts)
            .iter()
            .map(|(i, a)| a * over_srgb[*i])
            .sum();
        start(seen) + over
    };
    let mut cells = vec![[0.0; 2]; pictures * NODES];
    let (mut squares, mut weighted, mut blocks) = (0.0, 0.0, 0);
    for place in places {
        let all: f64 = place.iter().map(|seen| weight(seen.counts)).sum();
        let light = place
            .iter()
            .map(|s| weight(s.counts) * value(s))
            .sum::<f64>()
            / all;
        for seen in place {
            let off = value(seen) - light;
            let srgb = Encoding::Srgb.light(seen.counts);
            squares += (off * srgb * Encoding::Srgb.slope(srgb)).powi(2);
            weighted += weight(seen.counts) * off * off;
            blocks += 1;
            let cell = &mut cells[seen.picture * NODES + (seen.counts / STEP) as usize];
            cell[0] += off;
            cell[1] += 1.0;
        }
    }
    let full = cells.iter().filter(|cell| cell[1] >= LEAST_AT_NODE);
    let means: Vec<f64> = full.map(|cell| cell[0] / cell[1]).collect();
    let mean_square = means.iter().map(|m| m * m).sum::<f64>() / means.len().max(1) as f64;
    let freedom = (blocks as f64 - places.len() as f64).max(1.0);
    let scatter = (squares / (blocks as f64).max(1.0)).sqrt();
    (mean_square.sqrt(), scatter, weighted / freedom, blocks)
}

fn deviation(encoding: Encoding, nodes: &[usize], log_light: impl Fn(usize) -> f64) -> Deviation {
    let off: Vec<f64> = (nodes.iter())
        .map(|&k| log_light(k) - encoding.light(node(k)).ln())
        .collect();
    let mean = off.iter().sum::<f64>() / off.len() as f64;
    let square = off.iter().map(|o| (o - mean).powi(2)).sum::<f64>() / off.len() as f64;
    let largest = (0..off.len()).max_by(|&a, &b| {
        let size = |i: usize| (off[i] - mean).abs();
        size(a).total_cmp(&size(b))
    });
    let at = largest.unwrap_or(0);
    Deviation {
        encoding,
        rms: square.sqrt(),
        most: off[at] - mean,
        at_counts: node(nodes[at]),
    }
}
