//! The kernels on the processor: a group of lanes at a time on its vector units, in single precision, or one lane in double
//! precision.

mod rays;
mod rows;
mod surfaces;
#[cfg(test)]
mod tests;

pub(crate) use rays::RayWorker;
pub(crate) use rows::{RowBatch, RowWorker};
use surfaces::FromCamera;
pub use uw_lanes::Instructions;
use uw_lanes::{
    COUNTERS, DISPATCH_WORDS, Group, Kernel,
    scalar::{self, Lane},
    tree::Tree,
};

use crate::{
    kernels::{GpuError, Room, Selection, Tables, Tracer, layout::Dispatch, levels, switches},
    prepare::Prepared,
};

/// Samples of a lane that wait for their walks. A lane makes several pixels in a run where a batch has fewer: the longer it
/// goes on with walk after walk, the less the lanes of a group wait for each other at the end.
const QUEUED: u32 = 128;
/// Most samples that vector units make in the time of one in double precision.
const MOST_SPEED_OF_LANES: f64 = 6.0;

/// What all workers of a render share.
pub(crate) struct Shared<'a> {
    scene: &'a Prepared,
    tables: Tables,
    words: Words<'a>,
    switches: Vec<(&'static str, f64)>,
    room: Room,
    kernels: Vec<Kernel>,
    precision: Precision,
    max_events: u32,
    levels: Vec<f64>,
}

/// What samples look along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Looks {
    /// Through points of pixels.
    ThroughPixels,
    /// Along rays that are given.
    AlongRays,
}

/// How the kernels are run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Precision {
    /// In single precision on vector units.
    Single(Instructions),
    /// In double precision, one lane at a time.
    Double,
}

impl Precision {
    /// "cpu" or "cpu-simd".
    pub(crate) fn backend(self) -> &'static str {
        match self {
            Self::Single(_) => "cpu-simd",
            Self::Double => "cpu",
        }
    }

    /// The instructions of the vector units.
    pub(crate) fn adapter(self) -> Option<String> {
        match self {
            Self::Single(instructions) => Some(instructions.to_string()),
            Self::Double => None,
        }
    }

    /// Most samples that are made in the time of one in double precision.
    pub(crate) fn speed(self) -> f64 {
        match self {
            Self::Single(_) => MOST_SPEED_OF_LANES,
            Self::Double => 1.0,
        }
    }

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
    pub(crate) fn new(
        scene: &'a Prepared,
        selection: &Selection,
        precision: Precision,
        looks: Looks,
    ) -> Result<Self, GpuError> {
        let tables = Tables::build(scene, &selection.lamps, precision.tracer())?;
        let mut switches = switches(scene, &tables.scene);
        switches.push(("MANY_PIXELS", 1.0));
        switches.push(("GIVEN_RAYS", f64::from(u8::from(looks == Looks::AlongRays))));
        let lamps = (selection.has_lamps_in_water(scene)).then_some(Kernel::Lamps);
        let ambient = selection.ambient.then_some(Kernel::Ambient);
        Ok(Self {
            scene,
            switches,
            room: match precision {
                Precision::Single(_) => Room::of(scene, &tables.scene, QUEUED),
                Precision::Double => Room::of(scene, &tables.scene, QUEUED).ample(),
            },
            words: Words::new(precision, scene, &tables),
            tables,
            kernels: lamps.into_iter().chain(ambient).collect(),
            precision,
            max_events: selection.max_events,
            levels: levels(scene),
        })
    }

    fn runners(&self) -> Vec<Runner<'_>> {
        let runner = |&kernel| Runner::new(self, kernel);
        self.kernels.iter().map(runner).collect()
    }

    /// What is asked of all kernels for `batch` (its number and its samples).
    fn dispatch(&self, seed: u64, batch: (u32, u32)) -> Dispatch {
        Dispatch {
            max_events: self.max_events,
            ..Dispatch::new(seed, batch, self.precision.lanes(), self.room)
        }
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
        let sizes = (shared.room.rows(), tables.scene.film_layers, lanes * QUEUED);
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

    /// Gives it the rays of its next run: rows of four numbers, of their origin and of a direction each.
    fn set_rays(&mut self, rows: &[f64]) {
        match self {
            Self::Lanes(group) => {
                let rows: Vec<f32> = rows.iter().map(|&x| x as f32).collect();
                group.set_rays(&rows);
            }
            Self::Lane(lane) => lane.set_rays(rows),
        }
    }

    /// Makes the samples of a dispatch and adds the film to `sums`; returns what was counted.
    fn run(&mut self, dispatch: &Dispatch, sums: &mut [f64]) -> [u32; COUNTERS] {
        let first_pixel = dispatch.first_pixel;
        let dispatch: [u32; DISPATCH_WORDS] = bytemuck::cast(*dispatch);
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
