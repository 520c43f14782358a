//! Conditions of the kernels: none that uniform buffers decide alone. lavapipe (Mesa 22.3) may compile a kernel anew for
//! every dispatch where there is one (`shaders/common/settings.wgsl`).

use naga::{
    AddressSpace, Block, Expression as E, Function, Handle, Module, Statement, front::wgsl,
};
use uw_render::gpu::shaders::compose;

use crate::gpu_shaders::module;

#[test]
fn conditions_depend_on_more_than_uniforms() {
    for name in ["kernels/lamps", "kernels/ambient"] {
        assert_eq!(uniform_conditions(&module(name)), Vec::<String>::new());
    }
    let text = compose("kernels/lamps").unwrap_or_else(|e| panic!("{e}"));
    for (from, to) in [
        ("if !is_forced()", "if dispatch.forced == 0u"),
        ("probe < loop_probe()", "probe < dispatch.loop_probe"),
    ] {
        assert!(text.contains(from), "{from} is no part of the kernel");
        let module = wgsl::parse_str(&text.replace(from, to)).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(uniform_conditions(&module), ["lane_end"], "{from}");
    }
}

/// Functions with a condition that only uniform buffers and local counters decide.
fn uniform_conditions(module: &Module) -> Vec<String> {
    let mut found = Vec::new();
    for function in module.functions.iter().map(|(_, f)| f).chain(
        module
            .entry_points
            .iter()
            .map(|entry_point| &entry_point.function),
    ) {
        let mut conditions = Vec::new();
        collect_conditions(&function.body, &mut conditions);
        if conditions
            .iter()
            .any(|&c| depends_on(module, function, c) == Depends::Uniform)
        {
            found.push(function.name.clone().unwrap_or_default());
        }
    }
    found
}

fn collect_conditions(block: &Block, found: &mut Vec<Handle<E>>) {
    for statement in block.iter() {
        match statement {
            Statement::Block(inner) => collect_conditions(inner, found),
            Statement::If {
                condition,
                accept,
                reject,
            } => {
                found.push(*condition);
                collect_conditions(accept, found);
                collect_conditions(reject, found);
            }
            Statement::Switch { selector, cases } => {
                found.push(*selector);
                for case in cases {
                    collect_conditions(&case.body, found);
                }
            }
            Statement::Loop {
                body,
                continuing,
                break_if,
            } => {
                found.extend(break_if);
                collect_conditions(body, found);
                collect_conditions(continuing, found);
            }
            _ => {}
        }
    }
}

/// What a value depends on; the last of several parts counts. Arguments of functions and other globals are taken for more.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Depends {
    /// Constants and local variables, which may count a loop.
    Nothing,
    Uniform,
    More,
}

fn depends_on(module: &Module, function: &Function, expression: Handle<E>) -> Depends {
    let of = |handle| depends_on(module, function, handle);
    match &function.expressions[expression] {
        E::Literal(_) | E::Constant(_) | E::Override(_) | E::ZeroValue(_) => Depends::Nothing,
        E::LocalVariable(_) => Depends::Nothing,
        E::GlobalVariable(global) => match module.global_variables[*global].space {
            AddressSpace::Uniform => Depends::Uniform,
            _ => Depends::More,
        },
        E::Load { pointer } => of(*pointer),
        E::AccessIndex { base, .. } => of(*base),
        E::Access { base, index } => of(*base).max(of(*index)),
        E::Splat { value, .. } => of(*value),
        E::Swizzle { vector, .. } => of(*vector),
        E::Compose { components, .. } => components
            .iter()
            .map(|&c| of(c))
            .max()
            .unwrap_or(Depends::Nothing),
        E::Unary { expr, .. } | E::As { expr, .. } => of(*expr),
        E::Binary { left, right, .. } => of(*left).max(of(*right)),
        E::Select {
            condition,
            accept,
            reject,
        } => of(*condition).max(of(*accept)).max(of(*reject)),
        E::Relational { argument, .. } => of(*argument),
        _ => Depends::More,
    }
}
