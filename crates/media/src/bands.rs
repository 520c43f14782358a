//! From spectra to the three colour channels.

use std::fmt;
use std::str::FromStr;
use std::sync::LazyLock;

use crate::error::MediaError;
use crate::iops::Iops;
use crate::jerlov::{
    SpectralIop, WaterType, fine_spectrum, measured_spectrum, published_spectrum, spectrum,
};
use crate::tables;

/// How a spectrum of a and b becomes one value for each of R, G and B.
///
/// A wideband coefficient holds near zero range only: the most absorbed part of a band dies first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Bands {
    /// "mean": mean of the tabulated samples in 600-700, 500-600 and 400-500 nm, both ends included.
    #[default]
    Mean,
    /// "paper-printed": the same on the table as printed, with its misprints in 3C and 5C, to
    /// reproduce published results; physically wrong there.
    PaperPrinted,
    /// "measured": integral mean over the same intervals of the spectra that Williamson & Hollins
    /// (2022) measured for IB, II, III, 1C, 3C and 5C.
    Measured,
    /// "camera:NAME": mean weighted by the response of a camera's channels, light of equal energy.
    Camera(Camera),
    /// "R,G,B" with intervals such as "600-700,500-600,400-500": as `Mean` over these. An interval
    /// without a tabulated wavelength takes the straight line through its neighbours, at its middle.
    Intervals([Interval; 3]),
}

/// A closed interval of wavelengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Shortest wavelength, nm.
    pub from_nm: f64,
    /// Longest wavelength, nm.
    pub to_nm: f64,
}

/// A camera whose spectral response is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Camera {
    /// "canon5d2": Canon EOS 5D Mark II.
    Canon5d2,
    /// "nikon_d5100": Nikon D5100.
    NikonD5100,
    /// "imx219": Sony IMX219, the sensor of the Raspberry Pi camera v2.
    Imx219,
}

const DEFAULT_INTERVALS: [Interval; 3] = [
    Interval {
        from_nm: 600.0,
        to_nm: 700.0,
    },
    Interval {
        from_nm: 500.0,
        to_nm: 600.0,
    },
    Interval {
        from_nm: 400.0,
        to_nm: 500.0,
    },
];

/// Names that [`Bands`] reads, for error messages.
const KNOWN_BANDS: &str = "mean, paper-printed, measured, camera:canon5d2, camera:nikon_d5100, \
     camera:imx219, or three intervals in nm such as 600-700,500-600,400-500; or by wavelength spectral, \
     spectral-measured";

impl Camera {
    /// All cameras.
    pub const ALL: [Camera; 3] = [Camera::Canon5d2, Camera::NikonD5100, Camera::Imx219];

    /// The name, as in "camera:NAME" and in the table of responses.
    pub fn name(self) -> &'static str {
        match self {
            Camera::Canon5d2 => "canon5d2",
            Camera::NikonD5100 => "nikon_d5100",
            Camera::Imx219 => "imx219",
        }
    }
}

/// Absorption and scattering of a Jerlov type in the three channels, 1/m.
///
/// # Errors
/// `Bands::Measured` covers six types only; an interval must lie in the table, 300 to 700 nm.
pub fn channel_iops(water_type: WaterType, bands: &Bands) -> Result<Iops, MediaError> {
    let channels: [Channel; 3] = match bands {
        Bands::Mean => DEFAULT_INTERVALS.map(|i| mean_of_samples(spectrum(water_type), i, false)),
        Bands::PaperPrinted => paper_printed(water_type),
        Bands::Measured => measured(water_type)?,
        Bands::Camera(camera) => camera_weighted(water_type, *camera),
        Bands::Intervals(intervals) => {
            for interval in intervals {
                interval.check()?;
            }
            intervals.map(|i| mean_of_samples(spectrum(water_type), i, false))
        }
    };
    Ok(Iops {
        a: channels.map(|channel| channel.a),
        b: channels.map(|channel| channel.b),
    })
}

/// a and b of one channel, 1/m.
#[derive(Clone, Copy)]
struct Channel {
    a: f64,
    b: f64,
}

/// Sum of weighted samples over the sum of the weights.
fn weighted_mean(samples: impl Iterator<Item = (f64, SpectralIop)>) -> Channel {
    let (mut weights, mut a, mut b) = (0.0, 0.0, 0.0);
    for (weight, sample) in samples {
        weights += weight;
        a += weight * sample.a;
        b += weight * sample.b;
    }
    Channel {
        a: a / weights,
        b: b / weights,
    }
}

fn mean_of_samples(spectrum: &[SpectralIop], interval: Interval, skip_misprints: bool) -> Channel {
    let inside =
        |s: &&SpectralIop| interval.contains(s.wavelength_nm) && !(skip_misprints && s.misprint);
    if spectrum.iter().any(|s| inside(&s)) {
        weighted_mean(spectrum.iter().filter(inside).map(|s| (1.0, *s)))
    } else {
        interpolated(spectrum, 0.5 * (interval.from_nm + interval.to_nm))
    }
}

/// The straight line between the neighbours of a wavelength inside the spectrum.
fn interpolated(spectrum: &[SpectralIop], wavelength_nm: f64) -> Channel {
    let after = spectrum
        .partition_point(|s| s.wavelength_nm < wavelength_nm)
        .clamp(1, spectrum.len() - 1);
    let (before, after) = (spectrum[after - 1], spectrum[after]);
    let share =
        (wavelength_nm - before.wavelength_nm) / (after.wavelength_nm - before.wavelength_nm);
    weighted_mean([(1.0 - share, before), (share, after)].into_iter())
}

/// The published script leaves the misprinted 600 nm sample out of the green of 5C, and nothing else.
fn paper_printed(water_type: WaterType) -> [Channel; 3] {
    let printed = published_spectrum(water_type);
    let [red, green, blue] = DEFAULT_INTERVALS;
    [
        mean_of_samples(printed, red, false),
        mean_of_samples(printed, green, water_type == WaterType::C5),
        mean_of_samples(printed, blue, false),
    ]
}

fn measured(water_type: WaterType) -> Result<[Channel; 3], MediaError> {
    let spectrum = measured_spectrum(water_type)?;
    Ok(DEFAULT_INTERVALS.map(|interval| integral_mean(spectrum, interval)))
}

/// Trapezoidal mean over an interval whose ends are tabulated.
fn integral_mean(spectrum: &[SpectralIop], interval: Interval) -> Channel {
    let inside: Vec<SpectralIop> = spectrum
        .iter()
        .filter(|s| interval.contains(s.wavelength_nm))
        .copied()
        .collect();
    weighted_mean(inside.windows(2).flat_map(|pair| {
        let width = pair[1].wavelength_nm - pair[0].wavelength_nm;
        [(width, pair[0]), (width, pair[1])]
    }))
}

/// Response of one camera at one wavelength, per unit of energy, R, G, B.
struct CameraSample {
    wavelength_nm: f64,
    response: [f64; 3],
}

fn camera_samples(camera: Camera) -> &'static [CameraSample] {
    static TABLE: LazyLock<[Vec<CameraSample>; 3]> = LazyLock::new(|| {
        Camera::ALL.map(|camera| {
            tables::rows(tables::CAMERAS)
                .map(|row| {
                    let wavelength_nm = row.number("wavelength_nm");
                    // The IMX219 curve counts photons; the energy of a photon is ~ 1/wavelength.
                    let per_energy = match camera {
                        Camera::Imx219 => wavelength_nm,
                        Camera::Canon5d2 | Camera::NikonD5100 => 1.0,
                    };
                    let channel =
                        |c: &str| row.number(&format!("{}_{c}", camera.name())) * per_energy;
                    CameraSample {
                        wavelength_nm,
                        response: [channel("r"), channel("g"), channel("b")],
                    }
                })
                .collect()
        })
    });
    &TABLE[camera as usize]
}

fn camera_weighted(water_type: WaterType, camera: Camera) -> [Channel; 3] {
    let fine = fine_spectrum(water_type);
    std::array::from_fn(|k| {
        weighted_mean(fine.iter().flat_map(|sample| {
            camera_samples(camera)
                .iter()
                .filter(|c| c.wavelength_nm == sample.wavelength_nm)
                .map(|c| (c.response[k], *sample))
        }))
    })
}

impl Interval {
    /// Shortest and longest wavelength of the tables, nm.
    const TABLE_NM: (f64, f64) = (300.0, 700.0);
    const EXPECTED: &'static str = "FROM-TO in nm with 300 <= FROM <= TO <= 700";

    fn contains(self, wavelength_nm: f64) -> bool {
        (self.from_nm..=self.to_nm).contains(&wavelength_nm)
    }

    fn check(self) -> Result<(), MediaError> {
        let valid = Self::TABLE_NM.0 <= self.from_nm
            && self.from_nm <= self.to_nm
            && self.to_nm <= Self::TABLE_NM.1;
        if valid {
            Ok(())
        } else {
            Err(MediaError::BadInterval {
                got: self.to_string(),
                expected: Self::EXPECTED,
            })
        }
    }
}

impl fmt::Display for Interval {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-{}", self.from_nm, self.to_nm)
    }
}

impl FromStr for Interval {
    type Err = MediaError;

    fn from_str(text: &str) -> Result<Self, MediaError> {
        let bad = || MediaError::BadInterval {
            got: text.to_owned(),
            expected: Self::EXPECTED,
        };
        let (from, to) = text.split_once('-').ok_or_else(bad)?;
        let interval = Self {
            from_nm: from.trim().parse().map_err(|_| bad())?,
            to_nm: to.trim().parse().map_err(|_| bad())?,
        };
        interval.check()?;
        Ok(interval)
    }
}

impl fmt::Display for Bands {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Bands::Mean => f.pad("mean"),
            Bands::PaperPrinted => f.pad("paper-printed"),
            Bands::Measured => f.pad("measured"),
            Bands::Camera(camera) => write!(f, "camera:{}", camera.name()),
            Bands::Intervals([red, green, blue]) => write!(f, "{red},{green},{blue}"),
        }
    }
}

impl FromStr for Bands {
    type Err = MediaError;

    fn from_str(text: &str) -> Result<Self, MediaError> {
        let unknown = || MediaError::UnknownName {
            kind: "bands",
            got: text.to_owned(),
            known: KNOWN_BANDS.to_owned(),
        };
        match text {
            "mean" => return Ok(Bands::Mean),
            "paper-printed" => return Ok(Bands::PaperPrinted),
            "measured" => return Ok(Bands::Measured),
            _ => {}
        }
        if let Some(name) = text.strip_prefix("camera:") {
            let camera = Camera::ALL.into_iter().find(|camera| camera.name() == name);
            return camera.map(Bands::Camera).ok_or_else(unknown);
        }
        let parts: Vec<&str> = text.split(',').map(str::trim).collect();
        let [red, green, blue] = parts[..] else {
            return Err(unknown());
        };
        Ok(Bands::Intervals([
            red.parse()?,
            green.parse()?,
            blue.parse()?,
        ]))
    }
}
