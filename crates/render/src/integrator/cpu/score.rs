//! Where the light of a path is counted.

/// Where light comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Sun, sky and emitting surfaces.
    Ambient,
    /// A lamp by index.
    Lamp(usize),
}

/// What happened to the light on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// It reached a surface and the camera without scattering in the water.
    Direct,
    /// It met no surface.
    Backscatter,
    /// Anything else: forward-scattered light of the target.
    Blurred,
}

impl Way {
    /// The way of light that met a surface or not and scattered or not.
    #[inline]
    pub fn of(met_surface: bool, scattered: bool) -> Self {
        match (met_surface, scattered) {
            (false, true) => Self::Backscatter,
            (_, false) => Self::Direct,
            (true, true) => Self::Blurred,
        }
    }
}

/// Radiance found by the paths of one sample, W/(m² sr) per channel.
#[derive(Clone, Debug, Default)]
pub struct Scores {
    /// Sun, sky and emission.
    pub ambient: [f64; 3],
    /// Each lamp at 100 %.
    pub lamps: Vec<[f64; 3]>,
    /// Unscattered light of all sources at their levels.
    pub direct: [f64; 3],
    /// Light of all sources at their levels that met no surface.
    pub backscatter: [f64; 3],
    levels: Vec<f64>,
}

impl Scores {
    /// Empty scores for lamps at `levels` (fractions).
    pub fn new(levels: Vec<f64>) -> Self {
        Self {
            lamps: vec![[0.0; 3]; levels.len()],
            levels,
            ..Self::default()
        }
    }

    /// Sets everything to zero.
    pub fn clear(&mut self) {
        self.ambient = [0.0; 3];
        self.direct = [0.0; 3];
        self.backscatter = [0.0; 3];
        self.lamps.fill([0.0; 3]);
    }

    /// Multiplies everything.
    pub fn scale(&mut self, factor: f64) {
        for light in [&mut self.ambient, &mut self.direct, &mut self.backscatter] {
            *light = light.map(|x| factor * x);
        }
        for light in &mut self.lamps {
            *light = light.map(|x| factor * x);
        }
    }

    /// Adds all of `other`, which holds as many lamps.
    pub fn merge(&mut self, other: &Self) {
        self.add_share(other, [1.0; 3]);
        for (sum, lamp) in self.lamps.iter_mut().zip(&other.lamps) {
            add(sum, *lamp, 1.0);
        }
    }

    /// Adds what `other` holds but its lamps, times a factor per channel.
    pub fn add_share(&mut self, other: &Self, share: [f64; 3]) {
        for k in 0..3 {
            self.ambient[k] += share[k] * other.ambient[k];
            self.direct[k] += share[k] * other.direct[k];
            self.backscatter[k] += share[k] * other.backscatter[k];
        }
    }

    /// Adds radiance.
    #[inline]
    pub fn add(&mut self, source: Source, way: Way, radiance: [f64; 3]) {
        let (sum, level) = match source {
            Source::Ambient => (&mut self.ambient, 1.0),
            Source::Lamp(i) => (&mut self.lamps[i], self.levels[i]),
        };
        add(sum, radiance, 1.0);
        match way {
            Way::Direct => add(&mut self.direct, radiance, level),
            Way::Backscatter => add(&mut self.backscatter, radiance, level),
            Way::Blurred => {}
        }
    }

    /// All sources at their levels.
    pub fn total(&self) -> [f64; 3] {
        let mut total = self.ambient;
        for (lamp, &level) in self.lamps.iter().zip(&self.levels) {
            add(&mut total, *lamp, level);
        }
        total
    }
}

#[inline]
fn add(sum: &mut [f64; 3], radiance: [f64; 3], factor: f64) {
    for k in 0..3 {
        sum[k] += factor * radiance[k];
    }
}
