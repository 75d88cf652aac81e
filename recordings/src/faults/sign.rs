//! Signals with the wrong sign: velocities that run against what drives them.

use loopsight_core::unit::parse;

use super::drive::{Drive, is_coordinate, side};
use super::{large, signal};
use crate::fault::{Fault, FaultKind};
use crate::map::{MappedSignal, Recording};

/// Samples count when drive and velocity are both above this share of their large values: clear of
/// friction, noise and the moment of reversal.
const CLEAR: f64 = 0.2;
/// So many of them must be there,
const ENOUGH: usize = 50;
/// and this share of them must disagree. Inertia alone makes half of them disagree at worst.
const DISAGREE: f64 = 0.9;
/// Correlation of a velocity with the change of a position over two samples from which it is that position's: the counts of a
/// coarse encoder leave about so much of it.
const AGREES: f64 = 0.3;

pub(crate) fn check(recording: &Recording, inputs: &[&str]) -> Vec<Fault> {
    let mut found = Vec::new();
    let velocities: Vec<(usize, &MappedSignal)> = recording
        .measured
        .iter()
        .enumerate()
        .filter(|(_, m)| is_velocity(&m.unit) && !is_coordinate(&m.id))
        .collect();
    for (s, measured) in &velocities {
        let drive = Drive::of(measured, inputs);
        if drive == Drive::Any {
            continue;
        }
        let drives = recording
            .runs
            .iter()
            .flat_map(|run| (0..run.len()).map(move |k| drive.at(run, k)))
            .collect::<Vec<_>>();
        let values = recording
            .runs
            .iter()
            .flat_map(|run| signal(run, *s))
            .collect::<Vec<_>>();
        if let Some(share) = disagreement(&drives, &values) {
            let what = drive.describe(inputs);
            let with = position_of(recording, *s, values.iter().copied());
            found.push(reversed(&measured.id, &what, share, with));
        }
    }
    // One input for both sides: the sides tell on each other.
    if inputs.len() == 1 && found.is_empty() {
        for (s, left) in &velocities {
            let (is_right, stem) = side(&left.id);
            let partner = velocities
                .iter()
                .find(|(_, m)| side(&m.id) == (Some(true), stem.clone()));
            let (Some(false), Some((r, right))) = (is_right, partner) else {
                continue;
            };
            let values = |s: usize| {
                recording
                    .runs
                    .iter()
                    .flat_map(move |run| signal(run, s))
                    .collect::<Vec<_>>()
            };
            if let Some(share) = disagreement(&values(*r), &values(*s)) {
                let what = format!("`{}`", right.id);
                found.push(reversed(&left.id, &what, share, None));
            }
        }
    }
    found
}

/// The position that a velocity is the change of, where that is measured, too.
fn position_of(
    recording: &Recording,
    velocity: usize,
    values: impl Iterator<Item = f64> + Clone,
) -> Option<&str> {
    let of = parse(&recording.measured.get(velocity)?.unit)
        .ok()?
        .dimension;
    let is_position = |m: &MappedSignal| {
        parse(&m.unit).is_ok_and(|unit| {
            let d = unit.dimension;
            (d.metre, d.radian, d.second) == (of.metre, of.radian, 0)
        })
    };
    let mut positions = (recording.measured.iter().enumerate()).filter(|(_, m)| is_position(m));
    let (p, position) = positions.next()?;
    if positions.next().is_some() {
        return None;
    }
    // The change over a sample before and a sample behind.
    let changes = recording.runs.iter().flat_map(|run| {
        let x: Vec<f64> = signal(run, p).collect();
        let change = move |k: usize| x.get(k + 1).unwrap_or(&x[k]) - x[k.saturating_sub(1)];
        (0..run.len()).map(change).collect::<Vec<_>>()
    });
    let pairs = changes.zip(values);
    let (mut cross, mut of_change, mut of_value) = (0.0, 0.0, 0.0);
    for (change, value) in pairs.filter(|(c, v)| (c * v).is_finite()) {
        cross += change * value;
        of_change += change * change;
        of_value += value * value;
    }
    (cross > AGREES * (of_change * of_value).sqrt()).then_some(position.id.as_str())
}

fn reversed(id: &str, against: &str, (share, count): (f64, usize), with: Option<&str>) -> Fault {
    let mend = match with {
        Some(with) => format!(
            "as does `{with}`, so it is {against} that has the wrong sign (`scale = -1` in the model's [log.inputs] turns it)"
        ),
        None => {
            "one of them has the wrong sign (`scale = -1` in the model's [log] turns it)".to_owned()
        }
    };
    Fault {
        kind: FaultKind::ReversedSign,
        run: String::new(),
        signal: id.into(),
        detail: format!(
            "runs against {against} in {:.1} % of the {count} samples where both are clearly not \
             zero: {mend}",
            100.0 * share
        ),
    }
}

fn is_velocity(unit: &str) -> bool {
    parse(unit).is_ok_and(|unit| {
        let d = unit.dimension;
        d.second == -1
            && d.kilogram == 0
            && d.ampere == 0
            && d.kelvin == 0
            && (d.metre, d.radian) != (0, 0)
            && d.metre + d.radian == 1
    })
}

/// Share of clear samples that disagree, and their number, when it is a fault.
fn disagreement(a: &[f64], b: &[f64]) -> Option<(f64, usize)> {
    let limits = [a, b].map(|v| CLEAR * large(v.iter().copied()));
    let (mut clear, mut against) = (0usize, 0usize);
    for (a, b) in a.iter().zip(b) {
        if a.abs() > limits[0] && b.abs() > limits[1] {
            clear += 1;
            against += usize::from(a * b < 0.0);
        }
    }
    let share = against as f64 / clear.max(1) as f64;
    (clear >= ENOUGH && share >= DISAGREE).then_some((share, clear))
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{drive_log, kinds};
    use super::*;

    #[test]
    fn an_encoder_of_the_wrong_sign() {
        let log = drive_log(|_, [t, ur, ul, r, l]| [t, ur, ul, r, -l]);
        assert_eq!(kinds(&log), [(FaultKind::ReversedSign, "track_speed_left")]);
        let detail = &log.faults[0].detail;
        assert!(
            detail.starts_with("runs against `voltage_left` in "),
            "{detail}"
        );
    }

    #[test]
    fn velocities_are_known_by_their_unit() {
        for (unit, is) in [
            ("m/s", true),
            ("rad/s", true),
            ("m/s^2", false),
            ("V", false),
            ("1/s", false),
        ] {
            assert_eq!(is_velocity(unit), is, "{unit}");
        }
    }

    #[test]
    fn the_sides_tell_on_each_other() {
        let wave: Vec<f64> = (0..200).map(|k| (f64::from(k) * 0.1).sin()).collect();
        let minus: Vec<f64> = wave.iter().map(|v| -v).collect();
        assert_eq!(disagreement(&wave, &wave), None);
        assert!(disagreement(&wave, &minus).is_some_and(|(share, _)| share == 1.0));
        assert_eq!(disagreement(&wave[..20], &minus[..20]), None);
    }
}
