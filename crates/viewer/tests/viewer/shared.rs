//! Window and renderer on one device: the picture stays there, and is the one that comes through the host otherwise.

use eframe::egui_wgpu::{RenderState, RendererOptions};
use egui_kittest::wgpu::{WgpuTestRenderer, create_render_state};
use egui_kittest::{Harness, kittest::Queryable};
use uw_render::{
    backend::Backend,
    gpu::{AdapterChoice, Gpu},
    layers::RenderLayer,
};
use uw_viewer::app::{Options, Viewer};
use uw_viewer::model::{ShownLayer, snapshots::Side};
use uw_viewer::ui::toasts::Toasts;
use uw_viewer::window;
use uw_viewer::worker::{Activity, Goal, RenderDevice};

use crate::panels::until;
use crate::support::{has_gpu, small};

/// Most that a count may differ: the display transform is in f32 on the adapter and in f64 on the host.
const TOLERANCE: u8 = 1;

/// What draws a window whose device the renderer can share.
fn shareable() -> RenderState {
    let setup = window::configuration(true, None).wgpu_setup;
    create_render_state(setup, RendererOptions::PREDICTABLE)
}

/// The window's device, as the renderer's.
fn shared_device(window: &RenderState) -> Gpu {
    let device = window::renderer(Some(window), Backend::Gpu, None).expect("an adapter");
    let gpu = device.gpu().filter(|gpu| gpu.is_shared());
    gpu.expect("the window's device").clone()
}

/// A viewer that renders on `gpu` until every pixel has one sample. Small: a software adapter is slow.
fn finished(gpu: Gpu, window: RenderState) -> Harness<'static, Viewer> {
    let options = Options {
        render_device: RenderDevice {
            device: gpu.into(),
            threads: Some(1),
        },
        goal: Goal {
            samples_per_pixel: 1,
            target_error: None,
        },
        canvas: Some(window.clone()),
        ..Options::default()
    };
    let viewer = Viewer::new(&egui::Context::default(), small(), options).expect("a thread");
    let mut harness = Harness::builder()
        .with_size([560.0, 360.0])
        .renderer(WgpuTestRenderer::from_render_state(window))
        .with_context_setup(uw_viewer::ui::theme::set)
        .build_ui_state(|ui, viewer: &mut Viewer| viewer.show(ui), viewer);
    harness.run_steps(3);
    until(&mut harness, "the picture", is_done);
    harness.remove_cursor();
    harness.run_steps(3);
    harness
}

fn is_done(viewer: &Viewer) -> bool {
    viewer.is_current() && viewer.frame().is_some_and(|f| f.activity == Activity::Done)
}

fn is_on_adapter(viewer: &Viewer) -> bool {
    viewer.frame().is_some_and(|f| f.shown.image().is_none())
}

/// The window's pixels where the picture is.
fn picture(harness: &mut Harness<'_, Viewer>) -> Vec<[u8; 4]> {
    let rect = harness.get_by_label("Picture").rect().shrink(1.0);
    let window = harness.render().expect("drawn");
    let (left, top) = (rect.left().ceil() as u32, rect.top().ceil() as u32);
    let (right, bottom) = (rect.right() as u32, rect.bottom() as u32);
    let rows = (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y)));
    rows.map(|(x, y)| window.get_pixel(x, y).0).collect()
}

#[test]
fn the_picture_that_stays_on_the_adapter_is_the_one_that_is_read_back() {
    if !has_gpu() {
        return;
    }
    let state = shareable();
    let mut shared = finished(shared_device(&state), state);
    let own = Gpu::open(AdapterChoice::Best).expect("an adapter");
    let mut read_back = finished(own, shareable());
    assert!(is_on_adapter(shared.state()) && !is_on_adapter(read_back.state()));
    let samples = |h: &Harness<'_, Viewer>| h.state().frame().map(|f| f.samples);
    assert_eq!(samples(&shared), samples(&read_back));

    let (there, here) = (picture(&mut shared), picture(&mut read_back));
    assert_eq!(there.len(), here.len());
    assert!(there.len() > 10_000, "a picture of {} pixels", there.len());
    let most = there
        .iter()
        .zip(&here)
        .flat_map(|(a, b)| (0..4).map(|k| a[k].abs_diff(b[k])));
    assert!(most.max() <= Some(TOLERANCE));
    let lit = there.iter().filter(|p| p[1] > 40).count();
    assert!(4 * lit > there.len(), "{lit} pixels are lit");

    // A look that the adapter does not make goes through the host, and back.
    shared.state_mut().display.layer = ShownLayer::Layer(RenderLayer::Depth);
    until(&mut shared, "the layer", |v| !is_on_adapter(v));
    shared.state_mut().display.layer = ShownLayer::Picture;
    until(&mut shared, "the picture again", is_on_adapter);
    shared.run_steps(3);
    assert_eq!(picture(&mut shared), there);

    // The probe has radiance and counts.
    let centre = shared.get_by_label("Picture").rect().center();
    shared.hover_at(centre);
    until(&mut shared, "radiances for the probe", |v| {
        is_on_adapter(v) && v.frame().is_some_and(|f| !f.shown.radiance.is_empty())
    });
    let frame = shared.state().frame().cloned().expect("a frame");
    let text = uw_viewer::ui::picture::probe_text(&frame, glam::DVec2::splat(0.5));
    let text = text.expect("something is there");
    assert!(
        text.contains("radiance") && text.contains("counts"),
        "{text}"
    );
}

/// A picture that is kept comes through the host, and is the one that was shown, of which the zoom shows the same part.
#[test]
fn a_kept_picture_is_the_one_that_stays_on_the_adapter() {
    if !has_gpu() {
        return;
    }
    let state = shareable();
    let mut harness = finished(shared_device(&state), state);
    let place = harness.state().picture_place().expect("laid out");
    let at = glam::DVec2::new(0.3, 0.6);
    harness.state_mut().inspection.zoom.by(&place, at, 5.0);
    harness.run_steps(3);
    let live = picture(&mut harness);
    harness.state_mut().keep_picture();
    until(&mut harness, "a kept picture", |v| {
        v.inspection.snapshots.all().len() == 1
    });
    until(&mut harness, "the picture again", is_on_adapter);
    harness.state_mut().toasts = Toasts::default();
    let comparison = &mut harness.state_mut().inspection.comparison;
    (comparison.on, comparison.sides) = (true, [Side::Kept(1); 2]);
    harness.run_steps(3);
    let kept = picture(&mut harness);
    assert_eq!(live.len(), kept.len());
    let alike = live.iter().zip(&kept);
    let alike = alike.filter(|(a, b)| (0..3).all(|k| a[k].abs_diff(b[k]) <= TOLERANCE));
    // The wiper and the names of the sides lie over it.
    let share = alike.count() as f64 / live.len() as f64;
    assert!(share > 0.85, "{share}");
    let first = live[0];
    assert!(
        live.iter().any(|p| p[1].abs_diff(first[1]) > 20),
        "a plain picture"
    );
}

#[test]
fn when_the_shared_device_is_lost_the_processor_goes_on() {
    if !has_gpu() {
        return;
    }
    let state = shareable();
    let device = state.device.clone();
    let mut harness = finished(shared_device(&state), state);
    device.destroy();
    harness.state_mut().settings.sky_radiance = [0.2; 3];
    until(&mut harness, "a picture of the processor", |v| {
        is_done(v) && v.frame().is_some_and(|f| f.backend.starts_with("CPU"))
    });
    assert!(!is_on_adapter(harness.state()));
    let told = harness
        .query_all_by_label_contains("the processor renders instead")
        .count();
    assert_eq!(told, 1);
}
