//! Walks that scatter until they meet the target, with flights for a mixture of waters.

use glam::DVec3;
use uw_media::phase::PhaseTable;
use uw_render::sampling::directions::turn;

use super::Setting;
use super::evaluate::Path;
use super::orders::RATES_PER_M;
use crate::estimate::numbers::Numbers;

/// Walks longer than this many times the image point's range are given up. Light on the way to the target for that long is a
/// ten-thousandth or less in water in which an eighth or more is lost per free path.
pub(super) const MOST_STRETCH: f64 = 30.0;
/// Scatterings after which a walk is given up.
const MOST_SCATTERINGS: u32 = 500;

/// The scattering coefficient, 1/m, of a walk's flights that `u` chooses evenly.
pub(super) fn rate(u: f64) -> f64 {
    RATES_PER_M[((u * RATES_PER_M.len() as f64) as usize).min(RATES_PER_M.len() - 1)]
}

/// A walk before its first scattering.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flight {
    /// Where it scatters, m.
    pub(super) origin: DVec3,
    /// From where it came.
    pub(super) direction: DVec3,
    /// How far, m.
    pub(super) length_m: f64,
}

/// Goes on from the first scattering to the target: where the walk meets it, and its path but for the light there; `None`
/// beyond `longest_m`. `favour` is by how much flights of a rate were drawn more often at the start than later ones.
pub(super) fn to_target(
    setting: &Setting,
    phase: &PhaseTable,
    (start, rate): (Flight, f64),
    longest_m: f64,
    numbers: &mut Numbers,
    favour: impl Fn(f64) -> f64,
) -> Option<(DVec3, Path)> {
    let Flight {
        mut origin,
        mut direction,
        mut length_m,
    } = start;
    for scatterings in 1..=MOST_SCATTERINGS {
        direction = turn(direction, phase.sample_x(numbers.next()), numbers.next());
        let flight = numbers.length() / rate;
        let to_target = setting.view.range_m(origin, direction);
        let to_target = to_target.unwrap_or(f64::INFINITY);
        let way = flight.min(to_target);
        origin += way * direction;
        length_m += way;
        if to_target <= flight {
            // Over the density of the walk at all rates, in which phase values cancel.
            let densities = RATES_PER_M.map(|rate| {
                let exponent = f64::from(scatterings) * rate.ln() - rate * length_m;
                exponent.exp() * favour(rate)
            });
            let mean = densities.iter().sum::<f64>() / RATES_PER_M.len() as f64;
            let path = Path {
                scatterings: scatterings as f32,
                length_m,
                log_weight: -mean.ln(),
                light: [0.0; 2],
            };
            return Some((origin, path));
        }
        if length_m > longest_m {
            return None;
        }
    }
    None
}
