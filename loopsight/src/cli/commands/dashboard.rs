//! What is shown while a loop runs: a few lines that are redrawn on a terminal, or one line a second elsewhere.

use std::time::{Duration, Instant};

use console::{Term, measure_text_width, truncate_str};

use crate::RunView;
use crate::cli::output;
use crate::words::number;

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
    next: Instant,
    /// Lines drawn by the last picture.
    drawn: usize,
    /// Largest magnitude of each input so far.
    largest: Vec<f64>,
}

impl Dashboard {
    pub(super) fn new() -> Self {
        let term = Term::buffered_stderr();
        let wait = if term.is_term() { REDRAW } else { LINE };
        Self {
            next: Instant::now() + wait,
            term,
            drawn: 0,
            largest: Vec::new(),
        }
    }

    /// Takes a tick; draws when it is time to. A loop does not stop because something cannot be drawn.
    pub(super) fn take(&mut self, view: &RunView<'_>) {
        for (i, input) in view.inputs().enumerate() {
            match self.largest.get_mut(i) {
                Some(largest) => *largest = largest.max(input.applied.abs()),
                None => self.largest.push(input.applied.abs()),
            }
        }
        let now = Instant::now();
        if now < self.next {
            return;
        }
        if !self.term.is_term() {
            self.next = now + LINE;
            output::note(&line(view));
            return;
        }
        self.next = now + REDRAW;
        let width = usize::from(self.term.size().1).max(20);
        let lines = self.picture(view, width);
        let _ = self.clear();
        for line in &lines {
            let _ = self.term.write_line(line);
        }
        self.drawn = lines.len();
        let _ = self.term.flush();
    }

    /// Clears the picture: what comes next is written in its place.
    pub(super) fn clear(&mut self) -> std::io::Result<()> {
        if self.drawn > 0 {
            self.term.clear_last_lines(self.drawn)?;
            self.drawn = 0;
            self.term.flush()?;
        }
        Ok(())
    }

    /// The lines of a picture, none wider than `width`.
    fn picture(&self, view: &RunView<'_>, width: usize) -> Vec<String> {
        let of = view.duration_s().map_or_else(String::new, |d| {
            let done = (view.time_s() / d).clamp(0.0, 1.0);
            format!(" of {} s  {}", number(d), bar(done, 20, ('#', '-')))
        });
        let mut lines = vec![format!("{:.2} s{of}", view.time_s())];
        let mut said = format!(
            "saturated {:.1} %   stale {:.1} %",
            100.0 * view.saturated_share(),
            100.0 * view.stale_share()
        );
        if let Some(jitter) = view.jitter_s() {
            said.push_str(&format!("   jitter {:.2} ms", 1e3 * jitter));
        }
        if view.fallen_back() {
            said.push_str("   LAST GOOD MODEL");
        }
        lines.push(said);
        for signal in view.controlled() {
            lines.push(format!(
                "{} {:>8} of {:>8} {:<6} rms {:>8}",
                name(signal.id),
                short(signal.measured),
                short(signal.reference),
                signal.unit,
                short(signal.rms_error)
            ));
        }
        for (input, largest) in view.inputs().zip(&self.largest) {
            let share = input.applied / largest.max(f64::MIN_POSITIVE);
            lines.push(format!(
                "{} {:>8} {:<6} {}",
                name(input.id),
                short(input.applied),
                input.unit,
                needle(share)
            ));
        }
        for p in view.parameters().take(MOST_PARAMETERS) {
            let std = p
                .std
                .map_or_else(String::new, |s| format!(" ± {}", short(s)));
            lines.push(format!(
                "{} {:>8}{std} {}",
                name(p.name),
                short(p.value),
                p.unit
            ));
        }
        if let Some((time, what)) = view.last_event() {
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
fn line(view: &RunView<'_>) -> String {
    let mut text = format!("{:.2} s", view.time_s());
    for signal in view.controlled() {
        text.push_str(&format!(
            "  {} {} of {} {}",
            signal.id,
            short(signal.measured),
            short(signal.reference),
            signal.unit
        ));
    }
    for input in view.inputs() {
        let value = short(input.applied);
        text.push_str(&format!("  {} {value} {}", input.id, input.unit));
    }
    if view.saturated() {
        text.push_str("  saturated");
    }
    if view.fallen_back() {
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
