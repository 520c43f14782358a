//! Functions: statements under a mask of the lanes that take part. Code that no lane needs is jumped over.

use std::collections::HashSet;

use naga::{
    Block, Expression, Function, Handle, Statement, TypeInner, proc::TypeResolution,
    valid::FunctionInfo,
};

use crate::types::{LaneType, Types};

/// What a kernel is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Several lanes at once, in single precision, under masks.
    Lanes,
    /// One lane in double precision, with the control flow of the shader.
    Scalar,
}

impl Form {
    /// Functions that have a way of their own, and its text.
    pub fn by_hand(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Self::Lanes => &BY_HAND_IN_LANES,
            Self::Scalar => &crate::scalar::BY_HAND,
        }
    }
}

const BY_HAND_IN_LANES: [(&str, &str); 1] = [(
    "trace_triangles",
    "let (t, primitive, local) = nearest_triangles(&s.memory.tree, &mut s.memory.waiting, entry, (a0, a1), \
     (a2, a3, a4), (a5.t, a5.primitive, a5.local)); RECORD { t, primitive, local } }",
)];

/// Where a statement stands: the name of its mask, whether that is the function's own, and the masks of lanes that left
/// the innermost loop's body.
#[derive(Clone)]
pub struct Scope {
    pub mask: String,
    pub whole: bool,
    broken: String,
    continued: String,
}

impl Scope {
    /// Where there are no masks.
    pub fn of_one_lane() -> Self {
        Self {
            mask: String::new(),
            whole: true,
            broken: String::new(),
            continued: String::new(),
        }
    }
}

pub struct Writer<'a> {
    pub types: &'a Types<'a>,
    pub function: &'a Function,
    pub form: Form,
    info: &'a FunctionInfo,
    /// Expressions that have a variable of their own.
    pub named: HashSet<Handle<Expression>>,
    pub code: String,
    masks: u32,
}

/// Whether lanes may leave `block` before its end, or in it the function; of loops inside only the latter counts.
fn narrows(block: &Block, in_loop: bool) -> bool {
    block.iter().any(|statement| match statement {
        Statement::Break | Statement::Continue => !in_loop,
        Statement::Return { .. } => true,
        Statement::If { accept, reject, .. } => {
            narrows(accept, in_loop) || narrows(reject, in_loop)
        }
        Statement::Block(inner) => narrows(inner, in_loop),
        Statement::Loop {
            body, continuing, ..
        } => narrows(body, true) || narrows(continuing, true),
        _ => false,
    })
}

impl<'a> Writer<'a> {
    pub fn new(
        types: &'a Types<'a>,
        function: &'a Function,
        info: &'a FunctionInfo,
        form: Form,
    ) -> Self {
        Self {
            types,
            function,
            form,
            info,
            named: HashSet::new(),
            code: String::new(),
            masks: 0,
        }
    }

    pub fn put(&mut self, line: &str) {
        self.code.push_str(line);
        self.code.push('\n');
    }

    pub fn type_of(&self, expression: Handle<Expression>) -> LaneType {
        let resolution = &self.info[expression].ty;
        LaneType {
            inner: resolution.inner_with(&self.types.module.types).clone(),
            handle: match resolution {
                TypeResolution::Handle(handle) => Some(*handle),
                TypeResolution::Value(_) => None,
            },
        }
    }

    /// The whole function.
    pub fn function(mut self, name: &str, attribute: &str) -> String {
        let result = self.head(name, attribute);
        if self.is_by_hand(name) {
            return self.code;
        }
        if self.form == Form::Scalar {
            return self.scalar_body(result.as_ref());
        }
        self.put("let mut mask = entry;");
        if let Some(ty) = &result {
            self.put(&format!("let mut result = {};", self.types.zero(ty)));
        }
        self.variables();
        let scope = Scope {
            mask: "mask".to_owned(),
            whole: true,
            broken: String::new(),
            continued: String::new(),
        };
        self.block(&self.function.body, &scope);
        self.put(if result.is_some() { "result }" } else { "}" });
        self.code
    }

    /// Attribute, name and arguments of the function; returns the type of its result.
    fn head(&mut self, name: &str, attribute: &str) -> Option<LaneType> {
        let mut signature = String::from(match self.form {
            Form::Lanes => "s: &mut State, entry: B",
            Form::Scalar => "s: &mut State",
        });
        for (i, argument) in self.function.arguments.iter().enumerate() {
            let ty = self.types.name(&self.types.of(argument.ty));
            signature += &format!(", a{i}: {ty}");
        }
        let result = self.function.result.as_ref().map(|r| self.types.of(r.ty));
        let returned = result
            .as_ref()
            .map_or_else(|| "()".to_owned(), |ty| self.types.name(ty));
        self.put(attribute);
        self.put(&format!("fn shader_{name}({signature}) -> {returned} {{"));
        result
    }

    /// Whether the function has a way of its own, which is then written.
    fn is_by_hand(&mut self, name: &str) -> bool {
        let Some((_, text)) = self.form.by_hand().iter().find(|by_hand| by_hand.0 == name) else {
            return false;
        };
        let result = self.function.result.as_ref().map(|r| self.types.of(r.ty));
        let record = result
            .filter(|ty| matches!(ty.inner, TypeInner::Struct { .. }))
            .map_or_else(String::new, |ty| self.types.record(&ty));
        self.put(&text.replace("RECORD", &record));
        true
    }

    /// The function's variables.
    pub fn variables(&mut self) {
        for (handle, variable) in self.function.local_variables.iter() {
            let zero = || self.types.zero(&self.types.of(variable.ty));
            let first = variable.init.map_or_else(zero, |e| self.text(e));
            self.put(&format!("let mut l{} = {first};", handle.index()));
        }
    }

    fn block(&mut self, block: &Block, scope: &Scope) {
        let mut scope = scope.clone();
        let mut open = 0;
        for statement in block {
            if self.statement(statement, &scope) {
                scope.whole = false;
                self.put(&format!("if any({}) {{", scope.mask));
                open += 1;
            }
        }
        self.put(&"}".repeat(open));
    }

    /// Returns whether lanes may have left.
    fn statement(&mut self, statement: &Statement, scope: &Scope) -> bool {
        let mask = &scope.mask;
        match statement {
            Statement::Emit(range) => {
                for handle in range.clone() {
                    self.emit(handle);
                }
                false
            }
            Statement::Block(inner) => {
                self.block(inner, scope);
                narrows(inner, false)
            }
            Statement::If {
                condition,
                accept,
                reject,
            } => self.branch(*condition, accept, reject, scope),
            Statement::Loop {
                body,
                continuing,
                break_if,
            } => self.repeat(body, continuing, *break_if, scope),
            Statement::Break | Statement::Continue => {
                let left = match statement {
                    Statement::Break => &scope.broken,
                    _ => &scope.continued,
                };
                self.put(&format!(
                    "{left} = bor({left}, {mask}); {mask} = bs(false);"
                ));
                false
            }
            Statement::Return { value } => {
                if let (Some(value), Some(result)) = (value, &self.function.result) {
                    let text = self.text(*value);
                    let ty = self.types.of(result.ty);
                    let kept = self.types.select(&ty, mask, "v", "result");
                    self.put(&if scope.whole {
                        format!("result = {text};")
                    } else {
                        format!("{{ let v = {text}; result = {kept}; }}")
                    });
                }
                self.put(&format!("{mask} = bs(false);"));
                false
            }
            Statement::Store { pointer, value } => {
                let value = self.text(*value);
                self.store(*pointer, &value, scope);
                false
            }
            Statement::Atomic { pointer, value, .. } => {
                let value = self.text(*value);
                let counter = self.counter(*pointer);
                self.put(&format!(
                    "{counter} = {counter}.wrapping_add(usum({mask}, {value}));"
                ));
                false
            }
            Statement::Call {
                function,
                arguments,
                result,
            } => {
                self.call(*function, arguments, *result, &format!("s, {mask}"));
                false
            }
            other => panic!("a statement that kernels did not have: {other:?}"),
        }
    }

    /// A call with what every function is given, `common`, before its arguments.
    pub fn call(
        &mut self,
        function: Handle<Function>,
        arguments: &[Handle<Expression>],
        result: Option<Handle<Expression>>,
        common: &str,
    ) {
        let name = self.types.module.functions[function].name.clone();
        let mut call = format!("shader_{}({common}", name.unwrap_or_default());
        for argument in arguments {
            call += &format!(", {}", self.text(*argument));
        }
        if let Some(result) = result {
            self.put(&format!("let e{} = {call});", result.index()));
            self.named.insert(result);
        } else {
            self.put(&format!("{call});"));
        }
    }

    pub fn emit(&mut self, handle: Handle<Expression>) {
        let ty = self.type_of(handle).inner;
        // Places are written where they are used.
        if matches!(
            ty,
            TypeInner::Pointer { .. } | TypeInner::ValuePointer { .. }
        ) {
            return;
        }
        let text = self.value(handle);
        self.put(&format!("let e{} = {text};", handle.index()));
        self.named.insert(handle);
    }

    fn branch(
        &mut self,
        condition: Handle<Expression>,
        accept: &Block,
        reject: &Block,
        scope: &Scope,
    ) -> bool {
        let narrow = narrows(accept, false) || narrows(reject, false);
        if let Some(switch) = self.switch_text(condition) {
            self.put(&format!("if {switch} {{"));
            self.block(accept, scope);
            self.put("} else {");
            self.block(reject, scope);
            self.put("}");
            return narrow;
        }
        let mask = &scope.mask;
        let condition = self.text(condition);
        let (yes, no) = (self.fresh_mask(), self.fresh_mask());
        self.put(&format!("let mut {yes} = band({mask}, {condition});"));
        self.put(&format!("let mut {no} = bandnot({condition}, {mask});"));
        for (block, mask) in [(accept, &yes), (reject, &no)] {
            if !block.is_empty() {
                self.put(&format!("if any({mask}) {{"));
                let inner = Scope {
                    mask: mask.clone(),
                    whole: false,
                    ..scope.clone()
                };
                self.block(block, &inner);
                self.put("}");
            }
        }
        if narrow {
            self.put(&format!("{mask} = bor({yes}, {no});"));
        }
        narrow
    }

    fn repeat(
        &mut self,
        body: &Block,
        continuing: &Block,
        break_if: Option<Handle<Expression>>,
        scope: &Scope,
    ) -> bool {
        let (left, broken, continued) = (self.fresh_mask(), self.fresh_mask(), self.fresh_mask());
        let inner = Scope {
            mask: self.fresh_mask(),
            whole: false,
            broken: broken.clone(),
            continued: continued.clone(),
        };
        let mask = &inner.mask;
        self.put(&format!("let mut {broken} = bs(false);"));
        self.put(&format!("let mut {left} = {};", scope.mask));
        self.put(&format!(
            "loop {{ let mut {mask} = {left}; let mut {continued} = bs(false);"
        ));
        self.block(body, &inner);
        self.put(&format!("{mask} = bor({mask}, {continued});"));
        self.block(continuing, &inner);
        if let Some(condition) = break_if {
            let condition = self.text(condition);
            self.put(&format!(
                "{broken} = bor({broken}, band({mask}, {condition}));"
            ));
            self.put(&format!("{mask} = bandnot({condition}, {mask});"));
        }
        self.put(&format!("{left} = {mask}; if !any({left}) {{ break; }} }}"));
        let narrow = narrows(body, true) || narrows(continuing, true);
        if narrow {
            self.put(&format!("{} = {broken};", scope.mask));
        }
        narrow
    }

    pub fn fresh_mask(&mut self) -> String {
        self.masks += 1;
        format!("m{}", self.masks)
    }
}
