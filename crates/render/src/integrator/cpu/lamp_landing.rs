//! Where a walk lands: one of several first surface points, chosen by what it can bring.
//!
//! A pixel sees a target blurred by the water before it, and much of the noise of a textured one comes from where in
//! the blur a walk lands, on a light or on a dark spot. Walks to the first surface cost little next to bridges from
//! there to the lamps. So scouts are sent, walks without bridges, and one of all goes on, with a probability in
//! proportion to an estimate of its light. The sum of the estimates over the number of walks, relative to its own
//! estimate, is the factor of its weight, so that every surface point counts as often as without scouts (resampled
//! importance sampling, Talbot et al. 2005).

use super::{
    camera_ray::{CameraRay, End},
    lamp_target::LampWorkspace,
    lamp_walk::{FirstSegment, SURE_VERTICES, Walk, free_end, reflect_at_boundary, survival},
    spectral::Spectral,
};
use crate::{
    integrator::sampling::{Draws, directions::turn},
    prepare::{Medium, Prepared, SurfacePoint},
};

/// Scouts of a walk that falls freely, and of one that surely scatters.
const SCOUTS: u32 = 3;
const SCOUTS_WHERE_CLEAR: u32 = 2;
/// Stream of their leading numbers.
const STREAM: u32 = 3;
/// Light that comes from outside a lamp's beam or along a surface, relative to what comes straight.
const INDIRECT: f64 = 0.2;
/// Distance from a lamp, by the length of the walk, below which it is of no account.
const LEAST_OF_WALK: f64 = 1e-3;

/// A walk on the first surface that it meets.
pub(crate) struct Landing {
    pub(crate) walk: Walk,
    pub(crate) point: SurfacePoint,
}

/// What the scouts of one walk share.
pub(crate) struct Scouts<'a> {
    pub(crate) scene: &'a Prepared,
    pub(crate) active: &'a [usize],
    pub(crate) ray: &'a CameraRay,
    pub(crate) first: FirstSegment,
    pub(crate) max_events: usize,
    /// As in [`Walk`].
    pub(crate) lit_length2: f64,
}

impl Scouts<'_> {
    /// One of `landing` (of the walk that made bridges, if it met a surface) and the scouts' landings.
    pub(super) fn choose(
        &self,
        landing: Option<Landing>,
        draws: &mut Draws,
        work: &mut LampWorkspace,
    ) -> Option<Landing> {
        let number = self.number();
        let (Some(medium), true) = (&self.scene.medium, number > 0) else {
            return landing;
        };
        let mut chosen = landing;
        let mut worth = chosen.as_ref().map_or(0.0, |l| self.worth(l, medium, work));
        let mut sum = worth;
        let all = draws.of_stream(STREAM);
        for i in 0..number {
            let leading = all.at(draws.index() * number + i);
            let Some(scout) = self.scout(medium, &leading, draws, work) else {
                continue;
            };
            let its_worth = self.worth(&scout, medium, work);
            sum += its_worth;
            if its_worth > 0.0 && draws.uniform() * sum < its_worth {
                (chosen, worth) = (Some(scout), its_worth);
            }
        }
        let mut chosen = chosen.filter(|_| worth > 0.0)?;
        let mean = sum / f64::from(number + 1);
        chosen.walk.spectral.scale_all(mean / worth);
        Some(chosen)
    }

    /// Scouts pay where surfaces differ.
    fn number(&self) -> u32 {
        match self.first {
            FirstSegment::Through => 0,
            _ if !self.scene.needs.varied_reflectance => 0,
            FirstSegment::Scattered => SCOUTS_WHERE_CLEAR,
            FirstSegment::Free => SCOUTS,
        }
    }

    /// A walk to the first surface; its weights are found at the end, from its length and its scatterings.
    fn scout(
        &self,
        medium: &Medium,
        leading: &Draws,
        draws: &mut Draws,
        work: &mut LampWorkspace,
    ) -> Option<Landing> {
        let scene = self.scene;
        let mut walk = Walk::start(self.ray.in_water?, self.lit_length2);
        let spectral = Spectral::start(&medium.by_scattering, draws.uniform());
        let sigma = medium.by_scattering.sigma[spectral.chosen];
        let mut factor = self.ray.entry_factor;
        let mut end = self.first_end(sigma, leading.leading(2));
        let mut numbers = (leading.leading(3), leading.leading(4));
        loop {
            work.vertices += 1;
            match end {
                End::Scatter(t) => {
                    walk.go_to_scattering(t);
                    factor /= self.survival(medium, &walk, factor, draws)?;
                    let x = medium.phase.sample_x(numbers.0);
                    walk.direction = turn(walk.direction, x, numbers.1);
                }
                End::Surface(t, point, primitive) => {
                    walk.length += t;
                    walk.reach(t, primitive);
                    walk.spectral = spectral.after(medium, walk.scatterings, walk.length);
                    walk.spectral.scale_all(factor);
                    self.condition(medium, &mut walk.spectral);
                    return Some(Landing { walk, point });
                }
                End::Boundary(t) => {
                    walk.length += t;
                    if !reflect_at_boundary(scene, t, &mut walk, draws) {
                        return None;
                    }
                }
                End::Nothing => return None,
            }
            end = free_end(scene, &walk, -draws.uniform().ln() / sigma);
            numbers = (draws.uniform(), draws.uniform());
        }
    }

    /// The end of the first segment, with the flight that `u` gives.
    fn first_end(&self, sigma: f64, u: f64) -> End {
        let length = self.ray.in_water.map_or(0.0, |segment| segment.length);
        if self.first == FirstSegment::Scattered {
            let within = -(-sigma * length).exp_m1();
            return End::Scatter((-(-u * within).ln_1p() / sigma).min(length));
        }
        let t = -u.ln() / sigma;
        if t < length {
            End::Scatter(t)
        } else {
            self.ray.end()
        }
    }

    /// The strategies' densities of a path whose first segment surely scatters.
    fn condition(&self, medium: &Medium, spectral: &mut Spectral) {
        if self.first != FirstSegment::Scattered {
            return;
        }
        let length = self.ray.in_water.map_or(0.0, |segment| segment.length);
        for j in 0..spectral.count {
            let within = -(-medium.by_scattering.sigma[j] * length).exp_m1();
            spectral.density[j] /= within.max(f64::MIN_POSITIVE);
        }
    }

    /// Probability with which the scout goes on from a scattering; `None` when it does not.
    fn survival(
        &self,
        medium: &Medium,
        walk: &Walk,
        factor: f64,
        draws: &mut Draws,
    ) -> Option<f64> {
        if walk.events >= self.max_events {
            return None;
        }
        if walk.scatterings <= SURE_VERTICES {
            return Some(1.0);
        }
        let weight = factor * (-medium.a_min * walk.length).exp();
        let survival = survival(self.scene, self.active, walk, weight).min(1.0);
        let lives = survival >= 1.0 || (survival > 0.0 && draws.uniform() < survival);
        lives.then_some(survival)
    }

    /// Estimate of the light that a walk brings from where it landed; positive wherever there can be any.
    pub(crate) fn worth(&self, landing: &Landing, medium: &Medium, work: &LampWorkspace) -> f64 {
        let Landing { walk, point } = landing;
        let weight = walk.spectral.weight();
        let reflected: f64 = (0..3).map(|k| weight[k] * point.reflectance[k]).sum();
        let position = walk.unfolded(self.scene, walk.origin);
        let least = LEAST_OF_WALK * walk.length;
        let least2 = (least * least).max(f64::MIN_POSITIVE);
        let light = work.targets.iter().map(|target| {
            let lamp = &self.scene.lamps[target.lamp];
            let offset = target.centre(self.scene) - position;
            let distance2 = offset.length_squared().max(least2);
            let distance = distance2.sqrt();
            let towards = offset / distance;
            let cosine = point.shading_normal.dot(towards).max(0.0);
            let beam = lamp.relative_intensity(-towards);
            // From what the pixel sees unscattered only the light that scatters on its way there is this walk's.
            let share = if walk.unscattered {
                -(-medium.b_mean() * distance).exp_m1()
            } else {
                1.0
            };
            let attenuated = (-medium.c_min * distance).exp().max(1e-30) / distance2;
            (INDIRECT + beam) * (INDIRECT + cosine) * share.max(1e-3) * attenuated
        });
        reflected * light.sum::<f64>()
    }
}
