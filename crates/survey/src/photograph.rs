//! Pictures as a camera hands them over: JPEG files that state how they were exposed.

use std::io::Cursor;

use exif::experimental::Writer;
use exif::{Field, In, Rational, Tag, Value};
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder as _};
use uw_render::image::{Counts, Frame};

/// Parts of a unit in which EXIF is written: for numbers below 4, and up to 4000.
const PARTS: [f64; 2] = [1e9, 1e6];

/// How a picture was exposed, all > 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposed {
    /// Exposure time, s, in [1e-6, 3600].
    pub time_s: f64,
    /// F-number, in [0.1, 1000], where it is stated.
    pub f_number: Option<f64>,
    /// ISO, where it is stated.
    pub iso: Option<u16>,
}

/// A picture cannot be a JPEG file.
#[derive(Debug, thiserror::Error)]
pub enum PhotographError {
    /// Of 16 bits.
    #[error("a JPEG has 8 bits a channel: bits of [sensor] must be 8")]
    Bits,
    /// The encoder's answer.
    #[error("a JPEG cannot be made: {0}")]
    Jpeg(#[from] image::ImageError),
    /// The EXIF writer's answer.
    #[error("EXIF cannot be made: {0}")]
    Exif(#[from] exif::Error),
}

/// The bytes of a JPEG file of a quality (1 to 100), with EXIF where the exposure is given.
///
/// # Errors
/// The picture has 16 bits, or cannot be encoded.
pub fn jpeg(
    frame: &Frame,
    quality: u8,
    exposed: Option<&Exposed>,
) -> Result<Vec<u8>, PhotographError> {
    let Counts::Bits8(counts) = &frame.counts else {
        return Err(PhotographError::Bits);
    };
    let mut bytes = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut bytes, quality);
    if let Some(exposed) = exposed {
        encoder
            .set_exif_metadata(exif(exposed)?)
            .map_err(image::ImageError::Unsupported)?;
    }
    encoder.write_image(counts, frame.width, frame.height, ExtendedColorType::Rgb8)?;
    Ok(bytes)
}

fn exif(exposed: &Exposed) -> Result<Vec<u8>, exif::Error> {
    let ratio = |value: f64| {
        let parts = PARTS[usize::from(value >= 4.0)];
        Value::Rational(vec![Rational {
            num: (value * parts).round() as u32,
            denom: parts as u32,
        }])
    };
    let one = |value: u16| Value::Short(vec![value]);
    let mut values = vec![
        (Tag::ExposureTime, ratio(exposed.time_s)),
        (Tag::ExposureMode, one(1)),
        (Tag::WhiteBalance, one(1)),
    ];
    values.extend(exposed.f_number.map(|f| (Tag::FNumber, ratio(f))));
    values.extend(
        exposed
            .iso
            .map(|iso| (Tag::PhotographicSensitivity, one(iso))),
    );
    let field = |(tag, value)| Field {
        tag,
        ifd_num: In::PRIMARY,
        value,
    };
    let fields: Vec<Field> = values.into_iter().map(field).collect();
    let mut writer = Writer::new();
    fields.iter().for_each(|field| writer.push_field(field));
    let mut bytes = Cursor::new(Vec::new());
    writer.write(&mut bytes, false)?;
    Ok(bytes.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;
    use uw_calib::photo::Shot;
    use uw_calib::processing::jpeg_quality;

    #[test]
    fn a_photograph_states_quality_and_exposure() {
        let frame = Frame {
            width: 40,
            height: 24,
            counts: Counts::Bits8((0..40 * 24 * 3).map(|i| (i % 200) as u8).collect()),
        };
        let exposed = Exposed {
            time_s: 0.008,
            f_number: Some(2.8),
            iso: Some(400),
        };
        let bytes = jpeg(&frame, 90, Some(&exposed)).expect("a JPEG");
        let shot = Shot::of_bytes(&bytes);
        assert_eq!(
            (shot.time_s, shot.f_number, shot.iso),
            (Some(0.008), Some(2.8), Some(400.0))
        );
        assert_eq!(
            (shot.auto_exposure, shot.auto_white_balance),
            (Some(false), Some(false))
        );
        assert!(jpeg_quality(&bytes).is_some_and(|quality| quality.abs_diff(90) <= 1));
        assert!(image::load_from_memory(&bytes).is_ok_and(|image| image.width() == 40));
        assert_eq!(
            Shot::of_bytes(&jpeg(&frame, 90, None).expect("a JPEG")),
            Shot::default()
        );
        let deep = Frame {
            counts: Counts::Bits16(vec![0; 40 * 24 * 3]),
            ..frame
        };
        assert!(matches!(jpeg(&deep, 90, None), Err(PhotographError::Bits)));
    }
}
