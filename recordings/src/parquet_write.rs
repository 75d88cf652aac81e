//! Whole tables out as Parquet.

use std::path::Path;

use crate::error::RecordingError;
use crate::output::Written;

/// Writes a table, `rows` row by row, as Parquet: a missing value is null, the unit of a column is the metadata `unit`
/// of its field. Columns are names with their units. The file appears complete or not at all.
///
/// # Errors
///
/// [`RecordingError::Output`], [`RecordingError::RowWidth`] when `rows` is no whole number of rows, and
/// [`RecordingError::NotBuilt`] without the feature `all-formats`.
pub fn write_parquet(
    path: &Path,
    columns: &[(String, Option<String>)],
    rows: &[f64],
) -> Result<Written, RecordingError> {
    if columns.is_empty() || !rows.len().is_multiple_of(columns.len()) {
        return Err(RecordingError::RowWidth {
            path: path.to_owned(),
            expected: columns.len(),
            found: rows.len().checked_rem(columns.len()).unwrap_or(rows.len()),
        });
    }
    write(path, columns, rows)
}

#[cfg(feature = "all-formats")]
fn write(
    path: &Path,
    columns: &[(String, Option<String>)],
    rows: &[f64],
) -> Result<Written, RecordingError> {
    use crate::output::{OutputError, OutputFile};
    use loopsight_formats::OutColumn;

    let columns: Vec<OutColumn> = columns
        .iter()
        .map(|(name, unit)| OutColumn {
            name: name.clone(),
            unit: unit.clone(),
        })
        .collect();
    let mut out = OutputFile::create(path)?;
    loopsight_formats::write_parquet(&mut out, &columns, rows)
        .map_err(|e| OutputError::io(path, "write", &std::io::Error::other(e)))?;
    Ok(out.finish()?)
}

#[cfg(not(feature = "all-formats"))]
fn write(
    path: &Path,
    _: &[(String, Option<String>)],
    _: &[f64],
) -> Result<Written, RecordingError> {
    Err(RecordingError::NotBuilt {
        path: path.to_owned(),
    })
}
