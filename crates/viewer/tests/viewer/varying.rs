//! Water that varies with depth and place: opened, drawn, set and saved.

use std::time::Duration;

use egui::{Modifiers, PointerButton, Pos2, Rect, pos2};
use egui_kittest::{Harness, kittest::Queryable};
use uw_media::spectral::{JerlovWater, Response, WaterBands};
use uw_media::{Iops, WaterType};
use uw_render::scene::{Layer, Scene, Snow};
use uw_viewer::app::{Tab, Viewer};
use uw_viewer::model::depth_profile::{Entry, LayerWater, MOST_ENTRIES};
use uw_viewer::model::{Cloud, Coefficients, DepthProfile, OpenScene, Settings, Water, scene_text};
use uw_viewer::worker::{Activity, Frame};

use crate::layout::{SMALL, is_whole};
use crate::panels::{click, until, viewer};
use crate::support::SCENE;

/// Numbers with a jump, and a cloud.
pub(crate) const NUMBERS: &str = "profile = [ { depth_m = 0.0, a = [0.3, 0.1, 0.05], b = [0.2, 0.2, 0.2] }, \
    { depth_m = 2.5, a = [0.3, 0.1, 0.05], b = [0.2, 0.4, 0.3] }, \
    { depth_m = 2.5, a = [0.4, 0.2, 0.1], b = [1.0, 1.1, 1.2] }, \
    { depth_m = 4, a = [0.4, 0.2, 0.1], b = [0.9, 0.9, 0.9] } ]\n\
    [[water.plume]]\ncenter_m = [1.0, 0.1, -3.1]\nsigma_m = 0.25\na = [0.1, 0.2, 0.3]\nb = [2.0, 2.5, 3.0]\n";
/// Types, one between two that are no neighbours.
pub(crate) const TYPES: &str = "profile = [ { depth_m = 0.0, jerlov = \"IB\" }, \
    { depth_m = 1.5, jerlov = { between = [\"1C\", \"7C\"], share = 0.25 } }, { depth_m = 6.0, jerlov = \"III\" } ]\n";

/// The small scene in another water.
fn text(water: &str) -> String {
    SCENE.replace("water = { jerlov = \"IB\" }\n", "") + "[water]\n" + water
}

/// The small scene in another water, opened.
pub(crate) fn opened(water: &str) -> (OpenScene, Settings) {
    OpenScene::parse(&text(water), "varying.toml".as_ref()).expect("valid")
}

/// What of layers and clouds a picture hangs on.
fn variation(scene: &Scene) -> impl PartialEq + std::fmt::Debug {
    let water = scene.water.as_ref().expect("water");
    let layer = |layer: &Layer| (layer.depth_m, layer.iops, layer.spectrum.clone());
    let plumes = water.variation.plumes.iter().map(Cloud::from);
    let spectrum = scene.spectral.as_ref().map(|s| s.water.clone());
    let layers: Vec<_> = water.variation.layers.iter().map(layer).collect();
    (water.iops, layers, plumes.collect::<Vec<_>>(), spectrum)
}

/// The window renders what the file says, and what it saves elsewhere is the same again.
#[test]
fn profiles_and_clouds_survive_the_window() {
    let (from, to) = (
        tempfile::tempdir().expect("folder"),
        tempfile::tempdir().expect("folder"),
    );
    let table = "wavelength_nm,a_per_m,b_per_m\n400,0.1,0.3\n440,0.1,0.3\n480,0.1,0.25\n520,0.1,0.2\n560,0.15,0.2\n\
        600,0.2,0.15\n640,0.3,0.1\n680,0.5,0.1\n700,0.6,0.1\n";
    std::fs::write(from.path().join("own.csv"), table).expect("written");
    let cloud = NUMBERS.split_at(NUMBERS.find("[[").expect("a cloud")).1;
    let waters = [
        NUMBERS.to_owned(),
        TYPES.to_owned(),
        format!("{TYPES}bands = \"mean\"\n"),
        "profile = [ { depth_m = 0.0, spectrum = \"own.csv\" }, { depth_m = 3.0, jerlov = \"5C\" } ]\n".to_owned(),
        "bands = \"measured\"\nprofile = [ { depth_m = 0.0, jerlov = \"IB\" }, { depth_m = 2.0, a = [0.3, 0.2, 0.1], \
         b = [0.1, 0.2, 0.3] } ]\n"
            .to_owned(),
        "profile = [ { depth_m = 2.0, jerlov = \"IB\" } ]\n".to_owned(),
        "jerlov_profile = \"3C\"\n".to_owned(),
        "jerlov_profile = \"IB\"\nbands = \"mean\"\n".to_owned(),
        format!("jerlov = \"II\"\n{cloud}"),
        format!("a = [0.3, 0.2, 0.1]\nb = [0.1, 0.2, 0.3]\n{cloud}"),
    ];
    for water in waters {
        let path = from.path().join("varying.toml");
        std::fs::write(&path, text(&water)).expect("written");
        let file = Scene::read(&path).expect("valid");
        let (open, settings) = OpenScene::read(&path).expect("valid");
        let shown = settings.scene().expect("valid");
        assert_eq!(variation(&shown), variation(&file), "{water}");
        let saved = to.path().join("saved.toml");
        scene_text::save(&open, &settings, &saved).expect("saved");
        let (_, read) = OpenScene::read(&saved).expect("valid");
        let again = Scene::read(&saved).expect("valid");
        assert_eq!(variation(&again), variation(&file), "{water}");
        if !water.contains("own.csv") {
            assert_eq!(read, settings, "{water}");
        }
    }
}

/// The profile that is set.
fn profile(settings: &Settings) -> DepthProfile {
    match settings.water.as_ref().map(|water| &water.coefficients) {
        Some(Coefficients::Profile(profile)) => profile.clone(),
        other => panic!("{other:?}"),
    }
}

/// Numbers in [0, 1) that look random.
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() * n as f64) as usize
    }
}

/// One change of a profile, sensible or not.
fn change(profile: &mut DepthProfile, draws: &mut Draws) {
    let at = draws.below(profile.entries().len());
    let value = [-1.0, 0.0, 3.0, 1e9, f64::NAN, f64::INFINITY][draws.below(6)];
    let iops = Iops {
        a: [draws.next(), value, 0.1],
        b: [0.2, draws.next(), value],
    };
    let water_type = WaterType::ALL[draws.below(10)];
    let bands = [
        "spectral",
        "spectral-measured",
        "mean",
        "measured",
        "camera:imx219",
    ];
    match draws.below(12) {
        0 => profile.set_depth(at, 8.0 * draws.next() - 1.0),
        1 => profile.set_depth(at, value),
        2 => profile.set_values(at, iops),
        3 => profile.set_type(at, water_type.into()),
        4 => profile.set_type(
            at,
            JerlovWater {
                share: draws.next(),
                to: water_type,
                from: WaterType::ALL[draws.below(10)],
            },
        ),
        5 => profile.set_bands(bands[draws.below(5)].parse().expect("known")),
        6 => drop(profile.insert(9.0 * draws.next() - 1.0)),
        7 | 8 => drop(profile.insert_below(at)),
        9 => drop(profile.insert_jump(at)),
        10 if draws.below(4) == 0 => profile.to_numbers(&Response::boxes()).expect("covered"),
        10 => profile.set_direct(at, iops),
        _ => profile.remove(at),
    }
}

/// No change leads to a profile that a scene file cannot hold, and what is saved is read again.
#[test]
fn whatever_is_done_to_a_profile_a_scene_file_takes_it() {
    let (mut longest, mut jumps) = (0, 0);
    for seed in 0..8 {
        let (open, mut settings) = opened(if seed % 2 == 0 { NUMBERS } else { TYPES });
        let mut draws = Draws(seed);
        let mut own = profile(&settings);
        for _ in 0..150 {
            change(&mut own, &mut draws);
            let water = settings.water.as_mut().expect("water");
            water.coefficients = Coefficients::Profile(own.clone());
            let text = scene_text::scene_text(&open, &settings, "".as_ref());
            let read = OpenScene::parse(&text, "varying.toml".as_ref());
            let (_, read) = read.unwrap_or_else(|error| panic!("{error}\n{text}"));
            assert_eq!(read, settings, "{text}");
            longest = longest.max(own.entries().len());
            jumps += usize::from((0..own.entries().len()).any(|i| own.is_jump(i)));
        }
    }
    assert!(longest > 5 && jumps > 100, "{longest} {jumps}");
}

#[test]
fn a_profile_is_full_at_some_point_and_its_last_point_stays() {
    let (_, settings) = opened(NUMBERS);
    let mut own = profile(&settings);
    while (0..own.entries().len()).any(|at| own.insert_below(at).is_some()) {}
    assert_eq!(own.entries().len(), MOST_ENTRIES);
    assert!(!own.has_room() && own.insert_jump(0).is_none());
    for _ in 0..2 * MOST_ENTRIES {
        own.remove(0);
    }
    assert_eq!(own.entries().len(), 1);
    // Of entries that fit none or both.
    let entry = |depth_m: f64, water: LayerWater| Entry { depth_m, water };
    let numbers = || {
        LayerWater::Direct(Iops {
            a: [0.1; 3],
            b: [0.1; 3],
        })
    };
    let of_type = || LayerWater::Jerlov(WaterType::ALL[2].into());
    let new = |entries| DepthProfile::new(WaterBands::Spectral, entries);
    assert!(new(vec![]).is_none());
    assert!(new(vec![entry(2.0, numbers()), entry(1.0, numbers())]).is_none());
    assert!(new(vec![entry(1.0, numbers()), entry(2.0, of_type())]).is_none());
    assert!(new(vec![entry(1.0, of_type()), entry(1.0, of_type())]).is_some());
    assert!(new(vec![entry(1.0, of_type()); 3]).is_none());
}

#[test]
fn points_that_are_added_leave_the_water_as_it_is() {
    let (_, settings) = opened(NUMBERS);
    let mut own = profile(&settings);
    let at = own.insert(1.25).expect("room");
    let expected = Iops {
        a: [0.3, 0.1, 0.05],
        b: [0.2, 0.3, 0.25],
    };
    let LayerWater::Direct(iops) = own.entries()[at].water else {
        panic!("{own:?}")
    };
    for k in 0..3 {
        assert!((iops.a[k] - expected.a[k]).abs() < 1e-12);
        assert!((iops.b[k] - expected.b[k]).abs() < 1e-12);
    }
    // Between two pure types lies their mixture, whose channels are a straight line too.
    let types =
        "profile = [ { depth_m = 0.0, jerlov = \"IB\" }, { depth_m = 4.0, jerlov = \"5C\" } ]\n";
    let mut own = profile(&opened(types).1);
    own.insert(1.0).expect("room");
    let iops = own.iops(&Response::boxes()).expect("covered");
    let line = iops[0].towards(&iops[2], 0.25);
    for k in 0..3 {
        assert!((iops[1].b[k] - line.b[k]).abs() < 1e-12);
    }
    // The two of a jump move together.
    let mut own = profile(&settings);
    own.set_depth(1, 3.0);
    let depths: Vec<f64> = own.entries().iter().map(|entry| entry.depth_m).collect();
    assert_eq!(depths, [0.0, 3.0, 3.0, 4.0]);
}

/// A viewer of the small scene in this water.
fn showing(water: &str) -> Harness<'static, Viewer> {
    let mut harness = viewer();
    harness.state_mut().settings = opened(water).1;
    harness.run_steps(3);
    harness
}

/// The place of a point in the plot: (largest value and depth of the plot, value and depth of the point).
fn in_plot(harness: &Harness<'_, Viewer>, ends: [f64; 2], point: [f64; 2]) -> Pos2 {
    let rect: Rect = harness.get_by_label("Profile of the water").rect();
    // The plot has margins of 3 % at the sides, of 5 % above and below.
    let share = |i: usize| {
        let margin = [0.03, 0.05][i];
        ((point[i] / ends[i] + margin) / (1.0 + 2.0 * margin)) as f32
    };
    pos2(
        rect.left() + share(0) * rect.width(),
        rect.top() + share(1) * rect.height(),
    )
}

/// Presses at one place, moves in steps and lets go at another.
fn drag(harness: &mut Harness<'_, Viewer>, from: Pos2, to: Pos2) {
    harness.hover_at(from);
    harness.run_steps(2);
    harness.drag_at(from);
    harness.step();
    for share in [0.3, 0.7, 1.0] {
        harness.hover_at(from + share * (to - from));
        harness.step();
    }
    harness.drop_at(to);
    harness.run_steps(2);
}

#[test]
fn dragging_a_point_changes_depth_and_value_and_starts_the_picture_anew() {
    let mut harness = showing(NUMBERS);
    let before = (
        harness.state().settings.clone(),
        harness.state().generation(),
    );
    // A fifth beyond the largest value and the deepest point, 1.2 /m and 4 m.
    let ends = [1.44, 4.8];
    let (from, to) = ([0.9, 4.0], [0.6, 4.4]);
    let (from, to) = (in_plot(&harness, ends, from), in_plot(&harness, ends, to));
    // Changes that follow each other faster are one step of undoing.
    std::thread::sleep(Duration::from_millis(700));
    drag(&mut harness, from, to);
    let (old, new) = (profile(&before.0), profile(&harness.state().settings));
    assert_eq!(new.entries()[..3], old.entries()[..3]);
    let entry = &new.entries()[3];
    // A pixel is 0.03 m and 0.005 /m.
    assert!((entry.depth_m - 4.4).abs() < 0.06, "{entry:?}");
    let LayerWater::Direct(iops) = &entry.water else {
        panic!("{entry:?}")
    };
    assert!((iops.b[0] - 0.6).abs() < 0.02, "{iops:?}");
    assert_eq!((iops.a, iops.b[1], iops.b[2]), ([0.4, 0.2, 0.1], 0.9, 0.9));
    assert!(harness.state().generation() > before.1);
    assert_eq!(harness.state().profile_view.selected, 3);
    harness.state_mut().undo();
    assert_eq!(harness.state().settings, before.0);
}

#[test]
fn points_of_types_are_dragged_in_depth_alone() {
    let mut harness = showing(TYPES);
    let own = profile(&harness.state().settings);
    let iops = own.iops(&Response::boxes()).expect("covered");
    let most = iops.iter().flat_map(|i| i.a.into_iter().chain(i.b));
    let ends = [1.2 * most.fold(0.0, f64::max), 7.2];
    let from = in_plot(&harness, ends, [iops[2].b[2], 6.0]);
    let to = in_plot(&harness, ends, [0.5 * iops[2].b[2], 5.0]);
    drag(&mut harness, from, to);
    let moved = profile(&harness.state().settings);
    assert!((moved.entries()[2].depth_m - 5.0).abs() < 0.06);
    assert_eq!(moved.entries()[2].water, own.entries()[2].water);
    click(&mut harness, "Set numbers");
    let numbers = profile(&harness.state().settings);
    assert!(numbers.entries().iter().all(|e| e.water.is_direct()));
    assert!(
        harness
            .state()
            .settings
            .scene()
            .expect("valid")
            .spectral
            .is_none()
    );
}

#[test]
fn points_come_by_a_double_click_and_go_by_a_right_click() {
    let mut harness = showing(NUMBERS);
    let ends = [1.44, 4.8];
    let place = in_plot(&harness, ends, [1.3, 1.2]);
    harness.hover_at(place);
    harness.run_steps(2);
    // Frames of the harness are further apart than those of a window.
    let slow = |options: &mut egui::Options| options.input_options.max_double_click_delay = 2.0;
    harness.ctx.options_mut(slow);
    let press = |harness: &mut Harness<'_, Viewer>, button, at, clicks: usize| {
        for pressed in [true, false].repeat(clicks) {
            harness.event(egui::Event::PointerButton {
                pos: at,
                button,
                pressed,
                modifiers: Modifiers::NONE,
            });
        }
        harness.step();
    };
    press(&mut harness, PointerButton::Primary, place, 2);
    harness.run_steps(2);
    let added = profile(&harness.state().settings);
    assert_eq!(added.entries().len(), 5);
    assert!((added.entries()[1].depth_m - 1.2).abs() < 0.06);
    let first = in_plot(&harness, ends, [0.9, 4.0]);
    harness.hover_at(first);
    harness.run_steps(2);
    press(&mut harness, PointerButton::Secondary, first, 1);
    harness.run_steps(2);
    let left = profile(&harness.state().settings);
    assert_eq!(left.entries(), &added.entries()[..4]);
}

#[test]
fn homogeneous_water_becomes_a_profile_and_again_homogeneous() {
    let mut harness = viewer();
    let before = harness.state().settings.clone();
    click(&mut harness, "varies with depth");
    let own = profile(&harness.state().settings);
    assert_eq!(own.entries().len(), 2);
    assert_eq!(own.entries()[0].water, own.entries()[1].water);
    // Depths need a surface from which they are counted.
    click(&mut harness, "water surface");
    assert!(harness.state().settings.surface.is_some());
    click(&mut harness, "Add point");
    click(&mut harness, "Make a jump");
    let own = profile(&harness.state().settings);
    assert_eq!(own.entries().len(), 4);
    assert!(own.is_jump(1) && own.is_jump(2) && !own.is_jump(3));
    click(&mut harness, "Remove point");
    assert_eq!(profile(&harness.state().settings).entries().len(), 3);
    click(&mut harness, "varies with depth");
    assert_eq!(harness.state().settings, before);
    click(&mut harness, "water surface");
    click(&mut harness, "varies with depth");
    assert_eq!(
        harness.state().settings.water,
        before.water,
        "no profile without a surface"
    );
}

#[test]
fn a_cloud_is_added_placed_by_a_click_and_removed() {
    let mut harness = viewer();
    until(&mut harness, "a picture", Viewer::is_current);
    let clouds = |h: &Harness<'_, Viewer>| {
        let water: Option<&Water> = h.state().settings.water.as_ref();
        water.expect("water").clouds.clone()
    };
    let generation = harness.state().generation();
    click(&mut harness, "Add a cloud");
    // Half way to the wall, which is 1.5 m ahead at a depth of 3 m.
    assert_eq!(clouds(&harness).len(), 1);
    let centre = clouds(&harness)[0].centre_m;
    assert!(
        (centre - glam::dvec3(0.75, 0.0, -3.0)).length() < 1e-9,
        "{centre}"
    );
    let camera = &harness.state().settings.camera;
    let circle = clouds(&harness)[0].circle(&camera.build());
    let (middle, radius) = circle.expect("ahead");
    assert!((middle - glam::dvec2(80.0, 45.0)).length() < 1e-6);
    let expected = camera.focal_px.x * clouds(&harness)[0].sigma_m / 0.75;
    assert!((radius - expected).abs() < 1e-6, "{radius} {expected}");
    assert!(harness.state().generation() > generation);
    click(&mut harness, "Place here...");
    assert_eq!(harness.state().placed_cloud, Some(0));
    let camera = harness.state().settings.camera.clone();
    let picture = harness.get_by_label("Picture").rect();
    // Between the middle and the right edge, where the wall is.
    let at = picture.center() + egui::vec2(0.125 * picture.width(), 0.0);
    harness.hover_at(at);
    harness.run_steps(2);
    harness.drag_at(at);
    harness.step();
    harness.drop_at(at);
    harness.run_steps(2);
    let centre = clouds(&harness)[0].centre_m;
    // 60 degrees across: a quarter of the half width is tan(30°)/4 aside per metre ahead.
    let aside = -1.5 * 0.25 * 30_f64.to_radians().tan();
    assert!(
        (centre - glam::dvec3(1.5, aside, -3.0)).length() < 0.02,
        "{centre}"
    );
    assert_eq!(harness.state().placed_cloud, None);
    assert_eq!(harness.state().settings.camera, camera);
    click(&mut harness, "Remove");
    assert!(clouds(&harness).is_empty());
}

/// The routine does not know such water, and says so, whoever asks for it.
#[test]
fn guidance_is_refused_where_the_water_varies() {
    let mut harness = showing(NUMBERS);
    harness.state_mut().tab = Tab::Guidance;
    harness.run_steps(3);
    harness.get_by_label_contains("water that is the same everywhere");
    click(&mut harness, "Run the routine");
    assert!(harness.state().guidance.progress().is_none());
    let window = harness.state_mut();
    let settings = window.settings.clone();
    window.guidance.calibrate(&settings, &mut window.toasts);
    until(&mut harness, "the answer", |v| {
        v.guidance.progress().is_none()
    });
    let said = &harness.state().toasts.all().last().expect("a message").text;
    assert!(said.contains("switch off \"varies with depth\""), "{said}");
    assert!(harness.state().guidance.profile.is_none());
    // Of the same water everywhere the panel says nothing of it.
    let mut harness = viewer();
    harness.state_mut().tab = Tab::Guidance;
    harness.run_steps(3);
    let told = harness.query_by_label_contains("water that is the same everywhere");
    assert!(told.is_none());
}

#[test]
fn profiles_and_clouds_are_whole_in_a_small_window() {
    for water in [NUMBERS, TYPES] {
        let mut harness = showing(water);
        harness.set_size(SMALL);
        harness.run_steps(3);
        is_whole(&mut harness, Tab::Water);
        is_whole(&mut harness, Tab::Guidance);
    }
}

/// No label is so long that the panel grows beyond the width that it opens with and a row's margin.
#[test]
fn the_panel_is_no_wider_than_it_opens() {
    for water in [NUMBERS, TYPES] {
        let harness = showing(water);
        let edge = harness.get_by_label("Picture").rect().left();
        assert!(edge < 370.0, "{water}: {edge}");
    }
}

/// Marine snow as a scene file has it, with all that blurs it.
const SNOW: &str = "jerlov = \"3C\"\n[water.snow]\nshare = 0.4\nslope = 3.1\ndiameter_mm = [0.4, 3.7]\nper_litre = 50.0\n\
    drift_m_s = [0.01, 0.0, -0.002]\ntime_s = 2.5\nseed = 3\n";

#[test]
fn marine_snow_is_saved_as_it_was_read() {
    let camera = "camera = { aperture_mm = 4.3, focus_m = 1.2, exposure_s = 0.02, velocity_m_s = [0.3, 0.0, 0.0], ";
    let text = text(SNOW).replace("camera = { ", camera);
    let file = Scene::parse(&text, "".as_ref(), "snow.toml").expect("valid");
    let (open, settings) = OpenScene::parse(&text, "snow.toml".as_ref()).expect("valid");
    assert!(
        file.camera
            .opening
            .is_some_and(|opening| opening.focus_m == 1.2)
    );
    let built = settings.scene().expect("valid");
    assert_eq!(
        (built.snow, built.camera.opening),
        (file.snow, file.camera.opening)
    );
    let saved = scene_text::scene_text(&open, &settings, "".as_ref());
    let (_, read) = OpenScene::parse(&saved, "snow.toml".as_ref()).expect("valid");
    assert_eq!(read, settings, "{saved}");
}

#[test]
fn the_switch_brings_marine_snow_into_the_picture() {
    // A strip of the view: flakes of a whole window take a minute of processor time.
    let strip = text("jerlov = \"3C\"\n").replace("height = 90", "height = 12");
    let mut harness = viewer();
    let (_, settings) = OpenScene::parse(&strip, "strip.toml".as_ref()).expect("valid");
    harness.state_mut().settings = settings;
    harness.run_steps(3);
    let picture = |harness: &mut Harness<'_, Viewer>| {
        until(harness, "a finished picture", |v| {
            let done = |f: &Frame| f.activity == Activity::Done && f.coarseness == 1;
            v.is_current() && v.frame().is_some_and(|f| done(f))
        });
        let frame = harness.state().frame().expect("a frame");
        frame.shown.radiance.clone()
    };
    let without = picture(&mut harness);
    click(&mut harness, "marine snow");
    let snow = harness.state_mut().settings.snow.as_mut().expect("snow");
    assert_eq!(*snow, Snow::default());
    snow.share = 0.5;
    harness.run_steps(2);
    let with = picture(&mut harness);
    assert_eq!(with.len(), without.len());
    let changes = with.iter().zip(&without).map(|(x, y)| x[2] - y[2]);
    let brighter = changes.filter(|change| *change > 0.0).count();
    assert!((20..with.len() / 2).contains(&brighter), "{brighter}");
    click(&mut harness, "marine snow");
    assert_eq!(harness.state().settings.snow, None);
    assert_eq!(picture(&mut harness), without);
}
