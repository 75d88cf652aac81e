//! What is seen while a loop runs: a few lines that are drawn again and again on a terminal, one line
//! a second anywhere else.

use std::time::{Duration, Instant};

use console::{Term, measure_text_width, truncate_str};
use loopsight_core::Step;

use super::recorder::Recorder;
use crate::cli::output;

/// Time between two pictures on a terminal, and between two lines elsewhere.
const REDRAW: Duration = Duration::from_millis(150);
const LINE: Duration = Duration::from_secs(1);

/// Parameters that are shown; more would not fit a small terminal.
const MOST_PARAMETERS: usize = 8;

/// Width of the bar of an input.
const BAR: usize = 17;

/// Shows a loop at work on standard error.
pub(super) struct Dashboard {
    term: Term,
    /// Seconds that were asked for, if any.
    duration: Option<f64>,
    next: Instant,
    /// Lines drawn by the last picture.
    drawn: usize,
    /// Largest magnitude of each input so far.
    largest: Vec<f64>,
}

impl Dashboard {
    pub(super) fn new(duration: Option<f64>, inputs: usize) -> Self {
        let term = Term::buffered_stderr();
        let wait = if term.is_term() { REDRAW } else { LINE };
        Self {
            next: Instant::now() + wait,
            term,
            duration,
            drawn: 0,
            largest: vec![0.0; inputs],
        }
    }

    /// Takes a tick; draws when it is time to. What cannot be drawn is not drawn: a loop does not stop
    /// because nobody can look at it.
    pub(super) fn take(&mut self, step: &Step<'_, f64>, recorder: &Recorder) {
        for (largest, applied) in self.largest.iter_mut().zip(step.applied) {
            *largest = largest.max(applied.abs());
        }
        let now = Instant::now();
        if now < self.next {
            return;
        }
        if !self.term.is_term() {
            self.next = now + LINE;
            output::note(&line(step, recorder));
            return;
        }
        self.next = now + REDRAW;
        let width = usize::from(self.term.size().1).max(20);
        let lines = self.picture(step, recorder, width);
        let _ = self.clear();
        for line in &lines {
            let _ = self.term.write_line(line);
        }
        self.drawn = lines.len();
        let _ = self.term.flush();
    }

    /// Takes the picture away: what comes next is written in its place.
    pub(super) fn clear(&mut self) -> std::io::Result<()> {
        if self.drawn > 0 {
            self.term.clear_last_lines(self.drawn)?;
            self.drawn = 0;
            self.term.flush()?;
        }
        Ok(())
    }

    /// The lines of a picture, none wider than `width`.
    fn picture(&self, step: &Step<'_, f64>, recorder: &Recorder, width: usize) -> Vec<String> {
        let record = &recorder.record;
        let ticks = record.ticks().max(1) as f64;
        let of = self.duration.map_or_else(String::new, |d| {
            let done = (step.tick.time / d).clamp(0.0, 1.0);
            format!(" of {} s  {}", output::number(d), bar(done, 20, ('#', '-')))
        });
        let mut lines = vec![format!("{:.2} s{of}", step.tick.time)];
        let mut said = format!(
            "saturated {:.1} %   stale {:.1} %",
            100.0 * recorder.saturated as f64 / ticks,
            100.0 * recorder.stale as f64 / ticks
        );
        if let Some(timing) = &record.timing {
            said.push_str(&format!("   jitter {:.2} ms", 1e3 * timing.jitter_s));
        }
        if step.fallen {
            said.push_str("   LAST GOOD MODEL");
        }
        lines.push(said);
        for (i, trace) in record.controlled.iter().enumerate() {
            let rms = recorder.errors[i].rms().unwrap_or(f64::NAN);
            lines.push(format!(
                "{} {:>8} of {:>8} {:<6} rms {:>8}",
                name(&trace.id),
                short(step.measured[i]),
                short(step.reference[i]),
                trace.unit,
                short(rms)
            ));
        }
        for (i, trace) in record.inputs.iter().enumerate() {
            let share = step.applied[i] / self.largest[i].max(f64::MIN_POSITIVE);
            lines.push(format!(
                "{} {:>8} {:<6} {}",
                name(&trace.id),
                short(step.applied[i]),
                trace.unit,
                needle(share)
            ));
        }
        for (i, p) in record.parameters.iter().take(MOST_PARAMETERS).enumerate() {
            let value = short(recorder.estimates[i]);
            let std = Some(recorder.deviations[i]).filter(|s| s.is_finite());
            let std = std.map_or_else(String::new, |s| format!(" ± {}", short(s)));
            lines.push(format!("{} {value:>8}{std} {}", name(&p.name), p.unit));
        }
        if let Some((time, what)) = record.events.last() {
            lines.push(format!("{time:.2} s: {what}"));
        }
        // A terminal that is full to the last column starts a new line.
        let most = width - 1;
        lines
            .into_iter()
            .map(|line| truncate_str(&line, most, "…").into_owned())
            .collect()
    }
}

/// The line for those who are not at a terminal.
fn line(step: &Step<'_, f64>, recorder: &Recorder) -> String {
    let mut text = format!("{:.2} s", step.tick.time);
    for (i, trace) in recorder.record.controlled.iter().enumerate() {
        text.push_str(&format!(
            "  {} {} of {} {}",
            trace.id,
            short(step.measured[i]),
            short(step.reference[i]),
            trace.unit
        ));
    }
    for (i, trace) in recorder.record.inputs.iter().enumerate() {
        let value = short(step.applied[i]);
        text.push_str(&format!("  {} {value} {}", trace.id, trace.unit));
    }
    if step.outcome.saturated {
        text.push_str("  saturated");
    }
    if step.fallen {
        text.push_str("  last good model");
    }
    text
}

/// A name in a column of sixteen.
fn name(id: &str) -> String {
    let text = truncate_str(id, 16, "…");
    let gap = 16 - measure_text_width(&text).min(16);
    format!("{text}{}", " ".repeat(gap))
}

/// Four significant digits in at most eight characters or so.
fn short(value: f64) -> String {
    if !value.is_finite() {
        return "-".to_owned();
    }
    // Adding 0 makes -0 into 0.
    let (value, size) = (value + 0.0, value.abs());
    if size != 0.0 && !(1e-3..1e5).contains(&size) {
        return format!("{value:.1e}");
    }
    let digits = if size < 1.0 {
        4
    } else {
        3_usize.saturating_sub(size.log10() as usize)
    };
    format!("{value:.digits$}")
}

fn bar(share: f64, width: usize, (full, empty): (char, char)) -> String {
    let n = (share * width as f64).round() as usize;
    let text: String = (0..width)
        .map(|i| if i < n { full } else { empty })
        .collect();
    format!("[{text}]")
}

/// Where in ±1 something is.
fn needle(share: f64) -> String {
    let middle = BAR / 2;
    let at = (middle as f64 * (1.0 + share.clamp(-1.0, 1.0))).round() as usize;
    let text: String = (0..BAR)
        .map(|i| match i {
            i if i == at => '#',
            i if i == middle => '|',
            i if (at.min(middle)..at.max(middle)).contains(&i) => '=',
            _ => ' ',
        })
        .collect();
    format!("[{text}]")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (0.0, "0.0000"),
            (-0.0, "0.0000"),
            (0.19834, "0.1983"),
            (-15.1464, "-15.15"),
            (1234.5, "1234"),
            (1.5e-7, "1.5e-7"),
            (f64::NAN, "-"),
        ] {
            assert_eq!(short(value), text);
        }
    }

    #[test]
    fn needles_point() {
        assert_eq!(needle(-1.0), "[#=======|        ]");
        assert_eq!(needle(0.0), "[        #        ]");
        assert_eq!(needle(9.0), "[        |=======#]");
        assert_eq!(bar(0.5, 4, ('#', '-')), "[##--]");
        assert_eq!(measure_text_width(&name("a_name_that_is_too_long")), 16);
    }
}
