//! What every panel looks like, drawn by the graphics adapter and compared with stored pictures.

use egui_kittest::{Harness, SnapshotOptions, SnapshotResults, kittest::Queryable};
use uw_render::layers::RenderLayer;
use uw_viewer::app::{Options, Tab, Viewer};
use uw_viewer::model::{FalseColour, ShownLayer};
use uw_viewer::worker::{Activity, Goal};

use crate::panels::until;
use crate::support::{has_gpu, profile, recording, small};
use crate::varying::{NUMBERS, TYPES, opened};

/// A viewer whose picture is finished after one sample, so that it is always the same.
fn finished(tab: Tab, light: bool, prepare: impl FnOnce(&mut Viewer)) -> Harness<'static, Viewer> {
    let mut harness = shown(tab, light, prepare);
    until(&mut harness, "the picture", |v| {
        v.is_current() && v.frame().is_some_and(|f| f.activity == Activity::Done)
    });
    harness.run_steps(3);
    harness
}

/// The same as soon as it shows a picture, however coarse.
fn shown(tab: Tab, light: bool, prepare: impl FnOnce(&mut Viewer)) -> Harness<'static, Viewer> {
    let options = Options {
        goal: Goal {
            samples_per_pixel: 1,
            target_error: None,
        },
        ..Options::default()
    };
    let ctx = egui::Context::default();
    let mut viewer = Viewer::new(&ctx, small(), options).expect("a thread");
    viewer.tab = tab;
    prepare(&mut viewer);
    let theme = if light {
        egui::Theme::Light
    } else {
        egui::Theme::Dark
    };
    let mut harness = Harness::builder()
        .with_size([1280.0, 720.0])
        .with_theme(theme)
        .wgpu()
        .with_context_setup(uw_viewer::ui::theme::set)
        .build_ui_state(|ui, viewer: &mut Viewer| viewer.show(ui), viewer);
    harness.run_steps(3);
    until(&mut harness, "a picture", |v| {
        v.is_current() && v.frame().is_some()
    });
    harness.remove_cursor();
    harness.run_steps(3);
    harness
}

/// Compares the window without the noise of a render: panels are what these tests are about.
fn compare_panels(harness: &mut Harness<'_, Viewer>, name: &str) {
    let picture = harness.get_by_label("Picture").rect();
    harness.mask(picture);
    compare(harness, name);
}

fn compare(harness: &mut Harness<'_, Viewer>, name: &str) {
    // Speed and processor are those of the machine.
    let bottom = harness.ctx.content_rect().bottom();
    harness.mask(egui::Rect::from_min_max(
        egui::pos2(310.0, bottom - 39.0),
        egui::pos2(1272.0, bottom - 8.0),
    ));
    // Other versions of the software adapter round the edges of glyphs otherwise.
    let options = SnapshotOptions::new()
        .threshold(1.0)
        .max_failed_pixels(40_usize);
    harness.snapshot_options(name, &options);
}

#[test]
fn panels_look_as_they_did() {
    if !has_gpu() {
        return;
    }
    let mut results = SnapshotResults::new();
    for (tab, light, name) in [
        (Tab::Water, false, "water"),
        (Tab::Scene, false, "scene"),
        (Tab::Water, true, "water_light"),
    ] {
        let mut harness = shown(tab, light, |_| {});
        compare_panels(&mut harness, name);
        if name == "scene" {
            harness.get_by_label("Objects: 1").click_accesskit();
            // The header opens by and by.
            harness.run_steps(30);
            compare_panels(&mut harness, "objects");
        }
        results.extend_harness(&mut harness);
    }
}

#[test]
fn water_that_varies_looks_as_it_did() {
    if !has_gpu() {
        return;
    }
    let mut results = SnapshotResults::new();
    for (water, light, name) in [
        (NUMBERS, false, "water_profile"),
        (TYPES, true, "water_profile_light"),
    ] {
        let mut harness = shown(Tab::Water, light, |v| v.settings = opened(water).1);
        compare_panels(&mut harness, name);
        results.extend_harness(&mut harness);
    }
}

#[test]
fn advice_looks_as_it_did() {
    if !has_gpu() {
        return;
    }
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("operation.jsonl");
    std::fs::write(&path, recording(1.0)).expect("written");
    let mut harness = finished(Tab::Guidance, false, |viewer| {
        viewer.guidance.profile = Some(std::sync::Arc::new(profile()));
        viewer.guidance.open_record(&path).expect("a recording");
    });
    harness.set_size(egui::vec2(1280.0, 1150.0));
    harness.run_steps(3);
    until(&mut harness, "the larger picture", |v| {
        v.is_current() && v.frame().is_some_and(|f| f.activity == Activity::Done)
    });
    harness.run_steps(3);
    assert!(
        harness
            .state()
            .guidance
            .answer
            .as_ref()
            .is_some_and(|a| a.map.is_some())
    );
    compare_panels(&mut harness, "guidance");
}

#[test]
fn false_colours_and_help_look_as_they_did() {
    if !has_gpu() {
        return;
    }
    let mut harness = finished(Tab::Scene, false, |viewer| {
        // Depths have no noise; from here they differ over the picture.
        let camera = &mut viewer.settings.camera;
        camera.look_at(camera.position_m + glam::dvec3(1.0, 0.4, 0.1));
        viewer.display.layer = ShownLayer::Layer(RenderLayer::Depth);
        viewer.display.false_colour = FalseColour::Inferno;
        viewer.display.logarithmic = true;
    });
    compare(&mut harness, "false_colour");
    harness.state_mut().help_open = true;
    harness.run_steps(3);
    compare(&mut harness, "help");
}

/// Two pictures beside each other with marks and a pin, in a small window.
#[test]
fn what_is_looked_at_closely_looks_as_it_did() {
    if !has_gpu() {
        return;
    }
    let mut harness = finished(Tab::Inspect, false, |viewer| {
        viewer.settings.sensor.exposure = uw_render::scene::Exposure::Fixed(40.0);
        viewer.inspection.pin(glam::DVec2::new(0.2, 0.6));
        viewer.inspection.pin(glam::DVec2::new(0.95, 0.2));
        viewer.inspection.marks = true;
        viewer.keep_picture();
    });
    harness.set_size(crate::layout::SMALL);
    harness.state_mut().settings.sensor.exposure = uw_render::scene::Exposure::Fixed(4.0);
    harness.state_mut().inspection.comparison.on = true;
    harness.run_steps(3);
    until(&mut harness, "the smaller picture", |v| {
        let shows =
            |f: &uw_viewer::worker::Frame| f.activity == Activity::Done && f.shown.exposure == 4.0;
        v.is_current() && v.frame().is_some_and(|f| shows(f))
    });
    harness.run_steps(3);
    // Messages leave by themselves.
    harness.state_mut().toasts = uw_viewer::ui::toasts::Toasts::default();
    harness.run_steps(2);
    // Names tell the time of day; pins and histogram tell of the noise of one sample.
    let side = harness.get_by_role_and_label(egui::Role::ComboBox, "A");
    let mut noisy = vec![side.rect()];
    for part in [" UTC", "pixel ", "counts"] {
        let found = harness.query_all_by_label_contains(part);
        noisy.extend(found.map(|node| node.rect()));
    }
    let edge = |label: &str| harness.get_by_label(label).rect().left_bottom();
    let (top, bottom) = (edge("a channel is full"), edge("0, black"));
    let picture = harness.get_by_label("Picture").rect();
    noisy.push(egui::Rect::from_two_pos(
        top,
        egui::pos2(picture.left() - 8.0, bottom.y),
    ));
    for rect in noisy {
        harness.mask(rect);
    }
    compare_panels(&mut harness, "inspect");
}
