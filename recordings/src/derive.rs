//! Columns that a model's `[log]` makes of others: sums, differences, and parts of the rows.

use std::borrow::Cow;

use loopsight_core::unit::{conversion, parse};
use loopsight_model::log_map::{LogMap, Ranges};

use crate::error::RecordingError;
use crate::plan::{Link, find, missing};
use crate::table::{ColumnName, Table, TableRun};

/// The names in `right - left + offset`, with their signs; none where it is one name.
pub(crate) fn terms(name: &str) -> Option<Vec<(f64, &str)>> {
    let name = name.trim();
    let (mut sign, mut rest) = match name.strip_prefix("-") {
        Some(rest) => (-1.0, rest.trim_start()),
        None => (1.0, name),
    };
    let mut found = Vec::new();
    loop {
        let plus = rest.find(" + ");
        let minus = rest.find(" - ");
        let next = match (plus, minus) {
            (Some(p), Some(m)) => Some(p.min(m)),
            (p, m) => p.or(m),
        };
        let Some(at) = next else { break };
        found.push((sign, rest[..at].trim()));
        sign = if plus == Some(at) { 1.0 } else { -1.0 };
        rest = rest[at + 3..].trim_start();
    }
    found.push((sign, rest.trim()));
    let several = found.len() > 1 || sign < 0.0;
    (several && found.iter().all(|(_, name)| !name.is_empty())).then_some(found)
}

/// The sum as it stands in a model file.
pub(crate) fn text(terms: &[(f64, String)]) -> String {
    let mut out = String::new();
    for (at, (sign, name)) in terms.iter().enumerate() {
        out.push_str(match (at, *sign < 0.0) {
            (0, false) => "",
            (0, true) => "-",
            (_, false) => " + ",
            (_, true) => " - ",
        });
        out.push_str(name);
    }
    out
}

/// The sums and differences that a map names and a table does not have as columns.
pub(crate) fn wanted<'m>(table: &Table, map: &'m LogMap) -> Vec<(&'static str, &'m str, &'m str)> {
    let inputs = map
        .inputs
        .iter()
        .map(|(id, c)| ("the input", id.as_str(), c.name()));
    let measured = map
        .measured
        .iter()
        .filter_map(|(id, m)| Some(("the measured signal", id.as_str(), m.column.as_deref()?)));
    let all = inputs.chain(measured);
    all.filter(|(_, _, name)| find(table, name).is_none() && terms(name).is_some())
        .collect()
}

impl Table {
    /// Adds the column that a sum of others is, in the unit of the first.
    pub(crate) fn add_sum(
        &mut self,
        (role, id, name): (&'static str, &str, &str),
    ) -> Result<(), RecordingError> {
        if self.columns.iter().any(|c| c.text == name) {
            return Ok(());
        }
        let mut columns: Vec<(usize, f64)> = Vec::new();
        let mut unit: Option<(String, String)> = None;
        for (sign, term) in terms(name).unwrap_or_default() {
            let Some((at, ending)) = find(self, term) else {
                return Err(missing(
                    self,
                    role,
                    id,
                    format!("a column named `{term}`"),
                    term,
                ));
            };
            if let Some(words) = self.labels.get(&at) {
                return Err(self.text_column(at, id, words));
            }
            let own = ending.or(self.columns[at].unit.as_deref());
            let factor = match (&unit, own) {
                (Some((_, first)), Some(own)) => self.factor(at, own, id, first)?,
                _ => 1.0,
            };
            if let (None, Some(own)) = (&unit, own) {
                unit = Some((term.to_owned(), own.to_owned()));
            }
            columns.push((at, sign * factor));
        }
        let width = self.columns.len().max(1);
        for run in &mut self.runs {
            let rows = std::mem::take(&mut run.rows);
            for row in rows.chunks_exact(width) {
                run.rows.extend(row);
                run.rows
                    .push(columns.iter().map(|(at, factor)| factor * row[*at]).sum());
            }
        }
        self.columns.push(ColumnName {
            text: name.to_owned(),
            name: name.to_owned(),
            unit: unit.map(|(_, unit)| unit),
        });
        Ok(())
    }

    /// What makes a value of one column one in the unit of another.
    fn factor(&self, at: usize, own: &str, id: &str, first: &str) -> Result<f64, RecordingError> {
        if own == first {
            return Ok(1.0);
        }
        let unit = |text: &str| {
            parse(text).map_err(|error| RecordingError::BadUnit {
                log: self.source.as_str().into(),
                column: self.columns[at].text.as_str().into(),
                unit: text.into(),
                error,
            })
        };
        let (found, expected) = (unit(own)?, unit(first)?);
        conversion(&found, &expected).ok_or_else(|| RecordingError::UnitMismatch {
            log: self.source.as_str().into(),
            column: self.columns[at].text.as_str().into(),
            unit: own.into(),
            found: found.dimension,
            id: id.into(),
            expected_unit: first.into(),
            expected: expected.dimension,
        })
    }

    /// The rows that `[log]` asks for: each part a run of its own.
    pub(crate) fn parts(
        &self,
        time: Link,
        map: &LogMap,
    ) -> Result<Cow<'_, [TableRun]>, RecordingError> {
        if map.rows.is_empty() && map.times_s.is_empty() {
            return Ok(Cow::Borrowed(&self.runs));
        }
        if !map.rows.is_empty() && self.own_clocks {
            return Err(RecordingError::RowsOfClocks {
                log: self.source.as_str().into(),
            });
        }
        let mut before = 0;
        let numbers: Vec<std::ops::Range<usize>> = (self.runs.iter())
            .map(|run| {
                let n = self.rows(run).count();
                before += n;
                before - n..before
            })
            .collect();
        let row_number = |run: usize, row: usize, _: &[f64]| (numbers[run].start + row + 1) as f64;
        let stamp = |_: usize, _: usize, row: &[f64]| row[time.column] * time.factor;
        let by_rows = self.cut(&self.runs, "rows", &map.rows, row_number)?;
        let cut = self.cut(&by_rows, "times_s", &map.times_s, stamp)?;
        Ok(Cow::Owned(cut))
    }

    fn cut(
        &self,
        runs: &[TableRun],
        key: &'static str,
        ranges: &Ranges,
        place: impl Fn(usize, usize, &[f64]) -> f64,
    ) -> Result<Vec<TableRun>, RecordingError> {
        if ranges.is_empty() {
            return Ok(runs.to_vec());
        }
        let mut out = Vec::new();
        for (from, to) in ranges.parts() {
            let before = out.len();
            for (number, run) in runs.iter().enumerate() {
                let mut part = TableRun {
                    name: run.name.clone(),
                    ..TableRun::default()
                };
                if ranges.parts().len() > 1 {
                    let what = if key == "rows" { "rows " } else { "" };
                    let unit = if key == "rows" { "" } else { " s" };
                    let label = format!("{what}{from} to {to}{unit}");
                    part.name = format!("{} {label}", run.name).trim().to_owned();
                }
                for (at, row) in self.rows(run).enumerate() {
                    let here = place(number, at, row);
                    if (*from..=*to).contains(&here) {
                        part.rows.extend(row);
                        part.lines.extend(run.line(at));
                    }
                }
                part.first_line = part.lines.first().copied().unwrap_or(0);
                if !part.rows.is_empty() {
                    out.push(part);
                }
            }
            if out.len() == before {
                let all = runs.iter().enumerate().flat_map(|(number, run)| {
                    let place = &place;
                    self.rows(run)
                        .enumerate()
                        .map(move |(at, row)| place(number, at, row))
                });
                let span = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
                    (low.min(v), high.max(v))
                });
                return Err(RecordingError::EmptyPart {
                    log: self.source.as_str().into(),
                    key,
                    from: *from,
                    to: *to,
                    span,
                });
            }
        }
        Ok(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_signs() {
        assert_eq!(terms("right"), None);
        assert_eq!(terms("a-b"), None);
        assert_eq!(
            terms("right - left + c"),
            Some(vec![(1.0, "right"), (-1.0, "left"), (1.0, "c")])
        );
        assert_eq!(terms("-u"), Some(vec![(-1.0, "u")]));
        assert_eq!(terms("a + "), None);
        let own: Vec<(f64, String)> = vec![(-1.0, "a".into()), (1.0, "b".into())];
        assert_eq!(text(&own), "-a + b");
        assert_eq!(terms(&text(&own)), Some(vec![(-1.0, "a"), (1.0, "b")]));
    }
}
