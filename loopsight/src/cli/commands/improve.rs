//! `loopsight improve`.

use crate::ImproveOptions;
use crate::answers::ImproveAnswer;
use crate::cli::arguments::ImproveArguments;
use crate::cli::progress::Bar;
use crate::cli::{files, output};
use crate::error::Result;
use crate::words::percent;

pub(crate) fn run(arguments: &ImproveArguments) -> Result<()> {
    for path in arguments.output.iter().chain(&arguments.html) {
        files::writable(path)?;
    }
    let session = files::session(&arguments.files, &arguments.also, arguments.test.as_deref())?;
    let bar = Bar::new();
    let options = ImproveOptions::default()
        .series(arguments.series)
        .watch(bar.watch());
    let answer = session.improve(&options);
    drop(bar);
    let answer = answer?;
    output::answer(&answer, &text(&answer), arguments.json)?;
    if let (Some(path), Some(model)) = (&arguments.output, answer.model()) {
        files::save(path, model.to_toml())?;
    }
    if let Some(path) = &arguments.html {
        files::save(path, &answer.page(&output::command_line()))?;
    }
    Ok(())
}

fn text(answer: &ImproveAnswer) -> String {
    let rows: Vec<Vec<String>> = answer
        .steps
        .iter()
        .map(|step| {
            vec![
                step.added.as_ref().map_or_else(
                    || "the model as it is".to_owned(),
                    |place| format!("+ {place}"),
                ),
                percent(step.nrmse_fit),
                percent(step.nrmse_test),
            ]
        })
        .collect();
    let mut text = String::new();
    if !rows.is_empty() {
        text.push_str(&output::table(
            &["step", "error, fitted", "error, unseen"],
            &rows,
        ));
        text.push('\n');
    }
    for step in &answer.steps {
        let others = &step.indistinguishable_from;
        let others: Vec<String> = others.iter().map(ToString::to_string).collect();
        if let (Some(added), [_, ..]) = (&step.added, &others[..]) {
            text.push_str(&format!(
                "not told from {added} when it was added: {}\n",
                others.join(", ")
            ));
        }
    }
    text.push_str(&answer.summary);
    if answer.observer.is_some() {
        text.push('\n');
        text.push_str(output::correction(answer.observer.as_ref()).trim_end());
    }
    if let Some(force) = &answer.residual_force {
        text.push_str(&output::residual_force(force));
    }
    if let Some(fitted) = answer.fitted() {
        text.push_str("\n\n");
        text.push_str(&output::parameters(
            &answer.parameters,
            &answer.flat,
            &answer.derived,
        ));
        text.push_str(&format!("\n\n{fitted}"));
    }
    text
}
