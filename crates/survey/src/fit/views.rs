//! What the water does to the target's light from each distance, for any water.

use std::f64::consts::LN_2;

use rayon::prelude::*;
use uw_media::Iops;
use uw_render::prepare::PreparedLamp;

use super::FitError;
use super::blocks::Grid;
use uw_calib::vehicle::Vehicle;
use uw_twin::environment::PARTICLE_INDEX;
use uw_twin::estimate::every_water::{Derived, EveryPhase, Phases, Values};
use uw_twin::estimate::target_model::lamps_alone;
use uw_twin::estimate::target_view::TargetView;
use uw_twin::estimate::water_tables::KnownWater;

/// Backscatter fractions that the first paths are drawn for; in between a polynomial.
pub(super) const BACKSCATTER: [f64; 5] = [0.004, 0.009, 0.02, 0.045, 0.09];
/// How far apart those are that paths are drawn for once it is known about where to look.
const NEARER: f64 = 1.5;
/// Columns and rows of a block at which light that the edge of a lamp's beam may cut is taken.
const PARTS: (usize, usize) = (4, 4);
/// Waves on the target for which the spread of its sight is known.
const WAVES: usize = 9;
/// Depth of the vehicle, m: the light of lamps does not depend on it, and the target must be wide enough.
const DEPTH_M: f64 = 20.0;
/// Reflectance of the even target; only its place counts.
const REFLECTANCE: f32 = 0.2;

/// Paths for each of the distances of some pictures.
pub(super) struct Views {
    pub(super) distances_m: Vec<f64>,
    sets: Vec<EveryPhase>,
    /// Per distance and block where the camera sees its middle.
    points: Vec<Vec<Point>>,
    waves_per_m: Vec<f64>,
    /// Waves of the blocks' cosines, cycles per metre.
    pub(super) cosines_per_m: Vec<f64>,
}

/// Where a block's middle is seen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    /// Image coordinates in [-1, 1].
    pub(super) image: (f64, f64),
    /// How far the block reaches on either side, in the same.
    half: (f64, f64),
    range_m: f64,
    cosine: f64,
}

/// What a water does to light of a kind from a distance, by the blocks that the picture shows.
pub(super) struct Seen {
    /// Radiance that never met the target.
    pub(super) veil: Vec<Derived>,
    /// Irradiance over π of the target, without what the water sends back from it.
    pub(super) light: Vec<Derived>,
    /// Transmittance of straight rays.
    pub(super) straight: Vec<Derived>,
    /// Share of rays that scatter and reach the target.
    pub(super) scattered: Vec<Derived>,
    /// Contrast that those leave of each of the blocks' cosines.
    pub(super) transfer: Vec<Derived>,
    /// Light that the water sends back to a white target, of its irradiance.
    pub(super) returned: Derived,
}

/// Absorption and scattering of a channel, 1/m, and the share of light scattered back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Coefficients {
    pub(super) a: f64,
    pub(super) b: f64,
    pub(super) backscatter: f64,
}

impl Views {
    /// Draws `paths` for each of `backscatter` fractions and of `distances_m` of `vehicle`, whose pictures show the blocks of `grid` in a part as wide as the
    /// picture from `nearest_m`. `done` is told after each distance.
    pub(super) fn new(
        vehicle: &Vehicle,
        distances_m: Vec<f64>,
        (grid, nearest_m): (Grid, f64),
        backscatter: &[f64],
        (paths, seed): (usize, u64),
        done: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self, FitError> {
        let half_m = half_view(vehicle).map(|tangent| tangent * nearest_m * grid.wider());
        let cosines_per_m = cosines(grid, half_m);
        let least = cosines_per_m
            .iter()
            .skip(1)
            .copied()
            .fold(f64::MAX, f64::min);
        let most = cosines_per_m.iter().copied().fold(0.0, f64::max);
        let step = (most / least).ln() / (WAVES - 1) as f64;
        let waves_per_m: Vec<f64> = (0..WAVES)
            .map(|i| least * (step * i as f64).exp())
            .collect();
        let phases = Phases::new(PARTICLE_INDEX, backscatter)?;
        let made: Result<Vec<_>, FitError> = distances_m
            .par_iter()
            .map(|&distance_m| {
                let (view, lamps) = view(vehicle, distance_m)?;
                let set = EveryPhase::new(&view, &lamps, &phases, &waves_per_m, paths, seed)?;
                if !done() {
                    return Err(FitError::Interrupted);
                }
                Ok((set, points(&view, grid, nearest_m / distance_m)))
            })
            .collect();
        let (sets, points) = made?.into_iter().unzip();
        Ok(Self {
            distances_m,
            sets,
            points,
            waves_per_m,
            cosines_per_m,
        })
    }

    /// Where the blocks are seen that the picture from distance `i` shows.
    pub(super) fn points(&self, i: usize) -> &[Point] {
        &self.points[i]
    }

    /// What `water` does to pictures from distance `i`, as all paths or one independent group of them have it.
    pub(super) fn values(&self, i: usize, water: &Coefficients, group: Option<usize>) -> Values {
        let (a, b, backscatter) = (water.a, water.b, water.backscatter);
        match group {
            None => self.sets[i].at(a, b, backscatter),
            Some(group) => self.sets[i].of_group(group, a, b, backscatter),
        }
    }

    /// Light of the lamps at 100 % in a channel, from distance `i`.
    pub(super) fn lamps(&self, i: usize, channel: usize, values: &Values) -> Seen {
        let colour = self.sets[i].colour()[channel];
        let points = &self.points[i];
        let of = |f: &dyn Fn(&Point) -> Derived| points.iter().map(f).collect();
        Seen {
            veil: of(&|p| values.veil.at(p.image.0, p.image.1) * colour),
            light: of(&|p| {
                let straight = values.unscattered.mean_about(p.image, p.half, PARTS);
                (straight + values.scattered.at(p.image.0, p.image.1)) * colour
            }),
            straight: of(&|p| values.transmittance(p.range_m)),
            scattered: of(&|p| values.sight.share_at(p.cosine)),
            transfer: self.transfers(&values.sight.transfer),
            returned: values.returned,
        }
    }

    /// Daylight that lights the target evenly, from distance `i`: the veil is left at 0, the light at 1.
    pub(super) fn daylight(&self, i: usize, values: &Values) -> Seen {
        let points = &self.points[i];
        let of = |f: &dyn Fn(&Point) -> Derived| points.iter().map(f).collect();
        Seen {
            veil: of(&|_| Derived::default()),
            light: of(&|_| Derived::constant(1.0)),
            straight: of(&|p| values.transmittance(p.range_m)),
            scattered: of(&|p| values.even_sight.share_at(p.cosine)),
            transfer: self.transfers(&values.even_sight.transfer),
            returned: Derived::default(),
        }
    }

    /// Contrasts left of the blocks' cosines, from those of the waves: 1 at frequency 0, in proportion to the logarithm between
    /// waves.
    fn transfers(&self, of_waves: &[Derived]) -> Vec<Derived> {
        let ln = |f: f64| f.ln() / LN_2;
        let at = |&frequency: &f64| {
            let waves = &self.waves_per_m;
            if frequency <= 0.0 {
                return Derived::constant(1.0);
            }
            let after = waves
                .partition_point(|w| *w < frequency)
                .clamp(1, WAVES - 1);
            let (low, high) = (ln(waves[after - 1]), ln(waves[after]));
            let share = ((ln(frequency) - low) / (high - low)).clamp(0.0, 1.0);
            of_waves[after - 1] * (1.0 - share) + of_waves[after] * share
        };
        self.cosines_per_m.iter().map(at).collect()
    }
}

/// Backscatter fractions about one that is known roughly.
pub(super) fn about(backscatter: f64) -> [f64; 3] {
    let [least, most] = [BACKSCATTER[0], BACKSCATTER[BACKSCATTER.len() - 1]];
    let middle = backscatter.clamp(least, most);
    [middle / NEARER, middle, middle * NEARER]
}

/// Whether a fraction lies between those of [`about`] another.
pub(super) fn is_about(backscatter: f64, other: f64) -> bool {
    let [low, _, high] = about(other);
    (1.02 * low..high / 1.02).contains(&backscatter)
}

/// Half the field of view across and down, as tangents.
pub(super) fn half_view(vehicle: &Vehicle) -> [f64; 2] {
    let across = (0.5 * vehicle.hfov_deg.to_radians()).tan();
    [
        across,
        across * f64::from(vehicle.height) / f64::from(vehicle.width),
    ]
}

/// The view of an even target from a distance, and the lamps.
fn view(vehicle: &Vehicle, distance_m: f64) -> Result<(TargetView, Vec<PreparedLamp>), FitError> {
    // Paths serve every water: which one the scene has does not count.
    let water = KnownWater {
        iops: Iops {
            a: [0.1; 3],
            b: [0.1; 3],
        },
        backscatter_fraction: BACKSCATTER[2],
        bottom: false,
        reflectance: REFLECTANCE,
    };
    let scene = lamps_alone(&water.scene(&vehicle.in_three_bands(), DEPTH_M, distance_m)?);
    let lamps = scene.lamps.iter().map(PreparedLamp::build).collect();
    let view = TargetView::new(&scene).map_err(|_| FitError::Beyond { distance_m })?;
    Ok((view, lamps))
}

/// Where the middles of the blocks are seen that a picture shows, of whose middle the nearest picture shows `share`.
fn points(view: &TargetView, grid: Grid, share: f64) -> Vec<Point> {
    let (width, height) = view.size_px();
    let half = (share * grid.half().0, share * grid.half().1);
    let point = |i: usize| {
        let (u, v) = grid.middle(i);
        let x = 0.5 * width * (1.0 + share * u);
        let y = 0.5 * height * (1.0 + share * v);
        view.sight(x, y).map(|sight| Point {
            image: sight.image,
            half,
            range_m: sight.range_m,
            cosine: view.incidence(sight.direction),
        })
    };
    // The view's corners meet the target, and so do points between them.
    grid.shown(share).into_iter().filter_map(point).collect()
}

/// Waves of the cosines that make up the blocks' values, row by row, cycles per metre.
fn cosines(grid: Grid, half_m: [f64; 2]) -> Vec<f64> {
    let wave = |i: usize| {
        let across = (i % grid.size[0]) as f64 / (4.0 * half_m[0]);
        let down = (i / grid.size[0]) as f64 / (4.0 * half_m[1]);
        across.hypot(down)
    };
    (0..grid.len()).map(wave).collect()
}
