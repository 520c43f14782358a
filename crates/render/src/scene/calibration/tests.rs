//! Files that other programs write, and what is wrong with some.

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

const OPENCV_XML: &str = "<?xml version=\"1.0\"?>\n<opencv_storage>\n<calibration_Time>\"today\"</calibration_Time>\n<image_Width>640</image_Width>\n\
                      <image_Height>480</image_Height>\n<Camera_Matrix type_id=\"opencv-matrix\">\n  <rows>3</rows>\n  <cols>3</cols>\n  <dt>d</dt>\n  <data>\n    \
                      5.0050000000000000e+02 0. 3.1950000000000000e+02 0. 501.\n    2.3950000000000000e+02 0. 0. 1.</data></Camera_Matrix>\n\
                      <Distortion_Coefficients type_id=\"opencv-matrix\">\n  <rows>5</rows>\n  <cols>1</cols>\n  <dt>d</dt>\n  <data>\n    \
                      -2.0e-01 3.0e-02 1.0e-03 -2.0e-03 0.</data></Distortion_Coefficients>\n</opencv_storage>\n";
/// The same camera: B1 is fx - fy, P1 and P2 are exchanged, cx and cy count from the middle.
const METASHAPE: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<calibration>\n  <projection>frame</projection>\n  <width>640</width>\n  <height>480</height>\n  \
                     <f>501</f>\n  <cx>0</cx>\n  <cy>0.0</cy>\n  <b1>-0.5</b1>\n  <k1>-0.2</k1>\n  <k2>0.03</k2>\n  <p1>-0.002</p1>\n  <p2>0.001</p2>\n  \
                     <date>2026-11-30T10:00:00Z</date>\n</calibration>\n";

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
    for text in [ROS, OPENCV_FILE, KALIBR, OPENCV_XML, METASHAPE] {
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
        error.contains("line 17: distortion_coefficients.data must be beside a distortion_model"),
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
        "<a>".repeat(100_000),
        "<a>".repeat(100_000) + &"</a>".repeat(100_000),
        "<a/>".repeat(100_000),
        METASHAPE.replace("640", &"6".repeat(500_000)),
        METASHAPE.replace("frame", &"frame".repeat(100_000)),
        METASHAPE.replace("calibration", &"c".repeat(300_000)),
        OPENCV_XML.replace("501.", &"5".repeat(500_000)),
        KALIBR.replace("pinhole", &"p".repeat(500_000)),
        ROS.replace("plumb_bob", &"p".repeat(500_000)),
        "<!DOCTYPE a [<!ENTITY b \"c\"><!ENTITY d \"&b;&b;\">]><a>&d;</a>".to_owned(),
    ] {
        let error = parse(&text).expect_err("hostile");
        assert!(error.len() < 500, "{error}");
    }
}

/// Exported cameras have the calibration that was there first beside the adjusted one.
fn exported(adjusted: &str) -> String {
    let inside = adjusted.lines().skip(5).collect::<Vec<_>>().join("\n");
    let first = "<calibration type=\"frame\" class=\"initial\"><resolution width=\"640\" height=\"480\"/><f>480</f></calibration>";
    let sensor = |id: u32| {
        format!(
            "<sensor id=\"{id}\" type=\"frame\"><resolution width=\"640\" height=\"480\"/>\n{first}\n<calibration type=\"frame\" class=\"adjusted\">\n\
             <resolution width=\"640\" height=\"480\"/>\n{inside}\n</sensor>\n"
        )
    };
    format!(
        "\u{feff}<?xml version=\"1.0\"?>\n<document version=\"1.5.0\">\n<chunk label=\"Chunk 1\"><sensors>\n{}</sensors></chunk></document>\n",
        sensor(0)
    )
}

#[test]
fn cameras_of_metashape() {
    let lens = Lens::brown_conrady([-0.2, 0.03, 0.001, -0.002, 0.0]);
    assert_eq!(parse(&exported(METASHAPE)), Ok(expected(lens)));
    let moved = METASHAPE
        .replace("<cx>0<", "<cx>-3.5<")
        .replace("<cy>0.0<", "<cy>1e1<");
    let centre_px = DVec2::new(316.5, 250.0);
    assert_eq!(
        parse(&moved),
        Ok(Calibration {
            centre_px,
            ..expected(lens)
        })
    );
    let fisheye = METASHAPE
        .replace("frame", "fisheye")
        .replace("<p1>-0.002<", "<k4>0.1<");
    let fisheye = fisheye
        .replace("</p1>", "</k4>")
        .replace("<p2>0.001</p2>", "");
    let lens = Lens::Fisheye([-0.2, 0.03, 0.0, 0.1]);
    assert_eq!(parse(&fisheye), Ok(expected(lens)));
    let two = exported(METASHAPE);
    let sensor = &two[two.find("<sensor id").unwrap()..two.find("</sensors>").unwrap()];
    let two = two.replace("</sensors>", &format!("{sensor}</sensors>"));
    for (text, words) in [
        (METASHAPE.replace("<f>501</f>", ""), "line 2: it lacks `f`"),
        (
            METASHAPE.replace("501", "-1"),
            "line 6: f must be with focal lengths of at least 0.001 pixels, got -1.5 and -1",
        ),
        (
            METASHAPE.replace("640", "64 0"),
            "line 4: width must be a whole number in [1, 16384], got \"64 0\"",
        ),
        (
            METASHAPE.replace("0.03", "x"),
            "line 11: k2 must be a finite number, got \"x\"",
        ),
        (
            METASHAPE.replace("0.03", ""),
            "line 11: k2 must be a finite number, got no text",
        ),
        (
            METASHAPE.replace(">frame<", ">spherical<"),
            "line 3: projection must be frame, fisheye or equidistant_fisheye, got spherical",
        ),
        (
            METASHAPE.replace("b1", "b2"),
            "line 9: b2 must be 0 (without skew",
        ),
        (
            METASHAPE.replace("k2", "k4"),
            "line 11: k4 must be 0 (leave it out when cameras are optimised), got \"0.03\"",
        ),
        (
            fisheye.replace("k4", "p1"),
            "line 12: p1 must be 0 (of a fisheye",
        ),
        (
            two,
            "calibration must be left out: one camera a file, got another camera",
        ),
        (
            exported(METASHAPE).replace("adjusted", "initial"),
            "must have an adjusted calibration",
        ),
        (
            "<html/>".to_owned(),
            "must be a calibration of OpenCV (`opencv_storage`) or Metashape",
        ),
        ("<calibration>".to_owned(), "not XML"),
        (
            OPENCV_XML.replace("501.", ""),
            "line 10: camera_matrix.data must be a list of 9 numbers, got a list of 8",
        ),
        (
            OPENCV_XML.replace("501.", "a"),
            "camera_matrix.data[4] must be a finite number, got \"a\"",
        ),
    ] {
        let error = parse(&text).expect_err(words);
        assert!(error.contains(words), "{words}: {error}");
    }
}
