//! What all plots share.

use plotters::style::{FontStyle, register_font};

/// Makes the embedded font (DejaVu Sans) known as "sans-serif", so that plots need no font on the system.
pub fn use_font() -> Result<(), String> {
    register_font("sans-serif", FontStyle::Normal, dejavu::sans::regular())
        .map_err(|_| "the embedded font cannot be read".to_owned())
}
