//! Places in memory: variables, which are records and arrays of lanes; the records and tables of the scene, which all
//! lanes share; and buffers in which every lane reads and writes a place of its own.

use naga::{AddressSpace, Expression, Handle, TypeInner};

use crate::{
    function::{Form, Scope, Writer},
    types::{LaneType, count, letter, list, scalar},
};

/// What a place is in.
#[derive(Clone, Copy, PartialEq)]
enum Root {
    /// A variable of the function or of the lanes.
    Variable,
    /// A record that all lanes share, by words.
    Shared,
    /// A buffer of words.
    Buffer,
}

/// A place whose way from the root has at most one index that differs from lane to lane.
struct Place {
    root: Root,
    /// Rust's name of the place, up to the index that differs; of a shared record its own name.
    path: String,
    /// Shared records: the word. Buffers: nothing.
    word: u32,
    /// The index, the number of elements and the words of each; in buffers there may be a second for the component.
    indices: Vec<(String, u32, u32)>,
    /// What follows the index.
    rest: String,
    ty: LaneType,
}

/// Buffers of single words of which each group of lanes has a part.
const OF_WORDS: [&str; 2] = ["film", "completed"];

impl Writer<'_> {
    fn place(&self, pointer: Handle<Expression>) -> Place {
        match &self.function.expressions[pointer] {
            Expression::LocalVariable(handle) => Place {
                root: Root::Variable,
                path: format!("l{}", handle.index()),
                word: 0,
                indices: Vec::new(),
                rest: String::new(),
                ty: self.types.of(self.function.local_variables[*handle].ty),
            },
            Expression::GlobalVariable(handle) => {
                let variable = &self.types.module.global_variables[*handle];
                let name = variable.name.as_deref().unwrap_or_default();
                let (root, path) = match variable.space {
                    AddressSpace::Private => (Root::Variable, format!("s.{name}")),
                    // The small tables lie in one place only.
                    AddressSpace::Uniform if name == "uniform_rows" => {
                        (Root::Buffer, "near_rows".to_owned())
                    }
                    AddressSpace::Uniform if name == "rays" => (Root::Buffer, name.to_owned()),
                    AddressSpace::Uniform => (Root::Shared, format!("s.memory.{name}")),
                    _ => (Root::Buffer, name.to_owned()),
                };
                Place {
                    root,
                    path,
                    word: 0,
                    indices: Vec::new(),
                    rest: String::new(),
                    ty: self.types.of(variable.ty),
                }
            }
            Expression::AccessIndex { base, index } => self.part(self.place(*base), *index),
            Expression::Access { base, index } => {
                let mut place = self.place(*base);
                let element = self.types.element(&place.ty);
                let elements = match &place.ty.inner {
                    TypeInner::Array { .. } if place.root == Root::Buffer => 0,
                    inner => count(inner),
                };
                let words = words(&element);
                place.indices.push((self.index(*index), elements, words));
                place.ty = element;
                place
            }
            other => panic!("not a place: {other:?}"),
        }
    }

    /// Field or element `index` of a place.
    fn part(&self, mut place: Place, index: u32) -> Place {
        let step = match self.types.field(&place.ty, index) {
            Some((field, ty)) => {
                if let TypeInner::Struct { members, .. } = &place.ty.inner {
                    place.word += members[index as usize].offset / 4;
                }
                place.ty = ty;
                format!(".{field}")
            }
            None if place.root == Root::Buffer => {
                let element = self.types.element(&place.ty);
                place
                    .indices
                    .push((format!("us({index})"), 0, words(&element)));
                place.ty = element;
                return place;
            }
            None => {
                place.ty = self.types.element(&place.ty);
                place.word += index * words(&place.ty);
                format!("[{index}]")
            }
        };
        if place.root == Root::Shared {
            // Their words tell the place.
        } else if place.indices.is_empty() {
            place.path += &step;
        } else {
            place.rest += &step;
        }
        place
    }

    /// An index as whole numbers without sign.
    pub fn index(&self, index: Handle<Expression>) -> String {
        let text = self.text(index);
        match letter(scalar(&self.type_of(index).inner)) {
            'i' => format!("i2u({text})"),
            _ => text,
        }
    }

    /// The counter that an atomic operation is on.
    pub fn counter(&self, pointer: Handle<Expression>) -> String {
        format!("s.memory.counters[{}]", self.place(pointer).word)
    }

    /// What a place holds.
    pub fn load(&self, pointer: Handle<Expression>) -> String {
        let place = self.place(pointer);
        match place.root {
            Root::Buffer => self.load_buffer(&place),
            Root::Variable => match place.indices.first() {
                None => place.path.clone(),
                Some((index, elements, _)) => {
                    let element = |i: &str| format!("{}[{i}]{}", place.path, place.rest);
                    self.choose(index, *elements, &place.ty, element)
                }
            },
            Root::Shared => match place.indices.first() {
                None => shared(&place, &place.word.to_string()),
                Some((index, elements, words)) => {
                    let element =
                        |i: &str| shared(&place, &format!("{} + {i} * {words}", place.word));
                    self.choose(index, *elements, &place.ty, element)
                }
            },
        }
    }

    /// The element that `index` names, in each lane. `element` is the text of an element by the text of its number.
    pub fn choose(
        &self,
        index: &str,
        elements: u32,
        ty: &LaneType,
        element: impl Fn(&str) -> String,
    ) -> String {
        if self.form == Form::Scalar {
            return format!(
                "{{ let i = within({index}, {elements}); {} }}",
                element("i")
            );
        }
        let element = |i: u32| element(&i.to_string());
        let mut text = format!("{{ let i = {index}; let mut chosen = {};", element(0));
        for other in 1..elements {
            let kept = self.types.select(ty, "m", "other", "chosen");
            text += &format!(
                " {{ let other = {}; let m = ueq(i, us({other})); chosen = {kept}; }}",
                element(other)
            );
        }
        text + " chosen }"
    }

    fn load_buffer(&self, place: &Place) -> String {
        let kind = letter(scalar(&place.ty.inner));
        let buffer = format!("&s.memory.{}", place.path);
        match self.word_index(place) {
            Some(word) => format!("{kind}gather({buffer}, {word})"),
            None => format!("{kind}gather_rows({buffer}, {})", place.indices[0].0),
        }
    }

    /// The word of a place in a buffer; `None` for a whole row.
    fn word_index(&self, place: &Place) -> Option<String> {
        let row = &place.indices[0].0;
        if OF_WORDS.contains(&&*place.path) {
            // These hold the pixels at work alone.
            return Some(format!("usub({row}, us(s.memory.first_of_{}))", place.path));
        }
        if place.indices[0].2 == 1 {
            return Some(row.clone());
        }
        let (component, _, _) = place.indices.get(1)?;
        Some(format!("uadd(ushl({row}, us(2)), {component})"))
    }

    /// Sets a place in the lanes of the scope's mask.
    pub fn store(&mut self, pointer: Handle<Expression>, value: &str, scope: &Scope) {
        let place = self.place(pointer);
        if self.form == Form::Scalar {
            return self.store_scalar(&place, value);
        }
        let mask = &scope.mask;
        if place.root == Root::Buffer {
            let kind = letter(scalar(&place.ty.inner));
            let buffer = format!("&mut s.memory.{}", place.path);
            let (function, at) = self.way_into_buffer(&place);
            self.put(&format!(
                "{{ let (at, v) = ({at}, {value}); {kind}{function}({mask}, {buffer}, at, v); }}"
            ));
            return;
        }
        let Some((index, elements, _)) = place.indices.first() else {
            let kept = self.types.keep(&place.ty, mask, "v", &place.path);
            // Lanes that are not in the function never read its variables.
            self.put(&if scope.whole && !place.path.starts_with("s.") {
                format!("{} = {value};", place.path)
            } else {
                format!("{{ let v = {value}; {} = {kept}; }}", place.path)
            });
            return;
        };
        self.put(&format!("{{ let (v, i) = ({value}, {index});"));
        for element in 0..*elements {
            let target = format!("{}[{element}]{}", place.path, place.rest);
            let kept = self.types.keep(&place.ty, "m", "v", &target);
            self.put(&format!(
                "{{ let m = band({mask}, ueq(i, us({element}))); {target} = {kept}; }}"
            ));
        }
        self.put("}");
    }
}

impl Writer<'_> {
    /// Sets a place of a lane that is alone.
    fn store_scalar(&mut self, place: &Place, value: &str) {
        let Place { path, rest, .. } = place;
        let line = if place.root == Root::Buffer {
            let kind = letter(scalar(&place.ty.inner));
            let (function, at) = self.way_into_buffer(place);
            format!(
                "{{ let (at, v) = ({at}, {value}); {kind}{function}(&mut s.memory.{path}, at, v); }}"
            )
        } else if let Some((index, elements, _)) = place.indices.first() {
            format!(
                "{{ let (v, i) = ({value}, within({index}, {elements})); {path}[i]{rest} = v; }}"
            )
        } else {
            format!("{path} = {value};")
        };
        self.put(&line);
    }

    /// The function that writes to a buffer, and the word or row.
    fn way_into_buffer(&self, place: &Place) -> (&'static str, String) {
        match self.word_index(place) {
            Some(word) => ("scatter", word),
            None => ("scatter_rows", place.indices[0].0.clone()),
        }
    }
}

/// Words of a type in a record that lanes share.
fn words(ty: &LaneType) -> u32 {
    match &ty.inner {
        TypeInner::Scalar(_) | TypeInner::Vector { .. } => count(&ty.inner),
        _ => 0,
    }
}

/// What is at a word of a shared record, in every lane.
fn shared(place: &Place, word: &str) -> String {
    let record = &place.path;
    let kind = letter(scalar(&place.ty.inner));
    let splat = |i: u32| format!("{kind}word({record}[{word} + {i}])");
    match &place.ty.inner {
        TypeInner::Scalar(_) => splat(0),
        inner => format!("[{}]", list((0..count(inner)).map(splat))),
    }
}
