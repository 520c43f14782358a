//! A shader with everything that it imports, as one text. The build script of `crates/lanes` and `crates/render` share
//! this file.
//!
//! Shaders are WGSL with lines `import package::common::math::circle;` or `import package::common::math::{circle, turn};`.
//! WGSL knows no order of declarations and module-scope names are unique, so that joining the declarations that a kernel
//! reaches is all there is to do.

use std::collections::{BTreeMap, BTreeSet};

/// Declarations of a shader by name, and the shaders that its other names come from.
#[derive(Default)]
struct Shader<'t> {
    declared: BTreeMap<&'t str, &'t str>,
    imported: BTreeMap<&'t str, String>,
}

/// By their paths.
type Shaders<'t> = BTreeMap<&'t str, Shader<'t>>;

/// The text of the shader `name` (its path below `shaders/`, without the extension) with the declarations of others that
/// it reaches, all without comments. `sources` are all shaders: their paths and texts. Declarations stand in the order of
/// their own text whatever the order of `sources`, because drivers keep compiled shaders by their text.
///
/// # Errors
/// When there is no such shader, one of `sources` cannot be read, or imports what is not there, is there already or is not
/// used: says which and why.
pub fn compose<'a>(
    sources: impl IntoIterator<Item = (&'a str, &'a str)>,
    name: &str,
) -> Result<String, String> {
    let sources = sources.into_iter();
    let texts: Vec<_> = sources.map(|(path, s)| (path, uncommented(s))).collect();
    let mut shaders = Shaders::new();
    for (path, text) in &texts {
        let shader = Shader::read(text).map_err(|reason| format!("{path}: {reason}"))?;
        shaders.insert(path, shader);
    }
    for (path, shader) in &shaders {
        check_imports(&shaders, path, shader)?;
    }
    let shader = shaders.get(name);
    let shader = shader.ok_or_else(|| format!("there is no shader {name}"))?;
    let mut reached = BTreeSet::new();
    for declared in shader.declared.keys() {
        reach(&shaders, shader, declared, &mut reached);
    }
    Ok(reached
        .into_iter()
        .map(|text| format!("{text}\n"))
        .collect())
}

/// WGSL has no strings, so that every `//` starts a comment.
fn uncommented(text: &str) -> String {
    let lines = text.lines().map(|line| line.split("//").next());
    let lines = lines.map(|code| code.unwrap_or_default().trim_end());
    lines
        .filter(|code| !code.is_empty())
        .map(|code| format!("{code}\n"))
        .collect()
}

impl<'t> Shader<'t> {
    /// Reads a `text` without comments.
    fn read(text: &'t str) -> Result<Self, String> {
        let mut shader = Self::default();
        let mut rest = text.trim_start();
        while !rest.is_empty() {
            let import = rest.strip_prefix("import ");
            let end = import.map_or_else(|| end_of_declaration(rest), |_| rest.find(';'));
            let end = end.ok_or_else(|| format!("no end of \"{}\"", first_line(rest)))?;
            let (statement, others) = rest.split_at(end + 1);
            if let Some(import) = import {
                shader.import(&import[..end - "import ".len()])?;
            } else {
                shader.declare(statement)?;
            }
            rest = others.trim_start();
        }
        Ok(shader)
    }

    /// What stands between `import` and its semicolon.
    fn import(&mut self, import: &'t str) -> Result<(), String> {
        let parts = import.trim().strip_prefix("package::").and_then(|path| {
            path.strip_suffix('}')
                .and_then(|path| path.split_once("::{"))
                .or_else(|| path.rsplit_once("::"))
        });
        let (path, names) = parts.ok_or_else(|| format!("\"import {import}\" names nothing"))?;
        for name in names.split(',').map(str::trim).filter(|n| !n.is_empty()) {
            if self
                .imported
                .insert(name, path.replace("::", "/"))
                .is_some()
            {
                return Err(format!("{name} is imported twice"));
            }
        }
        Ok(())
    }

    fn declare(&mut self, declaration: &'t str) -> Result<(), String> {
        let name = declared_name(declaration)
            .ok_or_else(|| format!("\"{}\" declares nothing", first_line(declaration)))?;
        if self.declared.insert(name, declaration).is_some() {
            return Err(format!("{name} is declared twice"));
        }
        Ok(())
    }
}

fn first_line(text: &str) -> &str {
    text.lines().next().unwrap_or_default()
}

fn is_part_of_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Place of the semicolon or brace that ends the declaration at the start of `text`.
fn end_of_declaration(text: &str) -> Option<usize> {
    let mut open = 0_u32;
    text.char_indices().find_map(|(i, c)| {
        match c {
            '{' => open += 1,
            '}' if open > 1 => open -= 1,
            '}' => return Some(i),
            ';' if open == 0 => return Some(i),
            _ => {}
        }
        None
    })
}

/// The name that a declaration is for: after attributes, a keyword and the address space of a variable.
fn declared_name(declaration: &str) -> Option<&str> {
    let mut rest = declaration;
    while let Some(attribute) = rest.strip_prefix('@') {
        rest = attribute.trim_start_matches(is_part_of_name);
        if rest.starts_with('(') {
            rest = rest.split_once(')')?.1;
        }
        rest = rest.trim_start();
    }
    let (keyword, mut rest) = rest.split_at(rest.find(|c| !is_part_of_name(c))?);
    if !["fn", "struct", "const", "override", "alias", "var"].contains(&keyword) {
        return None;
    }
    if rest.starts_with('<') {
        rest = rest.split_once('>')?.1;
    }
    let name = rest.trim_start().split(|c| !is_part_of_name(c)).next();
    name.filter(|name| !name.is_empty())
}

/// Names in `text` that may be those of declarations: what follows a dot is a field.
fn names(text: &str) -> impl Iterator<Item = &str> {
    let paths = text.split(|c| !is_part_of_name(c) && c != '.');
    paths.filter_map(|path| path.split('.').next())
}

fn check_imports(shaders: &Shaders<'_>, path: &str, shader: &Shader<'_>) -> Result<(), String> {
    let used: BTreeSet<_> = shader.declared.values().flat_map(|d| names(d)).collect();
    for (name, from) in &shader.imported {
        let fault = match shaders.get(&**from) {
            None => "there is no such shader",
            Some(other) if !other.declared.contains_key(name) => "it declares no such name",
            _ if shader.declared.contains_key(name) => "the name is declared here too",
            _ if !used.contains(name) => "the name is not used",
            _ => continue,
        };
        return Err(format!("{path} imports {name} from {from}: {fault}"));
    }
    Ok(())
}

/// Adds the declaration that `name` means in `shader`, if it is one, and those that this one reaches.
fn reach<'t>(
    shaders: &Shaders<'t>,
    shader: &Shader<'t>,
    name: &str,
    reached: &mut BTreeSet<&'t str>,
) {
    if let Some(from) = shader.imported.get(name) {
        reach(shaders, &shaders[&**from], name, reached);
    } else if let Some(declaration) = shader.declared.get(name)
        && reached.insert(declaration)
    {
        for used in names(declaration) {
            reach(shaders, shader, used, reached);
        }
    }
}
