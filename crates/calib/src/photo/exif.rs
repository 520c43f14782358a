//! What a camera wrote beside a picture: how long it was exposed, and what was left to the camera.

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Seek};
use std::path::Path;

use exif::{Field, In, Reader, Tag, Value};

/// What is known of an exposure. What a file does not state is `None`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shot {
    /// Exposure time, s, finite and > 0.
    pub time_s: Option<f64>,
    /// Focal length over the opening's diameter, finite and > 0.
    pub f_number: Option<f64>,
    /// Sensitivity (ISO), > 0.
    pub iso: Option<f64>,
    /// Whether the camera chose the exposure.
    pub auto_exposure: Option<bool>,
    /// Whether the camera chose the white balance.
    pub auto_white_balance: Option<bool>,
    /// Whether the picture is stored turned or mirrored; pictures are measured as they are shown.
    pub turned: bool,
    /// What the file states that cannot be, in words.
    pub wrong: Option<String>,
}

impl Shot {
    /// Of a PNG, TIFF or JPEG file; nothing is known where it cannot be read or has no EXIF.
    pub fn of_file(path: &Path) -> Self {
        match File::open(path) {
            Ok(file) => Self::read(&mut BufReader::new(file)),
            Err(_) => Self::default(),
        }
    }

    /// The same of a file in memory.
    pub fn of_bytes(bytes: &[u8]) -> Self {
        Self::read(&mut Cursor::new(bytes))
    }

    fn read(file: &mut (impl BufRead + Seek)) -> Self {
        let read = Reader::new()
            .continue_on_error(true)
            .read_from_container(file)
            .or_else(|error| error.distill_partial_result(|_| ()));
        let Ok(exif) = read else {
            return Self::default();
        };
        let field = |tag| exif.get_field(tag, In::PRIMARY);
        let mut shot = Self::default();
        shot.time_s = shot.positive("exposure time", field(Tag::ExposureTime));
        shot.f_number = shot.positive("f-number", field(Tag::FNumber));
        shot.iso = shot.positive("ISO", field(Tag::PhotographicSensitivity));
        shot.turned = field(Tag::Orientation)
            .and_then(whole)
            .is_some_and(|way| way > 1);
        // 0 is automatic, 1 manual, 2 an automatic bracket.
        shot.auto_exposure = field(Tag::ExposureMode)
            .and_then(whole)
            .map(|mode| mode != 1);
        shot.auto_white_balance = field(Tag::WhiteBalance)
            .and_then(whole)
            .map(|mode| mode == 0);
        shot
    }

    /// A number that has to be above 0; what is none is remembered.
    fn positive(&mut self, name: &str, field: Option<&Field>) -> Option<f64> {
        let field = field?;
        let value = number(field).filter(|value| value.is_finite() && *value > 0.0);
        if value.is_none() {
            let got = field.display_value();
            self.wrong = Some(format!("EXIF states an {name} of {got}, which cannot be"));
        }
        value
    }

    /// Time · ISO / f-number², s, of what is stated.
    pub fn stated_exposure(&self) -> Option<f64> {
        self.exposure(&Stated {
            iso: self.iso.is_some(),
            f_number: self.f_number.is_some(),
        })
    }

    /// Time · ISO / f-number², s, of a file that states all three: what may be compared with another file's.
    pub fn whole_exposure(&self) -> Option<f64> {
        self.exposure(&Stated {
            iso: true,
            f_number: true,
        })
    }

    /// Light per count by what is known: time · ISO / f-number², without what `stated` says that all pictures lack.
    pub(crate) fn exposure(&self, stated: &Stated) -> Option<f64> {
        let iso = match stated.iso {
            true => self.iso?,
            false => 1.0,
        };
        let f_number = match stated.f_number {
            true => self.f_number?,
            false => 1.0,
        };
        Some(self.time_s? * iso / (f_number * f_number))
    }
}

/// Which of an exposure's numbers any of the pictures states.
pub(crate) struct Stated {
    pub(crate) iso: bool,
    pub(crate) f_number: bool,
}

fn whole(field: &Field) -> Option<u32> {
    field.value.get_uint(0)
}

fn number(field: &Field) -> Option<f64> {
    match &field.value {
        Value::Rational(values) => values.first().map(exif::Rational::to_f64),
        _ => whole(field).map(f64::from),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use exif::experimental::Writer;
    use exif::{Rational, Value};

    use super::*;

    /// A JPEG with the fields in its EXIF.
    pub(crate) fn with_exif(jpeg: &[u8], fields: &[Field]) -> Vec<u8> {
        let mut writer = Writer::new();
        fields.iter().for_each(|field| writer.push_field(field));
        let mut exif = Cursor::new(Vec::new());
        writer.write(&mut exif, false).unwrap();
        let body = [b"Exif\0\0".as_slice(), &exif.into_inner()].concat();
        let length = (body.len() as u16 + 2).to_be_bytes();
        [&jpeg[..2], &[0xff, 0xe1], &length, &body, &jpeg[2..]].concat()
    }

    pub(crate) fn ratio(tag: Tag, num: u32, denom: u32) -> Field {
        let value = Value::Rational(vec![Rational { num, denom }]);
        let ifd_num = In::PRIMARY;
        Field {
            tag,
            ifd_num,
            value,
        }
    }

    pub(crate) fn short(tag: Tag, value: u16) -> Field {
        let ifd_num = In::PRIMARY;
        Field {
            tag,
            ifd_num,
            value: Value::Short(vec![value]),
        }
    }

    #[test]
    fn what_a_file_states_is_read_and_what_cannot_be_is_told() {
        let stated = [
            ratio(Tag::ExposureTime, 1, 80),
            ratio(Tag::FNumber, 28, 10),
            short(Tag::PhotographicSensitivity, 400),
            short(Tag::ExposureMode, 0),
            short(Tag::WhiteBalance, 1),
        ];
        let shot = Shot::of_bytes(&with_exif(&[0xff, 0xd8, 0xff, 0xd9], &stated));
        assert_eq!(shot.time_s, Some(0.0125));
        assert_eq!((shot.f_number, shot.iso), (Some(2.8), Some(400.0)));
        assert_eq!(shot.auto_exposure, Some(true));
        assert_eq!(shot.auto_white_balance, Some(false));
        let all = Stated {
            iso: true,
            f_number: true,
        };
        let exposure = shot.exposure(&all).unwrap();
        assert!((exposure - 0.0125 * 400.0 / 7.84).abs() < 1e-12);
        for zero in [
            ratio(Tag::ExposureTime, 0, 1),
            ratio(Tag::ExposureTime, 1, 0),
        ] {
            let shot = Shot::of_bytes(&with_exif(&[0xff, 0xd8, 0xff, 0xd9], &[zero]));
            assert_eq!(shot.time_s, None);
            let wrong = shot.wrong.unwrap();
            assert!(wrong.contains("exposure time"), "{wrong}");
        }
        assert_eq!(Shot::of_bytes(b"nothing"), Shot::default());
    }
}
