//! The `[camera]` table of the scene file.

use glam::{DVec2, DVec3};

use super::calibration::{self, Calibration};
use super::camera::{LEAST_AHEAD, LEAST_FOCAL_PX, MAX_PIXELS, MAX_SIDE_PX};
use super::lens::Lens;
use super::port::{Port, PortShape};
use super::range::Range;
use super::reader::Table;
use super::snow::BLUR_FIELDS;
use super::value::Value;
use super::{Camera, Opening, SceneError, WaterSurface, spectral};

/// Smallest field of view, degrees.
const LEAST_FIELD_DEG: f64 = 1e-6;
/// Sine of the smallest angle between forward and up.
const PARALLEL_SINE: f64 = 1e-9;
/// Smallest distance of a flat port and radius of a dome, m.
const LEAST_PORT_M: f64 = 1e-4;
/// How far the middle of a dome may be from the centre of projection, in radii.
const MOST_OFFSET: f64 = 0.95;
/// Largest opening of a lens, mm, and nearest focus, m.
const MOST_OPENING_MM: f64 = 1e3;
const LEAST_FOCUS_M: f64 = 1e-3;
/// Millimetres in a metre.
const MM_PER_M: f64 = 1e3;
/// Refractive index of acrylic glass (PMMA) in the middle of the visible.
const ACRYLIC: f64 = 1.49;

pub(super) const FIELDS: [&str; 19] = [
    "position_m",
    "forward",
    "up",
    "hfov_deg",
    "fx",
    "fy",
    "cx",
    "cy",
    "distortion",
    "fisheye",
    "port",
    "calibration",
    "width",
    "height",
    "response",
    "aperture_mm",
    "focus_m",
    BLUR_FIELDS[0],
    BLUR_FIELDS[1],
];
/// How many of them tell a view; without any of these it comes from a glTF file.
const VIEW_FIELDS: usize = 12;

/// What the `[camera]` table says.
pub(super) enum CameraTable {
    /// A whole camera.
    Complete(Box<Camera>),
    /// Only the size of the image: the view comes from a glTF file.
    SizeOnly {
        /// Image width, pixels.
        width: u32,
        /// Image height, pixels.
        height: u32,
    },
}

/// Reads the `[camera]` table, `None` when the file has none.
pub(super) fn read(root: &Table<'_>) -> Result<Option<CameraTable>, SceneError> {
    let Some(table) = root.table("camera", &FIELDS)? else {
        return Ok(None);
    };
    let calibration = read_calibration(&table)?;
    let (width, height) = match calibration {
        Some(known) => (known.width, known.height),
        None => read_size(&table)?,
    };
    if FIELDS[..VIEW_FIELDS]
        .iter()
        .all(|field| table.optional(field).is_none())
    {
        return Ok(Some(CameraTable::SizeOnly { width, height }));
    }
    let forward = table.direction("forward")?;
    let up = table
        .optional("up")
        .map_or(Ok(DVec3::Z), |up| up.as_direction())?;
    if forward.cross(up).length() < PARALLEL_SINE {
        let (field, expected) = match table.optional("up") {
            Some(up) => (up, "a direction not parallel to camera.forward"),
            None => (
                table.required("forward", "")?,
                "a direction that is not vertical, where camera.up is left out",
            ),
        };
        return Err(field.invalid(expected));
    }
    let (lens, (focal_px, centre_px)) = match calibration {
        Some(known) => (known.lens, (known.focal_px, known.centre_px)),
        None => {
            let lens = read_lens(&table)?;
            (lens, read_intrinsics(&table, &lens, width, height)?)
        }
    };
    let port = table.optional("port");
    let camera = Camera {
        focal_px,
        centre_px,
        lens,
        port: port.as_ref().map(read_port).transpose()?,
        ..Camera::looking(table.vector("position_m")?, forward, up, width, height)
    };
    check_lens(&table, &camera)?;
    Ok(Some(CameraTable::Complete(Box::new(camera))))
}

/// Size, lens and principal point from the file that another program has written, for pictures of the size that the table says.
fn read_calibration(table: &Table<'_>) -> Result<Option<Calibration>, SceneError> {
    let Some(file) = table.optional("calibration") else {
        return Ok(None);
    };
    let in_file = ["hfov_deg", "fx", "fy", "cx", "cy", "distortion", "fisheye"];
    for field in in_file {
        table.refuse(field, "where camera.calibration is given, which tells it")?;
    }
    let (text, path) = spectral::read_file(&file)?;
    let known = calibration::parse(&text).map_err(|reason| file.unusable_file(&path, reason))?;
    let side = |field| {
        let given = table.optional(field);
        given
            .map(|side| side.as_whole(1, MAX_SIDE_PX, "pixels"))
            .transpose()
    };
    let (width, height) = (side("width")?, side("height")?);
    if let Some(scaled) = known.scaled(width, height) {
        return Ok(Some(scaled));
    }
    let given = table.optional("width").or_else(|| table.optional("height"));
    Err(given.unwrap_or(file).invalid(format!(
        "with camera.height of the proportions of the {} x {} pixels that were calibrated, at most {MAX_PIXELS} pixels in all (left out where pictures \
         have the size that was calibrated)",
        known.width, known.height
    )))
}

fn read_lens(table: &Table<'_>) -> Result<Lens, SceneError> {
    if let Some(coefficients) = table.optional("fisheye") {
        table.refuse("distortion", "where camera.fisheye is given")?;
        return Ok(Lens::Fisheye(coefficients.as_numbers(Range::finite(""))?));
    }
    let Some(coefficients) = table.optional("distortion") else {
        return Ok(Lens::default());
    };
    let range = Range::finite("");
    match coefficients.count() {
        5 => Ok(Lens::brown_conrady(coefficients.as_numbers(range)?)),
        8 => Ok(Lens::Perspective(coefficients.as_numbers(range)?)),
        _ => Err(coefficients
            .invalid("an array of 5 numbers (k1, k2, p1, p2, k3) or 8 (and k4, k5, k6)")),
    }
}

/// Refuses a lens without inverse, and one that looks past a flat port.
fn check_lens(table: &Table<'_>, camera: &Camera) -> Result<(), SceneError> {
    let (field, expected) = match camera.lens {
        Lens::Perspective(_) => (
            "distortion",
            "k1, k2, p1, p2, k3 (and k4, k5, k6) of a distortion that is one-to-one over the image",
        ),
        Lens::Fisheye(_) => (
            "fisheye",
            "k1, k2, k3, k4 of a lens that sees less than 180° off its axis and is one-to-one over the image",
        ),
    };
    let calibration = || table.optional("calibration");
    if let Some(value) = table.optional(field).or_else(calibration)
        && !camera.is_invertible()
    {
        return Err(value.invalid(expected));
    }
    let flat = (camera.port).filter(|port| matches!(port.shape, PortShape::Flat { .. }));
    match table.optional("port").filter(|_| flat.is_some()) {
        Some(port) if !camera.looks_ahead(LEAST_AHEAD) => Err(port.invalid(
            "a dome, where the image reaches 90° off the optical axis: a flat port is seen below that alone",
        )),
        _ => Ok(()),
    }
}

fn read_port(value: &Value<'_>) -> Result<Port, SceneError> {
    const FLAT: [&str; 4] = ["kind", "distance_m", "thickness_m", "glass_index"];
    const DOME: [&str; 5] = ["kind", "radius_m", "thickness_m", "offset_m", "glass_index"];
    let any = value.as_table(&[&FLAT[..], &DOME[1..2], &DOME[3..4]].concat())?;
    let kind = any.required("kind", "\"flat\" or \"dome\"")?;
    let flat = kind.as_choice(&[("flat", true), ("dome", false)])?;
    let table = value.as_table(if flat { &FLAT[..] } else { &DOME[..] })?;
    let size = Range::at_least(LEAST_PORT_M, "m");
    let shape = if flat {
        PortShape::Flat {
            distance_m: table.number("distance_m", size)?,
        }
    } else {
        let radius_m = table.number("radius_m", size)?;
        PortShape::Dome {
            radius_m,
            offset_m: read_offset(&table, radius_m)?,
        }
    };
    Ok(Port {
        shape,
        thickness_m: table.number("thickness_m", Range::non_negative("m"))?,
        glass_index: table.number_or("glass_index", Range::closed(1.0, 3.0, ""), ACRYLIC)?,
        outside_index: 1.0,
    })
}

/// Middle of a dome (right, down, forward) from the centre of projection, m: a number is along the optical axis.
fn read_offset(table: &Table<'_>, radius_m: f64) -> Result<DVec3, SceneError> {
    let Some(value) = table.optional("offset_m") else {
        return Ok(DVec3::ZERO);
    };
    let range = Range::finite("m");
    let offset_m = match value.is_array() {
        true => DVec3::from_array(value.as_numbers(range)?),
        false => DVec3::new(0.0, 0.0, value.as_number(range)?),
    };
    if offset_m.length() > MOST_OFFSET * radius_m {
        return Err(value.invalid(format!(
            "at most {} m long ({MOST_OFFSET} of radius_m): the camera is inside the dome",
            MOST_OFFSET * radius_m
        )));
    }
    Ok(offset_m)
}

/// The camera with the opening of its lens, which has room behind the port and on one side of the water surface.
pub(super) fn with_opening(
    root: &Table<'_>,
    camera: Camera,
    surface: Option<&WaterSurface>,
) -> Result<Camera, SceneError> {
    let Some(table) = root.table("camera", &FIELDS)? else {
        return Ok(camera);
    };
    let aperture_mm = table.number_or(
        "aperture_mm",
        Range::closed(0.0, MOST_OPENING_MM, "mm"),
        0.0,
    )?;
    let focus = table.optional("focus_m");
    let focus_m = focus
        .as_ref()
        .map(|focus| focus.as_number(Range::at_least(LEAST_FOCUS_M, "m")));
    let focus_m = focus_m.transpose()?;
    let Some(aperture) = table.optional("aperture_mm").filter(|_| aperture_mm > 0.0) else {
        return Ok(camera);
    };
    let (Some(focus), Some(focus_m)) = (focus, focus_m) else {
        return Err(table.missing(
            "focus_m",
            "the distance along the optical axis that is in focus, where camera.aperture_mm is above 0",
        ));
    };
    let room_m = room_for_opening_m(&camera, surface);
    if aperture_mm > 2.0 * MM_PER_M * room_m {
        let most_mm = 2.0 * MM_PER_M * room_m;
        return Err(aperture.invalid(format!(
            "at most {most_mm} mm: the lens is behind the port and on one side of the water surface"
        )));
    }
    let nearest_m = camera.port.as_ref().map_or(0.0, Port::outer_m);
    if focus_m <= nearest_m {
        return Err(focus.invalid(format!(
            "more than {nearest_m} m, where the outer side of camera.port is"
        )));
    }
    let opening = Opening {
        diameter_m: aperture_mm / MM_PER_M,
        focus_m,
    };
    Ok(Camera {
        opening: Some(opening),
        ..camera
    })
}

/// Largest radius of an opening that touches neither port nor water surface, m.
fn room_for_opening_m(camera: &Camera, surface: Option<&WaterSurface>) -> f64 {
    let to_surface_m = surface.map_or(f64::INFINITY, |surface| {
        (camera.position_m.z - surface.height_m).abs()
    });
    let to_port_m = match camera.port.map(|port| port.shape) {
        None => f64::INFINITY,
        Some(PortShape::Flat { distance_m }) => match camera.lens {
            Lens::Perspective(_) => f64::INFINITY,
            Lens::Fisheye(_) => distance_m,
        },
        Some(PortShape::Dome { radius_m, offset_m }) => radius_m - offset_m.length(),
    };
    to_surface_m.min(to_port_m)
}

/// Refuses a port where there is no water before it, and with flakes, which are not bent.
pub(super) fn check_port(
    root: &Table<'_>,
    camera: &Camera,
    (has_water, has_snow): (bool, bool),
) -> Result<(), SceneError> {
    let Some(table) = root.table("camera", &FIELDS)? else {
        return Ok(());
    };
    if !has_water {
        table.refuse("port", "where there is no [water] before it")?;
    }
    if has_snow {
        table.refuse(
            "port",
            "where there is [water.snow], which is not seen through ports",
        )?;
        if !camera.looks_ahead(LEAST_AHEAD) {
            let reason = "where there is [water.snow], which is not seen 90° off the optical axis and beyond";
            table.refuse("fisheye", reason)?;
        }
    }
    Ok(())
}

fn read_size(table: &Table<'_>) -> Result<(u32, u32), SceneError> {
    let side = |field| {
        table
            .required(field, "pixels")?
            .as_whole(1, MAX_SIDE_PX, "pixels")
    };
    let (width, height) = (side("width")?, side("height")?);
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        let expected = format!(
            "at most {} for this height ({MAX_PIXELS} pixels in all)",
            MAX_PIXELS / u64::from(height)
        );
        return Err(table.required("width", "pixels")?.invalid(expected));
    }
    Ok((width, height))
}

fn read_intrinsics(
    table: &Table<'_>,
    lens: &Lens,
    width: u32,
    height: u32,
) -> Result<(DVec2, DVec2), SceneError> {
    let centre = DVec2::new(f64::from(width), f64::from(height)) / 2.0;
    if let Some(hfov) = table.optional("hfov_deg") {
        for field in ["fx", "fy", "cx", "cy"] {
            table.refuse(field, "where camera.hfov_deg is given")?;
        }
        let most_deg = match lens {
            Lens::Perspective(_) => 180.0,
            Lens::Fisheye(_) => 360.0,
        };
        let hfov_deg = hfov.as_number(Range::below(LEAST_FIELD_DEG, most_deg, "degrees"))?;
        let focal_px = lens.focal_length_px(hfov_deg, width).ok_or_else(|| {
            hfov.invalid("a field of view up to which camera.fisheye is one-to-one, in degrees")
        })?;
        return Ok((DVec2::splat(focal_px), centre));
    }
    if table.optional("fx").is_none() {
        return Err(table.missing("hfov_deg", "or fx, with fy, cx, cy, in pixels"));
    }
    let positive = Range::at_least(LEAST_FOCAL_PX, "pixels");
    let fx = table.number("fx", positive)?;
    let fy = table.number_or("fy", positive, fx)?;
    let cx = table.number_or("cx", Range::finite("pixels"), centre.x)?;
    let cy = table.number_or("cy", Range::finite("pixels"), centre.y)?;
    Ok((DVec2::new(fx, fy), DVec2::new(cx, cy)))
}
