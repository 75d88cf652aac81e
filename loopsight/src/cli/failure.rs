//! What goes wrong, shown to a person once.

use miette::{GraphicalReportHandler, GraphicalTheme, LabeledSpan, MietteDiagnostic, NamedSource};

use crate::error::Error;

/// Shows an error on standard error: in its text with a caret, where there is one.
pub(crate) fn print(error: &Error) {
    let text = placed(error).unwrap_or_else(|| {
        let help = error.help();
        let help = help.map_or_else(String::new, |help| match help.contains('\n') {
            // What can be pasted stands on lines of its own.
            true => format!("\n{help}"),
            false => format!(" ({help})"),
        });
        format!("error: {}{help}", error.message())
    });
    eprintln!("{}", text.trim_end());
}

/// The text with the place of the mistake.
fn placed(error: &Error) -> Option<String> {
    let (file, (text, span)) = (error.file()?, error.excerpt()?);
    let label = LabeledSpan::new_with_span(None, span);
    let mut diagnostic = MietteDiagnostic::new(error.message().to_owned()).with_label(label);
    if let Some(help) = error.help() {
        diagnostic = diagnostic.with_help(help);
    }
    let report =
        miette::Report::new(diagnostic).with_source_code(NamedSource::new(file, text.to_owned()));
    let colours = std::io::IsTerminal::is_terminal(&std::io::stderr())
        && std::env::var_os("NO_COLOR").is_none();
    let theme = if colours {
        GraphicalTheme::unicode()
    } else {
        GraphicalTheme::unicode_nocolor()
    };
    let mut shown = String::new();
    let handler = GraphicalReportHandler::new_themed(theme).with_context_lines(1);
    match handler.render_report(&mut shown, report.as_ref()) {
        Ok(()) => Some(shown),
        Err(_) => Some(format!("{file}: {}", error.message())),
    }
}
