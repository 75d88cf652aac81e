//! Sensors, inputs and whole logs that stand still.

use loopsight_model::run::Run;

use super::drive::Drive;
use super::{extent, moves, signal};
use crate::fault::{Fault, FaultKind};
use crate::map::{Recording, run_names};

pub(crate) fn check(recording: &Recording, inputs: &[&str]) -> Vec<Fault> {
    let runs = &recording.runs;
    let n = recording.measured.len();
    let any_moves = |run: &Run| (0..n).any(|s| moves(run, s));
    let driven = |run: &Run| (0..run.len()).any(|k| run.input(k).iter().any(|u| *u != 0.0));
    let mut found = Vec::new();
    let mut push = |kind, run: String, signal: &str, detail: String| {
        found.push(Fault {
            kind,
            run,
            signal: signal.into(),
            detail,
        });
    };

    let still: Vec<&str> = runs
        .iter()
        .filter(|run| !any_moves(run))
        .map(|run| run.name())
        .collect();
    if still.len() == runs.len() {
        let detail = if runs.iter().any(driven) {
            format!(
                "no measured signal ever changes, although the inputs act ({})",
                ids(recording)
            )
        } else {
            "no measured signal ever changes, and all inputs are zero".to_owned()
        };
        push(FaultKind::Motionless, String::new(), "", detail);
        return found;
    }
    if !still.is_empty() {
        let acting = runs
            .iter()
            .filter(|run| !any_moves(run))
            .filter(|run| driven(run))
            .count();
        let detail = format!(
            "no measured signal changes in {} of {} runs; in {acting} of them the inputs act",
            still.len(),
            runs.len()
        );
        push(
            FaultKind::Motionless,
            run_names(&still, runs.len()),
            "",
            detail,
        );
    }

    let moving: Vec<&Run> = runs.iter().filter(|run| any_moves(run)).collect();
    for (s, measured) in recording.measured.iter().enumerate() {
        let drive = Drive::of(measured, inputs);
        let constant: Vec<&&Run> = moving.iter().filter(|run| !moves(run, s)).collect();
        let values = extent(constant.iter().flat_map(|run| signal(run, s)));
        let value = match values {
            None => "has no sample".to_owned(),
            Some((low, high)) if low == high => format!("is {low} {}", measured.unit),
            Some(_) => "has one value in each run".to_owned(),
        };
        let acts = constant.iter().any(|run| drive.acts(run));
        let said = drive.describe(inputs);
        if constant.len() == moving.len() {
            if acts {
                let detail =
                    format!("never changes ({value}), although {said} acts and other signals move");
                push(FaultKind::DeadSensor, String::new(), &measured.id, detail);
            } else {
                let detail = format!("never changes ({value}); {said} is zero throughout, too");
                push(
                    FaultKind::ConstantSensor,
                    String::new(),
                    &measured.id,
                    detail,
                );
            }
        } else if acts {
            let names: Vec<&str> = constant
                .iter()
                .filter(|run| drive.acts(run))
                .map(|run| run.name())
                .collect();
            let detail = format!(
                "does not change there ({value}), although {said} acts and other signals move"
            );
            push(
                FaultKind::ConstantSensor,
                run_names(&names, runs.len()),
                &measured.id,
                detail,
            );
        }
    }

    for (i, id) in inputs.iter().enumerate() {
        let all = runs
            .iter()
            .flat_map(|run| (0..run.len()).map(move |k| run.input(k)[i]));
        if let Some((low, high)) = extent(all).filter(|(low, high)| low == high) {
            let same = if low == 0.0 { high } else { low };
            let detail = format!("is {same} from beginning to end: what it does cannot be learnt");
            push(FaultKind::ConstantInput, String::new(), id, detail);
        }
    }
    found
}

fn ids(recording: &Recording) -> String {
    recording
        .measured
        .iter()
        .map(|m| m.id.as_str())
        .collect::<Vec<_>>()
        .join(", ")
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{drive_log, kinds};
    use super::*;

    #[test]
    fn a_good_log_has_no_fault() {
        assert_eq!(kinds(&drive_log(|_, row| row)), []);
    }

    #[test]
    fn a_dead_encoder() {
        let log = drive_log(|_, [t, ur, ul, r, _]| [t, ur, ul, r, 0.25]);
        assert_eq!(kinds(&log), [(FaultKind::DeadSensor, "track_speed_left")]);
        assert!(
            log.faults[0].detail.contains("is 0.25 m/s"),
            "{}",
            log.faults[0]
        );
        assert_eq!(log.faults[0].severity(), crate::Severity::Fatal);
    }

    #[test]
    fn a_sensor_without_drive_is_excused() {
        let log = drive_log(|_, [t, ur, _, r, _]| [t, ur, 0.0, r, 0.0]);
        assert_eq!(
            kinds(&log),
            [
                (FaultKind::ConstantSensor, "track_speed_left"),
                (FaultKind::ConstantInput, "voltage_left")
            ]
        );
        assert_ne!(log.faults[0].severity(), crate::Severity::Fatal);
    }

    #[test]
    fn a_sensor_that_is_dead_in_one_run() {
        let log =
            drive_log(|run, [t, ur, ul, r, l]| [t, ur, ul, r, if run == 1 { 0.0 } else { l }]);
        assert_eq!(
            kinds(&log),
            [(FaultKind::ConstantSensor, "track_speed_left")]
        );
        assert_eq!(log.faults[0].run, "b");
    }

    #[test]
    fn a_drive_that_begins_with_the_last_sample_has_no_answer_yet() {
        let starts_at = |first: f64| {
            drive_log(move |run, row @ [t, ur, ul, r, _]| match run {
                1 => [t, ur, if t < first { 0.0 } else { ul + 1.0 }, r, 0.0],
                _ => row,
            })
        };
        let end = drive_log(|_, row| row).runs[1]
            .time()
            .last()
            .copied()
            .unwrap();
        assert_eq!(kinds(&starts_at(end - 1e-6)), []);
        assert_eq!(
            kinds(&starts_at(end / 2.0)),
            [(FaultKind::ConstantSensor, "track_speed_left")]
        );
    }

    #[test]
    fn nothing_moves() {
        let log = drive_log(|_, [t, ur, ul, _, _]| [t, ur, ul, 1.0, 2.0]);
        assert_eq!(kinds(&log), [(FaultKind::Motionless, "")]);
        assert!(log.faults[0].detail.contains("although the inputs act"));
        let log = drive_log(|_, [t, ..]| [t, 0.0, 0.0, 0.0, 0.0]);
        assert!(log.faults[0].detail.contains("all inputs are zero"));
        let log = drive_log(|run, row| {
            if run == 0 {
                row
            } else {
                [row[0], 1.0, 1.0, 0.0, 0.0]
            }
        });
        assert_eq!(kinds(&log), [(FaultKind::Motionless, "")]);
        assert_eq!(
            (log.faults[0].run.as_str(), log.faults[0].severity()),
            ("b", crate::Severity::Warning)
        );
    }
}
