//! The renders of one group of images, and their statistics.

use std::sync::atomic::Ordering;
use std::time::Instant;

use uw_render::prepare::Prepared;
use uw_render::scene::Scene;

use super::plan::{Group, Render};
use super::rows::{self, ImageRow};
use super::{DatasetError, Workshop, pictures, store};
use uw_twin::environment::{View, scene_in};
use uw_twin::estimate::fields::{Fields, GROUPS};
use uw_twin::estimate::radiance::{Estimates, Lattice, RadianceImage, Reflection, Source};
use uw_twin::estimate::statistics::{Shot, standard_errors};
use uw_twin::estimate::target_model::{Effort, TargetModel, daylight_alone, lamps_alone};

/// A depth of the group and the model of its view.
pub(super) struct DepthView<'p> {
    pub(super) depth_m: f64,
    pub(super) model: TargetModel<'p>,
}

/// All light of a group.
pub(super) struct GroupLight {
    /// Daylight per depth.
    pub(super) daylight: Vec<Fields>,
    /// Lamps at 100 %.
    pub(super) lamps: Fields,
}

/// Makes the group's renders and the statistics of its images, unless they are there and as they were made.
pub(super) fn make(workshop: &Workshop, group: &Group) -> Result<(), DatasetError> {
    let path = group.images_path(workshop.folder);
    let table = workshop
        .watch
        .accept(&path, rows::inspect(workshop, group)?);
    let kept = !workshop.keep_images || pictures::are_kept(workshop, group)?;
    if table.is_some() && kept && !any_damaged(workshop, group)? {
        return Ok(());
    }
    let views = views(workshop, group, &workshop.config.depths_m)?;
    let light = light(workshop, group, &views, |render| render, &workshop.effort)?;
    if workshop.keep_images && !kept {
        pictures::keep(workshop, group, &views, &light)?;
    }
    let started = Instant::now();
    let mut rows = Vec::new();
    for (view, daylight) in views.iter().zip(&light.daylight) {
        rows.extend(measure(workshop, view, daylight, &light.lamps));
    }
    let text = rows::to_text(&workshop.watch.name(&path), &rows);
    uw_render::image::write_bytes(&path, text.as_bytes())?;
    workshop.times.add_statistics(started.elapsed());
    Ok(())
}

/// Whether any render of a group is there but not as it was written.
fn any_damaged(workshop: &Workshop, group: &Group) -> Result<bool, DatasetError> {
    for render in group.renders(workshop.config) {
        let path = render.path(workshop.folder);
        let found = store::inspect(&workshop.watch.name(&path), &path)?;
        if found.damage().is_some() {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Scenes and models of a group at `depths_m`.
pub(super) fn views<'w>(
    workshop: &'w Workshop,
    group: &Group,
    depths_m: &[f64],
) -> Result<Vec<DepthView<'w>>, DatasetError> {
    let started = Instant::now();
    let target = workshop.target(group.pattern)?;
    let upright = group.tilt_deg == 0.0;
    let mut views: Vec<DepthView> = Vec::new();
    let mut first: Option<Prepared> = None;
    for &depth_m in depths_m {
        let scene = group_scene(workshop, group, depth_m)?;
        let prepared = first.get_or_insert_with(|| Prepared::build(&lamps_alone(&scene)));
        let model = match views.first() {
            Some(view) => view.model.at(&scene, prepared),
            None => {
                // The walks' seed is the group's own.
                let seed = group.lamps().seed(workshop.config.seed);
                TargetModel::new(&scene, prepared, &target.pyramid, upright, seed)
            }
        };
        let model = model.map_err(|e| {
            DatasetError::Config(format!(
                "at depths_m {depth_m}, distances_m {}, tilts_deg {}: {e}",
                group.distance_m, group.tilt_deg
            ))
        })?;
        views.push(DepthView { depth_m, model });
    }
    workshop.times.add_spread(started.elapsed());
    Ok(views)
}

/// The scene of a group at a depth, with everything in it.
pub(super) fn group_scene(
    workshop: &Workshop,
    group: &Group,
    depth_m: f64,
) -> Result<Scene, DatasetError> {
    let view = View::Tilted {
        depth_m,
        distance_m: group.distance_m,
        tilt_deg: group.tilt_deg,
    };
    let (config, target) = (workshop.config, &workshop.target(group.pattern)?.target);
    let bands = config.water_bands();
    Ok(scene_in(
        &config.vehicle,
        &group.water,
        bands,
        target,
        view,
    )?)
}

/// Reads or renders the light of a group; `name` may rename its renders.
pub(super) fn light(
    workshop: &Workshop,
    group: &Group,
    views: &[DepthView],
    name: fn(Render) -> Render,
    effort: &Effort,
) -> Result<GroupLight, DatasetError> {
    let mut daylight = Vec::new();
    for view in views {
        let render = name(group.daylight(view.depth_m));
        daylight.push(daylight_at(workshop, group, view, &render, effort)?);
    }
    let render = name(group.lamps());
    let lamps = lamps(workshop, group, views, &daylight, &render, effort)?;
    Ok(GroupLight { daylight, lamps })
}

fn daylight_at(
    workshop: &Workshop,
    group: &Group,
    view: &DepthView,
    render: &Render,
    effort: &Effort,
) -> Result<Fields, DatasetError> {
    let path = render.path(workshop.folder);
    if let Some(fields) = workshop.watch.read_fields(&path)? {
        return Ok(fields);
    }
    let started = Instant::now();
    let scene = group_scene(workshop, group, view.depth_m)?;
    let prepared = Prepared::build(&daylight_alone(&scene));
    drop(scene);
    let source = view.model.daylight();
    let lattice = view.model.error_lattice();
    let reflection = Reflection::new(&source, lattice);
    let dark = dark(lattice);
    let mut enough = |fields: &Fields| {
        let ambient = RadianceImage::new(&source, fields, &reflection, Estimates::Groups);
        workshop.is_known(&ambient, &dark, &[0.0])
    };
    let fields = workshop.fields(render, effort, (&source, &prepared), &mut enough)?;
    workshop
        .times
        .add_daylight(started.elapsed(), fields.samples_per_group);
    Ok(fields)
}

fn lamps(
    workshop: &Workshop,
    group: &Group,
    views: &[DepthView],
    daylight: &[Fields],
    render: &Render,
    effort: &Effort,
) -> Result<Fields, DatasetError> {
    let path = render.path(workshop.folder);
    if let Some(fields) = workshop.watch.read_fields(&path)? {
        return Ok(fields);
    }
    let started = Instant::now();
    // The light is the same at all depths; the texture behind it is that of the middle one.
    let middle = &views[views.len() / 2];
    let scene = group_scene(workshop, group, middle.depth_m)?;
    let prepared = Prepared::build(&lamps_alone(&scene));
    drop(scene);
    let source = middle.model.lamps();
    let lattice = middle.model.error_lattice();
    let reflection = Reflection::new(&source, lattice);
    let ambients: Vec<RadianceImage> = views
        .iter()
        .zip(daylight)
        .map(|(view, fields)| {
            let source = view.model.daylight();
            let reflection = Reflection::new(&source, lattice);
            RadianceImage::new(&source, fields, &reflection, Estimates::Whole).repeated(GROUPS)
        })
        .collect();
    let mut enough = |fields: &Fields| {
        let lamps = RadianceImage::new(&source, fields, &reflection, Estimates::Groups);
        ambients
            .iter()
            .all(|ambient| workshop.is_known(ambient, &lamps, &workshop.config.light_pct))
    };
    let fields = workshop.fields(render, effort, (&source, &prepared), &mut enough)?;
    workshop
        .times
        .add_lamps(started.elapsed(), fields.samples_per_group);
    Ok(fields)
}

fn dark(lattice: Lattice) -> RadianceImage {
    let black = vec![[0.0; 3]; lattice.columns() * lattice.rows()];
    RadianceImage {
        lattice,
        estimates: vec![black; GROUPS],
    }
}

/// Statistics of the images of one place at all lamp levels.
fn measure(
    workshop: &Workshop,
    view: &DepthView,
    daylight: &Fields,
    lamps: &Fields,
) -> Vec<ImageRow> {
    let (sun, lamp) = (view.model.daylight(), view.model.lamps());
    let images = |reflection: &dyn Fn(&Source) -> Reflection, kind: Estimates| {
        (
            RadianceImage::new(&sun, daylight, &reflection(&sun), kind),
            RadianceImage::new(&lamp, lamps, &reflection(&lamp), kind),
        )
    };
    let step = workshop.config.accuracy.pixel_step;
    let (fine, coarse) = (view.model.lattice(step), view.model.error_lattice());
    let fine = images(&|source| Reflection::new(source, fine), Estimates::Halves);
    let coarse = images(
        &|source| Reflection::of_groups(source, coarse),
        Estimates::Groups,
    );
    let levels = workshop.config.light_pct.iter();
    levels
        .map(|&light_pct| {
            let shot = |(ambient, lamps), exposure| Shot {
                ambient,
                lamps,
                light_pct,
                exposure,
            };
            let exposure = workshop.exposure_of(&shot((&coarse.0, &coarse.1), 1.0));
            ImageRow {
                depth_m: view.depth_m,
                light_pct,
                exposure,
                stats: shot((&fine.0, &fine.1), exposure).statistics(&workshop.response),
                errors: standard_errors(
                    &shot((&coarse.0, &coarse.1), exposure),
                    &workshop.response,
                ),
                daylight_paths: daylight.samples_per_group * GROUPS as u32,
                lamp_paths: lamps.samples_per_group * GROUPS as u32,
            }
        })
        .collect()
}

impl Workshop<'_> {
    /// The fields of a render, which are kept.
    fn fields(
        &self,
        render: &Render,
        effort: &Effort,
        (source, prepared): (&Source, &Prepared),
        enough: &mut dyn FnMut(&Fields) -> bool,
    ) -> Result<Fields, DatasetError> {
        let seed = render.seed(self.config.seed);
        let fields = effort.fields(source, prepared, seed, &|| !self.cancelled(), enough)?;
        let fields = fields.ok_or_else(|| self.stopped())?;
        self.watch
            .write_fields(&render.path(self.folder), &fields)?;
        Ok(fields)
    }

    /// Whether mean and contrast of the images at `levels` are known as well as the configuration asks.
    fn is_known(&self, ambient: &RadianceImage, lamps: &RadianceImage, levels: &[f64]) -> bool {
        let accuracy = &self.config.accuracy;
        let within = |error: f64, value: f64| {
            error <= accuracy.error_counts.max(accuracy.error_share * value)
        };
        levels.iter().all(|&light_pct| {
            let shot = |exposure| Shot {
                ambient,
                lamps,
                light_pct,
                exposure,
            };
            let shot = shot(self.exposure_of(&shot(1.0)));
            let (errors, stats) = (
                standard_errors(&shot, &self.response),
                shot.statistics(&self.response),
            );
            (0..3).all(|k| {
                within(errors.contrast[k], stats.contrast[k])
                    && within(errors.mean[k], stats.mean[k])
            })
        })
    }

    pub(super) fn cancelled(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }

    fn stopped(&self) -> DatasetError {
        if self.cancelled() {
            DatasetError::Stopped
        } else {
            DatasetError::Inconsistent("the paths of a render are too few for a fit".into())
        }
    }
}
