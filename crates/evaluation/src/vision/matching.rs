//! Matching of two views and rejection of outliers.

use opencv::calib3d::{RANSAC, find_homography};
use opencv::core::{DMatch, Mat, NORM_L2, Point2f, Ptr, Vector, no_array};
use opencv::features2d::BFMatcher;
use opencv::prelude::*;

use super::{Features, VisionError, at};

/// Lowe's ratio: the nearest descriptor must be this much nearer than the second.
const RATIO: f32 = 0.8;
/// Largest distance from the homography's image that counts as inlier, pixels.
const INLIER_PX: f64 = 3.0;
/// Fewest matches a homography can be found from.
const FEWEST_MATCHES: usize = 4;

/// A plane's image in one view as a function of its image in another, row by row.
pub type Homography = [[f64; 3]; 3];

/// What the features of two views have to do with each other.
#[derive(Clone, Debug, PartialEq)]
pub struct PairMeasure {
    /// Features of the first view.
    pub features: usize,
    /// Matches that pass the ratio test.
    pub matches: usize,
    /// Matches that RANSAC keeps: on one homography within 3 pixels.
    pub inliers: usize,
    /// Inliers that also agree with the true motion, where it is known.
    pub true_inliers: usize,
    /// The homography found.
    pub homography: Option<Homography>,
}

impl PairMeasure {
    /// Inliers over features of the first view, as the published tables count; 0 without features.
    pub fn inlier_ratio(&self) -> f64 {
        if self.features == 0 {
            return 0.0;
        }
        self.inliers as f64 / self.features as f64
    }
}

/// Matches views.
pub struct Matcher {
    nearest: Ptr<BFMatcher>,
}

/// A match as positions in both images, pixels.
type Match = ([f64; 2], [f64; 2]);

impl Matcher {
    /// Exhaustive search by Euclidean distance.
    pub fn new() -> Result<Self, VisionError> {
        Ok(Self {
            nearest: BFMatcher::create(NORM_L2, false).map_err(at("making the matcher"))?,
        })
    }

    /// Matches `first` with `second`; `truth` takes pixels of the first to the second where it is known.
    pub fn compare(
        &self,
        first: &Features,
        second: &Features,
        truth: Option<&Homography>,
    ) -> Result<PairMeasure, VisionError> {
        let matches = self.ratio_matches(first, second)?;
        let (homography, kept) = homography(&matches)?;
        let is_true = |m: &Match| truth.is_none_or(|h| transfer_error_px(h, m) <= INLIER_PX);
        Ok(PairMeasure {
            features: first.count(),
            matches: matches.len(),
            inliers: kept.len(),
            true_inliers: kept.iter().filter(|m| is_true(m)).count(),
            homography,
        })
    }

    fn ratio_matches(
        &self,
        first: &Features,
        second: &Features,
    ) -> Result<Vec<Match>, VisionError> {
        if first.count() == 0 || second.count() < 2 {
            return Ok(Vec::new());
        }
        let mut nearest: Vector<Vector<DMatch>> = Vector::new();
        self.nearest
            .knn_train_match(
                &first.descriptors,
                &second.descriptors,
                &mut nearest,
                2,
                &no_array(),
                false,
            )
            .map_err(at("matching"))?;
        let mut matches = Vec::new();
        for pair in nearest.iter().filter(|pair| pair.len() == 2) {
            let best = pair.get(0).map_err(at("matching"))?;
            let second_best = pair.get(1).map_err(at("matching"))?;
            if best.distance < RATIO * second_best.distance {
                matches.push((
                    position(first, best.query_idx)?,
                    position(second, best.train_idx)?,
                ));
            }
        }
        Ok(matches)
    }
}

fn position(features: &Features, index: i32) -> Result<[f64; 2], VisionError> {
    let key_point = features
        .key_points
        .get(index as usize)
        .map_err(at("matching"))?;
    let position = key_point.pt();
    Ok([f64::from(position.x), f64::from(position.y)])
}

/// The homography that RANSAC finds and the matches on it; none of either when there is none.
fn homography(matches: &[Match]) -> Result<(Option<Homography>, Vec<Match>), VisionError> {
    if matches.len() < FEWEST_MATCHES {
        return Ok((None, Vec::new()));
    }
    let points = |of: fn(&Match) -> [f64; 2]| -> Vector<Point2f> {
        let to_point = |m: &Match| {
            let [x, y] = of(m);
            Point2f::new(x as f32, y as f32)
        };
        matches.iter().map(to_point).collect()
    };
    let mut mask = Mat::default();
    let found = find_homography(
        &points(|m| m.0),
        &points(|m| m.1),
        &mut mask,
        RANSAC,
        INLIER_PX,
    )
    .map_err(at("RANSAC"))?;
    if found.empty() {
        return Ok((None, Vec::new()));
    }
    let mut homography = [[0.0; 3]; 3];
    for (i, row) in homography.iter_mut().enumerate() {
        for (j, value) in row.iter_mut().enumerate() {
            *value = *found
                .at_2d::<f64>(i as i32, j as i32)
                .map_err(at("RANSAC"))?;
        }
    }
    let mask = mask.data_bytes().map_err(at("RANSAC"))?;
    let kept = matches.iter().zip(mask).filter(|(_, inside)| **inside != 0);
    Ok((Some(homography), kept.map(|(m, _)| *m).collect()))
}

/// The pixel of the second image that a pixel of the first is taken to.
pub fn transfer(h: &Homography, [x, y]: [f64; 2]) -> [f64; 2] {
    let line = |row: &[f64; 3]| row[0] * x + row[1] * y + row[2];
    let w = line(&h[2]);
    [line(&h[0]) / w, line(&h[1]) / w]
}

fn transfer_error_px(h: &Homography, (from, to): &Match) -> f64 {
    let [x, y] = transfer(h, *from);
    (x - to[0]).hypot(y - to[1])
}
