//! The `[log]` that a model lacks for a log: what it names and the log does not have is filled in with the
//! nearest channels.

use loopsight_core::Signal;
use loopsight_core::unit::{conversion, parse};
use loopsight_model::config::nearest;
use loopsight_model::log_map::{Column, ColumnMap, Hold, LogMap, Measured};
use loopsight_model::model::Model as Composed;
use loopsight_recordings::{ChannelFacts, Inventory, Kind, RecordingError, Source};

use super::likely;
use super::toml::{GUESSED_PERIOD, OTHERS};

/// Signals that are filled in at most.
const MOST: usize = 40;

/// A `[log]` with which the log can be read, as it stands in a model file, and what in it is a guess; none where
/// no channel would do.
pub(crate) fn table(model: &Composed, log: &Source) -> Option<String> {
    // One channel for all experiments would be wrong: the error names the nearest of each.
    if !model.log.side_by_side.is_empty() {
        return None;
    }
    let mut filling = Filling {
        inventory: log.inventory(),
        map: model.log.clone(),
        guesses: Vec::new(),
    };
    let mut trial = model.clone();
    for _ in 0..MOST {
        trial.log.clone_from(&filling.map);
        match crate::session::map(&trial, log) {
            Ok(_) => return filling.text(),
            Err(RecordingError::MissingColumn { role, id, .. }) => {
                filling.fill(model, role, &id)?
            }
            Err(RecordingError::NothingMeasured { .. }) => filling.measure(model)?,
            Err(_) => return None,
        }
    }
    None
}

struct Filling {
    inventory: Inventory,
    map: LogMap,
    guesses: Vec<String>,
}

impl Filling {
    fn text(&self) -> Option<String> {
        let mut text = self.map.to_toml()?;
        for guess in &self.guesses {
            text.push_str(&format!("# {guess}\n"));
        }
        Some(text)
    }

    fn fill(&mut self, model: &Composed, role: &str, id: &str) -> Option<()> {
        match role {
            "the time" => self.time(),
            "the run" => {
                self.map.run = None;
                self.guesses.push(format!(
                    "no channel is the run `{id}`; all of the log is one run"
                ));
                Some(())
            }
            "the input" => {
                let signal = model.plant.inputs.iter().find(|s| s.id == id)?;
                let named = self.map.inputs.get(id).map(|c| c.name().to_owned());
                let channel = self.channel(signal, true, named.as_deref())?;
                let old = self.map.inputs.remove(id);
                let old = old.unwrap_or_else(|| ColumnMap::Name(String::new()));
                let column = Column {
                    column: channel.path.clone(),
                    unit: unit(&channel),
                    scale: old.scale(),
                    scale_unit: old.scale_unit().map(str::to_owned),
                    offset: old.offset(),
                    hold: old.hold(),
                };
                self.map
                    .inputs
                    .insert(id.to_owned(), ColumnMap::Full(column));
                Some(())
            }
            _ => {
                let signals = model.plant.states.iter().chain(model.plant.outputs);
                let signal = signals.into_iter().find(|s| s.id == id)?;
                let named = self.map.measured.get(id).and_then(|m| m.column.clone());
                let channel = self.channel(signal, false, named.as_deref())?;
                self.put(signal, &channel);
                Some(())
            }
        }
    }

    /// States that the log seems to have; without any, the first state and the first channel that would do.
    fn measure(&mut self, model: &Composed) -> Option<()> {
        let states: Vec<&Signal> = model.plant.states.iter().collect();
        for signal in &states {
            let taken: Vec<&str> = self.not_free();
            let found = likely::best(signal, false, &self.inventory, &taken, None);
            if let Some(channel) = found.map(|(_, c)| c.clone()) {
                self.put(signal, &channel);
            }
        }
        if self.map.measured.is_empty() {
            let signal = states.first()?;
            let channel = self.channel(signal, false, None)?;
            self.put(signal, &channel);
        }
        Some(())
    }

    fn put(&mut self, signal: &Signal, channel: &ChannelFacts) {
        let old = self.map.measured.remove(signal.id).unwrap_or_default();
        let measured = Measured {
            column: Some(channel.path.clone()),
            unit: unit(channel),
            ..old
        };
        self.map.measured.insert(signal.id.to_owned(), measured);
    }

    /// Channels that stand for something else already.
    fn not_free(&self) -> Vec<&str> {
        let inputs = self.map.inputs.values().map(ColumnMap::name);
        let measured = self
            .map
            .measured
            .values()
            .filter_map(|m| m.column.as_deref());
        let time = self.map.time.iter().map(ColumnMap::name);
        inputs.chain(measured).chain(time).collect()
    }

    /// The channel for a signal: by words and unit, by a name that is nearly the one that was looked for, or
    /// the first that is free and may have its unit.
    fn channel(
        &mut self,
        signal: &Signal,
        input: bool,
        named: Option<&str>,
    ) -> Option<ChannelFacts> {
        let taken = self.not_free();
        let expected = parse(signal.unit).ok()?;
        let fits = |c: &&ChannelFacts| {
            let unit = c.unit.as_ref().and_then(|u| parse(&u.unit).ok());
            c.kind == Kind::Number
                && !c.is_time
                && !taken.contains(&c.path.as_str())
                && unit.is_none_or(|u| conversion(&u, &expected).is_some())
        };
        let free = || self.inventory.channels.iter().filter(fits);
        let like = |name: &str| {
            let near = nearest(name, free().map(|c| c.path.as_str()))?;
            free().find(|c| c.path == near)
        };
        let best = || likely::best(signal, input, &self.inventory, &taken, None).map(|(_, c)| c);
        let found = named
            .and_then(like)
            .or_else(best)
            .or_else(|| like(signal.id));
        let others = likely::others(signal, input, &self.inventory, &taken);
        let channel = match found {
            Some(channel) => channel.clone(),
            None => (*others.first()?).clone(),
        };
        let rest: Vec<String> = (others.iter().filter(|c| c.path != channel.path))
            .take(OTHERS)
            .map(|c| format!("`{}`", c.path))
            .collect();
        let doubtful = !likely::sure(signal, input, &self.inventory, &taken) && !rest.is_empty();
        let guess = (found.is_none() || doubtful).then(|| {
            let why = if found.is_none() {
                ": no channel has such a name"
            } else {
                ""
            };
            let or = if rest.is_empty() {
                ""
            } else {
                "; it could be "
            };
            format!(
                "`{}` for `{}` is a guess{why}{or}{}",
                channel.path,
                signal.id,
                rest.join(", ")
            )
        });
        self.guesses.extend(guess);
        Some(channel)
    }

    fn time(&mut self) -> Option<()> {
        let taken = self.not_free();
        let free = |c: &&ChannelFacts| !taken.contains(&c.path.as_str());
        let time = self
            .inventory
            .channels
            .iter()
            .filter(free)
            .find(|c| c.is_time);
        if let (Some(time), None) = (time, &self.map.time) {
            let column = Column {
                column: time.path.clone(),
                unit: unit(time).or(Some("s".to_owned())),
                scale: 1.0,
                scale_unit: None,
                offset: 0.0,
                hold: Hold::default(),
            };
            self.map.time = Some(ColumnMap::Full(column));
        } else if self.map.time.take().is_none() && self.map.period_s.is_none() {
            self.map.period_s = Some(GUESSED_PERIOD);
            self.guesses.push(format!(
                "the log has no time stamps: a row every {GUESSED_PERIOD} s is a guess"
            ));
        }
        Some(())
    }
}

/// The unit, where the log says one.
fn unit(channel: &ChannelFacts) -> Option<String> {
    let unit = channel.unit.as_ref()?;
    parse(&unit.unit).is_ok().then(|| unit.unit.clone())
}

#[cfg(test)]
mod tests {
    use crate::{Log, Model, Session};

    fn rows(header: &str) -> String {
        let row = |k: u32| format!("{},{},{}\n", f64::from(k) * 0.01, k % 7, 3 * k);
        let rows: String = (0..200).map(row).collect();
        format!("{header}{rows}")
    }

    /// What a model says with this `[log]` of a log; the help of the error, which then reads it.
    fn help(log_table: &str, text: &str) -> String {
        let plant = "[plant.dc_axis]\n";
        let open = |table: &str| {
            let model = Model::from_toml("m.toml", &format!("{plant}{table}")).unwrap();
            Session::new(model, Log::from_bytes("log.csv", text.as_bytes()).unwrap())
        };
        let error = open(log_table).unwrap_err();
        let help = error.help().unwrap().to_owned();
        let (_, table) = help.split_once("\n\n").unwrap();
        open(table).unwrap_or_else(|e| panic!("{table}: {e}"));
        help
    }

    #[test]
    fn what_is_printed_can_be_pasted_and_runs() {
        let said = help("", &rows("t,u,omega\n"));
        assert!(
            said.contains("[log.inputs.voltage]\ncolumn = \"u\""),
            "{said}"
        );
        let said = help(
            "[log.inputs]\nvoltage = { column = \"volts\", scale = -1.0 }\n",
            &rows("clock,volt_V,w_rpm\n"),
        );
        assert!(
            said.starts_with("this in the model file, in place of its [log]"),
            "{said}"
        );
        assert!(
            said.contains("column = \"volt_V\"") && said.contains("scale = -1.0"),
            "{said}"
        );
        assert!(said.contains("period_s = 0.01"), "{said}");
        // Nothing but numbers: the first column rises, the others are guesses.
        let said = help("", &rows(""));
        assert!(
            said.contains("`column 2` for `voltage` is a guess"),
            "{said}"
        );
    }
}
