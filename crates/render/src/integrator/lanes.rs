//! The kernels of the GPU backend on the processor: rows of pixels, a group of lanes at a time on its vector units, or one
//! lane in double precision.

mod surfaces;

use surfaces::FromCamera;
use uw_lanes::{
    COUNTERS, DISPATCH_WORDS, Group, Instructions, Kernel,
    scalar::{self, Lane},
    tree::Tree,
};

use super::{
    cpu::{RowBatch, Selection},
    method::Done,
};
use crate::{
    film::{BatchMean, Row},
    gpu::{
        GpuError,
        layout::Dispatch,
        pipeline::{Room, constants},
        render::levels,
        upload::{Tables, Tracer},
    },
    prepare::Prepared,
};

/// Samples of a lane that wait for their walks. A lane makes several pixels in a run where a batch has fewer: the longer it
/// goes on with walk after walk, the less the lanes of a group wait for each other at the end.
const HELD: u32 = 128;

/// What all workers of a render share.
pub(super) struct Shared<'a> {
    scene: &'a Prepared,
    tables: Tables,
    words: Words<'a>,
    switches: Vec<(&'static str, f64)>,
    room: Room,
    kernels: Vec<Kernel>,
    pub(super) precision: Precision,
    max_events: u32,
    levels: Vec<f64>,
}

/// How the kernels are run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Precision {
    /// In single precision on vector units.
    Single(Instructions),
    /// In double precision, one lane at a time.
    Double,
}

impl Precision {
    fn tracer(self) -> Tracer {
        match self {
            Self::Single(_) => Tracer::Lanes,
            Self::Double => Tracer::Prepared,
        }
    }

    /// Lanes of a group.
    fn lanes(self) -> u32 {
        match self {
            Self::Single(instructions) => instructions.lanes(),
            Self::Double => 1,
        }
    }
}

/// The record and the small tables as the kernels read them, and what they know besides.
enum Words<'a> {
    Single {
        instructions: Instructions,
        scene: Vec<u32>,
        near_rows: Vec<[u32; 4]>,
    },
    Double {
        scene: Vec<u64>,
        surfaces: FromCamera<'a>,
    },
}

impl<'a> Words<'a> {
    fn new(precision: Precision, scene: &'a Prepared, tables: &Tables) -> Self {
        match precision {
            Precision::Single(instructions) => Self::Single {
                instructions,
                scene: tables.scene_words(),
                near_rows: tables.near_rows(),
            },
            Precision::Double => Self::Double {
                scene: tables.exact_scene(),
                surfaces: FromCamera::new(scene),
            },
        }
    }
}

impl<'a> Shared<'a> {
    /// Prepares the tables of `scene` for the paths in `selection`, made in `precision`.
    ///
    /// # Errors
    /// [`GpuError::Limit`] when the scene has more triangles than indices can name.
    pub(super) fn new(
        scene: &'a Prepared,
        selection: &Selection,
        precision: Precision,
    ) -> Result<Self, GpuError> {
        let tables = Tables::build(scene, &selection.lamps, precision.tracer())?;
        let mut switches = constants(scene, &tables.scene, false);
        switches.push(("MANY_PIXELS", 1.0));
        let lamps = (!selection.lamps.is_empty()).then_some(Kernel::Lamps);
        let ambient = selection.ambient.then_some(Kernel::Ambient);
        Ok(Self {
            scene,
            switches,
            room: Room::of(scene, &tables.scene, HELD),
            words: Words::new(precision, scene, &tables),
            tables,
            kernels: lamps.into_iter().chain(ambient).collect(),
            precision,
            max_events: u32::try_from(selection.max_events).unwrap_or(u32::MAX),
            levels: levels(scene),
        })
    }
}

/// What runs a kernel.
enum Runner<'a> {
    Lanes(Group<'a>),
    Lane(Box<Lane<'a>>),
}

impl<'a> Runner<'a> {
    fn new(shared: &'a Shared<'a>, kernel: Kernel) -> Self {
        let is_on = |name: &str| shared.switches.iter().any(|s| s.0 == name && s.1 != 0.0);
        let tables = &shared.tables;
        let far_rows = tables.far_rows.as_flattened();
        let lanes = shared.precision.lanes();
        let sizes = (shared.room.rows(), tables.scene.film_layers, lanes * HELD);
        match &shared.words {
            Words::Single {
                instructions,
                scene,
                near_rows,
            } => {
                let tables = uw_lanes::Tables {
                    scene,
                    near_rows: near_rows.as_flattened(),
                    far_rows,
                    texels: &tables.texels,
                    tree: Tree {
                        nodes: &tables.wide_nodes,
                        triangles: &far_rows[4 * tables.scene.triangle_rows as usize..],
                    },
                };
                Self::Lanes(Group::new(kernel, *instructions, &tables, sizes, &is_on))
            }
            Words::Double { scene, surfaces } => {
                let tables = scalar::Tables {
                    scene,
                    near_rows: tables.exact_rows(),
                    far_rows,
                    texels: &tables.texels,
                    surfaces,
                };
                Self::Lane(Box::new(Lane::new(kernel, &tables, sizes, &is_on)))
            }
        }
    }

    /// Makes the samples of a dispatch and adds the film to `sums`; returns what was counted.
    fn run(
        &mut self,
        first_pixel: u32,
        dispatch: [u32; DISPATCH_WORDS],
        sums: &mut [f64],
    ) -> [u32; COUNTERS] {
        match self {
            Self::Lanes(group) => {
                let (film, counters) = group.run(first_pixel, dispatch);
                add(sums, film.map(f64::from));
                counters
            }
            Self::Lane(lane) => {
                let (film, counters) = lane.run(first_pixel, dispatch);
                add(sums, film);
                counters
            }
        }
    }
}

fn add(sums: &mut [f64], values: impl Iterator<Item = f64>) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += value;
    }
}

/// One worker: groups of lanes that live as long as its thread.
pub(super) struct Worker<'a> {
    shared: &'a Shared<'a>,
    runners: Vec<Runner<'a>>,
    sums: Vec<f64>,
    pub(super) done: Done,
}

impl<'a> Worker<'a> {
    pub(super) fn new(shared: &'a Shared<'a>) -> Self {
        let runner = |&kernel| Runner::new(shared, kernel);
        Self {
            shared,
            runners: shared.kernels.iter().map(runner).collect(),
            sums: Vec::new(),
            done: Done::default(),
        }
    }

    /// Adds a batch of samples to `row`. `stop` is asked before every group of pixels; where it says so the row stays as
    /// it was. Returns whether the batch was added.
    pub(super) fn add_row(&mut self, at: RowBatch, row: &mut Row, stop: &dyn Fn() -> bool) -> bool {
        let words = 3 * self.shared.tables.scene.film_layers as usize;
        let mut sums = std::mem::take(&mut self.sums);
        sums.clear();
        sums.resize(self.shared.scene.camera.width as usize * words, 0.0);
        let complete = self.sum_row(at, &mut sums, words, stop);
        if complete {
            let lamps = self.shared.scene.lamps.len();
            for (column, sums) in sums.chunks_exact(words).enumerate() {
                let mean = BatchMean::of_sums(sums, at.samples, &self.shared.levels);
                row.add(column, lamps, &mean, at.samples);
            }
            row.finish_batch(at.samples);
        }
        self.sums = sums;
        complete
    }

    /// Adds up the layers of a row, `words` sums a pixel; `false` when stopped.
    fn sum_row(
        &mut self,
        at: RowBatch,
        sums: &mut [f64],
        words: usize,
        stop: &dyn Fn() -> bool,
    ) -> bool {
        let pixels = self.shared.precision.lanes() * (HELD / at.samples).max(1);
        let mut first_pixel = at.row * self.shared.scene.camera.width;
        for sums in sums.chunks_mut(pixels as usize * words) {
            if stop() {
                return false;
            }
            let count = (sums.len() / words) as u32;
            self.run(at, first_pixel, count, sums);
            first_pixel += count;
        }
        true
    }

    /// Adds all samples of `count` pixels from `first_pixel` on to the sums of their layers.
    fn run(&mut self, at: RowBatch, first_pixel: u32, count: u32, sums: &mut [f64]) {
        let dispatch = Dispatch {
            seed_low: at.seed as u32,
            seed_high: (at.seed >> 32) as u32,
            batch: at.batch,
            batch_samples: at.samples,
            first_pixel,
            pixel_count: count,
            samples: at.samples,
            forced: 0,
            max_events: self.shared.max_events,
            slots: self.shared.room.slots,
            lanes: self.shared.precision.lanes(),
            loop_probe: 0,
            held: self.shared.room.held,
            padding_1: 0,
            padding_2: 0,
            padding_3: 0,
        };
        for runner in &mut self.runners {
            let counters = runner.run(first_pixel, bytemuck::cast(dispatch), sums);
            let [_, _, cut, paths, vertices, not_finite] = counters.map(u64::from);
            self.done.work.paths += paths;
            self.done.work.vertices += vertices;
            self.done.cut_paths += cut;
            self.done.lost_light += not_finite;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{path::Path, sync::atomic::AtomicBool, time::Instant};

    use uw_lanes::Instructions;

    use crate::{
        film::{Film, FilmLayer},
        integrator::{Plan, lanes::Precision, method::Method, render_rows},
        prepare::Prepared,
        scene::Scene,
    };

    const SCENE: &str = r#"
        format = "uw-scene/1"
        [water]
        a = [0.45, 0.20, 0.35]
        b = [0.9, 1.0, 1.1]
        phase = { model = "fournier-forand", n = 1.10, backscatter_fraction = 0.0183 }
        [camera]
        position_m = [0.0, 0.0, 0.0]
        forward = [1.0, 0.0, 0.0]
        hfov_deg = 60.0
        width = 37
        height = 11
        [surface]
        height_m = 2.0
        [sun]
        zenith_deg = 30.0
        azimuth_deg = 50.0
        irradiance = [1.0, 1.0, 1.0]
        [[lamp]]
        name = "disk"
        position_m = [0.0, -0.3, 0.0]
        forward = [1.0, 0.0, 0.0]
        intensity = [10.0, 10.0, 10.0]
        radius_m = 0.05
        [[object]]
        plane = { center_m = [1.5, 0.0, 0.0], normal = [-1.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], size_m = [2.0, 2.0] }
        reflectance = [0.2, 0.5, 0.7]
    "#;

    fn film(scene: &Prepared, instructions: Instructions) -> Film {
        let plan = Plan {
            samples_per_pixel: Some(4),
            time_limit: None,
            target_error: None,
            seed: 5,
            threads: None,
            max_bounces: 0,
            dark_lamps: false,
            share_walks: 1,
        };
        let method =
            Method::kernels(scene, &plan, Precision::Single(instructions)).expect("few triangles");
        let go_on = AtomicBool::new(false);
        let rendered = render_rows(scene, &plan, &method, Instant::now(), &go_on, &|_| {});
        rendered.unwrap_or_else(|e| panic!("{e}")).0
    }

    /// With one seed all instructions make the same decisions but for rounding, in a picture whose rows are no whole number
    /// of groups; where a number lies within the rounding of a decision, a pixel may differ.
    #[test]
    fn all_instructions_make_one_picture() {
        let scene = Scene::parse(SCENE, Path::new("."), "test").unwrap_or_else(|e| panic!("{e}"));
        let scene = Prepared::build(&scene);
        let baseline = film(&scene, Instructions::Baseline);
        let others = Instructions::ALL.into_iter().skip(1);
        for set in others.filter(|set| set.are_here()) {
            compare(&film(&scene, set), &baseline);
        }
    }

    fn compare(ours: &Film, baseline: &Film) {
        for layer in [
            FilmLayer::Ambient,
            FilmLayer::Lamp(0),
            FilmLayer::Backscatter,
        ] {
            let (ours, baseline) = (ours.layer(layer), baseline.layer(layer));
            let mean = baseline.iter().map(|p| p[1]).sum::<f64>() / baseline.len() as f64;
            assert!(mean > 0.0, "{layer:?} is black");
            let differ = |(a, b): &(&[f64; 3], &[f64; 3])| {
                (0..3).any(|k| (a[k] - b[k]).abs() > 1e-3 * b[k] + 1e-5 * mean)
            };
            let different = ours.iter().zip(&baseline).filter(differ).count();
            assert!(
                different <= 4,
                "{layer:?}: {different} of {} pixels",
                ours.len()
            );
        }
    }
}
