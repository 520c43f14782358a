//! The shaders, embedded and composed.

#[path = "../../../lanes/build/compose.rs"]
mod composition;

use super::GpuError;

macro_rules! sources {
    ($($name:literal),+ $(,)?) => {
        /// Every shader file: its path below `shaders/` and its text.
        pub const SOURCES: &[(&str, &str)] = &[
            $(($name, include_str!(concat!("../../../../shaders/", $name, ".wgsl")))),+
        ];
    };
}

sources![
    "common/layout",
    "common/settings",
    "common/tables",
    "common/math",
    "common/rng",
    "common/phase",
    "common/medium",
    "common/interface",
    "common/bvh",
    "common/light",
    "common/film",
    "common/lane",
    "common/camera",
    "common/order",
    "common/bridge",
    "common/unfold",
    "common/ways",
    "common/lamp_walk",
    "common/lamp_join",
    "common/lamp_landing",
    "common/lamp_path",
    "common/direct_lamps",
    "common/daylight",
    "common/ambient_held",
    "common/ambient_flight",
    "common/ambient_walk",
    "common/ambient_path",
    "common/noise",
    "common/picture",
    "kernels/lamps",
    "kernels/ambient",
    "kernels/hold",
    "kernels/statistics",
    "kernels/show",
    "probe/inputs",
    "probe/functions",
    "probe/lamps",
    "probe/daylight",
];

/// Shaders with an entry point.
pub const KERNELS: &[&str] = &[
    "kernels/lamps",
    "kernels/ambient",
    "kernels/hold",
    "kernels/statistics",
    "kernels/show",
    "probe/functions",
    "probe/lamps",
    "probe/daylight",
];

/// The text of a shader with everything that it imports.
///
/// # Errors
/// [`GpuError::Shader`] when it does not exist or an import fails: a fault of the shaders, not of their use.
pub fn compose(name: &str) -> Result<String, GpuError> {
    composition::compose(SOURCES.iter().copied(), name).map_err(|reason| GpuError::Shader {
        name: name.to_owned(),
        reason,
    })
}
