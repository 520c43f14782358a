//! A shader with everything that it imports, as one text. The build script of `crates/lanes` and `crates/render` share
//! this file.

use wesl::{ManglerKind, ModulePath, VirtualResolver, Wesl};

/// The text of the shader `name` (its path below `shaders/`, without the extension). `sources` are all shaders: their
/// paths and texts. Declarations stand in the order of their own text: wesl hands them out in the order of a hash table,
/// which differs from run to run, and drivers keep compiled shaders by their text.
///
/// # Errors
/// When a name is no path of a module, or an import is missing or wrong: says which and why.
pub fn compose<'a>(
    sources: impl IntoIterator<Item = (&'a str, &'a str)>,
    name: &str,
) -> Result<String, String> {
    let mut resolver = VirtualResolver::new();
    for (path, text) in sources {
        resolver.add_module(module_path(path)?, text.into());
    }
    let mut compiler = Wesl::new_barebones().set_custom_resolver(resolver);
    compiler
        .use_imports(true)
        .use_stripping(true)
        .set_mangler(ManglerKind::None);
    let compiled = compiler.compile(&module_path(name)?);
    let mut composed = compiled.map_err(|e| e.to_string())?.syntax;
    composed
        .global_declarations
        .sort_by_cached_key(ToString::to_string);
    Ok(composed.to_string())
}

fn module_path(name: &str) -> Result<ModulePath, String> {
    format!("package::{}", name.replace('/', "::"))
        .parse()
        .map_err(|e| format!("{e}"))
}
