//! What keeps a daemon running: logs, metrics and health over HTTP, the service manager.

pub mod http;
pub mod log;
#[cfg(unix)]
pub mod supervisor;
