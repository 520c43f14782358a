//! The one way into the decoders of PNG, TIFF and JPEG, so that they are compiled for one type.

use std::io::{self, BufReader, Read, Seek};

use image::ImageReader;

/// What files and memory have in common.
pub(crate) trait Encoded: Read + Seek {}

impl<T: Read + Seek> Encoded for T {}

/// Reads an encoded picture, whose format is guessed from its first bytes.
pub(crate) type Reader<'a> = ImageReader<BufReader<Box<dyn Encoded + 'a>>>;

/// A reader of a file or of bytes in memory.
pub(crate) fn reader<'a>(encoded: impl Encoded + 'a) -> io::Result<Reader<'a>> {
    let encoded: Box<dyn Encoded + 'a> = Box::new(encoded);
    ImageReader::new(BufReader::new(encoded)).with_guessed_format()
}
