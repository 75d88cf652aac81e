//! The tables of a model file beside its parts: `[log]`, `[fit]`, `[simulation]`.

use loopsight_model::registry::{PartMeta, Setting};

const fn key(id: &'static str, unit: &'static str, doc: &'static str) -> Setting {
    Setting { id, unit, doc }
}

/// The tables, each with all of its keys.
pub(super) static TABLES: [PartMeta; 3] = [
    PartMeta {
        id: "log",
        role: "table",
        summary: "Which channel of a log is which signal of the plant.",
        equation: "SI value = value in `unit` as SI, times `scale`, plus `offset`;  a column is named by its header, a channel by its path or the \
                   end of it, a sum or difference by names with ` + ` and ` - ` between them: `right - left`",
        reference: "docs/logs.md",
        example: "[log]\nrun = \"test\"\ntimes_s = [2.0, 30.0]\n\n[log.inputs]\nvoltage = { column = \"u\", unit = \"mV\" }\n\n\
                  [log.measured.speed]\ncolumn = \"right - left\"\nunit = \"rpm\"\nscale = 0.5\n",
        settings: &[
            key(
                "time",
                "",
                "column of the time stamps: a name, or `{ column, unit, scale }`; by default the first column whose name begins with `time` or is `t`, of a CSV file without one the first in a unit of time that rises throughout",
            ),
            key(
                "period_s",
                "s",
                "time from one row to the next, of a log without time stamps, or in place of its own",
            ),
            key(
                "rows",
                "",
                "rows to use, from 1, both ends included: `[1, 5000]`, or a list of such pairs, each a run; by default all",
            ),
            key(
                "times_s",
                "s",
                "times to use, as the log's own time stamps say them: `[10, 25]`, or a list of such pairs, each a run; by default all",
            ),
            key(
                "run",
                "",
                "column of a run's number or name; another value begins a new run; by default a column `run`, where there is one",
            ),
            key(
                "side_by_side",
                "",
                "experiments in columns side by side: `[1, 2, 3]`, or texts. `{}` in the names of columns stands for each in turn, and each is a run of that name; by default there is one",
            ),
            key(
                "inputs_measured",
                "",
                "`true`: the inputs were measured at the machine, and are no commands. What driver and supply do to a command (`dead_zone`, `input_saturation`, `battery_sag`) is in them, and is not looked for. So it is with SysId's voltages; by default `false`",
            ),
            key(
                "inputs.ID",
                "",
                "channel of an input: a name, or the keys below; by default the channel named `ID`",
            ),
            key(
                "inputs.ID.column",
                "",
                "the channel, or a sum or difference of channels: `right - left`",
            ),
            key(
                "inputs.ID.unit",
                "",
                "its unit, where neither the file nor the name says it; by default SI, with a note; `°C` and `°F` are known",
            ),
            key(
                "inputs.ID.scale",
                "",
                "factor, besides that of the unit; `-1` turns the sign; by default 1. One that is just the factor of the unit gets a warning",
            ),
            key(
                "inputs.ID.scale_unit",
                "",
                "unit of `scale`, where the channel holds what a transducer makes of the signal: `m/V`",
            ),
            key(
                "inputs.ID.offset",
                "",
                "added at last, in SI: an angle that is counted from elsewhere; by default 0",
            ),
            key(
                "inputs.ID.hold",
                "",
                "between samples: `\"zero_order\"` constant (the default), `\"first_order\"` straight",
            ),
            key(
                "measured.ID",
                "",
                "a measured signal: the channel, or the keys below; without any, all signals that the log has by name",
            ),
            key(
                "measured.ID.column",
                "",
                "as of an input; by default the channel named `ID`",
            ),
            key("measured.ID.unit", "", "as of an input"),
            key("measured.ID.scale", "", "as of an input"),
            key("measured.ID.scale_unit", "", "as of an input"),
            key("measured.ID.offset", "", "as of an input"),
            key(
                "measured.ID.sensor",
                "",
                "how the number is made: `\"instantaneous\"` (the default; an angle that is counted, too), `\"interval_mean\"`, or, of a speed, `encoder_counts` with the keys below",
            ),
            key(
                "measured.ID.sensor.encoder_counts.counts_per_revolution",
                "",
                "counts of the encoder's shaft in a revolution, after quadrature",
            ),
            key(
                "measured.ID.sensor.encoder_counts.of",
                "",
                "shaft angles that are counted, each with the gain from its rate to the signal; by default the signal's own integral",
            ),
        ],
    },
    PartMeta {
        id: "fit",
        role: "table",
        summary: "Which parameters a fit estimates, where this differs from their declaration.",
        equation: "`loopsight explain PLANT` says which parameters are estimated and which are known",
        reference: "docs/logs.md",
        example: "[fit]\nfree = [\"half_track\"]\nfixed = [\"K_A\"]\n",
        settings: &[
            key(
                "free",
                "",
                "parameters to estimate though they are declared as known",
            ),
            key(
                "fixed",
                "",
                "parameters to keep as the file has them though they are declared as estimated",
            ),
            key(
                "tied",
                "",
                "parameters that are what the plant says they likely are where no recording shows them",
            ),
            key(
                "per_run",
                "",
                "parameters to estimate in each run anew: what differs from run to run, a battery or a load",
            ),
        ],
    },
    PartMeta {
        id: "simulation",
        role: "table",
        summary: "How the model is integrated.",
        equation: "Runge-Kutta of fourth order, in equal steps from one sample to the next, none longer than `max_step_s`",
        reference: "docs/logs.md",
        example: "[simulation]\nmax_step_s = 0.001\n",
        settings: &[key(
            "max_step_s",
            "s",
            "longest step; by default the plant's own, up to a quarter longer so that a late sample takes no step more, or a longer one where samples are far apart and steps of half the length come to the same place",
        )],
    },
];

#[cfg(test)]
mod tests {
    use loopsight_model::log_map::{Column, LogMap, Measured};
    use loopsight_model::model::{FitTable, SimulationTable};
    use loopsight_model::sensor::Encoder;
    use serde::de::DeserializeOwned;

    use super::*;

    /// The keys of a table, as its reader names them when it is given another one.
    fn keys<T: DeserializeOwned>(more: &str) -> Vec<String> {
        let Err(error) = toml::from_str::<T>(&format!("{more}\nno_such_key = 1\n")) else {
            panic!("a key that does not exist was read")
        };
        let said = error.message().to_owned();
        let (_, expected) = said
            .split_once("expected")
            .expect("the keys that there are");
        // An alias is no key of its own.
        let names = expected
            .split('`')
            .skip(1)
            .step_by(2)
            .filter(|k| *k != "period");
        names.map(str::to_owned).collect()
    }

    #[test]
    fn every_key_of_the_code_is_told_and_no_other() {
        let under = |place: &str, keys: Vec<String>| -> Vec<String> {
            keys.iter().map(|key| format!("{place}{key}")).collect()
        };
        let mut log: Vec<String> = Vec::new();
        for key in keys::<LogMap>("") {
            match key.as_str() {
                "inputs" => {
                    log.push("inputs.ID".to_owned());
                    log.extend(under("inputs.ID.", keys::<Column>("column = \"u\"")));
                }
                "measured" => {
                    log.push("measured.ID".to_owned());
                    log.extend(under("measured.ID.", keys::<Measured>("")));
                    let counts = keys::<Encoder>("counts_per_revolution = 1");
                    log.extend(under("measured.ID.sensor.encoder_counts.", counts));
                }
                _ => log.push(key),
            }
        }
        let told = |id: &str| -> Vec<String> {
            let table = TABLES.iter().find(|t| t.id == id).unwrap();
            table.settings.iter().map(|s| s.id.to_owned()).collect()
        };
        assert_eq!(told("log"), log);
        assert_eq!(told("fit"), keys::<FitTable>(""));
        assert_eq!(told("simulation"), keys::<SimulationTable>(""));
    }

    #[test]
    fn the_page_has_them_in_the_same_words() {
        let page = include_str!("../../../docs/logs.md");
        for table in &TABLES {
            for Setting { id, doc, .. } in table.settings {
                let row = format!("| `{id}` | {doc} |");
                assert!(page.contains(&row), "docs/logs.md lacks:\n{row}");
            }
            toml::from_str::<toml::Table>(table.example).unwrap();
        }
    }
}
