//! Milliseconds taken for seconds.
//!
//! The time stamps of a log and the model each say how fast the machine is. From one sample to the next a
//! motion that is not an integral keeps the share `a` of itself: `y(k+1) = a y(k) + Σ b u(k) + c`, by least
//! squares. With samples `P` apart its time constant is `-P / ln a`. That of the model is the slowest of its
//! equations, linearised. A time constant is a positive number of unknown scale, so the unit of the stamps is
//! the one that brings the two nearest to each other as a ratio: `s` up to `√1000`, `ms` from there to
//! `1000 √1000`, and so on. Where the samples are so far apart that no motion is left between them, a unit is
//! doubted only when even in the smaller one none would be: a thousand time constants from sample to sample.

use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_recordings::Recording;
use nalgebra::{DMatrix, DVector};

use crate::error::{Error, Result};
use crate::log::Log;
use crate::pace::Pace;

/// Nobody logs faster, samples/s: closer stamps, taken as milliseconds, are none.
const FASTEST: f64 = 1e4;
/// From one unit of time to the next.
const UNIT: f64 = 1e3;
/// Share of the changes from sample to sample that state and inputs must explain.
const EXPLAINED: f64 = 0.5;
/// Samples that are looked at.
const MOST: usize = 20_000;
/// Samples that are needed for each coefficient.
const LEAST: usize = 10;

/// What the stamps seem to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Doubt {
    /// The unit that they seem to have.
    pub(crate) unit: &'static str,
    /// Between two samples, taken as seconds.
    pub(crate) period: f64,
    /// Time constant of what was measured, taken as seconds; none where nothing is left from sample to sample.
    pub(crate) seen: Option<f64>,
    /// The slowest time constant of the model, s.
    pub(crate) model: f64,
}

impl Doubt {
    /// Why the stamps are no seconds.
    pub(crate) fn reason(&self) -> String {
        let Doubt { period, model, .. } = self;
        let seen = match self.seen {
            Some(seen) => format!("and what was measured follows its inputs within {seen:.3} s"),
            None => "and nothing that was measured lasts from one to the next".to_owned(),
        };
        let (unit, number) = match self.unit {
            "ms" => ("milliseconds", UNIT),
            "us" => ("microseconds", UNIT * UNIT),
            _ => ("nanoseconds", UNIT * UNIT * UNIT),
        };
        format!(
            "samples would be {period} s apart {seen}, where the slowest time constant of the model is \
             {model:.3} s; in {unit} it would be {:.3} s",
            self.seen.unwrap_or(*period) / number
        )
    }
}

/// Refuses stamps that are no seconds, where nothing but the name of a column says that they are.
///
/// # Errors
///
/// They seem to be something else, with what to say in the model's `[log]` in either case.
pub(crate) fn check(model: &Model, log: &Log, recording: &Recording) -> Result<()> {
    let map = &model.log;
    let said = map.period_s.is_some() || map.time.as_ref().is_some_and(|t| t.unit().is_some());
    if said || !log.has_columns_of_time() {
        return Ok(());
    }
    let Some(doubt) = doubt(model, &recording.runs) else {
        return Ok(());
    };
    let Doubt { unit, .. } = doubt;
    let column = &recording.time;
    Err(Error::request(format!(
        "{}: the time stamps in `{column}` seem to be {unit}, not s: {}",
        log.name(),
        doubt.reason()
    ))
    .with_help(format!(
        "`time = {{ column = {column:?}, unit = {unit:?} }}` in the model's [log] says so; with `unit = \"s\"` \
         there they are seconds, and nothing is asked"
    )))
}

/// Whether the stamps of `runs`, taken as seconds, are a thousand times too far apart for the model.
pub(crate) fn doubt(model: &Model, runs: &[Run]) -> Option<Doubt> {
    let period = period(runs)?;
    if period * FASTEST < UNIT {
        return None;
    }
    let exact = model.missing_values().is_empty();
    // Somebody else's machine of the same kind may be slower; whole seconds are seldom written otherwise.
    if !exact && !whole(runs) {
        return None;
    }
    let model = valued(model)?;
    let drive: Vec<f64> = (0..model.plant.inputs.len())
        .map(|input| rms(runs, input))
        .collect();
    let known = Pace::known(&model, &drive)?.slowest;
    let seen = seen(runs, period);
    let ratio = match seen {
        Some(seen) => seen / known,
        None if period >= UNIT * known => UNIT,
        None => return None,
    };
    let unit = match (ratio.log10() / UNIT.log10()).round() as i64 {
        ..1 => return None,
        1 => "ms",
        2 => "us",
        _ => "ns",
    };
    Some(Doubt {
        unit,
        period,
        seen,
        model: known,
    })
}

/// The model with values: its own, or those of its plant's example. A plant written as expressions has none: the
/// example is another machine.
fn valued(model: &Model) -> Option<Model> {
    if model.missing_values().is_empty() {
        return Some(model.clone());
    }
    let (mut example, _) = Model::from_toml("example", model.plant.example).ok()?;
    let has = |name: &str| model.parameters.iter().any(|own| own.name == name);
    if !example.parameters.iter().all(|p| has(&p.name)) {
        return None;
    }
    let values: Vec<f64> = example
        .parameters
        .iter()
        .map(|p| {
            let own = model.parameters.iter().find(|own| own.name == p.name);
            own.and_then(|own| own.value)
                .or(p.value)
                .unwrap_or(f64::NAN)
        })
        .collect();
    example.set_values(&values);
    example.missing_values().is_empty().then_some(example)
}

/// Median time between samples.
fn period(runs: &[Run]) -> Option<f64> {
    let pairs = runs.iter().flat_map(|run| run.time().windows(2));
    let mut steps: Vec<f64> = pairs.take(MOST).map(|pair| pair[1] - pair[0]).collect();
    let middle = steps.len() / 2;
    (!steps.is_empty()).then(|| *steps.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Whether every stamp is a whole number.
fn whole(runs: &[Run]) -> bool {
    let mut stamps = runs.iter().flat_map(|run| run.time());
    stamps.all(|t| (t - t.round()).abs() < 1e-9 * t.abs().max(1.0))
}

fn rms(runs: &[Run], input: usize) -> f64 {
    let values = || {
        let of =
            |run: &'_ Run| -> Vec<f64> { (0..run.len()).map(|k| run.input(k)[input]).collect() };
        runs.iter().flat_map(of)
    };
    let n = values().count().max(1) as f64;
    (values().map(|u| u * u).sum::<f64>() / n).sqrt()
}

/// The shortest time constant with which a measured signal, or the change of one that is an integral, follows
/// the inputs; none where samples are further apart than that.
fn seen(runs: &[Run], period: f64) -> Option<f64> {
    let signals = runs.first()?.n_measured();
    let mut found: Option<f64> = None;
    let duration: f64 = runs.iter().map(Run::duration).sum();
    for signal in 0..signals {
        let mut kept = kept(runs, signal, period, false);
        // What keeps all of itself is an integral of something that may not.
        if kept.is_none_or(|a| a >= 1.0 || -period / a.ln() > duration) {
            kept = self::kept(runs, signal, period, true);
        }
        let constant = kept.filter(|a| *a < 1.0).map(|a| -period / a.ln());
        found = match (found, constant) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
    }
    found
}

/// The share of a signal (or of its changes) that is left at the next sample, where it and the inputs explain
/// most of what changes and samples are closer than the time constant.
fn kept(runs: &[Run], signal: usize, period: f64, changes: bool) -> Option<f64> {
    let inputs = runs.first()?.n_inputs();
    let width = inputs + 2;
    let mut normal = DMatrix::<f64>::zeros(width, width);
    let mut right = DVector::<f64>::zeros(width);
    let (mut total, mut n) = (0.0, 0);
    let even = |run: &Run, k: usize| {
        let step = run.time()[k + 1] - run.time()[k];
        (step - period).abs() < 0.2 * period
    };
    for run in runs {
        let value = |k: usize| match changes {
            false => run.sample(k)[signal],
            true => run.sample(k + 1)[signal] - run.sample(k)[signal],
        };
        let end = run.len().saturating_sub(if changes { 2 } else { 1 });
        for k in (0..end).filter(|k| even(run, *k)).take(MOST) {
            let (now, next) = (value(k), value(k + 1));
            if !(now.is_finite() && next.is_finite()) {
                continue;
            }
            let mut row = DVector::<f64>::zeros(width);
            row[0] = now;
            row[1] = 1.0;
            for (at, input) in run.input(k + usize::from(changes)).iter().enumerate() {
                row[2 + at] = *input;
            }
            let change = next - now;
            normal.ger(1.0, &row, &row, 1.0);
            right.axpy(change, &row, 1.0);
            total += change * change;
            n += 1;
        }
    }
    if n < LEAST * width || total == 0.0 {
        return None;
    }
    // Inputs that are constant or alike leave directions open: those do not matter.
    let scale = DVector::from_fn(width, |i, _| match normal[(i, i)] {
        0.0 => 0.0,
        square => square.sqrt().recip(),
    });
    let scaled = DMatrix::from_fn(width, width, |i, j| normal[(i, j)] * scale[i] * scale[j]);
    let solved = scaled
        .svd(true, true)
        .solve(&right.component_mul(&scale), 1e-10)
        .ok()?
        .component_mul(&scale);
    let explained = solved.dot(&right) / total;
    let a = 1.0 + solved[0];
    (explained >= EXPLAINED && a > (-1.0_f64).exp()).then_some(a)
}

#[cfg(test)]
mod tests {
    use loopsight_model::run::Rows;

    use super::*;

    /// A first-order machine under inputs that change every few samples, stamped every `period`.
    fn recorded(constant: f64, period: f64, noise: f64) -> Vec<Run> {
        let n = 400_u32;
        // Without a random number: the digits of a linear congruence.
        let digit = |k: u32| {
            f64::from(k.wrapping_mul(1_103_515_245).wrapping_add(12_345) >> 16 & 0xff) / 255.0
        };
        let a = (-period / constant).exp();
        let (mut y, mut speed, mut volts) = (0.0, Vec::new(), Vec::new());
        for k in 0..n {
            let u = (digit(k / 7 + 1) - 0.5) * 12.0;
            speed.push(y + noise * (digit(5000 + k) - 0.5));
            volts.push(u);
            y = a * y + (1.0 - a) * 4.0 * u;
        }
        let time = (0..n).map(|k| f64::from(k) * period).collect();
        vec![Run::new("", time, Rows::new(1, volts), Rows::new(1, speed)).unwrap()]
    }

    /// The same samples with stamps in thousandths.
    fn in_milliseconds(runs: &[Run]) -> Vec<Run> {
        let stretched = |run: &Run| {
            let time = run.time().iter().map(|t| (1e3 * t).round()).collect();
            let rows = |values: &[f64]| Rows::new(1, values.to_vec());
            Run::new("", time, rows(run.inputs()), rows(run.measured())).unwrap()
        };
        runs.iter().map(stretched).collect()
    }

    fn motor(text: &str) -> Model {
        Model::from_toml(
            "m.toml",
            &format!("[plant.dc_axis]\n{text}[log.measured.speed]\n"),
        )
        .unwrap()
        .0
    }

    fn unit(model: &Model, runs: &[Run]) -> Option<&'static str> {
        doubt(model, runs).map(|d| d.unit)
    }

    /// Time constants from 0.1 to 10 times the model's, periods from a hundredth to twice of them.
    #[test]
    fn milliseconds_are_told_from_seconds_whatever_the_period() {
        let model = motor("K_A = -2.0\nK_C = 8.0\n");
        for constant in [0.05, 0.16, 0.5, 1.6, 5.0] {
            for share in [0.02, 0.1, 0.5] {
                let runs = recorded(constant, share * constant, 0.02);
                let shown = format!("{constant} s, {share}");
                assert_eq!(unit(&model, &runs), None, "{shown}");
                let stretched = in_milliseconds(&runs);
                assert_eq!(unit(&model, &stretched), Some("ms"), "{shown}");
            }
        }
        let runs = recorded(0.5, 0.02, 0.0);
        let twice = in_milliseconds(&in_milliseconds(&runs));
        assert_eq!(unit(&model, &twice), Some("us"));
    }

    /// A machine that is slow is no mistake, and neither is a log of states at rest.
    #[test]
    fn slow_machines_and_slow_logs_are_not_doubted() {
        let slow = motor("K_A = -0.002\nK_C = 0.008\n");
        for period in [10.0, 60.0, 300.0] {
            assert_eq!(unit(&slow, &recorded(500.0, period, 0.0)), None, "{period}");
        }
        let model = motor("K_A = -2.0\nK_C = 8.0\n");
        assert_eq!(unit(&model, &recorded(0.5, 10.0, 0.0)), None);
        // A thousand time constants from sample to sample: in milliseconds it would be one.
        assert_eq!(unit(&model, &recorded(0.5, 600.0, 0.0)), Some("ms"));
    }

    /// Expressions without values may be any machine, however slow.
    #[test]
    fn expressions_without_values_are_not_doubted() {
        let text = "[plant.expression.states]\nheat = { unit = \"K\", rate = \"(gain * power - heat) / slow\" }\n\
                    [plant.expression.inputs]\npower = { unit = \"1\" }\n\
                    [plant.expression.parameters]\ngain = { unit = \"K\" }\nslow = { unit = \"s\" }\n\
                    [log.measured.heat]\n";
        let oven = Model::from_toml("oven.toml", text).unwrap().0;
        assert_eq!(unit(&oven, &recorded(300.0, 5.0, 0.0)), None);
    }

    /// Without values the plant's example stands for the machine, and only whole stamps are doubted.
    #[test]
    fn a_model_without_values_is_judged_by_its_plants_example() {
        let free = motor("");
        let runs = recorded(0.5, 0.02, 0.02);
        assert_eq!(unit(&free, &in_milliseconds(&runs)), Some("ms"));
        assert_eq!(unit(&free, &runs), None);
        assert_eq!(unit(&free, &recorded(30.0, 0.55, 0.0)), None);
    }
}
