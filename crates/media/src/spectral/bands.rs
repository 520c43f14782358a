//! How the spectra of a water become the three channels of a camera.

use std::fmt;
use std::str::FromStr;

use super::{JerlovWater, Response, WaterSpectrum};
use crate::bands::{Bands, channel_iops};
use crate::error::MediaError;
use crate::iops::Iops;

/// Name of the bands that leave a Jerlov type as it is by wavelength.
const SPECTRAL: &str = "spectral";
/// The same of the spectra that Williamson and Hollins measured.
const SPECTRAL_MEASURED: &str = "spectral-measured";

/// How the spectra of a water become the three channels of a camera.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum WaterBands {
    /// "spectral": they stay, and all light goes by wavelength.
    #[default]
    Spectral,
    /// "spectral-measured": the same with the spectra that Williamson and Hollins measured.
    SpectralMeasured,
    /// One coefficient for each channel.
    Three(Bands),
}

impl WaterBands {
    /// Whether light goes by wavelength.
    pub fn is_spectral(&self) -> bool {
        !matches!(self, Self::Three(_))
    }

    /// The water by wavelength; `None` in three bands.
    ///
    /// # Errors
    /// Types that were not measured.
    pub fn spectrum(&self, water: JerlovWater) -> Result<Option<WaterSpectrum>, MediaError> {
        match self {
            Self::Spectral => Ok(Some(water.spectrum())),
            Self::SpectralMeasured => water.measured().map(Some),
            Self::Three(_) => Ok(None),
        }
    }

    /// Absorption and scattering per channel, 1/m; by wavelength those near zero range for `response`.
    ///
    /// # Errors
    /// As [`channel_iops`] and [`WaterSpectrum::measured`].
    pub fn iops(&self, water: JerlovWater, response: &Response) -> Result<Iops, MediaError> {
        let near = |spectrum: WaterSpectrum| spectrum.near_zero_range(response);
        match self {
            Self::Spectral => Ok(near(water.spectrum())),
            Self::SpectralMeasured => water.measured().map(near),
            Self::Three(bands) => water.mixed(|t| channel_iops(t, bands), Iops::towards),
        }
    }
}

impl FromStr for WaterBands {
    type Err = MediaError;

    fn from_str(text: &str) -> Result<Self, MediaError> {
        match text {
            SPECTRAL => Ok(Self::Spectral),
            SPECTRAL_MEASURED => Ok(Self::SpectralMeasured),
            text => text.parse().map(Self::Three),
        }
    }
}

impl fmt::Display for WaterBands {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Spectral => f.write_str(SPECTRAL),
            Self::SpectralMeasured => f.write_str(SPECTRAL_MEASURED),
            Self::Three(bands) => bands.fmt(f),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::WaterType;

    #[test]
    fn bands_are_read_as_they_are_written() {
        for name in [
            "mean",
            "paper-printed",
            "camera:imx219",
            SPECTRAL,
            SPECTRAL_MEASURED,
        ] {
            let bands: WaterBands = name.parse().expect(name);
            assert_eq!(bands.to_string(), name);
        }
        let told = "narrow".parse::<WaterBands>().unwrap_err().to_string();
        assert!(told.contains("narrow") && told.contains(SPECTRAL), "{told}");
    }

    #[test]
    fn a_mixture_lies_between_its_types() {
        let water = JerlovWater {
            from: WaterType::C5,
            to: WaterType::C7,
            share: 0.25,
        };
        let boxes = Response::boxes();
        for bands in [WaterBands::Spectral, WaterBands::Three(Bands::Mean)] {
            let of = |water| bands.iops(water, &boxes).expect("covered").a;
            let (mixed, ends) = (of(water), [water.from, water.to].map(|t| of(t.into())));
            for k in 0..3 {
                let expected = 0.75 * ends[0][k] + 0.25 * ends[1][k];
                assert!((mixed[k] / expected - 1.0).abs() < 1e-9, "{bands}");
            }
        }
        // Near zero range light by wavelength is about what three bands have, whose table is coarser.
        let fine = WaterBands::Spectral.iops(water, &boxes).expect("covered");
        let coarse = WaterBands::Three(Bands::Mean)
            .iops(water, &boxes)
            .expect("covered");
        for k in 0..3 {
            assert!(
                (fine.b[k] / coarse.b[k] - 1.0).abs() < 0.1,
                "{fine:?} {coarse:?}"
            );
        }
        // The type 7C was not measured, and counts only where it is asked for.
        assert!(WaterBands::SpectralMeasured.spectrum(water).is_err());
        let only = WaterBands::SpectralMeasured.spectrum(WaterType::C5.into());
        assert!(only.expect("measured").is_some());
    }
}
