//! A daemon for programs without an asynchronous runtime.

use std::io;
use std::net::SocketAddr;
use std::thread::JoinHandle;

use tokio::sync::oneshot;

use super::{Daemon, Limits};
use crate::service::Service;

/// A daemon that runs on threads of its own.
#[derive(Debug)]
pub struct Running {
    local_addr: SocketAddr,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Running {
    /// The address bound.
    pub fn local_addr(&self) -> SocketAddr {
        self.local_addr
    }

    /// Stops serving and waits until the daemon has ended; dropping does the same.
    pub fn shutdown(self) {}
}

impl Drop for Running {
    fn drop(&mut self) {
        if let Some(stop) = self.stop.take() {
            // An error means that the daemon has ended already.
            let _ = stop.send(());
        }
        if let Some(thread) = self.thread.take() {
            // A panic in the thread has been printed by then.
            let _ = thread.join();
        }
    }
}

/// Starts a daemon on a thread of its own, for programs without an asynchronous runtime.
pub fn spawn(address: &str, service: Service, limits: Limits) -> io::Result<Running> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()?;
    let daemon = runtime.block_on(Daemon::bind(address, service, limits))?;
    let local_addr = daemon.local_addr()?;
    let (stop, stopped) = oneshot::channel::<()>();
    let thread = std::thread::Builder::new()
        .name("uwguide".to_owned())
        .spawn(move || {
            runtime.block_on(daemon.run(async {
                // A dropped handle stops the daemon as well.
                let _ = stopped.await;
            }));
        })?;
    Ok(Running {
        local_addr,
        stop: Some(stop),
        thread: Some(thread),
    })
}
