//! A robot with motors and encoders of its own, without a line: when it moves, and what brings it to rest.

#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

mod twil;

use loopsight_link::*;
use loopsight_onboard::{Sensors, Session, Twil};
use twil::*;

const SESSION: u32 = 0x5eed;

/// A robot by its own timer; what it says.
struct Own {
    robot: Session<Twil, ()>,
    body: Body,
    measured: [f32; 2],
    supply: f32,
}

impl Own {
    /// Greeted and configured.
    fn new() -> Self {
        let mut own = Self {
            robot: Session::with_sensors(PERIOD_US, ()),
            body: Body::default(),
            measured: [0.0; 2],
            supply: 12.0,
        };
        assert!(matches!(own.hear(&hello(SESSION))[..], [Reply::Hello(_)]));
        let told = own.hear(&configure(SESSION, configuration()));
        assert_eq!(told, [Reply::Configured { session: SESSION }]);
        own
    }

    fn hear(&mut self, request: &Request) -> Vec<Reply> {
        let mut said = Vec::new();
        for byte in frame(request) {
            self.robot.take(byte, &mut |reply| said.push(reply.clone()));
        }
        said
    }

    /// Its host wants it to be there.
    fn wants(&mut self, reference: [f32; 2]) -> Vec<Reply> {
        let mut step = step(SESSION, 0, [0.0; 2]);
        step.measured.clear();
        step.reference = list(&reference);
        self.hear(&Request::Step(step))
    }

    fn period(&mut self, sensors: Option<Sensors<[f32; 2]>>) -> Vec<Reply> {
        let mut said = Vec::new();
        self.robot
            .sensed(sensors, &mut |reply| said.push(reply.clone()));
        let volts = self.robot.output().copied().unwrap_or_default();
        self.measured = self.body.drive(&volts);
        said
    }

    fn go(&mut self) -> Vec<Reply> {
        let sensors = Sensors {
            measured: self.measured,
            supply: self.supply,
        };
        self.period(Some(sensors))
    }

    /// In the middle of a run.
    fn driving() -> Self {
        let mut own = Self::new();
        for _ in 0..200 {
            assert!(own.wants([0.1, 0.0]).is_empty());
            assert!(matches!(own.go()[..], [Reply::Act(_)]));
        }
        assert!((own.measured[0] - 0.1).abs() < 0.01, "{:?}", own.measured);
        own
    }

    fn rests(&self, said: &[Reply], expected: Reason) {
        let Some(Reply::Stopped {
            session, reason, ..
        }) = said.last()
        else {
            panic!("{said:?} where {expected:?} was expected")
        };
        assert_eq!((*session, *reason), (SESSION, expected));
        assert_eq!(self.robot.output(), None);
    }
}

#[test]
fn it_waits_for_its_host() {
    let mut own = Own::new();
    for _ in 0..100 {
        assert!(own.go().is_empty());
        assert_eq!(own.robot.output(), None);
    }
    // From the first step on it says in each of its periods what it measured and did.
    own.wants([0.1, 0.0]);
    let said = own.go();
    let [Reply::Act(act)] = &said[..] else {
        panic!("{said:?}")
    };
    let sensed = act.sensed.as_ref().unwrap();
    assert_eq!(
        (act.tick, &sensed.measured[..], &sensed.reference[..]),
        (0, &[0.0; 2][..], &[0.1, 0.0][..])
    );
    assert_eq!(own.robot.output().unwrap()[..], act.command[..]);
    assert!(act.command[0] > 1.0, "{act:?}");
}

/// Its own loop does not keep it going: only its host does.
#[test]
fn a_host_that_is_gone() {
    let mut own = Own::driving();
    let allowed = usize::from(configuration().safety.watchdog_ticks);
    for period in 0.. {
        let said = own.go();
        if let [Reply::Act(_)] = said[..] {
            assert!(period < allowed, "{period}");
            continue;
        }
        // One of the periods had gone by since the last step.
        assert_eq!(period, allowed - 1);
        return own.rests(&said, Reason::LinkLost);
    }
}

#[test]
fn what_its_own_sensors_may_say() {
    let mut own = Own::driving();
    let said = own.period(None);
    own.rests(&said, Reason::Hardware);
    for (measured, supply, expected) in [
        ([f32::NAN, 0.0], 12.0, Reason::NotFinite),
        ([0.1, 0.0], 9.0, Reason::SupplyLow),
        ([0.1, 0.0], f32::NAN, Reason::SupplyLow),
    ] {
        let mut own = Own::driving();
        let said = own.period(Some(Sensors { measured, supply }));
        own.rests(&said, expected);
        // Nothing but a new configuration moves it again.
        let said = own.wants([0.1, 0.0]);
        own.rests(&said, Reason::NotConfigured);
    }
    // Encoders that count nothing, however hard the motors are driven.
    let mut own = Own::driving();
    let mut said = Vec::new();
    for _ in 0..500 {
        own.wants([0.2, 0.0]);
        said = own.period(Some(Sensors {
            measured: [0.0; 2],
            supply: 12.0,
        }));
        if !matches!(said[..], [Reply::Act(_)]) {
            break;
        }
    }
    own.rests(&said, Reason::EncoderLost(0));
}

#[test]
fn a_measurement_of_the_host_is_none_of_its_own() {
    let mut own = Own::driving();
    let said = own.hear(&Request::Step(step(SESSION, 0, [0.1, 0.0])));
    own.rests(&said, Reason::OwnSensors);
}

/// A better model, sent while it drives.
#[test]
fn it_is_told_a_better_model_on_the_run() {
    let mut own = Own::driving();
    let mut better = configuration();
    better.parameters = list(&TRUE.map(|v| v as f32));
    better.learning = None;
    let told = own.hear(&configure(SESSION, better.clone()));
    assert_eq!(told, [Reply::Configured { session: SESSION }]);
    own.wants([0.1, 0.0]);
    let said = own.go();
    let [Reply::Act(act)] = &said[..] else {
        panic!("{said:?}")
    };
    assert_eq!((act.tick, &act.parameters), (200, &better.parameters));
    assert!((own.measured[0] - 0.1).abs() < 0.01, "{:?}", own.measured);
}

/// What the supply cannot give is not said to have been given.
#[test]
fn a_supply_below_the_limit_of_the_law() {
    let mut own = Own::new();
    own.supply = 10.0;
    own.wants([0.5, 0.0]);
    let said = own.go();
    let [Reply::Act(act)] = &said[..] else {
        panic!("{said:?}")
    };
    assert_eq!(&act.command[..], &[10.0, 10.0][..]);
    assert_eq!(own.robot.output(), Some(&[10.0, 10.0]));
}
