//! The sensor's noise from two or more frames of one still view.
//!
//! At each signal half the variance of the difference of two frames is a frame's own: a·y + b and rounding. What is removed
//! before: the encoding, a gain between frames, pixels near black and full scale. What is checked: that differences do not go with
//! the picture's slopes, and that neighbours are not alike.

use uw_calib::Encoding;
use uw_calib::response::LinearNoise;
use uw_render::image::Frame;

use super::bins::{self, Bin, Binned};
use super::frames::{FramesError, LEAST_LEVELS, LEAST_PIXELS, Linear};
use super::line::{self, Line};

/// Pixels that a bin needs.
const LEAST_IN_BIN: f64 = 100.0;
/// Passes: each leaves out what the noise found before it lets reach black or full scale.
const PASSES: usize = 3;
/// Standard errors beyond which a sign of a moved view counts.
const SURE: f64 = 6.0;
/// Share of the differences that goes with slopes, above which frames are refused, and above which a warning is given.
const MOVED: [f64; 2] = [0.1, 0.02];
/// Correlation of neighbours above which frames are refused; demosaicing stays below.
const SMOOTH: f64 = 0.6;
/// Correlation of neighbours that is told.
const ALIKE: f64 = 0.05;
/// Misfit that is told.
const MISFIT: f64 = 4.0;
/// Gain of a frame that is told.
const GAIN: f64 = 0.02;
/// Noise in counts below which rounding hides it.
const FEW_COUNTS: f64 = 0.25;

/// What two or more frames say of a sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct NoiseFit {
    /// a and b of the variance a·y + b of the linear signal y, both >= 0.
    pub noise: LinearNoise,
    /// Standard errors of a and b.
    pub errors: [f64; 2],
    /// The same of each channel alone, where it has enough pixels; one entry where all pictures are grey.
    pub channels: Vec<Option<(LinearNoise, [f64; 2])>>,
    /// By frame: its light over the mean of the frames, which was removed.
    pub gains: Vec<f64>,
    /// Pixels of channels that were used.
    pub pixels: usize,
    /// Correlation of the differences of neighbouring pixels; 0 for a sensor without demosaicing.
    pub correlation: f64,
    /// Mean square of what the variances are off the line, in units of their errors; near 1 where a·y + b holds.
    pub misfit: f64,
    /// What a user should know.
    pub warnings: Vec<String>,
}

/// Fits the noise to `frames` (two or more, R, G, B of 8 or 16 bits). `compressed`: the files are JPEG, which hides noise and makes
/// more of it at edges.
///
/// # Errors
/// Frames that do not go together, show a moved view, or leave too few pixels.
pub fn fit(
    frames: &[Frame],
    encoding: Encoding,
    compressed: bool,
) -> Result<NoiseFit, FramesError> {
    let linear = Linear::new(frames, encoding)?;
    let mut noise = LinearNoise::default();
    let mut last: Option<(Binned, Line)> = None;
    for _ in 0..PASSES {
        let binned = bins::sort(&linear, noise);
        let line = match (line_of(&binned), &last) {
            (Ok(line), _) => line,
            // Differences that are too much to be noise leave no pixel away from black and full scale.
            (Err(_), Some((before, line))) => {
                moved(before, compressed)?;
                return Err(FramesError::Unlike {
                    deviation: line.noise.standard_deviation(0.5),
                });
            }
            (Err(too_little), None) => return Err(too_little),
        };
        noise = line.noise;
        last = Some((binned, line));
    }
    let (binned, line) = last.ok_or(FramesError::TooFew(frames.len()))?;
    let correlation = correlation(&binned);
    if correlation > SMOOTH && !compressed {
        return Err(FramesError::Smooth { correlation });
    }
    let share = moved(&binned, compressed)?;
    let raise = raise(&binned);
    let channels = binned.bins.iter().map(|own| {
        let line = line::through(own.iter().filter(|b| b.count >= LEAST_IN_BIN), raise)?;
        Some((line.noise, line.errors))
    });
    let mut fit = NoiseFit {
        noise: line.noise,
        errors: line.errors,
        channels: channels.collect(),
        gains: linear.gains,
        pixels: used(&binned).map(|bin| bin.count as usize).sum(),
        correlation,
        misfit: line.misfit,
        warnings: Vec::new(),
    };
    fit.warnings = warnings(&fit, &line, share, compressed);
    Ok(fit)
}

/// The bins with enough pixels.
fn used(binned: &Binned) -> impl Iterator<Item = &Bin> {
    let bins = binned.bins.iter().flatten();
    bins.filter(|bin| bin.count >= LEAST_IN_BIN)
}

fn line_of(binned: &Binned) -> Result<Line, FramesError> {
    let pixels: usize = used(binned).map(|bin| bin.count as usize).sum();
    let level = |i: usize| (binned.bins.iter()).any(|own| own[i].count >= LEAST_IN_BIN);
    let levels = (0..bins::BINS).filter(|&i| level(i)).count();
    let too_little = FramesError::TooLittle { pixels, levels };
    if pixels < LEAST_PIXELS || levels < LEAST_LEVELS {
        return Err(too_little);
    }
    line::through(used(binned), raise(binned)).ok_or(too_little)
}

/// Mean correlation of the differences of neighbours in a row.
fn correlation(binned: &Binned) -> f64 {
    let sums = used(binned).map(Bin::correlation);
    let [own, alike] = sums.fold([0.0; 2], |sum, bin| [sum[0] + bin[0], sum[1] + bin[1]]);
    if own > 0.0 { alike / own } else { 0.0 }
}

/// By how much correlated neighbours raise the squared error of a variance: squares of normal numbers are correlated by the square
/// of their correlation, taken as that of rows in columns and squared along diagonals.
fn raise(binned: &Binned) -> f64 {
    let square = correlation(binned).powi(2);
    1.0 + 4.0 * square + 4.0 * square * square
}

/// Share of the differences' variance that goes with the picture's slope.
fn moved(binned: &Binned, compressed: bool) -> Result<f64, FramesError> {
    let mut sums = [0.0; 5];
    for bin in used(binned) {
        // Each bin in units of its own variance, so that bright ones do not drown the others.
        let unit = bin.variance().max(f64::MIN_POSITIVE);
        let [products, squares, scatter] = bin.regression();
        let weight = unit.powi(-2);
        let terms = [
            products * weight,
            squares * weight,
            scatter * weight * weight,
            bin.slopes() / unit,
            bin.count,
        ];
        for (sum, term) in sums.iter_mut().zip(terms) {
            *sum += term;
        }
    }
    let [products, squares, scatter, slopes, count] = sums;
    if squares <= 0.0 || products <= SURE * scatter.sqrt() {
        return Ok(0.0);
    }
    let per_slope = products / squares;
    let share = per_slope * slopes / count;
    let most = if compressed { 3.0 * MOVED[0] } else { MOVED[0] };
    if share <= most {
        return Ok(share);
    }
    Err(FramesError::Moved {
        share: 100.0 * share.min(1.0),
        // A shift by d along a random direction adds d²/4 of the squared slope to a frame's variance.
        shift_px: 2.0 * per_slope.sqrt(),
        hint: match compressed {
            true => ", or of JPEG's compression",
            false => "",
        },
    })
}

fn warnings(fit: &NoiseFit, line: &Line, share: f64, compressed: bool) -> Vec<String> {
    let mut told = Vec::new();
    if compressed {
        told.push(
            "JPEG removes noise and adds its own: take PNG or TIFF if the camera can; what was measured is the noise after JPEG"
                .to_owned(),
        );
    }
    if share > MOVED[1] {
        told.push(format!(
            "{:.0} % of the differences go with the picture's detail: a view that trembles, or sharpening",
            100.0 * share
        ));
    }
    if fit.correlation.abs() > ALIKE {
        told.push(format!(
            "differences of neighbouring pixels are correlated ({:+.2}): demosaicing or smoothing in the camera; the noise is that of \
             its pictures, and errors allow for it only roughly",
            fit.correlation
        ));
    }
    if fit.misfit > MISFIT {
        told.push(format!(
            "the variance is no straight line of the signal (off by {:.1} errors; errors were raised): another --encoding, a tone curve, \
             or gains of a white balance",
            fit.misfit.sqrt()
        ));
    }
    if line.least_counts < FEW_COUNTS {
        told.push(format!(
            "the noise is {:.2} counts where it is least: rounding hides it unless the picture's levels fall anywhere between counts",
            line.least_counts
        ));
    }
    let off = |gain: &f64| (gain - 1.0).abs() > GAIN;
    if let Some(frame) = fit.gains.iter().position(off) {
        told.push(format!(
            "frame {} has {:.3} times the light of the mean (removed): fix exposure and light",
            frame + 1,
            fit.gains[frame]
        ));
    }
    if let Some(words) = channels_differ(fit) {
        told.push(words);
    }
    told
}

/// Whether two channels have different noise, as white balance makes it.
fn channels_differ(fit: &NoiseFit) -> Option<String> {
    let known: Vec<_> = fit.channels.iter().flatten().collect();
    let differ = |one: &(LinearNoise, [f64; 2]), other: &(LinearNoise, [f64; 2])| {
        let off = (one.0.a - other.0.a).abs();
        off > 5.0 * one.1[0].hypot(other.1[0]) && off > 0.1 * one.0.a.max(other.0.a)
    };
    let differ = (known.iter().enumerate())
        .any(|(i, one)| known[..i].iter().any(|other| differ(one, other)));
    differ.then(|| {
        let a: Vec<String> = known.iter().map(|(n, _)| format!("{:.2e}", n.a)).collect();
        format!(
            "the channels have different noise (a of {}): gains of a white balance or a colour matrix; one a for all is a compromise",
            a.join(", ")
        )
    })
}
