//! Contrast limited adaptive histogram equalisation (CLAHE), then SIFT features.

use opencv::core::{KeyPoint, Mat, Ptr, Size, Vector, no_array};
use opencv::features2d::SIFT;
use opencv::imgproc::{CLAHE, create_clahe};
use opencv::prelude::*;

use super::{GreyImage, VisionError, at};

/// Clip limit of CLAHE.
const CLIP_LIMIT: f64 = 2.0;
/// CLAHE tiles along an edge of the image.
const TILES: i32 = 8;
/// Contrast threshold of SIFT, a quarter of its usual 0.04: faint features count too.
const CONTRAST_THRESHOLD: f64 = 0.01;
/// SIFT's own values for the rest: layers per octave, edge threshold, blur of the first layer in pixels.
const OCTAVE_LAYERS: i32 = 3;
const EDGE_THRESHOLD: f64 = 10.0;
const FIRST_BLUR_PX: f64 = 1.6;

/// Features of one image.
pub struct Features {
    pub(super) key_points: Vector<KeyPoint>,
    pub(super) descriptors: Mat,
}

impl Features {
    /// Number of features.
    pub fn count(&self) -> usize {
        self.key_points.len()
    }
}

/// Extracts features.
pub struct Detector {
    clahe: Ptr<CLAHE>,
    sift: Ptr<SIFT>,
}

impl Detector {
    /// CLAHE with clip limit 2 on 8 × 8 tiles, SIFT with contrast threshold 0.01.
    pub fn new() -> Result<Self, VisionError> {
        // The pipelines run in parallel already, one thread each.
        opencv::core::set_num_threads(1).map_err(at("threads"))?;
        let clahe =
            create_clahe(CLIP_LIMIT, Size::new(TILES, TILES)).map_err(at("making CLAHE"))?;
        let sift = SIFT::create(
            0,
            OCTAVE_LAYERS,
            CONTRAST_THRESHOLD,
            EDGE_THRESHOLD,
            FIRST_BLUR_PX,
        )
        .map_err(at("making SIFT"))?;
        Ok(Self { clahe, sift })
    }

    /// The image after CLAHE.
    pub fn equalise(&mut self, image: &GreyImage) -> Result<GreyImage, VisionError> {
        let mut out = Mat::default();
        self.equalise_into(image, &mut out)?;
        let values = out.data_bytes().map_err(at("reading CLAHE"))?.to_vec();
        GreyImage::new(image.width(), image.height(), values)
    }

    /// CLAHE, then SIFT.
    pub fn extract(&mut self, image: &GreyImage) -> Result<Features, VisionError> {
        let mut equalised = Mat::default();
        self.equalise_into(image, &mut equalised)?;
        let mut features = Features {
            key_points: Vector::new(),
            descriptors: Mat::default(),
        };
        self.sift
            .detect_and_compute(
                &equalised,
                &no_array(),
                &mut features.key_points,
                &mut features.descriptors,
                false,
            )
            .map_err(at("SIFT"))?;
        Ok(features)
    }

    fn equalise_into(&mut self, image: &GreyImage, out: &mut Mat) -> Result<(), VisionError> {
        let rows = image.height() as i32;
        let flat = Mat::from_slice(image.values()).map_err(at("taking the image over"))?;
        let grey = flat.reshape(1, rows).map_err(at("taking the image over"))?;
        self.clahe.apply(&grey, out).map_err(at("CLAHE"))
    }
}
