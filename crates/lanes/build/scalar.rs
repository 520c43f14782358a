//! Functions of one lane in double precision: the control flow of the shader is Rust's.

use naga::{Block, Expression, Handle, Statement};

use crate::{
    function::{Scope, Writer},
    types::LaneType,
};

/// Functions that have a way of their own, and its text: those whose accuracy WGSL leaves open or whose series are made for
/// single precision, those that look at the bits of a number, and what rays meet, which the host knows better.
pub const BY_HAND: [(&str, &str); 10] = [
    ("expm1", "a0.exp_m1() }"),
    ("ln_1p", "a0.ln_1p() }"),
    ("minus_ln", "(-a0.ln()).max(0.0) }"),
    ("angle_of", "a0.atan2(a1) }"),
    ("quarter_turns", "cosine_and_sine_of_quarters(a0) }"),
    (
        "is_light",
        "a0.iter().all(|x| (0.0..f64::INFINITY).contains(x)) }",
    ),
    (
        "table_at",
        "piecewise_cubic(s.memory.near_rows, (a0, a1, a2), a3, a4) }",
    ),
    (
        "stored_table_at",
        "piecewise_cubic(s.memory.near_rows, (a0, a1, a2), a3, false) }",
    ),
    (
        "trace",
        "let (t, primitive, local) = s.memory.nearest(a0, a1, a2, (a3, a4)); RECORD { t, primitive, local } }",
    ),
    (
        "surface_point",
        "let Point { normal, shading_normal, reflectance, emission, material, roughness, metallic } = s.memory.surface_point(a0.primitive, a0.local, a1); \
         RECORD { normal, shading_normal, reflectance, emission, material: u64::from(material), roughness, metallic, dielectric: 0, towards: [0.0; 3] } }",
    ),
];

/// Whether a loop's body may go on before its end, apart from loops inside.
fn continues(block: &Block) -> bool {
    block.iter().any(|statement| match statement {
        Statement::Continue => true,
        Statement::If { accept, reject, .. } => continues(accept) || continues(reject),
        Statement::Block(inner) => continues(inner),
        _ => false,
    })
}

/// Labels of the innermost loop, and of its body where something follows that.
#[derive(Clone, Default)]
struct Labels {
    leave: String,
    go_on: String,
}

impl Writer<'_> {
    /// The body of a function.
    pub fn scalar_body(mut self, result: Option<&LaneType>) -> String {
        self.variables();
        self.plain_block(&self.function.body, &Labels::default());
        let end = result.map_or_else(String::new, |ty| self.types.zero(ty));
        // Never reached where there is a result; it tells the compiler the type.
        self.put(&format!("{end} }}"));
        self.code
    }

    fn plain_block(&mut self, block: &Block, labels: &Labels) {
        for statement in block {
            self.plain_statement(statement, labels);
        }
    }

    fn plain_statement(&mut self, statement: &Statement, labels: &Labels) {
        match statement {
            Statement::Emit(range) => {
                for handle in range.clone() {
                    self.emit(handle);
                }
            }
            Statement::Block(inner) => {
                self.put("{");
                self.plain_block(inner, labels);
                self.put("}");
            }
            Statement::If {
                condition,
                accept,
                reject,
            } => self.plain_branch(*condition, accept, reject, labels),
            Statement::Loop {
                body,
                continuing,
                break_if,
            } => self.plain_loop(body, continuing, *break_if),
            Statement::Break => self.put(&format!("break {};", labels.leave)),
            Statement::Continue => self.put(&format!("{};", labels.go_on)),
            Statement::Return { value } => {
                let value = value.map_or_else(String::new, |value| self.text(value));
                self.put(&format!("return {value};"));
            }
            Statement::Store { pointer, value } => {
                let value = self.text(*value);
                self.store(*pointer, &value, &Scope::of_one_lane());
            }
            Statement::Atomic { pointer, value, .. } => {
                let value = self.text(*value);
                let counter = self.counter(*pointer);
                self.put(&format!(
                    "{counter} = {counter}.wrapping_add({value} as u32);"
                ));
            }
            Statement::Call {
                function,
                arguments,
                result,
            } => self.call(*function, arguments, *result, "s"),
            other => panic!("a statement that kernels did not have: {other:?}"),
        }
    }

    fn plain_branch(
        &mut self,
        condition: Handle<Expression>,
        accept: &Block,
        reject: &Block,
        labels: &Labels,
    ) {
        let condition = self
            .switch_text(condition)
            .unwrap_or_else(|| self.text(condition));
        self.put(&format!("if {condition} {{"));
        self.plain_block(accept, labels);
        if !reject.is_empty() {
            self.put("} else {");
            self.plain_block(reject, labels);
        }
        self.put("}");
    }

    fn plain_loop(
        &mut self,
        body: &Block,
        continuing: &Block,
        break_if: Option<Handle<Expression>>,
    ) {
        let name = self.fresh_mask();
        let is_last = continuing.is_empty() && break_if.is_none();
        let labels = Labels {
            leave: format!("'l{name}"),
            go_on: if is_last {
                format!("continue 'l{name}")
            } else {
                format!("break 'b{name}")
            },
        };
        self.put(&format!("'l{name}: loop {{"));
        let has_label = !is_last && continues(body);
        if has_label {
            self.put(&format!("'b{name}: {{"));
        }
        self.plain_block(body, &labels);
        if has_label {
            self.put("}");
        }
        self.plain_block(continuing, &labels);
        if let Some(condition) = break_if {
            let condition = self.text(condition);
            self.put(&format!("if {condition} {{ break 'l{name}; }}"));
        }
        self.put("}");
    }
}
