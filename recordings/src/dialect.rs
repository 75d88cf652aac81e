//! How a text of numbers is written: what separates its fields, and whether it names them.

use std::borrow::Cow;

use crate::naming;
use crate::stamp::Instant;

/// Lines that decide.
const LOOKED_AT: usize = 5;

/// Lines with content.
fn lines(text: &str) -> impl Iterator<Item = &str> {
    let full = |line: &&str| !line.trim().is_empty() && !line.starts_with('#');
    text.lines().filter(full)
}

/// What a spreadsheet says of its separator: `sep=;`.
pub(crate) fn said(line: &str) -> Option<u8> {
    let (key, value) = line.split_at_checked(4)?;
    let value = value.trim_matches(['"', '\r']);
    let right = key.eq_ignore_ascii_case("sep=") && value.len() == 1;
    right.then(|| value.bytes().next()).flatten()
}

/// The separator: what the first line has most of, unless that is the comma of decimals.
pub(crate) fn delimiter(text: &str) -> u8 {
    let first: Vec<&str> = lines(text).take(LOOKED_AT).collect();
    let Some(header) = first.first() else {
        return b',';
    };
    if let Some(said) = said(header) {
        return said;
    }
    let count = |line: &str, d: u8| line.bytes().filter(|b| *b == d).count();
    // `max_by_key` takes the last of equals: the comma.
    let most = [b'\t', b';', b',']
        .into_iter()
        .max_by_key(|d| count(header, *d));
    let steady = |d: &u8| {
        count(header, *d) > 0
            && first
                .iter()
                .all(|line| count(line, *d) == count(header, *d))
    };
    match most {
        Some(b',') | None if decimals_only(header) => {
            [b'\t', b';'].into_iter().find(steady).unwrap_or(b',')
        }
        Some(most) => most,
        None => b',',
    }
}

/// Whether every comma of a line stands between two digits.
fn decimals_only(line: &str) -> bool {
    let bytes = line.as_bytes();
    let digit = |at: Option<usize>| {
        at.and_then(|at| bytes.get(at))
            .is_some_and(u8::is_ascii_digit)
    };
    let between = |at: usize| digit(at.checked_sub(1)) && digit(at.checked_add(1));
    line.match_indices(',').all(|(at, _)| between(at))
}

/// Columns between which there are only spaces, as tables of plotting programs have them, with one tab each.
pub(crate) fn tabs_for_spaces(text: &str) -> Cow<'_, str> {
    let mut found = lines(text);
    let (header, row) = (
        found.next().unwrap_or_default(),
        found.next().unwrap_or_default(),
    );
    let bare = |line: &str| !line.contains([',', ';', '\t', '"']);
    let n = row.split_whitespace().count();
    let numbers = row
        .split_whitespace()
        .all(|word| word.parse::<f64>().is_ok());
    if n < 2 || !numbers || !bare(header) || !bare(row) || header.split_whitespace().count() != n {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len());
    for line in text.split_inclusive('\n') {
        match line.starts_with('#') {
            true => out.push_str(line),
            false => {
                for (at, word) in line.split_whitespace().enumerate() {
                    out.push_str(if at > 0 { "\t" } else { "" });
                    out.push_str(word);
                }
                out.push_str(if line.ends_with('\n') { "\n" } else { "" });
            }
        }
    }
    Cow::Owned(out)
}

/// The number that a field is; NaN: it is empty or says that the value is missing.
pub(crate) fn number(field: &str, delimiter: u8) -> Option<f64> {
    if ["", "na", "n/a", "null", "none"]
        .iter()
        .any(|m| field.eq_ignore_ascii_case(m))
    {
        return Some(f64::NAN);
    }
    match field.parse() {
        Ok(value) => Some(value),
        // Decimal commas, where the comma does not separate.
        Err(_) if delimiter != b',' => field.replacen(',', ".", 1).parse().ok(),
        Err(_) => None,
    }
}

/// Whether a first line names nothing: it holds numbers, and times perhaps.
pub(crate) fn is_data(record: &csv::StringRecord, delimiter: u8) -> bool {
    let value = |field: &str| number(field, delimiter);
    let any = record
        .iter()
        .any(|field| value(field).is_some_and(|v| !v.is_nan()));
    let fits = |field: &str| value(field).is_some() || Instant::of(field).is_some();
    any && record.iter().all(fits)
}

/// The units that stand below the names: `(ms)`, `V`, and nothing for what has none.
pub(crate) fn units(record: &csv::StringRecord) -> Option<Vec<Option<String>>> {
    let bare = |field: &str| field.trim_matches(['(', ')', '[', ']']).trim().to_owned();
    let units = record.iter().map(|field| match bare(field).as_str() {
        "" | "-" => Some(None),
        unit if naming::is_unit(unit) && number(unit, b',').is_none() => {
            Some(Some(unit.to_owned()))
        }
        _ => None,
    });
    let units: Vec<Option<String>> = units.collect::<Option<_>>()?;
    units.iter().any(Option::is_some).then_some(units)
}
