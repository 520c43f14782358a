//! Pictures of moments and of rows become a frame.

use uw_render::image::{ExrImage, Layer, LayerData, Picture};
use uw_render::layers::RenderLayer;

/// Whether a layer is made of light, and so is the mean over an exposure; the others are those of its beginning.
pub(super) fn is_light(layer: RenderLayer) -> bool {
    match layer {
        RenderLayer::Ambient
        | RenderLayer::Lamp(_)
        | RenderLayer::Direct
        | RenderLayer::Backscatter
        | RenderLayer::Variance => true,
        RenderLayer::Depth
        | RenderLayer::Position
        | RenderLayer::Normal
        | RenderLayer::Reflectance
        | RenderLayer::Transmittance => false,
    }
}

/// The sum of pictures of moments, for their mean.
pub(super) struct Exposed {
    sum: ExrImage,
    moments: usize,
}

impl Exposed {
    /// The first of them.
    pub(super) fn new(first: ExrImage) -> Self {
        Self {
            sum: first,
            moments: 1,
        }
    }

    /// Another one, with the same layers.
    pub(super) fn add(&mut self, image: &ExrImage) {
        add_triples(&mut self.sum.picture.data, &image.picture.data);
        for (sum, more) in self.sum.layers.iter_mut().zip(&image.layers) {
            match (&mut sum.data, &more.data) {
                (LayerData::Colour(sum), LayerData::Colour(more))
                | (LayerData::Vector(sum), LayerData::Vector(more)) => add_triples(sum, more),
                (LayerData::Scalar(sum), LayerData::Scalar(more)) => {
                    sum.iter_mut().zip(more).for_each(|(s, m)| *s += m);
                }
                _ => {}
            }
        }
        self.moments += 1;
    }

    /// Their mean; `layers` are those of the pictures. The variance is that of the mean.
    pub(super) fn mean(mut self, layers: &[RenderLayer]) -> ExrImage {
        let share = 1.0 / self.moments as f32;
        scale(&mut self.sum.picture.data, share);
        for (own, layer) in self.sum.layers.iter_mut().zip(layers) {
            let share = match layer {
                RenderLayer::Variance => share * share,
                _ => share,
            };
            match &mut own.data {
                LayerData::Colour(values) | LayerData::Vector(values) => scale(values, share),
                LayerData::Scalar(values) => values.iter_mut().for_each(|value| *value *= share),
            }
        }
        self.sum
    }
}

fn add_triples(sum: &mut [[f32; 3]], more: &[[f32; 3]]) {
    for (sum, more) in sum.iter_mut().zip(more) {
        (0..3).for_each(|k| sum[k] += more[k]);
    }
}

fn scale(values: &mut [[f32; 3]], share: f32) {
    for value in values {
        *value = value.map(|v| v * share);
    }
}

/// The picture whose rows, from the top, are those of `parts`, all with the same layers.
pub(super) fn stacked(parts: Vec<ExrImage>) -> ExrImage {
    let mut parts = parts.into_iter();
    let Some(mut whole) = parts.next() else {
        return ExrImage::new(Picture::black(0, 0));
    };
    for part in parts {
        whole.picture.height += part.picture.height;
        whole.picture.data.extend(part.picture.data);
        for (own, more) in whole.layers.iter_mut().zip(part.layers) {
            match (&mut own.data, more.data) {
                (LayerData::Colour(own), LayerData::Colour(more))
                | (LayerData::Vector(own), LayerData::Vector(more)) => own.extend(more),
                (LayerData::Scalar(own), LayerData::Scalar(more)) => own.extend(more),
                _ => {}
            }
        }
    }
    whole
}

/// Layers of light and those of the first surface, in the order that was asked for.
pub(super) fn in_order(asked: &[RenderLayer], light: Vec<Layer>, truth: Vec<Layer>) -> Vec<Layer> {
    let (mut light, mut truth) = (light.into_iter(), truth.into_iter());
    let ordered = asked.iter().filter_map(|layer| match is_light(*layer) {
        true => light.next(),
        false => truth.next(),
    });
    ordered.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(value: f32, layers: &[RenderLayer]) -> ExrImage {
        let layer = |_: &RenderLayer| Layer {
            name: String::new(),
            data: LayerData::Colour(vec![[value; 3]; 2]),
        };
        ExrImage {
            layers: layers.iter().map(layer).collect(),
            ..ExrImage::new(Picture {
                width: 2,
                height: 1,
                data: vec![[value; 3]; 2],
            })
        }
    }

    #[test]
    fn moments_are_averaged_and_rows_stacked() {
        let layers = [RenderLayer::Direct, RenderLayer::Variance];
        let mut exposed = Exposed::new(image(1.0, &layers));
        exposed.add(&image(3.0, &layers));
        let mean = exposed.mean(&layers);
        assert_eq!(mean.picture.data, [[2.0; 3]; 2]);
        let values = |image: &ExrImage, i: usize| match &image.layers[i].data {
            LayerData::Colour(values) => values.clone(),
            other => panic!("{other:?}"),
        };
        assert_eq!(values(&mean, 0), [[2.0; 3]; 2]);
        // Two independent means of variance 1 and 3: a quarter of the sum.
        assert_eq!(values(&mean, 1), [[1.0; 3]; 2]);
        let whole = stacked(vec![mean, image(5.0, &layers)]);
        assert_eq!((whole.picture.width, whole.picture.height), (2, 2));
        assert_eq!(whole.picture.data[2..], [[5.0; 3]; 2]);
        assert_eq!(values(&whole, 1).len(), 4);
    }
}
