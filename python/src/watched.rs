//! Long work: off the interpreter's thread, with progress, and stopped by Ctrl-C.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use loopsight::{CancelToken, Watch};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::error::raised;

/// How often Python is asked whether somebody wants to stop, and told how far the work is.
const LOOK: Duration = Duration::from_millis(50);
/// The stack of the thread that works: as much as the command's own thread has.
const STACK: usize = 8 << 20;

/// Does `work` on a thread of its own, while other Python threads run. Calls `progress(stage, done, total)`
/// on the calling thread. Ctrl-C, or an exception of `progress`, cancels the work and is raised.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(Watch) -> loopsight::Result<T> + Send,
) -> PyResult<T> {
    let token = CancelToken::new();
    let latest = Arc::new(Mutex::new(None));
    let mut watch = Watch::default().stopped_by(&token);
    if progress.is_some() {
        let latest = Arc::clone(&latest);
        watch = watch.reporting(move |now| {
            let now = (now.stage.text(), now.done, now.total);
            *latest.lock().unwrap_or_else(PoisonError::into_inner) = Some(now);
        });
    }
    let (tell, told) = channel();
    let told = Mutex::new(told);
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
            let wait = || {
                let told = told.lock().unwrap_or_else(PoisonError::into_inner);
                told.recv_timeout(LOOK)
            };
            if py.detach(wait) != Err(RecvTimeoutError::Timeout) {
                break;
            }
            if stopped.is_some() {
                continue;
            }
            let mut look = py.check_signals();
            if let (Ok(()), Some(progress)) = (&look, progress) {
                let now = latest.lock().unwrap_or_else(PoisonError::into_inner).take();
                if let Some((stage, done, total)) = now {
                    look = progress.call1((stage, done, total)).map(|_| ());
                }
            }
            if let Err(error) = look {
                token.cancel();
                stopped = Some(error);
            }
        }
        let answer = py.detach(|| worker.join());
        match (stopped, answer) {
            (Some(stopped), _) => Err(stopped),
            (None, Ok(answer)) => answer.map_err(|error| raised(py, &error)),
            (None, Err(_)) => Err(PyRuntimeError::new_err(
                "the engine stopped at a defect of its own; please report it with the model and the log",
            )),
        }
    })
}
