//! Waters on Jerlov's scale: absorption and scattering of all channels by one number, the place among the ten types.

use uw_media::WaterType;

use uw_twin::environment::JerlovWater;

/// How far a natural water is taken to be off the mixture of two neighbouring types, of the logarithms.
pub(super) const OFF_SCALE: f64 = 0.02;
/// Mean and spread of the place before the pictures: anywhere.
pub(super) const PLACE: [f64; 2] = [4.5, 4.5];

/// Absorption and scattering of the ten types, 1/m: per type and channel.
#[derive(Clone, Debug)]
pub(super) struct Scale(Vec<[[f64; 2]; 3]>);

/// A logarithm of a coefficient on the scale, and its derivative by the place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OnScale {
    pub(super) ln: f64,
    pub(super) by_place: f64,
}

impl Scale {
    pub(super) fn new() -> Self {
        let all = WaterType::ALL.iter();
        let of_type = all.filter_map(|t| JerlovWater::from(*t).iops().ok());
        Self(
            of_type
                .map(|iops| std::array::from_fn(|k| [iops.a[k], iops.b[k]]))
                .collect(),
        )
    }

    /// Absorption and scattering of channel `k`; beyond the first and last type straight on.
    pub(super) fn at(&self, k: usize, place: f64) -> [OnScale; 2] {
        let (first, share) = self.between(place);
        let [from, to] = [self.0[first][k], self.0[first + 1][k]];
        std::array::from_fn(|i| {
            let rise = to[i] - from[i];
            // Straight on is not below nothing.
            let value = (from[i] + share * rise).max(0.1 * from[i]);
            OnScale {
                ln: value.ln(),
                by_place: rise / value,
            }
        })
    }

    /// The type before a place, and how far it is from that to the next; beyond the ends of the scale below 0 or above 1.
    fn between(&self, place: f64) -> (usize, f64) {
        let last = (self.0.len() - 2) as f64;
        let first = place.floor().clamp(0.0, last);
        (first as usize, place - first)
    }

    /// The water at a place, at the scale's end beyond it.
    pub(super) fn water(&self, place: f64) -> JerlovWater {
        let (first, share) = self.between(place);
        JerlovWater {
            from: WaterType::ALL[first],
            to: WaterType::ALL[first + 1],
            share: (share.clamp(0.0, 1.0) * 1000.0).round() / 1000.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_mixtures_of_types_with_their_derivatives() {
        let scale = Scale::new();
        let third = JerlovWater::from(WaterType::ALL[3]).iops().expect("a type");
        for k in 0..3 {
            let [a, b] = scale.at(k, 3.0);
            assert!((a.ln - third.a[k].ln()).abs() < 1e-12);
            assert!((b.ln - third.b[k].ln()).abs() < 1e-12);
            let water = scale.water(6.3).iops().expect("a mixture");
            assert!((scale.at(k, 6.3)[1].ln - water.b[k].ln()).abs() < 1e-9);
            for place in [-0.2, 0.4, 5.5, 8.7, 9.3] {
                let step = 1e-6;
                let [up, down] = [place + step, place - step].map(|p| scale.at(k, p));
                let here = scale.at(k, place);
                for i in 0..2 {
                    let slope = (up[i].ln - down[i].ln) / (2.0 * step);
                    assert!((slope - here[i].by_place).abs() < 1e-5, "{k} {place} {i}");
                }
            }
        }
        assert_eq!(
            scale.water(9.4).to_string(),
            format!("{}-{}@1", WaterType::ALL[8], WaterType::ALL[9])
        );
    }
}
