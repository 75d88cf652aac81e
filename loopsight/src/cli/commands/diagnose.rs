//! `loopsight diagnose`.

use crate::DiagnoseOptions;
use crate::cli::arguments::DiagnoseArguments;
use crate::cli::progress::Bar;
use crate::cli::{files, output};
use crate::error::Result;
use crate::words::report;

pub(crate) fn run(arguments: &DiagnoseArguments) -> Result<()> {
    let session = files::session(
        &arguments.html,
        &arguments.files,
        &arguments.also,
        &arguments.without,
        arguments.test.as_ref(),
    )?;
    let bar = Bar::new();
    let options = DiagnoseOptions::default()
        .series(arguments.series)
        .watch(bar.watch());
    let answer = session.diagnose(&options);
    drop(bar);
    let answer = answer?;
    output::answer(
        &answer,
        &report::diagnosis::text(&answer.engine),
        arguments.json,
    )?;
    files::page(arguments.html.as_ref(), |foot| answer.page(foot))
}
