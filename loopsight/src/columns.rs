//! Single columns of tables, and the numbers in them.

use std::path::Path;

use loopsight_core::unit;
use loopsight_model::config::nearest;
use loopsight_model::registry::BuildError;

/// The column `name` (with or without its unit) of the table at `path` over its time, in SI units;
/// rows without a value are left out.
pub(crate) fn read(path: &Path, name: &str) -> Result<Vec<[f64; 2]>, BuildError> {
    let wrong = |key: &str, why: String| BuildError::at(key, format!("{}: {why}", path.display()));
    let log = loopsight_recordings::read(path).map_err(|e| wrong("path", e.to_string()))?;
    let table = log.table();
    let find = |name: &str, key: &str| {
        let found = table.columns.iter().position(|c| c.text == name);
        let found = found.or_else(|| table.columns.iter().position(|c| c.name == name));
        found.ok_or_else(|| {
            let texts = table.column_texts();
            let why = format!(
                "there is no column `{name}`, expected one of {}",
                texts.join(", ")
            );
            let error = wrong(key, why);
            match nearest(name, texts.iter().map(String::as_str)) {
                Some(near) => error.help(format!("did you mean `{near}`?")),
                None => error,
            }
        })
    };
    let factor = |at: usize| {
        let unit = table.columns[at].unit.as_deref().map(unit::parse);
        unit.and_then(Result::ok).map_or(1.0, |u| u.factor)
    };
    let (time, value) = (find("time", "path")?, find(name, "column")?);
    let (second, si) = (factor(time), factor(value));
    let rows = table
        .runs
        .iter()
        .flat_map(|run| run.rows.chunks_exact(table.columns.len().max(1)));
    Ok(rows
        .map(|row| [row[time] * second, row[value] * si])
        .filter(|[_, value]| value.is_finite())
        .collect())
}

/// Without the digits that are rounding errors of a simulation.
pub(crate) fn rounded(value: f64) -> f64 {
    (value * 1e12).round() / 1e12
}
