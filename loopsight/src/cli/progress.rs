//! A progress bar on standard error, on a terminal only.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use loopsight_diagnosis::Progress;

use crate::cli::output;

/// A spinner with a message, for work whose length is not known.
pub(crate) fn spinner(what: &str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{spinner} {prefix}: {msg} [{elapsed}]") {
        bar.set_style(style);
    }
    bar.set_prefix(what.to_owned());
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}

/// A bar from 0 to `length`.
pub(crate) fn bar(what: &str, length: u64) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{prefix} {wide_bar} {percent}% [{eta}]") {
        bar.set_style(style);
    }
    bar.set_prefix(what.to_owned());
    bar
}

/// Shows how far work is on a [`bar`].
pub(crate) fn shown(bar: &ProgressBar) -> impl Fn(&Progress) + Sync + '_ {
    |progress| {
        let stage = progress.stage.text();
        bar.set_prefix(match progress.round {
            0 => stage.to_owned(),
            round => format!("round {}: {stage}", round + 1),
        });
        bar.set_length(progress.total);
        bar.set_position(progress.done);
    }
}

/// Shows how far a fit is on a [`spinner`].
pub(crate) fn counted(bar: &ProgressBar) -> impl Fn(&Progress) + Sync + '_ {
    |progress| {
        bar.set_message(match progress.error {
            Some(error) => format!(
                "iteration {}, error {}",
                progress.done,
                output::percent(error)
            ),
            None => format!("{} of {} samples", progress.done, progress.total),
        });
    }
}
