//! `loopsight inspect`.

use crate::answers::InspectedChannel;
use crate::cli::arguments::InspectArguments;
use crate::cli::{files, output};
use crate::error::{Error, Result};
use crate::{FitOptions, InspectOptions, Log, Model, Session, inspect, words};

pub(crate) fn run(arguments: &InspectArguments) -> Result<()> {
    let input = std::slice::from_ref(&arguments.log);
    files::check(&arguments.output, &[input])?;
    let log = Log::read(&arguments.log)?;
    let mut options = InspectOptions::default();
    options.plant.clone_from(&arguments.plant);
    options.inputs.clone_from(&arguments.inputs);
    options.measured.clone_from(&arguments.measured);
    options.period_s = arguments.period;
    let found = inspect(&log, &options)?;
    let mut lines = vec![format!("{}: {}", found.file, found.summary)];
    lines.extend(found.notes.iter().map(|note| format!("  {note}")));
    lines.push(String::new());
    lines.extend(found.channels.iter().map(line));
    for plant in &found.plants {
        lines.push(String::new());
        lines.push(format!("{}:", plant.plant));
        let pairs = plant.inputs.iter().map(|m| ("input", m));
        for (role, m) in pairs.chain(plant.measured.iter().map(|m| ("measured", m))) {
            lines.push(format!("  {role} {} = {}", m.id, m.channel));
        }
    }
    match (&arguments.output, &found.model_toml) {
        (Some(out), Some(text)) => {
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
    output::answer(&found, &lines.join("\n"), arguments.json)
}

/// A channel on one line.
fn line(channel: &InspectedChannel) -> String {
    let mut parts = vec![format!("{} {}", channel.values, channel.kind)];
    if let (Some(unit), Some(why)) = (&channel.unit, channel.unit_from) {
        parts.push(match why {
            "the file says so" => unit.clone(),
            _ => format!("{unit} ({why})"),
        });
    }
    if let Some(rate) = channel.rate_hz {
        parts.push(format!("{} Hz", words::number(rate)));
    }
    if let (Some(min), Some(max)) = (channel.min, channel.max) {
        parts.push(format!("{} to {}", words::number(min), words::number(max)));
    }
    if !channel.words.is_empty() {
        parts.push(channel.words.join(" | "));
    }
    if channel.missing > 0.0 {
        parts.push(format!(
            "{} % missing",
            words::number(100.0 * channel.missing)
        ));
    }
    if channel.gaps > 0 {
        let longest = words::number(channel.longest_gap_s);
        parts.push(format!("{} pauses, the longest {longest} s", channel.gaps));
    }
    if channel.backwards > 0 {
        parts.push(format!("time goes back {} times", channel.backwards));
    }
    format!("  {}: {}", channel.path, parts.join(", "))
}
