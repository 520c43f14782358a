//! A kernel as a Rust module: its records, the state of a group of lanes, its functions.

use std::fmt::Write;

use naga::{AddressSpace, Module, TypeInner, valid::ModuleInfo};

use crate::{
    function::{Form, Writer},
    types::{LaneType, Types, list},
};

/// Records that lie in memory and are read word by word.
const IN_MEMORY: [&str; 3] = ["Scene", "Dispatch", "Counters"];

/// Functions that are called both in water that is the same everywhere and in water that varies. The compiler inlines a
/// function with one caller, so each caller has its own: with one for both, scenes with a sun took 7 % longer.
const COPIED: [&str; 4] = [
    "attenuation_integral",
    "attenuation_sample",
    "sun_reaches",
    "may_be_shadowed",
];

/// Functions of water that varies which are called from one place and large: inlined there they would keep the functions
/// around them from being inlined.
const APART: [&str; 1] = ["sunlight_in_layers"];

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
    let mut functions = Vec::new();
    for (handle, function) in module.functions.iter() {
        let name = function.name.as_deref().unwrap_or_default();
        let writer = Writer::new(&types, function, &info[handle], form);
        let apart = if APART.contains(&name) {
            "#[inline(never)] "
        } else {
            ""
        };
        functions.push((name, writer.function(name, &format!("{apart}{attribute}"))));
    }
    for (index, entry) in module.entry_points.iter().enumerate() {
        let writer = Writer::new(&types, &entry.function, info.get_entry_point(index), form);
        functions.push((&entry.name, writer.function(&entry.name, attribute)));
    }
    code + &with_copies(functions)
}

/// The texts of all functions, one after the other; those of [`COPIED`] once for each function that calls them.
fn with_copies(functions: Vec<(&str, String)>) -> String {
    let call = |name: &str| format!("shader_{name}(");
    let (copied, mut others): (Vec<_>, Vec<_>) =
        (functions.into_iter()).partition(|(name, _)| COPIED.contains(name));
    let mut copies = String::new();
    for (caller, text) in &mut others {
        for (name, body) in &copied {
            if text.contains(&call(name)) {
                let own = call(&format!("{name}_in_{caller}"));
                *text = text.replace(&call(name), &own);
                copies += &body.replace(&call(name), &own);
            }
        }
    }
    others
        .into_iter()
        .fold(copies, |code, (_, text)| code + &text)
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
