//! Calibrations of cameras as other programs write them: YAML of ROS (`camera_calibration`, `camera_info_manager`), of OpenCV
//! (`FileStorage`) and of Kalibr (`camchain`).

use std::fmt::Display;

use glam::DVec2;
use saphyr::{LoadableYamlNode as _, MarkedYaml, YamlData};

use super::camera::{MAX_PIXELS, MAX_SIDE_PX};
use super::lens::Lens;

/// Endings of such files.
const ENDINGS: [&str; 2] = ["yaml", "yml"];
/// Largest such file, bytes; they have less than a hundredth of it.
const MOST_BYTES: usize = 1 << 20;
/// Most brackets that may be open at a time.
const MOST_NESTED: usize = 32;
/// What OpenCV begins its files with, which is no directive of YAML.
const OPENCV: &str = "%YAML:1.0";
/// Where OpenCV and its kin have the point (0, 0): in the middle of the first pixel.
const HALF_PIXEL: f64 = 0.5;
/// Smallest focal length, pixels.
const LEAST_FOCAL_PX: f64 = 1e-3;
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
    check_extent(text)?;
    let documents =
        MarkedYaml::load_from_str(text).map_err(|error| format!("not YAML: {error}"))?;
    let Some(root) = documents.first() else {
        return Err("is empty".to_owned());
    };
    let root = Node {
        yaml: root,
        path: String::new(),
    };
    match root.get("image_width") {
        Some(_) => of_opencv(&root),
        None => of_kalibr(&root),
    }
}

/// Refuses what would take long to read, or many calls within each other.
fn check_extent(text: &str) -> Result<(), String> {
    if text.len() > MOST_BYTES {
        return Err(format!(
            "must have at most {MOST_BYTES} bytes, got {}",
            text.len()
        ));
    }
    let mut open = 0usize;
    for (number, line) in text.lines().enumerate() {
        let indent = line.len() - line.trim_start().len();
        for letter in line.chars() {
            match letter {
                '[' | '{' => open += 1,
                ']' | '}' => open = open.saturating_sub(1),
                _ => {}
            }
        }
        if open > MOST_NESTED || indent > 2 * MOST_NESTED && open == 0 || nested_items(line) {
            return Err(format!("line {}: nested too deeply", number + 1));
        }
    }
    Ok(())
}

/// Whether a line begins many lists within each other, as in `- - - 1`.
fn nested_items(line: &str) -> bool {
    let items = line
        .split_whitespace()
        .take_while(|word| matches!(*word, "-" | "?"));
    items.count() > MOST_NESTED
}

/// Of ROS and OpenCV, whose fields have the same names.
fn of_opencv(root: &Node<'_>) -> Result<Calibration, String> {
    let (width, height) = size([
        root.required("image_width")?,
        root.required("image_height")?,
    ])?;
    let matrix = root.required("camera_matrix")?.required("data")?;
    let of = matrix.numbers(9, 9)?;
    if of[1].abs() > NO_SKEW * of[0].abs() {
        return Err(matrix.wrong("without skew (its second number)", of[1]));
    }
    let coefficients = root.required("distortion_coefficients")?.required("data")?;
    let k = coefficients.numbers(0, 14)?;
    let model = root.get("distortion_model");
    let name = model.as_ref().map(Node::text).transpose()?;
    let lens = match name.unwrap_or("plumb_bob") {
        "plumb_bob" | "rational_polynomial" | "thin_prism" | "" => {
            brown_conrady(&coefficients, &k)?
        }
        "equidistant" | "fisheye" => equidistant(&coefficients, &k)?,
        other => {
            let known = "plumb_bob, rational_polynomial or equidistant";
            return Err(model.map_or_else(String::new, |model| model.wrong(known, other)));
        }
    };
    calibration((width, height), &matrix, [of[0], of[4], of[2], of[5]], lens)
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
    let [across, down] = <[Node<'_>; 2]>::try_from(resolution).map_err(|_| String::new())?;
    let size = size([across, down])?;
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

fn size(sides: [Node<'_>; 2]) -> Result<(u32, u32), String> {
    let [width, height] = &sides;
    let (across, down) = (width.side()?, height.side()?);
    match u64::from(across) * u64::from(down) <= MAX_PIXELS {
        true => Ok((across, down)),
        false => Err(height.wrong(
            &format!("such that there are at most {MAX_PIXELS} pixels"),
            down,
        )),
    }
}

/// k1, k2, p1, p2, k3; what OpenCV has beyond these is to be 0.
fn brown_conrady(node: &Node<'_>, k: &[f64]) -> Result<Lens, String> {
    if let Some(more) = k.iter().skip(5).find(|more| **more != 0.0) {
        return Err(node.wrong(
            "k1, k2, p1, p2, k3 and nothing beyond but zeros (calibrate with the plumb_bob model)",
            more,
        ));
    }
    if matches!(k.len(), 1..=3) {
        return Err(node.wrong("none or at least four numbers", k.len()));
    }
    let mut distortion = [0.0; 5];
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

/// A value with the names that lead to it.
struct Node<'y> {
    yaml: &'y MarkedYaml<'y>,
    path: String,
}

impl<'y> Node<'y> {
    /// The value itself, where a type stands before it.
    fn plain(&self) -> &'y MarkedYaml<'y> {
        match &self.yaml.data {
            YamlData::Tagged(_, value) => value,
            _ => self.yaml,
        }
    }

    fn get(&self, name: &str) -> Option<Self> {
        let YamlData::Mapping(fields) = &self.plain().data else {
            return None;
        };
        let found = fields
            .iter()
            .find(|(key, _)| key.data.as_str() == Some(name));
        let dot = if self.path.is_empty() { "" } else { "." };
        found.map(|(_, yaml)| Self {
            yaml,
            path: format!("{}{dot}{name}", self.path),
        })
    }

    fn required(&self, name: &str) -> Result<Self, String> {
        self.get(name).ok_or_else(|| {
            let place = match self.path.as_str() {
                "" => "it",
                path => path,
            };
            format!("line {}: {place} lacks `{name}`", self.line())
        })
    }

    fn line(&self) -> usize {
        self.plain().span.start.line()
    }

    fn wrong(&self, expected: &str, got: impl Display) -> String {
        let (line, path) = (self.line(), &self.path);
        format!("line {line}: {path} must be {expected}, got {got}")
    }

    /// What it is, for messages.
    fn written(&self) -> String {
        match &self.plain().data {
            YamlData::Sequence(items) => format!("a list of {}", items.len()),
            YamlData::Mapping(_) => "a table".to_owned(),
            data => match (data.as_integer(), data.as_floating_point(), data.as_str()) {
                (Some(whole), ..) => whole.to_string(),
                (_, Some(number), _) => number.to_string(),
                (.., Some(text)) => format!("{text:?}"),
                _ => "something else".to_owned(),
            },
        }
    }

    fn text(&self) -> Result<&'y str, String> {
        let text = self.plain().data.as_str();
        text.ok_or_else(|| self.wrong("a word", self.written()))
    }

    fn number(&self) -> Result<f64, String> {
        let data = &self.plain().data;
        let whole = data.as_integer().map(|whole| whole as f64);
        let number = whole.or_else(|| data.as_floating_point());
        let finite = number.filter(|number| number.is_finite());
        finite.ok_or_else(|| self.wrong("a finite number", self.written()))
    }

    fn side(&self) -> Result<u32, String> {
        let whole = self.plain().data.as_integer();
        let side = whole.and_then(|whole| u32::try_from(whole).ok());
        side.filter(|side| (1..=MAX_SIDE_PX).contains(side))
            .ok_or_else(|| {
                let expected = format!("a whole number in [1, {MAX_SIDE_PX}] pixels");
                self.wrong(&expected, self.written())
            })
    }

    fn items(&self, least: usize, most: usize) -> Result<Vec<Self>, String> {
        match &self.plain().data {
            YamlData::Sequence(items) if (least..=most).contains(&items.len()) => {
                let item = |(i, yaml)| Self {
                    yaml,
                    path: format!("{}[{i}]", self.path),
                };
                Ok(items.iter().enumerate().map(item).collect())
            }
            _ => {
                let expected = match least == most {
                    true => format!("a list of {least} numbers"),
                    false => format!("a list of {least} to {most} numbers"),
                };
                Err(self.wrong(&expected, self.written()))
            }
        }
    }

    fn numbers(&self, least: usize, most: usize) -> Result<Vec<f64>, String> {
        self.items(least, most)?.iter().map(Self::number).collect()
    }
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
        let lens = Lens::Perspective([-0.2, 0.03, 0.001, -0.002, 0.0]);
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
        // A longer model whose further numbers are zeros, and no distortion at all.
        let long = ROS.replace("-.002, 0]", "-.002, 0, 0, 0.0, 0]");
        assert_eq!(parse(&long), Ok(expected(lens)));
        let none = ROS.replace("[-0.2, 3.0e-02, 1e-3, -.002, 0]", "[]");
        assert_eq!(parse(&none), Ok(expected(Lens::Perspective([0.0; 5]))));
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
                "line 1: image_width must be a whole number in [1, 16384] pixels, got 64.5",
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
                "-.002, 0, 0.5, 0, 0]",
                "nothing beyond but zeros (calibrate with the plumb_bob model), got 0.5",
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
        let expected = "line 2: image_height must be such that there are at most";
        assert!(error.contains(expected), "{error}");
        for (text, words) in [
            ("", "is empty"),
            ("a: [1, 2", "not YAML"),
            ("exposure: 3\n", "must be a calibration of ROS or OpenCV"),
            ("- 1\n- 2\n", "got neither"),
        ] {
            let error = parse(text).expect_err(text);
            assert!(error.contains(words), "{text}: {error}");
        }
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
            "a".repeat(2 << 20),
            "a: &x [1]\nb: *x\n".to_owned(),
        ] {
            assert!(parse(&text).is_err());
        }
    }
}
