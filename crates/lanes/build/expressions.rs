//! Expressions: operators and functions of scalars, taken component by component.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, PI, TAU};

use naga::{
    BinaryOperator, Expression, Handle, Literal, MathFunction, RelationalFunction, Scalar,
    TypeInner, UnaryOperator,
};

use crate::{
    function::{Form, Writer},
    types::{count, letter, list, scalar},
};

type E = Handle<Expression>;

fn literal(literal: &Literal, form: Form) -> String {
    match literal {
        Literal::F32(x) if form == Form::Scalar => format!("fs({})", double(*x)),
        Literal::F32(x) => format!("fs({x:?}f32)"),
        Literal::U32(x) => format!("us({x})"),
        Literal::I32(x) => format!("is({x})"),
        Literal::Bool(x) => format!("bs({x})"),
        other => panic!("a literal that kernels did not have: {other:?}"),
    }
}

/// Numbers of the circle that shaders name, of which the parser leaves the digits of single precision.
const OF_THE_CIRCLE: [f64; 4] = [PI, TAU, FRAC_PI_2, FRAC_2_PI];

/// The number in double precision that was meant: one of the circle, a power of two itself, or that of its shortest decimal
/// form.
fn double(x: f32) -> String {
    let is_power_of_two = x.is_normal() && x.to_bits() & 0x7f_ffff == 0;
    if let Some(exact) = OF_THE_CIRCLE.iter().find(|&&exact| exact as f32 == x) {
        format!("{exact:?}f64")
    } else if is_power_of_two {
        format!("{:?}f64", f64::from(x))
    } else {
        format!("{x:?}f64")
    }
}

/// Component `i` of `name`, a scalar's being itself.
fn component(count: u32, name: &str, i: u32) -> String {
    if count == 1 {
        name.to_owned()
    } else {
        format!("{name}[{i}]")
    }
}

fn dot(a: &str, b: &str, count: u32) -> String {
    (1..count).fold(format!("fmul({a}[0], {b}[0])"), |sum, i| {
        format!("fadd({sum}, fmul({a}[{i}], {b}[{i}]))")
    })
}

impl Writer<'_> {
    /// An expression where it is used: its variable, or what it is.
    pub fn text(&self, expression: E) -> String {
        if self.named.contains(&expression) {
            format!("e{}", expression.index())
        } else {
            self.value(expression)
        }
    }

    /// A condition that is the same in every lane, because it hangs on switches alone.
    pub fn switch_text(&self, expression: E) -> Option<String> {
        Some(match &self.function.expressions[expression] {
            Expression::Override(switch) => {
                let name = self.types.module.overrides[*switch].name.as_deref();
                format!("s.switches.{}", name.unwrap_or_default())
            }
            Expression::Literal(Literal::Bool(value)) => value.to_string(),
            Expression::Unary {
                op: UnaryOperator::LogicalNot,
                expr,
            } => format!("!{}", self.switch_text(*expr)?),
            Expression::Binary { op, left, right } => {
                let op = match op {
                    BinaryOperator::LogicalAnd => "&&",
                    BinaryOperator::LogicalOr => "||",
                    _ => return None,
                };
                let (left, right) = (self.switch_text(*left)?, self.switch_text(*right)?);
                format!("({left} {op} {right})")
            }
            _ => return None,
        })
    }

    fn constant(&self, expression: E) -> String {
        match &self.types.module.global_expressions[expression] {
            Expression::Literal(value) => literal(value, self.form),
            Expression::Constant(c) => self.constant(self.types.module.constants[*c].init),
            Expression::Compose { components, .. } => {
                format!("[{}]", list(components.iter().map(|c| self.constant(*c))))
            }
            Expression::Splat { size, value } => {
                format!("[{}; {}]", self.constant(*value), *size as u32)
            }
            Expression::ZeroValue(ty) => self.types.zero(&self.types.of(*ty)),
            other => panic!("a constant that kernels did not have: {other:?}"),
        }
    }

    /// What an expression is.
    pub fn value(&self, expression: E) -> String {
        match &self.function.expressions[expression] {
            Expression::Literal(value) => literal(value, self.form),
            Expression::Constant(c) => self.constant(self.types.module.constants[*c].init),
            Expression::Override(_) => {
                format!("bs({})", self.switch_text(expression).unwrap_or_default())
            }
            Expression::ZeroValue(ty) => self.types.zero(&self.types.of(*ty)),
            Expression::FunctionArgument(i) => format!("a{i}"),
            Expression::Compose { components, .. } => self.compose(expression, components),
            Expression::Access { base, index } => {
                let ty = self.type_of(*base);
                let element = self.types.element(&ty);
                let chosen = self.choose(&self.index(*index), count(&ty.inner), &element, |i| {
                    format!("b[{i}]")
                });
                format!("{{ let b = {}; {chosen} }}", self.text(*base))
            }
            Expression::AccessIndex { base, index } => {
                let ty = self.type_of(*base);
                match self.types.field(&ty, *index) {
                    Some((field, _)) => format!("{}.{field}", self.text(*base)),
                    None => format!("{}[{index}]", self.text(*base)),
                }
            }
            Expression::Splat { size, value } => {
                format!("[{}; {}]", self.text(*value), *size as u32)
            }
            Expression::Swizzle {
                size,
                vector,
                pattern,
            } => {
                let parts = pattern[..*size as usize]
                    .iter()
                    .map(|p| format!("b[{}]", *p as u32));
                format!("{{ let b = {}; [{}] }}", self.text(*vector), list(parts))
            }
            Expression::Load { pointer } => self.load(*pointer),
            Expression::Unary { op, expr } => {
                let name = match op {
                    UnaryOperator::Negate => "neg",
                    UnaryOperator::LogicalNot | UnaryOperator::BitwiseNot => "not",
                };
                self.each(&[*expr], name)
            }
            Expression::Binary { op, left, right } => self.binary(*op, *left, *right),
            Expression::Select {
                condition,
                accept,
                reject,
            } => {
                if let Some(switch) = self.switch_text(*condition) {
                    let (accept, reject) = (self.text(*accept), self.text(*reject));
                    return format!("if {switch} {{ {accept} }} else {{ {reject} }}");
                }
                let kind = letter(scalar(&self.type_of(*accept).inner));
                self.map(&[*condition, *accept, *reject], |v| {
                    format!("{kind}sel({}, {}, {})", v[0], v[1], v[2])
                })
            }
            Expression::Relational { fun, argument } => {
                let function = match fun {
                    RelationalFunction::All => "band",
                    RelationalFunction::Any => "bor",
                    other => panic!("a function that kernels did not have: {other:?}"),
                };
                let parts = count(&self.type_of(*argument).inner);
                let all =
                    (1..parts).fold("x[0]".to_owned(), |t, i| format!("{function}({t}, x[{i}])"));
                format!("{{ let x = {}; {all} }}", self.text(*argument))
            }
            Expression::As {
                expr,
                kind,
                convert,
            } => {
                let from = letter(scalar(&self.type_of(*expr).inner));
                let to = letter(Scalar {
                    kind: *kind,
                    width: 4,
                });
                if from == to {
                    return self.text(*expr);
                }
                let between = if convert.is_some() { "2" } else { "bits" };
                self.map(&[*expr], |v| format!("{from}{between}{to}({})", v[0]))
            }
            Expression::Math {
                fun,
                arg,
                arg1,
                arg2,
                ..
            } => {
                let arguments: Vec<E> = [Some(*arg), *arg1, *arg2].into_iter().flatten().collect();
                self.math(*fun, &arguments)
            }
            other => panic!("an expression that kernels did not have: {other:?}"),
        }
    }

    fn compose(&self, expression: E, components: &[E]) -> String {
        let ty = self.type_of(expression);
        match &ty.inner {
            TypeInner::Struct { .. } => {
                let fields = (0..).zip(components).map(|(i, c)| {
                    let name = self.types.field(&ty, i).map(|(name, _)| name);
                    format!("{}: {}", name.unwrap_or_default(), self.text(*c))
                });
                format!("{} {{ {} }}", self.types.record(&ty), list(fields))
            }
            TypeInner::Vector { .. } => {
                let mut text = String::from("{ ");
                let mut parts = Vec::new();
                for (j, c) in components.iter().enumerate() {
                    let size = count(&self.type_of(*c).inner);
                    text += &format!("let x{j} = {}; ", self.text(*c));
                    parts.extend((0..size).map(|i| component(size, &format!("x{j}"), i)));
                }
                format!("{text}[{}] }}", list(parts))
            }
            _ => format!("[{}]", list(components.iter().map(|c| self.text(*c)))),
        }
    }

    /// A function of scalars, component by component; scalars go with every component of vectors.
    fn map(&self, arguments: &[E], function: impl Fn(&[String]) -> String) -> String {
        let mut text = String::from("{ ");
        let mut names = Vec::new();
        for (j, argument) in arguments.iter().enumerate() {
            text += &format!("let x{j} = {}; ", self.text(*argument));
            names.push((count(&self.type_of(*argument).inner), format!("x{j}")));
        }
        let size = names.iter().map(|n| n.0).max().unwrap_or(1);
        let at = |i| {
            let parts: Vec<String> = names.iter().map(|(n, x)| component(*n, x, i)).collect();
            function(&parts)
        };
        if size == 1 {
            format!("{text}{} }}", at(0))
        } else {
            format!("{text}[{}] }}", list((0..size).map(at)))
        }
    }

    /// The function `name` of the first argument's kind.
    fn each(&self, arguments: &[E], name: &str) -> String {
        let kind = letter(scalar(&self.type_of(arguments[0]).inner));
        self.map(arguments, |v| format!("{kind}{name}({})", v.join(", ")))
    }

    fn binary(&self, op: BinaryOperator, left: E, right: E) -> String {
        use BinaryOperator as Op;
        if let (TypeInner::Matrix { columns, .. }, TypeInner::Vector { .. }) =
            (&self.type_of(left).inner, &self.type_of(right).inner)
        {
            let rows = (0..count(&self.types.element(&self.type_of(left)).inner)).map(|r| {
                let column = |c: u32| format!("fmul(x[{c}][{r}], y[{c}])");
                (1..*columns as u32).fold(column(0), |t, c| format!("fadd({t}, {})", column(c)))
            });
            let (x, y) = (self.text(left), self.text(right));
            return format!("{{ let x = {x}; let y = {y}; [{}] }}", list(rows));
        }
        if let TypeInner::Matrix { columns, rows, .. } = &self.type_of(right).inner {
            let columns = (0..*columns as u32).map(|c| {
                let parts = (0..*rows as u32).map(|r| format!("fmul(x, y[{c}][{r}])"));
                format!("[{}]", list(parts))
            });
            let (x, y) = (self.text(left), self.text(right));
            return format!("{{ let x = {x}; let y = {y}; [{}] }}", list(columns));
        }
        let name = match op {
            Op::Add => "add",
            Op::Subtract => "sub",
            Op::Multiply => "mul",
            Op::Divide => "div",
            Op::Modulo => "rem",
            Op::Equal => "eq",
            Op::NotEqual => "ne",
            Op::Less => "lt",
            Op::LessEqual => "le",
            Op::Greater => return self.each(&[right, left], "lt"),
            Op::GreaterEqual => return self.each(&[right, left], "le"),
            Op::And | Op::LogicalAnd => "and",
            Op::InclusiveOr | Op::LogicalOr => "or",
            Op::ExclusiveOr => "xor",
            Op::ShiftLeft => "shl",
            Op::ShiftRight => "shr",
        };
        self.each(&[left, right], name)
    }

    fn math(&self, function: MathFunction, arguments: &[E]) -> String {
        use MathFunction as Math;
        let size = count(&self.type_of(arguments[0]).inner);
        let named = |names: [&str; 2]| {
            (names.iter().zip(arguments))
                .map(|(name, argument)| format!("let {name} = {}; ", self.text(*argument)))
                .collect::<String>()
        };
        let name = match function {
            Math::Abs => "abs",
            Math::Floor => "floor",
            Math::Round => "round",
            Math::Sqrt => "sqrt",
            Math::Exp => "exp",
            Math::Log => "log",
            Math::Fract => "fract",
            Math::ReverseBits => "reverse",
            Math::FirstTrailingBit => "trailing",
            Math::Min => "min",
            Math::Max => "max",
            Math::Clamp => "clamp",
            Math::Mix => "mix",
            Math::Dot => return format!("{{ {}{} }}", named(["x", "y"]), dot("x", "y", size)),
            Math::Length => {
                return format!("{{ {}fsqrt({}) }}", named(["x", ""]), dot("x", "x", size));
            }
            Math::Distance => {
                let parts = (0..size).map(|i| format!("fsub(x[{i}], y[{i}])"));
                let (names, root) = (named(["x", "y"]), dot("d", "d", size));
                return format!("{{ {names}let d = [{}]; fsqrt({root}) }}", list(parts));
            }
            Math::Normalize => {
                let parts = (0..size).map(|i| format!("fmul(x[{i}], scale)"));
                let (names, square) = (named(["x", ""]), dot("x", "x", size));
                return format!(
                    "{{ {names}let scale = fdiv(fs(1.0), fsqrt({square})); [{}] }}",
                    list(parts)
                );
            }
            Math::Cross => {
                let part =
                    |i: u32, j: u32| format!("fsub(fmul(x[{i}], y[{j}]), fmul(x[{j}], y[{i}]))");
                let parts = [part(1, 2), part(2, 0), part(0, 1)];
                return format!("{{ {}[{}] }}", named(["x", "y"]), list(parts));
            }
            other => panic!("a function that kernels did not have: {other:?}"),
        };
        self.each(arguments, name)
    }
}
