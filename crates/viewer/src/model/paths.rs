//! Paths inside scene files, which start from the file's own folder.

use std::path::{Component, Path, PathBuf};

/// `file`, found from `from`, as a scene file in `to` would name it: with `..` where the folders have a common
/// beginning, else from the root. A shipped file goes by its name (`shipped:NAME`), wherever the scene is.
pub fn rebased(file: &Path, from: &Path, to: &Path) -> PathBuf {
    let shipped = [file.to_path_buf(), from.join(file)]
        .iter()
        .find_map(|path| uw_assets::shipped_name(path));
    if let Some(name) = shipped {
        return format!("{}{name}", uw_assets::SCHEME).into();
    }
    if file.is_absolute() {
        return file.to_path_buf();
    }
    let target = plain(&whole(&from.join(file)));
    let folder = plain(&whole(to));
    let common = target
        .components()
        .zip(folder.components())
        .take_while(|(a, b)| a == b)
        .count();
    let is_root = |c: Component<'_>| matches!(c, Component::RootDir | Component::Prefix(_));
    if !folder.components().take(common).any(|c| !is_root(c)) {
        return target;
    }
    let up = folder
        .components()
        .skip(common)
        .map(|_| Component::ParentDir);
    up.chain(target.components().skip(common)).collect()
}

/// From the root where that is known.
fn whole(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf())
}

/// Without `.` and, where a folder stands before it, without `..`.
fn plain(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for component in path.components() {
        match component {
            Component::CurDir => {}
            Component::ParentDir if out.file_name().is_some() => {
                out.pop();
            }
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_keeps_its_place_when_the_scene_moves() {
        let cases = [
            ("t.png", "/a/scenes", "/a/scenes", "t.png"),
            (
                "../textures/t.png",
                "/a/scenes",
                "/a/mine/deep",
                "../../textures/t.png",
            ),
            ("./sub/t.png", "/a/scenes", "/a", "scenes/sub/t.png"),
            ("../t.png", "/a/scenes", "/other", "/a/t.png"),
            ("/abs/t.png", "/a", "/b", "/abs/t.png"),
            (
                "../textures/t.png",
                "shipped:scenes",
                "/b",
                "shipped:textures/t.png",
            ),
            (
                "shipped:textures/t.png",
                "/a",
                "/b",
                "shipped:textures/t.png",
            ),
        ];
        for (file, from, to, expected) in cases {
            let got = rebased(file.as_ref(), from.as_ref(), to.as_ref());
            assert_eq!(got, Path::new(expected), "{file} from {from} to {to}");
        }
    }
}
