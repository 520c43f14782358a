//! Work without the interpreter's lock, which Ctrl-C ends.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::errors::value_error;

/// How often signals are looked for.
const LOOK: Duration = Duration::from_millis(50);

/// Does `work` on a thread pool of its own while other threads of Python run. When a signal's handler raises an exception, as that of
/// Ctrl-C does, the flag that `work` is given is set, and the exception is returned when it has come to an end.
///
/// The pool is the call's own, so that a process that was forked after a call can make another.
///
/// # Errors
/// The exception of a signal's handler, or no threads to be had.
pub(crate) fn interruptible<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce(&AtomicBool) -> T + Send,
) -> PyResult<T> {
    let pool = pool(threads)?;
    let cancel = AtomicBool::new(false);
    py.detach(|| {
        thread::scope(|scope| {
            let (working, done) = channel::<()>();
            let worker = scope.spawn(|| {
                // Dropped at the end, however the work ends.
                let _working = working;
                pool.install(|| work(&cancel))
            });
            let interruption = loop {
                match done.recv_timeout(LOOK) {
                    Err(RecvTimeoutError::Timeout) => {
                        if let Err(raised) = Python::attach(|py| py.check_signals()) {
                            cancel.store(true, Ordering::Relaxed);
                            break Some(raised);
                        }
                    }
                    Ok(()) | Err(RecvTimeoutError::Disconnected) => break None,
                }
            };
            match (worker.join(), interruption) {
                (_, Some(raised)) => Err(raised),
                (Ok(value), None) => Ok(value),
                (Err(panic), None) => std::panic::resume_unwind(panic),
            }
        })
    })
}

fn pool(threads: Option<usize>) -> PyResult<ThreadPool> {
    let builder = ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0));
    builder.build().map_err(value_error)
}
