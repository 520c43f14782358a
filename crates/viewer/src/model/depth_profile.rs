//! Water that varies with depth, as the panel sets it. Whatever is done to a profile, a scene file takes it.

use uw_media::spectral::{JerlovWater, Response, WaterBands, WaterSpectrum};
use uw_media::{Bands, Iops, MediaError, WaterType};
use uw_render::scene::Layer;

use super::Coefficients;
use super::water::neighbours;

/// Most entries, as in scene files.
pub const MOST_ENTRIES: usize = 64;
/// Least depth between two entries that are no jump, m.
pub const CLOSEST_M: f64 = 1e-3;
/// Largest depth that is set by hand, m.
pub const DEEPEST_M: f64 = 1e4;
/// Largest coefficient that is set by hand, 1/m; that of tables of spectra.
pub const LARGEST_PER_M: f64 = 1e4;

/// The water at some depths, with straight lines between them.
///
/// Depths do not fall, two entries at one depth are a jump, and all entries are known by wavelength or none.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthProfile {
    bands: WaterBands,
    entries: Vec<Entry>,
}

/// The water at a depth.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Depth below the surface, m, >= 0.
    pub depth_m: f64,
    /// What is there.
    pub water: LayerWater,
}

/// Where the coefficients of an entry come from.
#[derive(Clone, Debug, PartialEq)]
pub enum LayerWater {
    /// From the tables of the Jerlov types.
    Jerlov(JerlovWater),
    /// By wavelength, from a file.
    OfFile {
        /// The path, as the scene file has it.
        path: String,
        /// What it holds.
        spectrum: WaterSpectrum,
    },
    /// Set by hand, 1/m per channel.
    Direct(Iops),
}

impl LayerWater {
    /// What the water is called: a type, a mixture of types, a file, or nothing.
    pub fn name(&self) -> String {
        match self {
            Self::Jerlov(JerlovWater {
                from, share: 0.0, ..
            }) => from.name().to_owned(),
            Self::Jerlov(JerlovWater { from, to, share }) => {
                format!("{from}-{to}, {:.0} %", 100.0 * share)
            }
            Self::OfFile { path, .. } => path.clone(),
            Self::Direct(_) => String::new(),
        }
    }

    /// Whether its values can be set.
    pub fn is_direct(&self) -> bool {
        matches!(self, Self::Direct(_))
    }

    fn of(coefficients: &Coefficients) -> Self {
        match coefficients {
            Coefficients::Jerlov { scale, .. } => Self::Jerlov(pure(neighbours(*scale))),
            Coefficients::OfFile { path, spectrum } => Self::OfFile {
                path: path.clone(),
                spectrum: spectrum.clone(),
            },
            Coefficients::Direct(iops) => Self::Direct(*iops),
            Coefficients::Profile(profile) => profile.entries[0].water.clone(),
        }
    }
}

/// Coefficients within what can be set by hand; `None` for what are no numbers.
fn settable(iops: Iops) -> Option<Iops> {
    let held = |values: [f64; 3]| {
        let finite = values.into_iter().all(f64::is_finite);
        finite.then(|| values.map(|x| x.clamp(0.0, LARGEST_PER_M)))
    };
    Some(Iops {
        a: held(iops.a)?,
        b: held(iops.b)?,
    })
}

/// The same water, of one type alone where only one counts.
pub fn pure(water: JerlovWater) -> JerlovWater {
    match water.share {
        0.0 => water.from.into(),
        1.0 => water.to.into(),
        _ => water,
    }
}

/// Place of a water along [`WaterType::ALL`], where it is one type or between two neighbours.
pub fn place(water: &JerlovWater) -> Option<f64> {
    let index = |of| WaterType::ALL.iter().position(|&t| t == of);
    let (from, to) = (index(water.from)? as f64, index(water.to)? as f64);
    let is_between = (to - from).abs() == 1.0 || water.share == 0.0;
    is_between.then_some(from + water.share * (to - from))
}

impl DepthProfile {
    /// A profile of these entries; `None` where they make none, as depths that fall or two kinds of entries.
    pub fn new(bands: WaterBands, entries: Vec<Entry>) -> Option<Self> {
        let depths = |at: usize| entries.get(at).map(|entry| entry.depth_m);
        let are_sorted = (0..entries.len()).all(|i| {
            let before = i.checked_sub(1).and_then(depths);
            let two_before = i.checked_sub(2).and_then(depths);
            let own = entries[i].depth_m;
            own >= 0.0 && before.is_none_or(|d| d <= own) && two_before.is_none_or(|d| d < own)
        });
        let mut profile = Self { bands, entries };
        profile.settle_bands();
        let fits = (1..=MOST_ENTRIES).contains(&profile.entries.len())
            && are_sorted
            && profile.takes_bands(&profile.bands);
        fits.then_some(profile)
    }

    /// The same water at the surface and at `bottom_m`, m.
    pub fn of(coefficients: &Coefficients, bottom_m: f64) -> Self {
        let bands = match coefficients {
            Coefficients::Jerlov { bands, .. } => *bands,
            _ => WaterBands::Spectral,
        };
        let water = LayerWater::of(coefficients);
        let entries = [0.0, bottom_m.clamp(CLOSEST_M, DEEPEST_M)].map(|depth_m| Entry {
            depth_m,
            water: water.clone(),
        });
        let mut profile = Self {
            bands,
            entries: entries.into(),
        };
        profile.settle_bands();
        profile
    }

    /// Bands do not count where all entries are set by hand: they are those that types can have beside them, then.
    fn settle_bands(&mut self) {
        if self.entries.iter().all(|entry| entry.water.is_direct()) {
            self.bands = WaterBands::Three(Bands::Mean);
        }
    }

    /// How wavelengths become channels.
    pub fn bands(&self) -> &WaterBands {
        &self.bands
    }

    /// The entries, from the uppermost; at least one.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// Whether an entry shares its depth with another.
    pub fn is_jump(&self, at: usize) -> bool {
        let own = self.entries[at].depth_m;
        let others = [at.checked_sub(1), Some(at + 1)];
        let mut others = others.into_iter().flatten();
        others.any(|i| self.entries.get(i).is_some_and(|e| e.depth_m == own))
    }

    /// Whether there is room for one more entry.
    pub fn has_room(&self) -> bool {
        self.entries.len() < MOST_ENTRIES
    }

    /// First and last of the entries at the depth of one of them.
    fn pair(&self, at: usize) -> (usize, usize) {
        let own = self.entries[at].depth_m;
        let same = |i: &usize| self.entries[*i].depth_m == own;
        let first = at.checked_sub(1).filter(same).unwrap_or(at);
        let last = Some(at + 1)
            .filter(|i| *i < self.entries.len() && same(i))
            .unwrap_or(at);
        (first, last)
    }

    /// Smallest and largest depth that an entry can have between its neighbours, m.
    pub fn depth_range_m(&self, at: usize) -> (f64, f64) {
        let (first, last) = self.pair(at);
        let own = self.entries[at].depth_m;
        let above = first.checked_sub(1).map(|i| self.entries[i].depth_m);
        let below = self.entries.get(last + 1).map(|entry| entry.depth_m);
        // Neighbours of a file may be closer than those that are set here.
        let low = above.map_or(0.0, |d| (d + CLOSEST_M).min(own));
        let high = below.map_or(DEEPEST_M.max(own), |d| (d - CLOSEST_M).max(own));
        (low, high)
    }

    /// Moves an entry to a depth, m, or as near as its neighbours let it; the two of a jump go together.
    pub fn set_depth(&mut self, at: usize, depth_m: f64) {
        if !depth_m.is_finite() {
            return;
        }
        let (low, high) = self.depth_range_m(at);
        let (first, last) = self.pair(at);
        for entry in &mut self.entries[first..=last] {
            entry.depth_m = depth_m.clamp(low, high);
        }
    }

    /// Sets the coefficients of an entry, 1/m, within what can be set; not of one that has them from a type or a file.
    pub fn set_values(&mut self, at: usize, iops: Iops) {
        if let (LayerWater::Direct(own), Some(iops)) = (&mut self.entries[at].water, settable(iops))
        {
            *own = iops;
        }
    }

    /// Whether an entry can be a water of the Jerlov types.
    pub fn takes_type(&self, water: JerlovWater) -> bool {
        self.bands.iops(water, &Response::boxes()).is_ok()
    }

    /// Makes an entry a water of the Jerlov types, where the bands cover it.
    pub fn set_type(&mut self, at: usize, water: JerlovWater) {
        if self.takes_type(water) {
            self.entries[at].water = LayerWater::Jerlov(pure(water));
        }
    }

    /// Makes an entry coefficients of its own, 1/m, where light does not go by wavelength.
    pub fn set_direct(&mut self, at: usize, iops: Iops) {
        if let (false, Some(iops)) = (self.bands.is_spectral(), settable(iops)) {
            self.entries[at].water = LayerWater::Direct(iops);
            self.settle_bands();
        }
    }

    /// Whether all entries can be had with these bands.
    pub fn takes_bands(&self, bands: &WaterBands) -> bool {
        self.entries.iter().all(|entry| match &entry.water {
            LayerWater::Jerlov(water) => bands.iops(*water, &Response::boxes()).is_ok(),
            LayerWater::OfFile { .. } => bands.is_spectral(),
            LayerWater::Direct(_) => !bands.is_spectral(),
        })
    }

    /// Changes the bands, where all entries can be had with them.
    pub fn set_bands(&mut self, bands: WaterBands) {
        if self.takes_bands(&bands) {
            self.bands = bands;
            self.settle_bands();
        }
    }

    /// Puts a point at a depth, m, that leaves the water as it is, as far as its kind allows; which one it is, or `None`
    /// where there is no room.
    pub fn insert(&mut self, depth_m: f64) -> Option<usize> {
        let depth_m = depth_m.clamp(0.0, DEEPEST_M);
        let is_free = |entry: &Entry| (entry.depth_m - depth_m).abs() >= CLOSEST_M;
        if !self.has_room() || !depth_m.is_finite() || !self.entries.iter().all(is_free) {
            return None;
        }
        let at = self.entries.partition_point(|e| e.depth_m < depth_m);
        let water = self.water_at(depth_m);
        self.entries.insert(at, Entry { depth_m, water });
        Some(at)
    }

    /// Adds a point below one: half way to the next, or beyond the last.
    pub fn insert_below(&mut self, at: usize) -> Option<usize> {
        let (_, last) = self.pair(at);
        let own = self.entries[at].depth_m;
        let depth_m = match self.entries.get(last + 1) {
            Some(next) => 0.5 * (own + next.depth_m),
            None => own + (0.5 * own).max(1.0),
        };
        self.insert(depth_m)
    }

    /// Makes an entry the upper one of a jump; which one is the lower, or `None` where it is part of a jump already or there
    /// is no room.
    pub fn insert_jump(&mut self, at: usize) -> Option<usize> {
        if !self.has_room() || self.is_jump(at) {
            return None;
        }
        let same = self.entries[at].clone();
        self.entries.insert(at + 1, same);
        Some(at + 1)
    }

    /// Takes an entry away; the last one stays.
    pub fn remove(&mut self, at: usize) {
        if self.entries.len() > 1 {
            self.entries.remove(at);
            self.settle_bands();
        }
    }

    /// Makes all entries what their channels have for `response` near zero range, for values to be set by hand.
    ///
    /// # Errors
    /// Bands that the tables do not cover.
    pub fn to_numbers(&mut self, response: &Response) -> Result<(), MediaError> {
        let iops = self.iops(response)?;
        for (entry, iops) in self.entries.iter_mut().zip(iops) {
            entry.water = LayerWater::Direct(iops);
        }
        self.settle_bands();
        Ok(())
    }

    /// What is between entries at a depth, or that of the nearest where there is no mixture of the two.
    fn water_at(&self, depth_m: f64) -> LayerWater {
        let below = self.entries.partition_point(|e| e.depth_m <= depth_m);
        let upper = &self.entries[below.saturating_sub(1)];
        let lower = &self.entries[below.min(self.entries.len() - 1)];
        let length = lower.depth_m - upper.depth_m;
        if length <= 0.0 {
            return upper.water.clone();
        }
        let share = (depth_m - upper.depth_m) / length;
        match (&upper.water, &lower.water) {
            (LayerWater::Direct(x), LayerWater::Direct(y)) => {
                LayerWater::Direct(x.towards(y, share))
            }
            (LayerWater::Jerlov(x), LayerWater::Jerlov(y))
                if x.from != y.from && x.share == 0.0 && y.share == 0.0 =>
            {
                LayerWater::Jerlov(JerlovWater {
                    from: x.from,
                    to: y.from,
                    share,
                })
            }
            (x, y) => if share < 0.5 { x } else { y }.clone(),
        }
    }

    /// The water of the entry nearest to a depth, m, for water that is the same at every depth.
    pub fn nearest(&self, depth_m: f64, response: &Response) -> Coefficients {
        let off = |entry: &&Entry| (entry.depth_m - depth_m).abs();
        let nearest = self
            .entries
            .iter()
            .min_by(|x, y| off(x).total_cmp(&off(y)))
            .unwrap_or(&self.entries[0]);
        match &nearest.water {
            LayerWater::OfFile { path, spectrum } => Coefficients::OfFile {
                path: path.clone(),
                spectrum: spectrum.clone(),
            },
            LayerWater::Direct(iops) => Coefficients::Direct(*iops),
            LayerWater::Jerlov(water) => match (place(water), self.bands.iops(*water, response)) {
                (None, Ok(iops)) => Coefficients::Direct(iops),
                (scale, _) => Coefficients::Jerlov {
                    scale: scale.unwrap_or(0.0),
                    bands: self.bands,
                },
            },
        }
    }

    /// Absorption and scattering of every entry per channel, 1/m; by wavelength those near zero range for `response`.
    ///
    /// # Errors
    /// Bands that the tables do not cover.
    pub fn iops(&self, response: &Response) -> Result<Vec<Iops>, MediaError> {
        let of = |entry: &Entry| match &entry.water {
            LayerWater::Jerlov(water) => self.bands.iops(*water, response),
            LayerWater::OfFile { spectrum, .. } => Ok(spectrum.near_zero_range(response)),
            LayerWater::Direct(iops) => Ok(*iops),
        };
        self.entries.iter().map(of).collect()
    }

    /// The entries as the renderer takes them.
    ///
    /// # Errors
    /// Bands that the tables do not cover.
    pub fn layers(&self, response: &Response) -> Result<Vec<Layer>, MediaError> {
        let layer = |(entry, iops): (&Entry, Iops)| {
            Ok(Layer {
                depth_m: entry.depth_m,
                iops,
                spectrum: self.spectrum_of(entry)?,
            })
        };
        let iops = self.iops(response)?;
        self.entries.iter().zip(iops).map(layer).collect()
    }

    fn spectrum_of(&self, entry: &Entry) -> Result<Option<WaterSpectrum>, MediaError> {
        match &entry.water {
            LayerWater::Jerlov(water) => self.bands.spectrum(*water),
            LayerWater::OfFile { spectrum, .. } => Ok(Some(spectrum.clone())),
            LayerWater::Direct(_) => Ok(None),
        }
    }

    /// The spectrum that stands for all entries: their mean; `None` where they are known in three bands.
    ///
    /// # Errors
    /// Types that were not measured.
    pub fn mean_spectrum(&self) -> Result<Option<WaterSpectrum>, MediaError> {
        let mut mean: Option<WaterSpectrum> = None;
        for (i, entry) in self.entries.iter().enumerate() {
            let Some(own) = self.spectrum_of(entry)? else {
                return Ok(None);
            };
            mean = Some(match mean {
                None => own,
                Some(mean) => mean.towards(&own, 1.0 / (i + 1) as f64),
            });
        }
        Ok(mean)
    }
}
