//! Angles that begin anew after each turn, and counters, of time as well, that run over.

use std::f64::consts::TAU;

use loopsight_model::run::Run;
use loopsight_model::sensor::Sensor;

use super::Recording;
use crate::fault::{Fault, FaultKind};
use crate::median::median;
use crate::plan::{Link, Plan};
use crate::segment::NEW_RUN_PERIODS;

/// What a counter runs over after, in its own numbers: the range of 16 or 32 bits.
const COUNTERS: [f64; 2] = [65_536.0, 4_294_967_296.0];
/// Part of the whole that a signal may exceed it by: an angle is logged with three digits at least.
const ROUNDED: f64 = 1e-3;
/// Part of the whole from which a step from one sample to the next is one around: what is left is less than a quarter, so its
/// direction is in no doubt.
const AROUND: f64 = 0.75;

/// Lets angles and ways go on where they begin anew, and says where that was.
pub(super) fn go_on(recording: &mut Recording, plan: &Plan) -> Vec<Fault> {
    let mut found = Vec::new();
    for (s, (link, signal)) in plan.measured.iter().enumerate() {
        if !["rad", "m"].contains(&signal.unit.as_str()) || signal.sensor != Sensor::Instantaneous {
            continue;
        }
        let span = span(&recording.runs, s);
        for whole in wholes(*link, &signal.unit) {
            if span > whole * (1.0 + ROUNDED) || span < AROUND * whole {
                continue;
            }
            let mut times = 0;
            for run in &mut recording.runs {
                times += unwrap(run, s, whole);
            }
            if times > 0 {
                found.push(Fault {
                    kind: FaultKind::Wrapped,
                    run: String::new(),
                    signal: signal.id.clone(),
                    detail: format!(
                        "it begins anew {times} times, each time {whole:.4} {} off; it is taken as going on",
                        signal.unit
                    ),
                });
                break;
            }
        }
    }
    found
}

/// Lets time stamps go on where the counter behind them ran over, and says how often it did: microseconds in 32 bits do each 72
/// minutes. It ran over where whole numbers come back by nearly the whole range, and with the range the time goes on by some
/// periods; what begins anew otherwise is another run.
pub(super) fn run_on(stamps: &mut [f64]) -> usize {
    if stamps.windows(2).all(|pair| pair[0] <= pair[1]) || stamps.iter().any(|t| t.fract() != 0.0) {
        return 0;
    }
    let steps = stamps.windows(2).map(|pair| pair[1] - pair[0]);
    let mut forward: Vec<f64> = steps.filter(|step| *step > 0.0).collect();
    let most = NEW_RUN_PERIODS * median(&mut forward);
    let (mut last, mut around, mut times) = (f64::NAN, 0.0, 0);
    for stamp in stamps {
        let goes_on = |whole: &f64| {
            let step = *stamp + whole - last;
            last < *whole && *stamp >= 0.0 && 0.0 < step && step <= most.min(whole * (1.0 - AROUND))
        };
        if *stamp < last
            && let Some(whole) = COUNTERS.into_iter().find(goes_on)
        {
            around += whole;
            times += 1;
        }
        last = *stamp;
        *stamp += around;
    }
    times
}

/// The wholes that a signal may begin anew after, in SI.
fn wholes(link: Link, unit: &str) -> Vec<f64> {
    let turn = (unit == "rad").then_some(TAU);
    let counted = COUNTERS.map(|whole| whole * link.factor.abs());
    turn.into_iter().chain(counted).collect()
}

/// From the least to the largest value of a signal.
fn span(runs: &[Run], signal: usize) -> f64 {
    let samples = runs
        .iter()
        .flat_map(|run| (0..run.len()).map(move |k| run.sample(k)[signal]));
    let finite = samples.filter(|value| value.is_finite());
    let [least, largest] = finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [value.min(low), value.max(high)]
    });
    largest - least
}

/// Lets a signal of a run go on; how often it began anew.
fn unwrap(run: &mut Run, signal: usize, whole: f64) -> usize {
    let width = run.n_measured();
    let mut measured = run.measured().to_vec();
    let (mut last, mut around, mut times) = (f64::NAN, 0.0, 0);
    for value in measured.iter_mut().skip(signal).step_by(width) {
        if !value.is_finite() {
            continue;
        }
        let step = *value - last;
        last = *value;
        if step.abs() > AROUND * whole {
            around -= whole.copysign(step);
            times += 1;
        }
        *value += around;
    }
    if times > 0
        && let Ok(going_on) = run.clone().with_measured(measured)
    {
        *run = going_on;
    }
    times
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use loopsight_core::Signal;
    use loopsight_model::log_map::{LogMap, Measured};

    use super::*;
    use crate::map::map;
    use crate::source::Source;

    const INPUTS: [Signal; 1] = [Signal::new("voltage", "u", "V", ".")];
    const SIGNALS: [Signal; 1] = [Signal::new("angle", "p", "rad", ".")];

    #[test]
    fn counters_of_time_that_run_over_go_on_and_what_begins_at_zero_is_another_run() {
        let of = |bits: u32, first: u64| -> Vec<f64> {
            let stamps = (0..100).map(|k| (first + 1000 * k) % (1 << bits));
            stamps.map(|stamp| stamp as f64).collect()
        };
        for (bits, first) in [(16, 60_000), (32, 4_294_960_000)] {
            let mut stamps = of(bits, first);
            let times = run_on(&mut stamps);
            assert_eq!(times, if bits == 16 { 2 } else { 1 });
            assert!(stamps.windows(2).all(|pair| pair[1] - pair[0] == 1000.0));
        }
        let two_runs = [of(32, 0), of(32, 0)].concat();
        let mut kept = two_runs.clone();
        assert_eq!(run_on(&mut kept), 0);
        assert_eq!(kept, two_runs);
    }

    #[test]
    fn angles_that_begin_anew_and_counters_that_run_over_go_on() {
        // Two turns forth and back, as an angle within a turn, as a counter of 16 bits, and within half a turn.
        let turned = |k: i32| 2.0 * (0.05 * f64::from(k)).sin();
        let logged = |unit: Option<&str>, scale: f64, number: &dyn Fn(f64) -> f64| {
            let rows: String = (0..200)
                .map(|k| format!("{},1,{}\n", 0.1 * f64::from(k), number(turned(k))))
                .collect();
            let angle = Measured {
                column: Some("angle".into()),
                unit: unit.map(str::to_owned),
                scale: Some(scale),
                ..Measured::default()
            };
            let log_map = LogMap {
                measured: BTreeMap::from([("angle".into(), angle)]),
                ..LogMap::default()
            };
            let text = format!("time_s,voltage_V,angle\n{rows}");
            let table = crate::read_csv_from(text.as_bytes(), "log.csv").unwrap();
            let recording = map(&Source::Table(table), &INPUTS, &SIGNALS, &log_map).unwrap();
            let wrapped = recording
                .faults
                .iter()
                .any(|f| f.kind == FaultKind::Wrapped);
            let run = &recording.runs[0];
            let off = (0..run.len()).map(|k| {
                let truth = std::f64::consts::TAU * turned(k as i32);
                (run.sample(k)[0] - run.sample(0)[0] - truth).abs()
            });
            (wrapped, off.fold(0.0, f64::max))
        };
        let degrees = |turns: f64| 360.0 * (turns - turns.round());
        let counts = |turns: f64| f64::from((turns * 30_000.0).round() as i32 as i16);
        for (wrapped, off) in [
            logged(Some("deg"), 1.0, &degrees),
            logged(Some("rev"), 1.0 / 30_000.0, &counts),
        ] {
            assert!(wrapped && off < 1e-3, "{off}");
        }
        let (wrapped, _) = logged(Some("rev"), 0.2, &|turns| turns);
        assert!(!wrapped);
    }
}
