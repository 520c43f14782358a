//! `uw sequence`: pictures along a trajectory with what is true of them.

use std::path::Path;

use glam::{DMat3, DQuat, DVec2, DVec3};
use image::{DynamicImage, ImageReader};
use serde_json::Value;
use uw_render::image::{ExrImage, LayerData};

use crate::support::{Folder, SCENE};

/// Ahead of the scene's pose (+x), half a metre nearer, and to the side with the camera turned.
const POSES: &str = "time_s,tx,ty,tz,forward_x,forward_y,forward_z\n\
                     10.0,0,0,0,1,0,0\n10.5,0.5,0,0,1,0,0\n11.0,0,0.5,0,1,-0.2,0.05\n";

/// Still, with lamps that are dimmed.
const DIMMED: &str = "time_s,tx,ty,tz,forward_x,forward_y,forward_z,level_pct\n\
                      0,0,0,0,1,0,0,100\n1,0,0,0,1,0,0,25\n";

fn folder() -> Folder {
    let folder = Folder::with_scene();
    folder.write("poses.csv", POSES);
    folder
}

fn picture(folder: &Folder, name: &str) -> DynamicImage {
    let reader = ImageReader::open(folder.path(name)).expect(name);
    reader.decode().expect(name)
}

fn json(folder: &Folder, name: &str) -> Value {
    serde_json::from_str(&folder.text(name)).expect(name)
}

/// Poses of `groundtruth.txt`: time, position, and the axes right, down, forward.
fn truth(folder: &Folder) -> Vec<(f64, DVec3, DMat3)> {
    let text = folder.text("out/groundtruth.txt");
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let pose = |line: &str| {
        let n: Vec<f64> = line
            .split(' ')
            .map(|x| x.parse().expect("a number"))
            .collect();
        let q = DQuat::from_xyzw(n[4], n[5], n[6], n[7]);
        (n[0], DVec3::new(n[1], n[2], n[3]), DMat3::from_quat(q))
    };
    lines.map(pose).collect()
}

#[test]
fn frames_come_with_depth_poses_lists_and_exports() {
    let folder = folder();
    let made = folder.good("sequence scene.toml poses.csv -o out --stereo 0.1 --format tum,colmap,nerfstudio,mcap --layers normal");
    assert!(
        made.stderr.contains("3 frames, 6 pictures"),
        "{}",
        made.stderr
    );
    // The wall is at x = 1.5 m.
    for (name, expected_mm) in [
        ("depth/000000.png", 1500),
        ("depth_right/000000.png", 1500),
        ("depth/000001.png", 1000),
    ] {
        let depth = picture(&folder, &format!("out/{name}"));
        let depth = depth.as_luma16().expect("16 bits, grey");
        assert!(
            depth.pixels().all(|p| p.0[0].abs_diff(expected_mm) <= 1),
            "{name}"
        );
    }
    let exr = ExrImage::read(&folder.path("out/exr_right/000002.exr")).expect("an EXR");
    assert!(exr.layer("depth").is_some() && exr.layer("normal").is_some());
    let poses = truth(&folder);
    assert_eq!(
        poses.iter().map(|p| p.0).collect::<Vec<_>>(),
        [10.0, 10.5, 11.0]
    );
    assert!((poses[2].2.z_axis - DVec3::new(1.0, -0.2, 0.05).normalize()).length() < 1e-8);
    assert!(
        folder
            .text("out/rgb_right.txt")
            .ends_with("11.000000000 rgb_right/000002.png\n")
    );
    // COLMAP: the camera is where its own coordinates are zero.
    let images = folder.text("out/colmap/images.txt");
    let rows: Vec<&str> = images
        .lines()
        .filter(|line| line.contains(".png"))
        .collect();
    assert_eq!(rows.len(), 6);
    let right_eyes = poses
        .iter()
        .map(|(_, place, axes)| *place + 0.1 * axes.x_axis);
    for (row, place) in rows.iter().skip(1).step_by(2).zip(right_eyes) {
        let n: Vec<f64> = row
            .split(' ')
            .take(8)
            .map(|x| x.parse().expect("a number"))
            .collect();
        let q = DQuat::from_xyzw(n[2], n[3], n[4], n[1]);
        assert!(
            (q * place + DVec3::new(n[5], n[6], n[7])).length() < 1e-6,
            "{row}"
        );
    }
    // nerfstudio: the camera looks along its -z.
    let frames = json(&folder, "out/transforms.json");
    let matrix = &frames["frames"][4]["transform_matrix"];
    let column =
        |c: usize| DVec3::from_array([0, 1, 2].map(|r| matrix[r][c].as_f64().expect("a number")));
    assert!((column(3) - poses[2].1).length() < 1e-8);
    assert!(
        (column(2) + poses[2].2.z_axis).length() < 1e-8
            && (column(1) + poses[2].2.y_axis).length() < 1e-8
    );
    assert_eq!(frames["frames"][4]["file_path"], "rgb/000002.png");
    // What its messages say is read by others (tests/python).
    let recording = folder.read("out/sequence.mcap");
    let stream = mcap::MessageStream::new(&recording).expect("a recording");
    let topics: Vec<String> = stream
        .map(|message| message.expect("a message").channel.topic.clone())
        .collect();
    let of = |topic: &str| topics.iter().filter(|own| *own == topic).count();
    assert_eq!([of("/pose"), of("/right/depth"), topics.len()], [3, 3, 24]);
}

/// Eight coefficients, as COLMAP and ROS have a model for, five where the others are none, and nerfstudio has no form for them.
#[test]
fn lenses_of_the_rational_model_go_to_those_who_have_it() {
    const RATIONAL: &str = "0.62, 0.11, 0.0004, -0.0003, 0.006, 0.93, 0.21, 0.021";
    let folder = folder();
    let with = |lens: &str| {
        let scene = SCENE.replace(
            "hfov_deg = 60.0",
            &format!("fx = 28.0\ndistortion = [{lens}]"),
        );
        folder.write("scene.toml", scene);
        "sequence scene.toml poses.csv --spp 1"
    };
    let models = |line: &str, out: &str| {
        folder.good(&format!("{line} -o {out} --format tum,colmap,mcap"));
        let recording = folder.read(&format!("{out}/sequence.mcap"));
        let stream = mcap::MessageStream::new(&recording).expect("a recording");
        let mut messages = stream.map(|message| message.expect("a message"));
        let info = messages.find(|message| message.channel.topic == "/left/camera_info");
        let info = String::from_utf8_lossy(&info.expect("an info").data).into_owned();
        let camera = json(&folder, &format!("{out}/camera.json"));
        let count = camera["distortion"].as_array().map(Vec::len);
        let colmap = folder.text(&format!("{out}/colmap/cameras.txt"));
        (colmap, info, count)
    };
    let (colmap, info, count) = models(with(RATIONAL), "eight");
    let numbers = RATIONAL.replace(',', "");
    assert!(
        colmap.contains(&format!("FULL_OPENCV 32 18 28 28 16 9 {numbers}\n")),
        "{colmap}"
    );
    assert!(info.contains("rational_polynomial"), "{info}");
    assert_eq!(count, Some(8));
    folder.refused(
        &format!("{} -o none --format nerfstudio", with(RATIONAL)),
        &["--format nerfstudio", "k4, k5 and k6", "--format colmap"],
    );
    let (colmap, info, count) = models(with("-0.1, 0.01, 0.0, 0.0, 0.0"), "five");
    assert!(colmap.contains("16 9 -0.1 0.01 0 0 0 0 0 0\n"), "{colmap}");
    assert!(info.contains("plumb_bob"), "{info}");
    assert_eq!(count, Some(5));
}

/// Pixels hold the places that poses, camera file and baseline say, and the picture shows a bright square where its place is.
#[test]
fn pictures_show_a_place_where_the_poses_say() {
    let folder = folder();
    let square = DVec3::new(1.4, -0.13, 0.21);
    let object = "[[object]]\nplane = { center_m = [1.4, -0.13, 0.21], normal = [-1.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], size_m = [0.1, 0.1] }\n\
                  reflectance = [0.0, 0.0, 0.0]\nemission = [1e3, 1e3, 1e3]\n";
    folder.write("scene.toml", format!("{SCENE}{object}"));
    folder.good("sequence scene.toml poses.csv -o out --stereo 0.2 --width 160 --height 90 --spp 16 --layers position");
    let camera = json(&folder, "out/camera.json");
    let number = |name: &str| camera[name].as_f64().expect("a number");
    for (k, (_, position, axes)) in truth(&folder).into_iter().enumerate() {
        for (eye, kind) in [(0.0, "exr"), (0.2, "exr_right")] {
            let name = format!("out/{kind}/{k:06}.exr");
            let image = ExrImage::read(&folder.path(&name)).expect("an EXR");
            let projected = |place: DVec3| {
                let seen = axes.transpose() * (place - position - eye * axes.x_axis);
                let (fx, fy) = (number("fx"), number("fy"));
                DVec2::new(
                    number("cx") + fx * seen.x / seen.z,
                    number("cy") + fy * seen.y / seen.z,
                )
            };
            let middle = |i: usize| DVec2::new((i % 160) as f64 + 0.5, (i / 160) as f64 + 0.5);
            let Some(LayerData::Vector(places)) = image.layer("position") else {
                panic!("{name}: no positions");
            };
            for (i, place) in places.iter().enumerate() {
                let place = DVec3::from_array(place.map(f64::from));
                let off = (projected(place) - middle(i)).length();
                assert!(off < 1e-3, "{name}: pixel {i} is off by {off}");
            }
            // What is scattered on the way lies beside it, and is weaker.
            let greens = || image.picture.data.iter().map(|pixel| f64::from(pixel[1]));
            let brightest = greens().fold(0.0, f64::max);
            let (mut light, mut at) = (0.0, DVec2::ZERO);
            for (i, green) in greens().enumerate().filter(|(_, g)| *g > 0.3 * brightest) {
                light += green;
                at += green * middle(i);
            }
            let off = (at / light - projected(square)).length();
            assert!(off < 0.5, "{name}: the square is off by {off}");
        }
    }
}

/// Place and width, pixels, of what is bright in a picture's row of light: mean and standard deviation of the column.
fn columns(picture: &uw_render::image::Picture, rows: std::ops::Range<u32>) -> (f64, f64) {
    let width = picture.width as usize;
    let (mut light, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for row in rows {
        for (column, pixel) in picture.data[row as usize * width..][..width]
            .iter()
            .enumerate()
        {
            let (x, green) = (column as f64 + 0.5, f64::from(pixel[1]));
            light += green;
            sum += green * x;
            squares += green * x * x;
        }
    }
    let mean = sum / light;
    (mean, (squares / light - mean * mean).sqrt())
}

/// A glowing post in clear air that the camera passes: a streak as long as speed times exposure from where its pose says, and where
/// rows open one after another, a post that leans.
#[test]
fn a_shutter_blurs_by_speed_times_exposure_and_bends_what_passes() {
    let folder = Folder::new();
    folder.write(
        "post.toml",
        "format = \"uw-scene/1\"\n\
         [camera]\nposition_m = [0, 0, 0]\nforward = [1, 0, 0]\nfx = 100\nwidth = 160\nheight = 90\n\
         [[object]]\nplane = { center_m = [2, 0, 0], normal = [-1, 0, 0], up = [0, 0, 1], size_m = [0.09, 4] }\n\
         reflectance = [0, 0, 0]\nemission = [1, 1, 1]\n",
    );
    // Half a metre a second to the right, which is -y: 25 pixels a second at 2 m.
    folder.write(
        "path.txt",
        "0 0 0.2 0 0.5 -0.5 0.5 -0.5\n2 0 -0.8 0 0.5 -0.5 0.5 -0.5\n",
    );
    let seen = |options: &str, out: &str| {
        folder.good(&format!(
            "sequence post.toml path.txt -o {out} --rate-hz 1 --spp 64 --backend cpu {options}"
        ));
        let name = format!("{out}/exr/000000.exr");
        ExrImage::read(&folder.path(&name)).expect("an EXR")
    };
    let sharp = columns(&seen("", "sharp").picture, 0..90);
    // From 80 pixels the post lies 0.2 m to the right of the camera, 10 pixels.
    assert!((sharp.0 - 90.0).abs() < 0.05, "{sharp:?}");
    let exposed = seen("--exposure-s 0.8 --layers variance", "exposed");
    let blurred = columns(&exposed.picture, 0..90);
    // 0.8 s are 20 pixels, to the left of where the post was when the shutter opened.
    let length = 12f64.sqrt() * (blurred.1.powi(2) - sharp.1.powi(2)).sqrt();
    assert!(
        (length / 20.0 - 1.0).abs() < 0.05,
        "a streak of {length} pixels"
    );
    assert!(
        (blurred.0 - sharp.0 + 10.0).abs() < 0.5,
        "{sharp:?} {blurred:?}"
    );
    let light = |image: &ExrImage| image.picture.mean()[1];
    let again = seen("--exposure-s 0.8 --seed 9", "again");
    assert_ne!(exposed.picture, again.picture);
    assert!((light(&again) / light(&exposed) - 1.0).abs() < 0.01);
    // The depth is that of the pose.
    let Some(LayerData::Scalar(depths)) = exposed.layer("depth") else {
        panic!("no depth");
    };
    let of_post = depths.iter().filter(|depth| depth.is_finite()).count();
    assert_eq!(of_post, 4 * 90, "columns of the sharp post");
    // A second from the first row to the last: the post leans by 25 pixels, top to bottom.
    let rolled = seen("--rolling-shutter-s 1", "rolled");
    let (top, bottom) = (
        columns(&rolled.picture, 0..5),
        columns(&rolled.picture, 85..90),
    );
    // Both five rows open when their middle one does, 2/89 of a second after the first and before the last.
    let lean = bottom.0 - top.0;
    assert!(
        (lean + 25.0 * 85.0 / 89.0).abs() < 0.3,
        "leans by {lean} pixels"
    );
    folder.refused(
        "sequence post.toml path.txt -o rolled --rate-hz 1 --spp 64 --backend cpu",
        &["made with", "asked for is"],
    );
    folder.refused(
        "sequence post.toml path.txt -o x --exposure-s -1",
        &["--exposure-s"],
    );
}

/// Lamps keep their place before the camera; those that are fixed do not.
#[test]
fn lamps_move_with_the_camera() {
    let folder = folder();
    // The wall is wide, so that from the side it looks the same where the lamps are there too.
    folder.write(
        "side.txt",
        "0 0 0 0 0.5 -0.5 0.5 -0.5\n1 0 1.5 0 0.5 -0.5 0.5 -0.5\n",
    );
    let mean = |name: &str| {
        let picture = ExrImage::read(&folder.path(name)).expect("an EXR").picture;
        picture.mean()[1]
    };
    folder.good("sequence scene.toml side.txt -o moved --spp 64");
    folder.good("sequence scene.toml side.txt -o fixed --spp 64 --fixed-lamp left,right");
    let [here, moved, fixed] = [
        "moved/exr/000000.exr",
        "moved/exr/000001.exr",
        "fixed/exr/000001.exr",
    ]
    .map(mean);
    assert!((moved / here - 1.0).abs() < 0.02, "{here} {moved}");
    assert!(fixed < 0.7 * here, "{here} {fixed}");
}

/// Lamps have the level of the pose, but for those that stay where they are.
#[test]
fn lamps_are_dimmed_on_the_way() {
    let folder = folder();
    folder.write("dim.csv", DIMMED);
    folder.good("sequence scene.toml dim.csv -o dimmed --spp 64 --fixed-lamp right --set sky.radiance=[0,0,0]");
    let [full, dimmed] = ["dimmed/exr/000000.exr", "dimmed/exr/000001.exr"].map(|name| {
        let image = ExrImage::read(&folder.path(name)).expect("an EXR");
        image.picture.mean()[1]
    });
    // The lamps are alike; the right one stays at the 25 % of the scene.
    let (expected, got) = ((0.25 + 0.25) / (1.0 + 0.25), dimmed / full);
    assert!((got / expected - 1.0).abs() < 0.02, "{full} {dimmed}");
}

/// Parts are the whole, and what is there is not made again.
#[test]
fn parts_make_the_same_frames_and_a_run_goes_on() {
    let folder = folder();
    folder.good("sequence scene.toml poses.csv -o whole --seed 3");
    let first = folder.good("sequence scene.toml poses.csv -o parts --seed 3 --shard 1/2");
    assert!(
        first
            .stderr
            .contains("1 pictures of other parts are missing"),
        "{}",
        first.stderr
    );
    assert!(!folder.path("parts/groundtruth.txt").exists());
    folder.good("sequence scene.toml poses.csv -o parts --seed 3 --shard 2/2");
    let same = |file: &str| {
        assert_eq!(
            folder.read(&format!("whole/{file}")),
            folder.read(&format!("parts/{file}")),
            "{file}"
        );
    };
    for k in 0..3 {
        same(&format!("rgb/{k:06}.png"));
        // Chunks of an EXR come in any order.
        let [whole, parts] = ["whole", "parts"]
            .map(|f| ExrImage::read(&folder.path(&format!("{f}/exr/{k:06}.exr"))).expect("an EXR"));
        assert!(whole == parts, "{k}");
    }
    same("groundtruth.txt");
    std::fs::remove_file(folder.path("parts/rgb/000001.png")).expect("removed");
    let again = folder.good("sequence scene.toml poses.csv -o parts --seed 3 --resume --json");
    assert!(again.stdout.contains("\"rendered\":1"), "{}", again.stdout);
    same("rgb/000001.png");
    // Every frame has noise of its own: poses 0 and 0 again.
    folder.write(
        "still.txt",
        "0 0 0 0 0.5 -0.5 0.5 -0.5\n1 0 0 0 0.5 -0.5 0.5 -0.5\n",
    );
    folder.good("sequence scene.toml still.txt -o still");
    assert_ne!(
        folder.read("still/rgb/000000.png"),
        folder.read("still/rgb/000001.png")
    );
    // Also where another sequence has the seed that is next to its own.
    folder.good("sequence scene.toml still.txt -o next --seed 2");
    assert_ne!(
        folder.read("next/rgb/000000.png"),
        folder.read("still/rgb/000001.png")
    );
    let words = ["seed = 3", "asked for is 4"];
    folder.refused("sequence scene.toml poses.csv -o parts --seed 4", &words);
}

#[test]
fn a_rate_makes_frames_in_between() {
    let folder = folder();
    folder.good("sequence scene.toml poses.csv -o out --rate-hz 4");
    let times: Vec<f64> = truth(&folder).into_iter().map(|pose| pose.0).collect();
    assert_eq!(times, [10.0, 10.25, 10.5, 10.75, 11.0]);
    assert!((truth(&folder)[1].1 - DVec3::new(0.25, 0.0, 0.0)).length() < 1e-9);
}

#[test]
fn what_makes_no_sequence_is_refused_before_anything_is_written() {
    let folder = folder();
    folder.write(
        "up.txt",
        "0 0 0 0 0.5 -0.5 0.5 -0.5\n1 0 0 2.5 0.5 -0.5 0.5 -0.5\n",
    );
    folder.write("early.txt", "-1 0 0 0 0.5 -0.5 0.5 -0.5\n");
    folder.write("bad.txt", "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 1\n");
    folder.write("dim.csv", DIMMED);
    std::fs::create_dir(folder.path("other")).expect("a folder");
    folder.write("other/notes.txt", "mine");
    let port = "--set camera.port={kind=\"flat\",distance_m=0.02,thickness_m=0.01}";
    for (line, words) in [
        (
            "poses.csv -o other".to_owned(),
            ["holds notes.txt", "empty"],
        ),
        ("none.csv -o out".to_owned(), ["none.csv", "cannot be read"]),
        ("bad.txt -o out".to_owned(), ["bad.txt:2", "got 7 numbers"]),
        (
            "up.txt -o out".to_owned(),
            ["pose 1 (1 s): lamp left", "--fixed-lamp left"],
        ),
        (
            "poses.csv -o out --fixed-lamp top".to_owned(),
            ["no such lamp", "left, right"],
        ),
        (
            "dim.csv -o out --fixed-lamp left,right".to_owned(),
            ["level_pct", "no lamp that moves along"],
        ),
        (
            "poses.csv -o out --denoise --spp 3".to_owned(),
            ["even", "got 3"],
        ),
        (
            "poses.csv -o out --resume".to_owned(),
            ["nothing to resume", "sequence.json"],
        ),
        (
            "poses.csv -o out --layers colour".to_owned(),
            ["--layers", "colour"],
        ),
        ("poses.csv -o out --stereo 0".to_owned(), ["--stereo", "0"]),
        (
            "early.txt -o out --format mcap".to_owned(),
            ["from 0 to", "got -1"],
        ),
        (
            format!("poses.csv -o out --format colmap {port}"),
            ["no model for a port", "--format tum"],
        ),
    ] {
        folder.refused(&format!("sequence scene.toml {line}"), &words);
    }
    assert!(!Path::new(&folder.path("out")).exists());
}
