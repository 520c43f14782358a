//! Settings and objects as the text of a scene file.

use std::fmt::Write as _;
use std::path::Path;

use glam::{DVec2, DVec3};
use toml::Value;
use uw_media::spectral::JerlovWater;
use uw_render::image::{ImageError, write_bytes};
use uw_render::scene::{Blur, Encoding, Exposure, Falloff, Lens, Port, PortShape, Sensor, Snow};

use super::depth_profile::{DepthProfile, Entry, LayerWater};
use super::paths::rebased;
use super::settings::rounded;
use super::{
    Balance, CameraSettings, Coefficients, LampSettings, LightSpectrum, OpenScene, PhaseModel,
    SensorSettings, Settings, Water, water,
};

/// Fields of a scene file that name a file.
const FILE_FIELDS: [&str; 4] = ["gltf", "texture", "file", "spectrum"];

/// Writes the scene to `path`, whole or not at all.
///
/// # Errors
/// A file that cannot be written.
pub fn save(open: &OpenScene, settings: &Settings, path: &Path) -> Result<(), ImageError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let text = scene_text(open, settings, folder);
    write_bytes(path, text.as_bytes())
}

/// The scene as the text of a scene file in `folder`.
pub fn scene_text(open: &OpenScene, settings: &Settings, folder: &Path) -> String {
    let moved = |value: &Value| moved(value, &open.base_dir, folder);
    let mut text = "format = \"uw-scene/1\"\n".to_owned();
    // Writing to a string cannot fail; the results are dropped throughout.
    if let Some(water) = &settings.water {
        write_water(&mut text, water, &moved);
        if let Some(snow) = &settings.snow_in_view() {
            write_snow(&mut text, snow);
        }
    }
    if let Some(surface) = settings.surface {
        let _ = write!(
            text,
            "\n[surface]\nheight_m = {:?}\nrefractive = {}\n",
            surface.height_m, surface.refractive
        );
    }
    if let Some(sun) = settings.sun {
        let _ = write!(
            text,
            "\n[sun]\nzenith_deg = {:?}\nazimuth_deg = {:?}\nirradiance = {:?}\n",
            sun.zenith_deg, sun.azimuth_deg, sun.irradiance
        );
        write_spectrum(&mut text, settings.sun_spectrum.as_ref(), &moved);
    }
    if settings.sky_radiance != [0.0; 3] {
        let _ = write!(text, "\n[sky]\nradiance = {:?}\n", settings.sky_radiance);
        write_spectrum(&mut text, settings.sky_spectrum.as_ref(), &moved);
    }
    write_camera(&mut text, &settings.camera);
    if let (Some(port), Some(_)) = (&settings.camera.port, &settings.water) {
        write_port(&mut text, port);
    }
    if let Some(snow) = &settings.snow {
        write_blur(&mut text, &snow.blur);
    }
    if let Some(response) = &settings.response.entry {
        let _ = writeln!(text, "response = {}", inline(&moved(response)));
    }
    for lamp in settings.lamps.iter().filter(|lamp| !lamp.of_gltf) {
        write_lamp(&mut text, lamp, &moved);
    }
    for object in &settings.objects {
        text += &object_text(&moved(object));
    }
    write_sensor(&mut text, &settings.sensor);
    let _ = write!(
        text,
        "\n[render]\nsamples_per_pixel = {}\nmax_bounces = {}\n",
        settings.samples_per_pixel, settings.max_bounces
    );
    text
}

/// An object as the table of a scene file.
pub(super) fn object_text(object: &Value) -> String {
    let fields = object.as_table().into_iter().flatten();
    let lines = fields.map(|(field, value)| format!("{field} = {}\n", inline(value)));
    format!("\n[[object]]\n{}", lines.collect::<String>())
}

fn write_water(text: &mut String, water: &Water, moved: &dyn Fn(&Value) -> Value) {
    text.push_str("\n[water]\n");
    let _ = match &water.coefficients {
        Coefficients::Jerlov { scale, bands } => {
            let jerlov = types(&water::neighbours(*scale));
            write!(text, "jerlov = {jerlov}\nbands = \"{bands}\"\n")
        }
        Coefficients::OfFile { path, .. } => {
            writeln!(text, "spectrum = {}", spectrum_file(path, moved))
        }
        Coefficients::Profile(profile) => {
            text.push_str(&profile_text(profile, moved));
            Ok(())
        }
        Coefficients::Direct(iops) => write!(text, "a = {:?}\nb = {:?}\n", iops.a, iops.b),
    };
    let phase = match &water.phase {
        PhaseModel::OfFile { entry, .. } => inline(&moved(entry)),
        model => {
            let mut entry = format!("{{ model = \"{}\"", model.name());
            for (field, value) in model.parameters() {
                let _ = write!(entry, ", {field} = {value:?}");
            }
            entry + " }"
        }
    };
    let _ = write!(
        text,
        "phase = {phase}\nrefractive_index = {:?}\n",
        water.refractive_index
    );
    for cloud in &water.clouds {
        let _ = write!(
            text,
            "\n[[water.plume]]\ncenter_m = {}\nsigma_m = {:?}\na = {:?}\nb = {:?}\n",
            vector(cloud.centre_m),
            cloud.sigma_m,
            cloud.iops.a,
            cloud.iops.b
        );
    }
}

fn write_snow(text: &mut String, snow: &Snow) {
    let [smallest, largest] = snow.diameter_m.map(|d| rounded(1e3 * d));
    let _ = write!(
        text,
        "\n[water.snow]\nshare = {:?}\nslope = {:?}\ndiameter_mm = [{smallest:?}, {largest:?}]\nper_litre = {:?}\n\
         drift_m_s = {}\ntime_s = {:?}\nseed = {}\n",
        snow.share,
        snow.slope,
        rounded(1e-3 * snow.per_m3),
        vector(snow.drift_m_s),
        snow.time_s,
        snow.seed
    );
}

/// What of the camera blurs flakes.
fn write_blur(text: &mut String, blur: &Blur) {
    if *blur != Blur::default() {
        let _ = write!(
            text,
            "exposure_s = {:?}\nvelocity_m_s = {}\n",
            blur.exposure_s,
            vector(blur.velocity_m_s)
        );
    }
}

/// What `jerlov` is for a water of the types.
fn types(water: &JerlovWater) -> String {
    match water {
        JerlovWater {
            from, share: 0.0, ..
        } => format!("\"{from}\""),
        JerlovWater { from, to, share } => {
            format!("{{ between = [\"{from}\", \"{to}\"], share = {share:?} }}")
        }
    }
}

/// What `spectrum` is for the file of a water.
fn spectrum_file(path: &str, moved: &dyn Fn(&Value) -> Value) -> String {
    let fields = [("spectrum".to_owned(), Value::from(path))];
    let entry = moved(&Value::Table(toml::Table::from_iter(fields)));
    inline(&entry["spectrum"])
}

/// A profile, with the bands where they count.
fn profile_text(profile: &DepthProfile, moved: &dyn Fn(&Value) -> Value) -> String {
    let entry = |Entry { depth_m, water }: &Entry| {
        let water = match water {
            LayerWater::Jerlov(water) => format!("jerlov = {}", types(water)),
            LayerWater::OfFile { path, .. } => {
                format!("spectrum = {}", spectrum_file(path, moved))
            }
            LayerWater::Direct(iops) => format!("a = {:?}, b = {:?}", iops.a, iops.b),
        };
        format!("    {{ depth_m = {depth_m:?}, {water} }},\n")
    };
    let entries: String = profile.entries().iter().map(entry).collect();
    let mut text = format!("profile = [\n{entries}]\n");
    if !profile.entries().iter().all(|e| e.water.is_direct()) {
        text += &format!("bands = \"{}\"\n", profile.bands());
    }
    text
}

fn write_spectrum(
    text: &mut String,
    spectrum: Option<&LightSpectrum>,
    moved: &dyn Fn(&Value) -> Value,
) {
    if let Some(spectrum) = spectrum {
        let _ = writeln!(text, "spectrum = {}", inline(&moved(&spectrum.entry)));
    }
}

fn write_camera(text: &mut String, camera: &CameraSettings) {
    let _ = write!(
        text,
        "\n[camera]\nposition_m = {}\nforward = {}\nup = {}\n",
        vector(camera.position_m),
        vector(camera.forward),
        vector(camera.up)
    );
    if camera.is_ideal() {
        let _ = writeln!(text, "hfov_deg = {:?}", camera.hfov_deg());
    } else {
        let (f, c) = (camera.focal_px, camera.centre_px);
        let _ = write!(
            text,
            "fx = {:?}\nfy = {:?}\ncx = {:?}\ncy = {:?}\n",
            f.x, f.y, c.x, c.y
        );
        let _ = match camera.lens {
            Lens::Perspective(_) => writeln!(text, "distortion = {:?}", camera.lens.coefficients()),
            Lens::Fisheye(k) => writeln!(text, "fisheye = {k:?}"),
        };
    }
    let _ = write!(
        text,
        "width = {}\nheight = {}\n",
        camera.width, camera.height
    );
    if camera.aperture_m > 0.0 {
        let aperture_mm = rounded(1e3 * camera.aperture_m);
        let _ = write!(
            text,
            "aperture_mm = {aperture_mm:?}\nfocus_m = {:?}\n",
            camera.focus_m
        );
    }
}

/// The port, where there is water before it.
fn write_port(text: &mut String, port: &Port) {
    let shape = match port.shape {
        PortShape::Flat { distance_m } => format!("kind = \"flat\", distance_m = {distance_m:?}"),
        PortShape::Dome { radius_m, offset_m } => format!(
            "kind = \"dome\", radius_m = {radius_m:?}, offset_m = {}",
            match offset_m.truncate() == DVec2::ZERO {
                true => format!("{:?}", offset_m.z),
                false => vector(offset_m),
            }
        ),
    };
    let _ = writeln!(
        text,
        "port = {{ {shape}, thickness_m = {:?}, glass_index = {:?} }}",
        port.thickness_m, port.glass_index
    );
}

fn write_lamp(text: &mut String, lamp: &LampSettings, moved: &dyn Fn(&Value) -> Value) {
    let falloff = match (&lamp.falloff, &lamp.beam_file) {
        (_, Some(file)) => {
            let entry = toml::Table::from_iter([("file".to_owned(), Value::from(file.as_str()))]);
            inline(&moved(&Value::Table(entry)))
        }
        (Falloff::Cosine, None) => "\"cosine\"".to_owned(),
        (Falloff::Uniform | Falloff::Profile(_), None) => "\"uniform\"".to_owned(),
    };
    let _ = write!(
        text,
        "\n[[lamp]]\nname = \"{}\"\nposition_m = {}\nforward = {}\nintensity = {:?}\nlevel_pct = {:?}\n\
         half_angle_deg = {:?}\nfalloff = {falloff}\nradius_m = {:?}\n",
        lamp.name,
        vector(lamp.position_m),
        vector(lamp.forward),
        lamp.intensity,
        lamp.level_pct,
        lamp.half_angle_deg,
        lamp.radius_m
    );
    write_spectrum(text, lamp.spectrum.as_ref(), moved);
}

fn write_sensor(text: &mut String, sensor: &SensorSettings) {
    let exposure = match sensor.exposure {
        Exposure::Fixed(factor) => format!("{factor:?}"),
        Exposure::AutoMean(mean) => format!("{{ auto_mean = {mean:?} }}"),
    };
    let encoding = match sensor.encoding {
        Encoding::Linear | Encoding::Srgb => format!("{:?}", sensor.encoding.name()),
        Encoding::Curve(curve) => format!("{{ curve = {:?} }}", curve.points()),
    };
    let _ = write!(
        text,
        "\n[sensor]\nexposure = {exposure}\nencoding = {encoding}\nbits = {}\n",
        sensor.bits
    );
    if let Some(noise) = sensor.noise {
        let _ = writeln!(text, "noise = {{ a = {:?}, b = {:?} }}", noise.a, noise.b);
    }
    let _ = match sensor.white_balance {
        Balance::None => Ok(()),
        Balance::Gray => writeln!(text, "white_balance = \"gray\""),
        Balance::Daylight => writeln!(text, "white_balance = \"d65\""),
        Balance::Gains(gains) => writeln!(text, "white_balance = {gains:?}"),
    };
    if let Some(lens) = sensor.vignetting {
        let _ = writeln!(text, "vignetting = {:?}", lens.coefficients());
    }
    if sensor.color_matrix != Sensor::default().color_matrix {
        let _ = writeln!(text, "color_matrix = {:?}", sensor.color_matrix);
    }
}

fn vector(v: DVec3) -> String {
    format!("{:?}", v.to_array())
}

/// A value in one line.
pub(super) fn inline(value: &Value) -> String {
    match value {
        Value::Table(table) => {
            let fields = table.iter().map(|(k, v)| format!("{k} = {}", inline(v)));
            format!("{{ {} }}", fields.collect::<Vec<_>>().join(", "))
        }
        Value::Array(values) => {
            let values: Vec<_> = values.iter().map(inline).collect();
            format!("[{}]", values.join(", "))
        }
        other => other.to_string(),
    }
}

/// The value with the files it names as a scene file in `to` names them.
fn moved(value: &Value, from: &Path, to: &Path) -> Value {
    match value {
        Value::Table(table) => Value::Table(
            table
                .iter()
                .map(|(field, value)| {
                    let value = match value.as_str() {
                        Some(file) if FILE_FIELDS.contains(&field.as_str()) => {
                            let file = rebased(file.as_ref(), from, to);
                            Value::from(file.to_string_lossy().into_owned())
                        }
                        _ => moved(value, from, to),
                    };
                    (field.clone(), value)
                })
                .collect(),
        ),
        Value::Array(values) => Value::Array(values.iter().map(|v| moved(v, from, to)).collect()),
        other => other.clone(),
    }
}
