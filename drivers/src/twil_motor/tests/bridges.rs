//! What each kind of bridge does to its pins.

use super::*;

fn drive(bridge: &mut impl Bridge<f32>, shares: &[f32]) -> Vec<f32> {
    shares.iter().map(|s| bridge.drive(*s).unwrap()).collect()
}

#[test]
fn sign_and_magnitude() {
    // unknown: to 0 before the direction; a new direction: through 0; coast; brake; on again.
    let mut duty = pwm(&[0, 250, 500, 0, 750, 0, 1000, 0, 0, 0, 100]);
    let mut direction = pin("hlh");
    let mut enable = pin("hlhh");
    let mut brake = pin("llhl");
    let mut bridge = SignMagnitude::new(duty.clone(), direction.clone())
        .with_enable(enable.clone())
        .with_brake(brake.clone());
    let set = drive(&mut bridge, &[0.25, 0.5, -0.75, 0.0, -1.0]);
    assert_eq!(set, [0.25, 0.5, -0.75, 0.0, -1.0]);
    Bridge::<f32>::coast(&mut bridge).unwrap();
    Bridge::<f32>::brake(&mut bridge).unwrap();
    assert_eq!(drive(&mut bridge, &[0.1]), [0.1]);
    for pin in [&mut direction, &mut enable, &mut brake] {
        pin.done();
    }
    duty.done();
    drop(bridge.free());
}

#[test]
fn locked_antiphase() {
    let mut duty = pwm(&[625, 500, 125, 1000, 500, 500, 0]);
    let (mut enable, mut brake) = (pin("hlhh"), pin("llhl"));
    let mut bridge = LockedAntiphase::new(duty.clone())
        .with_enable(enable.clone())
        .with_brake(brake.clone());
    let set = drive(&mut bridge, &[0.25, 0.0, -0.75, 1.0]);
    assert_eq!(set, [0.25, 0.0, -0.75, 1.0]);
    Bridge::<f32>::coast(&mut bridge).unwrap();
    Bridge::<f32>::brake(&mut bridge).unwrap();
    assert_eq!(drive(&mut bridge, &[-1.0]), [-1.0]);
    enable.done();
    brake.done();
    duty.done();
}

#[test]
fn bridges_without_optional_pins() {
    let (mut duty, mut direction) = (pwm(&[0, 500, 0, 0]), pin("h"));
    let mut bridge = SignMagnitude::new(duty.clone(), direction.clone());
    assert_eq!(drive(&mut bridge, &[0.5]), [0.5]);
    Bridge::<f32>::coast(&mut bridge).unwrap();
    Bridge::<f32>::brake(&mut bridge).unwrap();
    duty.done();
    direction.done();
    let mut duty = pwm(&[750, 500, 500]);
    let mut bridge = LockedAntiphase::new(duty.clone());
    assert_eq!(drive(&mut bridge, &[0.5]), [0.5]);
    Bridge::<f32>::coast(&mut bridge).unwrap();
    Bridge::<f32>::brake(&mut bridge).unwrap();
    duty.done();
}

#[test]
fn a_pin_that_acts_when_it_is_low() {
    let mut inner = pin("lh");
    let mut wrapped = ActiveLow(inner.clone());
    wrapped.set_high().unwrap();
    wrapped.set_low().unwrap();
    inner.done();
}

#[test]
fn each_pin_that_fails_is_named_and_the_others_are_set() {
    let fails = |level: State| Pin::new(&[Level::set(level).with_error(broken())]);
    // Driving: what comes after the failing pin is left alone.
    let mut duty = Pwm::new(&[
        Duty::max_duty_cycle(STEPS),
        Duty::set_duty_cycle(0).with_error(broken()),
        Duty::set_duty_cycle(0),
        Duty::set_duty_cycle(0),
        Duty::set_duty_cycle(0),
        Duty::set_duty_cycle(300).with_error(broken()),
        Duty::set_duty_cycle(0),
        Duty::set_duty_cycle(300),
    ]);
    let mut direction = Pin::new(&[
        Level::set(State::High).with_error(broken()),
        Level::set(State::High),
        Level::set(State::High),
        Level::set(State::High),
    ]);
    let mut enable = pin("hh");
    let mut brake = Pin::new(&[
        Level::set(State::Low).with_error(broken()),
        Level::set(State::Low),
        Level::set(State::Low),
    ]);
    let mut bridge = SignMagnitude::new(duty.clone(), direction.clone())
        .with_enable(enable.clone())
        .with_brake(brake.clone());
    assert_eq!(bridge.drive(0.3f32), Err(BridgeError::Pwm(broken())));
    assert_eq!(bridge.drive(0.3f32), Err(BridgeError::Direction(broken())));
    assert_eq!(bridge.drive(0.3f32), Err(BridgeError::Brake(broken())));
    assert_eq!(bridge.drive(0.3f32), Err(BridgeError::Pwm(broken())));
    // All of it is set again after a failure.
    assert_eq!(bridge.drive(0.3f32), Ok(0.3));
    for pin in [&mut direction, &mut enable, &mut brake] {
        pin.done();
    }
    duty.done();

    // Stopping: every pin is tried.
    let mut duty = Pwm::new(&[
        Duty::max_duty_cycle(STEPS),
        Duty::set_duty_cycle(0).with_error(broken()),
        Duty::set_duty_cycle(0),
    ]);
    let mut brake = pin("lh");
    let mut enable = Pin::new(&[
        Level::set(State::Low).with_error(broken()),
        Level::set(State::High).with_error(broken()),
    ]);
    let mut never = pin("");
    let mut bridge = SignMagnitude::new(duty.clone(), never.clone())
        .with_enable(enable.clone())
        .with_brake(brake.clone());
    let coasting = Bridge::<f32>::coast(&mut bridge);
    assert_eq!(coasting, Err(BridgeError::Pwm(broken())));
    let braking = Bridge::<f32>::brake(&mut bridge);
    assert_eq!(braking, Err(BridgeError::Enable(broken())));
    for pin in [&mut never, &mut enable, &mut brake] {
        pin.done();
    }
    duty.done();

    let (mut duty, mut enable) = (pwm(&[650]), fails(State::High));
    let mut bridge = LockedAntiphase::new(duty.clone()).with_enable(enable.clone());
    assert_eq!(bridge.drive(0.3f32), Err(BridgeError::Enable(broken())));
    duty.done();
    enable.done();
}

#[test]
fn a_direction_changes_at_duty_0_only_and_brakes_are_released_first() {
    let tape = Tape::default();
    let mut bridge = tape.bridge();
    drive(&mut bridge, &[0.4]);
    assert_eq!(
        tape.heard(),
        [
            "pwm 0",
            "direction high",
            "brake low",
            "enable high",
            "pwm 400"
        ]
    );
    drive(&mut bridge, &[-0.4]);
    assert_eq!(tape.heard(), ["pwm 0", "direction low", "pwm 400"]);
    Bridge::<f32>::coast(&mut bridge).unwrap();
    assert_eq!(tape.heard(), ["pwm 0", "enable low", "brake low"]);
    Bridge::<f32>::brake(&mut bridge).unwrap();
    assert_eq!(tape.heard(), ["pwm 0", "brake high", "enable high"]);
    let mut other = LockedAntiphase::new(tape.pin("pwm")).with_enable(tape.pin("enable"));
    // Open first: at the old duty the motor would still be driven.
    Bridge::<f32>::coast(&mut other).unwrap();
    assert_eq!(tape.heard(), ["enable low", "pwm 500"]);
    // The middle stands before the bridge closes: it would begin with full reverse.
    drive(&mut other, &[0.0]);
    assert_eq!(tape.heard(), ["pwm 500", "enable high"]);
}
