//! How much light a lamp gives at the levels it is set to, from pictures of a board that it alone lights.

use uw_calib::Encoding;
use uw_calib::vehicle::LevelCurve;
use uw_render::image::Frame;

/// Share of a picture's pixels at full scale that is refused.
const MOST_CLIPPED: f64 = 0.001;
/// Least mean signal of the picture at 100 %.
const LEAST_FULL: f64 = 0.05;
/// Share of the brightest block's light above which a block is lit.
const LIT: f64 = 0.3;
/// Edge of a block, pixels.
const BLOCK: u32 = 16;
/// Blocks that have to be lit.
const LEAST_BLOCKS: usize = 4;
/// Standard deviation of blocks' ratios of light at one level that is refused: the lamp's beam changes with its level, or more than it
/// shines.
const MOST_SPREAD: f64 = 0.1;
/// Standard errors by which light may fall where the level rises.
const MOST_FALL: f64 = 3.0;

/// What pictures say of the lamp.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelFit {
    /// The curve through the levels of the pictures.
    pub curve: LevelCurve,
    /// By rising level: level, light, and the standard error of the light, percent of full.
    pub points: Vec<[f64; 3]>,
    /// The largest standard deviation of a level's light over the board, over that light.
    pub spread: f64,
}

/// Pictures that say nothing of the lamp's levels.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LevelError {
    /// As many levels and exposures as pictures, at least two.
    #[error(
        "--level and --relative-exposure must have one value for each picture, and two pictures are needed at least: got {pictures} \
         pictures, {levels} levels and {exposures} exposures"
    )]
    Count {
        /// Pictures.
        pictures: usize,
        /// Levels.
        levels: usize,
        /// Exposures.
        exposures: usize,
    },
    /// A level out of its range.
    #[error("--level must be in [0, 100] percent, got {0}")]
    Level(f64),
    /// An exposure out of its range.
    #[error("--relative-exposure must be finite and above 0, got {0}")]
    Exposure(f64),
    /// Nothing to compare with, or nothing to compare.
    #[error(
        "the levels must be 100, with whose light that of the others is compared, and at least one between 0 and 100; got {0:?}"
    )]
    Levels(Vec<f64>),
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
    /// At full scale.
    #[error(
        "{:.1} % of picture {picture} are at full scale (at most {:.1} % can be): expose less and say so with --relative-exposure",
        100.0 * share,
        100.0 * MOST_CLIPPED
    )]
    Clipped {
        /// Which picture, from 1.
        picture: usize,
        /// Share of pixels of channels.
        share: f64,
    },
    /// The lamp lights next to nothing.
    #[error(
        "at level 100 {blocks} blocks of {BLOCK} x {BLOCK} pixels are lit, with {:.1} % of full scale; at least {LEAST_BLOCKS} with \
         {:.0} % are needed: a board nearer to the lamp, or a longer exposure",
        100.0 * light,
        100.0 * LEAST_FULL
    )]
    Dark {
        /// Blocks that are lit.
        blocks: usize,
        /// Their mean signal.
        light: f64,
    },
    /// Something else shines, or the view moved.
    #[error(
        "at level {level_pct} the light over that at level 100 differs by {:.0} % (standard deviation) from place to place on the board \
         (at most {:.0} % can be): other light in the room (give a picture at level 0, which is taken off), a moved view, or a beam that \
         changes with the level",
        100.0 * spread,
        100.0 * MOST_SPREAD
    )]
    Uneven {
        /// The level, percent.
        level_pct: f64,
        /// Standard deviation over mean.
        spread: f64,
    },
    /// Less light at a higher level.
    #[error(
        "the lamp gives {:.1} % of its light at level {} and {:.1} % at level {}: light must not fall where the level rises; are the \
         pictures in the order of --level, and is the exposure fixed?",
        low[1], low[0], high[1], high[0]
    )]
    Falls {
        /// Lower level and its light, percent.
        low: [f64; 2],
        /// The higher.
        high: [f64; 2],
    },
    /// Light that no curve has.
    #[error("{0}")]
    Curve(String),
}

/// Fits the curve to `frames` at `levels_pct`, percent, exposed `exposures` times as long as each other. A picture at level 0 is taken
/// off the others; without one the room counts as dark. Pictures at one level are averaged.
///
/// # Errors
/// Numbers that do not go with the pictures, clipped or dark pictures, a board on which the light does not change alike, light that
/// falls where the level rises.
pub fn fit(
    frames: &[Frame],
    levels_pct: &[f64],
    exposures: &[f64],
    encoding: Encoding,
) -> Result<LevelFit, LevelError> {
    check(frames, levels_pct, exposures)?;
    let lights = frames.iter().zip(exposures).enumerate();
    let lights: Vec<Vec<f64>> = lights
        .map(|(i, (frame, exposure))| blocks(frame, i + 1, *exposure, encoding))
        .collect::<Result<_, _>>()?;
    let mut levels = levels_pct.to_vec();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    let at = |level_pct: f64| -> Vec<f64> {
        let shown = levels_pct.iter().zip(&lights);
        let of: Vec<&Vec<f64>> = shown
            .filter(|(own, _)| **own == level_pct)
            .map(|(_, light)| light)
            .collect();
        let sum = |i: usize| of.iter().map(|light| light[i]).sum::<f64>();
        (0..lights[0].len())
            .map(|i| sum(i) / of.len() as f64)
            .collect()
    };
    let dark = match levels.first() {
        Some(0.0) => at(0.0),
        _ => vec![0.0; lights[0].len()],
    };
    let of_lamp = |level_pct: f64| -> Vec<f64> {
        let light = at(level_pct);
        light.iter().zip(&dark).map(|(l, d)| l - d).collect()
    };
    let full = of_lamp(100.0);
    let lit = lit(&full)?;
    let mut points = vec![[0.0; 3]];
    let mut widest = 0f64;
    for &level_pct in levels.iter().filter(|level| **level > 0.0) {
        let (share, spread) = share(&of_lamp(level_pct), &full, &lit);
        let relative = spread / share.max(f64::MIN_POSITIVE);
        // Where a lamp hardly shines yet, noise and rounding are all that there is.
        if share > 0.05 && relative > MOST_SPREAD {
            return Err(LevelError::Uneven {
                level_pct,
                spread: relative,
            });
        }
        if share > 0.05 {
            widest = widest.max(relative);
        }
        let error = spread / (lit.len() as f64).sqrt();
        points.push([level_pct, 100.0 * share, 100.0 * error]);
    }
    Ok(LevelFit {
        curve: rising(&points)?,
        points,
        spread: widest,
    })
}

fn check(frames: &[Frame], levels_pct: &[f64], exposures: &[f64]) -> Result<(), LevelError> {
    let counts = [frames.len(), levels_pct.len(), exposures.len()];
    if counts[0] < 2 || counts != [counts[0]; 3] {
        return Err(LevelError::Count {
            pictures: counts[0],
            levels: counts[1],
            exposures: counts[2],
        });
    }
    let wrong = |level: &&f64| !(0.0..=100.0).contains(*level);
    if let Some(level) = levels_pct.iter().find(wrong) {
        return Err(LevelError::Level(*level));
    }
    if let Some(exposure) = exposures.iter().find(|x| !(**x > 0.0 && x.is_finite())) {
        return Err(LevelError::Exposure(*exposure));
    }
    let between = levels_pct.iter().any(|x| *x > 0.0 && *x < 100.0);
    if !levels_pct.contains(&100.0) || !between {
        return Err(LevelError::Levels(levels_pct.to_vec()));
    }
    let size = |frame: &Frame| format!("{} x {}", frame.width, frame.height);
    match frames
        .iter()
        .position(|frame| size(frame) != size(&frames[0]))
    {
        None => Ok(()),
        Some(i) => Err(LevelError::Size {
            picture: i + 1,
            got: size(&frames[i]),
            first: size(&frames[0]),
        }),
    }
}

/// Mean linear signal of each block over all channels, at the exposure 1.
fn blocks(
    frame: &Frame,
    picture: usize,
    exposure: f64,
    encoding: Encoding,
) -> Result<Vec<f64>, LevelError> {
    let counts = frame.in_8_bit_counts();
    let clipped = counts.iter().flatten().filter(|count| **count > 254.5);
    let share = clipped.count() as f64 / (3 * counts.len()) as f64;
    if share > MOST_CLIPPED {
        return Err(LevelError::Clipped { picture, share });
    }
    let (across, down) = (frame.width / BLOCK, frame.height / BLOCK);
    let mut sums = vec![0.0; (across * down) as usize];
    for (i, pixel) in counts.iter().enumerate() {
        let i = i as u32;
        let place = (i % frame.width / BLOCK, i / frame.width / BLOCK);
        if place.0 < across && place.1 < down {
            let light = pixel.iter().map(|count| encoding.light(*count));
            sums[(place.1 * across + place.0) as usize] += light.sum::<f64>();
        }
    }
    let scale = 1.0 / (3.0 * f64::from(BLOCK * BLOCK) * exposure);
    Ok(sums.iter().map(|sum| scale * sum).collect())
}

/// The blocks that the lamp lights.
fn lit(full: &[f64]) -> Result<Vec<usize>, LevelError> {
    let brightest = full.iter().copied().fold(0.0, f64::max);
    let lit: Vec<usize> = (0..full.len())
        .filter(|&i| brightest > 0.0 && full[i] >= LIT * brightest)
        .collect();
    let light = lit.iter().map(|&i| full[i]).sum::<f64>() / lit.len().max(1) as f64;
    match lit.len() >= LEAST_BLOCKS && light >= LEAST_FULL {
        true => Ok(lit),
        false => Err(LevelError::Dark {
            blocks: lit.len(),
            light,
        }),
    }
}

/// Light over that at 100 % and its standard deviation over the blocks, of which bright ones count more.
fn share(light: &[f64], full: &[f64], lit: &[usize]) -> (f64, f64) {
    let sum = |of: &dyn Fn(usize) -> f64| lit.iter().map(|&i| of(i)).sum::<f64>();
    let whole = sum(&|i| full[i]);
    let share = sum(&|i| light[i]) / whole;
    let square = sum(&|i| full[i] * (light[i] / full[i] - share).powi(2)) / whole;
    (share, square.sqrt())
}

/// The curve; what falls by no more than errors is flat.
fn rising(points: &[[f64; 3]]) -> Result<LevelCurve, LevelError> {
    let mut curve = vec![[0.0, 0.0]];
    for pair in points.windows(2) {
        let ([low, below, e], [high, above, f]) = (pair[0], pair[1]);
        if above < below - MOST_FALL * e.hypot(f) {
            return Err(LevelError::Falls {
                low: [low, below],
                high: [high, above],
            });
        }
        let floor = curve.last().map_or(0.0, |last| last[1]);
        curve.push([high, above.max(floor)]);
    }
    // Light of a level that noise puts above that of 100 is full light.
    for point in &mut curve {
        point[1] = point[1].min(100.0);
    }
    if let Some(last) = curve.last_mut() {
        last[1] = 100.0;
    }
    LevelCurve::new(curve).map_err(LevelError::Curve)
}
