//! A log as its model sees it, for other programs.

use std::path::Path;

use loopsight_model::log_map::{LogMap, Measured};
use loopsight_model::model::{MeasuredSignal, Model as Composed};
use loopsight_model::sensor::Sensor;
use loopsight_recordings::{LogWriter, header, write_csv, write_parquet};

use crate::answers::{Answer, ConvertAnswer};
use crate::error::{Error, Result};
use crate::session::Session;
use crate::{files, words};

/// Between runs that are laid end to end, s.
const PAUSE: f64 = 1.0;

/// What the ending of a name asks for.
#[derive(Clone, Copy, PartialEq)]
enum Out {
    Csv,
    Mcap,
    Parquet,
}

impl Session {
    /// Writes the signals that the model has in the log, in SI units: CSV, or MCAP or Parquet where the name ends in
    /// `.mcap` or `.parquet`. Several runs have a column `run` with their numbers. The time of each begins at 0, but in
    /// MCAP, which players show on one line of time, they stand one after the other, 1 s apart. What was not measured at
    /// a time stamp is left empty. Parquet has the units in the metadata of its fields, and needs the feature
    /// `all-formats`.
    ///
    /// # Errors
    ///
    /// The session has no log, or the file cannot be written.
    pub fn convert(&self, path: impl AsRef<Path>) -> Result<ConvertAnswer> {
        let path = path.as_ref();
        let data = self.data()?;
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        let out = match ending.as_deref() {
            Some("mcap") => Out::Mcap,
            Some("csv") => Out::Csv,
            Some("parquet") => Out::Parquet,
            _ => {
                return Err(Error::request(format!(
                    "cannot write `{}`: expected a name that ends in .csv, .mcap or .parquet",
                    path.display()
                )));
            }
        };
        files::check(path)?;
        let several = data.runs.len() > 1;
        let mut columns = vec!["time_s".to_owned()];
        columns.extend(several.then(|| "run".to_owned()));
        columns.extend(data.model.plant.inputs.iter().map(header));
        columns.extend(data.model.measured.iter().map(|m| header(m.signal)));
        let mut rows: Vec<f64> = Vec::new();
        let mut begin = 0.0;
        for (number, run) in (1_u32..).zip(data.runs.iter()) {
            for k in 0..run.len() {
                rows.push(run.time()[k] + if out == Out::Mcap { begin } else { 0.0 });
                rows.extend(several.then(|| f64::from(number)));
                rows.extend(run.input(k).iter().chain(run.sample(k)));
            }
            begin += run.duration() + PAUSE;
        }
        let wrong = |error| Error::in_log(&error, &path.display().to_string(), None);
        let written = match out {
            Out::Mcap => {
                let mut log = LogWriter::create(path, &columns).map_err(wrong)?;
                for row in rows.chunks_exact(columns.len()) {
                    log.write(row).map_err(wrong)?;
                }
                log.finish()
            }
            Out::Csv => write_csv(path, &columns, &rows),
            Out::Parquet => {
                let inputs = data.model.plant.inputs.iter();
                let signals = inputs.chain(data.model.measured.iter().map(|m| m.signal));
                let mut units = vec![Some("s".to_owned())];
                units.extend(several.then_some(None));
                units.extend(signals.map(|s| Some(s.unit.to_owned()).filter(|u| u != "1")));
                let columns: Vec<_> = columns.iter().cloned().zip(units).collect();
                write_parquet(path, &columns, &rows)
            }
        };
        let written = written.map_err(wrong)?;
        let samples = rows.len() / columns.len();
        let duration_s = data.runs.iter().map(|run| run.duration()).sum();
        Ok(ConvertAnswer {
            schema: ConvertAnswer::SCHEMA,
            summary: format!(
                "{} of {}: {} runs, {samples} samples over {} s, columns {}.{}",
                path.display(),
                data.log,
                data.runs.len(),
                words::number(duration_s),
                columns.join(", "),
                sensors(&data.model)
            ),
            file: path.display().to_string(),
            runs: data.runs.iter().map(|run| run.name().to_owned()).collect(),
            samples,
            duration_s,
            columns,
            written,
        })
    }
}

/// How the numbers were made, which no column says: the `[log]` of a model that reads the file. Empty where all are
/// instantaneous.
fn sensors(model: &Composed) -> String {
    // All of them: a list of some would leave out the others.
    let made = model.measured.iter().any(|m| m.sensor != Sensor::default());
    let entry = |m: &MeasuredSignal| {
        let measured = Measured {
            sensor: m.sensor.clone(),
            ..Measured::default()
        };
        (m.signal.id.to_owned(), measured)
    };
    let map = LogMap {
        measured: model.measured.iter().map(entry).collect(),
        ..LogMap::default()
    };
    match map.to_toml().filter(|_| made) {
        Some(text) => {
            format!(" How they were made belongs into the model file that reads them:\n\n{text}")
        }
        None => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use crate::{Log, Model, Session};

    /// The signals that a model has in a log, in SI, read back by their names.
    #[test]
    fn what_is_written_reads_back_to_the_same_runs() {
        let folder = tempfile::tempdir().unwrap();
        let row = |k: u32| format!("{},{},{},{}\n", 20 * (k % 100), k / 100, k % 7, 3 * k);
        let rows: String = (0..200).map(row).collect();
        let text = format!("t_ms,run,u,w_rpm\n{rows}");
        let plant = "[plant.dc_axis]\n";
        let map = "[log]\ntime = \"t_ms\"\n[log.inputs]\nvoltage = { column = \"u\", unit = \"V\" }\n\
                   [log.measured.speed]\ncolumn = \"w_rpm\"\n";
        let model = |text: String| Model::from_toml("m.toml", &text).unwrap();
        let log = Log::from_bytes("log.csv", text.as_bytes()).unwrap();
        let before = Session::new(model(format!("{plant}{map}")), log).unwrap();
        for name in ["si.csv", "si.mcap", "si.parquet"] {
            let path = folder.path().join(name);
            let answer = before.convert(&path);
            if name.ends_with("parquet") && !cfg!(feature = "all-formats") {
                let error = answer.unwrap_err();
                assert!(
                    error.message().contains("the feature `all-formats`"),
                    "{error}"
                );
                assert!(error.help().unwrap().contains("cargo install"), "{error}");
                continue;
            }
            let answer = answer.unwrap();
            assert_eq!(
                answer.columns,
                ["time_s", "run", "voltage_V", "speed_rad_per_s"]
            );
            let after = Session::new(model(plant.to_owned()), Log::read(&path).unwrap()).unwrap();
            let (a, b) = (before.data().unwrap(), after.data().unwrap());
            assert_eq!(a.runs.len(), b.runs.len());
            for (a, b) in a.runs.iter().zip(b.runs.iter()) {
                assert_eq!(a.len(), b.len());
                for k in 0..a.len() {
                    assert!((a.time()[k] - b.time()[k]).abs() < 1e-9, "{name}");
                    assert_eq!(a.input(k), b.input(k), "{name}");
                    assert!((a.sample(k)[0] - b.sample(k)[0]).abs() < 1e-12, "{name}");
                }
            }
        }
        let error = before.convert(folder.path().join("si.xls")).unwrap_err();
        assert!(
            error.message().contains("ends in .csv, .mcap or .parquet"),
            "{error}"
        );
    }

    /// What no column says, the kind of a sensor, is in the answer, for the model that reads the file.
    #[test]
    fn the_kind_of_a_sensor_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let rows: String = (0..200)
            .map(|k| format!("{},{},{}\n", 0.01 * f64::from(k), k % 7, 3 * k))
            .collect();
        let log = Log::from_bytes("log.csv", format!("t_s,u_V,w_rpm\n{rows}").as_bytes()).unwrap();
        let plant = "[plant.dc_axis]\n";
        let map = "[log.inputs]\nvoltage = \"u\"\n[log.measured.speed]\ncolumn = \"w\"\nsensor = \"interval_mean\"\n";
        let before = Model::from_toml("m.toml", &format!("{plant}{map}")).unwrap();
        let before = Session::new(before, log).unwrap();
        let path = folder.path().join("si.csv");
        let answer = before.convert(&path).unwrap();
        let (_, table) = answer.summary.split_once("\n\n").unwrap();
        let after = Model::from_toml("m.toml", &format!("{plant}{table}")).unwrap();
        let after = Session::new(after, Log::read(&path).unwrap()).unwrap();
        let sensor = |s: &Session| s.data().unwrap().model.measured[0].sensor.clone();
        assert_eq!(sensor(&after), sensor(&before));
        assert_eq!(sensor(&after).name(), "interval mean");
    }
}
