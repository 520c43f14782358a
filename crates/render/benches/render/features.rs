//! What each feature costs that a scene can do without: samples per second with it and without it.

use criterion::{Criterion, Throughput};
use glam::DVec3;
use uw_render::backend::Device;
use uw_render::gpu::{AdapterChoice, Gpu};
use uw_render::scene::{Scene, SceneError, Sun, WaterSurface};

use super::gpu::{Backend, SAMPLES, bench_picture};
use super::scenes::{bench_samples, read};

/// Width and height of the pictures on the graphics adapter.
const GPU_PICTURE: (u32, u32) = (128, 72);

/// A change of the scene.
type Change = fn(&mut Scene);

/// Turbid water with a lamp, with everything that can be left out, one at a time and then all at once.
const LAMP: [(&str, &[Change]); 8] = [
    ("all", &[]),
    ("grey water", &[grey]),
    ("no scattering", &[without_scattering]),
    ("no medium", &[without_medium]),
    ("untextured", &[untextured]),
    ("two lamps", &[two_lamps]),
    ("lamp off", &[lamps_off]),
    ("grey, untextured", &[grey, untextured]),
];

/// The same under a refracting surface with sun and sky.
const DAYLIGHT: [(&str, &[Change]); 8] = [
    ("all", &[under_a_surface]),
    ("grey water", &[under_a_surface, grey]),
    (
        "surface without refraction",
        &[under_a_surface, without_refraction],
    ),
    ("no scattering", &[under_a_surface, without_scattering]),
    ("lamp off", &[under_a_surface, lamps_off]),
    ("sun off", &[under_a_surface, without_sun]),
    (
        "sun and sky off",
        &[under_a_surface, without_sun, without_sky],
    ),
    ("untextured", &[under_a_surface, untextured]),
];

/// The rates of all variants on the processor, and of whole small pictures on the graphics adapter where there is one.
pub fn bench(criterion: &mut Criterion) -> Result<(), SceneError> {
    let turbid = read("s2_turbid")?;
    let device = Gpu::open(AdapterChoice::Best).ok();
    for (light, variants) in [("lamp", LAMP), ("daylight", DAYLIGHT)] {
        let scenes = variants.map(|(variant, changes)| {
            let mut scene = turbid.clone();
            changes.iter().for_each(|change| change(&mut scene));
            (variant, scene)
        });
        let mut group = criterion.benchmark_group(format!("features/{light}"));
        for (variant, scene) in &scenes {
            bench_samples(&mut group, variant, scene, &Device::CpuSimd);
        }
        group.finish();
        let Some(device) = &device else { continue };
        let mut group = criterion.benchmark_group(format!("features/gpu/{light}"));
        group.sample_size(10);
        let pixels = GPU_PICTURE.0 * GPU_PICTURE.1;
        group.throughput(Throughput::Elements(u64::from(pixels * SAMPLES)));
        for (variant, scene) in scenes {
            let scene = at_size(scene, GPU_PICTURE);
            bench_picture(&mut group, variant, &scene, Backend::Adapter(device));
        }
        group.finish();
    }
    Ok(())
}

/// The scene with a picture of another size and the same view.
fn at_size(mut scene: Scene, (width, height): (u32, u32)) -> Scene {
    let camera = &mut scene.camera;
    let factor = f64::from(width) / f64::from(camera.width);
    camera.focal_px *= factor;
    camera.centre_px *= factor;
    (camera.width, camera.height) = (width, height);
    scene
}

fn grey(scene: &mut Scene) {
    if let Some(water) = &mut scene.water {
        water.iops.a = [water.iops.a[1]; 3];
        water.iops.b = [water.iops.b[1]; 3];
    }
}

/// The same attenuation, all of it absorption.
fn without_scattering(scene: &mut Scene) {
    if let Some(water) = &mut scene.water {
        water.iops.a = water.iops.c();
        water.iops.b = [0.0; 3];
    }
}

fn without_medium(scene: &mut Scene) {
    scene.water = None;
}

/// The mean of the texture everywhere, so that paths live as long as before.
fn untextured(scene: &mut Scene) {
    for material in &mut scene.materials {
        let Some(texture) = material.texture.take().map(|i| &scene.textures[i]) else {
            continue;
        };
        for k in 0..3 {
            let sum: f64 = texture.texels.iter().map(|t| f64::from(t[k])).sum();
            material.reflectance[k] *= sum / texture.texels.len() as f64;
        }
    }
    scene.textures.clear();
}

fn two_lamps(scene: &mut Scene) {
    if let Some(mut lamp) = scene.lamps.first().cloned() {
        lamp.name = "left".to_owned();
        lamp.position_m.y = -lamp.position_m.y;
        scene.lamps.push(lamp);
    }
}

fn lamps_off(scene: &mut Scene) {
    scene.lamps.iter_mut().for_each(|lamp| lamp.level_pct = 0.0);
}

fn under_a_surface(scene: &mut Scene) {
    scene.surface = Some(WaterSurface {
        height_m: 5.0,
        refractive: true,
    });
    scene.sun = Some(Sun {
        travel_direction: DVec3::new(0.5, 0.0, -0.75_f64.sqrt()),
        irradiance: [1.0; 3],
    });
    scene.sky_radiance = [0.1; 3];
}

fn without_refraction(scene: &mut Scene) {
    if let Some(surface) = &mut scene.surface {
        surface.refractive = false;
    }
}

fn without_sun(scene: &mut Scene) {
    scene.sun = None;
}

fn without_sky(scene: &mut Scene) {
    scene.sky_radiance = [0.0; 3];
}
