//! From the pictures of a camera with a lens and a port to those of an ideal camera, and the file that keeps it (`uw-undistortion/1`): where a lens is
//! described, all of its projection is needed, where it is used, a net of points.

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::resampling::Resampling;

/// The value of the field `format`.
const FORMAT: &str = "uw-undistortion/1";
/// Longest side, pixels, as of pictures.
const MAX_SIDE_PX: u32 = 32_768;
/// Points are kept to a ten thousandth of a pixel.
const PER_PIXEL: f64 = 1e4;

/// The ways from a camera's pictures to ideal ones: with a port they differ with the target's distance.
#[derive(Clone, Debug, PartialEq)]
pub struct Undistortion {
    hfov_deg: f64,
    far: Arc<Resampling>,
    near: Vec<(f64, Arc<Resampling>)>,
}

/// A file of an undistortion cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {message}")]
pub struct UndistortionError {
    /// File.
    pub file: String,
    /// Field, value and what would be right.
    pub message: String,
}

/// Points of a net, pixels of the stored picture; null where the camera does not see.
type Net = Vec<Option<[f64; 2]>>;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    made_by: String,
    /// Width and height of the stored pictures, pixels.
    stored_px: [u32; 2],
    /// Those of the ideal pictures.
    ideal_px: [u32; 2],
    /// Horizontal field of view of the ideal camera, degrees.
    hfov_deg: f64,
    /// For what is far away.
    far: Net,
    /// For targets at distances.
    near: Vec<Near>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Near {
    distance_m: f64,
    net: Net,
}

impl Undistortion {
    /// The way for what is far away, and for the target at distances in m, where that differs; `hfov_deg` is the horizontal field of view of the
    /// ideal camera, degrees.
    pub fn new(hfov_deg: f64, far: Resampling, near: Vec<(f64, Resampling)>) -> Self {
        Self {
            hfov_deg,
            far: Arc::new(far),
            near: near
                .into_iter()
                .map(|(at, map)| (at, Arc::new(map)))
                .collect(),
        }
    }

    /// Reads a file that [`Undistortion::to_json`] made.
    ///
    /// # Errors
    /// It cannot be read, or a field is missing, unknown or wrong.
    pub fn read(path: &Path) -> Result<Self, UndistortionError> {
        let file = path.display().to_string();
        let wrong = |message: String| UndistortionError {
            file: file.clone(),
            message,
        };
        let text = std::fs::read_to_string(path)
            .map_err(|error| wrong(format!("cannot be read: {error}")))?;
        let read: File = serde_json::from_str(&text)
            .map_err(|error| wrong(format!("not a usable file of {FORMAT}: {error}")))?;
        read.check().map_err(wrong)?;
        let map = |net: Net| Resampling::of_net(read.stored_px, read.ideal_px, net);
        let near = read.near.into_iter();
        Ok(Self::new(
            read.hfov_deg,
            map(read.far),
            near.map(|near| (near.distance_m, map(near.net))).collect(),
        ))
    }

    /// The text of a file.
    ///
    /// # Errors
    /// None that is known: numbers, lists and a name can be written.
    pub fn to_json(&self, made_by: &str) -> Result<String, serde_json::Error> {
        let net = |map: &Resampling| -> Net {
            let kept = |at: f64| (at * PER_PIXEL).round() / PER_PIXEL;
            map.net()
                .iter()
                .map(|at| at.map(|at| at.map(kept)))
                .collect()
        };
        let near = self.near.iter().map(|(distance_m, map)| Near {
            distance_m: *distance_m,
            net: net(map),
        });
        let file = File {
            format: FORMAT.to_owned(),
            made_by: made_by.to_owned(),
            stored_px: self.far.from_px().map(|side| side as u32),
            ideal_px: self.ideal_px(),
            hfov_deg: self.hfov_deg,
            far: net(&self.far),
            near: near.collect(),
        };
        Ok(serde_json::to_string(&file)? + "\n")
    }

    /// Horizontal field of view of the ideal camera, degrees.
    pub fn hfov_deg(&self) -> f64 {
        self.hfov_deg
    }

    /// Width and height of the ideal pictures, pixels.
    pub fn ideal_px(&self) -> [u32; 2] {
        self.far.to_px().map(|side| side as u32)
    }

    /// The way for what is far away.
    pub fn far(&self) -> &Resampling {
        &self.far
    }

    /// The way for a target at a distance, m.
    pub fn near(&self, distance_m: f64) -> &Resampling {
        self.at(Some(distance_m))
    }

    /// That for a target at a distance, m: the nearest in ratio; for what is far away without one.
    pub(crate) fn at(&self, distance_m: Option<f64>) -> &Arc<Resampling> {
        let Some(distance_m) = distance_m else {
            return &self.far;
        };
        let off = |at: f64| (at / distance_m).ln().abs();
        let nearest = self
            .near
            .iter()
            .min_by(|x, y| off(x.0).total_cmp(&off(y.0)));
        nearest.map_or(&self.far, |(_, map)| map)
    }
}

impl File {
    fn check(&self) -> Result<(), String> {
        if self.format != FORMAT {
            return Err(format!("format must be {FORMAT:?}, got {:?}", self.format));
        }
        for (field, sides) in [("stored_px", self.stored_px), ("ideal_px", self.ideal_px)] {
            if !sides.iter().all(|side| (1..=MAX_SIDE_PX).contains(side)) {
                return Err(format!(
                    "{field} must be two numbers of 1 to {MAX_SIDE_PX} pixels, got {sides:?}"
                ));
            }
        }
        if !(self.hfov_deg > 0.0 && self.hfov_deg < 180.0) {
            let got = self.hfov_deg;
            return Err(format!("hfov_deg must be in (0, 180), got {got}"));
        }
        let nodes = Resampling::nodes(self.ideal_px);
        let right = |field: String, net: &Net| match net.len() == nodes {
            true => Ok(()),
            false => Err(format!(
                "{field} must hold {nodes} points for ideal pictures of {:?} pixels, got {}",
                self.ideal_px,
                net.len()
            )),
        };
        right("far".to_owned(), &self.far)?;
        for (i, near) in self.near.iter().enumerate() {
            if !(near.distance_m > 0.0 && near.distance_m.is_finite()) {
                return Err(format!(
                    "near[{i}].distance_m must be finite and > 0, got {}",
                    near.distance_m
                ));
            }
            right(format!("near[{i}].net"), &near.net)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shifted() -> Undistortion {
        let map = |by: f64| {
            Resampling::new([60, 40], [40, 30], move |x, y| {
                (x < 39.0).then_some([x + by, y + 2.0])
            })
        };
        Undistortion::new(
            55.0,
            map(8.0),
            vec![(0.5, map(9.12345678)), (2.0, map(8.25))],
        )
    }

    #[test]
    fn a_file_gives_back_what_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lens.json");
        std::fs::write(&path, shifted().to_json("test").unwrap()).unwrap();
        let read = Undistortion::read(&path).unwrap();
        assert_eq!((read.hfov_deg(), read.ideal_px()), (55.0, [40, 30]));
        for distance_m in [0.4, 1.9, 100.0] {
            let (read, written) = (read.near(distance_m), &shifted());
            let written = written.near(distance_m);
            assert_eq!(read.from_px(), written.from_px());
            for (x, y) in [(0.0, 0.0), (17.3, 22.2), (39.9, 5.0)] {
                match (read.at(x, y), written.at(x, y)) {
                    (Some(a), Some(b)) => {
                        assert!((a[0] - b[0]).abs() < 1e-4 && (a[1] - b[1]).abs() < 1e-4);
                    }
                    (a, b) => assert_eq!(a, b),
                }
            }
        }
    }

    #[test]
    fn what_is_wrong_with_a_file_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lens.json");
        let right = shifted().to_json("test").unwrap();
        for (from, to, told) in [
            ("uw-undistortion/1", "uw-mask/1", "format must be"),
            ("[40,30]", "[40,300]", "far must hold 836 points"),
            ("[60,40]", "[60,0]", "stored_px must be two numbers"),
            ("55.0", "200.0", "hfov_deg must be in (0, 180), got 200"),
            (
                "\"distance_m\":0.5",
                "\"distance_m\":-0.5",
                "near[0].distance_m must be",
            ),
            ("made_by", "made", "unknown field `made`"),
        ] {
            assert!(right.contains(from), "{from}");
            std::fs::write(&path, right.replacen(from, to, 1)).unwrap();
            let error = Undistortion::read(&path).unwrap_err().to_string();
            assert!(
                error.contains("lens.json: ") && error.contains(told),
                "{error}"
            );
        }
        let error = Undistortion::read(&folder.path().join("none.json")).unwrap_err();
        assert!(error.to_string().contains("cannot be read"), "{error}");
    }
}
