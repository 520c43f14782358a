//! Shaders without a graphics adapter: every one is parsed and validated, every shared record compared field by field.

use naga::{
    Expression, Literal, Module, TypeInner,
    front::wgsl,
    valid::{Capabilities, ValidationFlags, Validator},
};
use uw_render::gpu::{
    layout::{QUEUED_ROWS, QUEUED_ROWS_WITH_ORIGIN, record_layouts},
    shaders::{KERNELS, SOURCES, compose},
};

pub(crate) fn module(name: &str) -> Module {
    let text = compose(name).unwrap_or_else(|e| panic!("{e}"));
    wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&text)))
}

#[test]
fn every_shader_is_valid() {
    for name in KERNELS {
        let module = module(name);
        let text = compose(name).unwrap_or_else(|e| panic!("{e}"));
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        let result = validator.validate(&module);
        assert!(
            result.is_ok(),
            "{name}: {}",
            result.map_or_else(|e| e.emit_to_string(&text), |_| String::new())
        );
    }
}

/// Not only what kernels reach: each file by itself imports what it names.
#[test]
fn every_file_is_valid() {
    for (name, _) in SOURCES {
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        if let Err(error) = validator.validate(&module(name)) {
            panic!("{name}: {error}");
        }
    }
}

/// Drivers, and the backend itself, keep compiled kernels by their text.
#[test]
fn a_shader_always_has_one_text() {
    for name in KERNELS {
        let texts: Vec<_> = (0..4).map(|_| compose(name).ok()).collect();
        assert!(
            texts[0].is_some() && texts.iter().all(|t| *t == texts[0]),
            "{name}"
        );
    }
}

/// The shader that the viewer draws the picture with.
#[test]
fn the_viewers_shader_is_valid() {
    let text = include_str!("../../crates/viewer/src/ui/canvas.wgsl");
    let module = wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    if let Err(error) = validator.validate(&module) {
        panic!("{}", error.emit_to_string(text));
    }
}

/// Every kernel, and the file of the records: those that are read field by field are in no kernel.
fn modules() -> Vec<Module> {
    let names = KERNELS.iter().chain(&["common/layout"]);
    names.map(|name| module(name)).collect()
}

/// Fields by name and offset, so that two swapped fields of one type and size are caught too.
#[test]
fn shared_records_have_one_layout() {
    assert_eq!(layout_faults(&modules()), Vec::<String>::new());
}

/// Rows of scratch memory that the kernel takes for a sample, and the host makes room for.
#[test]
fn held_samples_have_room() {
    let module = module("kernels/ambient");
    for (name, expected) in [
        ("QUEUED_ROWS", QUEUED_ROWS),
        ("QUEUED_ROWS_WITH_ORIGIN", QUEUED_ROWS_WITH_ORIGIN),
    ] {
        let rows = module.constants.iter().find_map(|(_, constant)| {
            let named = constant.name.as_deref() == Some(name);
            named.then(|| &module.global_expressions[constant.init])
        });
        assert!(
            matches!(rows, Some(Expression::Literal(Literal::U32(rows))) if *rows == expected),
            "{name}: {rows:?}"
        );
    }
}

/// The comparison sees what it is for: two fields of one type exchanged, and one too many.
#[test]
fn a_changed_record_is_seen() {
    let text = compose("common/layout").unwrap_or_else(|e| panic!("{e}"));
    let swapped = with_fields_of(&text, "Scene", |fields| {
        let marked = fields.replacen(" ln_b:", " marked:", 1);
        marked
            .replacen(" c:", " ln_b:", 1)
            .replacen(" marked:", " c:", 1)
    });
    let longer = with_fields_of(&text, "Lamp", |fields| format!("another: f32,{fields}"));
    for (record, changed) in [("Scene", swapped), ("Lamp", longer)] {
        let module =
            wgsl::parse_str(&changed).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&changed)));
        let mut modules = modules();
        modules.push(module);
        assert_eq!(layout_faults(&modules), [record]);
    }
}

/// `text` with the fields of one of its records changed.
fn with_fields_of(text: &str, record: &str, change: impl FnOnce(&str) -> String) -> String {
    let opening = format!("struct {record} {{");
    let (before, rest) = text.split_once(&opening).expect("the record is there");
    let (fields, after) = rest.split_once('}').expect("the record ends");
    format!("{before}{opening}{}}}{after}", change(fields))
}

/// Names of the records whose fields, offsets or size differ from the host's, or which no module declares.
fn layout_faults(modules: &[Module]) -> Vec<String> {
    let mut faults = Vec::new();
    for (name, size, fields) in record_layouts() {
        let declared = modules.iter().flat_map(|module| module.types.iter());
        let layouts: Vec<_> = declared
            .filter(|(_, declared)| declared.name.as_deref() == Some(name))
            .filter_map(|(_, declared)| match &declared.inner {
                TypeInner::Struct { members, span } => Some((members, *span as usize)),
                _ => None,
            })
            .collect();
        let same = |(members, span): &(&Vec<naga::StructMember>, usize)| {
            let theirs = members
                .iter()
                .map(|m| (m.name.as_deref().unwrap_or(""), m.offset as usize));
            *span == size && theirs.eq(fields.iter().copied())
        };
        if layouts.is_empty() || !layouts.iter().all(same) {
            faults.push(name.to_owned());
        }
    }
    faults
}

/// Records that are read field by field have a function for each, which reads it from where the host puts it.
#[test]
fn fields_are_read_from_their_rows() {
    let text = compose("kernels/lamps").unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(row_faults(&text), Vec::<String>::new());
    let swapped = text
        .replacen("fn lamp_radius(", "fn marked(", 1)
        .replacen("fn lamp_cos_half_angle(", "fn lamp_radius(", 1)
        .replacen("fn marked(", "fn lamp_cos_half_angle(", 1);
    assert_eq!(row_faults(&swapped), ["lamp_radius", "lamp_cos_half_angle"]);
}

/// Names of functions that should read a field of a lamp or a triangle from `row(i, ROW)` and `.xyz` or a component, and
/// do not.
fn row_faults(text: &str) -> Vec<String> {
    let mut faults = Vec::new();
    for (name, _, fields) in record_layouts() {
        if !["Lamp", "Triangle"].contains(&name) {
            continue;
        }
        let record = name.to_lowercase();
        for (field, offset) in fields.iter().filter(|(f, _)| !f.starts_with("padding")) {
            let function = format!("{record}_{field}");
            let (row, component) = (offset / 16, &"xyzw"[offset % 16 / 4..][..1]);
            let call = format!("{record}_row(i, {row}u)");
            let reads = text
                .split_once(&format!("fn {function}(i: u32)"))
                .and_then(|(_, rest)| rest.split_once('}'))
                .and_then(|(body, _)| body.split_once(&call))
                .and_then(|(_, rest)| rest.split_once('.'));
            if !reads.is_some_and(|(_, swizzle)| swizzle.starts_with(component)) {
                faults.push(function);
            }
        }
    }
    faults
}
