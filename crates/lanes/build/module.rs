//! A kernel as a Rust module: its records, the state of a group of lanes, its functions.

use std::fmt::Write;

use naga::{AddressSpace, Module, TypeInner, valid::ModuleInfo};

use crate::{
    function::{Form, Writer},
    types::{LaneType, Types, list},
};

/// Records that lie in memory and are read word by word.
const IN_MEMORY: [&str; 3] = ["Scene", "Dispatch", "Counters"];

/// All of `module` in a form, with `attribute` before every function.
pub fn write(module: &Module, info: &ModuleInfo, form: Form, attribute: &str) -> String {
    let types = Types { module };
    let mut code = String::new();
    for (handle, ty) in module.types.iter() {
        let lanes = types.of(handle);
        let name = ty.name.as_deref().unwrap_or_default();
        if matches!(lanes.inner, TypeInner::Struct { .. }) && !IN_MEMORY.contains(&name) {
            record(&types, &lanes, form, attribute, &mut code);
        }
    }
    switches(module, &mut code);
    state(&types, form, attribute, &mut code);
    for (handle, function) in module.functions.iter() {
        let name = function.name.as_deref().unwrap_or_default();
        let writer = Writer::new(&types, function, &info[handle], form);
        code += &writer.function(name, attribute);
    }
    for (index, entry) in module.entry_points.iter().enumerate() {
        let writer = Writer::new(&types, &entry.function, info.get_entry_point(index), form);
        code += &writer.function(&entry.name, attribute);
    }
    code
}

fn put(code: &mut String, line: &str) {
    code.push_str(line);
    code.push('\n');
}

/// A record of lanes and the choices between two of them.
fn record(types: &Types<'_>, ty: &LaneType, form: Form, attribute: &str, code: &mut String) {
    let TypeInner::Struct { members, .. } = &ty.inner else {
        return;
    };
    let name = types.record(ty);
    let fields = || (0..members.len() as u32).filter_map(|i| types.field(ty, i));
    let declared = fields().map(|(field, t)| format!("{field}: {}", types.name(&t)));
    put(code, "#[derive(Clone, Copy)]");
    put(code, &format!("pub struct {name} {{ {} }}", list(declared)));
    if form == Form::Scalar {
        return;
    }
    for verb in ["sel", "keep"] {
        let chosen = fields().map(|(field, t)| {
            let (a, b) = (format!("a.{field}"), format!("b.{field}"));
            format!("{field}: {}", types.choice(verb, &t, "m", &a, &b))
        });
        put(code, &format!("#[inline] {attribute}"));
        put(
            code,
            &format!(
                "fn {verb}_{name}(m: B, a: {name}, b: {name}) -> {name} {{ {name} {{ {} }} }}",
                list(chosen)
            ),
        );
    }
}

/// The override constants: all are switches.
fn switches(module: &Module, code: &mut String) {
    let names: Vec<&str> = module
        .overrides
        .iter()
        .filter_map(|(_, o)| o.name.as_deref())
        .collect();
    let declared = names.iter().map(|name| format!("{name}: bool"));
    put(code, "#[allow(non_snake_case)] #[derive(Clone, Copy)]");
    put(
        code,
        &format!("pub struct Switches {{ {} }}", list(declared)),
    );
    let set = names
        .iter()
        .map(|name| format!("{name}: is_on(\"{name}\")"));
    put(
        code,
        &format!(
            "impl Switches {{ fn new(is_on: &dyn Fn(&str) -> bool) -> Self {{ Self {{ {} }} }} }}",
            list(set)
        ),
    );
}

/// Memory, switches and the private variables of a group of lanes.
fn state(types: &Types<'_>, form: Form, attribute: &str, code: &mut String) {
    let (mut declared, mut zeros) = (String::new(), String::new());
    for (_, variable) in types.module.global_variables.iter() {
        if variable.space == AddressSpace::Private {
            let name = variable.name.as_deref().unwrap_or_default();
            let ty = types.of(variable.ty);
            write!(declared, ", {name}: {}", types.name(&ty)).expect("strings take everything");
            write!(zeros, ", {name}: {}", types.zero(&ty)).expect("strings take everything");
        }
    }
    put(
        code,
        &format!("pub struct State<'a> {{ pub memory: Memory<'a>, switches: Switches{declared} }}"),
    );
    put(
        code,
        &format!(
            "{attribute} pub fn new<'a>(memory: Memory<'a>, is_on: &dyn Fn(&str) -> bool) -> State<'a> \
             {{ let switches = Switches::new(is_on); State {{ memory, switches{zeros} }} }}"
        ),
    );
    let arguments = match form {
        Form::Lanes => "s, bs(true), [lane_numbers(), us(0), us(0)]",
        Form::Scalar => "s, [us(0); 3]",
    };
    put(
        code,
        &format!("{attribute} pub fn run(s: &mut State) {{ shader_main({arguments}) }}"),
    );
}
