//! The layers of a render: what a film and the first hits hold, by the names of EXR files.

use std::cell::LazyCell;

use crate::film::{Film, FilmLayer};
use crate::image::{ExrImage, Layer, LayerData, Picture};
use crate::integrator::first_hit::{FirstHit, first_hits};
use crate::prepare::Prepared;

/// A layer that can be asked for beside the picture itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RenderLayer {
    /// `ambient`: radiance from sun, sky and emission, W/(m² sr).
    Ambient,
    /// `lamp.NAME`: radiance from the lamp of that index at 100 %, W/(m² sr).
    Lamp(usize),
    /// `direct`: radiance that came straight from a surface or source, not scattered on the way, W/(m² sr).
    Direct,
    /// `backscatter`: radiance that met no surface, W/(m² sr).
    Backscatter,
    /// `depth`: distance of the first surface along the optical axis, m; infinite where there is none.
    Depth,
    /// `position`: the point of the first surface, world frame, m; zero where there is none.
    Position,
    /// `normal`: unit normal of the first surface towards the camera, world frame.
    Normal,
    /// `reflectance` of the first surface, in [0, 1].
    Reflectance,
    /// `transmittance` of the water between camera and first surface, in [0, 1].
    Transmittance,
    /// `variance` of the mean of each pixel of the picture, (W/(m² sr))²; NaN after a single batch.
    Variance,
}

/// The layers that every scene has, in the order in which `all` lists them; lamps follow.
const FIXED: [RenderLayer; 9] = [
    RenderLayer::Ambient,
    RenderLayer::Direct,
    RenderLayer::Backscatter,
    RenderLayer::Depth,
    RenderLayer::Position,
    RenderLayer::Normal,
    RenderLayer::Reflectance,
    RenderLayer::Transmittance,
    RenderLayer::Variance,
];
const ALL_LAMPS: &str = "lamps";
const ALL: &str = "all";

/// A layer name that means nothing in this scene.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown layer {got:?}; known: {known}")]
pub struct UnknownLayer {
    /// The refused name.
    pub got: String,
    /// Names that would be right.
    pub known: String,
}

impl RenderLayer {
    /// Layers by their names; `lamps` stands for every lamp, `all` for everything. A layer named twice comes once.
    ///
    /// # Errors
    /// The first unknown name, with the names that this scene has.
    pub fn by_names<S: AsRef<str>>(
        names: &[S],
        lamp_names: &[String],
    ) -> Result<Vec<Self>, UnknownLayer> {
        let mut layers = Vec::new();
        for name in names {
            for layer in Self::by_name(name.as_ref(), lamp_names)? {
                if !layers.contains(&layer) {
                    layers.push(layer);
                }
            }
        }
        Ok(layers)
    }

    fn by_name(name: &str, lamp_names: &[String]) -> Result<Vec<Self>, UnknownLayer> {
        let mut layers = Self::all(lamp_names);
        match name {
            ALL => {}
            ALL_LAMPS => layers.retain(|layer| layer.is_lamp()),
            _ => {
                layers.retain(|layer| layer.name(lamp_names) == name);
                if layers.is_empty() {
                    return Err(UnknownLayer {
                        got: name.to_owned(),
                        known: known_names(lamp_names),
                    });
                }
            }
        }
        Ok(layers)
    }

    fn all(lamp_names: &[String]) -> Vec<Self> {
        let lamps = (0..lamp_names.len()).map(Self::Lamp);
        FIXED.into_iter().chain(lamps).collect()
    }

    /// The name in EXR files; `lamp_names` are those of the scene.
    pub fn name(self, lamp_names: &[String]) -> String {
        let fixed = match self {
            Self::Ambient => "ambient",
            Self::Lamp(index) => return format!("lamp.{}", lamp_names[index]),
            Self::Direct => "direct",
            Self::Backscatter => "backscatter",
            Self::Depth => "depth",
            Self::Position => "position",
            Self::Normal => "normal",
            Self::Reflectance => "reflectance",
            Self::Transmittance => "transmittance",
            Self::Variance => "variance",
        };
        fixed.to_owned()
    }

    /// Whether lamps at level 0 must be rendered for this layer.
    pub fn is_lamp(self) -> bool {
        matches!(self, Self::Lamp(_))
    }
}

fn known_names(lamp_names: &[String]) -> String {
    let mut names: Vec<String> = RenderLayer::all(lamp_names)
        .into_iter()
        .map(|layer| layer.name(lamp_names))
        .collect();
    names.extend([ALL_LAMPS.to_owned(), ALL.to_owned()]);
    names.join(", ")
}

/// The rendered picture: radiance of all sources at their levels, W/(m² sr).
pub fn picture(film: &Film) -> Picture {
    Picture {
        width: film.width,
        height: film.height,
        data: colour(film, FilmLayer::Total),
    }
}

/// The rendered picture with the layers asked for, ready to be written; without attributes.
pub fn exr_image(scene: &Prepared, film: &Film, layers: &[RenderLayer]) -> ExrImage {
    let hits = LazyCell::new(|| first_hits(scene));
    let of_hits = |of: fn(&FirstHit) -> [f64; 3]| hits.iter().map(|hit| single(of(hit))).collect();
    let of_film = |layer| LayerData::Colour(colour(film, layer));
    let data = |layer| match layer {
        RenderLayer::Ambient => of_film(FilmLayer::Ambient),
        RenderLayer::Lamp(index) => of_film(FilmLayer::Lamp(index)),
        RenderLayer::Direct => of_film(FilmLayer::Direct),
        RenderLayer::Backscatter => of_film(FilmLayer::Backscatter),
        RenderLayer::Variance => of_film(FilmLayer::Variance),
        RenderLayer::Depth => {
            LayerData::Scalar(hits.iter().map(|hit| hit.depth_m as f32).collect())
        }
        RenderLayer::Position => LayerData::Vector(of_hits(|hit| hit.position_m)),
        RenderLayer::Normal => LayerData::Vector(of_hits(|hit| hit.normal)),
        RenderLayer::Reflectance => LayerData::Colour(of_hits(|hit| hit.reflectance)),
        RenderLayer::Transmittance => LayerData::Colour(of_hits(|hit| hit.transmittance)),
    };
    let layers = layers.iter().map(|&layer| Layer {
        name: layer.name(&scene.lamp_names),
        data: data(layer),
    });
    ExrImage {
        layers: layers.collect(),
        ..ExrImage::new(picture(film))
    }
}

fn colour(film: &Film, layer: FilmLayer) -> Vec<[f32; 3]> {
    film.layer(layer).into_iter().map(single).collect()
}

fn single(value: [f64; 3]) -> [f32; 3] {
    value.map(|channel| channel as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lamps() -> Vec<String> {
        vec!["left".to_owned(), "right".to_owned()]
    }

    #[test]
    fn names_and_layers_belong_to_each_other() {
        let all = RenderLayer::by_names(&["all"], &lamps()).expect("known");
        assert_eq!(all.len(), FIXED.len() + 2);
        for layer in all {
            let name = layer.name(&lamps());
            assert_eq!(RenderLayer::by_names(&[name], &lamps()), Ok(vec![layer]));
        }
    }

    #[test]
    fn a_layer_named_twice_comes_once() {
        let layers = RenderLayer::by_names(&["lamp.right", "lamps", "depth", "depth"], &lamps());
        let expected = [
            RenderLayer::Lamp(1),
            RenderLayer::Lamp(0),
            RenderLayer::Depth,
        ];
        assert_eq!(layers, Ok(expected.to_vec()));
    }

    #[test]
    fn an_unknown_name_is_answered_with_the_known_ones() {
        let error =
            RenderLayer::by_names(&["depth", "lamp.middle"], &lamps()).map_err(|e| e.to_string());
        let expected = "unknown layer \"lamp.middle\"; known: ambient, direct, backscatter, depth, position, \
             normal, reflectance, transmittance, variance, lamp.left, lamp.right, lamps, all";
        assert_eq!(error, Err(expected.to_owned()));
    }
}
