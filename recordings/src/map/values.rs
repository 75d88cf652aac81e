//! Values that a recording cannot have.

use super::{ABSURD, Mapper};
use crate::error::RecordingError;
use crate::plan::Link;
use crate::table::TableRun;

/// Stamps beyond this, s since 1970, are in another unit.
const NO_SECONDS: f64 = 1e11;

impl Mapper<'_> {
    /// Time stamps and inputs must be there.
    pub(super) fn check(
        &self,
        run: &TableRun,
        at: usize,
        link: Link,
        value: f64,
        role: &'static str,
    ) -> Result<(), RecordingError> {
        if value.is_nan() {
            return Err(RecordingError::MissingValue {
                log: self.table.source.as_str().into(),
                at: Box::new(self.table.location(run, at, link.column)),
                role,
            });
        }
        Ok(())
    }

    /// Milliseconds since 1970 or less, taken as seconds, are no times that anybody measured at.
    pub(super) fn seconds(
        &self,
        run: &TableRun,
        at: usize,
        stamp: f64,
    ) -> Result<(), RecordingError> {
        let unit = match stamp {
            s if (NO_SECONDS..NO_SECONDS * 1e3).contains(&s) => "ms",
            s if (NO_SECONDS * 1e3..NO_SECONDS * 1e6).contains(&s) => "us",
            s if (NO_SECONDS * 1e6..NO_SECONDS * 1e9).contains(&s) => "ns",
            _ => return Ok(()),
        };
        Err(RecordingError::NotSeconds {
            log: self.table.source.as_str().into(),
            at: Box::new(self.table.location(run, at, self.plan.time.column)),
            stamp,
            unit,
        })
    }

    pub(super) fn limit(
        &self,
        run: &TableRun,
        at: usize,
        link: Link,
        value: f64,
    ) -> Result<(), RecordingError> {
        // A NaN here is the difference of two infinite time stamps.
        if value.is_nan() || value.abs() >= ABSURD {
            return Err(RecordingError::AbsurdValue {
                log: self.table.source.as_str().into(),
                at: Box::new(self.table.location(run, at, link.column)),
                value,
                limit: ABSURD,
            });
        }
        Ok(())
    }
}
