//! Rates against the change of what they are the rate of, on the columns of the file.

use loopsight_core::unit::{Dimension, conversion, parse};

use crate::fault::{Fault, FaultKind};
use crate::plan::Plan;
use crate::table::Table;

/// Length of the pieces over which rate and change are compared, s: long against the delay of a
/// filtered rate.
const WINDOW: f64 = 0.5;
/// So many pieces must be there,
const ENOUGH: usize = 6;
/// and so well must the two correlate.
const CORRELATION: f64 = 0.8;
/// Degrees in a radian, with room for slip, delay and resolution on either side.
const DEGREES: std::ops::RangeInclusive<f64> = 40.0..=82.0;
/// A ratio of this magnitude is one of 1, up to its sign.
const UNITY: std::ops::RangeInclusive<f64> = 0.5..=2.0;
/// A step larger than this, rad, is the angle wrapping around.
const WRAP: f64 = 3.0;
/// Words that tell a rate from its angle and not which sensor it is.
const KIND_WORDS: [&str; 9] = [
    "angle", "angular", "heading", "yaw", "rate", "speed", "velocity", "position", "pos",
];

/// A column in SI units, as the model sees it where it uses it.
struct Column {
    at: usize,
    factor: f64,
    dimension: Dimension,
    stem: String,
    shown: String,
    /// Whether the model uses it.
    used: bool,
}

pub(crate) fn check(table: &Table, plan: &Plan) -> Vec<Fault> {
    let columns = columns(table, plan);
    let mut found: Vec<Fault> = Vec::new();
    for rate in &columns {
        let Some(angle) = columns.iter().find(|angle| is_rate_of(rate, angle)) else {
            continue;
        };
        let Some((ratio, correlation)) = ratio(table, plan, angle, rate) else {
            continue;
        };
        if correlation.abs() < CORRELATION {
            continue;
        }
        let (kind, what) = if DEGREES.contains(&ratio.abs()) {
            (
                FaultKind::GyroScale,
                "57.3 times too large: degrees taken for radians?",
            )
        } else if DEGREES.contains(&ratio.abs().recip()) {
            (
                FaultKind::GyroScale,
                "57.3 times too small: converted to radians twice?",
            )
        } else if UNITY.contains(&-ratio) {
            // Who turns a rate says that its angle is wrong as well, and where nothing uses that, it does not matter.
            if rate.used && rate.factor < 0.0 && !angle.used {
                continue;
            }
            (
                FaultKind::ReversedSign,
                "of the wrong sign (`scale = -1` in the model's [log] turns it)",
            )
        } else if !UNITY.contains(&ratio.abs()) {
            (FaultKind::RateScale, "one of the two is in another unit")
        } else {
            continue;
        };
        let sign = if kind != FaultKind::ReversedSign && ratio < 0.0 {
            ", and its sign is wrong"
        } else {
            ""
        };
        let ratio = match (1e-2..1e3).contains(&ratio.abs()) {
            true => format!("{ratio:.4}"),
            false => format!("{ratio:.2e}"),
        };
        found.push(Fault {
            kind,
            run: String::new(),
            signal: rate.shown.clone(),
            detail: format!(
                "its integral is {ratio} times the change of `{}` (correlation \
                 {correlation:.3}): {what}{sign}",
                angle.shown
            ),
        });
    }
    found
}

fn columns(table: &Table, plan: &Plan) -> Vec<Column> {
    let mut out = Vec::new();
    for (at, header) in table.columns.iter().enumerate() {
        let used = plan.measured.iter().find(|(link, _)| link.column == at);
        let unit = match used {
            Some((_, signal)) => parse(&signal.unit),
            None => parse(header.unit.as_deref().unwrap_or("")),
        };
        let Ok(unit) = unit else { continue };
        let si = loopsight_core::unit::Unit {
            factor: 1.0,
            ..unit
        };
        let factor = match used {
            Some((link, _)) => link.factor,
            None => conversion(&unit, &si).unwrap_or(1.0),
        };
        let name = used.map_or(header.name.as_str(), |(_, signal)| signal.id.as_str());
        let stem: Vec<&str> = name
            .split('_')
            .filter(|w| !KIND_WORDS.contains(w))
            .collect();
        out.push(Column {
            at,
            factor,
            dimension: unit.dimension,
            stem: stem.join("_"),
            shown: used.map_or(&header.text, |(_, signal)| &signal.id).clone(),
            used: used.is_some(),
        });
    }
    out
}

fn is_rate_of(rate: &Column, angle: &Column) -> bool {
    let d = angle.dimension;
    let is_place = d
        == Dimension {
            radian: 1,
            ..Dimension::default()
        }
        || d == Dimension {
            metre: 1,
            ..Dimension::default()
        };
    is_place && rate.dimension == (Dimension { second: -1, ..d }) && rate.stem == angle.stem
}

/// Least-squares factor from the change of the angle to the integral of the rate, and their
/// correlation.
fn ratio(table: &Table, plan: &Plan, angle: &Column, rate: &Column) -> Option<(f64, f64)> {
    let (mut count, mut aa, mut ar, mut rr) = (0usize, 0.0, 0.0, 0.0);
    let value = |row: &[f64], c: &Column| row[c.at] * c.factor;
    let time = |row: &[f64]| row[plan.time.column] * plan.time.factor;
    for run in &table.runs {
        let Some(mut start) = table.rows(run).next() else {
            continue;
        };
        let (mut integral, mut usable) = (0.0, true);
        for (before, now) in table.rows(run).zip(table.rows(run).skip(1)) {
            let step = time(now) - time(before);
            // A gap, a jump or a hole spoils the piece.
            let moved = value(now, angle) - value(before, angle);
            usable &= (0.0..WINDOW).contains(&step) && moved.abs() < WRAP;
            integral += 0.5 * (value(now, rate) + value(before, rate)) * step;
            if time(now) - time(start) >= WINDOW || !usable {
                let change = value(now, angle) - value(start, angle);
                if usable && (change * integral).is_finite() {
                    count += 1;
                    aa += change * change;
                    ar += change * integral;
                    rr += integral * integral;
                }
                (start, integral, usable) = (now, 0.0, true);
            }
        }
    }
    (count >= ENOUGH && aa > 0.0 && rr > 0.0).then(|| (ar / aa, ar / (aa * rr).sqrt()))
}

#[cfg(test)]
mod tests {
    use loopsight_core::Signal;
    use loopsight_model::log_map::LogMap;

    use super::*;
    use crate::{Severity, Source, map, read_csv_from};

    fn gyro(factor: f64, header: &str, id: &'static str) -> Vec<Fault> {
        let mut text = format!("time_s,voltage_V,speed_rad_per_s,gyro_angle_rad,{header}\n");
        for k in 0..1000 {
            let t = 0.01 * f64::from(k);
            let (angle, rate) = (0.5 * (2.0 * t).sin(), (2.0 * t).cos() * factor);
            let speed = (2.0 * t).cos();
            text += &format!("{t},{speed},{speed},{angle},{rate}\n");
        }
        let table = read_csv_from(text.as_bytes(), "l").unwrap();
        let signals = [
            Signal::new("speed", "w", "rad/s", "."),
            Signal::new(id, "r", "rad/s", "."),
        ];
        let inputs = [Signal::new("voltage", "u", "V", ".")];
        map(&Source::Table(table), &inputs, &signals, &LogMap::default())
            .unwrap()
            .faults
    }

    #[test]
    fn rates_in_the_wrong_unit_are_named() {
        assert_eq!(gyro(1.0, "gyro_rate_rad_per_s", "other"), []);
        for factor in [57.3, 1.0 / 57.3] {
            let found = gyro(factor, "gyro_rate_rad_per_s", "other");
            assert_eq!(found[0].kind, FaultKind::GyroScale, "{factor}");
            assert_eq!(found[0].signal, "gyro_rate_rad_per_s");
            assert_eq!(found[0].severity(), Severity::Warning);
        }
        for factor in [9.55, 1e-4] {
            let found = gyro(factor, "gyro_rate_rad_per_s", "other");
            assert_eq!(found[0].kind, FaultKind::RateScale, "{factor}");
            assert_eq!(found[0].severity(), Severity::Warning);
        }
        // Said to be in degrees, and so it is.
        assert_eq!(gyro(57.29578, "gyro_rate_deg_per_s", "other"), []);
    }

    #[test]
    fn a_rate_that_the_model_uses_is_fatal() {
        let found = gyro(57.3, "gyro_rate_rad_per_s", "gyro_rate");
        let fault = found
            .iter()
            .find(|f| f.kind == FaultKind::GyroScale)
            .unwrap();
        assert_eq!(
            (fault.signal.as_str(), fault.severity()),
            ("gyro_rate", Severity::Fatal)
        );
    }

    #[test]
    fn a_rate_of_the_wrong_sign() {
        let found = gyro(-1.0, "gyro_rate_rad_per_s", "other");
        assert_eq!(found[0].kind, FaultKind::ReversedSign);
        assert!(
            found[0].detail.contains("of the wrong sign"),
            "{}",
            found[0]
        );
    }
}
