//! What is written to the kernel's files, and made of what is read from them.

use super::*;

const RIGHT: &str = "class/pwm/pwmchip0/pwm0";

#[test]
fn everything_is_opened_at_the_first_reading_and_bridges_are_off_until_then() {
    let fake = Fake::new();
    let mut board = fake.board(&fake.settings());
    board.safe_stop().unwrap();
    assert!(fake.journal().is_empty());
    assert_eq!(
        board.write(&[0.0; 2], &mut [0.0; 2]).unwrap_err().fault,
        DriverFault::Rejected
    );
    let mut y = [1.0; 2];
    assert!(board.read(&mut y).unwrap().fresh);
    assert_eq!(y, [0.0; 2]);
    // Enable and direction of the right motor, then of the left one.
    assert_eq!(fake.journal(), ["6 low", "5 low", "19 low", "13 low"]);
    assert_eq!(fake.get(&format!("{RIGHT}/period")), "50000");
    assert_eq!(fake.get(&format!("{RIGHT}/enable")), "1");
    assert_eq!(fake.duties(), [0, 0]);
    let count = "bus/counter/devices/counter1/count0";
    assert_eq!(fake.get(&format!("{count}/function")), "quadrature x4");
    assert_eq!(fake.get(&format!("{count}/enable")), "1");
}

#[test]
fn volts_become_duties_and_directions() {
    let fake = Fake::new();
    let mut board = fake.board(&fake.settings());
    board.read(&mut [0.0; 2]).unwrap();
    fake.journal();
    let mut applied = [0.0; 2];
    board.write(&[6.0, 3.0], &mut applied).unwrap();
    // The left motor is the other way round.
    assert_eq!((applied, fake.duties()), ([6.0, 3.0], [25_000, 12_500]));
    assert_eq!(fake.journal(), ["5 high", "6 high", "13 low", "19 high"]);
    board.write(&[-3.0, 20.0], &mut applied).unwrap();
    assert_eq!((applied, fake.duties()), ([-3.0, 12.0], [12_500, 50_000]));
    assert_eq!(fake.journal(), ["5 low"]);
    board.safe_stop().unwrap();
    assert_eq!(fake.duties(), [0, 0]);
    assert_eq!(fake.journal(), ["6 high", "19 high"]);
    let error = board.write(&[1.0, 1.0], &mut applied).unwrap_err();
    assert_eq!((error.fault, applied), (DriverFault::Rejected, [0.0; 2]));
    assert_eq!(fake.duties(), [0, 0]);
}

#[test]
fn locked_antiphase_begins_in_the_middle_with_its_bridge_open() {
    let fake = Fake::new();
    let mut settings = fake.settings();
    for motor in settings.motor.values_mut() {
        motor.bridge = BridgeKind::LockedAntiphase;
        motor.direction = None;
        let line = motor.enable.as_ref().unwrap().number();
        motor.enable = Some(GpioLine::Table {
            line,
            active_low: true,
        });
        motor.brake = Some(GpioLine::High(line + 1));
    }
    let mut board = fake.board(&settings);
    board.read(&mut [0.0; 2]).unwrap();
    assert_eq!(fake.duties(), [25_000, 25_000]);
    assert_eq!(fake.journal(), ["6 high", "7 low", "19 high", "20 low"]);
    let mut applied = [0.0; 2];
    board.write(&[6.0, 6.0], &mut applied).unwrap();
    assert_eq!((applied, fake.duties()), ([6.0, 6.0], [37_500, 12_500]));
    assert_eq!(fake.journal(), ["7 low", "6 low", "20 low", "19 low"]);
    board.safe_stop().unwrap();
    assert_eq!(fake.duties(), [25_000, 25_000]);
    assert_eq!(fake.journal(), ["7 high", "6 low", "20 high", "19 low"]);
}

#[test]
fn counts_become_the_models_signals_and_wrap() {
    let fake = Fake::new();
    let mut board = fake.board(&fake.settings());
    let rate = std::f64::consts::TAU / 8192.0 / 0.01;
    let mut y = [0.0; 2];
    fake.count([65_500, 10]);
    board.read(&mut y).unwrap();
    for (counts, right, left) in [
        ([64, 110], 100.0, 100.0),
        ([64, 60], 0.0, -50.0),
        ([65_500, 65_520], -100.0, -76.0),
    ] {
        fake.count(counts);
        let sample = board.read(&mut y).unwrap();
        assert!(sample.fresh);
        let expected = [
            rate * WHEEL / 2.0 * (right + left),
            rate * WHEEL / (2.0 * HALF_TRACK) * (right - left),
        ];
        for (y, expected) in y.iter().zip(expected) {
            assert!((y - expected).abs() < 1e-9, "{y}, {expected}");
        }
    }
}

#[test]
fn a_late_reading_is_a_mean_over_its_own_time_and_not_fresh() {
    let fake = Fake::new();
    let mut board = fake.board(&fake.settings());
    let (mut on_time, mut late) = ([0.0; 2], [0.0; 2]);
    board.read(&mut on_time).unwrap();
    fake.count([100, 100]);
    assert!(board.read(&mut on_time).unwrap().fresh);
    *fake.now.lock().unwrap() += 0.01;
    fake.count([300, 300]);
    assert!(!board.read(&mut late).unwrap().fresh);
    assert!((on_time[0] - late[0]).abs() < 1e-9 && on_time[0] > 0.1);
}

#[test]
fn a_measured_supply_is_made_up_for() {
    let fake = Fake::new();
    let mut settings = fake.settings();
    let file = fake.path("bus/iio/devices/iio:device0/in_voltage0_raw");
    put(&file, "1200\n");
    settings.supply = SupplySetting::Measured {
        file: file.clone(),
        scale: 0.01,
    };
    settings.least_supply_v = 9.0;
    let mut board = fake.board(&settings);
    board.read(&mut [0.0; 2]).unwrap();
    let mut applied = [0.0; 2];
    board.write(&[6.0, 0.0], &mut applied).unwrap();
    assert_eq!(fake.duties(), [25_000, 0]);
    put(&file, "1000\n");
    board.write(&[6.0, 0.0], &mut applied).unwrap();
    assert_eq!((applied, fake.duties()), ([6.0, 0.0], [30_000, 0]));
    put(&file, "899\n");
    let error = board.write(&[6.0, 0.0], &mut applied).unwrap_err();
    assert_eq!(error.fault, DriverFault::Io);
    assert_eq!(
        error.message,
        "the supply is 8.99 V, expected at least 9.0 V"
    );
    assert_eq!((applied, fake.duties()), ([0.0; 2], [0, 0]));
}

#[test]
fn a_hanging_loop_is_noticed_by_a_thread_that_coasts_and_then_brakes() {
    let fake = Fake::new();
    let mut settings = fake.settings();
    (settings.coast_after, settings.then_brake) = (100, 20);
    let mut board = fake.board(&settings);
    board.read(&mut [0.0; 2]).unwrap();
    board.write(&[6.0, 6.0], &mut [0.0; 2]).unwrap();
    // Nothing is asserted of when, only that it comes: first the one, then the other.
    let expected = ["6 low", "19 low", "6 high", "19 high"];
    let mut seen = Vec::new();
    for _ in 0..3000 {
        seen.extend(fake.journal());
        if seen.ends_with(&expected.map(str::to_owned)) {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    // Two lines for each motor to open it, two to drive it, and then no others.
    assert_eq!(seen[8..], expected);
    assert_eq!(fake.duties(), [0, 0]);
    let error = board.write(&[6.0, 6.0], &mut [0.0; 2]).unwrap_err();
    assert_eq!(error.fault, DriverFault::Disconnected);
    assert!(error.message.contains("no command came in time"), "{error}");
    // A board that is let go leaves no thread and no motor running.
    drop(board);
    assert_eq!(
        (fake.journal(), fake.duties()),
        (vec!["6 high".to_owned(), "19 high".to_owned()], [0, 0])
    );
}

#[test]
fn reading_and_writing_allocate_nothing() {
    let fake = Fake::new();
    let mut board = fake.board(&fake.settings());
    let (mut y, mut applied) = ([0.0; 2], [0.0; 2]);
    board.read(&mut y).unwrap();
    board.write(&[1.0, 1.0], &mut applied).unwrap();
    fake.count([5, 7]);
    let counted = allocation_counter::measure(|| {
        board.read(&mut y).unwrap();
        board.write(&[2.0, 3.0], &mut applied).unwrap();
    });
    assert_eq!(counted.count_total, 0);
}
