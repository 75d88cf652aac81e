//! `loopsight inspect`.

use std::io::{BufRead as _, IsTerminal as _};

use crate::cli::arguments::InspectArguments;
use crate::cli::{files, output};
use crate::error::{Error, Result};
use crate::inspect::questions;
use crate::words::report::inventory::facts;
use crate::{FitOptions, InspectOptions, Log, Model, Session, inspect, inspect_file};

pub(crate) fn run(arguments: &InspectArguments) -> Result<()> {
    files::check(
        arguments.output.iter().chain(&arguments.html),
        &[std::slice::from_ref(&arguments.log)],
    )?;
    let mut options = InspectOptions::default();
    options.plant.clone_from(&arguments.plant);
    options.inputs.clone_from(&arguments.inputs);
    options.measured.clone_from(&arguments.measured);
    options.period_s = arguments.period;
    options.units.clone_from(&arguments.units);
    // A model file is fitted to the log, which is kept for that.
    let (found, log) = match &arguments.output {
        Some(_) => {
            let log = Log::read(&arguments.log)?;
            let options = asked(&log, &options, arguments)?;
            (inspect(&log, &options)?, Some(log))
        }
        None => (inspect_file(&arguments.log, &options)?, None),
    };
    let mut lines = vec![format!("{}: {}", found.file, found.summary)];
    lines.extend(found.notes.iter().map(|note| format!("  {note}")));
    lines.push(String::new());
    lines.extend((found.inventory.channels.iter()).map(|c| format!("  {}: {}", c.path, facts(c))));
    for plant in &found.plants {
        lines.push(String::new());
        lines.push(format!("{}:", plant.plant));
        let pairs = plant.inputs.iter().map(|m| ("input", m));
        for (role, m) in pairs.chain(plant.measured.iter().map(|m| ("measured", m))) {
            lines.push(format!("  {role} {} = {}", m.id, m.channel));
        }
    }
    match (arguments.output.as_ref().zip(log), &found.model_toml) {
        (Some((out, log)), Some(text)) => {
            // With the values of a fit it runs at once; without them it is what a fit begins with.
            let name = out.display().to_string();
            let fitted = Model::from_toml(&name, text)
                .and_then(|model| Session::new(model, log))
                .and_then(|session| session.fit(&FitOptions::default()));
            let text = fitted
                .as_ref()
                .map_or(text.as_str(), |f| f.model().to_toml());
            files::save(out, text)?;
            if let Err(error) = &fitted {
                lines.push(String::new());
                lines.push(format!("The file has no values yet: {}", error.message()));
            }
            let (out, log) = (out.display(), arguments.log.display());
            lines.push(String::new());
            lines.push(format!(
                "{out} is a model file; next: loopsight improve {out} {log}"
            ));
        }
        (Some(_), None) => {
            return Err(Error::request(format!(
                "{}: no plant fits its channels by their names; say it with --plant, --input ID=CHANNEL \
                 and --measure ID=CHANNEL (`loopsight list plants` shows them)",
                found.file
            )));
        }
        (None, Some(_)) => {
            lines.push(String::new());
            lines.push("-o model.toml writes a model file for the first of them.".to_owned());
        }
        (None, None) => {}
    }
    output::answer(&found, &lines.join("\n"), arguments.json)?;
    files::page(arguments.html.as_ref(), |foot| found.page(foot))
}

/// The options, with the answers of the person at the terminal, where there are both.
fn asked(
    log: &Log,
    options: &InspectOptions,
    arguments: &InspectArguments,
) -> Result<InspectOptions> {
    let person = std::io::stdin().is_terminal() && std::io::stdout().is_terminal();
    if !person || arguments.json {
        return Ok(options.clone());
    }
    output::note("What the log does not say is asked; Enter takes what stands in brackets.");
    questions::answered(log, options, &mut |question| {
        if !question.wrong.is_empty() {
            output::note(&question.wrong);
        }
        output::note(&format!("{} [{}]", question.text, question.proposed));
        let mut line = String::new();
        let read = std::io::stdin().lock().read_line(&mut line);
        read.is_ok_and(|bytes| bytes > 0).then_some(line)
    })
}
