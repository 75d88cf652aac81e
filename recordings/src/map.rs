//! From the columns of a file to the signals of a model.

mod held;
mod short;
mod side_by_side;
mod tally;
mod turns;
mod values;

use std::borrow::Cow;
use std::collections::BTreeMap;

use loopsight_core::Signal;
use loopsight_model::log_map::LogMap;
use loopsight_model::run::{Rows, Run};
use loopsight_model::sensor::Sensor;

use crate::error::RecordingError;
use crate::fault::{Fault, FaultKind};
use crate::faults;
use crate::plan::Plan;
use crate::segment::{Inputs, Segments, segment};
use crate::source::Source;
use crate::table::{RunRows, Table, TableRun};
pub(crate) use short::run_names;
use tally::Tally;

/// One row in so many that repeats a time stamp: the rows came in bursts.
const BURSTS: usize = 3;
/// Values of this magnitude or more, in SI units, are no measurements.
pub(crate) const ABSURD: f64 = 1e9;

/// Measurements in SI units, in the order of a model's signals, and what is wrong with them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// File name.
    pub source: String,
    /// Uninterrupted runs; the time of each begins at 0.
    pub runs: Vec<Run>,
    /// What the columns of [`Run::measured`] are.
    pub measured: Vec<MappedSignal>,
    /// The column of the time stamps, as its header stands in the file.
    pub time: String,
    /// What is wrong with the log, the worst first.
    pub faults: Vec<Fault>,
}

/// A signal of the model for which the log has a column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MappedSignal {
    /// Id of the signal.
    pub id: String,
    /// Its SI unit.
    pub unit: String,
    /// How the number is made.
    pub sensor: Sensor,
}

/// Maps a log on the signals of a model.
///
/// `plant_inputs` must all have a column; of `plant_signals` (states and outputs: everything that
/// can be measured) those are taken that `map` lists, or all that the log has when it lists none.
/// A column belongs to a signal when the model file says so, or when its header is the signal's
/// id, or the id, an underscore and a unit.
///
/// Each run begins at time 0. Rows that repeat a time stamp are dropped; a jump back by more than
/// ten periods starts a new run, and so does a gap above `max(10 periods, 0.5 s)`, and one above 10 periods
/// across which the inputs change so much that nobody knows what the machine was told: the parts of a
/// run `x` are `x`, `x#2`, `x#3`. Runs shorter than 1 s are left out, unless nothing would be
/// left, or nothing moves in what would be left. All of it is named in [`Recording::faults`].
///
/// # Errors
///
/// [`RecordingError`] when a column is missing, has a wrong unit, or when a time stamp or an input
/// has no value that can be used.
pub fn map(
    source: &Source,
    plant_inputs: &[Signal],
    plant_signals: &[Signal],
    map: &LogMap,
) -> Result<Recording, RecordingError> {
    let (mut recording, table, plan) = match map.side_by_side.is_empty() {
        true => one(source, plant_inputs, plant_signals, map, None)?,
        false => side_by_side::all(source, plant_inputs, plant_signals, map)?,
    };
    if let Source::SysId(log) = source {
        recording.faults.extend(log.notes());
    }
    if !table.cut.is_empty() {
        recording.faults.push(Fault {
            kind: FaultKind::CutLog,
            run: String::new(),
            signal: String::new(),
            detail: table.cut.clone(),
        });
    }
    let input_ids: Vec<&str> = plan.inputs.iter().map(|(_, id)| id.as_str()).collect();
    let found = faults::check(&recording, &input_ids, &table, &plan);
    recording.faults.extend(found);
    recording
        .faults
        .sort_by_key(|fault| std::cmp::Reverse(fault.severity()));
    Ok(recording)
}

/// A recording, and the table and the plan that it was made with.
type Mapped<'s> = (Recording, Cow<'s, Table>, Plan);

/// The columns of one experiment, with its label where others stand beside it.
fn one<'s>(
    source: &'s Source,
    plant_inputs: &[Signal],
    plant_signals: &[Signal],
    map: &'s LogMap,
    label: Option<&str>,
) -> Result<Mapped<'s>, RecordingError> {
    let (mut table, map) = source.table_for(plant_inputs, plant_signals, map)?;
    let plan = Plan::new(&table, plant_inputs, plant_signals, &map)?;
    let held = held::wanted(&table, &plan);
    if !held.is_empty() {
        held::hold(table.to_mut(), &held);
    }
    let mut used = table.parts(plan.time, &map)?;
    if !held.is_empty() {
        used = Cow::Owned(held::without_unknown(&table, &used, &held));
    }
    if let Some(label) = label {
        side_by_side::cut(&table, &plan, used.to_mut(), label);
    }
    let mut mapper = Mapper::new(&table, &plan);
    mapper.own_clocks |= !held.is_empty();
    for run in &*used {
        mapper.run(run)?;
    }
    let (runs, mut found) = mapper.finish()?;
    let mut recording = Recording {
        source: table.source.clone(),
        runs,
        measured: plan.measured.iter().map(|(_, m)| m.clone()).collect(),
        time: (table.columns.get(plan.time.column)).map_or_else(String::new, |c| c.text.clone()),
        faults: Vec::new(),
    };
    found.extend(plan.notes.iter().cloned());
    let measured_ids: Vec<&str> = plan.measured.iter().map(|(_, m)| m.id.as_str()).collect();
    found.extend(turns::go_on(&mut recording, &plan));
    found.extend(faults::take_out_spikes(&mut recording, &measured_ids));
    recording.faults = found;
    Ok((recording, table, plan))
}

struct Mapper<'a> {
    table: &'a Table,
    plan: &'a Plan,
    runs: Vec<Run>,
    names: BTreeMap<String, usize>,
    rows: usize,
    /// What is missing in a row was never there.
    own_clocks: bool,
    duplicates: Tally,
    backwards: Tally,
    restarts: Tally,
    /// How often a counter of time ran over.
    wrapped: usize,
    gaps: Tally,
    longest_gap: f64,
    missing: Vec<Tally>,
    absurd: Vec<Tally>,
    empty: Vec<&'a str>,
}

impl<'a> Mapper<'a> {
    fn new(table: &'a Table, plan: &'a Plan) -> Self {
        let tallies = || plan.measured.iter().map(|_| Tally::default()).collect();
        Self {
            table,
            plan,
            runs: Vec::new(),
            names: BTreeMap::new(),
            rows: 0,
            own_clocks: table.own_clocks,
            duplicates: Tally::default(),
            backwards: Tally::default(),
            restarts: Tally::default(),
            wrapped: 0,
            gaps: Tally::default(),
            longest_gap: 0.0,
            missing: tallies(),
            absurd: tallies(),
            empty: Vec::new(),
        }
    }

    fn run(&mut self, run: &'a TableRun) -> Result<(), RecordingError> {
        if run.rows.is_empty() {
            self.empty.push(&run.name);
            return Ok(());
        }
        let rows = RunRows::new(&run.rows, self.table.columns.len());
        // Runs of equal numbers in the column of the run, or all rows.
        let number = |at: usize| self.plan.run.map(|c| rows.row(at)[c].to_bits());
        let mut start = 0;
        while start < rows.len() {
            let end = match self.plan.run {
                Some(_) => (start..rows.len()).find(|at| number(*at) != number(start)),
                None => None,
            };
            let group = start..end.unwrap_or(rows.len());
            let name = match self.plan.run {
                Some(column) => self.group_name(run, column, rows.row(start)[column]),
                None => run.name.clone(),
            };
            self.group(run, rows, group.clone(), &name)?;
            start = group.end;
        }
        Ok(())
    }

    fn group_name(&self, run: &TableRun, column: usize, value: f64) -> String {
        let label = match self.table.labels.get(&column) {
            Some(words) => words.get(value as usize).cloned().unwrap_or_default(),
            None => value.to_string(),
        };
        if run.name.is_empty() {
            label
        } else {
            format!("{} {label}", run.name)
        }
    }

    fn group(
        &mut self,
        run: &TableRun,
        rows: RunRows<'_>,
        range: std::ops::Range<usize>,
        name: &str,
    ) -> Result<(), RecordingError> {
        let time = self.plan.time;
        // Shifted before scaled: large stamps (microseconds since 1970) keep their digits.
        let first_row = range.start;
        let origin = rows.row(first_row)[time.column];
        let mut times: Vec<f64> = range.clone().map(|at| rows.row(at)[time.column]).collect();
        self.wrapped += turns::run_on(&mut times);
        for (at, stamp) in range.clone().zip(&mut times) {
            self.check(run, at, time, *stamp, "the time")?;
            self.seconds(run, at, *stamp * time.factor)?;
            *stamp = self.exact((*stamp - origin) * time.factor);
            self.limit(run, at, time, *stamp)?;
        }
        self.rows += times.len();
        // A channel with a clock of its own says nothing while it stays as it is.
        let columns = self.plan.inputs.iter().filter_map(|(link, _)| *link);
        let columns = columns.map(|link| link.column).filter(|_| !self.own_clocks);
        let inputs = Inputs::new(rows.part(range), columns.collect());
        let cut = segment(first_row, &times, &inputs);
        self.count_cuts(run, rows, &cut);
        for part in &cut.parts {
            let part_name = self.part_name(name);
            let time_of = |at: &usize| times[at - first_row];
            let start = part.first().map_or(0.0, time_of);
            let times = part
                .iter()
                .map(|at| self.exact(time_of(at) - start))
                .collect();
            let room = |width: usize| Rows::new(width, Vec::with_capacity(width * part.len()));
            let mut inputs = room(self.plan.inputs.len());
            let mut measured = room(self.plan.measured.len());
            for at in part {
                self.row(run, *at, rows.row(*at), &mut inputs, &mut measured)?;
            }
            let built = Run::new(part_name, times, inputs, measured);
            self.runs.push(built.map_err(|error| RecordingError::Run {
                log: self.table.source.as_str().into(),
                error,
            })?);
        }
        Ok(())
    }

    /// Stamps of other programs count nanoseconds or more: a difference of two loses none of them.
    fn exact(&self, seconds: f64) -> f64 {
        match self.table.own_clocks {
            true => (seconds * 1e9).round() / 1e9,
            false => seconds,
        }
    }

    fn part_name(&mut self, name: &str) -> String {
        let parts = self.names.entry(name.to_owned()).or_insert(0);
        *parts += 1;
        if *parts == 1 {
            name.to_owned()
        } else {
            format!("{name}#{parts}")
        }
    }

    fn count_cuts(&mut self, run: &TableRun, rows: RunRows<'_>, cut: &Segments) {
        let (table, time) = (self.table, self.plan.time);
        let place = |row: usize| {
            let stamp = rows.row(row)[time.column];
            format!("{}: {stamp}", table.location(run, row, time.column))
        };
        for row in &cut.duplicates {
            self.duplicates.add(|| place(*row));
        }
        for row in &cut.backwards {
            self.backwards.add(|| place(*row));
        }
        for row in &cut.restarts {
            self.restarts.add(|| place(*row));
        }
        for (row, length) in &cut.gaps {
            self.gaps.add(|| place(*row));
            self.longest_gap = self.longest_gap.max(*length);
        }
    }

    fn row(
        &mut self,
        run: &TableRun,
        at: usize,
        row: &[f64],
        inputs: &mut Rows,
        measured: &mut Rows,
    ) -> Result<(), RecordingError> {
        let plan = self.plan;
        for (link, _) in &plan.inputs {
            let Some(link) = link else {
                inputs.values.push(0.0);
                continue;
            };
            let value = row[link.column];
            self.check(run, at, *link, value, "an input")?;
            self.limit(run, at, *link, link.si(value))?;
            inputs.values.push(link.si(value));
        }
        for (signal, (link, _)) in plan.measured.iter().enumerate() {
            let mut value = link.si(row[link.column]);
            let place = || self.table.location(run, at, link.column).to_string();
            if value.is_nan() {
                self.missing[signal].add(place);
            } else if value.abs() >= ABSURD {
                self.absurd[signal].add(|| format!("{}: {value}", place()));
                value = f64::NAN;
            }
            measured.values.push(value);
        }
        Ok(())
    }

    /// The runs to use, and what was done to get them.
    fn finish(self) -> Result<(Vec<Run>, Vec<Fault>), RecordingError> {
        if self.runs.is_empty() {
            return Err(RecordingError::HeaderOnly {
                log: self.table.source.as_str().into(),
            });
        }
        let mut faults = Vec::new();
        let time = self
            .table
            .columns
            .get(self.plan.time.column)
            .map_or("", |c| c.text.as_str());
        let back = self.backwards.count + self.restarts.count;
        if back > 1 && 2 * back >= self.rows {
            return Err(RecordingError::TimeBackwards {
                log: self.table.source.as_str().into(),
                column: time.into(),
                back,
                rows: self.rows,
            });
        }
        if self.runs.iter().all(|run| run.len() < 2) && self.rows > 0 {
            return Err(RecordingError::OneRow {
                log: self.table.source.as_str().into(),
                runs: self.runs.len(),
            });
        }
        let mut push = |kind, run: String, signal: &str, detail: String| {
            faults.push(Fault {
                kind,
                run,
                signal: signal.into(),
                detail,
            });
        };
        let Tally { count, first } = &self.duplicates;
        if *count > 0 {
            let mut detail = format!(
                "{count} of {} rows repeat the time stamp before and were left out, the first \
                 at {first}",
                self.rows
            );
            let duration: f64 = self.runs.iter().map(Run::duration).sum();
            if BURSTS * count >= self.rows && duration > 0.0 {
                let period = duration / (self.rows - self.runs.len()).max(1) as f64;
                detail.push_str(&format!(
                    "; so many rows at one stamp were stamped when they arrived, not when they were measured: \
                     `period_s = {period:.3e}` in place of `time` in the model's [log] uses all of them, evenly"
                ));
            }
            push(FaultKind::DuplicateTime, String::new(), time, detail);
        }
        let (back, restarts) = (&self.backwards, &self.restarts);
        if back.count + restarts.count > 0 {
            let mut said = Vec::new();
            if back.count > 0 {
                said.push(format!(
                    "the time goes back in {} of {} rows, which were left out, the first at {}",
                    back.count, self.rows, back.first
                ));
            }
            if restarts.count > 0 {
                said.push(format!(
                    "the time jumps back {} times, where a new run was begun, the first at {}",
                    restarts.count, restarts.first
                ));
            }
            push(
                FaultKind::NonMonotoneTime,
                String::new(),
                time,
                said.join("; "),
            );
        }
        if self.wrapped > 0 {
            let detail = format!(
                "it begins anew {} times, as a counter of 16 or 32 bits does that runs over; it is taken as going on",
                self.wrapped
            );
            push(FaultKind::Wrapped, String::new(), time, detail);
        }
        if self.gaps.count > 0 {
            let detail = format!(
                "{} gaps, the longest {:.3} s, where the run was split; the first ends at {}",
                self.gaps.count, self.longest_gap, self.gaps.first
            );
            push(FaultKind::Gap, String::new(), time, detail);
        }
        for (at, (_, signal)) in self.plan.measured.iter().enumerate() {
            let (missing, absurd) = (&self.missing[at], &self.absurd[at]);
            if missing.count > 0 && !self.own_clocks {
                let detail = format!(
                    "{} of {} samples are missing, the first at {}",
                    missing.count, self.rows, missing.first
                );
                push(FaultKind::NotANumber, String::new(), &signal.id, detail);
            }
            if absurd.count > 0 {
                let detail = format!(
                    "{} of {} samples are {ABSURD:e} {} or more in magnitude and count as \
                     missing, the first at {}",
                    absurd.count, self.rows, signal.unit, absurd.first
                );
                push(FaultKind::AbsurdValue, String::new(), &signal.id, detail);
            }
        }
        if !self.empty.is_empty() {
            let detail = "no rows; left out".to_owned();
            push(
                FaultKind::EmptyRun,
                run_names(&self.empty, usize::MAX),
                "",
                detail,
            );
        }
        let (runs, short) = short::without_short_runs(self.runs);
        faults.extend(short);
        Ok((runs, faults))
    }
}

#[cfg(test)]
mod tests;
