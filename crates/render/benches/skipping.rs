//! What a scene gains by not carrying a feature that it lacks: pairs of scenes that give the same picture, one without the
//! feature and one in which it is there without effect (light of a billionth, a surface a kilometre up). Processor seconds
//! of both, rendered in alternation, on the processor and on the graphics adapter; those of an adapter only mean something
//! where it is a program.
//!
//! `cargo bench -p uw-render --bench skipping [-- WORD..]`, with words only features whose names contain one of them.

use std::{
    env,
    error::Error,
    io::{self, Write},
    path::Path,
    sync::atomic::AtomicBool,
};

use cpu_time::ProcessTime;
use glam::DVec3;
use uw_render::{
    film::Film,
    gpu::{AdapterChoice, AdapterStepper, Gpu},
    integrator::{self, Plan},
    prepare::Prepared,
    scene::{Mesh, Scene, Sun, Texture, TextureFilter, WaterSurface},
};

/// Times that each scene of a pair is rendered. The least time counts, because other work only adds.
const REPEATS: u32 = 7;
const CPU_SAMPLES: u32 = 16;
const GPU_SAMPLES: u32 = 8;
/// Size of the pictures, pixels.
const SIZE: (u32, u32) = (128, 72);
/// How far the means of a pair's pictures may be apart, relative to them: they are noisy.
const SAME: f64 = 0.1;
/// Light and water that change nothing.
const NOTHING: f64 = 1e-9;

/// A change of the scene.
type Change = fn(&mut Scene);

/// A feature, what makes the common scene of a pair, and what brings the feature in.
struct Pair {
    feature: &'static str,
    common: &'static [Change],
    with: Change,
}

const PAIRS: [Pair; 11] = [
    Pair {
        feature: "medium",
        common: &[clear_out],
        with: |s| water_of(s, |a, b| (a.map(|_| NOTHING), b)),
    },
    Pair {
        feature: "scattering",
        common: &[without_scattering],
        with: |s| water_of(s, |a, b| (a, b.map(|_| NOTHING))),
    },
    Pair {
        feature: "chromatic sampling",
        common: &[|s| water_of(s, |_, _| ([0.2; 3], [0.9, 1.0, 1.169]))],
        with: |s| water_of(s, |_, _| ([0.2; 3], [0.9, 1.0, 1.171])),
    },
    Pair {
        feature: "surface",
        common: &[],
        with: |s| under_a_surface(s, 1000.0),
    },
    Pair {
        feature: "refraction",
        common: &[daylight, |s| refractive(s, false)],
        with: |s| {
            refractive(s, true);
            index_of_one(s);
        },
    },
    Pair {
        feature: "textures",
        common: &[],
        with: plain_texture,
    },
    Pair {
        feature: "meshes",
        common: &[],
        with: mesh_behind,
    },
    Pair {
        feature: "sun",
        common: &[daylight, |s| s.sun = None],
        with: |s| s.sun = sun(NOTHING),
    },
    Pair {
        feature: "sky",
        common: &[daylight, |s| s.sky_radiance = [0.0; 3]],
        with: |s| s.sky_radiance = [NOTHING; 3],
    },
    Pair {
        feature: "lamps",
        common: &[daylight],
        with: |s| {
            s.lamps
                .iter_mut()
                .for_each(|l| l.level_pct = 100.0 * NOTHING)
        },
    },
    Pair {
        feature: "emission",
        common: &[],
        with: |s| {
            s.materials
                .iter_mut()
                .for_each(|m| m.emission = [NOTHING; 3])
        },
    },
];

fn main() -> Result<(), Box<dyn Error>> {
    let base = base()?;
    let device = Gpu::open(AdapterChoice::Best);
    let mut out = io::stdout().lock();
    writeln!(
        out,
        "feature: backend, CPU s without it, with it and without effect, ratio"
    )?;
    let words: Vec<String> = env::args()
        .skip(1)
        .filter(|a| !a.starts_with('-'))
        .collect();
    let is_asked = |p: &&Pair| words.is_empty() || words.iter().any(|w| p.feature.contains(&**w));
    for pair in PAIRS.iter().filter(is_asked) {
        let mut without = base.clone();
        pair.common.iter().for_each(|change| change(&mut without));
        let mut with = without.clone();
        (pair.with)(&mut with);
        let scenes = [without, with].map(|scene| Prepared::build(&scene));
        report(&mut out, pair.feature, "cpu", on_processor(&scenes)?)?;
        if let Ok(device) = &device {
            report(&mut out, pair.feature, "gpu", on_adapter(device, &scenes)?)?;
        }
    }
    Ok(())
}

fn report(out: &mut impl Write, feature: &str, backend: &str, seconds: [f64; 2]) -> io::Result<()> {
    let [without, with] = seconds;
    let ratio = with / without;
    writeln!(
        out,
        "{feature}: {backend}, {without:.3}, {with:.3}, {ratio:.2}"
    )
}

/// The least seconds of both scenes, rendered in alternation on one thread.
fn on_processor(scenes: &[Prepared; 2]) -> Result<[f64; 2], Box<dyn Error>> {
    let mut least = [f64::INFINITY; 2];
    let mut means = [[0.0; 3]; 2];
    for repeat in 0..REPEATS {
        for (i, scene) in scenes.iter().enumerate() {
            let plan = plan(CPU_SAMPLES, repeat);
            let start = ProcessTime::now();
            let (film, _) = integrator::render(scene, &plan, &AtomicBool::new(false), &|_| {})?;
            least[i] = least[i].min(start.elapsed().as_secs_f64());
            add(&mut means[i], &film);
        }
    }
    check_same(means)?;
    Ok(least)
}

/// The same on `device`, compilation left out.
fn on_adapter(device: &Gpu, scenes: &[Prepared; 2]) -> Result<[f64; 2], Box<dyn Error>> {
    let plan = plan(GPU_SAMPLES, 0);
    let mut steppers = Vec::new();
    for scene in scenes {
        steppers.push(AdapterStepper::new(device, scene, &plan)?);
    }
    let mut least = [f64::INFINITY; 2];
    // The first step compiles.
    for repeat in 0..=REPEATS {
        for (least, stepper) in least.iter_mut().zip(&mut steppers) {
            let start = ProcessTime::now();
            stepper.step(GPU_SAMPLES, &|| false)?;
            if repeat > 0 {
                *least = least.min(start.elapsed().as_secs_f64());
            }
        }
    }
    let mut means = [[0.0; 3]; 2];
    for (mean, stepper) in means.iter_mut().zip(&steppers) {
        add(mean, &stepper.film()?);
    }
    check_same(means)?;
    Ok(least)
}

fn plan(samples: u32, seed: u32) -> Plan {
    Plan {
        samples_per_pixel: Some(samples),
        threads: Some(1),
        ..Plan::new(u64::from(seed))
    }
}

fn add(mean: &mut [f64; 3], film: &Film) {
    for (sum, value) in mean.iter_mut().zip(film.mean()) {
        *sum += value;
    }
}

fn check_same(means: [[f64; 3]; 2]) -> Result<(), String> {
    let [a, b] = means;
    if (0..3).all(|k| (a[k] - b[k]).abs() <= SAME * b[k]) {
        return Ok(());
    }
    Err(format!("not the same picture: means {a:?} and {b:?}"))
}

/// Turbid water, a lamp, an untextured plate.
fn base() -> Result<Scene, Box<dyn Error>> {
    let file = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../assets/benchmarks/s2_turbid.toml"
    );
    let mut scene = Scene::read(Path::new(file))?;
    for material in &mut scene.materials {
        material.texture = None;
        material.reflectance = [0.4; 3];
    }
    scene.textures.clear();
    let camera = &mut scene.camera;
    let factor = f64::from(SIZE.0) / f64::from(camera.width);
    camera.focal_px *= factor;
    camera.centre_px *= factor;
    (camera.width, camera.height) = SIZE;
    Ok(scene)
}

fn water_of(scene: &mut Scene, change: impl Fn([f64; 3], [f64; 3]) -> ([f64; 3], [f64; 3])) {
    if let Some(water) = &mut scene.water {
        (water.iops.a, water.iops.b) = change(water.iops.a, water.iops.b);
    }
}

/// Water that does nothing, which is not prepared.
fn clear_out(scene: &mut Scene) {
    water_of(scene, |_, _| ([0.0; 3], [0.0; 3]));
}

/// The same attenuation, all of it absorption.
fn without_scattering(scene: &mut Scene) {
    water_of(scene, |a, b| {
        (std::array::from_fn(|k| a[k] + b[k]), [0.0; 3])
    });
}

fn daylight(scene: &mut Scene) {
    under_a_surface(scene, 5.0);
    scene.sun = sun(1.0);
    scene.sky_radiance = [0.1; 3];
    scene.lamps.iter_mut().for_each(|lamp| lamp.level_pct = 0.0);
}

fn under_a_surface(scene: &mut Scene, height_m: f64) {
    scene.surface = Some(WaterSurface {
        height_m,
        refractive: true,
    });
}

fn refractive(scene: &mut Scene, refractive: bool) {
    if let Some(surface) = &mut scene.surface {
        surface.refractive = refractive;
    }
}

fn index_of_one(scene: &mut Scene) {
    if let Some(water) = &mut scene.water {
        water.refractive_index = 1.0 + NOTHING;
    }
}

fn sun(irradiance: f64) -> Option<Sun> {
    Some(Sun {
        travel_direction: DVec3::new(0.5, 0.0, -0.75_f64.sqrt()),
        irradiance: [irradiance; 3],
    })
}

/// A texture of one colour, the plate's.
fn plain_texture(scene: &mut Scene) {
    scene.textures.push(Texture {
        width: 64,
        height: 64,
        texels: vec![[1.0; 3]; 64 * 64].into(),
        filter: TextureFilter::Bilinear,
    });
    scene.materials.iter_mut().for_each(|m| m.texture = Some(0));
}

/// A triangle far behind the camera.
fn mesh_behind(scene: &mut Scene) {
    let material = scene.quads.first().map_or(0, |quad| quad.material);
    scene.meshes.push(Mesh {
        positions: [(0.0, 0.0), (0.1, 0.0), (0.0, 0.1)]
            .map(|(y, z)| DVec3::new(-100.0, y, z))
            .to_vec(),
        triangles: vec![[0, 1, 2]],
        material,
        ..Mesh::default()
    });
}
