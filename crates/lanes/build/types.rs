//! Types of the shaders as types of lanes: a scalar becomes F, I, U or B, a value per lane; vectors and arrays become
//! arrays of them, records become records.

use naga::{ArraySize, Handle, Module, Scalar, ScalarKind, Type, TypeInner};

/// A type and, where it is one of the module's, its handle, which records need for their name.
#[derive(Clone)]
pub struct LaneType {
    pub inner: TypeInner,
    pub handle: Option<Handle<Type>>,
}

/// The letter that marks a scalar's functions.
pub fn letter(scalar: Scalar) -> char {
    match scalar.kind {
        ScalarKind::Float | ScalarKind::AbstractFloat => 'f',
        ScalarKind::Sint | ScalarKind::AbstractInt => 'i',
        ScalarKind::Uint => 'u',
        ScalarKind::Bool => 'b',
    }
}

pub struct Types<'a> {
    pub module: &'a Module,
}

impl Types<'_> {
    pub fn of(&self, handle: Handle<Type>) -> LaneType {
        LaneType {
            inner: self.module.types[handle].inner.clone(),
            handle: Some(handle),
        }
    }

    /// Name of a record.
    pub fn record(&self, ty: &LaneType) -> String {
        let handle = ty.handle.expect("records have handles");
        let name = self.module.types[handle].name.clone();
        name.expect("records have names")
    }

    pub fn name(&self, ty: &LaneType) -> String {
        match &ty.inner {
            TypeInner::Scalar(s) => letter(*s).to_ascii_uppercase().to_string(),
            TypeInner::Struct { .. } => self.record(ty),
            _ => format!("[{}; {}]", self.name(&self.element(ty)), count(&ty.inner)),
        }
    }

    pub fn zero(&self, ty: &LaneType) -> String {
        match &ty.inner {
            TypeInner::Scalar(s) => match letter(*s) {
                'f' => "fs(0.0)".to_owned(),
                'b' => "bs(false)".to_owned(),
                x => format!("{x}s(0)"),
            },
            TypeInner::Struct { members, .. } => {
                let fields = members.iter().map(|m| {
                    let name = m.name.as_deref().unwrap_or_default();
                    format!("{name}: {}", self.zero(&self.of(m.ty)))
                });
                format!("{} {{ {} }}", self.record(ty), list(fields))
            }
            _ => format!("[{}; {}]", self.zero(&self.element(ty)), count(&ty.inner)),
        }
    }

    /// `a` in the lanes of `mask`, `b` in the others; both are names or fields of names.
    pub fn select(&self, ty: &LaneType, mask: &str, a: &str, b: &str) -> String {
        self.choice("sel", ty, mask, a, b)
    }

    /// The same for `b` in memory, where the result is going to be kept.
    pub fn keep(&self, ty: &LaneType, mask: &str, a: &str, b: &str) -> String {
        self.choice("keep", ty, mask, a, b)
    }

    /// By the functions `verb` of each type.
    pub fn choice(&self, verb: &str, ty: &LaneType, mask: &str, a: &str, b: &str) -> String {
        match &ty.inner {
            TypeInner::Scalar(s) => format!("{}{verb}({mask}, {a}, {b})", letter(*s)),
            TypeInner::Struct { .. } => format!("{verb}_{}({mask}, {a}, {b})", self.record(ty)),
            _ => {
                let element = self.element(ty);
                let parts = (0..count(&ty.inner)).map(|i| {
                    let (a, b) = (format!("{a}[{i}]"), format!("{b}[{i}]"));
                    self.choice(verb, &element, mask, &a, &b)
                });
                format!("[{}]", list(parts))
            }
        }
    }

    pub fn element(&self, ty: &LaneType) -> LaneType {
        let inner = match &ty.inner {
            TypeInner::Vector { scalar, .. } => TypeInner::Scalar(*scalar),
            TypeInner::Matrix { rows, scalar, .. } => TypeInner::Vector {
                size: *rows,
                scalar: *scalar,
            },
            TypeInner::Array { base, .. } => return self.of(*base),
            other => panic!("no elements in {other:?}"),
        };
        LaneType {
            inner,
            handle: None,
        }
    }

    /// Name and type of field `index` of a record.
    pub fn field(&self, ty: &LaneType, index: u32) -> Option<(String, LaneType)> {
        let TypeInner::Struct { members, .. } = &ty.inner else {
            return None;
        };
        let member = &members[index as usize];
        Some((member.name.clone().unwrap_or_default(), self.of(member.ty)))
    }
}

/// Number of elements; 1 of a scalar.
pub fn count(inner: &TypeInner) -> u32 {
    match inner {
        TypeInner::Scalar(_) => 1,
        TypeInner::Vector { size, .. } => *size as u32,
        TypeInner::Matrix { columns, .. } => *columns as u32,
        TypeInner::Array {
            size: ArraySize::Constant(n),
            ..
        } => n.get(),
        other => panic!("no count of {other:?}"),
    }
}

/// The scalar of a scalar or vector.
pub fn scalar(inner: &TypeInner) -> Scalar {
    match inner {
        TypeInner::Scalar(s) | TypeInner::Vector { scalar: s, .. } => *s,
        other => panic!("no scalar in {other:?}"),
    }
}

pub fn list(parts: impl IntoIterator<Item = String>) -> String {
    parts.into_iter().collect::<Vec<_>>().join(", ")
}
