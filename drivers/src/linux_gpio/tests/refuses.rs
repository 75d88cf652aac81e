//! What is wrong with a file or a board is named, and stops the motors.

use super::*;

fn refused(change: impl FnOnce(&mut LinuxGpio)) -> BuildError {
    let mut settings = example();
    change(&mut settings);
    plan(&settings, &twil_encoders()).unwrap_err()
}

fn right(settings: &mut LinuxGpio) -> &mut Motor {
    settings.motor.get_mut("voltage_right").unwrap()
}

#[test]
fn mistakes_in_the_file_are_pointed_at() {
    assert!(plan(&example(), &twil_encoders()).is_ok());
    let key = |change: fn(&mut LinuxGpio)| refused(change).key;
    assert_eq!(key(|s| s.pwm_hz = 0.0), "pwm_hz");
    assert_eq!(key(|s| s.supply = SupplySetting::Fixed(f64::NAN)), "supply");
    assert_eq!(key(|s| s.least_supply_v = -1.0), "least_supply_v");
    assert_eq!(key(|s| s.coast_after = 0), "coast_after");
    assert_eq!(
        key(|s| right(s).limit_v = 0.0),
        "motor.voltage_right.limit_v"
    );
    assert_eq!(
        key(|s| right(s).slew = Some(-2.0)),
        "motor.voltage_right.slew"
    );
    assert_eq!(key(|s| right(s).direction = None), "motor.voltage_right");
    assert_eq!(
        key(|s| right(s).bridge = BridgeKind::LockedAntiphase),
        "motor.voltage_right.direction"
    );
    let open = refused(|s| {
        let motor = right(s);
        motor.bridge = BridgeKind::LockedAntiphase;
        (motor.direction, motor.enable) = (None, None);
    });
    assert!(open.message.contains("enable pin"), "{open}");
    let error = refused(|s| {
        let motor = s.motor.remove("voltage_right").unwrap();
        s.motor.insert("voltage_rigth".to_owned(), motor);
    });
    assert_eq!(error.key, "motor.voltage_rigth");
    assert_eq!(error.help.unwrap(), "did you mean `voltage_right`?");
    let error = refused(|s| drop(s.motor.remove("voltage_left")));
    assert_eq!(
        error.help.unwrap(),
        "add [driver.linux_gpio.motor.voltage_left]"
    );
    let error = refused(|s| right(s).shaft = "shaft".to_owned());
    assert!(error.message.contains("`shaft_angle_right`"), "{error}");
    let tachometers = twil("\"instantaneous\"", "\"instantaneous\"");
    let error = plan(&example(), &tachometers).unwrap_err();
    assert!(error.message.contains("encoder counts only"), "{error}");
}

/// What the first reading says of a board with this wrong with it.
fn first_reading(spoil: impl FnOnce(&Fake, &mut LinuxGpio)) -> String {
    let fake = Fake::new();
    let mut settings = fake.settings();
    spoil(&fake, &mut settings);
    let error = fake.board(&settings).read(&mut [0.0; 2]).unwrap_err();
    assert_eq!(error.fault, DriverFault::Io);
    error.message
}

#[test]
fn what_a_board_lacks_is_named_by_its_file() {
    let said = first_reading(|_, s| right(s).pwm = [3, 0]);
    assert!(
        said.contains("pwmchip3: there is no such PWM chip"),
        "{said}"
    );
    let said = first_reading(|_, s| right(s).pwm = [0, 2]);
    assert!(
        said.contains("found channel 2, expected one below 2"),
        "{said}"
    );
    let said = first_reading(|_, s| right(s).counter = [4, 0]);
    assert!(
        said.contains("counter4/count0: there is no such counter"),
        "{said}"
    );
    let said = first_reading(|fake, _| {
        fake.set("bus/counter/devices/counter0/count0/ceiling", "0\n");
    });
    assert!(said.contains("ceiling: found 0"), "{said}");
    let said = first_reading(|fake, _| *fake.lines.broken.lock().unwrap() = Some(6));
    assert_eq!(said, "the motor of `voltage_right`: line 6 is broken");
    let said = first_reading(|fake, s| {
        let file = fake.path("in_voltage0_raw");
        s.supply = SupplySetting::Measured { file, scale: 0.01 };
    });
    assert!(said.contains("in_voltage0_raw"), "{said}");
}

/// The kernel refuses a line that is not there; this needs no board.
#[test]
fn a_chip_that_is_not_there_is_named() {
    let lines = super::super::bridge::CharacterDevices;
    let error = lines.open("/dev/gpiochip_nowhere", 4, PinState::Low).err();
    let error = error.unwrap();
    assert!(
        error.starts_with("line 4 of /dev/gpiochip_nowhere: "),
        "{error}"
    );
}

#[test]
fn a_counter_without_a_ceiling_has_32_bits_and_wide_ones_lend_theirs() {
    for (ceiling, range) in [
        (None, 1u64 << 32),
        (Some("18446744073709551615\n"), 1 << 32),
        (Some("8191\n"), 8192),
    ] {
        let fake = Fake::new();
        let file = "bus/counter/devices/counter0/count0/ceiling";
        match ceiling {
            Some(text) => fake.set(file, text),
            None => fs::remove_file(fake.path(file)).unwrap(),
        }
        let counter = super::super::counter::KernelCounter::open(fake.folder.path(), 0, 0).unwrap();
        assert_eq!(crate::twil_motor::Quadrature::range(&counter), range);
    }
}

/// A board in motion, and what its next command says after `spoil`; the motors have to stand then.
fn next_command(command: [f64; 2], spoil: impl FnOnce(&Fake)) -> (Fake, String) {
    let fake = Fake::new();
    let mut board = fake.board(&fake.settings());
    let mut applied = [0.0; 2];
    board.read(&mut [0.0; 2]).unwrap();
    board.write(&[6.0, 6.0], &mut applied).unwrap();
    spoil(&fake);
    let error = board.write(&command, &mut applied).unwrap_err();
    assert_eq!(applied, [0.0; 2]);
    (fake, error.message)
}

#[test]
fn what_fails_on_the_way_stops_the_motors_and_says_which_pin() {
    let (fake, said) = next_command([f64::NAN, 1.0], |_| ());
    assert_eq!(said, "the command for motor 0 is not a number");
    assert_eq!(fake.duties(), [0, 0]);
    let (fake, said) = next_command([-1.0, 1.0], |fake| {
        *fake.lines.broken.lock().unwrap() = Some(5)
    });
    let pin = "the motor of `voltage_right`: its direction pin failed: line 5 is broken";
    assert_eq!((said.as_str(), fake.duties()), (pin, [0, 0]));
    assert!(fake.level(19));
}

#[test]
fn a_pwm_and_a_counter_that_fail_are_named() {
    // A full disk stands for a PWM that refuses what is written.
    let fake = Fake::new();
    let duty = fake.path("class/pwm/pwmchip0/pwm1/duty_cycle");
    fs::remove_file(&duty).unwrap();
    std::os::unix::fs::symlink("/dev/full", &duty).unwrap();
    let said = fake
        .board(&fake.settings())
        .read(&mut [0.0; 2])
        .unwrap_err();
    assert!(said.message.contains("pwm1/duty_cycle"), "{said}");
    assert_eq!(fake.duties_of_right(), 0);
    let fake = Fake::new();
    let mut board = fake.board(&fake.settings());
    board.read(&mut [0.0; 2]).unwrap();
    fake.set("bus/counter/devices/counter1/count0/count", "gone\n");
    let error = board.read(&mut [0.0; 2]).unwrap_err();
    let encoder = "the encoder of `voltage_left`: ";
    assert!(error.message.starts_with(encoder), "{error}");
    assert!(
        error.message.ends_with("found `gone`, expected a number"),
        "{error}"
    );
}

impl Fake {
    fn duties_of_right(&self) -> u64 {
        let duty = self.get("class/pwm/pwmchip0/pwm0/duty_cycle");
        duty.parse().unwrap()
    }
}
