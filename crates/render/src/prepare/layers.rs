//! Water that varies, as the integrators read it: nodes of a profile in depth, and clouds.
//! Twins: `shaders/common/layer_tables.wgsl`, `layers.wgsl`, `plumes.wgsl`.

use glam::DVec3;
use uw_media::{Iops, Spectrum};

use super::{AtWavelengths, Boundary};
use crate::scene::{Layer, Scene, Variation};

/// Least relative number that walks are drawn with: scatterings are also looked for where there are few.
const FLOOR: f64 = 0.02;
/// Share of the number for bridges that scattering has where it is, and everywhere alike; the rest is blurred.
const IN_PLACE: f64 = 0.5;
const EVEN: f64 = 0.1;
/// By how much it is blurred, m: bridges that are turned about reach layers so far from where their straight way does.
const BLUR_M: f64 = 0.15;
/// Distance from a cloud's middle, in standard deviations, beyond which nothing of it is left.
const REACH: f64 = 9.0;

/// What walks are drawn with, relative to the coefficients that stand for all the water.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Relative {
    /// By scattering.
    pub by_scattering: f64,
    /// By attenuation.
    pub by_attenuation: f64,
}

/// What places the scatterings of bridges: scattering, partly blurred.
#[derive(Clone, Debug, Default)]
pub struct BridgePlaces {
    /// Depths, m, growing, and the numbers there, relative like those by scattering.
    pub nodes: Vec<(f64, f64)>,
    /// Of each cloud.
    pub plumes: Vec<BridgePlume>,
}

/// A cloud twice: as it is and blurred.
#[derive(Clone, Copy, Debug)]
pub struct BridgePlume {
    /// Number in its middle.
    pub in_place: f64,
    /// The same of the blurred cloud.
    pub blurred: f64,
    /// Standard deviation of the blurred cloud, m.
    pub blurred_sigma_m: f64,
}

/// A profile in depth and clouds. What is kept of coefficients goes in this order: nodes, then clouds.
#[derive(Clone, Debug)]
pub struct Layers {
    /// Depths of the nodes, m, growing.
    pub depths_m: Vec<f64>,
    /// Middles and standard deviations of the clouds, m.
    pub plumes: Vec<(DVec3, f64)>,
    /// Relative numbers of nodes and clouds.
    pub relative: Vec<Relative>,
    /// What places the scatterings of bridges.
    pub bridge: BridgePlaces,
    /// Attenuation and scattering of nodes and clouds, 1/m; of a scene by wavelength those near zero range.
    pub coefficients: Vec<Coefficients>,
    /// Height of the water surface, m.
    height_m: f64,
}

/// Attenuation and scattering per channel, 1/m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    /// Attenuation.
    pub c: Spectrum,
    /// Scattering.
    pub b: Spectrum,
}

/// A straight way through the water.
#[derive(Clone, Debug)]
pub enum Way {
    /// Its length, m, where the water is the same everywhere.
    Length(f64),
    /// The length that each node and each cloud counts for, m.
    Counted(Vec<f64>),
}

impl From<Iops> for Coefficients {
    fn from(iops: Iops) -> Self {
        Self {
            c: iops.c(),
            b: iops.b,
        }
    }
}

impl Layers {
    /// The layers of `scene`; `None` where its water is the same everywhere.
    pub fn build(scene: &Scene, boundary: Option<&Boundary>) -> Option<Self> {
        let water = scene.water.as_ref()?;
        let variation = &water.variation;
        if variation.is_none() {
            return None;
        }
        let coefficients = coefficients_of(variation, |layer| layer.iops);
        let depths_m: Vec<f64> = variation.layers.iter().map(|layer| layer.depth_m).collect();
        let whole = Coefficients::from(water.iops);
        let mut relative: Vec<Relative> = coefficients
            .iter()
            .map(|own| relative(own, &whole))
            .collect();
        for number in &mut relative[..depths_m.len()] {
            number.by_scattering = number.by_scattering.max(FLOOR);
            number.by_attenuation = number.by_attenuation.max(FLOOR);
        }
        let plumes = variation.plumes.iter();
        let mut built = Self {
            depths_m,
            plumes: plumes
                .map(|plume| (plume.centre_m, plume.sigma_m))
                .collect(),
            relative,
            bridge: BridgePlaces::default(),
            coefficients,
            height_m: boundary.map_or(0.0, |boundary| boundary.height),
        };
        built.bridge = built.bridge_places();
        Some(built)
    }

    /// What places the scatterings of bridges: it bends at the layers, and above and below each.
    fn bridge_places(&self) -> BridgePlaces {
        let depths = &self.depths_m;
        let number = |depth_m: f64, by_scattering: f64| {
            let blurred = self.mean_scattering(depth_m - BLUR_M, depth_m + BLUR_M);
            let number = IN_PLACE * by_scattering + (1.0 - IN_PLACE - EVEN) * blurred + EVEN;
            (depth_m, number)
        };
        let own = depths.iter().zip(&self.relative);
        let mut nodes: Vec<_> = own.map(|(&z, own)| number(z, own.by_scattering)).collect();
        if depths.len() > 1 {
            let beside = depths.iter().flat_map(|z| [z - BLUR_M, z + BLUR_M]);
            for z in beside.filter(|z| *z > 0.0) {
                let is_near = |other: &f64| (other - z).abs() < 0.1 * BLUR_M;
                if depths.iter().any(is_near) || nodes.iter().any(|(other, _)| is_near(other)) {
                    continue;
                }
                let (upper, lower, share) = self.stretch(z);
                let [from, to] = [upper, lower].map(|i| self.relative[i].by_scattering);
                nodes.push(number(z, from + share * (to - from)));
            }
        }
        nodes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let clouds = self.plumes.iter().zip(&self.relative[depths.len()..]);
        let plumes = clouds.map(|(&(_, sigma_m), own)| {
            let blurred_sigma_m = sigma_m.hypot(BLUR_M);
            let spread = (sigma_m / blurred_sigma_m).powi(3);
            BridgePlume {
                in_place: IN_PLACE * own.by_scattering,
                blurred: (1.0 - IN_PLACE - EVEN) * own.by_scattering * spread,
                blurred_sigma_m,
            }
        });
        BridgePlaces {
            nodes,
            plumes: plumes.collect(),
        }
    }

    /// Mean of the relative scattering of layers between two depths.
    fn mean_scattering(&self, low: f64, high: f64) -> f64 {
        let mut counted = vec![0.0; self.relative.len()];
        self.count_nodes((low, high), high - low, &mut counted);
        let parts = counted.iter().zip(&self.relative);
        parts
            .map(|(length, own)| length * own.by_scattering)
            .sum::<f64>()
            / (high - low)
    }

    /// The way from the surface straight down to `depth_m` below it, without the clouds.
    pub(super) fn way_down(&self, depth_m: f64) -> Way {
        let mut counted = vec![0.0; self.coefficients.len()];
        self.count_nodes((0.0, depth_m), depth_m, &mut counted);
        Way::Counted(counted)
    }

    /// The layers at a depth, m, without the clouds.
    pub(super) fn at_depth(&self, depth_m: f64) -> Coefficients {
        let (upper, lower, share) = self.stretch(depth_m);
        let [from, to] = [upper, lower].map(|i| self.coefficients[i]);
        let mix = |x: Spectrum, y: Spectrum| std::array::from_fn(|k| x[k] + share * (y[k] - x[k]));
        Coefficients {
            c: mix(from.c, to.c),
            b: mix(from.b, to.b),
        }
    }

    /// The way of `length_m` from `origin` along a unit vector, by the underside of the surface where it goes on above it.
    pub fn way(&self, origin: DVec3, direction: DVec3, length_m: f64) -> Way {
        let depth = |t: f64| self.height_m - (origin + t * direction).z;
        let (start, end) = (depth(0.0), depth(length_m));
        let mut counted = vec![0.0; self.coefficients.len()];
        let crossing = match start.signum() * end.signum() < 0.0 {
            true => length_m * start / (start - end),
            false => length_m,
        };
        for (from, to) in [(0.0, crossing), (crossing, length_m)] {
            if to > from {
                self.count_part(origin, direction, (from, to), &mut counted);
            }
        }
        Way::Counted(counted)
    }

    /// What each node and each cloud counts for at a point below the surface.
    pub(crate) fn counted_at(&self, point: DVec3) -> Vec<f64> {
        let mut counted = vec![0.0; self.coefficients.len()];
        let (upper, lower, share) = self.stretch(self.height_m - point.z);
        counted[upper] += 1.0 - share;
        counted[lower] += share;
        let clouds = &mut counted[self.depths_m.len()..];
        for (&(centre, sigma), counted) in self.plumes.iter().zip(clouds) {
            *counted = (-0.5 * centre.distance_squared(point) / (sigma * sigma)).exp();
        }
        counted
    }

    /// Adds what a part of a way counts that lies on one side of the surface.
    fn count_part(
        &self,
        origin: DVec3,
        direction: DVec3,
        (from, to): (f64, f64),
        counted: &mut [f64],
    ) {
        let above = self.height_m - (origin + 0.5 * (from + to) * direction).z < 0.0;
        let fold = |mut v: DVec3, height: f64| {
            if above {
                v.z = 2.0 * height - v.z;
            }
            v
        };
        let start = fold(origin + from * direction, self.height_m);
        let direction = fold(direction, 0.0);
        let length = to - from;
        let depth = self.height_m - start.z;
        self.count_nodes((depth, depth - length * direction.z), length, counted);
        for (&(centre, sigma), counted) in
            self.plumes.iter().zip(&mut counted[self.depths_m.len()..])
        {
            *counted += length_in_plume(centre - start, direction, length, sigma);
        }
    }

    /// Adds what the nodes count of a way between two depths.
    fn count_nodes(&self, (start, end): (f64, f64), length: f64, counted: &mut [f64]) {
        let (low, high) = (start.min(end), start.max(end));
        let edges = self
            .depths_m
            .iter()
            .copied()
            .filter(|&z| low < z && z < high);
        let mut from = low;
        for to in edges.chain([high]) {
            let part = if high > low {
                length * (to - from) / (high - low)
            } else {
                length
            };
            let (upper, lower, share) = self.stretch(0.5 * (from + to));
            counted[upper] += part * (1.0 - share);
            counted[lower] += part * share;
            from = to;
        }
    }

    /// The nodes above and below a depth, and how far it is from the first to the second.
    fn stretch(&self, depth_m: f64) -> (usize, usize, f64) {
        let above = self.depths_m.partition_point(|&z| z <= depth_m);
        let (upper, lower) = (above.saturating_sub(1), above.min(self.depths_m.len() - 1));
        let (from, to) = (self.depths_m[upper], self.depths_m[lower]);
        let share = if to > from {
            (depth_m - from) / (to - from)
        } else {
            0.0
        };
        (upper, lower, share.clamp(0.0, 1.0))
    }
}

/// Coefficients of the layers, as `of` has them, then of the clouds.
fn coefficients_of(variation: &Variation, of: impl Fn(&Layer) -> Iops) -> Vec<Coefficients> {
    let layers = variation.layers.iter().map(of);
    let plumes = variation.plumes.iter().map(|plume| plume.iops);
    layers.chain(plumes).map(Coefficients::from).collect()
}

/// Means of the channels over those of `whole`.
fn relative(own: &Coefficients, whole: &Coefficients) -> Relative {
    let share = |part: Spectrum, whole: Spectrum| match whole.iter().sum::<f64>() {
        whole if whole > 0.0 => part.iter().sum::<f64>() / whole,
        _ => 1.0,
    };
    Relative {
        by_scattering: share(own.b, whole.b),
        by_attenuation: share(own.c, whole.c),
    }
}

/// Coefficients of nodes and clouds at a wavelength of each channel, nm; empty where the water is the same everywhere.
pub(super) fn at_wavelengths(variation: &Variation, wavelengths_nm: [f64; 3]) -> Vec<Coefficients> {
    if variation.is_none() {
        return Vec::new();
    }
    coefficients_of(variation, |layer| match &layer.spectrum {
        Some(spectrum) => spectrum.at(wavelengths_nm),
        None => layer.iops,
    })
}

/// Length of the way through a cloud whose middle is `offset` from its start, each metre counted by what is there of the
/// middle.
fn length_in_plume(offset: DVec3, direction: DVec3, length: f64, sigma: f64) -> f64 {
    let along = offset.dot(direction);
    let aside = (offset - along * direction).length() / sigma;
    if aside > REACH {
        return 0.0;
    }
    let erf = |x: f64| libm::erf(x / (sigma * std::f64::consts::SQRT_2));
    let half = sigma * (0.5 * std::f64::consts::PI).sqrt();
    half * (-0.5 * aside * aside).exp() * (erf(length - along) + erf(along))
}

impl Way {
    /// This way and another one in the same water.
    pub(crate) fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::Counted(own), Self::Counted(other)) => {
                Self::Counted(own.iter().zip(&other).map(|(x, y)| x + y).collect())
            }
            (Self::Length(own), Self::Length(other)) => Self::Length(own + other),
            // Ways in one water are of one kind.
            (own, _) => own,
        }
    }

    /// Transmittance, where the water has attenuation `c` or, where it varies, `coefficients`.
    pub(crate) fn transmittance(&self, c: Spectrum, coefficients: &[Coefficients]) -> Spectrum {
        std::array::from_fn(|k| match self {
            // Where nothing is lost the range may be infinite.
            Self::Length(length) if c[k] > 0.0 => (-c[k] * length).exp(),
            Self::Length(_) => 1.0,
            Self::Counted(counted) => {
                let parts = counted.iter().zip(coefficients);
                (-parts.map(|(length, own)| length * own.c[k]).sum::<f64>()).exp()
            }
        })
    }
}

impl AtWavelengths {
    /// Transmittance of a way.
    pub fn transmittance_of(&self, way: &Way) -> Spectrum {
        way.transmittance(self.c, &self.layers)
    }
}
