//! A program that stands alone: a copy in an empty folder, in which the checkout that it was built from has no name.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Copies `program` into `folder` with every mention of the checkout replaced by a path of the same length that leads nowhere, so
/// that the copy cannot read it.
pub fn copy(program: &str, folder: &Path) -> PathBuf {
    let checkout = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let checkout = checkout.canonicalize().expect("the checkout");
    let checkout = checkout.to_str().expect("a path in UTF-8").as_bytes();
    let nowhere: Vec<u8> = b"/nowhere"
        .iter()
        .copied()
        .cycle()
        .take(checkout.len())
        .collect();
    let mut bytes = fs::read(program).expect("the program");
    let mut at = 0;
    while let Some(next) = bytes[at..]
        .windows(checkout.len())
        .position(|w| w == checkout)
    {
        at += next;
        bytes[at..at + checkout.len()].copy_from_slice(&nowhere);
    }
    let copy = folder.join(Path::new(program).file_name().expect("a name"));
    fs::write(&copy, bytes).expect("written");
    let permissions = fs::metadata(program).expect("the program").permissions();
    fs::set_permissions(&copy, permissions).expect("made executable");
    copy
}

/// The copy in its folder with the words of `line` as arguments, without environment and without data of the system.
pub fn command(copy: &Path, line: &str) -> Command {
    let folder = copy.parent().expect("a folder");
    let mut command = Command::new(copy);
    command
        .args(line.split_whitespace())
        .current_dir(folder)
        .env_clear()
        .env("HOME", folder.join("nobody"))
        .env("XDG_DATA_DIRS", "/nowhere")
        .stdin(Stdio::null());
    command
}
