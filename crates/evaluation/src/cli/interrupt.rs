//! Ctrl-C and the request to terminate.

use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::EvalError;

/// A flag that the first Ctrl-C (or SIGTERM) sets; the second one ends the process at once. Once per process.
pub(super) fn cancel_flag() -> Result<Arc<AtomicBool>, EvalError> {
    let flag = Arc::new(AtomicBool::new(false));
    let shared = Arc::clone(&flag);
    ctrlc::set_handler(move || {
        if shared.swap(true, Ordering::Relaxed) {
            process::exit(130);
        }
    })
    .map_err(|error| EvalError::Input(format!("cannot listen for Ctrl-C: {error}")))?;
    Ok(flag)
}
