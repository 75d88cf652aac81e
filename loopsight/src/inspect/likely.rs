//! Which channels are likely to be the inputs and signals of a plant.

use loopsight_core::unit::{conversion, parse};
use loopsight_core::{PlantMeta, Signal};
use loopsight_recordings::{ChannelFacts, Inventory, Kind};

use super::Known;
use crate::answers::{FittingPlant, MappedChannel};
use crate::error::{Error, Result};

/// Values that a channel must have to be fitted to.
const LEAST: usize = 20;
/// Score below which a channel is not the signal.
const ENOUGH: f64 = 2.0;

/// Words of signals, and those that logs use for them.
const SYNONYMS: [(&str, &[&str]); 10] = [
    ("voltage", &["voltage", "volt", "volts", "u", "v"]),
    ("speed", &["speed", "velocity", "vel", "rpm", "omega", "w"]),
    ("velocity", &["velocity", "vel", "speed", "v"]),
    (
        "angle",
        &[
            "angle",
            "position",
            "pos",
            "phi",
            "theta",
            "rotations",
            "yrad",
        ],
    ),
    ("position", &["position", "pos", "x", "q", "travel"]),
    ("force", &["force", "f", "thrust"]),
    ("right", &["right", "r"]),
    ("left", &["left", "l"]),
    ("heading", &["heading", "yaw", "theta"]),
    ("travel", &["travel", "distance", "s"]),
];
/// What is wished for, not measured.
const WISHES: [&str; 6] = [
    "setpoint",
    "target",
    "reference",
    "desired",
    "ref",
    "request",
];
/// What supplies a motor, and does not drive it.
const SUPPLIES: [&str; 4] = ["bus", "battery", "supply", "input"];
/// What reached the motor.
const APPLIED: [&str; 3] = ["applied", "output", "motor"];
/// What flows, where a log calls it so.
const CURRENTS: [&str; 4] = ["i", "current", "amps", "amperes"];
const SIDES: [&str; 2] = ["right", "left"];

/// A plant whose inputs are all there and of which something was measured, with a score.
pub(super) fn fitting(
    meta: &'static PlantMeta,
    inventory: &Inventory,
    known: &Known,
) -> Result<Option<(f64, FittingPlant)>> {
    let mut taken: Vec<&str> = Vec::new();
    let (mut inputs, mut measured) = (Vec::new(), Vec::new());
    let mut total = 0.0;
    let needed: Vec<&Signal> = meta.inputs.iter().filter(|s| !s.optional).collect();
    let signals: Vec<&Signal> = meta.states.iter().chain(meta.outputs).collect();
    check(known, meta)?;
    for (at, signal) in needed.iter().enumerate() {
        let named = named(&known.inputs, signal, at == 0, inventory);
        let Some((score, channel)) = named.or_else(|| best(signal, true, inventory, &taken, None))
        else {
            return Ok(None);
        };
        total += score;
        taken.push(&channel.path);
        inputs.push(mapped(signal, channel, known));
    }
    let group = inputs
        .first()
        .map(|input: &MappedChannel| parent(&input.channel).to_owned());
    for (at, signal) in signals.iter().enumerate() {
        let said = named(&known.measured, signal, at == 0, inventory);
        if !known.measured.is_empty() && said.is_none() {
            continue;
        }
        // What is not a state is measured only where its own name stands in the log.
        let own = at < meta.states.len() || said.is_some();
        let found = said.or_else(|| best(signal, false, inventory, &taken, group.as_deref()));
        let Some((score, channel)) = found.filter(|(score, _)| own || *score > 2.0 * ENOUGH) else {
            continue;
        };
        total += score;
        taken.push(&channel.path);
        measured.push(mapped(signal, channel, known));
    }
    if measured.is_empty() {
        return Ok(None);
    }
    let mean = total / (inputs.len() + measured.len()) as f64;
    Ok(Some((
        mean,
        FittingPlant {
            plant: meta.id.to_owned(),
            inputs,
            measured,
        },
    )))
}

/// Names that the caller gave to signals that the plant does not have.
fn check(known: &Known, meta: &PlantMeta) -> Result<()> {
    let inputs = known.inputs.iter().map(|(id, _)| (id, "input"));
    let measured = known.measured.iter().map(|(id, _)| (id, "signal"));
    for (id, what) in inputs.chain(measured) {
        let Some(id) = id else { continue };
        // Of a plant that was not asked for, a foreign name says that it is not meant.
        if !signals(meta).any(|s| s.id == id) {
            if any_plant_has(id) {
                continue;
            }
            let known: Vec<&str> = signals(meta).map(|s| s.id).collect();
            return Err(Error::request(format!(
                "no plant has the {what} `{id}`; `{}` has {}",
                meta.id,
                known.join(", ")
            )));
        }
    }
    Ok(())
}

fn any_plant_has(id: &str) -> bool {
    let plants = loopsight_model::registry::plants();
    plants.iter().any(|meta| signals(meta).any(|s| s.id == id))
}

/// All that a plant has a name for.
fn signals(meta: &PlantMeta) -> impl Iterator<Item = &Signal> {
    meta.inputs.iter().chain(meta.states).chain(meta.outputs)
}

/// The channel that the caller named for a signal.
fn named<'i>(
    known: &[(Option<String>, String)],
    signal: &Signal,
    first: bool,
    inventory: &'i Inventory,
) -> Option<(f64, &'i ChannelFacts)> {
    let fits = |id: &Option<String>| match id {
        Some(id) => id == signal.id,
        None => first,
    };
    let (_, path) = known.iter().find(|(id, _)| fits(id))?;
    let channel = inventory.channels.iter().find(|c| c.path == *path)?;
    Some((10.0, channel))
}

fn mapped(signal: &Signal, channel: &ChannelFacts, known: &Known) -> MappedChannel {
    let said = known.unit(&channel.path).map(str::to_owned);
    MappedChannel {
        id: signal.id.to_owned(),
        channel: channel.path.clone(),
        unit: said.or_else(|| channel.unit.as_ref().map(|u| u.unit.clone())),
    }
}

/// The channel that is most likely a signal, with its score.
pub(super) fn best<'i>(
    signal: &Signal,
    input: bool,
    inventory: &'i Inventory,
    taken: &[&str],
    group: Option<&str>,
) -> Option<(f64, &'i ChannelFacts)> {
    let mut found: Option<(f64, &ChannelFacts)> = None;
    for channel in &inventory.channels {
        if channel.is_time || taken.contains(&channel.path.as_str()) {
            continue;
        }
        let Some(mut score) = score(signal, input, channel) else {
            continue;
        };
        if group.is_some_and(|g| !g.is_empty() && parent(&channel.path) == g) {
            score += 1.5;
        }
        if score >= ENOUGH && found.is_none_or(|(most, _)| score > most) {
            found = Some((score, channel));
        }
    }
    found
}

/// How likely a channel is a signal; none where it cannot be.
fn score(signal: &Signal, input: bool, channel: &ChannelFacts) -> Option<f64> {
    let (low, high) = channel.range?;
    if channel.kind != Kind::Number || channel.values < LEAST || low == high {
        return None;
    }
    let words = words(&channel.path);
    let mut score: f64 = 0.0;
    let expected = parse(signal.unit).ok()?;
    if let Some(unit) = channel.unit.as_ref().and_then(|u| parse(&u.unit).ok()) {
        conversion(&unit, &expected)?;
        score += 2.0;
    }
    let wanted: Vec<&str> = signal.id.split('_').collect();
    let place = |list: &[&str]| list.iter().position(|w| words.iter().any(|x| x == w));
    let hit = |wanted: &str| match SYNONYMS.iter().find(|(word, _)| *word == wanted) {
        Some((_, list)) => place(list),
        None => place(&[wanted]),
    };
    let mut hits = 0;
    for word in &wanted {
        match hit(word) {
            // The word itself counts more than one that may stand for it.
            Some(place) => {
                hits += 1;
                score += if place == 0 { 2.5 } else { 2.0 };
            }
            None if SIDES.contains(word) => return None,
            None => score -= 1.0,
        }
    }
    // A plain `u` is what was put in, a plain `y` what came out: of a rate and its integral, the rate.
    let plain = if input { "u" } else { "y" };
    if hits == 0 && words.first().is_some_and(|w| w == plain) {
        let rate = words.len() == 1 && signal.unit.ends_with("/s");
        score = score.max(0.0) + if rate { 2.5 } else { 1.5 };
        hits = 1;
    }
    // A current jumps with the input, and is none of the signals that a plant has.
    if words.iter().any(|w| CURRENTS.contains(&w.as_str())) && signal.unit != "A" {
        return None;
    }
    if hits == 0 {
        return None;
    }
    let has = |list: &[&str]| words.iter().any(|w| list.contains(&w.as_str()));
    for side in SIDES {
        if !wanted.contains(&side) && has(&[side]) {
            score -= 0.5;
        }
    }
    if has(&WISHES) {
        score -= 2.0;
    }
    if input && has(&SUPPLIES) {
        score -= 3.0;
    }
    if input && has(&APPLIED) {
        score += 1.0;
    }
    Some(score)
}

/// Margin by which the best channel must lead, and the score that a name and a unit have together.
const LEAD: f64 = 1.0;
const SURE: f64 = 4.0;

/// Whether the names and units of a log leave no doubt which channel a signal is.
pub(super) fn sure(signal: &Signal, input: bool, inventory: &Inventory, taken: &[&str]) -> bool {
    let free = |c: &&ChannelFacts| !c.is_time && !taken.contains(&c.path.as_str());
    let scored = inventory.channels.iter().filter(free);
    let mut scores: Vec<f64> = scored.filter_map(|c| score(signal, input, c)).collect();
    scores.sort_by(|a, b| b.total_cmp(a));
    match scores.as_slice() {
        [best, second, ..] => *best >= SURE && best - second >= LEAD,
        [best] => *best >= SURE,
        [] => false,
    }
}

/// Channels that a signal could be as well, the likeliest first: those of its unit or of none. Of what was measured, what
/// is smooth comes before what jumps, as a state does before a current; inputs stand in the order of the file.
pub(super) fn others<'i>(
    signal: &Signal,
    input: bool,
    inventory: &'i Inventory,
    taken: &[&str],
) -> Vec<&'i ChannelFacts> {
    let expected = parse(signal.unit).ok();
    let fits = |c: &&ChannelFacts| {
        let unit = c.unit.as_ref().and_then(|u| parse(&u.unit).ok());
        let same = match (unit, &expected) {
            (Some(unit), Some(expected)) => conversion(&unit, expected).is_some(),
            _ => true,
        };
        let moves = c.range.is_some_and(|(low, high)| low < high);
        c.kind == Kind::Number && !c.is_time && moves && same && !taken.contains(&c.path.as_str())
    };
    let mut found: Vec<&ChannelFacts> = inventory.channels.iter().filter(fits).collect();
    let current = |c: &ChannelFacts| {
        words(&c.path)
            .iter()
            .any(|w| CURRENTS.contains(&w.as_str()))
    };
    let rough = |c: &ChannelFacts| match input {
        true => 0.0,
        false => c.roughness.unwrap_or(f64::INFINITY),
    };
    found.sort_by(|a, b| {
        current(a)
            .cmp(&current(b))
            .then(rough(a).total_cmp(&rough(b)))
    });
    found
}

/// The words of a path: `NT:/URCL/AppliedOutputVoltage` has `nt urcl applied output voltage`.
fn words(path: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut now = String::new();
    let mut lower = false;
    for c in path.chars() {
        if (!c.is_alphabetic() || (c.is_uppercase() && lower)) && !now.is_empty() {
            words.push(std::mem::take(&mut now));
        }
        if c.is_alphabetic() {
            now.extend(c.to_lowercase());
        }
        lower = c.is_lowercase();
    }
    if !now.is_empty() {
        words.push(now);
    }
    words
}

/// What a channel has in common with those beside it.
fn parent(path: &str) -> &str {
    path.rfind(['/', '.']).map_or("", |at| &path[..at])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_a_path() {
        assert_eq!(
            words("NT:/URCL/SparkMax-11/AppliedOutputVoltage"),
            ["nt", "urcl", "spark", "max", "applied", "output", "voltage"]
        );
        assert_eq!(words("MotorVelocityRPM"), ["motor", "velocity", "rpm"]);
        assert_eq!(parent("a/b.c"), "a/b");
    }
}
