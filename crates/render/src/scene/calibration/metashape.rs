//! Calibrations of Agisoft Metashape: the camera's alone (`calibration`), or those of exported cameras (`document`), of which the adjusted one counts.
//!
//! Its manual (Metashape Professional, appendix "Camera models") has, with x = X/Z, y = Y/Z and r² = x² + y²,
//! x' = x (1 + K1 r² + K2 r⁴ + K3 r⁶ + K4 r⁸) + P1 (r² + 2 x²) + 2 P2 x y, y' alike with P1 and P2 exchanged,
//! u = w/2 + cx + x' (f + B1) + y' B2 and v = h/2 + cy + y' f from the upper left corner of the picture: P1 is OpenCV's p2 and P2 its p1. A fisheye has the angle from the
//! axis in the place of r.

use glam::DVec2;

use super::value::{Value, told};
use super::xml::Element;
use super::{Calibration, HALF_PIXEL, Lens, NO_SKEW, calibration, size};

/// Of the outermost element of a file.
pub(super) fn read(root: &Element<'_>) -> Result<Calibration, String> {
    match root.name() {
        "calibration" => camera(root),
        "document" => {
            let mut adjusted = root.all("calibration");
            adjusted.retain(|calibration| calibration.says("class", "adjusted"));
            match &adjusted[..] {
                [only] => camera(only),
                [] => Err("must have an adjusted calibration (`calibration` with class=\"adjusted\": align the cameras before they are exported), got none".to_owned()),
                [_, second, ..] => Err(second.wrong("left out: one camera a file", "another camera")),
            }
        }
        other => Err(format!(
            "must be a calibration of OpenCV (`opencv_storage`) or Metashape (`calibration`, or `document` of exported cameras), got `{}`",
            told(other)
        )),
    }
}

fn camera(of: &Element<'_>) -> Result<Calibration, String> {
    let within = of.get("resolution");
    let side = |name| within.as_ref().unwrap_or(of).required(name);
    let (width, height) = size(&side("width")?, &side("height")?)?;
    let focal = of.required("f")?;
    let number = |name: &str| of.get(name).map_or(Ok(0.0), |value| value.number());
    let zero = |name: &str, why: &str, most: f64| match of.get(name) {
        Some(value) if value.number()?.abs() > most => {
            Err(value.wrong(&format!("0 ({why})"), value.written()))
        }
        _ => Ok(()),
    };
    let f = focal.number()?;
    zero(
        "b2",
        "without skew: leave B2 out when cameras are optimised",
        NO_SKEW * f.abs(),
    )?;
    let kind = match of.get("projection") {
        Some(kind) => kind,
        None => of.required("type")?,
    };
    let lens = match kind.text()? {
        "frame" => {
            for name in ["k4", "p3", "p4"] {
                zero(name, "leave it out when cameras are optimised", 0.0)?;
            }
            let [k1, k2, k3] = [number("k1")?, number("k2")?, number("k3")?];
            Lens::brown_conrady([k1, k2, number("p2")?, number("p1")?, k3])
        }
        "fisheye" | "equidistant_fisheye" => {
            for name in ["p1", "p2", "p3", "p4"] {
                zero(
                    name,
                    "of a fisheye, leave it out when cameras are optimised",
                    0.0,
                )?;
            }
            Lens::Fisheye([number("k1")?, number("k2")?, number("k3")?, number("k4")?])
        }
        other => return Err(kind.wrong("frame, fisheye or equidistant_fisheye", other)),
    };
    let centre = 0.5 * DVec2::new(width.into(), height.into()) - HALF_PIXEL;
    let intrinsics = [
        f + number("b1")?,
        f,
        centre.x + number("cx")?,
        centre.y + number("cy")?,
    ];
    calibration((width, height), &focal, intrinsics, lens)
}
