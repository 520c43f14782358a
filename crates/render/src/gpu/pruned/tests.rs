use naga::valid::{Capabilities, ValidationFlags, Validator};

use super::pruned;
use crate::kernels::shaders::{KERNELS, compose};

const SHADER: &str = "\
override HAS_SUN: bool = true;
override HAS_FOG: bool = true;
@group(0) @binding(0) var<storage, read_write> out: array<f32>;
fn sun() -> f32 { return out[1]; }
fn fog(x: f32) -> bool { return x > out[2]; }
fn early() -> f32 {
    if !HAS_SUN { return 0.0; }
    return sun();
}
@compute @workgroup_size(1) fn main() {
    if HAS_FOG && HAS_SUN && fog(out[3]) { out[0] = 1.0; }
    if HAS_SUN || fog(out[4]) { out[5] = early(); }
}
";

fn functions(switches: &[(&str, f64)]) -> Vec<String> {
    let module = pruned(SHADER, switches).expect("parsed");
    let functions = module.functions.iter();
    functions.filter_map(|(_, f)| f.name.clone()).collect()
}

#[test]
fn functions_stay_where_they_can_be_called() {
    let both = [("HAS_SUN", 1.0), ("HAS_FOG", 1.0)];
    assert_eq!(functions(&both), ["sun", "fog", "early"]);
    assert_eq!(functions(&[]), ["sun", "fog", "early"]);
    // What is left of `HAS_SUN || fog(..)` is the former.
    let no_fog = [("HAS_SUN", 1.0), ("HAS_FOG", 0.0)];
    assert_eq!(functions(&no_fog), ["sun", "early"]);
    // `early` returns before it comes to the sun.
    let no_sun = [("HAS_SUN", 0.0), ("HAS_FOG", 1.0)];
    assert_eq!(functions(&no_sun), ["fog", "early"]);
}

const QUESTIONS: &str = "\
override HAS_GLOSS: bool = true;
@group(0) @binding(0) var<storage, read_write> out: array<f32>;
fn shines(x: f32) -> bool { return HAS_GLOSS && x > out[1]; }
fn is_dull(x: f32) -> bool { return !shines(x) || x > out[2]; }
fn either(x: f32) -> bool {
    if x > out[3] { return shines(x); }
    return !HAS_GLOSS;
}
fn gloss() -> f32 { return out[4]; }
fn matt() -> f32 { return out[5]; }
fn undecided() -> f32 { return out[6]; }
@compute @workgroup_size(1) fn main() {
    if out[7] > 1.0 && shines(out[8]) { out[9] = gloss(); }
    if is_dull(out[10]) { out[11] = matt(); } else { out[11] = gloss(); }
    if either(out[12]) { out[13] = undecided(); }
}
";

#[test]
fn functions_that_always_return_the_same_decide_where_they_are_called() {
    let kept = |value: f64| {
        let module = pruned(QUESTIONS, &[("HAS_GLOSS", value)]).expect("parsed");
        let names = module.functions.iter().filter_map(|(_, f)| f.name.clone());
        names.collect::<Vec<_>>()
    };
    let all = ["shines", "is_dull", "either", "gloss", "matt", "undecided"];
    assert_eq!(kept(1.0), all);
    assert_eq!(
        kept(0.0),
        ["shines", "is_dull", "either", "matt", "undecided"]
    );
}

#[test]
fn a_switch_that_is_none_is_named() {
    let known = pruned(SHADER, &[("HAS_MOON", 1.0)]);
    assert_eq!(known.err().as_deref(), Some("no switch HAS_MOON"));
}

/// Functions of a kernel's module whose switches are all `value`.
fn functions_of(kernel: &str, value: f64) -> Vec<String> {
    let text = compose(kernel).expect("composed");
    let declared = text.split("override ").skip(1);
    let names = declared.filter_map(|rest| rest.split(':').next());
    let switches: Vec<_> = names.map(|name| (name, value)).collect();
    let module = pruned(&text, &switches).unwrap_or_else(|e| panic!("{kernel}: {e}"));
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    let validated = validator.validate(&module);
    assert!(validated.is_ok(), "{kernel}: {validated:?}");
    let functions = module.functions.iter();
    functions.filter_map(|(_, f)| f.name.clone()).collect()
}

#[test]
fn kernels_are_valid_with_every_switch_on_and_off() {
    for kernel in KERNELS {
        let [on, off] = [1.0, 0.0].map(|value| functions_of(kernel, value));
        if ["kernels/lamps", "kernels/ambient"].contains(kernel) {
            for name in ["layered_distance", "trace_triangles"] {
                let is_in = |functions: &[String]| functions.iter().any(|f| f == name);
                assert!(is_in(&on) && !is_in(&off), "{kernel}: {name}");
            }
        }
    }
}
