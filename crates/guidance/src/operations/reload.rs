//! Model and profile read again while the daemon runs.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tokio::sync::oneshot;
use tokio::time::timeout;

use crate::record::Recorder;
use crate::service::{Loaded, Service};

/// How long reading may take before the daemon goes on with what it has.
const READING_TIME: Duration = Duration::from_secs(30);

type Load = dyn Fn() -> Result<Loaded, String> + Send + Sync;

/// Reads files on a thread of its own that nothing waits for: a file system that hangs keeps neither the
/// answers nor the end of the daemon waiting.
pub struct Reloader {
    load: Arc<Load>,
    reading: Arc<AtomicBool>,
}

impl std::fmt::Debug for Reloader {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_struct("Reloader")
            .field("reading", &self.reading)
            .finish_non_exhaustive()
    }
}

/// Ends a reading, also where it panics.
struct ReadGuard(Arc<AtomicBool>);

impl Drop for ReadGuard {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}

impl Reloader {
    /// A reloader of what `load` reads.
    pub fn new(load: impl Fn() -> Result<Loaded, String> + Send + Sync + 'static) -> Self {
        Self {
            load: Arc::new(load),
            reading: Arc::new(AtomicBool::new(false)),
        }
    }

    /// Reads and puts to use; what cannot be used is refused, and the service keeps what it has.
    pub async fn reload(&self, service: &Service, recorder: Option<&Recorder>) {
        match self.read().await {
            Ok(loaded) => {
                let (sequence, loaded) = service.replace(loaded);
                tracing::info!(model = loaded.model_name, "reloaded");
                if let Some(recorder) = recorder {
                    recorder.reloaded(sequence, &loaded);
                }
            }
            Err(message) => {
                tracing::error!(message, "reload refused; the old model and profile stay");
                service.reload_failed(message);
            }
        }
    }

    async fn read(&self) -> Result<Loaded, String> {
        if self.reading.swap(true, Ordering::AcqRel) {
            return Err("the files of an earlier reload are still being read".to_owned());
        }
        let (load, reading) = (Arc::clone(&self.load), ReadGuard(Arc::clone(&self.reading)));
        let (tell, told) = oneshot::channel();
        let begun: io::Result<_> =
            std::thread::Builder::new()
                .name("reload".to_owned())
                .spawn(move || {
                    let loaded = load();
                    drop(reading);
                    // Nobody listens any more where it took too long.
                    let _ = tell.send(loaded);
                });
        begun.map_err(|error| format!("no thread to read the files: {error}"))?;
        match timeout(READING_TIME, told).await {
            Ok(Ok(loaded)) => loaded,
            Ok(Err(_)) => Err("reading the files failed".to_owned()),
            Err(_) => {
                let seconds = READING_TIME.as_secs();
                Err(format!("the files could not be read within {seconds} s"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;
    use std::thread;

    use super::*;

    #[test]
    fn files_that_are_never_read_keep_nobody_waiting() {
        let (done, ended) = channel();
        thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_multi_thread()
                .worker_threads(1)
                .enable_all()
                .build()
                .unwrap();
            let reloader = Arc::new(Reloader::new(|| {
                loop {
                    thread::park();
                }
            }));
            let second = runtime.block_on(async {
                let first = Arc::clone(&reloader);
                let reading = tokio::spawn(async move { first.read().await.map(|_| ()) });
                while !reloader.reading.load(Ordering::Acquire) {
                    tokio::task::yield_now().await;
                }
                assert!(!reading.is_finished());
                reloader.read().await.map(|_| ())
            });
            drop(runtime);
            done.send(second).unwrap();
        });
        let second = ended.recv_timeout(Duration::from_secs(20)).unwrap();
        assert!(second.unwrap_err().contains("still being read"));
    }
}
