//! Calibrations of cameras as other programs write them: YAML of ROS (`camera_calibration`, `camera_info_manager`), of OpenCV
//! (`FileStorage`) and of Kalibr (`camchain`).

use glam::DVec2;

use super::camera::{LEAST_FOCAL_PX, MAX_PIXELS, MAX_SIDE_PX, is_size};
use super::lens::Lens;
use super::yaml::Node;

/// Endings of such files.
const ENDINGS: [&str; 2] = ["yaml", "yml"];
/// What OpenCV begins its files with, which is no directive of YAML.
const OPENCV: &str = "%YAML:1.0";
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
    let text = text.strip_prefix(OPENCV).unwrap_or(text);
    Node::of_text(text, |root| match root.get("image_width") {
        Some(_) => of_opencv(root),
        None => of_kalibr(root),
    })
}

/// Of ROS and OpenCV, whose fields have the same names.
fn of_opencv(root: &Node<'_>) -> Result<Calibration, String> {
    let size = size(
        &root.required("image_width")?,
        &root.required("image_height")?,
    )?;
    let matrix = root.required("camera_matrix")?.required("data")?;
    let of = matrix.numbers(9, 9)?;
    if of[1].abs() > NO_SKEW * of[0].abs() {
        return Err(matrix.wrong("without skew (its second number)", of[1]));
    }
    let coefficients = root.required("distortion_coefficients")?.required("data")?;
    let k = coefficients.numbers(0, 14)?;
    let lens = match is_fisheye(root, &coefficients, k.len())? {
        true => equidistant(&coefficients, &k)?,
        false => brown_conrady(&coefficients, &k)?,
    };
    calibration(size, &matrix, [of[0], of[4], of[2], of[5]], lens)
}

/// As `distortion_model` of ROS or `fisheye_model` of OpenCV's own program says. Files of OpenCV may say neither, but then four numbers may be of either lens.
fn is_fisheye(root: &Node<'_>, coefficients: &Node<'_>, count: usize) -> Result<bool, String> {
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

fn size(width: &Node<'_>, height: &Node<'_>) -> Result<(u32, u32), String> {
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
fn brown_conrady(node: &Node<'_>, k: &[f64]) -> Result<Lens, String> {
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

fn equidistant(node: &Node<'_>, k: &[f64]) -> Result<Lens, String> {
    let fisheye = <[f64; 4]>::try_from(k);
    let fisheye = fisheye.map_err(|_| node.wrong("four numbers", k.len()))?;
    Ok(Lens::Fisheye(fisheye))
}

/// With fx, fy, cx and cy.
fn calibration(
    (width, height): (u32, u32),
    node: &Node<'_>,
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
mod tests {
    use super::*;

    const ROS: &str = "image_width: 640\nimage_height: 480\ncamera_name: left\ncamera_matrix:\n  rows: 3\n  cols: 3\n  \
                       data: [500.5, 0., 319.5, 0., 501, 239.5, 0., 0., 1.]\ndistortion_model: plumb_bob\n\
                       distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [-0.2, 3.0e-02, 1e-3, -.002, 0]\n\
                       rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n";
    const OPENCV_FILE: &str = "%YAML:1.0\n---\ncalibration_time: \"Mon 30 Nov 2026\"\nimage_width: 640\nimage_height: 480\nflags: 0\n\
                       camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 5.0050000000000000e+02, 0., 3.1950000000000000e+02, 0.,\n       \
                       501., 2.3950000000000000e+02, 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   \
                       data: [ -2.0e-01, 3.0e-02, 1.0e-03,\n       -2.0e-03, 0. ]\navg_reprojection_error: 3.1e-01\n";
    const KALIBR: &str = "cam0:\n  cam_overlaps: []\n  camera_model: pinhole\n  distortion_coeffs: [-0.2, 0.03, 0.001, -0.002]\n  \
                          distortion_model: radtan\n  intrinsics: [500.5, 501.0, 319.5, 239.5]\n  resolution: [640, 480]\n  rostopic: /left/image_raw\n";

    fn expected(lens: Lens) -> Calibration {
        Calibration {
            width: 640,
            height: 480,
            focal_px: DVec2::new(500.5, 501.0),
            centre_px: DVec2::new(320.0, 240.0),
            lens,
        }
    }

    #[test]
    fn files_of_ros_opencv_and_kalibr_tell_the_same_camera() {
        let lens = Lens::brown_conrady([-0.2, 0.03, 0.001, -0.002, 0.0]);
        for text in [ROS, OPENCV_FILE, KALIBR] {
            assert_eq!(parse(text), Ok(expected(lens)), "{text}");
        }
        let fisheye = Lens::Fisheye([0.01, -0.003, 0.0, 0.1]);
        let ros = ROS
            .replace("plumb_bob", "equidistant")
            .replace("[-0.2, 3.0e-02, 1e-3, -.002, 0]", "[0.01, -0.003, 0, 0.1]");
        let kalibr = KALIBR
            .replace("radtan", "equidistant")
            .replace("[-0.2, 0.03, 0.001, -0.002]", "[0.01, -0.003, 0.0, 0.1]");
        for text in [ros, kalibr] {
            assert_eq!(parse(&text), Ok(expected(fisheye)), "{text}");
        }
        // Longer models, with and without zeros beyond, and no distortion at all.
        let long = ROS.replace("-.002, 0]", "-.002, 0, 0, 0.0, 0, 0, 0, 0]");
        assert_eq!(parse(&long), Ok(expected(lens)));
        let rational = Lens::Perspective([-0.2, 0.03, 0.001, -0.002, 0.0, 0.5, -0.1, 0.02]);
        let long = ROS.replace("plumb_bob", "rational_polynomial");
        let long = long.replace("-.002, 0]", "-.002, 0, 0.5, -0.1, 0.02]");
        assert_eq!(parse(&long), Ok(expected(rational)));
        let none = ROS.replace("[-0.2, 3.0e-02, 1e-3, -.002, 0]", "[]");
        assert_eq!(parse(&none), Ok(expected(Lens::default())));
    }

    #[test]
    fn what_is_wrong_is_told_by_line_and_field() {
        let told = |from: &str, to: &str| {
            assert!(ROS.contains(from), "{from}");
            parse(&ROS.replace(from, to)).expect_err(to)
        };
        for (from, to, words) in [
            ("image_height: 480\n", "", "line 1: it lacks `image_height`"),
            (
                "width: 640",
                "width: 64.5",
                "line 1: image_width must be a whole number in [1, 16384], got 64.5",
            ),
            ("width: 640", "width: 0", "got 0"),
            (
                "501, 239.5",
                "501",
                "line 7: camera_matrix.data must be a list of 9 numbers, got a list of 8",
            ),
            (
                "501, 239.5",
                "501, .nan",
                "camera_matrix.data[5] must be a finite number, got NaN",
            ),
            (
                "501, 239.5",
                "-501, 239.5",
                "focal lengths of at least 0.001 pixels, got 500.5 and -501",
            ),
            (
                "[500.5, 0.",
                "[500.5, 3.",
                "without skew (its second number), got 3",
            ),
            (
                "plumb_bob",
                "fov",
                "line 8: distortion_model must be plumb_bob, rational_polynomial or equidistant, got fov",
            ),
            (
                "plumb_bob",
                "equidistant",
                "line 12: distortion_coefficients.data must be four numbers, got 5",
            ),
            (
                "-.002, 0]",
                "-.002, 0, 0.5, 0, 0, 0, 0.25]",
                "nothing beyond but zeros (calibrate with the plumb_bob or the rational_polynomial model), got 0.25",
            ),
            (
                "-.002, 0]",
                "-.002, \"x\"]",
                "distortion_coefficients.data[4] must be a finite number, got \"x\"",
            ),
            (
                "1e-3, -.002, 0]",
                "1e-3]",
                "none or at least four numbers, got 3",
            ),
        ] {
            let error = told(from, to);
            assert!(error.contains(words), "{to}: {error}");
        }
        let large = ROS.replace("640", "16384").replace("480", "16384");
        let error = parse(&large).expect_err("large");
        let words = "line 2: image_height must be such that there are at most";
        assert!(error.contains(words), "{error}");
        for (text, words) in [
            ("", "is empty"),
            ("a: [1, 2", "not YAML"),
            ("exposure: 3\n", "must be a calibration of ROS or OpenCV"),
            ("- 1\n- 2\n", "got neither"),
        ] {
            let error = parse(text).expect_err(text);
            assert!(error.contains(words), "{text}: {error}");
        }
        // OpenCV's own file of a fisheye says so, or it might be another lens with four numbers.
        let four = OPENCV_FILE.replace("\n       -2.0e-03, 0. ]", "\n       -2.0e-03 ]");
        let error = parse(&four).expect_err("either lens");
        assert!(
            error.contains(
                "line 17: distortion_coefficients.data must be beside a distortion_model"
            ),
            "{error}"
        );
        let fisheye = Lens::Fisheye([-0.2, 0.03, 0.001, -0.002]);
        let said = four.replace("flags: 0", "fisheye_model: 1");
        assert_eq!(parse(&said), Ok(expected(fisheye)));
        let said = four.replace("flags: 0", "fisheye_model: 0");
        let lens = Lens::brown_conrady([-0.2, 0.03, 0.001, -0.002, 0.0]);
        assert_eq!(parse(&said), Ok(expected(lens)));
        let two = format!("{KALIBR}{}", KALIBR.replace("cam0", "cam1"));
        let error = parse(&two).expect_err("two cameras");
        assert!(
            error.contains("cam1 must be left out: one camera a file"),
            "{error}"
        );
        let omni = parse(&KALIBR.replace("pinhole", "omni")).expect_err("omni");
        assert!(
            omni.contains("line 3: cam0.camera_model must be pinhole, got omni"),
            "{omni}"
        );
    }

    #[test]
    fn hostile_files_are_refused() {
        for text in [
            "[".repeat(100_000),
            "{a: ".repeat(100_000),
            format!("{}1", "- ".repeat(100_000)),
            (0..100_000).map(|k| " ".repeat(k % 500) + "a:\n").collect(),
            "# [\n".to_owned()
                + &(0..1400)
                    .map(|k| " ".repeat(k) + "a:\n")
                    .collect::<String>(),
            "- !x ".repeat(100_000),
            "[\"]\", ".repeat(100_000),
            "a".repeat(2 << 20),
            "a: &x [1]\nb: *x\n".to_owned(),
        ] {
            assert!(parse(&text).is_err());
        }
    }
}
