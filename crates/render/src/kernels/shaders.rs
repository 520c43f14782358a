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
    "common/spectrum",
    "common/phase",
    "common/interface",
    "common/layer_tables",
    "common/plumes",
    "common/layers",
    "common/layer_distance",
    "common/medium",
    "common/bvh",
    "common/surface",
    "common/gloss",
    "common/light",
    "common/film",
    "common/lane",
    "common/camera",
    "common/lens",
    "common/sight",
    "common/order",
    "common/bridge",
    "common/unfold",
    "common/subpath",
    "common/mis",
    "common/lamp_walk",
    "common/lamp_targets",
    "common/lamp_flight",
    "common/lamp_survival",
    "common/lamp_beam",
    "common/lamp_spot",
    "common/lamp_connect",
    "common/lamp_resampling",
    "common/lamp_path",
    "common/direct_lamps",
    "common/daylight",
    "common/ambient_queue",
    "common/air_lamps",
    "common/air_way",
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
];

/// Shaders with an entry point.
pub const KERNELS: &[&str] = &[
    "kernels/lamps",
    "kernels/ambient",
    "kernels/hold",
    "kernels/statistics",
    "kernels/show",
    "probe/functions",
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

#[cfg(test)]
mod tests {
    use super::composition::compose;

    const MATH: &str = "const TURN: f32 = 6.28;\n/// No { brace; no end.\n@must_use\nfn circle(x: f32) -> vec2f {\n    \
                        if x > 1.0 { return vec2f(0.0); }\n    return vec2f(TURN * x, x.other); // done\n}\n\
                        fn other() -> f32 { return 1.0; }\n";
    const LAYOUT: &str = "struct Row {\n    centre: vec2f,\n}\n\
                          @group(0) @binding(1) var<storage, read_write> rows: array<Row>;\n\
                          @group(0) @binding(0) var<uniform> scene: vec4f;\n";
    const KERNEL: &str = "import package::common::math::circle;\nimport package::common::layout::{\n    rows,\n};\n\n\
                          @compute @workgroup_size(64)\nfn main() { rows[0].centre = circle(0.5); }\n";

    fn composed(kernel: &str) -> Result<String, String> {
        let files = [
            ("common/math", MATH),
            ("common/layout", LAYOUT),
            ("kernels/a", kernel),
        ];
        compose(files, "kernels/a")
    }

    #[test]
    fn a_kernel_gets_what_it_reaches() {
        let text = "@compute @workgroup_size(64)\nfn main() { rows[0].centre = circle(0.5); }\n\
                    @group(0) @binding(1) var<storage, read_write> rows: array<Row>;\n\
                    @must_use\nfn circle(x: f32) -> vec2f {\n    if x > 1.0 { return vec2f(0.0); }\n    \
                    return vec2f(TURN * x, x.other);\n}\nconst TURN: f32 = 6.28;\nstruct Row {\n    centre: vec2f,\n}\n";
        assert_eq!(composed(KERNEL), Ok(text.to_owned()));
    }

    #[test]
    fn a_wrong_import_is_named() {
        let cases = [
            (
                "math::",
                "maths::",
                " imports circle from common/maths: there is no such shader",
            ),
            (
                "math::circle",
                "math::ring",
                " imports ring from common/math: it declares no such name",
            ),
            (
                "rows,",
                "rows, scene,",
                " imports scene from common/layout: the name is not used",
            ),
            (
                "fn main",
                "fn circle() {}\nfn main",
                " imports circle from common/math: the name is declared here too",
            ),
            ("rows,", "rows, rows,", ": rows is imported twice"),
            (
                "package::common::math::",
                "",
                ": \"import circle\" names nothing",
            ),
            (
                "fn main",
                "fn main() {}\nfn main",
                ": main is declared twice",
            ),
            (
                "};",
                "};\nenable f16;",
                ": \"enable f16;\" declares nothing",
            ),
            (" }\n", "", ": no end of \"@compute @workgroup_size(64)\""),
        ];
        for (from, to, fault) in cases {
            let changed = KERNEL.replacen(from, to, 1);
            assert_ne!(changed, KERNEL, "{from}");
            assert_eq!(composed(&changed), Err(format!("kernels/a{fault}")));
        }
        let error = compose([("kernels/a", KERNEL)], "kernels/b");
        assert!(error.is_err_and(|e| e.contains("common/")));
        let error = compose([("kernels/a", "fn main() {}")], "kernels/b");
        assert_eq!(error, Err("there is no shader kernels/b".to_owned()));
    }
}
