//! Which column is which signal, and the factor that makes it SI.

use loopsight_core::Signal;
use loopsight_core::unit::{Unit, conversion, parse};
use loopsight_model::log_map::LogMap;

use crate::error::RecordingError;
use crate::fault::{Fault, FaultKind};
use crate::map::MappedSignal;
use crate::names::nearest;
use crate::naming;
use crate::table::{ColumnName, Table};

/// A column and how it becomes the SI unit of its signal: `value · factor + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Link {
    pub(crate) column: usize,
    pub(crate) factor: f64,
    pub(crate) offset: f64,
}

impl Link {
    /// A value of the column in SI.
    pub(crate) fn si(self, value: f64) -> f64 {
        value * self.factor + self.offset
    }
}

/// Everything a model takes from a log.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Plan {
    pub(crate) time: Link,
    pub(crate) run: Option<usize>,
    /// Inputs with their columns; none for one that is optional and not logged.
    pub(crate) inputs: Vec<(Option<Link>, String)>,
    pub(crate) measured: Vec<(Link, MappedSignal)>,
    pub(crate) notes: Vec<Fault>,
}

/// What the model file says of one signal.
#[derive(Clone, Copy, Default)]
struct Wish<'m> {
    column: Option<&'m str>,
    unit: Option<&'m str>,
    scale: Option<f64>,
    scale_unit: Option<&'m str>,
    offset: f64,
}

impl Plan {
    /// The columns of the inputs that are logged.
    pub(crate) fn input_columns(&self) -> impl Iterator<Item = usize> + '_ {
        let logged = self.inputs.iter().filter_map(|(link, _)| link.as_ref());
        logged.map(|link| link.column)
    }

    pub(crate) fn new(
        table: &Table,
        inputs: &[Signal],
        signals: &[Signal],
        map: &LogMap,
    ) -> Result<Self, RecordingError> {
        known("log.inputs", map.inputs.keys(), inputs)?;
        known("log.measured", map.measured.keys(), signals)?;
        let mut finder = Finder {
            table,
            notes: Vec::new(),
        };
        let time = finder.time(map)?;
        let run = match &map.run {
            Some(name) => Some(find(table, name).map(|(column, _)| column).ok_or_else(|| {
                missing(
                    table,
                    "the run",
                    name,
                    format!("a column named `{name}`"),
                    name,
                )
            })?),
            None => table.columns.iter().position(|c| c.text == "run"),
        };
        let mut input_links = Vec::new();
        for signal in inputs {
            let wish = map
                .inputs
                .get(signal.id)
                .map_or_else(Wish::default, |c| Wish {
                    column: Some(c.name()),
                    unit: c.unit(),
                    scale: Some(c.scale()),
                    scale_unit: c.scale_unit(),
                    offset: c.offset(),
                });
            let absent = signal.optional && find(table, wish.column.unwrap_or(signal.id)).is_none();
            let link = match absent {
                true => None,
                false => Some(finder.signal("the input", signal, wish)?),
            };
            input_links.push((link, signal.id.to_owned()));
        }
        let mut measured = Vec::new();
        for signal in signals {
            let entry = map.measured.get(signal.id);
            let wanted = match entry {
                Some(_) => true,
                // Without a list: whatever the log has, but no input twice.
                None => {
                    map.measured.is_empty()
                        && !inputs.iter().any(|input| input.id == signal.id)
                        && find(table, signal.id).is_some()
                }
            };
            if !wanted {
                continue;
            }
            let wish = entry.map_or_else(Wish::default, |m| Wish {
                column: m.column.as_deref(),
                unit: m.unit.as_deref(),
                scale: m.scale,
                scale_unit: m.scale_unit.as_deref(),
                offset: m.offset.unwrap_or(0.0),
            });
            let link = finder.signal("the measured signal", signal, wish)?;
            let measured_signal = MappedSignal {
                id: signal.id.to_owned(),
                unit: signal.unit.to_owned(),
                sensor: entry.map(|m| m.sensor.clone()).unwrap_or_default(),
            };
            measured.push((link, measured_signal));
        }
        if measured.is_empty() {
            return Err(RecordingError::NothingMeasured {
                log: table.source.as_str().into(),
                signals: signals.iter().map(|s| s.id.to_owned()).collect(),
                columns: table.column_texts().into(),
            });
        }
        Ok(Self {
            time,
            run,
            inputs: input_links,
            measured,
            notes: finder.notes,
        })
    }
}

fn known<'m>(
    table: &'static str,
    ids: impl Iterator<Item = &'m String>,
    signals: &[Signal],
) -> Result<(), RecordingError> {
    for id in ids {
        if !signals.iter().any(|s| s.id == id) {
            return Err(RecordingError::UnknownSignal {
                table,
                id: id.as_str().into(),
                nearest: nearest(id, signals.iter().map(|s| s.id)),
                known: signals.iter().map(|s| s.id.to_owned()).collect(),
            });
        }
    }
    Ok(())
}

/// The column of this name, with the rest of its header as the unit: the whole header first,
/// then the name, an underscore and anything that is a unit, then the name with a unit in brackets, at
/// last the one that differs in small and large letters or spaces only.
pub(crate) fn find<'t>(table: &'t Table, name: &str) -> Option<(usize, Option<&'t str>)> {
    if let Some(at) = table.columns.iter().position(|c| c.text == name) {
        return Some((at, None));
    }
    let columns = || table.columns.iter().enumerate();
    let ending = columns().find_map(|(at, column)| {
        let unit = column.text.strip_prefix(name)?.strip_prefix('_')?;
        let split = column.unit.as_deref().filter(|_| column.name == name);
        naming::is_unit(unit).then_some((at, split.or(Some(unit))))
    });
    let named = || {
        let fits = |(_, c): &(usize, &ColumnName)| c.unit.is_some() && c.name == name;
        columns().find(fits).map(|(at, c)| (at, c.unit.as_deref()))
    };
    let alike = || {
        let wanted = naming::plain(name);
        let fits = |(_, c): &(usize, &ColumnName)| naming::plain(&c.name) == wanted;
        let mut found = columns().filter(fits);
        let (at, column) = found.next()?;
        found
            .next()
            .is_none()
            .then_some((at, column.unit.as_deref()))
    };
    ending.or_else(named).or_else(alike)
}

/// No column is what something needs; the nearest is named by names, and shown by its header.
pub(crate) fn missing(
    table: &Table,
    role: &'static str,
    id: &str,
    wanted: String,
    like: &str,
) -> RecordingError {
    let columns = &table.columns;
    let texts = columns.iter().map(|c| c.text.as_str());
    let by_name = nearest(like, columns.iter().map(|c| c.name.as_str()))
        .and_then(|name| columns.iter().find(|c| c.name == *name))
        .map(|c| c.text.as_str().into());
    RecordingError::MissingColumn {
        log: table.source.as_str().into(),
        role,
        id: id.into(),
        wanted: wanted.into(),
        nearest: by_name.or_else(|| nearest(like, texts)),
        columns: table.column_texts().into(),
    }
}

struct Finder<'t> {
    table: &'t Table,
    notes: Vec<Fault>,
}

impl Finder<'_> {
    fn signal(
        &mut self,
        role: &'static str,
        signal: &Signal,
        wish: Wish<'_>,
    ) -> Result<Link, RecordingError> {
        let name = wish.column.unwrap_or(signal.id);
        let (column, ending) = find(self.table, name).ok_or_else(|| {
            let wanted = match wish.column {
                Some(name) => format!("the model's [log] says `{name}`"),
                None => format!("expected `{}`", crate::header(signal)),
            };
            missing(self.table, role, signal.id, wanted, name)
        })?;
        let header = self.table.columns.get(column);
        // A header that is the id itself has no unit to it; one named in the model file may.
        let split = header
            .filter(|h| h.text != signal.id)
            .and_then(|h| h.unit.as_deref());
        // One that is nothing but a unit of the signal is in it: `RPM`.
        let expected = parse(signal.unit).ok().map(|unit| unit.dimension);
        let named = header.and_then(|header| {
            let mut texts = [header.text.clone(), header.text.to_lowercase()].into_iter();
            texts.find(|text| parse(text).is_ok_and(|unit| Some(unit.dimension) == expected))
        });
        let unit = wish.unit.or(ending).or(split).or(named.as_deref());
        let link = self.link(
            column,
            signal.id,
            signal.unit,
            unit,
            (wish.scale.unwrap_or(1.0), wish.scale_unit),
        )?;
        Ok(Link {
            offset: link.offset + wish.offset,
            ..link
        })
    }

    fn time(&mut self, map: &LogMap) -> Result<Link, RecordingError> {
        let wanted = "a column such as `time_s`, or `period_s` in the model's [log]".to_owned();
        if let Some(time) = &map.time {
            let (column, ending) = find(self.table, time.name())
                .ok_or_else(|| missing(self.table, "the time", "time", wanted, time.name()))?;
            let split = self
                .table
                .columns
                .get(column)
                .and_then(|c| c.unit.as_deref());
            return self.link(
                column,
                "time",
                "s",
                time.unit().or(ending).or(split),
                (time.scale(), time.scale_unit()),
            );
        }
        let columns = &self.table.columns;
        let is_time = naming::is_time;
        let with_unit = columns.iter().position(|c| {
            is_time(&c.name) && c.unit.as_deref().is_some_and(naming::is_unit_of_time)
        });
        let column = with_unit
            .or_else(|| {
                columns
                    .iter()
                    .position(|c| is_time(&c.text) && c.unit.is_none())
            })
            .or(self.table.stamps)
            .ok_or_else(|| missing(self.table, "the time", "time", wanted, "time_s"))?;
        let unit = columns.get(column).and_then(|c| c.unit.as_deref());
        self.link(column, "time", "s", unit, (1.0, None))
    }

    fn link(
        &mut self,
        column: usize,
        id: &str,
        si: &str,
        unit: Option<&str>,
        (scale, scale_unit): (f64, Option<&str>),
    ) -> Result<Link, RecordingError> {
        let header = self
            .table
            .columns
            .get(column)
            .map_or_else(String::new, |c| c.text.clone());
        if !scale.is_finite() || scale == 0.0 {
            return Err(RecordingError::BadScale {
                column: header.into(),
                scale,
            });
        }
        if let Some(words) = self.table.labels.get(&column) {
            return Err(self.table.text_column(column, id, words));
        }
        let expected = self.unit(id, si)?;
        let kelvin = self.unit(id, "K")?.dimension;
        let scale_of = |text| naming::temperature(text, expected.dimension == kelvin);
        if let Some((degree, zero)) = unit.and_then(scale_of)
            && scale_unit.is_none()
        {
            if expected.dimension != kelvin {
                return Err(RecordingError::UnitMismatch {
                    log: self.table.source.as_str().into(),
                    column: header.as_str().into(),
                    unit: unit.unwrap_or_default().into(),
                    found: kelvin,
                    id: id.into(),
                    expected_unit: si.into(),
                    expected: expected.dimension,
                });
            }
            return Ok(Link {
                column,
                factor: degree * scale / expected.factor,
                offset: zero * scale / expected.factor,
            });
        }
        // What a transducer has a gain for is a plain number where the column does not say more.
        let given = unit.or(scale_unit.map(|_| "1"));
        let factor = match given {
            Some(text) => {
                let mut found = self.unit(&header, text)?;
                let mut text = text.to_owned();
                if let Some(gain) = scale_unit {
                    found = found.times(self.unit(&header, gain)?, 1).unwrap_or(found);
                    text = format!("{text} times {gain}");
                }
                conversion(&found, &expected).ok_or_else(|| RecordingError::UnitMismatch {
                    log: self.table.source.as_str().into(),
                    column: header.as_str().into(),
                    unit: text.into(),
                    found: found.dimension,
                    id: id.into(),
                    expected_unit: si.into(),
                    expected: expected.dimension,
                })?
            }
            None => {
                if !expected.dimension.is_one() {
                    let mut detail =
                        format!("the column `{header}` does not say its unit; taken as {si}");
                    if si == "rad" && scale == 1.0 && self.is_counted(column) {
                        detail += ". It holds whole numbers alone, as counts do: of counts say `unit = \"rev\"`, and as \
                                   `scale` one over the counts in a turn";
                    }
                    self.notes.push(Fault {
                        kind: FaultKind::UnitAssumed,
                        run: String::new(),
                        signal: id.into(),
                        detail,
                    });
                }
                1.0
            }
        };
        if let (Some(unit), None) = (unit, scale_unit) {
            self.check_scale(&header, id, (unit, si), factor, scale);
        }
        Ok(Link {
            column,
            factor: factor * scale,
            offset: 0.0,
        })
    }

    /// Tells of a `scale` that is the `factor` from a column's unit to that of the model: whoever gives it does not expect that the
    /// unit is known. It may be rounded to three digits.
    fn check_scale(
        &mut self,
        header: &str,
        id: &str,
        (unit, si): (&str, &str),
        factor: f64,
        scale: f64,
    ) {
        let is_one = (factor - 1.0).abs() < 1e-3;
        if !is_one && (scale / factor - 1.0).abs() < 1e-3 {
            let detail = format!(
                "the column `{header}` is in {unit}, and becomes {si} by itself; a `scale` of {scale} makes that of it once more: leave it \
                 out, or say `unit = \"{si}\"`"
            );
            self.notes.push(Fault {
                kind: FaultKind::ScaledTwice,
                run: String::new(),
                signal: id.into(),
                detail,
            });
        }
    }

    /// Whether a column changes and holds nothing but whole numbers, which no angle in radians does.
    fn is_counted(&self, column: usize) -> bool {
        let width = self.table.columns.len().max(1);
        let rows = self.table.runs.iter().flat_map(|run| run.rows.iter());
        let mut values = rows.skip(column).step_by(width).filter(|v| v.is_finite());
        let Some(first) = values.next() else {
            return false;
        };
        let mut changes = false;
        first.fract() == 0.0
            && values.all(|v| {
                changes |= v != first;
                v.fract() == 0.0
            })
            && changes
    }

    fn unit(&self, column: &str, unit: &str) -> Result<Unit, RecordingError> {
        parse(unit).map_err(|error| RecordingError::BadUnit {
            log: self.table.source.as_str().into(),
            column: column.into(),
            unit: unit.into(),
            error,
        })
    }
}
