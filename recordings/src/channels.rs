//! A log of another program, as the table that the `[log]` of a model asks for.
//!
//! Channels without time stamps (MATLAB, NumPy, Parquet) are columns of one table, whose rows are
//! those of the first channel that is asked for. Channels with time stamps of their own (WPILOG,
//! ULog, MCAP) are brought on the union of their stamps: an input and a state hold their last
//! value, a measured signal stands where it was measured and is missing elsewhere. Nothing is
//! resampled.

use std::collections::BTreeMap;

use loopsight_core::Signal;
use loopsight_core::unit::{parse, split_name};
use loopsight_formats::{Channel, Cut, Log, Values};
use loopsight_model::log_map::{Column, ColumnMap, LogMap};

use crate::derive;
use crate::error::RecordingError;
use crate::names::nearest;
use crate::naming;
use crate::table::{ColumnName, TIME, Table, TableRun};

/// What WPILib calls the state of a mechanism that is not being tested.
const NO_TEST: [&str; 2] = ["none", ""];
/// Where WPILib logs the state of a test.
const SYSID_STATE: &str = "sysid-test-state";

/// The table and the map of it, in which every column has the path of its channel.
pub(crate) fn prepare(
    log: &Log,
    inputs: &[Signal],
    signals: &[Signal],
    map: &LogMap,
) -> Result<(Table, LogMap), RecordingError> {
    if log.channels.is_empty() {
        return Err(RecordingError::NoChannels {
            log: log.source.as_str().into(),
            cut: log.cut.as_ref().map(|at| cut(at).into()),
        });
    }
    let finder = Finder { log };
    let mut named = map.clone();
    let mut wanted = Wanted::default();
    for signal in inputs {
        let found = match map.inputs.get(signal.id) {
            Some(column) => Some(finder.sum("the input", signal.id, column.name())?),
            None => finder.by_id(signal.id).map(|at| finder.alone(at)),
        };
        let Some((path, channels)) = found else {
            if signal.optional {
                continue;
            }
            return Err(finder.missing("the input", signal.id, signal.id));
        };
        let column = named.inputs.entry(signal.id.to_owned());
        match column.or_insert_with(|| ColumnMap::Name(path.clone())) {
            ColumnMap::Name(name) => *name = path,
            ColumnMap::Full(column) => column.column = path,
        }
        wanted.held.extend(channels);
    }
    for signal in signals {
        let entry = map.measured.get(signal.id);
        let found = match entry {
            Some(entry) => {
                let name = entry.column.as_deref().unwrap_or(signal.id);
                Some(finder.sum("the measured signal", signal.id, name)?)
            }
            None if map.measured.is_empty() => {
                let at = finder.by_id(signal.id);
                at.filter(|at| !wanted.held.contains(at))
                    .map(|at| finder.alone(at))
            }
            None => None,
        };
        let Some((path, channels)) = found else {
            continue;
        };
        let measured = named.measured.entry(signal.id.to_owned()).or_default();
        measured.column = Some(path);
        wanted.measured.extend(channels);
    }
    if let Some(name) = &map.run {
        let at = finder.named("the run", name, name)?;
        named.run = Some(finder.path(at));
        wanted.run = Some(at);
    }
    if let Some(time) = &map.time {
        let at = finder.named("the time", "time", time.name())?;
        wanted.time = Some(at);
        named.time = Some(match time {
            ColumnMap::Name(_) => ColumnMap::Name(finder.path(at)),
            ColumnMap::Full(column) => ColumnMap::Full(Column {
                column: finder.path(at),
                ..column.clone()
            }),
        });
    }
    let table = match wanted.clocks(log) {
        true => {
            named.time = Some(ColumnMap::Name(TIME.to_owned()));
            on_all_stamps(log, &wanted)
        }
        false => side_by_side(log, &wanted)?,
    };
    Ok((table, named))
}

/// The table of all channels that stand side by side with the largest one.
pub(crate) fn table(log: &Log) -> Table {
    let largest = (0..log.channels.len()).max_by_key(|at| log.channels[*at].values.len());
    let Some(largest) = largest else {
        return Table::default();
    };
    let first = &log.channels[largest];
    let beside = |c: &Channel| {
        c.info.clock == first.info.clock
            && c.values.len() == first.values.len()
            && !matches!(c.values, Values::Opaque(_))
    };
    let columns: Vec<usize> = (0..log.channels.len())
        .filter(|at| beside(&log.channels[*at]))
        .collect();
    let mut table = rows(log, &columns, first.values.len());
    if let Some(time) = log.time(first) {
        prepend_time(&mut table, time);
    }
    table
}

/// Topic of the rows of a log that a loop wrote.
const OWN: &str = "loop/";

/// Whether a channel is one of a loop's own log.
pub(crate) fn is_own(path: &str) -> bool {
    path.strip_prefix(OWN) == Some(TIME)
}

/// The table of a log that a loop wrote as MCAP: its columns are the fields of one topic.
pub(crate) fn own(log: &Log) -> Option<Table> {
    log.find(&format!("{OWN}{TIME}"))?;
    let columns: Vec<usize> = (0..log.channels.len())
        .filter(|at| log.channels[*at].info.path.starts_with(OWN))
        .collect();
    let n = log.channels.get(*columns.first()?)?.values.len();
    let mut table = rows(log, &columns, n);
    for column in &mut table.columns {
        *column = ColumnName::new(column.text.trim_start_matches(OWN));
    }
    Some(table)
}

/// Channels by what they are for.
#[derive(Default)]
struct Wanted {
    held: Vec<usize>,
    measured: Vec<usize>,
    run: Option<usize>,
    time: Option<usize>,
}

impl Wanted {
    /// All of them, in the order of columns.
    fn all(&self) -> Vec<usize> {
        let mut all: Vec<usize> = self.held.clone();
        for at in self.measured.iter().chain(&self.run).chain(&self.time) {
            if !all.contains(at) {
                all.push(*at);
            }
        }
        all
    }

    /// Whether they have time stamps of their own.
    fn clocks(&self, log: &Log) -> bool {
        let all = self.all();
        let clock = |at: &usize| log.channels[*at].info.clock.is_some();
        !all.is_empty() && self.time.is_none() && all.iter().any(clock)
    }
}

struct Finder<'l> {
    log: &'l Log,
}

impl Finder<'_> {
    fn path(&self, at: usize) -> String {
        self.log.channels[at].info.path.clone()
    }

    /// The channel that a map names: by its path, or by the end of it where only one has it.
    fn named(&self, role: &'static str, id: &str, name: &str) -> Result<usize, RecordingError> {
        self.by_id(name).ok_or_else(|| self.missing(role, id, name))
    }

    /// The channels of a name, or of a sum of names, and what the sum is called by their paths.
    fn sum(
        &self,
        role: &'static str,
        id: &str,
        name: &str,
    ) -> Result<(String, Vec<usize>), RecordingError> {
        if let Some(at) = self.by_id(name) {
            return Ok(self.alone(at));
        }
        let Some(terms) = derive::terms(name) else {
            return Err(self.missing(role, id, name));
        };
        let mut paths = Vec::new();
        let mut channels = Vec::new();
        for (sign, term) in terms {
            let at = self.named(role, id, term)?;
            paths.push((sign, self.path(at)));
            channels.push(at);
        }
        Ok((derive::text(&paths), channels))
    }

    fn alone(&self, at: usize) -> (String, Vec<usize>) {
        (self.path(at), vec![at])
    }

    /// The channel with this path, or the one whose path ends so.
    fn by_id(&self, id: &str) -> Option<usize> {
        self.log.position(id).or_else(|| self.ending(id))
    }

    /// The one channel whose path ends with a name, with or without a unit behind it.
    fn ending(&self, name: &str) -> Option<usize> {
        let fits = |c: &Channel| {
            let last = last(&c.info.path);
            last == name || split_name(last).0 == name
        };
        let mut found = (0..self.log.channels.len()).filter(|at| fits(&self.log.channels[*at]));
        let first = found.next()?;
        found.next().is_none().then_some(first)
    }

    fn missing(&self, role: &'static str, id: &str, wanted: &str) -> RecordingError {
        let columns: Vec<String> = self
            .log
            .channels
            .iter()
            .filter(|c| !matches!(c.values, Values::Opaque(_)))
            .map(|c| c.info.path.clone())
            .collect();
        let by_end = nearest(wanted, columns.iter().map(|c| last(c)))
            .and_then(|end| columns.iter().find(|c| last(c) == &*end))
            .map(|c| c.as_str().into());
        RecordingError::MissingColumn {
            log: self.log.source.as_str().into(),
            role,
            id: id.into(),
            wanted: format!("a channel named `{wanted}`").into(),
            nearest: nearest(wanted, columns.iter().map(String::as_str)).or(by_end),
            columns: columns.into(),
        }
    }
}

/// The last part of a path.
pub(crate) fn last(path: &str) -> &str {
    path.rsplit(['/', '.']).next().unwrap_or(path)
}

/// A column named by the path of its channel, with the unit that the file declares.
fn header(channel: &Channel) -> ColumnName {
    let (name, ending) = split_name(last(&channel.info.path));
    let declared = channel.info.unit.as_deref();
    let declared = declared.filter(|unit| parse(unit).is_ok());
    let ending = ending.map(naming::ending);
    ColumnName {
        text: channel.info.path.clone(),
        name: name.to_owned(),
        unit: declared.map(str::to_owned).or(ending),
    }
}

/// The number that stands for the value of a row: texts by their index.
fn cell(channel: &Channel, row: usize) -> f64 {
    match &channel.values {
        Values::Numbers(values) => values.get(row).copied().unwrap_or(f64::NAN),
        Values::Texts(texts) => texts.word(row).map_or(f64::NAN, |word| word as f64),
        Values::Opaque(_) => f64::NAN,
    }
}

/// A table of channels of the same number of rows.
fn rows(log: &Log, columns: &[usize], n: usize) -> Table {
    let channels: Vec<&Channel> = columns.iter().map(|at| &log.channels[*at]).collect();
    let mut values = Vec::with_capacity(n * channels.len());
    for row in 0..n {
        values.extend(channels.iter().map(|channel| cell(channel, row)));
    }
    Table {
        source: log.source.clone(),
        columns: channels.iter().map(|c| header(c)).collect(),
        runs: vec![TableRun {
            rows: values,
            ..TableRun::default()
        }],
        labels: labels(&channels),
        own_clocks: false,
        cut: log.cut.as_ref().map_or_else(String::new, cut),
        stamps: None,
    }
}

/// Where the file ends too early; none where it is whole.
pub(crate) fn cut(cut: &Cut) -> String {
    format!(
        "the file ends too early: {} at byte {} is cut",
        cut.what, cut.at
    )
}

fn labels(channels: &[&Channel]) -> BTreeMap<usize, Vec<String>> {
    let texts = channels.iter().enumerate();
    texts
        .filter_map(|(at, channel)| Some((at, channel.texts()?.words().to_vec())))
        .collect()
}

fn prepend_time(table: &mut Table, time: &[f64]) {
    let width = table.columns.len().max(1);
    for run in &mut table.runs {
        let old = std::mem::take(&mut run.rows);
        for (row, stamp) in old.chunks_exact(width).zip(time) {
            run.rows.push(*stamp);
            run.rows.extend(row);
        }
    }
    table.columns.insert(0, ColumnName::new(TIME));
    let labels = std::mem::take(&mut table.labels);
    table.labels = labels.into_iter().map(|(at, w)| (at + 1, w)).collect();
}

/// Channels without time stamps: all that have as many rows as those that are asked for.
fn side_by_side(log: &Log, wanted: &Wanted) -> Result<Table, RecordingError> {
    let all = wanted.all();
    let n = all.first().map_or(0, |at| log.channels[*at].values.len());
    if let Some(other) = all.iter().find(|at| log.channels[**at].values.len() != n) {
        let (first, other) = (&log.channels[all[0]], &log.channels[*other]);
        return Err(RecordingError::ChannelLengths {
            log: log.source.as_str().into(),
            first: first.info.path.as_str().into(),
            rows: n,
            second: other.info.path.as_str().into(),
            found: other.values.len(),
        });
    }
    let beside: Vec<usize> = (0..log.channels.len())
        .filter(|at| {
            let channel = &log.channels[*at];
            let there = all.is_empty() || channel.values.len() == n;
            there && !matches!(channel.values, Values::Opaque(_))
        })
        .collect();
    Ok(rows(log, &beside, n))
}

/// Channels with time stamps of their own, on all stamps of those that are asked for.
fn on_all_stamps(log: &Log, wanted: &Wanted) -> Table {
    let all = wanted.all();
    let channels: Vec<&Channel> = all.iter().map(|at| &log.channels[*at]).collect();
    let held: Vec<bool> = all
        .iter()
        .map(|at| wanted.held.contains(at) || wanted.run == Some(*at))
        .collect();
    let mut events: Vec<(f64, usize, f64)> = Vec::new();
    for (column, channel) in channels.iter().enumerate() {
        let time = log.time(channel).unwrap_or_default();
        let mut before = f64::NEG_INFINITY;
        for (row, stamp) in time.iter().enumerate() {
            let value = cell(channel, row);
            // A clock that goes back has nothing new to say.
            if *stamp >= before && !value.is_nan() {
                events.push((*stamp, column, value));
                before = *stamp;
            }
        }
    }
    events.sort_by(|a, b| a.0.total_cmp(&b.0));
    let state = wanted.run.and_then(|at| {
        let path = &log.channels[at].info.path;
        let column = all.iter().position(|c| *c == at)?;
        path.contains(SYSID_STATE).then_some(column)
    });
    let idle = |row: &[f64]| {
        let Some((column, value)) = state.and_then(|c| Some((c, *row.get(c)?))) else {
            return false;
        };
        let words = channels.get(column).and_then(|c| c.texts());
        let word = words.and_then(|t| t.words().get(value as usize));
        word.is_none_or(|word| NO_TEST.contains(&word.as_str()))
    };
    let mut now = vec![f64::NAN; channels.len()];
    let mut runs = vec![TableRun::default()];
    for group in events.chunk_by(|a, b| a.0 == b.0) {
        let mut news = false;
        for (column, value) in now.iter_mut().enumerate() {
            if held.get(column) == Some(&false) {
                *value = f64::NAN;
            }
        }
        for (_, column, value) in group {
            let is_held = held.get(*column) == Some(&true);
            if let Some(now) = now.get_mut(*column) {
                news |= !is_held || *now != *value;
                *now = *value;
            }
        }
        let known = now.iter().zip(&held).all(|(v, held)| !held || !v.is_nan());
        let resting = idle(&now);
        // A test that is made again is another run, however short the rest between the two was.
        if resting && runs.last().is_some_and(|run| !run.rows.is_empty()) {
            runs.push(TableRun::default());
        }
        let stamp = group.first().map(|(stamp, ..)| *stamp);
        let stamp = stamp.filter(|_| known && news && !resting);
        if let (Some(stamp), Some(run)) = (stamp, runs.last_mut()) {
            run.rows.push(stamp);
            run.rows.extend(&now);
        }
    }
    if runs.len() > 1 && runs.last().is_some_and(|run| run.rows.is_empty()) {
        runs.pop();
    }
    let mut columns = vec![ColumnName::new(TIME)];
    columns.extend(channels.iter().map(|c| header(c)));
    let labels = labels(&channels);
    Table {
        source: log.source.clone(),
        columns,
        runs,
        labels: labels.into_iter().map(|(at, w)| (at + 1, w)).collect(),
        own_clocks: true,
        cut: log.cut.as_ref().map_or_else(String::new, cut),
        stamps: None,
    }
}
