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
    let mut outside = Outside {
        constants: &module.constants,
        values: &module.global_expressions,
        returned: Vec::with_capacity(module.functions.len()),
    };
    // Those that a function calls come before it.
    for (_, function) in module.functions.iter_mut() {
        let returned = prune(function, &outside);
        outside.returned.push(returned);
    }
    for entry in &mut module.entry_points {
        prune(&mut entry.function, &outside);
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

/// What is known outside a function: a module's constants, and what each function so far returns if that is always the same.
struct Outside<'a> {
    constants: &'a Arena<Constant>,
    values: &'a Arena<Expression>,
    returned: Vec<Option<bool>>,
}

impl Outside<'_> {
    fn constant(&self, constant: Handle<Constant>) -> Option<bool> {
        literal_truth(&self.values[self.constants[constant].init])
    }

    fn result(&self, called: Handle<Function>) -> Option<bool> {
        self.returned.get(called.index()).copied().flatten()
    }
}

fn literal_truth(expression: &Expression) -> Option<bool> {
    match expression {
        Expression::Literal(Literal::Bool(value)) => Some(*value),
        _ => None,
    }
}

/// Takes branches out of a function for as long as that tells of others, and tells what it returns if that is always the same. Names go
/// too, which would keep results of calls that are gone.
fn prune(function: &mut Function, outside: &Outside<'_>) -> Option<bool> {
    function.named_expressions.clear();
    loop {
        let known = Known::of(function, outside);
        let body = std::mem::take(&mut function.body);
        let mut taken = 0;
        function.body = without_dead(body, &known, &mut taken);
        if taken == 0 {
            let mut values = Vec::new();
            returned(&function.body, &mut values);
            return known.only(values.into_iter());
        }
    }
}

/// What is known of a function's conditions.
struct Known(Vec<Option<bool>>);

impl Known {
    fn of(function: &Function, outside: &Outside<'_>) -> Self {
        let mut known = Self(Vec::with_capacity(function.expressions.len()));
        let mut stores = Vec::new();
        stored(&function.body, &mut stores);
        for (_, expression) in function.expressions.iter() {
            let truth = match *expression {
                Expression::Constant(constant) => outside.constant(constant),
                Expression::CallResult(called) => outside.result(called),
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
        let into = stores
            .iter()
            .filter(|(pointer, _)| variable_of(function, *pointer) == Some(variable));
        self.only(into.map(|&(_, value)| value))
    }

    /// What all `values` are, where there are any.
    fn only(&self, mut values: impl Iterator<Item = Handle<Expression>>) -> Option<bool> {
        let first = self.truth(values.next()?)?;
        values
            .all(|value| self.truth(value) == Some(first))
            .then_some(first)
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
        if let Statement::Store { pointer, value } = statement {
            stores.push((*pointer, *value));
        }
        for inner in blocks(statement) {
            stored(inner, stores);
        }
    }
}

/// Adds all that a block returns.
fn returned(block: &Block, values: &mut Vec<Handle<Expression>>) {
    for statement in block {
        if let Statement::Return { value: Some(value) } = statement {
            values.push(*value);
        }
        for inner in blocks(statement) {
            returned(inner, values);
        }
    }
}

/// The blocks of a statement.
fn blocks(statement: &Statement) -> Vec<&Block> {
    match statement {
        Statement::Block(inner) => vec![inner],
        Statement::If { accept, reject, .. } => vec![accept, reject],
        Statement::Loop {
            body, continuing, ..
        } => vec![body, continuing],
        Statement::Switch { cases, .. } => cases.iter().map(|case| &case.body).collect(),
        _ => Vec::new(),
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
