//! Structured logs on standard error or in a file.
//!
//! Lines go through a bounded queue to a thread of their own: a reader that stalls or a disk that is full
//! costs log lines, never an answer.

use std::io;
use std::path::PathBuf;

use tracing::level_filters::LevelFilter;
use tracing_appender::non_blocking::{NonBlockingBuilder, WorkerGuard};

use uw_guidance::operations::files::append;

/// Log lines that may wait to be written.
const QUEUE: usize = 8192;

/// How logs look and where they go.
#[derive(Clone, Debug, PartialEq)]
pub struct LogConfig {
    /// Least important level that is written.
    pub level: LevelFilter,
    /// One JSON object a line instead of text.
    pub json: bool,
    /// File that lines are appended to; standard error without one.
    pub file: Option<PathBuf>,
}

impl Default for LogConfig {
    fn default() -> Self {
        Self {
            level: LevelFilter::INFO,
            json: false,
            file: None,
        }
    }
}

/// Begins logging for the whole process; lines still waiting are written when the guard is dropped. A new
/// file is for its owner, and for its group where that is wanted.
pub fn begin(config: &LogConfig, group_may_read: bool) -> io::Result<WorkerGuard> {
    let queue = NonBlockingBuilder::default()
        .lossy(true)
        .buffered_lines_limit(QUEUE);
    let (writer, guard) = match &config.file {
        None => queue.finish(io::stderr()),
        Some(path) => queue.finish(append(path, group_may_read)?),
    };
    let builder = tracing_subscriber::fmt()
        .with_max_level(config.level)
        .with_target(false)
        .with_ansi(false)
        .log_internal_errors(false)
        .with_writer(writer);
    // A subscriber that is set already (by a program around this one) stays.
    if config.json {
        let _ = tracing::subscriber::set_global_default(builder.json().finish());
    } else {
        let _ = tracing::subscriber::set_global_default(builder.finish());
    }
    Ok(guard)
}
