//! What a supervisor does, tick by tick, in single precision and with buffers as on a robot.

use super::*;
use crate::{Command, Innovation, Sample, Tick};

const PERIOD: f32 = 0.01;

const THRESHOLDS: Thresholds<f32> = Thresholds {
    window: 0.5,
    worse: 2.0,
    innovation: 5.0,
    innovation_for: 1.0,
    tracking_share: 0.5,
    tracking_for: 1.0,
    frozen: 0.3,
    stale: 0.2,
    calm: 1.0,
    falls: 2,
};

/// What the observer says is written here.
#[derive(Default)]
struct Script {
    theta: Option<f32>,
    innovation: f32,
    residual: f32,
    restarted: Option<f32>,
    /// Learns nothing, as from a robot at rest.
    idle: bool,
}

impl Observer<f32> for Script {
    fn observe(&mut self, _: &Observation<'_, f32>) {}
    fn teach(&self, model: &mut dyn AffineModel<f32>) {
        if let Some(theta) = self.theta {
            model.learn(1, theta);
        }
    }
    fn innovation(&self, row: usize) -> Option<Innovation<f32>> {
        (row == 0).then_some(Innovation {
            innovation: self.innovation,
            relative_variance: 1.0,
            accepted: !self.idle,
        })
    }
    fn residual(&self, row: usize, _: &[f32]) -> Option<f32> {
        (row == 0).then_some(self.residual)
    }
    fn restart(&mut self, values: &[f32]) {
        self.restarted = Some(values[1]);
    }
}

/// The controller's model: one value that may be learned.
struct Learner(f32);

impl AffineModel<f32> for Learner {
    fn size(&self) -> usize {
        1
    }
    fn evaluate(&mut self, _: &[f32], _: &mut [f32], _: &mut [f32]) {}
    fn learn(&mut self, parameter: usize, value: f32) {
        assert_eq!(parameter, 1, "only what was taught is handed over");
        self.0 = value;
    }
}

struct Bench {
    supervisor: Supervisor<f32, [f32; 2]>,
    observer: Script,
    model: Learner,
    index: u64,
    reference: f32,
    /// Added to the reference to make the measurement.
    error: f32,
    still: bool,
    fresh: bool,
    saturated: bool,
}

impl Bench {
    fn new() -> Self {
        Self::counting(0.0)
    }

    /// With an encoder at the first shaft, by the angle of one count.
    fn counting(count: f32) -> Self {
        let free = f32::INFINITY;
        Self {
            supervisor: Supervisor::new(
                THRESHOLDS,
                [7.0, 2.0],
                (1, 2),
                [free; 2],
                ([-9.0, -free], [9.0, free]),
                // The second shaft turns with the difference of the signals; it has no encoder.
                ([1.0, 0.0], [count, 0.0]),
                |_| [0.0; 2],
            ),
            observer: Script::default(),
            model: Learner(2.0),
            index: 0,
            reference: 1.0,
            error: 0.0,
            still: false,
            fresh: true,
            saturated: false,
        }
    }

    /// Runs for some time; the time and the event at which something happened first.
    fn run(&mut self, seconds: f32) -> Option<(f32, Event<f32>)> {
        for k in 0..(seconds / PERIOD).round() as u32 {
            self.index += 1;
            let time = self.index as f32 * PERIOD;
            // A little motion, so that nothing seems frozen.
            let wiggle = if self.still {
                0.0
            } else {
                0.01 * (7.0 * time).sin()
            };
            let measured = [self.reference + self.error + wiggle, 0.0];
            let seen = Observation {
                tick: Tick {
                    index: self.index,
                    time,
                    period: PERIOD,
                },
                sample: Sample {
                    time,
                    fresh: self.fresh,
                },
                measured: &measured,
                command: &[0.0],
                applied: &[0.0],
                outcome: Command {
                    saturated: self.saturated,
                    held: false,
                },
            };
            let reference = [self.reference];
            let event =
                self.supervisor
                    .judge(&seen, &reference, &mut self.observer, &mut self.model);
            if let Some(event) = event {
                return Some(((k + 1) as f32 * PERIOD, event));
            }
        }
        None
    }

    /// A loop that has learned 3 instead of 2, and uses it.
    fn proved() -> Self {
        let mut bench = Self::new();
        bench.observer.theta = Some(3.0);
        bench.observer.innovation = 0.01;
        bench.observer.residual = 0.05;
        let (time, event) = bench.run(5.0).unwrap();
        assert_eq!((event.action, event.cause), (Action::Resumed, Cause::Calm));
        assert!((0.99..1.1).contains(&time), "handed over after {time} s");
        bench
    }
}

#[test]
fn what_is_learned_has_to_prove_itself_first() {
    let mut bench = Bench::new();
    bench.observer.theta = Some(9.0);
    bench.observer.innovation = 0.5;
    bench.observer.residual = 0.05;
    assert_eq!(
        bench.run(5.0),
        None,
        "worse than the model file: never handed over"
    );
    assert_eq!(bench.model.0, 2.0);
    assert!(
        !bench.supervisor.fallen(),
        "nothing was left that had been in use"
    );
    assert_eq!(Bench::proved().model.0, 3.0);
    // At rest all models predict alike: that proves nothing.
    let mut idle = Bench::new();
    idle.observer.theta = Some(3.0);
    idle.observer.idle = true;
    assert_eq!(idle.run(5.0), None);
    assert_eq!(idle.model.0, 2.0);
}

#[test]
fn a_model_that_predicts_worse_is_left_for_the_last_good_one_and_comes_back() {
    let mut bench = Bench::proved();
    assert_eq!(bench.run(2.0), None);
    // The estimate runs away; the good one (3) would still explain what is measured.
    bench.observer.theta = Some(40.0);
    bench.observer.innovation = 0.4;
    bench.observer.residual = 0.01;
    let (time, event) = bench.run(2.0).unwrap();
    assert_eq!(
        (event.action, event.cause),
        (Action::FellBack, Cause::Worse(0))
    );
    assert!(
        time < 0.2 && event.value > event.limit,
        "{event:?} after {time} s"
    );
    assert_eq!((bench.model.0, bench.observer.restarted), (3.0, Some(3.0)));
    assert!(bench.supervisor.fallen());
    bench.observer.theta = Some(3.1);
    bench.observer.innovation = 0.01;
    let (time, event) = bench.run(4.0).unwrap();
    assert_eq!(event.action, Action::Resumed);
    assert!(time >= 0.99 && bench.model.0 == 3.1 && !bench.supervisor.fallen());
}

/// Learning that goes wrong again and again is left alone for a minute; the loop goes on with the good model.
#[test]
fn what_is_left_too_often_is_not_used_for_a_minute() {
    let mut bench = Bench::proved();
    bench.observer.residual = 0.01;
    for fall in 1..=3 {
        bench.observer.innovation = 0.4;
        let (_, event) = bench.run(2.0).unwrap();
        assert_eq!(event.action, Action::FellBack, "fall {fall}");
        bench.observer.innovation = 0.01;
        if fall <= THRESHOLDS.falls {
            assert_eq!(event.cause, Cause::Worse(0), "fall {fall}");
            assert_eq!(bench.run(4.0).unwrap().1.action, Action::Resumed);
        } else {
            assert_eq!((event.cause, event.value), (Cause::Relapse, 3.0));
        }
    }
    assert_eq!(bench.run(59.0), None);
    assert!(bench.supervisor.fallen());
    assert_eq!(bench.run(4.0).unwrap().1.action, Action::Resumed);
}

/// Who asks for more than the motors have is not lost, unless it goes the wrong way.
#[test]
fn what_cannot_be_reached_is_no_lost_track() {
    let mut bench = Bench::new();
    bench.saturated = true;
    bench.error = -0.7;
    assert_eq!(bench.run(5.0), None);
    bench.error = -1.5;
    let (time, event) = bench.run(5.0).unwrap();
    assert_eq!(
        (event.action, event.cause),
        (Action::Stopped, Cause::Tracking(0))
    );
    assert!((1.0..1.1).contains(&time), "{time} s");
}

/// A voltage that cannot grow gives a speed that does not change, and friction holds what came to rest.
#[test]
fn a_shaft_flat_out_or_held_by_friction_is_not_frozen_at_once() {
    for (saturated, error) in [(true, -0.7), (false, -1.0)] {
        let mut bench = Bench::new();
        bench.saturated = saturated;
        assert_eq!(bench.run(1.0), None);
        if !saturated {
            // It comes to rest by and by.
            for _ in 0..100 {
                bench.error -= 0.01;
                assert_eq!(bench.run(PERIOD), None);
            }
        }
        bench.still = true;
        bench.error = error;
        if !saturated {
            assert_eq!(bench.run(2.0 * PERIOD), None);
        }
        let (time, event) = bench.run(3.0).unwrap();
        if saturated {
            assert_eq!(event.cause, Cause::Frozen(0));
            assert!((1.15..1.25).contains(&time), "{time} s");
        } else {
            // What it is stopped for is that it does not follow.
            assert_eq!(event.cause, Cause::Tracking(0));
        }
    }
}

/// A count is the least change that an encoder can show: a shaft that went by one, and stands, came to rest as gradually
/// as can be seen. From two counts it dropped.
#[test]
fn a_shaft_that_stops_within_a_count_came_to_rest() {
    // One count within a period is 0.2, more than a tenth of what is asked for.
    let count = 0.2;
    for (counts, dropped, dead) in [
        (0.0, count, true),
        (count * PERIOD, count, false),
        (count * PERIOD, 2.0 * count, true),
    ] {
        let mut bench = Bench::counting(counts);
        bench.still = true;
        bench.error = dropped - 1.0;
        assert_eq!(bench.run(2.0 * PERIOD), None);
        bench.error = -1.0;
        let (time, event) = bench.run(3.0).unwrap();
        if dead {
            assert_eq!(event.cause, Cause::Frozen(0), "{counts} {dropped}");
            assert!((0.3..0.4).contains(&time), "{time} s");
        } else {
            // What it is stopped for is that it does not follow.
            assert_eq!(event.cause, Cause::Tracking(0));
            assert!(time > 0.9, "{time} s");
        }
    }
}

#[test]
fn a_lost_track_costs_the_learned_model_first_and_then_the_run() {
    let mut bench = Bench::proved();
    bench.error = 0.7;
    // First what was good last, then the model file's own values, which predict no worse.
    for value in [3.0, 2.0] {
        let (time, event) = bench.run(3.0).unwrap();
        assert_eq!(
            (event.action, event.cause),
            (Action::FellBack, Cause::Tracking(0))
        );
        assert!((1.0..1.1).contains(&time), "{time} s");
        let told = (bench.model.0, bench.observer.restarted);
        assert_eq!(told, (value, Some(value)));
    }
    let (time, event) = bench.run(3.0).unwrap();
    assert_eq!(
        (event.action, event.cause),
        (Action::Stopped, Cause::Tracking(0))
    );
    assert!((1.0..1.1).contains(&time) && (event.limit - 0.5).abs() < 1e-6);
    // A loop that does not learn has nothing to fall back from.
    let mut plain = Bench::new();
    plain.error = 0.7;
    assert_eq!(plain.run(3.0).unwrap().1.action, Action::Stopped);
    // A first guess that does not track is left for what predicts better.
    let mut guess = Bench::new();
    guess.observer.theta = Some(3.0);
    guess.observer.idle = true;
    guess.observer.innovation = 0.01;
    guess.observer.residual = 0.05;
    guess.error = 0.7;
    let (_, event) = guess.run(3.0).unwrap();
    assert_eq!(
        (event.action, event.cause),
        (Action::Resumed, Cause::Tracking(0))
    );
    assert_eq!(guess.model.0, 3.0);
    // Short of the limit, or not for long enough: nothing.
    let mut plain = Bench::new();
    plain.error = 0.4;
    assert_eq!(plain.run(3.0), None);
    plain.error = 0.7;
    assert_eq!(plain.run(0.9), None);
    plain.error = 0.0;
    assert_eq!(plain.run(3.0), None);
}

#[test]
fn sensors_that_say_nothing_stop_the_run() {
    let stops = |change: fn(&mut Bench), cause: Cause, after: f32| {
        let mut bench = Bench::new();
        assert_eq!(bench.run(1.0), None);
        change(&mut bench);
        let (time, event) = bench.run(3.0).unwrap();
        assert_eq!((event.action, event.cause), (Action::Stopped, cause));
        assert!(
            (after - 1e-4..after + 0.05).contains(&time),
            "{cause:?} after {time} s"
        );
    };
    stops(|b| b.fresh = false, Cause::Stale, 0.2);
    stops(|b| b.error = f32::NAN, Cause::Stale, 0.2);
    stops(|b| b.error = 20.0, Cause::Range(0), 0.0);
    stops(
        |b| {
            b.still = true;
            b.error = -1.0;
        },
        Cause::Frozen(0),
        0.3,
    );
    // At rest where it should be, a signal may keep its value for ever.
    let mut rest = Bench::new();
    rest.reference = 0.0;
    rest.still = true;
    assert_eq!(rest.run(5.0), None);
}

#[test]
fn what_no_model_explains_stops_the_run() {
    let mut bench = Bench::proved();
    assert_eq!(bench.run(5.0), None);
    bench.observer.innovation = 1.0;
    bench.observer.residual = 1.0;
    let (time, event) = bench.run(5.0).unwrap();
    assert_eq!(
        (event.action, event.cause),
        (Action::Stopped, Cause::Innovation(0))
    );
    assert!(
        (1.0..1.5).contains(&time) && event.value > 5.0,
        "{event:?} {time} s"
    );
}
