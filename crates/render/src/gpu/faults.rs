//! Devices that fail: every fault comes back as an error, none as a panic, a hang or a picture.

use std::{env, path::Path, sync::atomic::AtomicBool};

use super::{AdapterChoice, Gpu, GpuError, adapters, render};
use crate::{
    integrator::{Plan, RenderError},
    prepare::Prepared,
    scene::Scene,
};

/// Says that a test is skipped without an adapter, which `UW_REQUIRE_GPU=1` does not allow.
#[expect(clippy::print_stdout, reason = "a skipped test has to say so")]
pub(super) fn adapter_is_missing(error: &GpuError) {
    assert!(
        !env::var("UW_REQUIRE_GPU").is_ok_and(|v| v == "1"),
        "UW_REQUIRE_GPU is set, but {error}"
    );
    println!("skipped: {error}");
}

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
        time_limit: None,
        target_error: None,
        seed: 1,
        threads: None,
        max_bounces: 0,
        dark_lamps: false,
    }
}

/// A device of the test's own, because it is going to be broken.
fn device() -> Option<Gpu> {
    match Gpu::open(AdapterChoice::Best) {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            adapter_is_missing(&error);
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
        adapter_is_missing(&GpuError::no_adapter());
        return;
    };
    let error = Gpu::open(AdapterChoice::Named("no such adapter")).map(|_| ());
    let text = error.map_or_else(|e| e.to_string(), |()| String::new());
    assert!(
        text.contains("no such adapter") && text.contains(&first.name),
        "{text}"
    );
}
