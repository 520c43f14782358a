//! `uw adapters`: the graphics adapters that `uw render --adapter` takes.

use std::io::{self, Write};

use serde_json::json;
use uw_render::gpu::{AdapterInfo, GpuError, adapters};

use super::error::CliError;
use super::output;

/// Lists the adapters, hardware first; as JSON where `json`.
pub(super) fn run(json: bool) -> Result<(), CliError> {
    let found = adapters();
    if found.is_empty() && !json {
        return Err(CliError::failed(GpuError::no_adapter()));
    }
    output::to_stdout(|out| match json {
        true => writeln!(out, "{}", json!(found)),
        false => write_table(out, &found),
    })
}

fn write_table(out: &mut dyn Write, adapters: &[AdapterInfo]) -> io::Result<()> {
    for adapter in adapters {
        let AdapterInfo {
            name,
            kind,
            backend,
            driver,
            largest_buffer_bytes,
        } = adapter;
        let mebibytes = largest_buffer_bytes >> 20;
        writeln!(
            out,
            "{name} ({kind}, {backend}, {driver}, buffers up to {mebibytes} MiB)"
        )?;
    }
    Ok(())
}
