//! The water by chance alone: where coefficients differ from place to place, flights and transmittances by tracking with the
//! largest attenuation there is (Woodcock et al. 1965; Novák, Selle and Jarosz 2014).

use glam::DVec3;
use uw_render::scene::{Scene, Water};

use super::chance::Random;

/// Distance beyond which nothing is looked for, m.
const FAR_M: f64 = 1e4;

/// Scattering and attenuation, 1/m.
#[derive(Clone, Copy)]
pub(super) struct Coefficients {
    pub(super) b: f64,
    pub(super) c: f64,
}

/// The water of one channel.
pub(super) struct Medium {
    everywhere: Coefficients,
    /// Depth of a node, m, and the water there.
    layers: Vec<(f64, Coefficients)>,
    /// Middle and standard deviation of a cloud, m, and what it adds in its middle.
    plumes: Vec<(DVec3, f64, Coefficients)>,
    height: f64,
    largest: f64,
}

impl Medium {
    pub(super) fn new(scene: &Scene, channel: usize) -> Self {
        let of = |iops: &uw_media::Iops| Coefficients {
            b: iops.b[channel],
            c: iops.a[channel] + iops.b[channel],
        };
        let none = Coefficients { b: 0.0, c: 0.0 };
        let variation = scene.water.as_ref().map(|water| &water.variation);
        let layers: Vec<_> = variation
            .iter()
            .flat_map(|own| {
                own.layers
                    .iter()
                    .map(|layer| (layer.depth_m, of(&layer.iops)))
            })
            .collect();
        let plumes: Vec<_> = variation
            .iter()
            .flat_map(|own| {
                own.plumes
                    .iter()
                    .map(|p| (p.centre_m, p.sigma_m, of(&p.iops)))
            })
            .collect();
        let thickest = layers.iter().map(|(_, own)| own.c).fold(0.0, f64::max);
        let clouds: f64 = plumes.iter().map(|(_, _, own)| own.c).sum();
        Self {
            everywhere: scene
                .water
                .as_ref()
                .map_or(none, |water: &Water| of(&water.iops)),
            layers,
            plumes,
            height: scene.surface.map_or(0.0, |surface| surface.height_m),
            largest: thickest + clouds,
        }
    }

    fn varies(&self) -> bool {
        !self.layers.is_empty()
    }

    /// Whether there is no water.
    pub(super) fn is_clear(&self) -> bool {
        !self.varies() && self.everywhere.c == 0.0
    }

    pub(super) fn at(&self, point: DVec3) -> Coefficients {
        if !self.varies() {
            return self.everywhere;
        }
        let depth = self.height - point.z;
        let mut own = self.in_layers(depth);
        for (centre, sigma, cloud) in &self.plumes {
            let dense = (-0.5 * (point.distance(*centre) / sigma).powi(2)).exp();
            own.b += dense * cloud.b;
            own.c += dense * cloud.c;
        }
        own
    }

    fn in_layers(&self, depth: f64) -> Coefficients {
        let (first, last) = (&self.layers[0], &self.layers[self.layers.len() - 1]);
        if depth < first.0 {
            return first.1;
        }
        for pair in self.layers.windows(2) {
            let ((from, upper), (to, lower)) = (pair[0], pair[1]);
            if from <= depth && depth < to {
                let share = (depth - from) / (to - from);
                return Coefficients {
                    b: upper.b + share * (lower.b - upper.b),
                    c: upper.c + share * (lower.c - upper.c),
                };
            }
        }
        last.1
    }

    /// Length of a free flight, m; infinite where nothing stops it.
    pub(super) fn flight(&self, origin: DVec3, direction: DVec3, random: &mut Random) -> f64 {
        if self.is_clear() {
            return f64::INFINITY;
        }
        if !self.varies() {
            return -random.uniform().ln() / self.everywhere.c;
        }
        let mut t = 0.0;
        while t < FAR_M {
            t -= random.uniform().ln() / self.largest;
            if random.uniform() * self.largest < self.at(origin + t * direction).c {
                return t;
            }
        }
        f64::INFINITY
    }

    /// An estimate of the transmittance of a straight way whose mean is right.
    pub(super) fn transmittance(
        &self,
        origin: DVec3,
        direction: DVec3,
        range: f64,
        random: &mut Random,
    ) -> f64 {
        if !self.varies() {
            return (-self.everywhere.c * range).exp();
        }
        let (mut left, mut t) = (1.0, 0.0);
        loop {
            t -= random.uniform().ln() / self.largest;
            if t >= range {
                return left;
            }
            left *= 1.0 - self.at(origin + t * direction).c / self.largest;
        }
    }
}
