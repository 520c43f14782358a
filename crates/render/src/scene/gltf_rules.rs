//! From JSON to a document that keeps the rules of the format, those that reach across the parts of a file included.

use serde_json::Value;

use super::gltf_check;
use super::gltf_json::{Accessor, Document};
use super::gltf_schema::ROOT;

/// Parses and checks the JSON of a file: every index is inside its list afterwards.
///
/// # Errors
/// What is wrong, and where.
pub(super) fn parse(json: &[u8]) -> Result<Document, String> {
    let mut root: Value = serde_json::from_slice(json).map_err(|error| error.to_string())?;
    gltf_check::check(&mut root, &ROOT)?;
    let document = serde_json::from_value(root).map_err(|error| error.to_string())?;
    check(&document)?;
    Ok(document)
}

/// Checks all rules; every index is inside its list already. Says which is broken, and where.
fn check(document: &Document) -> Result<(), String> {
    check_version(document)?;
    check_channels(document)?;
    check_accessors(document)?;
    check_positions(document)?;
    check_tree(document)
}

/// A version that is read here.
fn check_version(document: &Document) -> Result<(), String> {
    let numbers = |version: &str| {
        let (major, minor) = version.split_once('.')?;
        Some((major.parse::<u32>().ok()?, minor.parse::<u32>().ok()?))
    };
    let version = &document.asset.version;
    let Some(stated @ (2, _)) = numbers(version) else {
        return Err(format!("asset.version must be \"2.0\", got {version:?}"));
    };
    let Some(least) = &document.asset.min_version else {
        return Ok(());
    };
    match numbers(least) {
        Some(least) if least <= (2, 0) && least <= stated => Ok(()),
        _ => Err(format!(
            "asset.minVersion must be at most \"2.0\", the version that is read here, got {least:?}"
        )),
    }
}

/// Channels of animations have samplers.
fn check_channels(document: &Document) -> Result<(), String> {
    for (i, animation) in document.animations.iter().enumerate() {
        let count = animation.samplers.len();
        let bad = animation
            .channels
            .iter()
            .position(|channel| channel.sampler >= count);
        if let Some(j) = bad {
            return Err(format!(
                "animations[{i}].channels[{j}].sampler must be an index below {count} (samplers), got {}",
                animation.channels[j].sampler
            ));
        }
    }
    Ok(())
}

/// Accessors without a view have no place in it.
fn check_accessors(document: &Document) -> Result<(), String> {
    let is_lost = |accessor: &Accessor| accessor.buffer_view.is_none() && accessor.byte_offset > 0;
    match document.accessors.iter().position(is_lost) {
        Some(i) => Err(format!(
            "accessors[{i}].byteOffset must be left out where bufferView is, got {}",
            document.accessors[i].byte_offset
        )),
        None => Ok(()),
    }
}

/// Positions have bounds.
fn check_positions(document: &Document) -> Result<(), String> {
    for (i, mesh) in document.meshes.iter().enumerate() {
        for (j, primitive) in mesh.primitives.iter().enumerate() {
            let index = primitive.attributes.get("POSITION");
            let lacks = |index: &&usize| {
                let accessor = &document.accessors[**index];
                let is_vector =
                    |bound: &Option<Vec<f64>>| bound.as_ref().is_some_and(|bound| bound.len() == 3);
                !is_vector(&accessor.min) || !is_vector(&accessor.max)
            };
            if let Some(index) = index.filter(lacks) {
                return Err(format!(
                    "accessors[{index}] lacks min and max of three numbers each, which meshes[{i}].primitives[{j}].attributes.POSITION needs"
                ));
            }
        }
    }
    Ok(())
}

/// Every node has one parent at most and is not inside itdocument.
fn check_tree(document: &Document) -> Result<(), String> {
    let mut parents = vec![None; document.nodes.len()];
    for (i, node) in document.nodes.iter().enumerate() {
        for &child in &node.children {
            if let Some(other) = parents[child].replace(i) {
                return Err(format!(
                    "nodes[{child}] must be a child once, but is one of nodes[{other}] and of nodes[{i}]"
                ));
            }
        }
    }
    // With one parent each, all nodes are reached from those without a parent unless there is a circle.
    let mut waiting: Vec<usize> = (0..parents.len())
        .filter(|&i| parents[i].is_none())
        .collect();
    let mut reached = vec![false; parents.len()];
    while let Some(i) = waiting.pop() {
        reached[i] = true;
        waiting.extend(&document.nodes[i].children);
    }
    match reached.iter().position(|reached| !reached) {
        Some(i) => Err(format!("nodes[{i}] must not be inside itself")),
        None => Ok(()),
    }
}
