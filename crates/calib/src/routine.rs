//! The pictures of a manifest become a profile, also where they are not those of the plain routine.

use std::path::Path;

use crate::calibrate::{
    CalibrateError, ContrastMeasurement, DepthMeasurement, average, relative_to_shallowest,
};
use crate::coverage::{Coverage, SAME_DEPTH_M, range};
use crate::daylight::{self, Dark};
use crate::detail::Detail;
use crate::doubts::Doubts;
use crate::levels::{Lit, contrast_at};
use crate::manifest::{Manifest, Row, RowKind};
use crate::noise::NoiseModel;
use crate::photo::exposures::OneExposure;
use crate::photo::{Opened, Treatment};
use crate::processing;
use crate::profile::{ContrastSample, Corrected, CorrectedSample, DepthSample, Profile, Source};
use crate::rig::Rig;
use crate::stats::{Measured, PatchGrid, StatsError};
use crate::vehicle::LevelCurve;

/// Lamp level of the data from which the shipped models learnt, percent: preferred among equally covered levels.
const USUAL_LIGHT_PCT: f64 = 67.0;

/// Contrast below which a picture holds neither detail nor noise, 8-bit counts.
const BLANK_COUNTS: f64 = 0.01;

/// Where K_z comes from.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Daylight {
    /// From the manifest's pictures that look up.
    #[default]
    Pictures,
    /// From measurements made elsewhere, where the manifest has no such pictures.
    Measured {
        /// Means of pictures that look up.
        depth: Vec<DepthMeasurement>,
        /// What they are, for the profile's note.
        what: String,
    },
}

/// How daylight falls with depth in pictures of the target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DaylightFit {
    /// K_d per channel, 1/m.
    pub k_d_per_m: [f64; 3],
    /// Its standard errors, 1/m; 0 where there are no more pictures than unknowns.
    pub errors_per_m: [f64; 3],
    /// Shallowest and deepest depth, m.
    pub depths_m: [f64; 2],
    /// Number of pictures.
    pub pictures: usize,
}

/// How a manifest is made into a profile.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RoutineOptions {
    /// Lamp level of K_c on, percent; `None` for the level with pictures from the most distances.
    pub light_pct: Option<f64>,
    /// What is done to the pictures before they are measured; how counts stand for light is needed, too, where contrast is derived from
    /// other levels.
    pub treatment: Treatment,
    /// Where K_z comes from.
    pub daylight: Daylight,
    /// Where the noise is taken from that is left out of the corrected contrasts.
    pub noise: NoiseModel,
    /// Light of the lamps by the level that they are set to, where it is known: the column `level_pct` needs it.
    pub levels: Option<LevelCurve>,
    /// What is known of camera and lamps, for the profile to state; where it states a size, pictures of the target have to have it.
    pub rig: Rig,
}

/// A profile, and what should be known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// The profile. Where parts of it are not measured as the plain routine does, its note begins with "approximate: ".
    pub profile: Profile,
    /// What a user should know, a sentence each.
    pub warnings: Vec<String>,
}

/// Measures the images of a manifest and makes their profile; `made_by` names the program and its version.
pub fn calibrate_manifest(path: &Path, made_by: &str) -> Result<Profile, CalibrateError> {
    Ok(from_manifest(path, made_by, &RoutineOptions::default())?.profile)
}

/// The same with choices, and with what should be known of the result.
pub fn from_manifest(
    path: &Path,
    made_by: &str,
    options: &RoutineOptions,
) -> Result<Calibration, CalibrateError> {
    let (mut manifest, coverage) = examine(path, options, options.daylight != Daylight::Pictures)?;
    let OneExposure {
        approximate,
        warnings,
        exposure: _,
        iso: _,
    } = manifest.one_exposure(options.treatment.exposure);
    let mut work = Work {
        manifest: &manifest,
        options,
        coverage: &coverage,
        warnings: coverage.warnings(),
        approximate: Vec::new(),
        size_px: None,
        doubts: Doubts::default(),
    };
    let (depth, target) = work.daylight()?;
    let (on, off, corrected) = work.contrast(&target)?;
    work.warnings.extend(work.doubts.told(path));
    work.warnings.extend(warnings);
    approximate
        .into_iter()
        .for_each(|what| work.approximately(what));
    let processing = processing::warnings_of(&manifest, &options.noise);
    work.warnings.extend(processing);
    let note = (!work.approximate.is_empty())
        .then(|| format!("{APPROXIMATE}{}", work.approximate.join("; ")));
    let source = Source {
        made_by: made_by.to_owned(),
        images: manifest.rows.len() as u64,
        note,
    };
    let rig = match (work.size_px, options.rig.size_px()) {
        (Some(size_px), None) => Rig::of_size(size_px),
        _ => options.rig,
    };
    let mut profile = Profile::new(depth, on, off, source)?.with_rig(rig);
    if let Some(corrected) = corrected {
        profile = profile.with_corrected(corrected)?;
    }
    Ok(Calibration {
        profile: match work.contrast_depth(&target) {
            Some(depths_m) => profile.with_contrast_depth(depths_m)?,
            None => profile,
        },
        warnings: work.warnings,
    })
}

/// K_d of a manifest without pictures that look up, from its pictures of the target with the lamps off; `None` where there are
/// pictures that look up.
pub fn fit_daylight(
    path: &Path,
    options: &RoutineOptions,
) -> Result<Option<DaylightFit>, CalibrateError> {
    let (mut manifest, coverage) = examine(path, options, false)?;
    if coverage.looks_up() {
        return Ok(None);
    }
    manifest.one_exposure(options.treatment.exposure);
    let mut dark = Vec::new();
    for t in manifest.rows.iter().filter_map(target) {
        if let (0.0, Some(depth_m)) = (t.light_pct, t.depth_m) {
            let light = measured(&manifest, t.row, |row| {
                linear(&open(row, options)?, options)
            })?;
            dark.push(Dark {
                depth_m,
                distance_m: t.distance_m,
                light: light.stats.mean,
            });
        }
    }
    let (k_d_per_m, errors_per_m) =
        daylight::fit(&dark).map_err(|reason| CalibrateError::Daylight {
            manifest: path.display().to_string(),
            reason,
        })?;
    let depths: Vec<f64> = dark.iter().map(|d| d.depth_m).collect();
    let (least, most) = range(&depths);
    Ok(Some(DaylightFit {
        k_d_per_m,
        errors_per_m,
        depths_m: [least, most],
        pictures: dark.len(),
    }))
}

fn open(row: &Row, options: &RoutineOptions) -> Result<Opened, StatsError> {
    options.treatment.open(&row.view())
}

fn linear(picture: &Opened, options: &RoutineOptions) -> Result<PatchGrid, StatsError> {
    picture.measure_as(|counts| options.treatment.encoding.light(counts))
}

fn measured<T>(
    manifest: &Manifest,
    row: &Row,
    measure: impl FnOnce(&Row) -> Result<T, StatsError>,
) -> Result<T, CalibrateError> {
    measure(row).map_err(|source| CalibrateError::Image {
        manifest: manifest.path.display().to_string(),
        line: row.line,
        source,
    })
}

/// Reads a manifest and looks whether its pictures, of which none is opened, can make a profile. `daylight_given` says that
/// K_z does not come from pictures.
pub fn check_manifest(
    path: &Path,
    options: &RoutineOptions,
    daylight_given: bool,
) -> Result<(), CalibrateError> {
    examine(path, options, daylight_given).map(|_| ())
}

fn examine(
    path: &Path,
    options: &RoutineOptions,
    daylight_given: bool,
) -> Result<(Manifest, Coverage), CalibrateError> {
    let manifest = Manifest::parse(path, options.levels.as_ref())?;
    let coverage = Coverage::of(&manifest.rows);
    let lacks = coverage.lacks(daylight_given);
    if !lacks.is_empty() {
        return Err(CalibrateError::Incomplete {
            manifest: path.display().to_string(),
            has: coverage.has(),
            lacks,
        });
    }
    if daylight_given && coverage.looks_up() {
        return Err(CalibrateError::Daylight {
            manifest: path.display().to_string(),
            reason: "the manifest has pictures that look up (kind depth); take them out, or leave --jerlov and --kd-per-m out"
                .into(),
        });
    }
    manifest.check_images()?;
    Ok((manifest, coverage))
}

/// Begins the note of a profile of which a part is approximate.
const APPROXIMATE: &str = "approximate: ";

impl Source {
    /// What of the profile is approximate, in words; `None` where all of it was measured as the routine does.
    pub fn approximate(&self) -> Option<&str> {
        self.note.as_deref()?.strip_prefix(APPROXIMATE)
    }
}

/// A row of kind contrast.
#[derive(Clone, Copy, Debug)]
struct Target<'a> {
    row: &'a Row,
    distance_m: f64,
    light_pct: f64,
    depth_m: Option<f64>,
}

/// K_c with the lamps on and off, and without noise.
type Contrasts = (Vec<ContrastSample>, Vec<ContrastSample>, Option<Corrected>);

struct Work<'a> {
    manifest: &'a Manifest,
    options: &'a RoutineOptions,
    coverage: &'a Coverage,
    warnings: Vec<String>,
    approximate: Vec<String>,
    /// Width and height of the pictures of the target measured so far, pixels.
    size_px: Option<[u32; 2]>,
    doubts: Doubts,
}

impl<'a> Work<'a> {
    fn approximately(&mut self, what: String) {
        self.warnings.push(what.clone());
        self.approximate.push(what);
    }

    /// Measures a picture; what is told of it goes to the warnings.
    fn measure(&mut self, row: &Row) -> Result<Measured, CalibrateError> {
        let picture = measured(self.manifest, row, |row| open(row, self.options))?;
        let place = format!("{}:{}", self.manifest.path.display(), row.line);
        let told = picture.told().iter();
        self.warnings
            .extend(told.map(|what| format!("{place}: {what}")));
        measured(self.manifest, row, |_| picture.measure(&self.options.noise))
    }

    /// Samples of K_z, and the pictures of the target that K_c is taken from.
    fn daylight(&mut self) -> Result<(Vec<DepthSample>, Vec<Target<'a>>), CalibrateError> {
        let manifest = self.manifest;
        let target: Vec<Target<'a>> = manifest.rows.iter().filter_map(target).collect();
        if let Daylight::Measured { depth, what } = &self.options.daylight {
            self.approximately(format!("K_z {what}"));
            return Ok((relative_to_shallowest(depth)?, self.of_one_depth(target)));
        }
        let mut depth = Vec::new();
        for row in &manifest.rows {
            if let RowKind::Depth { depth_m } = row.kind {
                let picture = self.measure(row)?;
                self.doubts.look_up(row, picture.detail.as_ref());
                let mean = picture.grid.stats.mean;
                depth.push(DepthMeasurement { depth_m, mean });
            }
        }
        Ok((relative_to_shallowest(&depth)?, target))
    }

    /// The pictures of the depth from which most distances were seen: K_c must not mix depths.
    fn of_one_depth(&mut self, target: Vec<Target<'a>>) -> Vec<Target<'a>> {
        let near = |t: &Target, depth_m: f64| {
            t.depth_m
                .is_none_or(|z| (z - depth_m).abs() <= SAME_DEPTH_M)
        };
        let distances = |depth_m: f64, on: bool| {
            let of = target
                .iter()
                .filter(|t| near(t, depth_m) && (t.light_pct > 0.0) == on);
            average(of.map(|t| (t.distance_m, [0.0; 3]))).len()
        };
        let covered = |depth_m: f64| distances(depth_m, true).min(distances(depth_m, false));
        let depths = target.iter().filter_map(|t| t.depth_m);
        let best = depths.max_by(|x, y| covered(*x).cmp(&covered(*y)).then(y.total_cmp(x)));
        let Some(best) = best else {
            return target;
        };
        let (here, elsewhere): (Vec<Target>, Vec<Target>) =
            target.iter().partition(|t| near(t, best));
        let lit = elsewhere.iter().filter(|t| t.light_pct > 0.0).count();
        if lit > 0 {
            self.warnings.push(format!(
                "K_c is that of {best} m depth; {lit} pictures with the lamps on from other depths are not used"
            ));
        }
        here
    }

    /// Least and most depth of the pictures of the target, m; `None` where one of them does not tell.
    fn contrast_depth(&mut self, target: &[Target]) -> Option<[f64; 2]> {
        let depths: Vec<f64> = target.iter().filter_map(|t| t.depth_m).collect();
        if depths.len() < target.len() {
            self.warnings.push(
                "the depth of the pictures of the target (kind contrast, depth_m) is not given for all: advice at other depths, \
                 where the water may be another, is not told from advice at theirs"
                    .into(),
            );
            return None;
        }
        let (least, most) = range(&depths);
        if most - least > 2.0 * SAME_DEPTH_M {
            self.warnings.push(format!(
                "the pictures of the target are from depths of {least} to {most} m: K_c mixes what the water is there; in layered \
                 water calibrate at one depth"
            ));
        }
        Some([least, most])
    }

    /// K_c at the common lamp level and with the lamps off.
    fn contrast(&mut self, target: &[Target]) -> Result<Contrasts, CalibrateError> {
        let level = self.level();
        let mut contrasts = Vec::new();
        let mut details = Vec::new();
        for t in target {
            let (contrast, detail) = self.contrast_of(t.row)?;
            details.extend(detail.map(|detail| (t, detail)));
            contrasts.push(ContrastMeasurement {
                distance_m: t.distance_m,
                light_pct: t.light_pct,
                contrast,
            });
        }
        let at = |level: f64| -> Vec<(f64, [f64; 3])> {
            let of = contrasts.iter().filter(|m| m.light_pct == level);
            average(of.map(|m| (m.distance_m, m.contrast)))
        };
        let mut on = at(level);
        let mut derived = Vec::new();
        for &distance_m in &distances(target) {
            if on.iter().all(|s| s.0 != distance_m)
                && let Some(contrast) = self.derive(level, distance_m, target)?
            {
                derived.push(distance_m);
                on.push((distance_m, contrast));
            }
        }
        if on.is_empty() {
            return Err(CalibrateError::NoLevel {
                manifest: self.manifest.path.display().to_string(),
                light_pct: level,
            });
        }
        self.tell_levels(level, &derived, &on, target);
        let samples = |values: Vec<(f64, [f64; 3])>| {
            let sample = |(distance_m, k_c)| ContrastSample { distance_m, k_c };
            values.into_iter().map(sample).collect()
        };
        let corrected = (details.len() == target.len()).then(|| {
            let at = |level: f64| {
                let of = details.iter().filter(|(t, _)| t.light_pct == level);
                corrected_samples(of.map(|(t, detail)| (t.distance_m, detail)))
            };
            Corrected {
                source: self.options.noise.source(),
                on: at(level),
                off: at(0.0),
            }
        });
        Ok((
            samples(average(on.into_iter())),
            samples(at(0.0)),
            corrected,
        ))
    }

    /// Contrast of a picture of the target, which must have the size of the others, and what of it is noise.
    fn contrast_of(&mut self, row: &Row) -> Result<([f64; 3], Option<Detail>), CalibrateError> {
        let Measured { grid, detail } = self.measure(row)?;
        // A picture that is decoded has far fewer pixels a side than this could hold.
        let size = [grid.width, grid.height].map(|side| u32::try_from(side).unwrap_or(u32::MAX));
        if let Some(vehicle) = self.options.rig.size_px()
            && vehicle != size.map(f64::from)
        {
            return Err(CalibrateError::OtherSize {
                manifest: self.manifest.path.display().to_string(),
                line: row.line,
                vehicle,
                got: size,
            });
        }
        let first = *self.size_px.get_or_insert(size);
        if first != size {
            return Err(CalibrateError::MixedSizes {
                manifest: self.manifest.path.display().to_string(),
                line: row.line,
                first,
                second: size,
            });
        }
        let contrast = grid.stats.contrast;
        let blank = contrast.iter().all(|&c| c < BLANK_COUNTS);
        if !blank {
            self.doubts.target(row, detail.as_ref());
        }
        if blank {
            self.warnings.push(format!(
                "{}:{}: the picture shows nothing, every channel is even (black, saturated or covered): K_c is 0 there",
                self.manifest.path.display(),
                row.line
            ));
        }
        Ok((contrast, detail))
    }

    /// The lamp level of K_c on: as asked for, or that with pictures from the most distances.
    fn level(&self) -> f64 {
        let usual = |level: f64| (level - USUAL_LIGHT_PCT).abs();
        let best = self.coverage.lit().max_by(|x, y| {
            let covered = x.1.len().cmp(&y.1.len());
            covered.then(usual(y.0).total_cmp(&usual(x.0)))
        });
        let best = best.map_or(USUAL_LIGHT_PCT, |l| l.0);
        self.options.light_pct.unwrap_or(best)
    }

    /// Contrast at a level from the two nearest levels at a distance, one of them with the lamps on.
    fn derive(
        &self,
        level: f64,
        distance_m: f64,
        target: &[Target],
    ) -> Result<Option<[f64; 3]>, CalibrateError> {
        let mut here: Vec<&Target> = target
            .iter()
            .filter(|t| t.distance_m == distance_m)
            .collect();
        here.sort_by(|x, y| {
            (x.light_pct - level)
                .abs()
                .total_cmp(&(y.light_pct - level).abs())
        });
        let Some(one) = here.first().copied() else {
            return Ok(None);
        };
        let same_depth = |t: &Target| match (t.depth_m, one.depth_m) {
            (Some(x), Some(y)) => (x - y).abs() <= SAME_DEPTH_M,
            _ => true,
        };
        let other = here
            .iter()
            .find(|t| t.light_pct != one.light_pct && same_depth(t));
        let Some(other) = other else {
            return Ok(None);
        };
        let lit = |t: &Target| -> Result<Lit, CalibrateError> {
            measured(self.manifest, t.row, |row| {
                let picture = open(row, self.options)?;
                Ok(Lit {
                    light_pct: t.light_pct,
                    counts: picture.measure_as(|counts| counts)?,
                    linear: linear(&picture, self.options)?,
                })
            })
        };
        let encoding = self.options.treatment.encoding;
        let contrast = contrast_at(level, &lit(one)?, &lit(other)?, encoding);
        Ok(Some(contrast))
    }

    fn tell_levels(
        &mut self,
        level: f64,
        derived: &[f64],
        on: &[(f64, [f64; 3])],
        target: &[Target],
    ) {
        if !derived.is_empty() {
            let at: Vec<String> = derived.iter().map(f64::to_string).collect();
            self.approximately(format!(
                "K_c on at {level} % was derived from pictures at other levels, in linear light, at {} m",
                at.join(", ")
            ));
        }
        let lit = target
            .iter()
            .filter(|t| t.light_pct > 0.0 && t.light_pct != level);
        let unused = lit
            .filter(|t| on.iter().all(|s| s.0 != t.distance_m))
            .count();
        if unused > 0 {
            self.warnings.push(format!(
                "{unused} pictures are at other levels than {level} % from distances without a second level (the lamps off is \
                 one) to bring them there; they are not used"
            ));
        }
    }
}

/// Corrected contrasts by distance; those of one distance are averaged.
fn corrected_samples<'a>(
    of: impl Iterator<Item = (f64, &'a Detail)> + Clone,
) -> Vec<CorrectedSample> {
    let contrasts = average(of.clone().map(|(at, detail)| (at, detail.contrast)));
    let floors = average(of.map(|(at, detail)| (at, detail.floor)));
    let both = contrasts.into_iter().zip(floors);
    both.map(|((distance_m, k_c), (_, floor))| CorrectedSample {
        distance_m,
        k_c,
        floor,
    })
    .collect()
}

fn target(row: &Row) -> Option<Target<'_>> {
    match row.kind {
        RowKind::Depth { .. } => None,
        RowKind::Contrast {
            distance_m,
            light_pct,
            depth_m,
        } => Some(Target {
            row,
            distance_m,
            light_pct,
            depth_m,
        }),
    }
}

fn distances(target: &[Target]) -> Vec<f64> {
    let all = average(target.iter().map(|t| (t.distance_m, [0.0; 3])));
    all.into_iter().map(|d| d.0).collect()
}
