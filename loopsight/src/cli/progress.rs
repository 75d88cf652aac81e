//! A progress bar on standard error, on a terminal only.

use std::sync::Arc;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::cli::interrupt;
use crate::watch::{Progress, Watch};
use crate::words::percent;

/// A bar that follows long work until it is dropped; Ctrl-C stops the work.
pub(crate) struct Bar(Arc<ProgressBar>);

impl Bar {
    pub(crate) fn new() -> Self {
        let bar = ProgressBar::with_draw_target(Some(1), ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{prefix} {wide_bar} {percent}% {msg}") {
            bar.set_style(style);
        }
        Self(Arc::new(bar))
    }

    /// What moves the bar; Ctrl-C stops what reports to it.
    pub(crate) fn watch(&self) -> Watch {
        let bar = Arc::clone(&self.0);
        Watch::default()
            .reporting(move |progress| show(&bar, progress))
            .stopped_by(&interrupt::token())
    }
}

fn show(bar: &ProgressBar, progress: &Progress) {
    let round = match progress.round {
        0 => String::new(),
        round => format!("round {}: ", round + 1),
    };
    bar.set_prefix(format!("{round}{}", progress.stage.text()));
    bar.set_length(progress.total);
    bar.set_position(progress.done);
    if let Some(error) = progress.error {
        bar.set_message(format!("error {}", percent(error)));
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
        interrupt::work_ends();
    }
}
