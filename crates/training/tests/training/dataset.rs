//! Tables of a known function, written as a dataset file.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Columns of the tables, more than are needed and in no special order.
pub(crate) const HEADER: &str = "entry,environment,delta_distance,delta_light,target_distance,target_light,\
    kz_r,kz_g,kz_b,kc_on_r,kc_on_g,kc_on_b,kc_off_r,kc_off_g,kc_off_b,distance,light,depth,\
    mean_r,mean_g,mean_b,std_r,std_g,std_b,contrast_r,contrast_g,contrast_b";

/// Number of different environments in a table.
pub(crate) const ENVIRONMENTS: usize = 8;

/// Numbers in [0, 1) from a Weyl sequence, a different one per row and slot.
fn unit(row: usize, slot: usize) -> f64 {
    (row as f64 * 0.754_877_666 + slot as f64 * 0.569_840_291 + (row * slot) as f64 * 0.362_5)
        .fract()
}

/// A table of `rows` rows in which contrast falls exponentially with the new distance at a rate
/// set by the environment, and rises with the new lamp level. The rate shows only in the
/// calibration inputs, so that leaving them out must hurt.
pub(crate) fn text(rows: usize) -> String {
    let mut text = format!("{HEADER}\n");
    for row in 0..rows {
        let environment = row % ENVIRONMENTS;
        let rate = 0.2 + 0.15 * environment as f64;
        let distance = 0.5 + 2.5 * unit(row, 1);
        let light = 100.0 * unit(row, 2);
        let depth = 1.0 + 4.0 * unit(row, 3);
        let target_distance = 0.5 + 2.5 * unit(row, 4);
        let target_light = 100.0 * unit(row, 5);
        let k_z = (-rate * depth).exp();
        let k_c = 20.0 * (-rate * distance).exp();
        let contrast = 20.0 * (-rate * target_distance).exp() * (0.3 + 0.007 * target_light);
        write!(
            text,
            "{row},env{environment},{},{},{target_distance},{target_light}",
            target_distance - distance,
            target_light - light,
        )
        .expect("strings take everything");
        for value in [
            k_z,
            0.9 * k_z,
            0.8 * k_z,
            k_c,
            0.9 * k_c,
            0.8 * k_c,
            0.5 * k_c,
            0.4 * k_c,
            0.3 * k_c,
        ] {
            write!(text, ",{value}").expect("strings take everything");
        }
        write!(text, ",{distance},{light},{depth},80,90,100,5,5,5")
            .expect("strings take everything");
        writeln!(text, ",{contrast},{},{}", 0.9 * contrast, 0.8 * contrast)
            .expect("strings take everything");
    }
    text
}

/// An empty folder of the build folder, another one on every call.
pub(crate) fn empty_folder() -> PathBuf {
    static CALLS: AtomicUsize = AtomicUsize::new(0);
    let call = CALLS.fetch_add(1, Ordering::Relaxed);
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("uw-training-{call}"));
    if folder.exists() {
        std::fs::remove_dir_all(&folder).expect("the build folder is writable");
    }
    std::fs::create_dir_all(&folder).expect("the build folder is writable");
    folder
}

/// Writes a dataset file into `folder`.
pub(crate) fn write(folder: &Path, text: &str) -> PathBuf {
    let path = folder.join("dataset.csv");
    std::fs::write(&path, text).expect("the test's folder is writable");
    path
}
