//! `loopsight improve`.

use crate::ImproveOptions;
use crate::cli::arguments::ImproveArguments;
use crate::cli::progress::Bar;
use crate::cli::{files, output};
use crate::error::Result;
use crate::words::report;

pub(crate) fn run(arguments: &ImproveArguments) -> Result<()> {
    let outputs = arguments.output.iter().chain(&arguments.html);
    let session = files::session(
        outputs,
        &arguments.files,
        &arguments.also,
        &arguments.without,
        arguments.test.as_ref(),
    )?;
    let bar = Bar::new();
    let options = ImproveOptions::default()
        .discover(arguments.discover)
        .series(arguments.series)
        .watch(bar.watch());
    let answer = session.improve(&options);
    drop(bar);
    let answer = answer?;
    let mut text = report::improvement::text(&answer.engine);
    if let Some(feedforward) = &answer.feedforward {
        let text_so_far = text.trim_end().len();
        text.truncate(text_so_far);
        text.push_str(&format!("\n\n{}", feedforward.sentences().join("\n")));
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
