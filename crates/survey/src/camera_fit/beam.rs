//! A lamp's intensity by the angle from its axis, from pictures of a white board in air.

use std::f64::consts::PI;

use uw_render::image::Frame;

use uw_calib::vehicle::{Vehicle, Vignetting};

/// Degrees between the rows of the profile.
const STEP_DEG: f64 = 2.0;
/// Degrees from the axis whose mean is the intensity on it.
const AXIS_DEG: f64 = 4.0;
/// Pixels of channels that a row needs.
const LEAST_IN_ROW: f64 = 30.0;
/// Relative intensity below which the beam has ended.
const ENDED: f64 = 0.01;
/// Share of pixels at full scale that is refused.
const MOST_CLIPPED: f64 = 0.001;
/// Standard deviation of the intensity in a row over that on the axis that is refused, beyond what the fall from row to row makes: the
/// lamp is elsewhere, or the board no board.
const MOST_SPREAD: f64 = 0.25;

/// How the board was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Board {
    /// Distance from camera and lamp to the board, m; the board is across the camera's axis.
    pub distance_m: f64,
    /// Diffuse reflectance of the board.
    pub reflectance: f64,
    /// Place of the lamp from the camera, m: to the right (negative: to the left), in the camera's plane, its axis along the
    /// camera's.
    pub lamp_right_m: f64,
    /// Horizontal field of view in air, degrees.
    pub hfov_deg: f64,
    /// Exposure of the pictures over the vehicle's: the ratio of exposure times.
    pub relative_exposure: f64,
}

/// A lamp's beam.
#[derive(Clone, Debug, PartialEq)]
pub struct BeamFit {
    /// Intensity on the axis, W/sr in each channel, where the vehicle's exposure is right.
    pub intensity_w_per_sr: f64,
    /// Angle from the axis in degrees and intensity over that on it, from 0 to where the beam or the picture ends.
    pub profile: Vec<[f64; 2]>,
    /// Standard deviation of the pixels of each row of the profile, over the intensity on the axis.
    pub spread: Vec<f64>,
    /// Angle at which half of the intensity on the axis is left, degrees; `None` where the picture ends before.
    pub half_deg: Option<f64>,
    /// Whether the beam ends inside the picture.
    pub ends: bool,
    /// Root mean square of what the profile is off the cosine inside its cone, over the intensity on the axis.
    pub off_cosine: f64,
}

/// Pictures that say nothing of the beam.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BeamError {
    /// A value out of its range, by the option's name.
    #[error("{option} must be {right}, got {got}")]
    Value {
        /// The option.
        option: &'static str,
        /// What would be right.
        right: &'static str,
        /// What was given.
        got: f64,
    },
    /// Full scale.
    #[error("{:.2} % of picture {picture} are at full scale (at most {:.1} % can be); expose shorter and say so with --relative-exposure", 100.0 * share, 100.0 * MOST_CLIPPED)]
    Clipped {
        /// Which picture, from 1.
        picture: usize,
        /// Share of pixels of channels.
        share: f64,
    },
    /// The axis is not in view.
    #[error(
        "no light is seen within {AXIS_DEG} degrees of the lamp's axis; the board must show the place straight ahead of the lamp, lit"
    )]
    NoAxis,
    /// Places at one angle are lit differently.
    #[error("at {angle_deg:.0} degrees from the lamp's axis the intensity spreads by {:.0} % of that on the axis (at most {:.0} %): is --lamp-right-m (now {lamp_right_m}) right, is the other lamp off, the room dark and the board across?", 100.0 * spread, 100.0 * MOST_SPREAD)]
    Spread {
        /// Angle from the axis, degrees.
        angle_deg: f64,
        /// Standard deviation over the intensity on the axis.
        spread: f64,
        /// The place that was given.
        lamp_right_m: f64,
    },
}

/// Sums over the pixels near an angle.
#[derive(Clone, Copy, Default)]
struct Row {
    count: f64,
    sum: f64,
    squares: f64,
    angles: f64,
}

/// Finds the beam of one lamp from pictures of a board that it alone lights. `vehicle` gives exposure, encoding and vignetting.
///
/// A board at distance D across the axis reflects ρ I(θ) cos θ / (π d²) towards the camera, d = D / cos θ from the lamp.
///
/// # Errors
/// A value out of its range, pictures at full scale, an axis out of view, intensities that are no function of the angle.
pub fn fit(frames: &[Frame], board: &Board, vehicle: &Vehicle) -> Result<BeamFit, BeamError> {
    check(board)?;
    let mut rows: Vec<Row> = vec![Row::default(); (90.0 / STEP_DEG) as usize + 1];
    let mut axis = Row::default();
    for (picture, frame) in frames.iter().enumerate() {
        let counts = frame.in_8_bit_counts();
        let full = counts.iter().flatten().filter(|c| **c > 254.5).count();
        let share = full as f64 / (3 * counts.len()) as f64;
        if share > MOST_CLIPPED {
            return Err(BeamError::Clipped {
                picture: picture + 1,
                share,
            });
        }
        for (i, pixel) in counts.iter().enumerate() {
            let place = (i as u32 % frame.width, i as u32 / frame.width);
            let (cosine, per_signal) = geometry(place, frame, board);
            let angle = cosine.acos().to_degrees();
            let left = lens(vehicle.vignetting, place, frame) * vehicle.exposure;
            let light: f64 = pixel
                .iter()
                .map(|c| vehicle.encoding.light(*c))
                .sum::<f64>()
                / 3.0;
            let intensity = light * per_signal / (left * board.relative_exposure);
            add(
                &mut rows[(angle / STEP_DEG).round() as usize],
                angle,
                intensity,
            );
            if angle < AXIS_DEG {
                add(&mut axis, angle, intensity);
            }
        }
    }
    let on_axis = axis.sum / axis.count;
    if axis.count < LEAST_IN_ROW || !(on_axis > 0.0) {
        return Err(BeamError::NoAxis);
    }
    profile(&rows, on_axis, board)
}

fn profile(rows: &[Row], on_axis: f64, board: &Board) -> Result<BeamFit, BeamError> {
    // The mean about the axis is that at two thirds of the circle's radius; what falls from the axis there is second order.
    let mut profile = vec![[0.0, 1.0]];
    let (mut spread, mut ends) = (vec![0.0], false);
    let mean_of = |row: &Row| (row.count >= LEAST_IN_ROW).then(|| row.sum / row.count);
    for (i, row) in rows.iter().enumerate().skip(1) {
        if row.count < LEAST_IN_ROW {
            break;
        }
        let mean = row.sum / row.count;
        let deviation = (row.squares / row.count - mean * mean).max(0.0).sqrt() / on_axis;
        let angle_deg = row.angles / row.count;
        // A row holds the fall over its own width: at most half of it is the deviation, as at the edge of a cone.
        let before = mean_of(&rows[i - 1]).unwrap_or(on_axis);
        let after = rows.get(i + 1).and_then(mean_of).unwrap_or(mean);
        if deviation > MOST_SPREAD + 0.5 * (before - after).abs() / on_axis {
            return Err(BeamError::Spread {
                angle_deg,
                spread: deviation,
                lamp_right_m: board.lamp_right_m,
            });
        }
        let relative = mean / on_axis;
        profile.push([angle_deg, relative.max(0.0)]);
        spread.push(deviation);
        if relative < ENDED {
            ends = true;
            break;
        }
    }
    let cosine = |row: &&[f64; 2]| row[1] >= 0.5;
    let off: Vec<f64> = (profile.iter().filter(cosine))
        .map(|[angle, relative]| (relative - angle.to_radians().cos()).powi(2))
        .collect();
    let half = profile.windows(2).find(|pair| pair[1][1] < 0.5);
    Ok(BeamFit {
        intensity_w_per_sr: on_axis,
        half_deg: half.map(|pair| {
            let [[x0, y0], [x1, y1]] = [pair[0], pair[1]];
            x0 + (x1 - x0) * (y0 - 0.5) / (y0 - y1)
        }),
        off_cosine: (off.iter().sum::<f64>() / off.len() as f64).sqrt(),
        profile,
        spread,
        ends,
    })
}

/// Cosine of the angle from the lamp's axis, and intensity per linear signal at an exposure of 1.
fn geometry((column, row): (u32, u32), frame: &Frame, board: &Board) -> (f64, f64) {
    let (width, height) = (f64::from(frame.width), f64::from(frame.height));
    let focal = 0.5 * width / (0.5 * board.hfov_deg.to_radians()).tan();
    let at =
        |place: u32, size: f64| (f64::from(place) + 0.5 - 0.5 * size) / focal * board.distance_m;
    let (right, down) = (at(column, width) - board.lamp_right_m, at(row, height));
    let square = right * right + down * down + board.distance_m * board.distance_m;
    let cosine = board.distance_m / square.sqrt();
    (cosine, PI * square / (board.reflectance * cosine))
}

fn lens(vignetting: Option<Vignetting>, place: (u32, u32), frame: &Frame) -> f64 {
    vignetting.map_or(1.0, |lens| {
        lens.share_at(place, (frame.width, frame.height))
    })
}

fn add(row: &mut Row, angle: f64, intensity: f64) {
    row.count += 1.0;
    row.sum += intensity;
    row.squares += intensity * intensity;
    row.angles += angle;
}

fn check(board: &Board) -> Result<(), BeamError> {
    let values = [
        (
            "--distance-m",
            board.distance_m,
            0.05,
            100.0,
            "in [0.05, 100] m",
        ),
        (
            "--reflectance",
            board.reflectance,
            1e-3,
            1.0,
            "in [0.001, 1]",
        ),
        (
            "--lamp-right-m",
            board.lamp_right_m,
            -10.0,
            10.0,
            "in [-10, 10] m",
        ),
        (
            "--hfov-deg",
            board.hfov_deg,
            1.0,
            170.0,
            "in [1, 170] degrees",
        ),
        (
            "--relative-exposure",
            board.relative_exposure,
            1e-6,
            1e6,
            "in [1e-6, 1e6]",
        ),
    ];
    for (option, got, least, most, right) in values {
        if !(got >= least && got <= most) {
            return Err(BeamError::Value { option, right, got });
        }
    }
    Ok(())
}
