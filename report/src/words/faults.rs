//! Faults of a log.

use loopsight_recordings::{Fault, Severity};

/// How much a fault matters, in a word: `fault`, `warning`, `note`.
pub fn severity(fault: &Fault) -> &'static str {
    match fault.severity() {
        Severity::Note => "note",
        Severity::Warning => "warning",
        Severity::Fatal => "fault",
    }
}

/// A fault: what it is, in which signal and run, and what was seen.
pub fn fault(fault: &Fault) -> String {
    let mut text = fault.kind.name().replace('_', " ");
    if !fault.signal.is_empty() {
        text.push_str(&format!(" `{}`", fault.signal));
    }
    if !fault.run.is_empty() {
        text.push_str(&format!(" in run {}", fault.run));
    }
    format!("{text}: {}", fault.detail)
}

/// A line for each fault, each with its line's end.
pub fn faults(faults: &[Fault]) -> String {
    faults
        .iter()
        .map(|one| format!("{}: {}\n", severity(one), fault(one)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use loopsight_recordings::FaultKind;

    #[test]
    fn a_fault_says_what_where_and_how_bad() {
        let mut one = Fault {
            kind: FaultKind::DeadSensor,
            run: String::new(),
            signal: "speed".into(),
            detail: "never moves".into(),
        };
        assert_eq!(
            faults(&[one.clone()]),
            "fault: dead sensor `speed`: never moves\n"
        );
        one.run = "3".into();
        one.kind = FaultKind::Gap;
        one.signal.clear();
        assert_eq!(faults(&[one]), "warning: gap in run 3: never moves\n");
    }
}
