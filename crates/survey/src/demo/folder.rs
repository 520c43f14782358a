//! The folder of a demonstration: made, or known as one's own, before anything is rendered.

use std::path::Path;

use serde_json::{Value, json};

use super::{DemoError, stages::write_text};

/// The file that marks a demonstration's folder.
const MARK: &str = "uw-demo.json";
/// Its format.
const FORMAT: &str = "uw-demo-folder/1";

/// Makes the folder with its mark, or takes one that an earlier demonstration left.
///
/// # Errors
/// [`DemoError::Input`] where the folder holds anything else or cannot be written to.
pub(super) fn claim(folder: &Path) -> Result<(), DemoError> {
    let refuse = |reason: String| DemoError::Input(format!("{}: {reason}", folder.display()));
    if folder.exists() && !folder.is_dir() {
        return Err(refuse("the output must be a folder, this is a file".into()));
    }
    if folder.is_dir() && !is_empty(folder).map_err(|e| refuse(e.to_string()))? && !is_ours(folder)
    {
        return Err(refuse(format!(
            "the folder holds files and is no demonstration's (it has no {MARK}); choose a new one with -o DIR"
        )));
    }
    let cannot =
        |e: &dyn std::fmt::Display| refuse(format!("the folder cannot be written to: {e}"));
    std::fs::create_dir_all(folder.join("calibration")).map_err(|e| cannot(&e))?;
    let mark = json!({"format": FORMAT, "made_by": concat!("uw demo ", env!("CARGO_PKG_VERSION"))});
    write_text(&folder.join(MARK), &format!("{mark}\n")).map_err(|e| cannot(&e))
}

fn is_empty(folder: &Path) -> std::io::Result<bool> {
    Ok(std::fs::read_dir(folder)?.next().is_none())
}

/// Whether a demonstration made the folder; the first versions wrote no mark, but a report.
fn is_ours(folder: &Path) -> bool {
    let format = |name: &str| -> Option<String> {
        let text = std::fs::read(folder.join(name)).ok()?;
        let value: Value = serde_json::from_slice(&text).ok()?;
        Some(value["format"].as_str()?.to_owned())
    };
    format(MARK).as_deref() == Some(FORMAT) || format("report.json").as_deref() == Some("uw-demo/1")
}
