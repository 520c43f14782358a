//! Calibrations of cameras as other programs write them: YAML of ROS (`camera_calibration`, `camera_info_manager`), of OpenCV
//! (`FileStorage`) and of Kalibr (`camchain`), XML of OpenCV and of Metashape ([`metashape`]).

mod metashape;
mod value;
mod xml;
mod yaml;

use glam::DVec2;

use super::camera::{LEAST_FOCAL_PX, MAX_PIXELS, MAX_SIDE_PX, is_size};
use super::lens::Lens;
use value::Value;
use xml::Element;
use yaml::Node;

/// Endings of such files.
const ENDINGS: [&str; 3] = ["yaml", "yml", "xml"];
/// Largest file that is read, bytes; calibrations have less than a hundredth of it.
const MOST_BYTES: usize = 1 << 20;
/// What OpenCV begins its files with, which is no directive of YAML.
const OPENCV: &str = "%YAML:1.0";
/// What some programs begin XML with.
const BYTE_ORDER_MARK: char = '\u{feff}';
/// Where OpenCV and its kin have the point (0, 0): in the middle of the first pixel.
const HALF_PIXEL: f64 = 0.5;
/// Skew that is none, over the focal length.
const NO_SKEW: f64 = 1e-6;

/// What such a file tells of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Calibration {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) focal_px: DVec2,
    /// From the upper left corner of the picture.
    pub(super) centre_px: DVec2,
    pub(super) lens: Lens,
}

/// How much the scales of width and height of a picture may differ.
const SAME_PROPORTIONS: f64 = 0.01;

impl Calibration {
    /// The camera of the same pictures made smaller or larger; one side alone keeps the proportions. `None` where the proportions are others,
    /// or the size is none that a picture can have.
    pub(super) fn scaled(self, width: Option<u32>, height: Option<u32>) -> Option<Self> {
        let [across, down] = [self.width, self.height].map(f64::from);
        let scale = match (width, height) {
            (None, None) => return Some(self),
            (Some(width), None) => DVec2::splat(f64::from(width) / across),
            (None, Some(height)) => DVec2::splat(f64::from(height) / down),
            (Some(width), Some(height)) => {
                DVec2::new(f64::from(width) / across, f64::from(height) / down)
            }
        };
        let side = |given: Option<u32>, scaled: f64| given.unwrap_or(scaled.round() as u32);
        let (width, height) = (side(width, scale.x * across), side(height, scale.y * down));
        let same = (scale.x / scale.y - 1.0).abs() <= SAME_PROPORTIONS;
        (same && is_size(width, height)).then(|| Self {
            width,
            height,
            focal_px: scale * self.focal_px,
            centre_px: scale * self.centre_px,
            lens: self.lens,
        })
    }
}

/// Whether a file is one by its name.
pub(super) fn is_meant(path: &std::path::Path) -> bool {
    let ending = path.extension().and_then(|ending| ending.to_str());
    ending.is_some_and(|ending| ENDINGS.contains(&ending.to_ascii_lowercase().as_str()))
}

/// Reads the text of such a file.
///
/// # Errors
/// What is wrong, with its line and field.
pub(super) fn parse(text: &str) -> Result<Calibration, String> {
    if text.len() > MOST_BYTES {
        let got = text.len();
        return Err(format!("must have at most {MOST_BYTES} bytes, got {got}"));
    }
    if text
        .trim_start_matches(BYTE_ORDER_MARK)
        .trim_start()
        .starts_with('<')
    {
        return Element::of_text(text, |root| match root.name() {
            "opencv_storage" => of_opencv(root),
            _ => metashape::read(root),
        });
    }
    let text = text.strip_prefix(OPENCV).unwrap_or(text);
    Node::of_text(text, |root| match root.get("image_width") {
        Some(_) => of_opencv(root),
        None => of_kalibr(root),
    })
}

/// Of ROS and OpenCV, whose fields have the same names.
fn of_opencv(root: &impl Value) -> Result<Calibration, String> {
    let size = size(
        &root.required("image_width")?,
        &root.required("image_height")?,
    )?;
    let matrix = root.required("camera_matrix")?;
    let matrix = matrix.required("data")?;
    let of = matrix.numbers(9, 9)?;
    if of[1].abs() > NO_SKEW * of[0].abs() {
        return Err(matrix.wrong("without skew (its second number)", of[1]));
    }
    let coefficients = root.required("distortion_coefficients")?;
    let coefficients = coefficients.required("data")?;
    let k = coefficients.numbers(0, 14)?;
    let lens = match is_fisheye(root, &coefficients, k.len())? {
        true => equidistant(&coefficients, &k)?,
        false => brown_conrady(&coefficients, &k)?,
    };
    calibration(size, &matrix, [of[0], of[4], of[2], of[5]], lens)
}

/// As `distortion_model` of ROS or `fisheye_model` of OpenCV's own program says. Files of OpenCV may say neither, but then four numbers may be of either lens.
fn is_fisheye<V: Value>(root: &V, coefficients: &V, count: usize) -> Result<bool, String> {
    if let Some(model) = root.get("distortion_model") {
        return match model.text()? {
            "plumb_bob" | "rational_polynomial" | "thin_prism" => Ok(false),
            "equidistant" | "fisheye" => Ok(true),
            other => Err(model.wrong("plumb_bob, rational_polynomial or equidistant", other)),
        };
    }
    match root.get("fisheye_model") {
        Some(flag) => Ok(flag.whole(0, 1)? == 1),
        None if count == 4 => Err(coefficients.wrong(
            "beside a distortion_model (plumb_bob or equidistant) where there are four numbers, which either lens has",
            "none",
        )),
        None => Ok(false),
    }
}

/// Of Kalibr: one camera of a chain.
fn of_kalibr(root: &Node<'_>) -> Result<Calibration, String> {
    let cameras: Vec<String> = (0..16).map(|number| format!("cam{number}")).collect();
    let mut found = cameras.iter().filter_map(|name| root.get(name));
    let Some(camera) = found.next() else {
        return Err("must be a calibration of ROS or OpenCV (image_width, image_height, camera_matrix, distortion_coefficients) \
             or Kalibr (cam0), got neither"
            .to_owned());
    };
    if let Some(second) = found.next() {
        return Err(second.wrong("left out: one camera a file", "another camera"));
    }
    let model = camera.required("camera_model")?;
    if model.text()? != "pinhole" {
        return Err(model.wrong("pinhole", model.text()?));
    }
    let resolution = camera.required("resolution")?.items(2, 2)?;
    let size = size(&resolution[0], &resolution[1])?;
    let intrinsics = camera.required("intrinsics")?;
    let of = intrinsics.numbers(4, 4)?;
    let coefficients = camera.required("distortion_coeffs")?;
    let k = coefficients.numbers(0, 5)?;
    let model = camera.required("distortion_model")?;
    let lens = match model.text()? {
        "radtan" | "none" => brown_conrady(&coefficients, &k)?,
        "equidistant" | "equi" => equidistant(&coefficients, &k)?,
        other => return Err(model.wrong("radtan, equidistant or none", other)),
    };
    calibration(size, &intrinsics, [of[0], of[1], of[2], of[3]], lens)
}

fn size<V: Value>(width: &V, height: &V) -> Result<(u32, u32), String> {
    let (across, down) = (width.whole(1, MAX_SIDE_PX)?, height.whole(1, MAX_SIDE_PX)?);
    match is_size(across, down) {
        true => Ok((across, down)),
        false => Err(height.wrong(
            &format!("such that there are at most {MAX_PIXELS} pixels"),
            down,
        )),
    }
}

/// k1, k2, p1, p2, k3, k4, k5, k6; what OpenCV has beyond these (a thin prism, a tilted sensor) is to be 0.
fn brown_conrady(node: &impl Value, k: &[f64]) -> Result<Lens, String> {
    if let Some(more) = k.iter().skip(8).find(|more| **more != 0.0) {
        return Err(node.wrong(
            "k1, k2, p1, p2, k3, k4, k5, k6 and nothing beyond but zeros (calibrate with the plumb_bob or the rational_polynomial model)",
            more,
        ));
    }
    if matches!(k.len(), 1..=3) {
        return Err(node.wrong("none or at least four numbers", k.len()));
    }
    let mut distortion = [0.0; 8];
    for (coefficient, given) in distortion.iter_mut().zip(k) {
        *coefficient = *given;
    }
    Ok(Lens::Perspective(distortion))
}

fn equidistant(node: &impl Value, k: &[f64]) -> Result<Lens, String> {
    let fisheye = <[f64; 4]>::try_from(k);
    let fisheye = fisheye.map_err(|_| node.wrong("four numbers", k.len()))?;
    Ok(Lens::Fisheye(fisheye))
}

/// With fx, fy, cx and cy.
fn calibration(
    (width, height): (u32, u32),
    node: &impl Value,
    [fx, fy, cx, cy]: [f64; 4],
    lens: Lens,
) -> Result<Calibration, String> {
    if fx < LEAST_FOCAL_PX || fy < LEAST_FOCAL_PX {
        let expected = format!("with focal lengths of at least {LEAST_FOCAL_PX} pixels");
        return Err(node.wrong(&expected, format_args!("{fx} and {fy}")));
    }
    Ok(Calibration {
        width,
        height,
        focal_px: DVec2::new(fx, fy),
        centre_px: DVec2::new(cx, cy) + HALF_PIXEL,
        lens,
    })
}

#[cfg(test)]
mod tests;
