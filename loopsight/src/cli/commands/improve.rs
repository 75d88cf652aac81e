//! `loopsight improve`.

use crate::answers::{Feedforward, Reported};
use crate::cli::arguments::ImproveArguments;
use crate::cli::progress::Bar;
use crate::cli::{files, output};
use crate::error::Result;
use crate::words::report;
use crate::{ImproveOptions, Log};

pub(crate) fn run(arguments: &ImproveArguments) -> Result<()> {
    let outputs = arguments.output.iter().chain(&arguments.html);
    let mut session = files::session(
        outputs.clone(),
        &arguments.files,
        &arguments.also,
        &arguments.without,
        arguments.test.as_ref(),
    )?;
    if let Some(log) = &arguments.report {
        for output in outputs {
            files::apart(output, &[std::slice::from_ref(log)])?;
        }
        session = session.report(Log::read(log)?)?;
    }
    let bar = Bar::new();
    let options = ImproveOptions::default()
        .discover(arguments.discover)
        .series(arguments.series)
        .watch(bar.watch());
    let answer = session.improve(&options);
    drop(bar);
    let answer = answer?;
    let mut text = report::improvement::text(&answer.engine);
    let reported = answer.reported.iter().map(Reported::sentence);
    let feedforward = answer.feedforward.iter().flat_map(Feedforward::sentences);
    for sentences in [reported.collect::<Vec<_>>(), feedforward.collect()] {
        if !sentences.is_empty() {
            text = format!("{}\n\n{}", text.trim_end(), sentences.join("\n"));
        }
    }
    output::answer(&answer, &text, arguments.json)?;
    if let Some(path) = &arguments.output {
        match answer.model() {
            Some(model) => files::save(path, model.to_toml())?,
            None => files::save_described(path, &session)?,
        }
    }
    files::page(arguments.html.as_ref(), |foot| answer.page(foot))
}
