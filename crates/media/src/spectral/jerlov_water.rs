//! Waters on Jerlov's scale, between types too.

use std::fmt;
use std::str::FromStr;

use super::WaterSpectrum;
use crate::bands::{Bands, channel_iops};
use crate::error::MediaError;
use crate::iops::Iops;
use crate::jerlov::WaterType;

/// A water on Jerlov's scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JerlovWater {
    /// A type.
    pub from: WaterType,
    /// Another type.
    pub to: WaterType,
    /// How far the water is from the first to the second, in [0, 1]; absorption and scattering are linear between them.
    pub share: f64,
}

impl From<WaterType> for JerlovWater {
    fn from(only: WaterType) -> Self {
        Self {
            from: only,
            to: only,
            share: 0.0,
        }
    }
}

impl JerlovWater {
    /// Jerlov's scale in tenths from type to type, clear to turbid: the ocean's waters, and the coast's.
    pub fn scale() -> [Vec<Self>; 2] {
        let coast = WaterType::ALL.partition_point(|own| *own < WaterType::C1);
        [&WaterType::ALL[..coast], &WaterType::ALL[coast..]].map(|types| {
            let between = types.windows(2).flat_map(|pair| {
                let mixed = (1..10).map(|tenths| Self {
                    from: pair[0],
                    to: pair[1],
                    share: f64::from(tenths) / 10.0,
                });
                std::iter::once(pair[0].into()).chain(mixed)
            });
            between
                .chain(types.last().map(|last| (*last).into()))
                .collect()
        })
    }

    /// Absorption and scattering by wavelength, 400 to 700 nm.
    pub fn spectrum(&self) -> WaterSpectrum {
        let from = WaterSpectrum::jerlov(self.from);
        match self.share {
            0.0 => from,
            share => from.towards(&WaterSpectrum::jerlov(self.to), share),
        }
    }

    /// Absorption and scattering per channel as plain means over three bands, 1/m.
    ///
    /// # Errors
    /// As [`channel_iops`].
    pub fn iops(&self) -> Result<Iops, MediaError> {
        self.mixed(|own| channel_iops(own, &Bands::Mean), Iops::towards)
    }

    /// What `of` gives for the types, mixed; the second is not asked for where it does not count.
    pub(super) fn mixed<T>(
        &self,
        of: impl Fn(WaterType) -> Result<T, MediaError>,
        towards: fn(&T, &T, f64) -> T,
    ) -> Result<T, MediaError> {
        let first = of(self.from)?;
        match self.share {
            0.0 => Ok(first),
            share => Ok(towards(&first, &of(self.to)?, share)),
        }
    }

    /// The same as Williamson and Hollins (2022) measured it.
    pub(super) fn measured(&self) -> Result<WaterSpectrum, MediaError> {
        self.mixed(WaterSpectrum::measured, WaterSpectrum::towards)
    }
}

impl fmt::Display for JerlovWater {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { from, to, share } = self;
        match *share {
            0.0 => write!(f, "{from}"),
            _ => write!(f, "{from}-{to}@{share}"),
        }
    }
}

impl FromStr for JerlovWater {
    type Err = String;

    /// A type's name, or a mixture of two written as `IB-II@0.4` (0.4 of the way from IB to II).
    fn from_str(text: &str) -> Result<Self, String> {
        let one = |name: &str| name.parse::<WaterType>().map_err(|e| e.to_string());
        let Some((types, share)) = text.split_once('@') else {
            return one(text).map(Self::from);
        };
        let (Some((from, to)), Ok(share)) = (types.split_once('-'), share.parse::<f64>()) else {
            return Err(format!(
                "a water between two types must be written as \"IB-II@0.4\", got {text:?}"
            ));
        };
        if !(0.0..=1.0).contains(&share) {
            return Err(format!(
                "the share in {text:?} must be in [0, 1], got {share}"
            ));
        }
        Ok(Self {
            from: one(from)?,
            to: one(to)?,
            share,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_has_every_type_and_reads_back() {
        let [ocean, coast] = JerlovWater::scale();
        assert_eq!((ocean.len(), coast.len()), (41, 41));
        let all: Vec<String> = ocean.iter().chain(&coast).map(|w| w.to_string()).collect();
        for water_type in WaterType::ALL {
            assert!(all.contains(&water_type.to_string()), "{water_type}");
        }
        assert!(all.contains(&"IB-II@0.4".to_owned()) && !all.iter().any(|w| w.contains("III-1C")));
        for (water, name) in ocean.iter().chain(&coast).zip(&all) {
            assert_eq!(name.parse().as_ref(), Ok(water));
        }
    }

    #[test]
    fn what_is_no_water_is_refused() {
        for (text, told) in [
            ("ib", "did you mean \"IB\"?"),
            ("IB-II", "IB-II"),
            ("IB@0.4", "must be written as"),
            ("IB-II@1.4", "must be in [0, 1], got 1.4"),
            ("IB-IV@0.4", "IV"),
        ] {
            let error = text.parse::<JerlovWater>().expect_err(text);
            assert!(error.contains(told), "{error}");
        }
    }
}
