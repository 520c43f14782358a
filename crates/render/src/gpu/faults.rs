//! Devices that fail: every fault comes back as an error, none as a panic, a hang or a picture.

use std::{path::Path, sync::atomic::AtomicBool};

use super::{
    AdapterChoice, Gpu, GpuError, adapters, render, render::render_edited, skipped::skip_test,
};
use crate::{
    film::FilmLayer,
    integrator::{Plan, RenderError, RenderStats},
    prepare::Prepared,
    scene::Scene,
};

fn scene(width: u32, height: u32) -> Prepared {
    let text = format!(
        "format = \"uw-scene/1\"\n[camera]\nposition_m = [0.0, 0.0, 0.0]\nforward = [1.0, 0.0, 0.0]\nhfov_deg = 60.0\n\
         width = {width}\nheight = {height}\n[sky]\nradiance = [1.0, 1.0, 1.0]\n"
    );
    let scene = Scene::parse(&text, Path::new("."), "faults").unwrap_or_else(|e| panic!("{e}"));
    Prepared::build(&scene)
}

fn plan() -> Plan {
    Plan {
        samples_per_pixel: Some(4),
        ..Plan::new(1)
    }
}

/// A device of the test's own, because it is going to be broken.
fn device() -> Option<Gpu> {
    match Gpu::open(AdapterChoice::Best) {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            skip_test(&error);
            None
        }
    }
}

#[test]
fn a_lost_device_is_an_error() {
    let Some(gpu) = device() else { return };
    let scene = scene(64, 64);
    let go_on = AtomicBool::new(false);
    assert!(render(&gpu, &scene, &plan(), &go_on, &|_| {}).is_ok());
    // In the middle of a render, after its first rows.
    let lose = |_: &_| gpu.device.destroy();
    let result = render(&gpu, &scene, &plan(), &go_on, &lose);
    assert!(
        matches!(result, Err(RenderError::Gpu(_))),
        "{:?}",
        result.map(|r| r.1)
    );
    // And ever after.
    let result = render(&gpu, &scene, &plan(), &go_on, &|_| {});
    assert!(
        matches!(result, Err(RenderError::Gpu(_))),
        "{:?}",
        result.map(|r| r.1)
    );
}

#[test]
fn a_picture_larger_than_a_buffer_names_the_limit() {
    let Some(gpu) = device() else { return };
    // Three layers of three floats a pixel, somewhat more than fits.
    let side = (gpu.limits.max_storage_buffer_binding_size as f64 / 36.0).sqrt() as u32 + 64;
    let result = render(
        &gpu,
        &scene(side, side),
        &plan(),
        &AtomicBool::new(false),
        &|_| {},
    );
    let Err(RenderError::Gpu(error @ GpuError::Limit { .. })) = result else {
        panic!("{:?}", result.map(|r| r.1));
    };
    assert!(
        error
            .to_string()
            .contains("max_storage_buffer_binding_size"),
        "{error}"
    );
}

#[test]
fn a_fault_of_the_device_is_kept() {
    let Some(gpu) = device() else { return };
    // A buffer beyond every limit: refused, or out of memory.
    drop(gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::MAX / 2,
        usage: wgpu::BufferUsages::STORAGE,
        mapped_at_creation: false,
    }));
    assert!(gpu.check().is_err());
    let result = render(
        &gpu,
        &scene(64, 64),
        &plan(),
        &AtomicBool::new(false),
        &|_| {},
    );
    assert!(
        matches!(result, Err(RenderError::Gpu(_))),
        "{:?}",
        result.map(|r| r.1)
    );
}

#[test]
fn an_unknown_adapter_is_named_with_the_known_ones() {
    let Some(first) = adapters().into_iter().next() else {
        skip_test(&GpuError::no_adapter());
        return;
    };
    let error = Gpu::open(AdapterChoice::Named("no such adapter")).map(|_| ());
    let text = error.map_or_else(|e| e.to_string(), |()| String::new());
    assert!(
        text.contains("no such adapter") && text.contains(&first.name),
        "{text}"
    );
}

/// A picture of the sky by a kernel of whose text `from` has become `to`; its mean and its statistics.
fn render_broken(gpu: &Gpu, from: &str, to: &str) -> Result<(f64, RenderStats), RenderError> {
    let edit = |text: String| {
        assert!(text.contains(from), "{from} is no part of the kernel");
        text.replace(from, to)
    };
    let go_on = AtomicBool::new(false);
    let (film, stats) = render_edited(gpu, &scene(64, 64), &plan(), &go_on, &|_| {}, &edit)?;
    let pixels = film.layer(FilmLayer::Total);
    let mean = pixels.iter().map(|p| p[1]).sum::<f64>() / pixels.len() as f64;
    Ok((mean, stats))
}

#[test]
fn lost_samples_are_an_error() {
    let Some(gpu) = device() else { return };
    for (from, to) in [
        // Lanes that end without a word.
        (
            "work = lane_start(id.x);",
            "work = lane_start(id.x); if id.x % 7u == 3u { return; }",
        ),
        // Counts that fall short, and that never get there.
        (
            "completed[work.pixel] = made;",
            "completed[work.pixel] = min(made, 1u);",
        ),
        (
            "if made < dispatch.batch_samples {",
            "completed[work.pixel] = made - 1u; if false {",
        ),
    ] {
        let result = render_broken(&gpu, from, to).map(|r| r.1);
        let Err(RenderError::Gpu(error @ GpuError::LostSamples { made, wanted, .. })) = result
        else {
            panic!("{to}: {result:?}");
        };
        assert!(made < wanted, "{to}: {error}");
    }
}

/// Lanes whose loops are cut where a dispatch makes more than one sample: repeated with fewer, nothing is missing, and the
/// numbers are added up in the same order.
#[test]
fn lanes_that_were_cut_are_repeated() {
    let Some(gpu) = device() else { return };
    let (from, to) = ("begun += 1u;", "begun += 1u; if begun > 1u { break; }");
    let whole = render_broken(&gpu, from, from).expect("nothing is broken");
    let (mean, stats) = render_broken(&gpu, from, to).expect("comes to its end");
    assert_eq!(stats.cut_paths, 0);
    assert_eq!(stats.samples_per_pixel, 4);
    assert_eq!(mean, whole.0);
    // Where not even one sample fits, what there is counts as cut.
    let never = "if probe < 10u * (loop_probe() + 1u) ||";
    let (_, stats) =
        render_broken(&gpu, "if probe < loop_probe() ||", never).expect("comes to its end");
    assert_eq!(stats.samples_per_pixel, 4);
    assert_eq!(u64::from(stats.cut_paths), 4 * 64 * 64);
}
