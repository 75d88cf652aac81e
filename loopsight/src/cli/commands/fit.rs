//! `loopsight fit`.

use crate::cli::arguments::{FitArguments, MethodName, SchemeName};
use crate::cli::progress::Bar;
use crate::cli::{files, output};
use crate::error::Result;
use crate::words::report;
use crate::{FitOptions, Method, Scheme};

pub(crate) fn run(arguments: &FitArguments) -> Result<()> {
    let outputs = arguments.output.iter().chain(&arguments.html);
    let session = files::session(
        outputs,
        &arguments.files,
        &arguments.also,
        &arguments.without,
        arguments.test.as_ref(),
    )?;
    let bar = Bar::new();
    let options = FitOptions::default()
        .method(match arguments.method {
            MethodName::Rls => Method::Rls,
            MethodName::OutputError => Method::OutputError,
        })
        .regression(match arguments.regression {
            SchemeName::Euler => Scheme::Euler,
            SchemeName::Integrated => Scheme::Integrated,
        })
        .series(arguments.series)
        .watch(bar.watch());
    let answer = session.fit(&options);
    drop(bar);
    if let (Some(path), Err(_)) = (&arguments.output, &answer) {
        files::save_described(path, &session)?;
    }
    let answer = answer?;
    let test = arguments
        .test
        .as_ref()
        .map(|path| path.display().to_string());
    let text = report::fit::text(&answer.engine, test.as_deref());
    output::answer(&answer, &text, arguments.json)?;
    if let Some(path) = &arguments.output {
        files::save(path, answer.model().to_toml())?;
    }
    files::page(arguments.html.as_ref(), |foot| answer.page(foot))?;
    answer.arrived()
}
