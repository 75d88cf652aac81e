//! Bytes of a file that is being written, on their way to the disk, while nobody waits for it.

use std::fs::File;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// Longest time between two syncs of a file that is written to.
const PERIOD: Duration = Duration::from_secs(1);

/// Syncs a file about once a second in a thread of its own: a slow disk must not hold up a control loop.
///
/// Without a thread (a system that has none) the file is synced when it is finished.
pub(crate) struct Syncer {
    ask: Option<SyncSender<()>>,
    asked: Instant,
    /// How often it was synced.
    #[cfg_attr(not(test), allow(dead_code, reason = "only tests look at it"))]
    done: Arc<AtomicU64>,
}

impl Syncer {
    /// A syncer of `file`.
    pub(crate) fn of(file: &File) -> Self {
        let done = Arc::new(AtomicU64::new(0));
        let count = Arc::clone(&done);
        let ask = file.try_clone().ok().and_then(|file| {
            let (ask, asked) = sync_channel(1);
            let thread = std::thread::Builder::new().name("sync".to_owned());
            let spawned = thread.spawn(move || {
                while asked.recv().is_ok() {
                    // A disk that fails says so to the next write, or where the file is finished.
                    if file.sync_data().is_ok() {
                        count.fetch_add(1, Ordering::Relaxed);
                    }
                }
            });
            spawned.ok().map(|_| ask)
        });
        Self {
            ask,
            asked: Instant::now(),
            done,
        }
    }

    /// What was written so far may go to the disk, if the last time was a second ago.
    pub(crate) fn flushed(&mut self) {
        if self.asked.elapsed() >= PERIOD {
            self.asked = Instant::now();
            if let Some(ask) = &self.ask {
                // One that is under way already takes these bytes along, or the next one does.
                let _ = ask.try_send(());
            }
        }
    }

    /// How often it was synced.
    #[cfg(test)]
    pub(crate) fn done(&self) -> u64 {
        self.done.load(Ordering::Relaxed)
    }

    /// As if the last time was a second ago.
    #[cfg(test)]
    pub(crate) fn age(&mut self) {
        self.asked = self.asked.checked_sub(PERIOD).unwrap_or(self.asked);
    }
}
