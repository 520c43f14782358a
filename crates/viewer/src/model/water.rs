//! The water as the panel sets it.

use uw_media::spectral::{JerlovWater, Response, WaterBands, WaterSpectrum};
use uw_media::{
    Iops, MediaError, WaterType,
    phase::{Draine, FournierForand, HenyeyGreenstein, Phase, Rayleigh, Tabulated},
};
use uw_render::scene::{self, Layer, Variation};

use super::{Cloud, DepthProfile};

/// Water: coefficients, clouds, phase function, refractive index.
#[derive(Clone, Debug, PartialEq)]
pub struct Water {
    /// Where absorption and scattering come from.
    pub coefficients: Coefficients,
    /// Clouds, which add to the coefficients.
    pub clouds: Vec<Cloud>,
    /// Phase function of all channels.
    pub phase: PhaseModel,
    /// Refractive index against air, in [1, 2].
    pub refractive_index: f64,
}

/// Absorption and scattering per channel.
#[derive(Clone, Debug, PartialEq)]
pub enum Coefficients {
    /// From the tables of the Jerlov types.
    Jerlov {
        /// Place along [`WaterType::ALL`], in [0, 9]; between two whole numbers a and b are mixed linearly.
        scale: f64,
        /// How wavelengths become channels.
        bands: WaterBands,
    },
    /// By wavelength, from a file.
    OfFile {
        /// The path, as the scene file has it.
        path: String,
        /// What it holds.
        spectrum: WaterSpectrum,
    },
    /// Set by hand, 1/m per channel.
    Direct(Iops),
    /// By depth.
    Profile(DepthProfile),
}

/// A phase function with the parameters that can be set.
#[derive(Clone, Debug)]
pub enum PhaseModel {
    /// Fournier-Forand.
    FournierForand {
        /// Refractive index of the particles relative to the water, > 1.
        n: f64,
        /// Backscatter fraction, in (0, 0.5).
        backscatter_fraction: f64,
    },
    /// Henyey-Greenstein with this mean cosine, in (-1, 1).
    HenyeyGreenstein {
        /// Mean cosine.
        g: f64,
    },
    /// Rayleigh.
    Rayleigh {
        /// Depolarisation ratio, in [0, 1].
        depolarisation: f64,
    },
    /// Draine.
    Draine {
        /// As in [`Draine::new`].
        g: f64,
        /// As in [`Draine::new`], >= 0.
        alpha: f64,
    },
    /// Petzold's average particle.
    Petzold,
    /// The same in all directions.
    Isotropic,
    /// A table or a mixture of the scene file, kept as it stands there.
    OfFile {
        /// The entry of the scene file.
        entry: toml::Value,
        /// What it means.
        phase: Phase,
    },
}

impl PartialEq for PhaseModel {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::OfFile { entry: a, .. }, Self::OfFile { entry: b, .. }) => a == b,
            (Self::OfFile { .. }, _) | (_, Self::OfFile { .. }) => false,
            _ => self.name() == other.name() && self.parameters() == other.parameters(),
        }
    }
}

impl PhaseModel {
    /// The default of scene files: closest to Petzold's average particle.
    pub const DEFAULT: Self = Self::FournierForand {
        n: 1.10,
        backscatter_fraction: 0.0183,
    };

    /// One of each model that has no file, with usual parameters.
    pub const CHOICES: [Self; 6] = [
        Self::DEFAULT,
        Self::HenyeyGreenstein { g: 0.924 },
        Self::Petzold,
        Self::Rayleigh {
            depolarisation: 0.09,
        },
        Self::Draine { g: 0.9, alpha: 1.0 },
        Self::Isotropic,
    ];

    /// The name in scene files.
    pub fn name(&self) -> &'static str {
        match self {
            Self::FournierForand { .. } => "fournier-forand",
            Self::HenyeyGreenstein { .. } => "henyey-greenstein",
            Self::Rayleigh { .. } => "rayleigh",
            Self::Draine { .. } => "draine",
            Self::Petzold => "petzold",
            Self::Isotropic => "isotropic",
            Self::OfFile { phase, .. } => phase.name(),
        }
    }

    /// Names and values of the parameters, as scene files hold them.
    pub fn parameters(&self) -> Vec<(&'static str, f64)> {
        match *self {
            Self::FournierForand {
                n,
                backscatter_fraction,
            } => vec![("n", n), ("backscatter_fraction", backscatter_fraction)],
            Self::HenyeyGreenstein { g } => vec![("g", g)],
            Self::Rayleigh { depolarisation } => vec![("depolarisation", depolarisation)],
            Self::Draine { g, alpha } => vec![("g", g), ("alpha", alpha)],
            Self::Petzold | Self::Isotropic | Self::OfFile { .. } => Vec::new(),
        }
    }

    /// The phase function.
    ///
    /// # Errors
    /// A parameter outside its range.
    pub fn phase(&self) -> Result<Phase, MediaError> {
        Ok(match self {
            Self::FournierForand {
                n,
                backscatter_fraction,
            } => Phase::FournierForand(FournierForand::new(*n, *backscatter_fraction)?),
            Self::HenyeyGreenstein { g } => Phase::HenyeyGreenstein(HenyeyGreenstein::new(*g)?),
            Self::Rayleigh { depolarisation } => Phase::Rayleigh(Rayleigh::new(*depolarisation)?),
            Self::Draine { g, alpha } => Phase::Draine(Draine::new(*g, *alpha)?),
            Self::Petzold => Phase::Tabulated(Tabulated::petzold()),
            Self::Isotropic => Phase::Isotropic,
            Self::OfFile { phase, .. } => phase.clone(),
        })
    }
}

impl Default for Water {
    /// Jerlov IB with the particles closest to Petzold's.
    fn default() -> Self {
        Self {
            coefficients: Coefficients::Jerlov {
                scale: 2.0,
                bands: WaterBands::Spectral,
            },
            clouds: Vec::new(),
            phase: PhaseModel::DEFAULT,
            refractive_index: 1.34,
        }
    }
}

impl Coefficients {
    /// Absorption and scattering per channel, 1/m; of water by wavelength those near zero range for `response`, of a profile the
    /// mean of its entries.
    ///
    /// # Errors
    /// Bands that the tables do not cover.
    pub fn iops(&self, response: &Response) -> Result<Iops, MediaError> {
        match self {
            Self::Direct(iops) => Ok(*iops),
            Self::OfFile { spectrum, .. } => Ok(spectrum.near_zero_range(response)),
            Self::Jerlov { scale, bands } => bands.iops(neighbours(*scale), response),
            Self::Profile(profile) => {
                let layers = profile.layers(response)?;
                let first = layers[0].iops;
                let clouds = Vec::new();
                let variation = Variation {
                    layers,
                    plumes: clouds,
                };
                Ok(variation.mean_iops(first))
            }
        }
    }

    /// The water by wavelength, of a profile the mean of its entries; `None` where it is known in three bands.
    ///
    /// # Errors
    /// Types that were not measured.
    pub fn spectrum(&self) -> Result<Option<WaterSpectrum>, MediaError> {
        match self {
            Self::Direct(_) => Ok(None),
            Self::OfFile { spectrum, .. } => Ok(Some(spectrum.clone())),
            Self::Jerlov { scale, bands } => bands.spectrum(neighbours(*scale)),
            Self::Profile(profile) => profile.mean_spectrum(),
        }
    }

    /// What is drawn: (wavelength in nm, a, b in 1/m); nothing of coefficients without wavelengths and of profiles.
    pub fn rows(&self) -> Vec<(f64, f64, f64)> {
        if let Self::Profile(_) = self {
            return Vec::new();
        }
        match (self, self.spectrum()) {
            (_, Ok(Some(spectrum))) => {
                let nodes = spectrum.a.nodes().iter();
                nodes.map(|&(nm, a)| (nm, a, spectrum.b.at(nm))).collect()
            }
            (Self::Jerlov { scale, .. }, _) => spectrum_at(*scale),
            _ => Vec::new(),
        }
    }
}

/// The water at a place along [`WaterType::ALL`]: between two neighbours, the share in [0, 1).
pub fn neighbours(scale: f64) -> JerlovWater {
    let last = WaterType::ALL.len() - 1;
    let scale = scale.clamp(0.0, last as f64);
    let first = (scale.floor() as usize).min(last);
    JerlovWater {
        from: WaterType::ALL[first],
        to: WaterType::ALL[(first + 1).min(last)],
        share: scale - first as f64,
    }
}

/// Absorption and scattering against wavelength at a place along the types: (wavelength in nm, a, b in 1/m).
pub fn spectrum_at(scale: f64) -> Vec<(f64, f64, f64)> {
    let JerlovWater { from, to, share } = neighbours(scale);
    uw_media::spectrum(from)
        .iter()
        .zip(uw_media::spectrum(to))
        .map(|(x, y)| {
            (
                x.wavelength_nm,
                x.a + share * (y.a - x.a),
                x.b + share * (y.b - x.b),
            )
        })
        .collect()
}

/// A name of the place, such as "3C" or "1C-3C, 40 %".
pub fn scale_name(scale: f64) -> String {
    let JerlovWater { from, to, share } = neighbours(scale);
    if share == 0.0 {
        from.name().to_owned()
    } else {
        format!("{from}-{to}, {:.0} %", 100.0 * share)
    }
}

impl Water {
    /// Whether it differs from place to place.
    pub fn varies(&self) -> bool {
        let by_depth = match &self.coefficients {
            Coefficients::Profile(profile) => profile.entries().len() > 1,
            _ => false,
        };
        by_depth || !self.clouds.is_empty()
    }

    /// The water as the renderer takes it.
    ///
    /// # Errors
    /// A parameter outside its range.
    pub fn build(&self, response: &Response) -> Result<scene::Water, MediaError> {
        let homogeneous = self.coefficients.iops(response)?;
        let variation = self.variation(homogeneous, response)?;
        Ok(scene::Water {
            iops: variation.mean_iops(homogeneous),
            phase: self.phase.phase()?,
            refractive_index: self.refractive_index,
            variation,
        })
    }

    /// How the water differs from place to place, as scene files have it: with clouds there is at least one layer.
    fn variation(&self, homogeneous: Iops, response: &Response) -> Result<Variation, MediaError> {
        let layers = match &self.coefficients {
            Coefficients::Profile(profile) => profile.layers(response)?,
            _ if self.clouds.is_empty() => Vec::new(),
            same => vec![Layer {
                depth_m: 0.0,
                iops: homogeneous,
                spectrum: same.spectrum()?,
            }],
        };
        Ok(Variation {
            layers,
            plumes: self.clouds.iter().map(Into::into).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use uw_media::{Bands, channel_iops};

    use super::*;

    #[test]
    fn whole_places_are_the_types_and_halves_lie_between() {
        let at = |scale| {
            let bands = WaterBands::Three(Bands::Mean);
            let iops = Coefficients::Jerlov { scale, bands }.iops(&Response::boxes());
            iops.expect("covered")
        };
        for (i, water_type) in WaterType::ALL.into_iter().enumerate() {
            let table = channel_iops(water_type, &Bands::Mean).expect("covered");
            assert_eq!(at(i as f64), table);
            assert_eq!(scale_name(i as f64), water_type.name());
        }
        let (low, middle, high) = (at(5.0), at(5.5), at(6.0));
        for k in 0..3 {
            assert!((middle.a[k] - 0.5 * (low.a[k] + high.a[k])).abs() < 1e-12);
            assert!((middle.b[k] - 0.5 * (low.b[k] + high.b[k])).abs() < 1e-12);
        }
        assert_eq!(scale_name(5.25), "1C-3C, 25 %");
    }

    #[test]
    fn bands_without_data_are_refused() {
        let scale = 0.0;
        let bands = Bands::Measured;
        let bands = WaterBands::Three(bands);
        let iops = Coefficients::Jerlov { scale, bands }.iops(&Response::boxes());
        assert!(iops.is_err());
    }
}
