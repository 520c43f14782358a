//! Ctrl-C and the request to terminate.

use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::error::{CliError, INTERRUPTED};

/// A flag that the first Ctrl-C (or SIGTERM) sets, so that finished work can be kept; the second one ends the
/// process at once. To be called once per process.
pub(crate) fn cancel_flag() -> Result<Arc<AtomicBool>, CliError> {
    let flag = Arc::new(AtomicBool::new(false));
    let shared = Arc::clone(&flag);
    ctrlc::set_handler(move || {
        if shared.swap(true, Ordering::Relaxed) {
            process::exit(i32::from(INTERRUPTED));
        }
    })
    .map_err(|error| CliError::failed(format!("cannot listen for Ctrl-C: {error}")))?;
    Ok(flag)
}
