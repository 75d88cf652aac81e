//! A model file for a log.

use loopsight_core::unit::parse;
use loopsight_model::registry;
use loopsight_recordings::Inventory;

use crate::answers::{FittingPlant, MappedChannel};

/// Period that stands in a file where nobody knows it, s.
pub(super) const GUESSED_PERIOD: f64 = 0.01;

/// What stamps the rows.
#[derive(Clone, Copy)]
pub(super) enum Period {
    /// The log itself.
    Log,
    /// The caller, s.
    Given(f64),
    /// Nothing: a guess.
    Guessed,
}

impl Period {
    pub(super) fn new(stamps: bool, given: Option<f64>) -> Self {
        match given {
            Some(period) => Period::Given(period),
            None if stamps => Period::Log,
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
    period: Period,
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
        Period::Log => {
            let time = inventory.channels.iter().find(|c| c.is_time);
            if let Some(time) = time {
                lines.push(format!("time = {}", column(&time.path, time.unit.as_ref().map_or(Some("s"), |_| None))));
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
        lines.push(format!("{} = {}", input.id, column(&input.channel, unit)));
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
        lines.push(format!("column = {}", quoted(&signal.channel)));
        match unit(signal) {
            Some(unit) => lines.push(format!("unit = {}", quoted(unit))),
            None => lines.push("# The log does not say its unit; taken as SI.".to_owned()),
        }
    }
    lines.push(String::new());
    lines.join("\n")
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
