//! How the water between camera and target spreads the sight of it.

use uw_media::phase::PhaseTable;
use uw_render::scene::Water;

use super::fields::GROUPS;
use super::guess::Guess;
use super::levels::{fit_levels, frequencies};
use super::pyramid::TexturePyramid;
use super::source_light::{Colours, SeenLight, SourceLight};
use super::target_view::{Sight, TargetView};
use super::walks::{ByWavelength, Sums, Walker};

/// What becomes of camera rays in one water and view, per channel.
#[derive(Clone, Debug)]
pub struct Spread {
    attenuation: [f64; 3],
    /// In the place of `attenuation` where the scene goes by wavelength.
    seen_light: Option<SeenLight>,
    all: Scattered,
    groups: Vec<Scattered>,
}

/// What an unscattered ray brings.
#[derive(Clone, Copy, Debug)]
pub struct Unscattered {
    /// Transmittance per channel.
    pub transmittance: [f64; 3],
    /// What the channels see of the texture.
    pub colours: Colours,
}

/// What becomes of scattered camera rays, per channel.
#[derive(Clone, Debug)]
pub struct Scattered {
    /// Share of them that reach the target: polynomial in 1/cos - 1 of the view's angle.
    share: [[f64; 3]; 3],
    /// Weights of the pyramid's levels, sum 1.
    levels: [Vec<f32>; 3],
    /// What the channels see of the texture.
    colours: Colours,
}

impl Spread {
    /// Walks through `water` from the camera of `view` to the target, where the irradiance is as `guess` has it; `light`
    /// is the source's where the scene goes by wavelength.
    pub fn new(
        water: &Water,
        phase: &PhaseTable,
        view: &TargetView,
        (guess, light): (&Guess, Option<&SourceLight>),
        pyramid: &TexturePyramid,
        seed: u64,
    ) -> Self {
        let seen_light = light.map(|light| SeenLight::new(light, guess, view));
        let wavelengths =
            (light.zip(seen_light.as_ref())).map(|(light, seen)| ByWavelength { light, seen });
        let frequencies = frequencies(pyramid);
        let sums: [Vec<Sums>; 3] = std::array::from_fn(|k| {
            let walker = Walker::new(water, phase, view, guess, wavelengths, k);
            let groups = 0..GROUPS as u32;
            groups
                .map(|g| walker.walks(&frequencies, seed, g))
                .collect()
        });
        let all = sums.each_ref().map(|groups| Sums::of_all(groups));
        let scattered = |of: [&Sums; 3]| Scattered {
            share: of.map(Sums::share),
            levels: of.map(|s| fit_levels(pyramid, &frequencies, &s.transfer())),
            colours: Sums::colours(of),
        };
        Self {
            attenuation: water.iops.c(),
            all: scattered(all.each_ref()),
            groups: (0..GROUPS)
                .map(|g| scattered(sums.each_ref().map(|groups| &groups[g])))
                .collect(),
            seen_light,
        }
    }

    /// No water: nothing scatters; `seen_light` where the scene goes by wavelength all the same.
    pub fn none(pyramid: &TexturePyramid, seen_light: Option<SeenLight>) -> Self {
        let mut levels = vec![0.0; pyramid.levels()];
        levels[0] = 1.0;
        let nothing = Scattered {
            share: [[0.0; 3]; 3],
            levels: [levels.clone(), levels.clone(), levels],
            colours: Colours::OWN,
        };
        Self {
            attenuation: [0.0; 3],
            groups: vec![nothing.clone(); GROUPS],
            all: nothing,
            seen_light,
        }
    }

    /// What the unscattered ray of `sight` brings.
    #[inline]
    pub fn unscattered(&self, sight: &Sight) -> Unscattered {
        match &self.seen_light {
            None => Unscattered {
                transmittance: self.attenuation.map(|c| (-c * sight.range_m).exp()),
                colours: Colours::OWN,
            },
            Some(seen) => {
                let point = seen.at(sight.image);
                Unscattered {
                    transmittance: point.transmittance(sight.range_m),
                    colours: point.colours(),
                }
            }
        }
    }

    /// What becomes of scattered rays, from all walks.
    pub fn scattered(&self) -> &Scattered {
        &self.all
    }

    /// The same from each group of walks alone.
    pub fn groups(&self) -> &[Scattered] {
        &self.groups
    }
}

/// What becomes of scattered camera rays, by waves on the target instead of blurs of a texture.
#[derive(Clone, Debug)]
pub struct ScatteredWaves {
    share: [[f64; 3]; 3],
    /// Per channel the contrast left of each wave.
    pub transfer: [Vec<f64>; 3],
}

impl ScatteredWaves {
    /// Walks as those of [`Spread::new`], for waves of `frequencies_per_m`.
    pub fn new(
        water: &Water,
        phase: &PhaseTable,
        view: &TargetView,
        (guess, light): (&Guess, Option<&SourceLight>),
        frequencies_per_m: &[f64],
        seed: u64,
    ) -> Self {
        let seen_light = light.map(|light| SeenLight::new(light, guess, view));
        let wavelengths =
            (light.zip(seen_light.as_ref())).map(|(light, seen)| ByWavelength { light, seen });
        let sums: [Sums; 3] = std::array::from_fn(|k| {
            let walker = Walker::new(water, phase, view, guess, wavelengths, k);
            let walks = |group| walker.walks(frequencies_per_m, seed, group);
            Sums::of_all(&(0..GROUPS as u32).map(walks).collect::<Vec<_>>())
        });
        Self {
            share: sums.each_ref().map(Sums::share),
            transfer: sums.each_ref().map(Sums::transfer),
        }
    }

    /// Share of scattered rays that reach the target, per channel, at the cosine of the view's angle.
    pub fn share(&self, cosine: f64) -> [f64; 3] {
        share_at(&self.share, cosine)
    }
}

fn share_at(share: &[[f64; 3]; 3], cosine: f64) -> [f64; 3] {
    let m = 1.0 / cosine - 1.0;
    share.map(|[a, b, c]| (a + m * (b + m * c)).max(0.0))
}

impl Scattered {
    /// Share of scattered rays that reach the target, per channel, at the cosine of the view's angle.
    #[inline]
    pub fn share(&self, cosine: f64) -> [f64; 3] {
        share_at(&self.share, cosine)
    }

    /// Weights of the pyramid's levels for `channel`.
    #[inline]
    pub fn levels(&self, channel: usize) -> &[f32] {
        &self.levels[channel]
    }

    /// What the channels see of the texture.
    #[inline]
    pub fn colours(&self) -> &Colours {
        &self.colours
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use uw_media::Iops;
    use uw_media::phase::{HenyeyGreenstein, Phase};
    use uw_render::scene::{Texture, TextureFilter};

    use crate::environment::{Target, View, WaterBody, scene};
    use uw_calib::vehicle::Vehicle;
    use uw_scenery::textures::Pattern;

    fn view_of(distance_m: f64) -> TargetView {
        let texture = Texture {
            width: 1,
            height: 1,
            texels: vec![[0.5; 3]].into(),
            filter: TextureFilter::Nearest,
        };
        let target = Target {
            pattern: Pattern::Seabed,
            texture,
        };
        let water = WaterBody {
            jerlov: "II".parse().unwrap(),
            backscatter_fraction: 0.0183,
        };
        let view = View::Target {
            depth_m: 5.0,
            distance_m,
        };
        let scene = scene(&Vehicle::default(), &water, &target, view).unwrap();
        TargetView::new(&scene).unwrap()
    }

    fn pyramid() -> TexturePyramid {
        let texels: Vec<[f32; 3]> = (0..256 * 256)
            .map(|i| [(i % 256) as f32 / 256.0; 3])
            .collect();
        let texture = Texture {
            width: 256,
            height: 256,
            texels: texels.into(),
            filter: TextureFilter::Bilinear,
        };
        TexturePyramid::new(&texture, 2.0)
    }

    /// In water that scatters almost straight on nothing is lost but what is absorbed, and little is blurred.
    #[test]
    fn forward_scattering_spreads_but_does_not_lose_light() {
        let (a, b, g, d) = ([0.1, 0.3, 0.5], [0.05; 3], 0.9999, 1.0);
        let phase = Phase::HenyeyGreenstein(HenyeyGreenstein::new(g).unwrap());
        let water = Water {
            iops: Iops { a, b },
            phase: phase.clone(),
            refractive_index: 1.34,
            variation: uw_render::scene::Variation::default(),
        };
        let (view, pyramid) = (view_of(d), pyramid());
        let table = PhaseTable::new(&phase);
        let spread = Spread::new(&water, &table, &view, (&Guess::Even, None), &pyramid, 3);
        for x in [640.0, 100.0] {
            let sight = view.sight(x, 360.0).unwrap();
            let (range, cosine) = (sight.range_m, view.incidence(sight.direction));
            let direct = spread.unscattered(&sight).transmittance;
            for k in 0..3 {
                let all = direct[k] + spread.scattered().share(cosine)[k];
                let expected = (-a[k] * range).exp();
                assert!(
                    (all / expected - 1.0).abs() < 2e-3,
                    "{k} {cosine}: {all} {expected}"
                );
            }
        }
        let weights = spread.scattered().levels(1);
        assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        // A mean cosine of 0.9999 is a mean square angle of 2e-4; the spread is a centimetre at most, so next to
        // nothing may be in levels that blur by more than ten.
        let far: f32 = (0..pyramid.levels())
            .filter(|&l| pyramid.blur_m(l) > 0.1)
            .map(|l| weights[l])
            .sum();
        assert!(far < 0.05, "{weights:?}");
        assert!(weights[0] > 0.3, "{weights:?}");
    }

    #[test]
    fn the_view_knows_where_its_rays_meet_the_target() {
        let view = view_of(2.0);
        let centre = view.sight(640.0, 360.0).unwrap();
        assert!((centre.range_m - 2.0).abs() < 1e-12);
        let corner = view.sight(0.0, 360.0).unwrap();
        // Half of 60 degrees to the side.
        assert!((corner.range_m - 2.0 / 30f64.to_radians().cos()).abs() < 1e-9);
        let (dx, dy) = view.offset(centre.point, corner.point);
        assert!((dx + 2.0 * 30f64.to_radians().tan()).abs() < 1e-9 && dy.abs() < 1e-9);
        assert!(view.range_m(DVec3::new(0.0, 0.0, -5.0), DVec3::Z).is_none());
    }
}
