//! The images themselves, for those who want to keep them: pictures as the sensor stores them, and one file per
//! place with the radiance of each source and the depth.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use uw_render::image::{ExrImage, Layer, LayerData, Picture, write_frame};

use super::group::{DepthView, GroupLight};
use super::plan::Group;
use super::seal::{self, Found, checksum, name_in};
use super::{DatasetError, Workshop, store};
use uw_twin::environment::sensor;
use uw_twin::estimate::fields::Fields;
use uw_twin::estimate::radiance::{Estimates, RadianceImage, Reflection, Source};
use uw_twin::estimate::statistics::Shot;
use uw_twin::estimate::target_view::TargetView;

/// Name of the list of a group's pictures with their checksums, beside them.
const LIST: &str = "pictures.json";

/// What the file [`LIST`] holds.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    /// CRC-32 by file name.
    pictures: BTreeMap<String, u32>,
}

/// Whether all pictures of a group are there and as they were written.
pub(super) fn are_kept(workshop: &Workshop, group: &Group) -> Result<bool, DatasetError> {
    let folder = group.images_path(workshop.folder).with_extension("");
    let path = folder.join(LIST);
    let found = read_list(workshop.folder, &path)?;
    if found == Found::Absent {
        // An earlier version kept no list, and wrote the layers of a place last.
        let depths = &workshop.config.depths_m;
        let mut layers = depths.iter().map(|&z| layers_path(workshop, group, z));
        let all = layers.all(|path| path.exists());
        return Ok(all && workshop.watch.accept(&path, Found::Unsealed(())).is_some());
    }
    let Some(pictures) = workshop.watch.accept(&path, found) else {
        return Ok(false);
    };
    for name in pictures.keys() {
        let picture = folder.join(name);
        let found = inspect(workshop.folder, &picture)?;
        if workshop.watch.accept(&picture, found).is_none() {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Whether a picture, or the list of pictures itself, in the output `folder` is as it was written.
pub(super) fn inspect(folder: &Path, path: &Path) -> Result<Found<()>, DatasetError> {
    let list = path.with_file_name(LIST);
    let found = read_list(folder, &list)?;
    if path == list {
        return Ok(found.and_then("", |_| Some(())));
    }
    let Some(bytes) = store::read_bytes(path)? else {
        return Ok(Found::Absent);
    };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let Found::Sealed(pictures) = found else {
        return Ok(Found::Unsealed(()));
    };
    Ok(match pictures.get(name.as_ref()) {
        None => Found::Unsealed(()),
        Some(sum) if *sum == checksum(&name_in(folder, path), &bytes) => Found::Sealed(()),
        Some(_) => Found::changed(),
    })
}

fn read_list(folder: &Path, path: &Path) -> Result<Found<BTreeMap<String, u32>>, DatasetError> {
    let Some(text) = store::read_bytes(path)? else {
        return Ok(Found::Absent);
    };
    let found = seal::from_json::<List>(&name_in(folder, path), &text);
    Ok(found.and_then("", |list| Some(list.pictures)))
}

/// Writes the list of the pictures in the folder of a group.
fn write_list(workshop: &Workshop, group: &Group, names: &[String]) -> Result<(), DatasetError> {
    let folder = group.images_path(workshop.folder).with_extension("");
    let mut list = List::default();
    for name in names {
        let path = folder.join(name);
        let bytes = store::read_bytes(&path)?.unwrap_or_default();
        let sum = checksum(&workshop.watch.name(&path), &bytes);
        list.pictures.insert(name.clone(), sum);
    }
    let path = folder.join(LIST);
    let text = seal::to_json(&workshop.watch.name(&path), &list)
        .map_err(|e| DatasetError::Inconsistent(e.to_string()))?;
    Ok(uw_render::image::write_bytes(&path, text.as_bytes())?)
}

/// Writes the pictures of a group: `z…_light….png` per lamp level, and last `z….exr`. That holds the radiance with
/// lamps at 100 %, and its layers: `ambient` and `lamps`, which add up to it, of each the part that met no surface
/// (`ambient.backscatter`, `lamps.backscatter`), and `depth` along the optical axis, m.
pub(super) fn keep(
    workshop: &Workshop,
    group: &Group,
    views: &[DepthView],
    light: &GroupLight,
) -> Result<(), DatasetError> {
    let mut names = Vec::new();
    for (view, daylight) in views.iter().zip(&light.daylight) {
        let layers = layers_path(workshop, group, view.depth_m);
        if let Some(folder) = layers.parent() {
            fs::create_dir_all(folder).map_err(|source| DatasetError::Io {
                path: folder.display().to_string(),
                source,
            })?;
        }
        let lattice = view.model.lattice(1);
        let image = |source: &Source, fields: &Fields| {
            let reflection = Reflection::new(source, lattice);
            RadianceImage::new(source, fields, &reflection, Estimates::Whole)
        };
        let veil = |source: &Source, fields: &Fields| {
            let reflection = Reflection::none(lattice);
            RadianceImage::new(source, fields, &reflection, Estimates::Whole)
        };
        let (sun, lamp) = (view.model.daylight(), view.model.lamps());
        let (ambient, lamps) = (image(&sun, daylight), image(&lamp, &light.lamps));
        let shot = |light_pct, exposure| Shot {
            ambient: &ambient,
            lamps: &lamps,
            light_pct,
            exposure,
        };
        for &light_pct in &workshop.config.light_pct {
            let exposure = workshop.exposure_of(&shot(light_pct, 1.0));
            let frame = sensor(&workshop.config.vehicle, exposure).expose(
                &picture(&shot(light_pct, 1.0), &ambient),
                group.daylight(view.depth_m).seed(workshop.config.seed) ^ light_pct.to_bits(),
            );
            let name = format!("z{}_light{light_pct}.png", view.depth_m);
            write_frame(&layers.with_file_name(&name), &frame)?;
            names.push(name);
        }
        let mut exr = ExrImage::new(picture(&shot(100.0, 1.0), &ambient));
        exr.layers = vec![
            colour("ambient", ambient),
            colour("ambient.backscatter", veil(&sun, daylight)),
            colour("lamps", lamps),
            colour("lamps.backscatter", veil(&lamp, &light.lamps)),
            Layer {
                name: "depth".to_owned(),
                data: LayerData::Scalar(depths_m(view.model.view())),
            },
        ];
        exr.write(&layers)?;
        names.extend(layers.file_name().map(|n| n.to_string_lossy().into_owned()));
    }
    write_list(workshop, group, &names)
}

fn layers_path(workshop: &Workshop, group: &Group, depth_m: f64) -> PathBuf {
    let stem = group.images_path(workshop.folder).with_extension("");
    stem.join(format!("z{depth_m}.exr"))
}

/// The layer of an image of a single estimate.
fn colour(name: &str, mut image: RadianceImage) -> Layer {
    Layer {
        name: name.to_owned(),
        data: LayerData::Colour(image.estimates.swap_remove(0)),
    }
}

fn picture(shot: &Shot, like: &RadianceImage) -> Picture {
    let lattice = like.lattice;
    Picture {
        width: lattice.width as u32,
        height: lattice.height as u32,
        data: (0..like.estimates[0].len())
            .map(|i| shot.signal(0, i))
            .collect(),
    }
}

/// Distance along the optical axis of every pixel, m.
fn depths_m(view: &TargetView) -> Vec<f32> {
    let camera = &view.camera;
    let pixels = (0..camera.height).flat_map(|y| (0..camera.width).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| {
            let sight = view.sight(f64::from(x) + 0.5, f64::from(y) + 0.5);
            sight.map_or(f64::INFINITY, |s| {
                s.range_m * s.direction.dot(camera.forward)
            }) as f32
        })
        .collect()
}
