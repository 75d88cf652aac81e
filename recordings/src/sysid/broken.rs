//! Runs of a SysId log that do not belong to the same machine in the same state as the others: stalled,
//! blocked at the start, recorded in other units, under a voltage that breaks down.
//!
//! The runs are compared with each other by the regression that SysId itself makes, over [`windows`].

use nalgebra::Vector3;

use super::windows::{ENOUGH, Window, feedforward, highest, left, moving, windows};
use super::{SysIdLog, TestKind};
use crate::fault::{Fault, FaultKind};
use crate::faults::large;
use crate::table::Table;

/// Length of a window, s: long against the lateness of a motor controller's speed, short against a run.
const WINDOW: f64 = 0.2;
/// Length of a window for what the supply does, s: long against a single reading that is wrong, short against
/// a controller that switches off and on again.
const SUPPLY_WINDOW: f64 = 0.1;
/// Share of the large speed below which a machine rests.
const RESTS: f64 = 0.02;
/// Gain of a run over that of the others, either way, from which it is another one. Sides, directions and
/// a battery that sags differ by a quarter at most.
const OTHER_GAIN: f64 = 1.5;
/// Share of the voltage that a regression may leave where runs agree.
const AGREES: f64 = 0.15;
/// By how much the others must agree better without a run of another gain.
const BETTER: f64 = 2.0;
/// At rest for so long, s, under a voltage that moves it elsewhere: longer than any sensor is late.
const STALLED: f64 = 0.5;
/// Voltage over the one that moves the machine at a fifth of its large speed in another run, from which
/// rest is a stall.
const MOVING: f64 = 0.2;
const ABOVE: f64 = 1.5;
/// Share of the voltage that the other runs would not need, and of the largest voltage of the run, from which
/// it is held up.
const HELD_UP: f64 = 0.5;
/// Voltage at which a run breaks loose over the friction in motion, and over that of the other runs that
/// begin slowly, from which its start was blocked. Breakaway friction is seldom twice the sliding one, and
/// the same in both.
const BLOCKED: f64 = 2.0;
/// Share of the largest voltage that a breakdown takes away and gives back,
const BREAKDOWN: f64 = 0.3;
/// and how many times until a run counts as one under a broken voltage. The procedures of SysId have one step.
const BREAKDOWNS: usize = 4;
/// Share of the voltage that what the other runs agree on may leave of a run. Good logs leave an eighth at most.
const UNLIKE: f64 = 0.3;
/// Ratio of the largest to the least voltage in motion from which runs tell friction and gain apart.
const VOLTAGES: f64 = 2.0;
/// One motor in one run.
struct Trace<'a> {
    run: &'a str,
    voltages: Vec<f64>,
    windows: Vec<Window>,
}

impl SysIdLog {
    /// Runs that are broken, with what was seen. Arms and lifts have a weight that this does not know: none.
    pub fn broken_runs(&self) -> Vec<Fault> {
        if matches!(self.test, TestKind::Arm | TestKind::Elevator) {
            return Vec::new();
        }
        let table = self.table();
        let motors: &[(usize, usize)] = match self.test.is_drivetrain() {
            true => &[(1, 5), (2, 6)],
            false => &[(1, 3)],
        };
        let mut found: Vec<Fault> = Vec::new();
        for (voltage, speed) in motors {
            let signal = table.columns.get(*speed).map_or("", |c| c.text.as_str());
            for fault in of_motor(&table, *voltage, *speed, signal) {
                // Both sides of a drivetrain tell the same.
                if !found.iter().any(|known| known.run == fault.run) {
                    found.push(fault);
                }
            }
        }
        found
    }
}

fn of_motor(table: &Table, voltage: usize, speed: usize, signal: &str) -> Vec<Fault> {
    let traces: Vec<Trace<'_>> = table
        .runs
        .iter()
        .map(|run| Trace {
            run: &run.name,
            voltages: windows(table.rows(run), SUPPLY_WINDOW, voltage, speed)
                .iter()
                .map(|w| w.voltage)
                .collect(),
            windows: windows(table.rows(run), WINDOW, voltage, speed),
        })
        .collect();
    let all = || traces.iter().flat_map(|t| &t.windows);
    let large = large(all().map(|w| w.speed));
    let highest = highest(all());
    if traces.len() < 2 || large <= 0.0 || highest <= 0.0 {
        return Vec::new();
    }
    // What a run shows by itself or against any other first: the rest needs others that are whole.
    let plain = |index: usize| {
        let others = || besides(&traces, index, &[]);
        breakdown(&traces[index], highest)
            .or_else(|| stall(&traces[index], others(), large))
            .or_else(|| other_gain(&traces[index], others(), large))
    };
    let mut seen: Vec<Option<String>> = (0..traces.len()).map(plain).collect();
    let known: Vec<usize> = (0..traces.len()).filter(|i| seen[*i].is_some()).collect();
    for index in (0..traces.len()).filter(|index| !known.contains(index)) {
        let others = || besides(&traces, index, &known);
        seen[index] = held_up(&traces[index], others(), large)
            .or_else(|| blocked(&traces[index], others(), large))
            .or_else(|| unlike(&traces[index], others(), large));
    }
    let fault = |(trace, detail): (&Trace<'_>, Option<String>)| {
        Some(Fault {
            kind: FaultKind::BrokenRun,
            run: trace.run.to_owned(),
            signal: signal.to_owned(),
            detail: format!("{}; `--without {}` leaves it out", detail?, trace.run),
        })
    };
    traces.iter().zip(seen).filter_map(fault).collect()
}

/// All traces but one and those that are broken.
fn besides<'t>(
    traces: &'t [Trace<'t>],
    index: usize,
    broken: &'t [usize],
) -> impl Iterator<Item = &'t Trace<'t>> + Clone {
    let all = traces.iter().enumerate();
    all.filter(move |(i, _)| *i != index && !broken.contains(i))
        .map(|(_, trace)| trace)
}

/// Moves in another way than what the other runs agree on, all along.
fn unlike<'t>(
    trace: &'t Trace<'_>,
    others: impl Iterator<Item = &'t Trace<'t>> + Clone,
    large: f64,
) -> Option<String> {
    let others = || others.clone().flat_map(|t| &t.windows);
    let volts = moving(others(), large).into_iter().map(|w| w.voltage.abs());
    let (least, most) = volts.fold((f64::INFINITY, 0.0f64), |(least, most), u| {
        (least.min(u), most.max(u))
    });
    let without = feedforward(others(), large)?;
    let hardest = hardest(others());
    let mut own = moving(trace.windows.iter(), large);
    own.retain(|w| w.acceleration.abs() <= hardest);
    let here = left(&without.terms, &own)?;
    let told = most > VOLTAGES * least && own.len() >= ENOUGH;
    let stands_out = without.left < AGREES && here > UNLIKE.max(BETTER * without.left);
    (told && stands_out).then(|| {
        format!(
            "what the other runs agree on leaves {:.0} % of their voltage and {:.0} % of this one's: it is not the voltage that \
             moves it here, as when wheels hop",
            100.0 * without.left,
            100.0 * here
        )
    })
}

/// Another ratio of speed to voltage than in the others, which agree without it.
fn other_gain<'t>(
    trace: &'t Trace<'_>,
    others: impl Iterator<Item = &'t Trace<'t>>,
    large: f64,
) -> Option<String> {
    let others: Vec<&Window> = others.flat_map(|t| &t.windows).collect();
    let own = moving(trace.windows.iter(), large);
    let without = feedforward(others.iter().copied(), large)?;
    let with = feedforward(others.iter().copied().chain(&trace.windows), large)?;
    if own.len() < ENOUGH || without.left > AGREES || with.left < BETTER * without.left {
        return None;
    }
    let (mut cross, mut square, mut volts) = (0.0, 0.0, 0.0);
    let parts = |w: &Window| {
        let driven = w.voltage - without.terms[0] * w.speed.signum();
        (
            driven,
            without.terms[1] * w.speed + without.terms[2] * w.acceleration,
        )
    };
    for window in &own {
        let (driven, wanted) = parts(window);
        cross += driven * wanted;
        square += driven * driven;
        volts += window.voltage * window.voltage;
    }
    let gain = square.recip() * cross;
    let gain = if gain > 0.0 { gain } else { return None };
    let left: f64 = own
        .iter()
        .map(|w| {
            let (driven, wanted) = parts(w);
            (driven - wanted / gain).powi(2)
        })
        .sum();
    let agrees = (left / volts).sqrt() < AGREES;
    let other = !(1.0 / OTHER_GAIN..=OTHER_GAIN).contains(&gain);
    (agrees && other).then(|| {
        format!(
            "at the same voltage the speed is {gain:.2} times that of the other runs, which agree with each \
             other: other units, another gear, or another supply"
        )
    })
}

/// Driven by more than twice the voltage that the other runs need at its speed and acceleration.
fn held_up<'t>(
    trace: &'t Trace<'_>,
    others: impl Iterator<Item = &'t Trace<'t>> + Clone,
    large: f64,
) -> Option<String> {
    let others = || others.clone().flat_map(|t| &t.windows);
    let without = feedforward(others(), large)?;
    let hardest = hardest(others());
    let needed = |w: &Window| {
        let direction = if w.speed == 0.0 { w.voltage } else { w.speed };
        without
            .terms
            .dot(&Vector3::new(direction.signum(), w.speed, w.acceleration))
    };
    let highest = highest(&trace.windows);
    let far = |w: &Window| {
        let wasted = w.voltage.signum() * (w.voltage - needed(w));
        wasted > HELD_UP * w.voltage.abs()
            && w.voltage.abs() > HELD_UP * highest
            && w.acceleration.abs() <= hardest
    };
    let (from, length, at) = longest(&trace.windows, far)?;
    (without.left < AGREES).then(|| {
        format!(
            "for {length:.1} s from {from:.1} s on it takes {:.1} V where the other runs need {:.1} V: it ran into \
             something, or is held",
            at.voltage.abs(),
            needed(at).abs()
        )
    })
}

/// The hardest acceleration. What a harder one takes is not known from these.
fn hardest<'w>(windows: impl Iterator<Item = &'w Window>) -> f64 {
    windows.map(|w| w.acceleration.abs()).fold(0.0, f64::max)
}

/// The longest stretch of windows that are `so`, longer than a stall must be: when it begins, counted from the
/// start of the run, how long it is, and its last window.
fn longest(windows: &[Window], so: impl Fn(&Window) -> bool) -> Option<(f64, f64, &Window)> {
    let origin = windows.first()?.start;
    let mut began = None;
    let mut longest: Option<(f64, f64, &Window)> = None;
    for window in windows {
        if !so(window) {
            began = None;
            continue;
        }
        let from = *began.get_or_insert(window.start);
        let length = window.end - from;
        if length > longest.map_or(STALLED, |(_, length, _)| length) {
            longest = Some((from - origin, length, window));
        }
    }
    longest
}

/// At rest under a voltage that moves it in another run.
fn stall<'t>(
    trace: &'t Trace<'_>,
    others: impl Iterator<Item = &'t Trace<'t>>,
    large: f64,
) -> Option<String> {
    let moves = others
        .flat_map(|t| &t.windows)
        .filter(|w| w.speed.abs() > MOVING * large && w.speed * w.voltage > 0.0)
        .map(|w| w.voltage.abs())
        .fold(f64::INFINITY, f64::min);
    let stalled = |w: &Window| w.speed.abs() < RESTS * large && w.voltage.abs() > ABOVE * moves;
    let (from, length, at) = longest(&trace.windows, stalled)?;
    Some(format!(
        "it stands still for {length:.1} s from {from:.1} s on, under {:.1} V: stalled or blocked ({moves:.1} V \
         moves it in another run)",
        at.voltage.abs()
    ))
}

/// The highest voltage at rest before it first moves.
fn breakaway(trace: &Trace<'_>, large: f64) -> Option<f64> {
    let windows = trace.windows.iter();
    let volts = highest(windows.take_while(|w| w.speed.abs() < RESTS * large));
    (volts > 0.0).then_some(volts)
}

/// Breaks loose at a voltage far above the friction in motion and above that of the other slow runs.
fn blocked<'t>(
    trace: &'t Trace<'_>,
    others: impl Iterator<Item = &'t Trace<'t>> + Clone,
    large: f64,
) -> Option<String> {
    let own = breakaway(trace, large)?;
    let steps =
        |t: &Trace<'_>| breakaway(t, large).is_some_and(|volts| volts > 0.5 * highest(&t.windows));
    let elsewhere = (others.clone().filter(|t| !steps(t)))
        .filter_map(|t| breakaway(t, large))
        .fold(0.0, f64::max);
    let sliding = feedforward(trace.windows.iter(), large)?;
    let enough = sliding.left < AGREES && elsewhere > 0.0 && !steps(trace);
    (enough && own > BLOCKED * elsewhere && own > BLOCKED * sliding.terms[0].abs()).then(|| {
        format!(
            "it breaks loose at {own:.2} V only, against {elsewhere:.2} V in another run and {:.2} V of friction \
             in motion: its start was blocked",
            sliding.terms[0].abs()
        )
    })
}

/// The voltage goes and comes back, again and again.
fn breakdown(trace: &Trace<'_>, highest: f64) -> Option<String> {
    let limit = BREAKDOWN * highest;
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let (mut rising, mut turns) = (None, 0_usize);
    for volts in &trace.voltages {
        (low, high) = (low.min(*volts), high.max(*volts));
        let now = if rising != Some(true) && volts - low > limit {
            Some(true)
        } else if rising != Some(false) && high - volts > limit {
            Some(false)
        } else {
            continue;
        };
        turns += usize::from(rising.is_some());
        (rising, low, high) = (now, *volts, *volts);
    }
    (turns >= BREAKDOWNS).then(|| {
        format!(
            "its voltage goes and comes back {turns} times: a supply that gives way, or no procedure of SysId"
        )
    })
}

#[cfg(test)]
mod tests {
    use crate::{FaultKind, Severity, read_sysid};

    /// A flywheel `u = 0.4 sign(v) + 2 v + 0.4 v'` in four runs of SysId; `change` has the voltage that acts and
    /// the speed that is measured from run, time, voltage and speed.
    fn log(change: impl Fn(&str, f64, f64, f64) -> (f64, f64)) -> Vec<crate::Fault> {
        let mut text =
            String::from(r#"{"test":"Simple","units":"Rotations","unitsPerRotation":1.0"#);
        for (run, sign, step) in [
            ("slow-forward", 1.0, false),
            ("slow-backward", -1.0, false),
            ("fast-forward", 1.0, true),
            ("fast-backward", -1.0, true),
        ] {
            let (mut v, mut rows) = (0.0f64, Vec::new());
            for k in 0..(if step { 800 } else { 2400 }) {
                let t = 0.005 * f64::from(k);
                let u = sign * if step { 7.0 } else { 0.4 * t };
                let (acts, measured) = change(run, t, u, v);
                rows.push(format!("[{t},{u},0,{measured}]"));
                let friction = if v == 0.0 {
                    acts.clamp(-0.4, 0.4)
                } else {
                    0.4 * v.signum()
                };
                v += 0.005 * (acts - friction - 2.0 * v) / 0.4;
            }
            text += &format!(r#","{run}":[{}]"#, rows.join(","));
        }
        read_sysid(&(text + "}"), "l").unwrap().broken_runs()
    }

    #[test]
    fn runs_of_one_machine_agree() {
        assert_eq!(log(|_, _, u, v| (u, v)), []);
        // Friction that is half as strong again one way is physics.
        assert_eq!(log(|_, _, u, v| (if u < 0.0 { u + 0.2 } else { u }, v)), []);
        // So is a tenth less gain.
        assert_eq!(log(|_, _, u, v| (if u < 0.0 { 0.9 * u } else { u }, v)), []);
    }

    #[test]
    fn a_run_that_does_not_belong_is_named() {
        let named = |faults: Vec<crate::Fault>, run: &str, says: &str| {
            assert_eq!(faults.len(), 1, "{faults:?}");
            let fault = &faults[0];
            assert_eq!((fault.kind, &*fault.run), (FaultKind::BrokenRun, run));
            assert_eq!(fault.severity(), Severity::Fatal);
            assert!(fault.detail.contains(says), "{fault}");
        };
        let in_run = |name: &'static str| move |run: &str| run == name;
        let slow = in_run("slow-forward");
        named(
            log(|run, _, u, v| (u, if slow(run) { 4.0 * v } else { v })),
            "slow-forward",
            "4.0",
        );
        let fast = in_run("fast-forward");
        named(
            log(|run, t, u, v| (if fast(run) && t > 2.5 { 0.0 } else { u }, v)),
            "fast-forward",
            "V",
        );
        let back = in_run("slow-backward");
        named(
            log(|run, t, u, v| (if back(run) && t < 3.5 { 0.0 } else { u }, v)),
            "slow-backward",
            "its start was blocked",
        );
        named(
            log(|run, t, u, v| {
                (
                    u,
                    if fast(run) {
                        v * (1.0 + 0.8 * (14.0 * t).sin())
                    } else {
                        v
                    },
                )
            }),
            "fast-forward",
            "as when wheels hop",
        );
    }
}
