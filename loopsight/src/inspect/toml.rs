//! A model file for a log.

use loopsight_core::unit::parse;
use loopsight_model::registry;
use loopsight_recordings::Inventory;

use super::likely;
use crate::answers::{FittingPlant, MappedChannel};

/// Channels that are named beside a guess.
pub(super) const OTHERS: usize = 6;
/// Period that stands in a file where nobody knows it, s.
pub(super) const GUESSED_PERIOD: f64 = 0.01;

/// What stamps the rows.
#[derive(Clone, Copy)]
pub(super) enum Period<'t> {
    /// The log itself; its unit, where somebody said it or it is a guess with a reason.
    Log(Option<(&'t str, &'t str)>),
    /// The caller, s.
    Given(f64),
    /// Nothing: a guess.
    Guessed,
}

impl<'t> Period<'t> {
    pub(super) fn new(stamps: bool, given: Option<f64>, unit: Option<(&'t str, &'t str)>) -> Self {
        match given {
            Some(period) => Period::Given(period),
            None if stamps => Period::Log(unit),
            None => Period::Guessed,
        }
    }
}

/// The model file: a plant, and which channels are its signals; `named`: the caller said which.
pub(super) fn model(
    log: &str,
    plant: &FittingPlant,
    inventory: &Inventory,
    state: Option<&str>,
    period: Period<'_>,
    named: bool,
) -> String {
    // A comment must stay on its line, whatever the file is called.
    let log: String = log.chars().filter(|c| !c.is_control()).collect();
    let mut lines = vec![
        format!("# Made from {log} ({}).", inventory.format),
        "# Which channel is what was guessed from names and units: look at [log].".to_owned(),
        "# Parameters that are not given here are what a fit finds.".to_owned(),
        String::new(),
        format!("[plant.{}]", plant.plant),
        String::new(),
        "[log]".to_owned(),
    ];
    match period {
        Period::Log(said) => {
            if let Some(time) = inventory.channels.iter().find(|c| c.is_time) {
                let (unit, why) = match (said, &time.unit) {
                    (Some((unit, why)), _) => (Some(unit), why),
                    (None, Some(_)) => (None, ""),
                    (None, None) => (Some("s"), ""),
                };
                let reason = if why.is_empty() { String::new() } else { format!(" # {why}") };
                lines.push(format!("time = {}{reason}", column(&time.path, unit)));
            }
        }
        Period::Given(period) => lines.push(format!("period_s = {period:?}")),
        Period::Guessed => lines.push(format!(
            "period_s = {GUESSED_PERIOD:?} # a guess: the log has no time stamps; say it with --period"
        )),
    }
    if let Some(state) = state {
        lines.push(format!("run = {}", quoted(state)));
    }
    lines.push(String::new());
    lines.push("[log.inputs]".to_owned());
    for input in &plant.inputs {
        let unit = unit(input);
        let doubt =
            doubt(plant, input, true, inventory).map_or_else(String::new, |d| format!(" # {d}"));
        lines.push(format!(
            "{} = {}{doubt}",
            input.id,
            column(&input.channel, unit)
        ));
    }
    for signal in &plant.measured {
        // What is the integral of another signal that was measured says nothing new, and disagrees
        // where the two were scaled differently.
        if let Some(rate) = rate_of(plant, &signal.id).filter(|_| !named) {
            lines.push(String::new());
            let (id, channel) = (&signal.id, quoted(&signal.channel));
            lines.push(format!(
                "# {channel} seems to be `{id}`, the integral of `{rate}`."
            ));
            continue;
        }
        lines.push(String::new());
        lines.push(format!("[log.measured.{}]", signal.id));
        let doubt = doubt(plant, signal, false, inventory).filter(|_| !named);
        // On the line itself: what is appended to the file later comes before what stands behind it.
        let assumed = unit(signal).is_none();
        let assumed = assumed.then(|| "the log does not say its unit; taken as SI".to_owned());
        let remarks: Vec<String> = doubt.into_iter().chain(assumed).collect();
        let remarks = match remarks.is_empty() {
            true => String::new(),
            false => format!(" # {}", remarks.join("; ")),
        };
        lines.push(format!("column = {}{remarks}", quoted(&signal.channel)));
        lines.extend(unit(signal).map(|unit| format!("unit = {}", quoted(unit))));
    }
    lines.push(String::new());
    lines.join("\n")
}

/// That a channel is a guess, and what else it could be; none where name and unit leave no doubt.
fn doubt(
    plant: &FittingPlant,
    mapped: &MappedChannel,
    input: bool,
    inventory: &Inventory,
) -> Option<String> {
    let meta = registry::plants()
        .into_iter()
        .find(|meta| meta.id == plant.plant)?;
    let mut signals = meta.inputs.iter().chain(meta.states).chain(meta.outputs);
    let signal = signals.find(|s| s.id == mapped.id)?;
    let all = plant.inputs.iter().chain(&plant.measured);
    let taken: Vec<&str> = all
        .map(|m| m.channel.as_str())
        .filter(|c| *c != mapped.channel)
        .collect();
    if likely::sure(signal, input, inventory, &taken) {
        return None;
    }
    let others = likely::others(signal, input, inventory, &taken);
    let others = others.iter().filter(|c| c.path != mapped.channel);
    let shown: Vec<String> = others.take(OTHERS).map(|c| quoted(&c.path)).collect();
    (!shown.is_empty()).then(|| format!("a guess; it could be {}", shown.join(", ")))
}

/// The measured signal whose integral a signal is.
fn rate_of(plant: &FittingPlant, id: &str) -> Option<&'static str> {
    let integrals = registry::plants()
        .into_iter()
        .find(|meta| meta.id == plant.plant)?
        .integrals;
    let (rate, _) = integrals.iter().find(|(_, integral)| *integral == id)?;
    let measured = plant.measured.iter().any(|m| m.id == *rate);
    measured.then_some(*rate)
}

/// The unit, where it is one.
fn unit(channel: &MappedChannel) -> Option<&str> {
    channel.unit.as_deref().filter(|unit| parse(unit).is_ok())
}

fn column(path: &str, unit: Option<&str>) -> String {
    match unit {
        Some(unit) => format!("{{ column = {}, unit = {} }}", quoted(path), quoted(unit)),
        None => quoted(path),
    }
}

/// A string of TOML.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => out.push_str(&format!("\\u{:04X}", u32::from(c))),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}
