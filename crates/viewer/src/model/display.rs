//! From radiance to what is shown: the sensor's picture, a layer, or false colours.

use std::sync::Arc;

use eframe::wgpu::Texture;
use egui::{Color32, ColorImage};
use serde::{Deserialize, Serialize};
use uw_render::{
    film::Film,
    gpu::Look,
    image::{Counts, ExrImage, LayerData, Picture, linear_to_srgb},
    layers::{self, RenderLayer},
    prepare::Prepared,
    scene::{Encoding, Sensor},
    sensor::channel_means,
};

/// What of the render is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ShownLayer {
    /// The whole picture.
    #[default]
    Picture,
    /// One layer of it.
    Layer(RenderLayer),
}

/// A scale of colours for single values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FalseColour {
    /// The picture as the sensor gives it.
    #[default]
    Off,
    /// Dark blue over green to yellow.
    Viridis,
    /// Black over red to white.
    Inferno,
}

/// How the film becomes a picture on the screen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Display {
    /// The layer.
    pub layer: ShownLayer,
    /// False colours of the mean over the channels.
    pub false_colour: FalseColour,
    /// Whether false colours follow the logarithm.
    pub logarithmic: bool,
}

/// Ends of the scale of false colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Legend {
    /// Value of the first colour.
    pub low: f32,
    /// Value of the last colour.
    pub high: f32,
    /// Unit of the values.
    pub unit: &'static str,
    /// The scale.
    pub colours: FalseColour,
    /// Whether it follows the logarithm.
    pub logarithmic: bool,
}

/// The pixels of a picture.
#[derive(Clone, Debug)]
pub enum Pixels {
    /// On the host.
    Image(ColorImage),
    /// On the adapter of the window, with the sensor that took them.
    Texture(Arc<Texture>, Box<Sensor>),
}

/// A picture ready for the screen.
#[derive(Clone, Debug)]
pub struct Shown {
    /// The pixels.
    pub pixels: Pixels,
    /// The radiance of all sources, W/(m² sr); empty where the picture stays on the adapter and nobody probes it.
    pub radiance: Vec<[f32; 3]>,
    /// Values of the shown layer, where it is not the whole picture.
    pub values: Option<LayerData>,
    /// Scale of false colours, where they are shown.
    pub legend: Option<Legend>,
    /// Linear signal per radiance that was used.
    pub exposure: f64,
}

/// Share of the values below the first and above the last colour.
const TAIL: f64 = 0.01;
/// Values from which the ends of a scale are taken.
const SAMPLED_VALUES: usize = 8192;
/// Seed of the sensor noise on the screen: it stands still, as a photograph does.
const NOISE_SEED: u64 = 0;

/// Anchors of viridis and inferno (matplotlib, CC0), evenly spaced.
const VIRIDIS: [[u8; 3]; 10] = [
    [68, 1, 84],
    [72, 40, 120],
    [62, 74, 137],
    [49, 104, 142],
    [38, 130, 142],
    [31, 158, 137],
    [53, 183, 121],
    [109, 205, 89],
    [180, 222, 44],
    [253, 231, 37],
];
const INFERNO: [[u8; 3]; 10] = [
    [0, 0, 4],
    [27, 12, 65],
    [74, 12, 107],
    [120, 28, 109],
    [165, 44, 96],
    [207, 68, 70],
    [237, 105, 37],
    [251, 155, 6],
    [247, 209, 61],
    [252, 255, 164],
];

impl FalseColour {
    /// All, with their names.
    pub const ALL: [(Self, &'static str); 3] = [
        (Self::Off, "Off"),
        (Self::Viridis, "Viridis"),
        (Self::Inferno, "Inferno"),
    ];

    /// Colour at `t` in [0, 1]; grey for what is not a number.
    pub fn colour(self, t: f32) -> Color32 {
        let anchors = match self {
            Self::Inferno => &INFERNO,
            Self::Off | Self::Viridis => &VIRIDIS,
        };
        if t.is_nan() {
            return Color32::GRAY;
        }
        let fraction = t.clamp(0.0, 1.0) * (anchors.len() - 1) as f32;
        let first = (fraction as usize).min(anchors.len() - 2);
        let weight = fraction - first as f32;
        let [r, g, b] = std::array::from_fn(|k| {
            let (x, y) = (
                f32::from(anchors[first][k]),
                f32::from(anchors[first + 1][k]),
            );
            (x + weight * (y - x)).round() as u8
        });
        Color32::from_rgb(r, g, b)
    }
}

impl Legend {
    /// Place of a value on the scale, in [0, 1] between its ends.
    pub fn fraction(&self, value: f32) -> f32 {
        if self.logarithmic {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }
}

impl ShownLayer {
    /// All layers of a scene with these lamps, with their names.
    pub fn all(lamp_names: &[String]) -> Vec<(Self, String)> {
        let layers = RenderLayer::by_names(&["all"], lamp_names).unwrap_or_default();
        let named = |layer: RenderLayer| (Self::Layer(layer), layer.name(lamp_names));
        let whole = (Self::Picture, "picture".to_owned());
        [whole]
            .into_iter()
            .chain(layers.into_iter().map(named))
            .collect()
    }

    /// The same layer, or the whole picture where a scene has fewer lamps.
    pub fn within(self, lamps: usize) -> Self {
        match self {
            Self::Layer(RenderLayer::Lamp(index)) if index >= lamps => Self::Picture,
            other => other,
        }
    }

    /// Unit of its values.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Layer(RenderLayer::Depth | RenderLayer::Position) => "m",
            Self::Layer(
                RenderLayer::Normal | RenderLayer::Reflectance | RenderLayer::Transmittance,
            ) => "",
            Self::Layer(RenderLayer::Variance) => "(W/(m² sr))²",
            _ => "W/(m² sr)",
        }
    }

    fn is_single(self) -> bool {
        matches!(
            self,
            Self::Layer(RenderLayer::Depth | RenderLayer::Variance)
        )
    }
}

impl Shown {
    /// A picture on the adapter of the window, from a sensor that is set for it.
    pub fn on_adapter(texture: Arc<Texture>, radiance: Vec<[f32; 3]>, sensor: Sensor) -> Self {
        Self {
            exposure: sensor.exposure_factor_of(|| [1.0; 3]),
            pixels: Pixels::Texture(texture, Box::new(sensor)),
            radiance,
            values: None,
            legend: None,
        }
    }

    /// The pixels, where they are on the host.
    pub fn image(&self) -> Option<&ColorImage> {
        match &self.pixels {
            Pixels::Image(image) => Some(image),
            Pixels::Texture(..) => None,
        }
    }

    /// Red, green and blue of the pixel of that index, as shown; without noise where the picture is on the adapter.
    pub fn counts(&self, index: usize) -> Option<[u8; 3]> {
        match &self.pixels {
            Pixels::Image(image) => image.pixels.get(index).map(|p| [p.r(), p.g(), p.b()]),
            Pixels::Texture(_, sensor) => {
                let picture = Picture {
                    data: vec![*self.radiance.get(index)?],
                    ..Picture::black(1, 1)
                };
                let sensor = Sensor {
                    noise: None,
                    ..**sensor
                };
                bytes(&sensor.expose(&picture, NOISE_SEED).counts)
                    .first()
                    .copied()
            }
        }
    }
}

/// Whether the display wants nothing but the sensor's picture, as the adapter of the window can make it by itself: with
/// neither a measured curve nor vignetting.
pub fn is_photograph(display: &Display, sensor: &Sensor, lamps: usize) -> bool {
    let known = !matches!(sensor.encoding, Encoding::Curve(_)) && sensor.vignetting.is_none();
    known
        && display.layer.within(lamps) == ShownLayer::Picture
        && display.false_colour == FalseColour::Off
}

/// The same for the adapter: what `sensor`, set for the picture, makes of it.
pub fn look(sensor: &Sensor) -> Look {
    Look {
        exposure: sensor.exposure_factor_of(|| [1.0; 3]),
        colours: sensor.color_matrix,
        encoding: sensor.encoding,
        bits: sensor.bits,
        noise: sensor.noise,
        noise_seed: NOISE_SEED,
    }
}

/// The picture of `film` as `display` and `sensor` want it.
pub fn compose(scene: &Prepared, film: &Film, display: &Display, sensor: &Sensor) -> Shown {
    let layer = display.layer.within(scene.lamps.len());
    let wanted: &[RenderLayer] = match &layer {
        ShownLayer::Picture => &[],
        ShownLayer::Layer(layer) => std::slice::from_ref(layer),
    };
    let ExrImage {
        picture,
        mut layers,
        ..
    } = layers::exr_image(scene, film, wanted);
    let values = layers.pop().map(|layer| layer.data);
    let sensor = sensor.set_for(channel_means(&sensor.seen(&picture)));
    let (image, legend) = if display.false_colour == FalseColour::Off && !layer.is_single() {
        (photograph(&picture, values.as_ref(), layer, &sensor), None)
    } else {
        let single = single_values(&picture, values.as_ref());
        false_colours(&picture, &single, layer, display)
    };
    Shown {
        pixels: Pixels::Image(image),
        radiance: picture.data,
        values,
        legend,
        exposure: sensor.exposure_factor_of(|| [1.0; 3]),
    }
}

/// What the sensor, set for the picture, makes of it or of a colour layer; vectors and shares as they are.
fn photograph(
    picture: &Picture,
    values: Option<&LayerData>,
    layer: ShownLayer,
    sensor: &Sensor,
) -> ColorImage {
    let size = [picture.width as usize, picture.height as usize];
    let plain = |data: &[[f32; 3]], of: fn(f32) -> f64| {
        let pixels = data
            .iter()
            .map(|p| rgb(p.map(|x| (255.0 * of(x)).round().clamp(0.0, 255.0) as u8)));
        ColorImage::new(size, pixels.collect())
    };
    let data = match (layer, values) {
        (ShownLayer::Layer(RenderLayer::Position), Some(LayerData::Vector(places))) => {
            // From black to bright with every metre along each axis.
            return plain(places, |x| f64::from(x - x.floor()));
        }
        (_, Some(LayerData::Vector(vectors))) => {
            return plain(vectors, |x| 0.5 + 0.5 * f64::from(x));
        }
        (
            ShownLayer::Layer(RenderLayer::Reflectance | RenderLayer::Transmittance),
            Some(LayerData::Colour(shares)),
        ) => return plain(shares, |x| linear_to_srgb(f64::from(x))),
        (_, Some(LayerData::Colour(colours))) => colours,
        _ => &picture.data,
    };
    let frame = if std::ptr::eq(data, &picture.data) {
        sensor.expose(picture, NOISE_SEED)
    } else {
        let layer = Picture {
            data: data.clone(),
            ..Picture::black(picture.width, picture.height)
        };
        sensor.expose(&layer, NOISE_SEED)
    };
    let pixels = bytes(&frame.counts).into_iter().map(rgb).collect();
    ColorImage::new(size, pixels)
}

/// Counts as a screen shows them: of 16 bits the upper 8.
fn bytes(counts: &Counts) -> Vec<[u8; 3]> {
    match counts {
        Counts::Bits8(counts) => counts.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
        Counts::Bits16(counts) => counts
            .chunks_exact(3)
            .map(|c| [c[0], c[1], c[2]].map(|x| (x / 257) as u8))
            .collect(),
    }
}

fn rgb([r, g, b]: [u8; 3]) -> Color32 {
    Color32::from_rgb(r, g, b)
}

fn single_values(picture: &Picture, values: Option<&LayerData>) -> Vec<f32> {
    let mean = |data: &[[f32; 3]]| data.iter().map(|p| (p[0] + p[1] + p[2]) / 3.0).collect();
    match values {
        Some(LayerData::Scalar(values)) => values.clone(),
        Some(LayerData::Colour(data) | LayerData::Vector(data)) => mean(data),
        None => mean(&picture.data),
    }
}

fn false_colours(
    picture: &Picture,
    values: &[f32],
    layer: ShownLayer,
    display: &Display,
) -> (ColorImage, Option<Legend>) {
    let colours = match display.false_colour {
        FalseColour::Off => FalseColour::Viridis,
        chosen => chosen,
    };
    let (low, high) = ends(values, display.logarithmic);
    let legend = Legend {
        low,
        high,
        unit: layer.unit(),
        colours,
        logarithmic: display.logarithmic,
    };
    let pixels = values
        .iter()
        .map(|&value| {
            if value == f32::INFINITY {
                Color32::BLACK
            } else {
                colours.colour(legend.fraction(value))
            }
        })
        .collect();
    let size = [picture.width as usize, picture.height as usize];
    (ColorImage::new(size, pixels), Some(legend))
}

/// Values below and above which lies a hundredth of all; never the same twice.
fn ends(values: &[f32], positive: bool) -> (f32, f32) {
    let step = values.len().div_ceil(SAMPLED_VALUES).max(1);
    let mut some: Vec<f32> = values
        .iter()
        .step_by(step)
        .copied()
        .filter(|v| v.is_finite() && (!positive || *v > 0.0))
        .collect();
    some.sort_by(f32::total_cmp);
    let Some(last) = some.len().checked_sub(1) else {
        return (0.1, 1.0);
    };
    let tail = (TAIL * last as f64).round() as usize;
    let (low, high) = (some[tail], some[last - tail]);
    if high > low {
        (low, high)
    } else {
        let reach = (0.1 * low.abs()).max(f32::MIN_POSITIVE);
        (
            low - if positive { 0.5 * reach } else { reach },
            low + reach,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_run_from_their_first_to_their_last_colour() {
        for (colours, first, last) in [
            (FalseColour::Viridis, VIRIDIS[0], VIRIDIS[9]),
            (FalseColour::Inferno, INFERNO[0], INFERNO[9]),
        ] {
            assert_eq!(colours.colour(-1.0), rgb(first));
            assert_eq!(colours.colour(0.0), rgb(first));
            assert_eq!(colours.colour(1.0), rgb(last));
            assert_eq!(colours.colour(f32::NAN), Color32::GRAY);
        }
    }

    #[test]
    fn ends_leave_outliers_aside_and_never_coincide() {
        let mut values: Vec<f32> = (0..1000).map(|i| i as f32 / 1000.0).collect();
        values[500] = 1e9;
        values[501] = f32::INFINITY;
        let (low, high) = ends(&values, false);
        assert!(
            (0.0..0.02).contains(&low) && (0.97..1.0).contains(&high),
            "{low} {high}"
        );
        for positive in [false, true] {
            for same in [0.3_f32, 1e-6] {
                let (low, high) = ends(&[same; 20], positive);
                assert!(low < same && same < high);
            }
            let (low, high) = ends(&[f32::NAN], positive);
            assert!(low < high);
        }
    }

    #[test]
    fn a_legend_places_values_on_both_scales() {
        let mut legend = Legend {
            low: 0.01,
            high: 1.0,
            unit: "",
            colours: FalseColour::Viridis,
            logarithmic: true,
        };
        assert!((legend.fraction(0.1) - 0.5).abs() < 1e-6);
        legend.logarithmic = false;
        assert!((legend.fraction(0.505) - 0.5).abs() < 1e-6);
    }
}
