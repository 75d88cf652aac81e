//! What wheels and the driver of a robot do to their bridges.

use loopsight_core::{Driver, DriverError, DriverFault};
use proptest::prelude::*;

use super::*;

/// A wheel on a bridge that shows its pins on a tape.
type TapedWheel = Wheel<f32, SignMagnitude<Taped, Taped, Taped, Taped>, Positions>;

fn wheel(tape: &Tape, settings: WheelSettings<f32>, positions: &[u32]) -> TapedWheel {
    Wheel::new(tape.bridge(), Positions(positions.to_vec()), settings)
}

#[test]
fn volts_are_held_to_limit_slew_and_dead_time() {
    let settings = WheelSettings {
        slew: 200.0,
        dead_ticks: 2,
        ..WheelSettings::new(6.0)
    };
    let mut wheel = wheel(&Tape::default(), settings, &[]);
    let asked = [9.0, 9.0, 9.0, 9.0, 1.0, 1.0, 1.0, -9.0, -9.0, -9.0, -9.0];
    let got: Vec<f32> = asked
        .iter()
        .map(|u| wheel.drive(*u, 10.0, 0.01).unwrap())
        .collect();
    let expected = [2.0, 4.0, 6.0, 6.0, 4.0, 2.0, 1.0, 0.0, 0.0, -2.0, -4.0];
    for (got, expected) in got.iter().zip(expected) {
        assert!((got - expected).abs() < 1e-5, "{got} V, {expected} V");
    }
    // Ticks that were at 0 V anyway count as dead time; the same direction needs none.
    for (asked, expected) in [
        (0.0, -2.0),
        (0.0, 0.0),
        (0.0, 0.0),
        (9.0, 2.0),
        (0.0, 0.0),
        (1.0, 1.0),
    ] {
        let got = wheel.drive(asked, 10.0, 0.01).unwrap();
        assert!((got - expected).abs() < 1e-5, "{got} V, {expected} V");
    }
}

#[test]
fn a_volt_is_a_volt_while_the_battery_runs_down() {
    let tape = Tape::default();
    let mut wheel = wheel(&tape, WheelSettings::new(12.0), &[]);
    for (supply, duty, applied) in [
        (12.0, 500, 6.0),
        (10.0, 600, 6.0),
        (8.0, 750, 6.0),
        (5.0, 1000, 5.0),
    ] {
        let got = wheel.drive(6.0, supply, 0.01).unwrap();
        assert!((got - applied).abs() < 1e-5, "{got} V, {applied} V");
        assert_eq!(tape.heard().last().unwrap(), &format!("pwm {duty}"));
    }
}

#[test]
fn wires_the_other_way_round() {
    let tape = Tape::default();
    let settings = WheelSettings {
        motor_reversed: true,
        encoder_reversed: true,
        ..WheelSettings::new(12.0)
    };
    let mut wheel = wheel(&tape, settings, &[10, 65_531, 3]);
    let counts = [(); 3].map(|()| wheel.counts().unwrap());
    assert_eq!(counts, [0, 15, -8]);
    assert_eq!(
        wheel.counts(),
        Err(WheelError::Encoder("the counter is gone"))
    );
    let applied = wheel.drive(3.0, 12.0, 0.01).unwrap();
    assert!((applied - 3.0).abs() < 1e-6);
    assert!(tape.heard().contains(&"direction low".to_owned()));
}

type Motors = TwilMotor<f32, Pair<TapedWheel, TapedWheel>, Meter, [f32; 4]>;

fn motors(tape: &Tape, supply: &[f32]) -> Motors {
    let right = wheel(tape, WheelSettings::new(12.0), &[0, 100, 150]);
    let left = wheel(tape, WheelSettings::new(12.0), &[0, 100, 50]);
    TwilMotor::new(
        Pair { right, left },
        Meter(supply.to_vec()),
        [1.0, 0.0, 0.0, 1.0],
        0.01,
        Watchdog::new(3, 2),
    )
    .with_least_supply(9.0)
}

const COAST: [&str; 3] = ["pwm 0", "enable low", "brake low"];
const BRAKE: [&str; 3] = ["pwm 0", "brake high", "enable high"];

#[test]
fn counts_come_out_and_times_go_on() {
    let mut driver = motors(&Tape::default(), &[12.0; 3]);
    let mut y = [f32::NAN; 2];
    let times = [0.0, 0.01, 0.02];
    for (time, counts) in times
        .into_iter()
        .zip([[0.0, 0.0], [100.0, 100.0], [50.0, -50.0]])
    {
        let sample = driver.read(&mut y).unwrap();
        assert_eq!((sample.fresh, y), (true, counts));
        assert!((sample.time - time).abs() < 1e-6);
    }
    let error = driver.read(&mut y).unwrap_err();
    let gone = PairError::Right(WheelError::Encoder("the counter is gone"));
    assert_eq!(
        (error.kind(), error),
        (DriverFault::Io, TwilMotorError::Wheel(gone))
    );
    let short = driver.read(&mut y[..1]).unwrap_err();
    assert_eq!(
        short,
        TwilMotorError::Length {
            found: 1,
            expected: 2
        }
    );
}

#[test]
fn without_commands_the_motors_coast_and_then_brake_until_armed_again() {
    let tape = Tape::default();
    let mut driver = motors(&tape, &[12.0; 9]);
    let mut applied = [0.0; 2];
    driver.write(&[6.0, -6.0], &mut applied).unwrap();
    assert_eq!(driver.tick(), Ok(None));
    assert_eq!(driver.tick(), Ok(None));
    driver.write(&[6.0, -6.0], &mut applied).unwrap();
    tape.heard();
    assert_eq!([driver.tick(), driver.tick()], [Ok(None), Ok(None)]);
    assert!(tape.heard().is_empty());
    assert_eq!(driver.tick(), Ok(Some(Guard::Coasting)));
    assert_eq!(tape.heard(), [COAST, COAST].concat());
    let error = driver.write(&[6.0, 6.0], &mut applied).unwrap_err();
    assert_eq!(error, TwilMotorError::Halted(Guard::Coasting));
    assert_eq!(
        (error.kind(), applied),
        (DriverFault::Disconnected, [0.0; 2])
    );
    assert_eq!(
        [driver.tick(), driver.tick()],
        [Ok(None), Ok(Some(Guard::Braking))]
    );
    assert_eq!(tape.heard(), [BRAKE, BRAKE].concat());
    assert_eq!([driver.tick(), driver.tick()], [Ok(None), Ok(None)]);
    assert!(driver.write(&[6.0, 6.0], &mut applied).is_err());
    assert!(tape.heard().is_empty());
    driver.rearm();
    driver.write(&[6.0, 3.0], &mut applied).unwrap();
    assert_eq!(applied, [6.0, 3.0]);
}

#[test]
fn what_cannot_be_stops_the_motors_and_says_why() {
    let tape = Tape::default();
    let stopped = |command: [f32; 2], supply: &[f32]| {
        let mut driver = motors(&tape, supply);
        let mut applied = [1.0; 2];
        driver.write(&[6.0, 6.0], &mut [0.0; 2]).unwrap();
        tape.heard();
        let error = driver.write(&command, &mut applied).unwrap_err();
        assert_eq!(tape.heard(), [BRAKE, BRAKE].concat());
        assert_eq!(applied, [0.0; 2]);
        // It stays so whatever comes, and however long.
        assert_eq!(
            driver.write(&[6.0, 6.0], &mut applied),
            Err(TwilMotorError::Halted(Guard::Stopped))
        );
        for _ in 0..9 {
            assert_eq!(driver.tick(), Ok(None));
        }
        assert!(tape.heard().is_empty());
        error
    };
    let nan = stopped([1.0, f32::NAN], &[12.0; 2]);
    assert_eq!(
        (nan.kind(), nan),
        (DriverFault::Rejected, TwilMotorError::NotFinite(1))
    );
    assert_eq!(
        stopped([f32::INFINITY, 0.0], &[12.0; 2]),
        TwilMotorError::NotFinite(0)
    );
    let low = stopped([6.0, 6.0], &[12.0, 8.9]);
    let (volts, least) = (8.9, 9.0);
    assert_eq!(
        (low.kind(), low),
        (DriverFault::Io, TwilMotorError::SupplyLow { volts, least })
    );
    assert_eq!(
        low.to_string(),
        "the supply is 8.9 V, expected at least 9.0 V"
    );
    assert!(matches!(
        stopped([6.0, 6.0], &[12.0, f32::NAN]),
        TwilMotorError::SupplyLow { .. }
    ));
    assert_eq!(
        stopped([6.0, 6.0], &[12.0]),
        TwilMotorError::Supply("the meter is gone")
    );
}

#[test]
fn a_stop_shorts_both_motors_though_one_fails() {
    let mut duty = Pwm::new(&[
        Duty::max_duty_cycle(STEPS),
        Duty::set_duty_cycle(0).with_error(broken()),
    ]);
    let (mut direction, tape) = (pin(""), Tape::default());
    let failing = SignMagnitude::new(duty.clone(), direction.clone());
    let settings = WheelSettings::new(12.0);
    let right = Wheel::new(failing, Positions(vec![]), settings);
    let left = wheel(&tape, settings, &[]);
    let wheels = Pair { right, left };
    let dog = Watchdog::new(3, 2);
    let mut driver = TwilMotor::new(wheels, FixedSupply(12.0f32), [1.0; 2], 0.01, dog);
    let error = driver.safe_stop().unwrap_err();
    let pin = PairError::Right(WheelError::Bridge(BridgeError::Pwm(broken())));
    assert_eq!(error, TwilMotorError::Wheel(pin));
    assert_eq!(tape.heard(), BRAKE);
    assert_eq!(driver.guard(), Guard::Stopped);
    duty.done();
    direction.done();
}

proptest! {
    /// What is said to be applied is what the duty makes of the supply, and within all limits.
    #[test]
    fn what_is_applied_is_what_the_bridge_does(
        asked in proptest::collection::vec((-30.0..30.0f64, 6.0..15.0f64), 1..80),
        limit in 1.0..20.0f64,
        slew in 50.0..5000.0f64,
        locked in any::<bool>(),
        steps in 2u16..5000,
    ) {
        let duty = Arc::new(Mutex::new((0u16, true)));
        let settings = WheelSettings { slew, dead_ticks: 1, ..WheelSettings::new(limit) };
        let mut magnitude = Wheel::new(
            SignMagnitude::new(Last(duty.clone(), steps), Last(duty.clone(), steps)), Positions(vec![]), settings);
        let mut antiphase = Wheel::new(LockedAntiphase::new(Last(duty.clone(), steps)), Positions(vec![]), settings);
        let mut before = 0.0;
        for (volts, supply) in asked {
            let applied = if locked { antiphase.drive(volts, supply, 0.01) } else { magnitude.drive(volts, supply, 0.01) };
            let applied = applied.map_err(|e| TestCaseError::fail(format!("{e:?}")))?;
            let (high, forward) = *duty.lock().unwrap();
            let share = f64::from(high) / f64::from(steps);
            let sign = if forward { 1.0 } else { -1.0 };
            let mean = if locked { supply * (2.0 * share - 1.0) } else { supply * share * sign };
            prop_assert!((applied - mean).abs() < 1e-9);
            // Half a step of the PWM, from end to end of a locked antiphase.
            let step = 15.0 / f64::from(steps) + 1e-9;
            prop_assert!(applied.abs() <= limit.min(supply) + step);
            // A falling supply may take volts away faster than the slew.
            let reach = slew * 0.01 + 2.0 * step;
            prop_assert!((applied - before).abs() <= reach || applied.abs() < before.abs());
            before = applied;
        }
    }
}
