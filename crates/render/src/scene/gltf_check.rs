//! Whether the JSON of a glTF file has the form that the format's schema gives it, so that what reads it afterwards
//! can take every index and every type for granted. Fields that the schema does not know are left alone.

use serde_json::Value;

/// Characters of a wrong value that a message repeats.
const QUOTED_CHARS: usize = 60;

/// What a value of the file must be.
pub(super) enum Kind {
    /// True or false.
    Flag,
    Text,
    /// Any number.
    Number,
    /// A number in a closed range.
    NumberIn(f64, f64),
    /// Numbers, as many as stated.
    Numbers(usize),
    /// A whole number in a closed range.
    Whole(u64, u64),
    /// An index into a list of the file, by the list's name.
    Index(&'static str),
    /// Names of attributes with the indices of their accessors.
    Attributes,
    /// A list of values of one kind.
    List(&'static Kind),
    /// An object with these fields, perhaps among others.
    Object(&'static [Property]),
}

/// A field of an object.
pub(super) struct Property {
    pub(super) name: &'static str,
    pub(super) required: bool,
    pub(super) kind: Kind,
}

/// Checks the whole file. Whole numbers written with a fraction of zero are made whole.
///
/// # Errors
/// The first thing that is wrong, as `nodes[0].mesh must be .., got ..`.
pub(super) fn check(root: &mut Value, schema: &'static [Property]) -> Result<(), String> {
    let mut checker = Checker {
        counts: counts(root),
        path: String::new(),
    };
    checker.object(root, schema)
}

/// Elements of every list of the file that indices can point into.
fn counts(root: &Value) -> Vec<(String, usize)> {
    let count = |value: &Value| value.as_array().map(Vec::len);
    let own = root.as_object().into_iter().flatten();
    let mut counts: Vec<_> = own
        .filter_map(|(name, value)| Some((name.clone(), count(value)?)))
        .collect();
    let lights = root.pointer("/extensions/KHR_lights_punctual/lights");
    counts.extend(
        lights
            .and_then(count)
            .map(|lights| ("lights".to_string(), lights)),
    );
    counts
}

struct Checker {
    counts: Vec<(String, usize)>,
    /// Where the value under inspection stands.
    path: String,
}

impl Checker {
    fn value(&mut self, value: &mut Value, kind: &'static Kind) -> Result<(), String> {
        match kind {
            Kind::Flag => self.must(value.is_boolean(), value, "true or false"),
            Kind::Text => self.must(value.is_string(), value, "text"),
            Kind::Number => self.must(value.is_number(), value, "a number"),
            Kind::NumberIn(low, high) => {
                let fits = value.as_f64().is_some_and(|x| (*low..=*high).contains(&x));
                self.must(fits, value, &in_range(*low, *high))
            }
            Kind::Numbers(count) => {
                let list = value.as_array().filter(|list| list.len() == *count);
                let fits = list.is_some_and(|list| list.iter().all(Value::is_number));
                self.must(fits, value, &format!("{count} numbers"))
            }
            Kind::Whole(low, high) => {
                make_whole(value);
                let fits = value.as_u64().is_some_and(|x| (*low..=*high).contains(&x));
                let range = match *high {
                    u64::MAX => format!("a whole number of at least {low}"),
                    _ => format!("a whole number in [{low}, {high}]"),
                };
                self.must(fits, value, &range)
            }
            Kind::Index(list) => self.index(value, list),
            Kind::Attributes => self.attributes(value),
            Kind::List(element) => {
                let Some(list) = value.as_array_mut() else {
                    return self.must(false, value, "a list");
                };
                for (i, value) in list.iter_mut().enumerate() {
                    self.within(&format!("[{i}]"), |checker| checker.value(value, element))?;
                }
                Ok(())
            }
            Kind::Object(fields) => self.object(value, fields),
        }
    }

    fn object(&mut self, value: &mut Value, fields: &'static [Property]) -> Result<(), String> {
        let Some(object) = value.as_object_mut() else {
            return self.must(false, value, "an object");
        };
        for field in fields {
            match object.get_mut(field.name) {
                Some(value) => self.within(&dotted(field.name), |checker| {
                    checker.value(value, &field.kind)
                })?,
                None if field.required => {
                    let place = if self.path.is_empty() {
                        "the file"
                    } else {
                        self.place()
                    };
                    return Err(format!("{place} lacks the required field `{}`", field.name));
                }
                None => {}
            }
        }
        Ok(())
    }

    fn index(&self, value: &mut Value, list: &str) -> Result<(), String> {
        make_whole(value);
        let own = self.counts.iter().find(|(name, _)| name == list);
        let count = own.map_or(0, |(_, count)| *count);
        let fits = value.as_u64().is_some_and(|index| index < count as u64);
        self.must(fits, value, &format!("an index below {count} ({list})"))
    }

    fn attributes(&mut self, value: &mut Value) -> Result<(), String> {
        let Some(attributes) = value.as_object_mut() else {
            return self.must(false, value, "an object");
        };
        if attributes.is_empty() {
            return self.must(false, value, "an object with one attribute at least");
        }
        for (name, value) in attributes {
            self.within(&dotted(name), |checker| {
                if !is_attribute(name) {
                    let expected =
                        "a known attribute, or an application's own with `_` before its name";
                    return Err(format!("{} must be {expected}", checker.place()));
                }
                checker.index(value, "accessors")
            })?;
        }
        Ok(())
    }

    /// Runs `inspect` with `step` at the end of the path.
    fn within(
        &mut self,
        step: &str,
        inspect: impl FnOnce(&mut Self) -> Result<(), String>,
    ) -> Result<(), String> {
        let length = self.path.len();
        self.path.push_str(step);
        let outcome = inspect(self);
        self.path.truncate(length);
        outcome
    }

    fn must(&self, fits: bool, value: &Value, expected: &str) -> Result<(), String> {
        if fits {
            return Ok(());
        }
        let written = value.to_string();
        let got = match written.char_indices().nth(QUOTED_CHARS) {
            Some((end, _)) => format!("{} ...", &written[..end]),
            None => written,
        };
        let place = if self.path.is_empty() {
            "the file"
        } else {
            self.place()
        };
        Err(format!("{place} must be {expected}, got {got}"))
    }

    fn place(&self) -> &str {
        self.path.trim_start_matches('.')
    }
}

fn dotted(name: &str) -> String {
    format!(".{name}")
}

fn in_range(low: f64, high: f64) -> String {
    if high.is_infinite() {
        format!("a number of at least {low}")
    } else {
        format!("a number in [{low}, {high}]")
    }
}

/// 3.0 is 3 to JSON.
fn make_whole(value: &mut Value) {
    let written = value.as_f64().filter(|_| value.is_f64());
    // Every whole number below 2⁵³ is exact.
    let whole = written.filter(|x| x.fract() == 0.0 && (0.0..9e15).contains(x));
    if let Some(x) = whole {
        *value = Value::from(x as u64);
    }
}

/// Whether the format or an extension knows the attribute, or leaves its name to applications.
fn is_attribute(name: &str) -> bool {
    let numbered = ["TEXCOORD_", "COLOR_", "JOINTS_", "WEIGHTS_"];
    let is_numbered = |prefix: &str| {
        let number = name.strip_prefix(prefix).unwrap_or_default();
        !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit())
    };
    ["POSITION", "NORMAL", "TANGENT"].contains(&name)
        || name.starts_with('_')
        || name.contains(':')
        || numbered.iter().any(|prefix| is_numbered(prefix))
}
