//! Shaders without a graphics adapter: every one is parsed and validated, every shared record compared field by field.

use naga::{
    Module, TypeInner,
    front::wgsl,
    valid::{Capabilities, ValidationFlags, Validator},
};
use uw_render::gpu::{
    layout::record_layouts,
    shaders::{KERNELS, compose},
};

fn module(name: &str) -> Module {
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

/// Fields by name and offset, so that two swapped fields of one type and size are caught too.
#[test]
fn shared_records_have_one_layout() {
    let modules: Vec<Module> = KERNELS.iter().map(|name| module(name)).collect();
    for (name, size, fields) in record_layouts() {
        let mut found = 0;
        for module in &modules {
            for (_, declared) in module.types.iter() {
                let TypeInner::Struct { members, span } = &declared.inner else {
                    continue;
                };
                if declared.name.as_deref() != Some(name) {
                    continue;
                }
                found += 1;
                let theirs: Vec<(&str, usize)> = members
                    .iter()
                    .map(|m| (m.name.as_deref().unwrap_or(""), m.offset as usize))
                    .collect();
                assert_eq!(theirs, fields, "{name}");
                assert_eq!(*span as usize, size, "{name}");
            }
        }
        assert!(found > 0, "no shader has a record {name}");
    }
}
