//! Functions of the shaders on an adapter, over tables of inputs, against what they stand for in double precision.

mod numbers;
mod orders;
mod picture;
mod surfaces;
mod tables;

use std::{
    f64::consts::TAU,
    path::Path,
    sync::{LazyLock, Mutex},
};

use glam::DVec3;

use super::{AdapterChoice, Gpu, GpuError, pipeline::Loaded, skipped::skip_test};
use crate::{
    kernels::{Tables, Tracer, layout::Dispatch},
    prepare::Prepared,
    sampling::Rng,
    scene::Scene,
};

const SEED: u64 = 0x1234_5678_9abc;
const BATCH: u32 = 3;
const ROWS: usize = 2048;

/// The shader with the functions.
const FUNCTIONS: &str = "probe/functions";

/// Water with a surface, a disk lamp with a profile and a point lamp, two parallelograms; enough pixels for the tables.
const SCENE: &str = r#"
format = "uw-scene/1"
[water]
a = [0.45, 0.20, 0.05]
b = [0.9, 1.0, 0.1]
phase = { model = "fournier-forand", n = 1.10, backscatter_fraction = 0.0183 }
[surface]
height_m = 3.0
[camera]
position_m = [0.1, 0.2, 0.3]
forward = [1.0, 0.1, -0.1]
hfov_deg = 60.0
width = 64
height = 64
[[lamp]]
name = "disk"
position_m = [1.0, -0.3, 0.2]
forward = [-1.0, 0.1, 0.3]
intensity = [10.0, 5.0, 2.0]
half_angle_deg = 60.0
falloff = "cosine"
radius_m = 0.2
[[lamp]]
name = "point"
position_m = [0.9, 0.4, 0.7]
forward = [0.0, 0.0, -1.0]
intensity = [1.0, 1.0, 1.0]
half_angle_deg = 70.0
[[object]]
plane = { center_m = [1.5, 0.0, 0.0], normal = [-1.0, 0.2, 0.1], up = [0.0, 0.0, 1.0], size_m = [2.0, 3.0] }
reflectance = [0.2, 0.4, 0.6]
[[object]]
plane = { center_m = [0.0, 0.0, -2.0], normal = [0.0, 0.0, 1.0], up = [0.0, 1.0, 0.0], size_m = [4.0, 4.0] }
reflectance = [0.3, 0.5, 0.7]
"#;

static GPU: LazyLock<Result<Gpu, GpuError>> = LazyLock::new(|| Gpu::open(AdapterChoice::Best));
/// One probe at a time, because software adapters use all cores.
static TURN: Mutex<()> = Mutex::new(());

/// The adapter; without one the test that asks is skipped.
fn adapter() -> Option<&'static Gpu> {
    GPU.as_ref().inspect_err(|error| skip_test(error)).ok()
}

fn scene() -> Prepared {
    scene_with("")
}

/// The scene with `more` in its file.
fn scene_with(more: &str) -> Prepared {
    parsed(&format!("{SCENE}{more}"))
}

fn parsed(text: &str) -> Prepared {
    let scene = Scene::parse(text, Path::new("."), "functions").unwrap_or_else(|e| panic!("{e}"));
    Prepared::build(&scene)
}

/// How far a number may be from what is expected: `absolute + relative·|expected|`.
#[derive(Clone, Copy)]
struct Within {
    absolute: f64,
    relative: f64,
}

fn absolute(absolute: f64) -> Within {
    Within {
        absolute,
        relative: 0.0,
    }
}

fn relative(relative: f64) -> Within {
    Within {
        absolute: 1e-36,
        relative,
    }
}

/// The rows of `function` for `inputs`.
fn probe(gpu: &Gpu, scene: &Prepared, function: u32, inputs: &[[f32; 4]]) -> Vec<[f32; 4]> {
    let _turn = TURN.lock().unwrap_or_else(|e| e.into_inner());
    let lamps: Vec<usize> = (0..scene.lamps.len()).collect();
    let tables = Tables::build(scene, &lamps, Tracer::Kernels).expect("tables");
    let loaded = Loaded::new(gpu, scene, &tables, false).expect("fits");
    let pipeline = loaded.pipeline(FUNCTIONS).expect("compiles");
    gpu.queue
        .write_buffer(&loaded.scratch, 0, bytemuck::cast_slice(inputs));
    let dispatch = Dispatch {
        pixel_count: inputs.len() as u32,
        max_events: function,
        ..Dispatch::new(SEED, (BATCH, 0), loaded.lanes, loaded.room)
    };
    loaded.run(&pipeline, &dispatch).expect("runs");
    let film = loaded.read_film().expect("comes back");
    let rows = film.chunks_exact(4).take(inputs.len());
    rows.map(|r| [r[0], r[1], r[2], r[3]]).collect()
}

/// Compares `function` with `expected` on `inputs`.
fn compare(
    gpu: &Gpu,
    scene: &Prepared,
    function: u32,
    inputs: &[[f32; 4]],
    within: [Within; 4],
    expected: impl Fn([f32; 4]) -> [f64; 4],
) {
    let found = probe(gpu, scene, function, inputs);
    for (input, row) in inputs.iter().zip(found) {
        let expected = expected(*input);
        for k in 0..4 {
            let allowed = within[k].absolute + within[k].relative * expected[k].abs();
            let error = (f64::from(row[k]) - expected[k]).abs();
            assert!(
                error <= allowed,
                "{FUNCTIONS} {function}, number {k} at {input:?}: {} instead of {} (allowed {allowed})",
                row[k],
                expected[k]
            );
        }
    }
}

/// Rows of numbers in (0, 1).
fn uniform_rows(stream: u32) -> Vec<[f32; 4]> {
    let mut rng = Rng::new(1, 2, 3, stream);
    let row = |_| std::array::from_fn(|_| (rng.uniform() as f32).min(0.999_999));
    (0..ROWS).map(row).collect()
}

fn direction_of(u: impl Into<f64>, v: impl Into<f64>) -> DVec3 {
    let (u, v) = (u.into(), v.into());
    let up = 2.0 * u - 1.0;
    let across = (1.0 - up * up).max(0.0).sqrt();
    let (sin, cos) = (TAU * v).sin_cos();
    DVec3::new(across * cos, across * sin, up)
}

/// A number between 10^-`decades` and 1, evenly in its logarithm.
fn spread(u: f32, decades: f32) -> f32 {
    10f32.powf(-decades * u)
}
