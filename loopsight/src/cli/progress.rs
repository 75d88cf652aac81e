//! How far long work is and what it knows already, on standard error, on a terminal only.

use std::sync::{Arc, Mutex, PoisonError};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::cli::interrupt;
use crate::watch::{Early, Finding, Progress, Watch};
use crate::words::{percent, report};

/// A bar that follows long work until it is dropped, under lines with what is known already; Ctrl-C stops the work. All of
/// it vanishes in the end, since the answer says it again.
pub(crate) struct Bar {
    bar: Arc<ProgressBar>,
    lines: Arc<Mutex<Lines>>,
}

/// The lines above a bar, from top to bottom.
struct Lines {
    all: MultiProgress,
    /// What an improvement added: a line for each.
    added: Vec<ProgressBar>,
    /// What the present model leaves, what promises most, and what was best so far.
    present: [Option<ProgressBar>; 3],
    /// The error of the best so far.
    best: f64,
}

impl Bar {
    pub(crate) fn new() -> Self {
        let all = MultiProgress::with_draw_target(ProgressDrawTarget::stderr());
        let bar = all.add(ProgressBar::new(1));
        if let Ok(style) = ProgressStyle::with_template("{prefix} {wide_bar} {percent}% {msg}") {
            bar.set_style(style);
        }
        let lines = Lines {
            all,
            added: Vec::new(),
            present: [None, None, None],
            best: f64::INFINITY,
        };
        Self {
            bar: Arc::new(bar),
            lines: Arc::new(Mutex::new(lines)),
        }
    }

    /// What moves the bar and writes the lines; Ctrl-C stops what reports to it.
    pub(crate) fn watch(&self) -> Watch {
        let (bar, lines) = (Arc::clone(&self.bar), Arc::clone(&self.lines));
        Watch::default()
            .reporting(move |progress| show(&bar, progress))
            .telling(move |early| {
                let mut lines = lines.lock().unwrap_or_else(PoisonError::into_inner);
                lines.show(early);
            })
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

impl Lines {
    fn show(&mut self, early: &Early) {
        let said = report::early::line(early);
        match &early.finding {
            Finding::Compared { .. } => {
                self.forget();
                self.write(0, said);
            }
            Finding::Promised { .. } => self.write(1, said),
            Finding::Finalist(found) if found.nrmse < self.best => {
                self.best = found.nrmse;
                self.write(2, format!("best so far: {said}"));
            }
            Finding::Added(_) => {
                self.forget();
                let line = self.line(self.added.len());
                line.set_message(said);
                self.added.push(line);
            }
            _ => {}
        }
    }

    /// The present lines go: another model is tried, or more of the log.
    fn forget(&mut self) {
        for line in self.present.iter_mut().filter_map(Option::take) {
            line.finish_and_clear();
            self.all.remove(&line);
        }
        self.best = f64::INFINITY;
    }

    /// Writes the present line `of`, in its place or anew.
    fn write(&mut self, of: usize, said: String) {
        let above = self.present[..of].iter().flatten().count();
        let line = match self.present[of].take() {
            Some(line) => line,
            None => self.line(self.added.len() + above),
        };
        line.set_message(said);
        self.present[of] = Some(line);
    }

    /// A new line, with so many above it.
    fn line(&self, above: usize) -> ProgressBar {
        let line = self.all.insert(above, ProgressBar::new(1));
        if let Ok(style) = ProgressStyle::with_template("{wide_msg}") {
            line.set_style(style);
        }
        line
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        let mut lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        lines.forget();
        for line in lines.added.drain(..) {
            line.finish_and_clear();
        }
        self.bar.finish_and_clear();
        interrupt::work_ends();
    }
}
