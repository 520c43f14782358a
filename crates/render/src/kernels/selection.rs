//! Which light is traced, and what that took.

use crate::prepare::Prepared;

/// Which paths a render needs.
#[derive(Clone, Debug)]
pub struct Selection {
    /// Indices of the lamps to trace.
    pub lamps: Vec<usize>,
    /// Whether to trace daylight and emission.
    pub ambient: bool,
    /// Largest number of events on a path; `u32::MAX` for no limit.
    pub max_events: u32,
}

impl Selection {
    /// Whether some of the lamps are in the water, which bridges lead to; those in the air are found on the way to daylight.
    pub(crate) fn has_lamps_in_water(&self, scene: &Prepared) -> bool {
        self.lamps.iter().any(|&i| !scene.lamps[i].in_air)
    }

    /// All light of `scene`: its lamps, with `dark_lamps` those at level 0 too, and daylight where there is any. At most
    /// `max_bounces` scatterings and reflections; 0 for no limit.
    pub fn all(scene: &Prepared, dark_lamps: bool, max_bounces: u32) -> Self {
        let shines = |i: &usize| {
            let lamp = &scene.lamps[*i];
            (dark_lamps || lamp.level > 0.0) && lamp.intensity.iter().any(|&x| x > 0.0)
        };
        Self {
            lamps: (0..scene.lamps.len()).filter(shines).collect(),
            ambient: scene.features.ambient(),
            max_events: if max_bounces == 0 {
                u32::MAX
            } else {
                max_bounces
            },
        }
    }
}

/// What was done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Work {
    /// Walks started at the camera.
    pub(crate) paths: u64,
    /// Vertices of walks and bridges.
    pub(crate) vertices: u64,
    /// Paths that were ended by a limit of the kernels.
    pub(crate) cut_paths: u64,
    /// Contributions of light that were left out because they were no finite numbers of single precision.
    pub(crate) lost_light: u64,
}

impl Work {
    /// With what a dispatch counted, in the order of its counters.
    pub(crate) fn add_counters(&mut self, counters: [u32; 6]) {
        let [_, _, cut_paths, paths, vertices, lost_light] = counters.map(u64::from);
        self.add(Self {
            paths,
            vertices,
            cut_paths,
            lost_light,
        });
    }

    /// With other work.
    pub(crate) fn add(&mut self, other: Self) {
        self.paths += other.paths;
        self.vertices += other.vertices;
        self.cut_paths += other.cut_paths;
        self.lost_light += other.lost_light;
    }
}
