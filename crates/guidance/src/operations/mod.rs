//! What keeps a daemon running: files, metrics and health over HTTP, reloading, the service manager.

pub mod files;
pub mod http;
pub mod reload;
#[cfg(unix)]
pub mod supervisor;
pub mod throttle;
