//! What goes wrong, shown to a person once.

use std::ops::Range;

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};

use super::output;
use crate::error::Error;

/// Shows an error on standard error: in its text with a caret, where there is one.
pub(crate) fn print(error: &Error) {
    let text = placed(error).unwrap_or_else(|| {
        let help = error.help();
        let help = help.map_or_else(String::new, |help| {
            // What can be pasted stands on lines of its own.
            if help.contains('\n') {
                format!("\n{help}")
            } else {
                format!(" ({help})")
            }
        });
        format!("error: {}{help}", error.message())
    });
    output::note(text.trim_end());
}

/// The text with the place of the mistake, and a line before and behind it.
fn placed(error: &Error) -> Option<String> {
    let (file, (text, span)) = (error.file()?, error.excerpt()?);
    let (lines, first) = around(text, &span)?;
    let at = span.start - lines.start..span.end.min(lines.end) - lines.start;
    let shown = &text[lines];
    let snippet = Snippet::source(shown)
        .path(file)
        .line_start(first)
        .annotation(AnnotationKind::Visible.span(0..shown.len()))
        .annotation(AnnotationKind::Primary.span(at));
    let mut report = Level::ERROR.primary_title(error.message()).element(snippet);
    if let Some(help) = error.help() {
        report = report.element(Level::HELP.message(help));
    }
    let colours = std::io::IsTerminal::is_terminal(&std::io::stderr())
        && std::env::var_os("NO_COLOR").is_none();
    let renderer = if colours {
        Renderer::styled()
    } else {
        Renderer::plain()
    };
    let width = console::Term::stderr().size().1.max(40);
    Some(renderer.term_width(width.into()).render(&[report]))
}

/// The lines of `span`, one before and one behind, in bytes, and the number of the first of them.
fn around(text: &str, span: &Range<usize>) -> Option<(Range<usize>, usize)> {
    let (before, behind) = (text.get(..span.start)?, text.get(span.end..)?);
    let mut ends = before.rmatch_indices('\n').map(|(at, _)| at + 1);
    let start = ends.by_ref().nth(1).unwrap_or(0);
    let end = behind.match_indices('\n').nth(1);
    let end = end.map_or(text.len(), |(at, _)| span.end + at);
    Some((start..end, 1 + text[..start].matches('\n').count()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistake_is_shown_with_its_neighbours() {
        let text = "one\ntwo\nthree\nfour\nfive\n";
        let lines = |word: &str| {
            let at = text.find(word).unwrap_or(0);
            let (lines, first) = around(text, &(at..at + word.len())).unwrap_or_default();
            (&text[lines], first)
        };
        assert_eq!(lines("one"), ("one\ntwo", 1));
        assert_eq!(lines("three"), ("two\nthree\nfour", 2));
        assert_eq!(lines("five"), ("four\nfive\n", 4));
        assert!(around(text, &(30..31)).is_none());
    }
}
