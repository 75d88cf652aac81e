//! Long work: off the interpreter's thread, with progress and what is known before it ends, and stopped by Ctrl-C.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use loopsight::{CancelToken, Early, Watch};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::error::raised;

/// How often Python is asked whether somebody wants to stop, and told how far the work is.
const LOOK: Duration = Duration::from_millis(50);
/// The stack of the thread that works: as much as the command's own thread has.
const STACK: usize = 8 << 20;

/// Whom long work tells something, each on the calling thread.
#[derive(Clone, Copy, Default)]
pub(crate) struct Told<'a, 'py> {
    /// Called as `progress(stage, done, total)`, from time to time.
    pub(crate) progress: Option<&'a Bound<'py, PyAny>>,
    /// Called as `early(json)` with all that is known before the work ends.
    pub(crate) early: Option<&'a Bound<'py, PyAny>>,
}

impl<'a, 'py> From<Option<&'a Bound<'py, PyAny>>> for Told<'a, 'py> {
    fn from(progress: Option<&'a Bound<'py, PyAny>>) -> Self {
        let early = None;
        Self { progress, early }
    }
}

/// What work on another thread has told so far.
#[derive(Default)]
struct Heard {
    latest: Mutex<Option<(&'static str, u64, u64)>>,
    early: Mutex<Vec<Early>>,
}

fn locked<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Heard {
    fn hand_on(&self, to: Told<'_, '_>) -> PyResult<()> {
        let early = std::mem::take(&mut *locked(&self.early));
        if let Some(hear) = to.early {
            for known in early {
                let said = serde_json::to_string(&known);
                hear.call1((said.map_err(|error| PyValueError::new_err(error.to_string()))?,))?;
            }
        }
        let latest = locked(&self.latest).take();
        if let (Some(progress), Some(now)) = (to.progress, latest) {
            progress.call1(now)?;
        }
        Ok(())
    }
}

/// Does `work` on a thread of its own, while other Python threads run. Ctrl-C, or an exception of what is `told`, cancels
/// the work and is raised.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    told: Told<'_, '_>,
    work: impl FnOnce(Watch) -> loopsight::Result<T> + Send,
) -> PyResult<T> {
    let token = CancelToken::new();
    let heard = Arc::new(Heard::default());
    let mut watch = Watch::default().stopped_by(&token);
    if told.progress.is_some() {
        let heard = Arc::clone(&heard);
        watch = watch.reporting(move |now| {
            *locked(&heard.latest) = Some((now.stage.text(), now.done, now.total));
        });
    }
    if told.early.is_some() {
        let heard = Arc::clone(&heard);
        watch = watch.telling(move |known| locked(&heard.early).push(known.clone()));
    }
    let (tell, ended) = channel();
    let ended = Mutex::new(ended);
    thread::scope(|scope| {
        let worker = thread::Builder::new()
            .stack_size(STACK)
            .spawn_scoped(scope, move || {
                let answer = work(watch);
                // Nobody listens only where the caller is gone, and it waits below.
                let _ = tell.send(());
                answer
            })?;
        let mut stopped = None;
        loop {
            let wait = || locked(&ended).recv_timeout(LOOK);
            if py.detach(wait) != Err(RecvTimeoutError::Timeout) {
                break;
            }
            if stopped.is_some() {
                continue;
            }
            let look = py.check_signals();
            if let Err(error) = look.and_then(|()| heard.hand_on(told)) {
                token.cancel();
                stopped = Some(error);
            }
        }
        let answer = py.detach(|| worker.join());
        if stopped.is_none() {
            // What was told since the last look.
            stopped = heard.hand_on(told).err();
        }
        match (stopped, answer) {
            (Some(stopped), _) => Err(stopped),
            (None, Ok(answer)) => answer.map_err(|error| raised(py, &error)),
            (None, Err(_)) => Err(PyRuntimeError::new_err(
                "the engine stopped at a defect of its own; please report it with the model and the log",
            )),
        }
    })
}
