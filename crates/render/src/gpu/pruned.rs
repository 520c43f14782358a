//! Shaders without what their switches leave out. A driver sees that a branch is never taken after it has put all functions into one and
//! worked on that for long; most of a kernel belongs to what a scene does not have, so that it is not given to the driver.

use naga::{
    Arena, Block, Constant, Expression, Function, Handle, Literal, LocalVariable, Module,
    Statement, UnaryOperator,
    compact::{KeepUnused, compact},
};

/// The module of the shader `text`, whose `switches` are constants that are 0 or 1, without branches that these never take and without
/// functions that are then not called.
///
/// # Errors
/// The shader's first fault, with its place, or a switch that it does not have.
pub(super) fn pruned(text: &str, switches: &[(&str, f64)]) -> Result<Module, String> {
    let mut text = text.to_owned();
    for &(name, value) in switches {
        text = fixed(&text, name, value != 0.0).ok_or_else(|| format!("no switch {name}"))?;
    }
    let mut module = naga::front::wgsl::parse_str(&text).map_err(|e| e.emit_to_string(&text))?;
    let constants = Constants {
        all: &module.constants,
        values: &module.global_expressions,
    };
    for (_, function) in module.functions.iter_mut() {
        prune(function, &constants);
    }
    for entry in &mut module.entry_points {
        prune(&mut entry.function, &constants);
    }
    compact(&mut module, KeepUnused::No);
    Ok(module)
}

/// The text with a constant in the place of the switch that can be set; none where it has no such switch.
fn fixed(text: &str, name: &str, value: bool) -> Option<String> {
    let (before, rest) = text.split_once(&format!("override {name}: bool = "))?;
    let (_, after) = rest.split_once(';')?;
    Some(format!("{before}const {name}: bool = {value};{after}"))
}

/// A module's constants.
struct Constants<'a> {
    all: &'a Arena<Constant>,
    values: &'a Arena<Expression>,
}

impl Constants<'_> {
    fn truth(&self, constant: Handle<Constant>) -> Option<bool> {
        literal_truth(&self.values[self.all[constant].init])
    }
}

fn literal_truth(expression: &Expression) -> Option<bool> {
    match expression {
        Expression::Literal(Literal::Bool(value)) => Some(*value),
        _ => None,
    }
}

/// Takes branches out of a function for as long as that tells of others. Names go too, which would keep results of calls that are gone.
fn prune(function: &mut Function, constants: &Constants<'_>) {
    function.named_expressions.clear();
    loop {
        let known = Known::of(function, constants);
        let body = std::mem::take(&mut function.body);
        let mut taken = 0;
        function.body = without_dead(body, &known, &mut taken);
        if taken == 0 {
            break;
        }
    }
}

/// What is known of a function's conditions.
struct Known(Vec<Option<bool>>);

impl Known {
    fn of(function: &Function, constants: &Constants<'_>) -> Self {
        let mut known = Self(Vec::with_capacity(function.expressions.len()));
        let mut stores = Vec::new();
        stored(&function.body, &mut stores);
        for (_, expression) in function.expressions.iter() {
            let truth = match *expression {
                Expression::Constant(constant) => constants.truth(constant),
                Expression::Unary {
                    op: UnaryOperator::LogicalNot,
                    expr,
                } => known.truth(expr).map(|truth| !truth),
                Expression::Load { pointer } => known.in_variable(function, pointer, &stores),
                ref other => literal_truth(other),
            };
            known.0.push(truth);
        }
        known
    }

    fn truth(&self, expression: Handle<Expression>) -> Option<bool> {
        self.0.get(expression.index()).copied().flatten()
    }

    /// What a nameless variable holds: the one of `&&` and `||`, into which each of two branches stores, before it is loaded. Where
    /// one of them has been taken out it holds what the other stores.
    fn in_variable(
        &self,
        function: &Function,
        pointer: Handle<Expression>,
        stores: &[(Handle<Expression>, Handle<Expression>)],
    ) -> Option<bool> {
        let variable = variable_of(function, pointer)?;
        if function.local_variables[variable].name.is_some() {
            return None;
        }
        let mut into = stores
            .iter()
            .filter(|(pointer, _)| variable_of(function, *pointer) == Some(variable));
        match (into.next(), into.next()) {
            (Some((_, value)), None) => self.truth(*value),
            _ => None,
        }
    }
}

fn variable_of(function: &Function, pointer: Handle<Expression>) -> Option<Handle<LocalVariable>> {
    match function.expressions[pointer] {
        Expression::LocalVariable(variable) => Some(variable),
        _ => None,
    }
}

/// Adds all pointers that a block stores to, and what.
fn stored(block: &Block, stores: &mut Vec<(Handle<Expression>, Handle<Expression>)>) {
    for statement in block {
        match statement {
            Statement::Store { pointer, value } => stores.push((*pointer, *value)),
            Statement::Block(inner) => stored(inner, stores),
            Statement::If { accept, reject, .. } => {
                stored(accept, stores);
                stored(reject, stores);
            }
            Statement::Loop {
                body, continuing, ..
            } => {
                stored(body, stores);
                stored(continuing, stores);
            }
            Statement::Switch { cases, .. } => {
                cases.iter().for_each(|case| stored(&case.body, stores));
            }
            _ => {}
        }
    }
}

/// The block with the branch that is taken in the place of each condition that is known, up to where it is left; counts these.
fn without_dead(block: Block, known: &Known, taken: &mut usize) -> Block {
    let mut kept = Block::with_capacity(block.len());
    for (mut statement, span) in block.span_into_iter() {
        match &mut statement {
            Statement::If {
                condition,
                accept,
                reject,
            } => {
                let accept = without_dead(std::mem::take(accept), known, taken);
                let reject = without_dead(std::mem::take(reject), known, taken);
                match known.truth(*condition) {
                    Some(truth) => {
                        *taken += 1;
                        kept.extend_block(if truth { accept } else { reject });
                    }
                    None => {
                        let condition = *condition;
                        let branches = Statement::If {
                            condition,
                            accept,
                            reject,
                        };
                        kept.push(branches, span);
                    }
                }
            }
            Statement::Block(inner) => {
                kept.extend_block(without_dead(std::mem::take(inner), known, taken));
            }
            Statement::Loop {
                body, continuing, ..
            } => {
                *body = without_dead(std::mem::take(body), known, taken);
                *continuing = without_dead(std::mem::take(continuing), known, taken);
                kept.push(statement, span);
            }
            Statement::Switch { cases, .. } => {
                for case in cases {
                    case.body = without_dead(std::mem::take(&mut case.body), known, taken);
                }
                kept.push(statement, span);
            }
            _ => kept.push(statement, span),
        }
        if kept.last().is_some_and(leaves) {
            break;
        }
    }
    kept
}

/// Whether nothing after the statement is reached.
fn leaves(statement: &Statement) -> bool {
    matches!(
        statement,
        Statement::Return { .. } | Statement::Break | Statement::Continue | Statement::Kill
    )
}

#[cfg(test)]
mod tests;
