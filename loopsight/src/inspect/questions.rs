//! What a log does not say, asked of a person.

use loopsight_core::unit::{conversion, parse};
use loopsight_core::{PlantMeta, Signal};
use loopsight_model::config::nearest;
use loopsight_model::registry;
use loopsight_recordings::Inventory;

use super::toml::GUESSED_PERIOD;
use super::{InspectOptions, doubted, inspect, likely};
use crate::answers::FittingPlant;
use crate::error::Result;
use crate::log::Log;

/// Channels that are named in a question.
const SHOWN: usize = 12;
/// The answer that a signal was not measured.
const NONE: &str = "none";

/// A question: what may be answered, and what an empty answer stands for.
pub(crate) struct Question<'q> {
    pub(crate) text: String,
    pub(crate) proposed: &'q str,
    /// Why the last answer will not do; empty at first.
    pub(crate) wrong: String,
}

/// Whoever answers; none: nobody is there any more.
pub(crate) type Ask<'a> = dyn FnMut(&Question<'_>) -> Option<String> + 'a;

/// The options, with the answers to what the log leaves open: which plant of several, which channel where its
/// name and unit do not say so, units, the period. Whoever leaves gets what was proposed.
///
/// # Errors
///
/// As [`inspect`].
pub(crate) fn answered(
    log: &Log,
    options: &InspectOptions,
    ask: &mut Ask<'_>,
) -> Result<InspectOptions> {
    let mut options = options.clone();
    if log.source.model_toml().is_some() {
        return Ok(options);
    }
    let inventory = log.source.inventory();
    let plants = registry::plants();
    if options.plant.is_none() {
        let found = inspect(log, &options)?.plants;
        let ids: Vec<&str> = match found.is_empty() {
            true => plants.iter().map(|meta| meta.id).collect(),
            false => found.iter().map(|plant| plant.plant.as_str()).collect(),
        };
        let proposed = ids.first().copied().unwrap_or_default();
        let chosen = match ids.len() {
            1 => proposed.to_owned(),
            _ => {
                let known: Vec<&str> = plants.iter().map(|meta| meta.id).collect();
                let text = format!("Which plant is it: {}?", ids.join(", "));
                choice(ask, text, proposed, &known)
            }
        };
        options.plant = Some(chosen);
    }
    let Some(meta) = plants
        .into_iter()
        .find(|meta| options.plant.as_deref() == Some(meta.id))
    else {
        return Ok(options);
    };
    // A plant that does not fit by names has no channels yet.
    let guessed = inspect(log, &options).ok();
    let guessed = guessed.and_then(|answer| answer.plants.into_iter().next());
    let chosen = channels(meta, &inventory, guessed.as_ref(), &mut options, ask);
    units(&inventory, &chosen, &mut options, ask);
    time(log, &inventory, &mut options, ask);
    Ok(options)
}

/// The channels of inputs and measured signals.
fn channels(
    meta: &'static PlantMeta,
    inventory: &Inventory,
    guessed: Option<&FittingPlant>,
    options: &mut InspectOptions,
    ask: &mut Ask<'_>,
) -> Vec<(&'static Signal, String)> {
    let mut chosen: Vec<(&Signal, String)> = Vec::new();
    let guess = |id: &str, input: bool| {
        let found = match input {
            true => &guessed?.inputs,
            false => &guessed?.measured,
        };
        found.iter().find(|m| m.id == id).map(|m| m.channel.clone())
    };
    if options.inputs.is_empty() {
        for signal in meta.inputs.iter().filter(|s| !s.optional) {
            let found = guess(signal.id, true);
            if let Some(channel) = channel(signal, true, inventory, found, &chosen, ask) {
                options.inputs.push(format!("{}={channel}", signal.id));
                chosen.push((signal, channel));
            }
        }
    }
    if options.measured.is_empty() {
        let signals = || meta.states.iter().chain(meta.outputs);
        let any = signals().any(|s| guess(s.id, false).is_some());
        // Without any guess the first state is what is asked for.
        let wanted = signals().enumerate().filter(|(at, s)| match any {
            true => guess(s.id, false).is_some(),
            false => *at == 0,
        });
        for (_, signal) in wanted {
            let found = guess(signal.id, false);
            if let Some(channel) = channel(signal, false, inventory, found, &chosen, ask) {
                options.measured.push(format!("{}={channel}", signal.id));
                chosen.push((signal, channel));
            }
        }
    }
    chosen
}

/// The channel of a signal: asked for where several would do.
fn channel(
    signal: &Signal,
    input: bool,
    inventory: &Inventory,
    guessed: Option<String>,
    chosen: &[(&Signal, String)],
    ask: &mut Ask<'_>,
) -> Option<String> {
    let taken: Vec<&str> = chosen.iter().map(|(_, channel)| channel.as_str()).collect();
    let others = likely::others(signal, input, inventory, &taken);
    let proposed = guessed.or_else(|| Some(others.first()?.path.clone()))?;
    if others.len() < 2 || likely::sure(signal, input, inventory, &taken) {
        return Some(proposed);
    }
    let mut known: Vec<&str> = others.iter().map(|c| c.path.as_str()).collect();
    let shown: Vec<&str> = known.iter().copied().take(SHOWN).collect();
    let more = if known.len() > SHOWN { ", …" } else { "" };
    let (role, or) = match input {
        true => ("the input", ""),
        false => ("the measured signal", ", or none"),
    };
    if !input {
        known.push(NONE);
    }
    let text = format!(
        "Which channel is {role} `{}` ({}): {}{more}{or}?",
        signal.id,
        signal.unit,
        shown.join(", ")
    );
    Some(choice(ask, text, &proposed, &known)).filter(|answer| input || answer != NONE)
}

/// Units that the log does not say.
fn units(
    inventory: &Inventory,
    chosen: &[(&'static Signal, String)],
    options: &mut InspectOptions,
    ask: &mut Ask<'_>,
) {
    for (signal, path) in chosen {
        let channel = inventory.channels.iter().find(|c| c.path == *path);
        let said = channel.is_some_and(|c| c.unit.as_ref().is_some_and(|u| parse(&u.unit).is_ok()));
        let prefix = format!("{path}=");
        if said || options.units.iter().any(|u| u.starts_with(&prefix)) {
            continue;
        }
        let fits = |text: &str| match (parse(text), parse(signal.unit)) {
            (Ok(unit), Ok(expected)) if conversion(&unit, &expected).is_some() => Ok(()),
            (Ok(_), _) => Err(format!("`{text}` is no unit for {}", signal.unit)),
            (Err(error), _) => Err(format!("`{text}`: {error}")),
        };
        let text = format!("In which unit is `{path}`, the {}?", signal.id);
        let unit = asked(ask, &text, signal.unit, &fits);
        options.units.push(format!("{path}={unit}"));
    }
}

/// What stamps the rows.
fn time(log: &Log, inventory: &Inventory, options: &mut InspectOptions, ask: &mut Ask<'_>) {
    let column = inventory.channels.iter().find(|c| c.is_time);
    let clocks = inventory.channels.iter().any(|c| c.clock.is_some());
    if options.period_s.is_some() || (clocks && column.is_none()) {
        return;
    }
    let Some(column) = column else {
        let fits = |text: &str| match text.parse::<f64>() {
            Ok(period) if period.is_finite() && period > 0.0 => Ok(()),
            _ => Err(format!("`{text}`: expected a number of seconds above 0")),
        };
        let text = "The log has no time stamps. How many seconds from one row to the next?";
        let proposed = GUESSED_PERIOD.to_string();
        options.period_s = asked(ask, text, &proposed, &fits).parse().ok();
        return;
    };
    let prefix = format!("{}=", column.path);
    if options.units.iter().any(|u| u.starts_with(&prefix)) {
        return;
    }
    let first = inspect(log, options).ok();
    let noted = first.as_ref().and_then(|answer| {
        let toml = answer.model_toml.as_deref()?;
        doubted(log, toml)
    });
    let (proposed, reason) = match (&noted, &column.unit) {
        (Some(doubt), _) => (doubt.unit, format!(" Taken as s, {}.", doubt.reason())),
        (None, Some(_)) => return,
        (None, None) => ("s", String::new()),
    };
    let second = parse("s").ok();
    let fits = |text: &str| match (parse(text), &second) {
        (Ok(unit), Some(second)) if conversion(&unit, second).is_some() => Ok(()),
        _ => Err(format!(
            "`{text}` is no unit of time: expected s, ms, us, ns or min"
        )),
    };
    let text = format!(
        "In which unit are the time stamps in `{}`?{reason}",
        column.path
    );
    let unit = asked(ask, &text, proposed, &fits);
    options.units.push(format!("{}={unit}", column.path));
}

/// One of some words.
fn choice(ask: &mut Ask<'_>, text: String, proposed: &str, known: &[&str]) -> String {
    let fits = |answer: &str| {
        if known.contains(&answer) {
            return Ok(());
        }
        let near = nearest(answer, known.iter().copied());
        let near = near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
        Err(format!("there is no `{answer}`{near}"))
    };
    asked(ask, &text, proposed, &fits)
}

/// The answer, once it fits.
fn asked(
    ask: &mut Ask<'_>,
    text: &str,
    proposed: &str,
    fits: &dyn Fn(&str) -> std::result::Result<(), String>,
) -> String {
    let mut question = Question {
        text: text.to_owned(),
        proposed,
        wrong: String::new(),
    };
    while let Some(answer) = ask(&question) {
        let answer = match answer.trim() {
            "" => proposed,
            answer => answer,
        };
        match fits(answer) {
            Ok(()) => return answer.to_owned(),
            Err(wrong) => question.wrong = wrong,
        }
    }
    proposed.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(header: &str) -> Log {
        let row = |k: u32| {
            let t = f64::from(k);
            format!(
                "{},{},{},{}\n",
                0.01 * t,
                k / 20 % 5,
                (t / 40.0).sin(),
                k % 3
            )
        };
        let rows: String = (0..400).map(row).collect();
        Log::from_bytes("log.csv", format!("{header}\n{rows}").as_bytes()).unwrap()
    }

    /// The questions, and what they come to, for these answers; the rest is Enter.
    fn said(log: &Log, answers: &[&str]) -> (Vec<String>, InspectOptions) {
        let mut questions = Vec::new();
        let mut answers = answers.iter();
        let options = answered(log, &InspectOptions::default(), &mut |q| {
            questions.push(format!("{} {} [{}]", q.wrong, q.text, q.proposed));
            Some((*answers.next().unwrap_or(&"")).to_owned())
        });
        (questions, options.unwrap())
    }

    #[test]
    fn what_names_and_units_say_is_not_asked() {
        let (questions, options) = said(&log("t_s,voltage_V,speed_rpm,note"), &[]);
        assert_eq!(questions.len(), 1, "{questions:?}");
        assert!(
            questions[0].contains("Which plant is it: dc_axis, "),
            "{questions:?}"
        );
        assert_eq!(options.inputs, ["voltage=voltage_V"]);
        assert_eq!(options.measured, ["speed=speed_rpm"]);
    }

    #[test]
    fn what_is_open_is_asked_and_wrong_answers_again() {
        let (questions, options) = said(
            &log("t,a,b,c"),
            &["dc_axes", "dc_axis", "a", "B", "b", "m", "V", "rpm", ""],
        );
        let all = questions.join("\n");
        for part in [
            "there is no `dc_axes`; did you mean `dc_axis`?",
            "Which channel is the input `voltage` (V): ",
            "there is no `B`; did you mean `b`?",
            "`m` is no unit for V",
            "In which unit is `b`",
            "In which unit are the time stamps in `t`? [s]",
        ] {
            assert!(all.contains(part), "{part} is not in\n{all}");
        }
        assert_eq!(options.plant.as_deref(), Some("dc_axis"));
        assert_eq!(options.inputs, ["voltage=a"]);
        assert_eq!(options.units, ["a=V", "b=rpm", "t=s"]);
        let found = inspect(&log("t,a,b,c"), &options).unwrap();
        let toml = found.model_toml.unwrap();
        assert!(
            toml.contains("unit = \"rpm\"") && toml.contains("unit = \"s\""),
            "{toml}"
        );
    }

    /// Somebody who leaves gets what was proposed.
    #[test]
    fn nobody_there_is_enter_for_the_rest() {
        let log = log("x,u,y,i");
        let options = answered(&log, &InspectOptions::default(), &mut |_| None).unwrap();
        assert_eq!(options.inputs, ["voltage=u"]);
        assert_eq!(options.period_s, Some(GUESSED_PERIOD));
    }
}
