//! What must bring a robot to rest does, says why, and nothing but a new configuration moves it again.

#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

mod twil;

use loopsight_link::*;
use twil::*;

const SESSION: u32 = 0x5eed;

/// A robot in the middle of a run: where it is, and its next tick.
struct Driving {
    line: Line,
    body: Body,
    measured: [f32; 2],
    tick: u32,
}

impl Driving {
    fn new() -> Self {
        Self::with(configuration())
    }

    fn with(configuration: Configuration) -> Self {
        let mut line = Line::default();
        assert!(matches!(line.send(&hello(SESSION))[..], [Reply::Hello(_)]));
        let told = line.send(&configure(SESSION, configuration));
        assert_eq!(told, [Reply::Configured { session: SESSION }]);
        assert_eq!(line.robot.output(), None);
        let mut driving = Self {
            line,
            body: Body::default(),
            measured: [0.0; 2],
            tick: 0,
        };
        for _ in 0..400 {
            driving.go();
        }
        driving
    }

    fn next(&self) -> Measured {
        step(SESSION, self.tick, self.measured)
    }

    /// One tick as it should be.
    fn go(&mut self) -> Act {
        let said = self.line.send(&Request::Step(self.next()));
        let [Reply::Act(act)] = &said[..] else {
            panic!("{said:?}")
        };
        assert!(self.line.elapsed().is_empty());
        self.measured = self.body.drive(&act.command);
        self.tick += 1;
        act.clone()
    }

    /// It came to rest for this reason, and stays there whatever its old host says.
    fn rests(&mut self, said: &[Reply], expected: Reason) {
        let [
            Reply::Stopped {
                session, reason, ..
            },
        ] = said
        else {
            panic!("{said:?}")
        };
        assert_eq!((*session, *reason), (SESSION, expected));
        assert_eq!(self.line.robot.output(), None);
        let again = self.line.send(&Request::Step(self.next()));
        assert!(matches!(again[..], [Reply::Stopped { .. }]), "{again:?}");
        assert_eq!(self.line.robot.output(), None);
        // It can be used again.
        self.line.send(&hello(7));
        let told = self.line.send(&configure(7, configuration()));
        assert_eq!(told, [Reply::Configured { session: 7 }]);
        let said = self.line.send(&Request::Step(step(7, 0, [0.0; 2])));
        assert!(matches!(said[..], [Reply::Act(_)]), "{said:?}");
    }

    /// Periods of the robot's timer until it rests; all that it says.
    fn wait(&mut self) -> (u32, Vec<Reply>) {
        let mut said = Vec::new();
        for periods in 1..100 {
            said.extend(self.line.elapsed());
            if self.line.robot.output().is_none() {
                return (periods, said);
            }
        }
        panic!("the robot goes on: {said:?}")
    }
}

/// Periods without a message that end a run, when one went by since the last.
fn watchdog() -> u32 {
    u32::from(configuration().safety.watchdog_ticks)
}

#[test]
fn it_drives_where_it_is_told_to() {
    let mut driving = Driving::new();
    let (mut error, mut moved) = (0.0, 0.0);
    for _ in 0..3000 {
        let wanted = reference(driving.tick);
        driving.go();
        // The loop's own delay is some ticks of every step.
        if driving.tick % 150 > 100 {
            error += f64::from((driving.measured[0] - wanted[0]).powi(2));
            moved += f64::from(wanted[0].powi(2));
        }
    }
    assert!(error < 0.01 * moved, "{error} of {moved}");
}

#[test]
fn a_link_that_is_cut() {
    let mut driving = Driving::new();
    let (periods, said) = driving.wait();
    assert_eq!(periods, watchdog());
    driving.rests(&said, Reason::LinkLost);
}

#[test]
fn half_a_frame_is_not_acted_upon() {
    let mut driving = Driving::new();
    let bytes = frame(&Request::Step(driving.next()));
    for cut in [1, bytes.len() / 2, bytes.len() - 2] {
        assert!(driving.line.bytes(&bytes[..cut]).is_empty());
        driving.line.bytes(&[0]);
    }
    let (periods, said) = driving.wait();
    assert_eq!(periods, watchdog());
    // The pieces are in the log, then the reason.
    assert_eq!(said[0], Reply::Log(Note::Dropped(3)));
    driving.rests(&said[1..], Reason::LinkLost);
}

#[test]
fn half_a_frame_and_then_the_whole_goes_on() {
    let mut driving = Driving::new();
    let bytes = frame(&Request::Step(driving.next()));
    driving.line.bytes(&bytes[..9]);
    driving.line.bytes(&[0]);
    assert_eq!(driving.line.elapsed(), [Reply::Log(Note::Dropped(1))]);
    driving.go();
}

/// Every bit of a step: none is acted upon, and the robot stops in time.
#[test]
fn flipped_bits() {
    let mut driving = Driving::new();
    let good = frame(&Request::Step(driving.next()));
    let before = *driving.line.robot.output().unwrap();
    for bit in 0..8 * good.len() {
        let mut bytes = good.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        bytes.push(0);
        assert!(driving.line.bytes(&bytes).is_empty(), "bit {bit}");
        assert_eq!(driving.line.robot.output(), Some(&before));
    }
    let (periods, said) = driving.wait();
    assert_eq!(periods, watchdog());
    driving.rests(&said[1..], Reason::LinkLost);
}

/// Frames that come, and are none to act upon, do not keep a robot going.
#[test]
fn what_is_no_step_does_not_feed_the_watchdog() {
    let mut driving = Driving::new();
    let mut said = Vec::new();
    for _ in 0..watchdog() {
        driving.line.bytes(&[3, 1, 2, 0]);
        said.extend(driving.line.elapsed());
    }
    assert_eq!(driving.line.robot.output(), None);
    said.retain(|reply| !matches!(reply, Reply::Log(_)));
    driving.rests(&said, Reason::LinkLost);
}

#[test]
fn a_host_that_was_started_anew() {
    let mut driving = Driving::new();
    let said = driving.line.send(&hello(SESSION + 1));
    let [stopped, Reply::Hello(welcome)] = &said[..] else {
        panic!("{said:?}")
    };
    assert_eq!(welcome.hello.session, SESSION + 1);
    driving.rests(std::slice::from_ref(stopped), Reason::HostRestarted);
}

#[test]
fn a_robot_that_was_started_anew() {
    let mut driving = Driving::new();
    driving.line = Line::default();
    let said = driving.line.send(&Request::Step(driving.next()));
    let expected = Reply::Stopped {
        session: 0,
        tick: 0,
        reason: Reason::OtherSession,
    };
    assert_eq!(said, [expected]);
    assert_eq!(driving.line.robot.output(), None);
}

#[test]
fn samples_that_are_stale() {
    let mut driving = Driving::new();
    let allowed = u32::from(configuration().safety.stale_ticks);
    for late in 1..100 {
        let mut old = driving.next();
        old.age_us = 30_000;
        let said = driving.line.send(&Request::Step(old));
        if let [Reply::Act(act)] = &said[..] {
            assert_eq!(act.learned, 0, "{late}");
            driving.measured = driving.body.drive(&act.command);
            driving.tick += 1;
            continue;
        }
        assert_eq!(late, allowed + 1);
        return driving.rests(&said, Reason::Stale);
    }
    panic!("the robot goes on")
}

/// A stale sample teaches nothing, nor does the one after it, which has nothing to differ from.
#[test]
fn one_stale_sample_costs_two_lessons() {
    let mut all = configuration();
    all.learning.as_mut().unwrap().least_excitation = list(&[0.0, 0.0]);
    let mut driving = Driving::with(all);
    while driving.go().learned != 0b11 {}
    let mut old = driving.next();
    old.age_us = 30_000;
    let said = driving.line.send(&Request::Step(old));
    let [Reply::Act(act)] = &said[..] else {
        panic!("{said:?}")
    };
    let parameters = act.parameters.clone();
    driving.measured = driving.body.drive(&act.command);
    driving.tick += 1;
    let next = driving.go();
    assert_eq!((act.learned, next.learned), (0, 0));
    assert_eq!(parameters, next.parameters);
    assert_eq!(driving.go().learned, 0b11);
}

#[test]
fn an_encoder_that_is_disconnected() {
    let mut driving = Driving::new();
    let allowed = u32::from(configuration().safety.encoder_ticks);
    let drives = |volts: f32| u32::from(volts.abs() > 2.5);
    // What was applied in the period that ends with the first silent sample counts.
    let mut silent = drives(driving.line.robot.output().unwrap()[0]);
    for _ in 0..2000 {
        let mut dead = driving.next();
        // The right wheel counts nothing: odometry from the left one alone.
        let left = driving.measured[0] - 0.131 * driving.measured[1];
        dead.measured = list(&[left / 2.0, -left / (2.0 * 0.131)]);
        let said = driving.line.send(&Request::Step(dead));
        if let [Reply::Act(act)] = &said[..] {
            silent = drives(act.command[0]) * (silent + 1);
            driving.measured = driving.body.drive(&act.command);
            driving.tick += 1;
            continue;
        }
        assert_eq!(silent, allowed);
        return driving.rests(&said, Reason::EncoderLost(0));
    }
    panic!("the robot goes on")
}

#[test]
fn what_is_no_number() {
    for (reference, at) in [(true, 0), (true, 1), (false, 0), (false, 1)] {
        for value in [f32::NAN, f32::INFINITY] {
            let mut driving = Driving::new();
            let mut bad = driving.next();
            let signals = if reference {
                &mut bad.reference
            } else {
                &mut bad.measured
            };
            signals[at] = value;
            let said = driving.line.send(&Request::Step(bad));
            driving.rests(&said, Reason::NotFinite);
        }
    }
    let mut driving = Driving::new();
    let mut short = driving.next();
    short.measured.pop();
    let said = driving.line.send(&Request::Step(short));
    driving.rests(&said, Reason::NotFinite);
}

#[test]
fn a_supply_that_sags() {
    for supply in [9.5, f32::NAN] {
        let mut driving = Driving::new();
        let mut weak = driving.next();
        weak.supply = supply;
        let said = driving.line.send(&Request::Step(weak));
        driving.rests(&said, Reason::SupplyLow);
    }
}

#[test]
fn steps_that_do_not_follow_one_another() {
    let mut driving = Driving::new();
    let mut skipped = driving.next();
    let expected = skipped.tick;
    skipped.tick += 1;
    let found = skipped.tick;
    let said = driving.line.send(&Request::Step(skipped));
    driving.rests(&said, Reason::OutOfOrder { expected, found });
}

#[test]
fn a_stop_that_was_asked_for() {
    let mut driving = Driving::new();
    let said = driving.line.send(&Request::Stop { session: SESSION });
    driving.rests(&said, Reason::Asked);
}

#[test]
fn another_version_opens_no_session() {
    let mut line = Line::default();
    let greeting = Request::Hello(Hello {
        version: VERSION + 1,
        session: SESSION,
    });
    let said = line.send(&greeting);
    let reason = Reason::Version {
        expected: VERSION,
        found: VERSION + 1,
    };
    assert!(
        matches!(&said[..], [Reply::Hello(w), Reply::Stopped { reason: r, .. }]
        if w.hello.version == VERSION && *r == reason)
    );
    let told = line.send(&configure(SESSION, configuration()));
    assert!(matches!(told[..], [Reply::Stopped { .. }]));
}

#[test]
fn a_configuration_that_cannot_be_used_is_refused_by_name() {
    type Spoil = fn(&mut Configuration);
    let cases: [(Spoil, Unusable); 15] = [
        (|c| c.plant = "dc_axis".try_into().unwrap(), Unusable::Plant),
        (|c| c.parameters[2] = f32::NAN, Unusable::Parameters),
        (|c| c.parameters[7] = 0.0, Unusable::Parameters),
        (|c| c.parameters.truncate(1), Unusable::Parameters),
        (
            |c| c.effects[0].id = "magnetism".try_into().unwrap(),
            Unusable::Effect(0),
        ),
        (|c| c.effects[0].values.truncate(1), Unusable::Effect(0)),
        (|c| c.effects[0].channels[1] = 6, Unusable::Channel(0)),
        (|c| c.effects[0].channels[1] = 99, Unusable::Channel(0)),
        (|c| c.bands[0] = f32::NAN, Unusable::Controller),
        (|c| c.controller.limit[1] = 0.0, Unusable::Controller),
        (|c| c.controller.integral.truncate(1), Unusable::Controller),
        (
            |c| c.learning.as_mut().unwrap().forgetting = 1.5,
            Unusable::Learning,
        ),
        (
            |c| c.learning.as_mut().unwrap().scale[0] = 0.0,
            Unusable::Learning,
        ),
        (|c| c.safety.watchdog_ticks = 0, Unusable::Safety),
        (|c| c.safety.least_supply = f32::NAN, Unusable::Safety),
    ];
    for (spoil, expected) in cases {
        let mut line = Line::default();
        line.send(&hello(SESSION));
        let mut spoilt = configuration();
        spoil(&mut spoilt);
        let said = line.send(&configure(SESSION, spoilt.clone()));
        let [Reply::Stopped { reason, .. }] = said[..] else {
            panic!("{said:?} to {spoilt:?}")
        };
        assert_eq!(reason, Reason::Configuration(expected));
        // A robot that runs comes to rest by it.
        let mut driving = Driving::new();
        let said = driving.line.send(&configure(SESSION, spoilt));
        driving.rests(&said, Reason::Configuration(expected));
    }
}

/// A range whose ends are no numbers bounds nothing: what it would learn could be anything.
#[test]
fn an_infinite_range_of_learning_is_refused() {
    let open = f32::INFINITY;
    for [low, high] in [
        [-open, -open],
        [open, open],
        [-open, open],
        [-open, 1.0],
        [-20.0, open],
        [f32::NAN, 1.0],
    ] {
        let mut line = Line::default();
        line.send(&hello(SESSION));
        let mut spoilt = configuration();
        let learning = spoilt.learning.as_mut().unwrap();
        (learning.low[0], learning.high[0]) = (low, high);
        let said = line.send(&configure(SESSION, spoilt));
        let [Reply::Stopped { reason, .. }] = said[..] else {
            panic!("{said:?} to [{low}, {high}]")
        };
        assert_eq!(reason, Reason::Configuration(Unusable::Learning));
        assert_eq!(line.robot.output(), None);
    }
}

/// A better model, sent while it drives: no jump of the command beyond what the model's change asks for.
#[test]
fn a_model_is_improved_on_the_run() {
    let mut driving = Driving::new();
    let mut better = configuration();
    better.parameters = list(&TRUE.map(|v| v as f32));
    better.learning = None;
    let told = driving.line.send(&configure(SESSION, better.clone()));
    assert_eq!(told, [Reply::Configured { session: SESSION }]);
    let act = driving.go();
    assert_eq!(act.parameters, better.parameters);
    assert_eq!(act.tick, driving.tick - 1);
    // Still on its reference: the integrals were kept.
    let wanted = reference(driving.tick);
    for _ in 0..20 {
        driving.go();
    }
    assert!((driving.measured[0] - wanted[0]).abs() < 0.02);
}
