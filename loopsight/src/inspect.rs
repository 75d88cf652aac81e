//! What is in a log of another program, and a model file for it.

mod likely;
#[cfg(feature = "cli")]
pub(crate) mod questions;
pub(crate) mod suggest;
mod toml;

use std::path::Path;

use loopsight_core::PlantMeta;
use loopsight_core::unit::parse;
use loopsight_model::model::Model as Composed;
use loopsight_model::registry;
use loopsight_recordings::{ChannelFacts, Inventory, Kind, survey};

use crate::answers::{Answer, FittingPlant, InspectAnswer, InspectedChannel};
use crate::error::{Error, Result};
use crate::log::Log;
use crate::model::Model;
use crate::stamps::{self, Doubt};
use crate::words;

/// A larger file is not kept in memory to say what is in it, bytes.
const LARGE: u64 = 64 << 20;

/// What is known of a log beforehand.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct InspectOptions {
    /// The plant; by default the one that fits the channels best.
    pub plant: Option<String>,
    /// Channels of the inputs: `voltage=drive/u`, or the channel of the first input alone.
    pub inputs: Vec<String>,
    /// Channels of the measured signals: `speed=drive/omega`, or the channel of the first state alone.
    pub measured: Vec<String>,
    /// Units of channels that the log does not say, the time's as well: `u=V`, `t=ms`.
    pub units: Vec<String>,
    /// Time from one row to the next, s, of a log without time stamps.
    pub period_s: Option<f64>,
}

impl InspectOptions {
    /// The plant.
    #[must_use]
    pub fn plant(mut self, id: impl Into<String>) -> Self {
        self.plant = Some(id.into());
        self
    }

    /// The channel of an input: `ID=CHANNEL`.
    #[must_use]
    pub fn input(mut self, channel: impl Into<String>) -> Self {
        self.inputs.push(channel.into());
        self
    }

    /// The channel of a measured signal: `ID=CHANNEL`.
    #[must_use]
    pub fn measure(mut self, channel: impl Into<String>) -> Self {
        self.measured.push(channel.into());
        self
    }

    /// The unit of a channel: `CHANNEL=UNIT`.
    #[must_use]
    pub fn unit(mut self, unit: impl Into<String>) -> Self {
        self.units.push(unit.into());
        self
    }

    /// Time from one row to the next, s.
    #[must_use]
    pub fn period_s(mut self, period: f64) -> Self {
        self.period_s = Some(period);
        self
    }
}

/// Says what is in a log: format, channels with unit, rate and range, the plants of the library that fit
/// them, and a model file to begin with.
///
/// ```
/// use loopsight::{InspectOptions, Log, Model, inspect};
///
/// let text: String = (0..50).map(|k| format!("{},{},{}\n", 0.01 * k as f64, k % 7, 3 * k)).collect();
/// let log = loopsight::Log::from_bytes("motor.csv", format!("t,u,omega\n{text}").as_bytes())?;
/// let found = inspect(&log, &InspectOptions::default())?;
/// assert_eq!(found.plants[0].plant, "dc_axis");
/// let model = Model::from_toml("model.toml", found.model_toml.as_deref().unwrap_or_default())?;
/// # Ok::<(), loopsight::Error>(())
/// ```
///
/// # Errors
///
/// A plant, an input or a channel that was named is not there.
pub fn inspect(log: &Log, options: &InspectOptions) -> Result<InspectAnswer> {
    examined(log.name(), &log.source.inventory(), Some(log), options)
}

/// As [`inspect`], of a file. One above 64 MB with channels (MCAP, ULog, HDF5 and the like) is counted on the
/// way and not kept: memory does not grow with its length.
///
/// # Errors
///
/// As [`Log::read`] and [`inspect`].
pub fn inspect_file(path: impl AsRef<Path>, options: &InspectOptions) -> Result<InspectAnswer> {
    let path = path.as_ref();
    let large = std::fs::metadata(path).is_ok_and(|m| m.is_file() && m.len() > LARGE);
    if large {
        let name = path.display().to_string();
        let counted = survey(path).map_err(|error| Error::in_log(&error, &name, None))?;
        if let Some(inventory) = counted {
            return examined(&name, &inventory, None, options);
        }
    }
    inspect(&Log::read(path)?, options)
}

fn examined(
    name: &str,
    inventory: &Inventory,
    log: Option<&Log>,
    options: &InspectOptions,
) -> Result<InspectAnswer> {
    if inventory.channels.is_empty() {
        let notes = inventory.notes.iter().map(|note| format!("; {note}"));
        let (format, notes) = (&inventory.format, notes.collect::<String>());
        return Err(Error::request(format!(
            "{name}: this {format} log has no channels{notes}"
        )));
    }
    let known = Known::new(inventory, options)?;
    let mut plants: Vec<(f64, usize, FittingPlant)> = Vec::new();
    for meta in registry::plants() {
        if options.plant.as_deref().is_some_and(|id| id != meta.id) {
            continue;
        }
        if let Some((score, plant)) = likely::fitting(meta, inventory, &known)? {
            plants.push((score, meta.parameters.len(), plant));
        } else if options.plant.is_some() {
            return Err(unfit(name, meta));
        }
    }
    // Of plants that fit alike, the simplest is tried first.
    plants.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let plants: Vec<FittingPlant> = plants.into_iter().map(|(_, _, plant)| plant).collect();
    let state = state(inventory).map(|c| c.path.clone());
    let mut notes = inventory.notes.clone();
    let described = log.and_then(|log| log.source.model_toml());
    let model_toml = match described {
        Some(text) if options.plant.is_none() => Some(text),
        _ => plants.first().map(|plant| {
            let stamps = |c: &ChannelFacts| c.clock.is_some() || c.is_time;
            let stamped = inventory.channels.iter().any(stamps);
            let text = |unit: Option<(&str, &str)>| {
                let period = toml::Period::new(stamped, options.period_s, unit);
                let (state, named) = (state.as_deref(), !known.measured.is_empty());
                toml::model(name, plant, inventory, state, period, named)
            };
            let time = inventory.channels.iter().find(|c| c.is_time);
            if let Some(unit) = time.and_then(|c| known.unit(&c.path)) {
                return text(Some((unit, "")));
            }
            let first = text(None);
            match log.and_then(|log| doubted(log, &first)) {
                Some(doubt) => {
                    let reason = doubt.reason();
                    notes.push(format!(
                        "the time stamps seem to be {}, not s: {reason}",
                        doubt.unit
                    ));
                    text(Some((
                        doubt.unit,
                        &format!("a guess: taken as s, {reason}"),
                    )))
                }
                None => first,
            }
        }),
    };
    let mut answer = InspectAnswer {
        schema: InspectAnswer::SCHEMA,
        summary: String::new(),
        file: name.to_owned(),
        format: inventory.format.clone(),
        duration_s: inventory.duration,
        runs: inventory.runs,
        state,
        notes,
        channels: inventory.channels.iter().map(inspected).collect(),
        plants,
        model_toml,
        inventory: inventory.clone(),
    };
    answer.summary = summary(&answer);
    Ok(answer)
}

/// Whether the time stamps of a log are seconds for the model that was made for it.
fn doubted(log: &Log, model_toml: &str) -> Option<Doubt> {
    let (model, _) = Composed::from_toml("model.toml", model_toml).ok()?;
    let recording = crate::session::map(&model, &log.source).ok()?;
    stamps::doubt(&model, &recording.runs).filter(|_| log.has_columns_of_time())
}

/// What the caller said of the log.
#[derive(Default)]
struct Known {
    inputs: Vec<(Option<String>, String)>,
    measured: Vec<(Option<String>, String)>,
    /// Channels and their units.
    units: Vec<(String, String)>,
}

impl Known {
    /// What the caller said of a channel.
    fn unit(&self, path: &str) -> Option<&str> {
        let found = self.units.iter().find(|(channel, _)| channel == path);
        found.map(|(_, unit)| unit.as_str())
    }

    fn new(inventory: &Inventory, options: &InspectOptions) -> Result<Self> {
        if let Some(id) = &options.plant {
            Model::of_plant(id)?;
        }
        let split = |given: &String| -> Result<(Option<String>, String)> {
            let paths = || inventory.channels.iter().map(|c| c.path.as_str());
            let (id, name) = match given.split_once('=') {
                Some((id, name)) if !paths().any(|p| p == given) => (Some(id.to_owned()), name),
                _ => (None, given.as_str()),
            };
            let whole = paths().find(|path| *path == name);
            let found = whole.or_else(|| {
                let mut ends = paths().filter(|p| p.ends_with(name));
                ends.next().filter(|_| ends.next().is_none())
            });
            match found {
                Some(path) => Ok((id, path.to_owned())),
                None => {
                    let near = loopsight_model::config::nearest(name, paths());
                    let near = near.map_or_else(String::new, |n| format!("; did you mean `{n}`?"));
                    Err(Error::request(format!(
                        "there is no channel `{name}`{near}"
                    )))
                }
            }
        };
        let unit = |given: &String| -> Result<(String, String)> {
            let Some((name, unit)) = given.rsplit_once('=') else {
                return Err(Error::request(format!(
                    "expected CHANNEL=UNIT, found `{given}`"
                )));
            };
            parse(unit).map_err(|error| Error::request(format!("`{given}`: {error}")))?;
            Ok((split(&name.to_owned())?.1, unit.to_owned()))
        };
        let all = |given: &[String]| given.iter().map(split).collect::<Result<Vec<_>>>();
        Ok(Self {
            inputs: all(&options.inputs)?,
            measured: all(&options.measured)?,
            units: options.units.iter().map(unit).collect::<Result<Vec<_>>>()?,
        })
    }
}

fn unfit(log: &str, meta: &PlantMeta) -> Error {
    let ids = |signals: &[loopsight_core::Signal]| {
        let ids: Vec<&str> = signals
            .iter()
            .filter(|s| !s.optional)
            .map(|s| s.id)
            .collect();
        ids.join(", ")
    };
    Error::request(format!(
        "{}: no channel seems to be an input or a signal of `{}`; it needs the inputs {} and one of {}; \
         say them with --input ID=CHANNEL and --measure ID=CHANNEL",
        log,
        meta.id,
        ids(meta.inputs),
        ids(meta.states),
    ))
}

/// The channel of texts that says which test runs.
fn state(inventory: &Inventory) -> Option<&ChannelFacts> {
    let is_state = |c: &&ChannelFacts| {
        c.kind == Kind::Text && c.words.len() > 1 && c.path.to_lowercase().contains("test-state")
    };
    inventory.channels.iter().find(is_state)
}

fn inspected(channel: &ChannelFacts) -> InspectedChannel {
    let clock = channel.clock.as_ref();
    InspectedChannel {
        path: channel.path.clone(),
        kind: match channel.kind {
            Kind::Number => "number",
            Kind::Boolean => "boolean",
            Kind::Text => "text",
            Kind::Opaque => "opaque",
        },
        declared: channel.declared.clone(),
        unit: channel.unit.as_ref().map(|u| u.unit.clone()),
        unit_from: channel.unit.as_ref().map(|u| u.why),
        values: channel.values,
        missing: channel.missing as f64 / channel.values.max(1) as f64,
        min: channel.range.map(|r| r.0),
        max: channel.range.map(|r| r.1),
        words: channel.words.clone(),
        rate_hz: clock.filter(|c| c.period > 0.0).map(|c| 1.0 / c.period),
        jitter_s: clock.map(|c| c.jitter),
        gaps: clock.map_or(0, |c| c.gaps),
        longest_gap_s: clock.map_or(0.0, |c| c.longest_gap),
        backwards: clock.map_or(0, |c| c.backwards),
    }
}

fn summary(answer: &InspectAnswer) -> String {
    let mut text = format!("{}, {} channels", answer.format, answer.channels.len());
    if let Some(duration) = answer.duration_s {
        text.push_str(&format!(", {} s", words::number(duration)));
    }
    text.push('.');
    if answer.runs > 1 {
        text.push_str(&format!(" {} runs.", answer.runs));
    }
    if let Some(state) = &answer.state {
        text.push_str(&format!(" The texts of `{state}` become runs."));
    }
    match answer.plants.first() {
        Some(plant) => text.push_str(&format!(" `{}` fits its channels.", plant.plant)),
        None => text.push_str(" No plant of the library fits its channels by their names: say which is which with --plant, --input and --measure."),
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(log: &str, bytes: &[u8]) -> Result<InspectAnswer> {
        inspect(
            &Log::from_bytes(log, bytes).unwrap(),
            &InspectOptions::default(),
        )
    }

    #[test]
    fn a_log_without_channels_is_refused() {
        let error = found("l.mcap", b"\x89MCAP0\r\n").unwrap_err();
        assert_eq!(error.exit_status(), 2);
        let said = error.to_string();
        assert!(
            said.contains("l.mcap: this MCAP log has no channels"),
            "{said}"
        );
    }

    /// A remark stands on the line that it is about: an effect that is added later comes behind it.
    #[test]
    fn a_unit_that_is_not_said_is_told_beside_the_column() {
        let row = |k: u32| format!("{},{},{}\n", 0.01 * f64::from(k), k / 50 % 3, k % 50);
        let rows: String = (0..500).map(row).collect();
        let answer = found("l.csv", format!("t,u,omega\n{rows}").as_bytes()).unwrap();
        let text = answer.model_toml.unwrap();
        let line = "column = \"omega\" # the log does not say its unit; taken as SI\n";
        assert!(text.ends_with(line), "{text}");
    }
}
