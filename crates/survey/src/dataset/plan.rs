//! What has to be rendered: the fewest renders of a grid, their names and seeds, and who makes them.
//!
//! An entry is a pair of images. Images at all lamp levels share one render of daylight and one of the lamps,
//! because radiance is linear in the level. Light of the lamps does not depend on depth: one render serves all.
//! Images that look up depend on the water alone.

use std::path::{Path, PathBuf};

use super::DatasetConfig;
use uw_scenery::textures::Pattern;
use uw_twin::environment::WaterBody;

/// Images of one target from one distance and tilt in one water: all depths and lamp levels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Group {
    pub(super) water: WaterBody,
    pub(super) pattern: Pattern,
    pub(super) tilt_deg: f64,
    pub(super) distance_m: f64,
}

/// An image that looks up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Upward {
    pub(super) water: WaterBody,
    pub(super) depth_m: f64,
}

/// A task: what is made in one go by one thread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Task {
    Upward(Upward),
    Group(Group),
}

/// A part of the work: number `index` (from 1) of `count`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Number of the part, from 1.
    pub index: usize,
    /// Parts in all.
    pub count: usize,
}

impl Shard {
    /// The whole work.
    pub const WHOLE: Self = Self { index: 1, count: 1 };

    /// Reads "i/n" with 1 <= i <= n.
    pub fn parse(text: &str) -> Result<Self, String> {
        let numbers = text
            .split_once('/')
            .and_then(|(i, n)| Some((i.parse::<usize>().ok()?, n.parse::<usize>().ok()?)));
        match numbers {
            Some((index, count)) if index >= 1 && index <= count => Ok(Self { index, count }),
            _ => Err(format!(
                "a shard must be i/n with 1 <= i <= n, got {text:?}"
            )),
        }
    }

    /// Whether the shard makes what is at place `index`, such as the waters of a grid.
    pub(crate) fn holds(self, index: usize) -> bool {
        index % self.count == self.index - 1
    }
}

/// Numbers of renders and images of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counts {
    /// Renders of daylight on a target.
    pub daylight: usize,
    /// Renders of lamps alone.
    pub lamps: usize,
    /// Renders that look up.
    pub upward: usize,
    /// Images of targets, over all lamp levels.
    pub images: usize,
    /// Entries of the table.
    pub entries: usize,
}

impl Counts {
    /// Of a configuration.
    pub fn of(config: &DatasetConfig) -> Self {
        let (waters, groups) = (config.waters().len(), groups(config).count());
        let depths = config.depths_m.len();
        let per_place = config.distances_m.len() * config.light_pct.len();
        let environments = groups / config.distances_m.len();
        Self {
            daylight: groups * depths,
            lamps: groups,
            upward: waters * config.calibration_depths_m.len(),
            images: groups * depths * config.light_pct.len(),
            entries: environments * depths * per_place * per_place,
        }
    }

    /// All renders.
    pub fn renders(&self) -> usize {
        self.daylight + self.lamps + self.upward
    }
}

/// All groups in the order of the table: textures, waters, tilts, distances.
pub(super) fn groups(config: &DatasetConfig) -> impl Iterator<Item = Group> {
    environments(config)
        .into_iter()
        .flat_map(|e| config.distances_m.iter().map(move |&d| e.group(d)))
}

/// Tasks of a shard, water by water.
pub(super) fn tasks(config: &DatasetConfig, shard: Shard) -> Vec<Task> {
    let mut tasks = Vec::new();
    for (index, water) in config.waters().into_iter().enumerate() {
        if !shard.holds(index) {
            continue;
        }
        let depths = config.calibration_depths_m.iter();
        tasks.extend(depths.map(|&depth_m| Task::Upward(Upward { water, depth_m })));
        tasks.extend(groups(config).filter(|g| g.water == water).map(Task::Group));
    }
    tasks
}

/// A target in a water seen at a tilt: what one profile belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Environment {
    pub(super) water: WaterBody,
    pub(super) pattern: Pattern,
    pub(super) tilt_deg: f64,
}

/// All environments in the order of the table.
pub(super) fn environments(config: &DatasetConfig) -> Vec<Environment> {
    let mut all = Vec::new();
    for pattern in config.patterns() {
        for water in config.waters() {
            for &tilt_deg in &config.tilts_deg {
                all.push(Environment {
                    water,
                    pattern,
                    tilt_deg,
                });
            }
        }
    }
    all
}

impl Environment {
    /// Name in the table and in file names.
    pub(super) fn name(&self) -> String {
        let tilt = match self.tilt_deg {
            0.0 => String::new(),
            tilt => format!("_tilt{tilt}"),
        };
        format!("{}_{}{tilt}", self.pattern.name(), self.water.name())
    }

    pub(super) fn group(&self, distance_m: f64) -> Group {
        Group {
            water: self.water,
            pattern: self.pattern,
            tilt_deg: self.tilt_deg,
            distance_m,
        }
    }
}

impl Group {
    fn stem(&self) -> String {
        let Self {
            pattern,
            tilt_deg,
            distance_m,
            ..
        } = self;
        format!("{}_tilt{tilt_deg}_d{distance_m}", pattern.name())
    }

    /// Name of the render of daylight at a depth.
    pub(super) fn daylight(&self, depth_m: f64) -> Render {
        Render::new(&self.water, &format!("{}_z{depth_m}", self.stem()))
    }

    /// Name of the render of the lamps.
    pub(super) fn lamps(&self) -> Render {
        Render::new(&self.water, &format!("{}_lamps", self.stem()))
    }

    /// All renders of the group.
    pub(super) fn renders(&self, config: &DatasetConfig) -> impl Iterator<Item = Render> {
        let daylight = config.depths_m.iter().map(|&z| self.daylight(z));
        daylight.chain([self.lamps()])
    }

    /// The file with the statistics of the group's images.
    pub(super) fn images_path(&self, folder: &Path) -> PathBuf {
        let name = format!("{}.csv", self.stem());
        folder.join("images").join(self.water.name()).join(name)
    }
}

impl Upward {
    /// Name of the render.
    pub(super) fn render(&self) -> Render {
        Render::new(&self.water, &format!("up_z{}", self.depth_m))
    }
}

/// One render, by name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Render {
    water: String,
    name: String,
}

impl Render {
    fn new(water: &WaterBody, name: &str) -> Self {
        Self {
            water: water.name(),
            name: name.to_owned(),
        }
    }

    /// The same view in a preliminary render.
    pub(super) fn pilot(self) -> Self {
        Self {
            name: format!("pilot_{}", self.name),
            ..self
        }
    }

    /// Its file.
    pub(super) fn path(&self, folder: &Path) -> PathBuf {
        let name = format!("{}.sums", self.name);
        folder.join("renders").join(&self.water).join(name)
    }

    /// Its seed: the dataset's and a hash of its name (FNV-1a), so that a render is the same in every grid that
    /// holds it.
    pub(super) fn seed(&self, dataset: u64) -> u64 {
        let text = format!("{}/{}", self.water, self.name);
        let hash = text.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
        hash ^ dataset.wrapping_mul(0x9e37_79b9_7f4a_7c15)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_of_the_paper_needs_2200_renders() {
        let counts = Counts::of(&DatasetConfig::default());
        let expected = Counts {
            daylight: 1440,
            lamps: 480,
            upward: 280,
            images: 5760,
            entries: 138_240,
        };
        assert_eq!((counts, counts.renders()), (expected, 2200));
    }

    #[test]
    fn shards_are_disjoint_and_complete() {
        let config = DatasetConfig::default();
        let whole = tasks(&config, Shard::WHOLE);
        let parts: Vec<Task> = (1..=7)
            .flat_map(|index| tasks(&config, Shard { index, count: 7 }))
            .collect();
        let upward = config.waters().len() * config.calibration_depths_m.len();
        assert_eq!(whole.len(), groups(&config).count() + upward);
        assert_eq!(parts.len(), whole.len());
        assert!(whole.iter().all(|t| parts.contains(t)));
        assert_eq!(Shard::parse("2/3"), Ok(Shard { index: 2, count: 3 }));
        for wrong in ["0/3", "4/3", "1", "a/b"] {
            assert!(Shard::parse(wrong).is_err());
        }
    }

    #[test]
    fn renders_have_names_and_seeds_of_their_own() {
        let config = DatasetConfig::default();
        let mut seeds = Vec::new();
        for group in groups(&config) {
            seeds.push(group.lamps().seed(1));
            seeds.extend(config.depths_m.iter().map(|&z| group.daylight(z).seed(1)));
        }
        let n = seeds.len();
        seeds.sort_unstable();
        seeds.dedup();
        assert_eq!((n, seeds.len()), (1920, 1920));
    }
}
