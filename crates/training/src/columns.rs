//! Stage 1: the inputs and outputs of the network, the one place where their names and units stand.

/// Most inputs of a network; rows have room for so many, those that a network does not have are 0.
pub const INPUTS: usize = 26;
/// Outputs of the network: contrast in R, G, B.
pub const OUTPUTS: usize = 3;
/// Contrast, in 8-bit counts, that the network sees as 1; the unit of the published error figures.
pub const CONTRAST_SCALE_COUNTS: f32 = 15.0;
/// Names of the outputs in order, all in 8-bit counts.
pub const OUTPUT_NAMES: [&str; OUTPUTS] = ["contrast_r", "contrast_g", "contrast_b"];
/// Columns with the standard errors of the inputs `std_*`, which a table may have.
pub const STD_ERRORS: [&str; OUTPUTS] = ["std_error_r", "std_error_g", "std_error_b"];
/// Unit of the outputs in the model file.
pub const OUTPUT_UNIT: &str = "8bit_counts";
/// Column that names the environment (texture, water and backscatter) of a row.
pub const ENVIRONMENT: &str = "environment";

/// One input of the network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Input {
    /// Name in the dataset's header and in the model file.
    pub name: &'static str,
    /// Unit as the model file writes it: `1`, `8bit_counts`, `m` or `percent`.
    pub unit: &'static str,
    /// True for values read from a calibration profile.
    pub calibration: bool,
}

const fn calibrated(name: &'static str, unit: &'static str) -> Input {
    Input {
        name,
        unit,
        calibration: true,
    }
}

const fn observed(name: &'static str, unit: &'static str) -> Input {
    Input {
        name,
        unit,
        calibration: false,
    }
}

/// How the candidate distance and lamp level are given to the network. Both carry the same
/// information, because the present distance and level are inputs as well.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Offsets {
    /// As changes from the present: `delta_distance`, `delta_light`.
    Delta,
    /// As absolute values: `target_distance`, `target_light`.
    Target,
    /// As absolute values, with what the calibration says about the candidate's distance: `target_kc_on_*`,
    /// `target_kc_off_*`.
    Ahead,
}

impl Offsets {
    /// The word that stands for it on the command line and in the report.
    pub fn word(self) -> &'static str {
        match self {
            Self::Delta => "delta",
            Self::Target => "target",
            Self::Ahead => "ahead",
        }
    }
}

/// The inputs in the order in which the network and the model file have them.
pub fn inputs(offsets: Offsets) -> Vec<Input> {
    let (candidate_distance, candidate_light) = match offsets {
        Offsets::Delta => ("delta_distance", "delta_light"),
        Offsets::Target | Offsets::Ahead => ("target_distance", "target_light"),
    };
    let mut all = vec![
        calibrated("kz_r", "1"),
        calibrated("kz_g", "1"),
        calibrated("kz_b", "1"),
        calibrated("kc_on_r", "8bit_counts"),
        calibrated("kc_on_g", "8bit_counts"),
        calibrated("kc_on_b", "8bit_counts"),
        calibrated("kc_off_r", "8bit_counts"),
        calibrated("kc_off_g", "8bit_counts"),
        calibrated("kc_off_b", "8bit_counts"),
        observed("distance", "m"),
        observed("light", "percent"),
        observed("depth", "m"),
        observed("mean_r", "8bit_counts"),
        observed("mean_g", "8bit_counts"),
        observed("mean_b", "8bit_counts"),
        observed("std_r", "8bit_counts"),
        observed("std_g", "8bit_counts"),
        observed("std_b", "8bit_counts"),
        observed(candidate_distance, "m"),
        observed(candidate_light, "percent"),
    ];
    if offsets == Offsets::Ahead {
        all.extend([
            calibrated("target_kc_on_r", "8bit_counts"),
            calibrated("target_kc_on_g", "8bit_counts"),
            calibrated("target_kc_on_b", "8bit_counts"),
            calibrated("target_kc_off_r", "8bit_counts"),
            calibrated("target_kc_off_g", "8bit_counts"),
            calibrated("target_kc_off_b", "8bit_counts"),
        ]);
    }
    all
}
