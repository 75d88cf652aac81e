//! A place in a log.

use std::fmt;

/// Where in a log a value stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Location {
    /// Line of the file, from 1, where the format has lines.
    pub line: Option<usize>,
    /// Run, where they have names.
    pub run: String,
    /// Row within the run, from 1.
    pub row: usize,
    /// Header of the column.
    pub column: String,
    /// Number of the column, from 1.
    pub column_number: usize,
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.line, self.run.as_str()) {
            (Some(line), _) => write!(f, "line {line}")?,
            (None, "") => write!(f, "row {}", self.row)?,
            (None, run) => write!(f, "run `{run}`, row {}", self.row)?,
        }
        write!(f, ", column {} (`{}`)", self.column_number, self.column)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_location_has_a_line_or_a_row() {
        let mut at = Location {
            line: Some(7),
            run: String::new(),
            row: 6,
            column: "u_V".into(),
            column_number: 2,
        };
        assert_eq!(at.to_string(), "line 7, column 2 (`u_V`)");
        at.line = None;
        at.run = "slow".into();
        assert_eq!(at.to_string(), "run `slow`, row 6, column 2 (`u_V`)");
    }
}
