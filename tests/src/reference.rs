//! Reference numbers kept in `data/`.

use crate::{file, tiles::Tiles};

/// Reads `data/reference_NAME.csv`: tile means and standard errors of a converged picture.
///
/// # Panics
/// When the file is missing or malformed.
pub fn tiles(name: &str) -> Tiles {
    let path = file(&format!("data/reference_{name}.csv"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut tiles = Tiles {
        mean: Vec::new(),
        standard_error: Vec::new(),
    };
    for line in text.lines().skip(1) {
        let v: Vec<f64> = line
            .split(',')
            .map(|x| x.parse().expect("a number"))
            .collect();
        tiles.mean.push([v[2], v[3], v[4]]);
        tiles.standard_error.push([v[5], v[6], v[7]]);
    }
    tiles
}
