//! The firmware with motors and encoders of its own on an emulated board, ticking by the board's own timer,
//! beside the same code on this machine.
//!
//! Needs `qemu-system-arm` and the firmware with the feature `body`, named by `LOOPSIGHT_FIRMWARE_BODY`.

#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

mod board;
mod twil;

use board::Board;
use loopsight_link::*;
use loopsight_onboard::{Sensors, Session, Twil};
use twil::*;

const SESSION: u32 = 0x7173;
const TICKS: u32 = 1000;

/// A step that brings a reference only.
fn wanted(tick: u32) -> Request {
    let mut step = step(SESSION, tick, [0.0; 2]);
    step.measured.clear();
    Request::Step(step)
}

/// A desk that measures what the board says it measured; what it does of it.
fn twin_of(twin: &mut Session<Twil, ()>, act: &Act) -> Act {
    let sensed = act.sensed.clone().unwrap();
    let mut step = step(SESSION, act.tick, [0.0; 2]);
    step.measured.clear();
    step.reference = sensed.reference;
    for byte in frame(&Request::Step(step)) {
        twin.take(byte, &mut |reply| panic!("{reply:?}"));
    }
    let sensors = Sensors {
        measured: [sensed.measured[0], sensed.measured[1]],
        supply: sensed.supply,
    };
    let mut said = Vec::new();
    twin.sensed(Some(sensors), &mut |reply| said.push(reply.clone()));
    let [Reply::Act(act)] = &said[..] else {
        panic!("{said:?}")
    };
    act.clone()
}

/// Every command and every parameter has the same bits, whenever a reference arrived; the robot follows, and
/// rests in time when its host is gone.
#[test]
#[ignore = "needs qemu-system-arm and the firmware, named by LOOPSIGHT_FIRMWARE_BODY"]
fn a_board_that_ticks_by_itself_does_what_the_desk_does() {
    let mut board = Board::with("LOOPSIGHT_FIRMWARE_BODY");
    let mut twin = Session::with_sensors(PERIOD_US, ());
    let mut configuration = configuration();
    // This machine may be busy with other things.
    configuration.safety.watchdog_ticks = 200;
    for request in [hello(SESSION), configure(SESSION, configuration)] {
        let mut said = Vec::new();
        for byte in frame(&request) {
            twin.take(byte, &mut |reply| said.push(reply.clone()));
        }
        assert_eq!([board.ask(&request)], said[..]);
    }
    board.send(&frame(&wanted(0)));
    let (mut error, mut moved, mut learned) = (0.0, 0.0, 0);
    for tick in 0..TICKS {
        let said = board.hear();
        let Reply::Act(mut act) = said else {
            panic!("tick {tick}: {said:?}")
        };
        board.send(&frame(&wanted(tick)));
        let desk = twin_of(&mut twin, &act);
        // What a tick costs is known on the board only.
        act.cost = desk.cost;
        let bits = |act: &Act| {
            let values = act.command.iter().chain(&act.parameters);
            values.map(|v| v.to_bits()).collect::<Vec<_>>()
        };
        assert_eq!((act.tick, bits(&act)), (tick, bits(&desk)));
        assert_eq!(act, desk);
        learned += act.learned.count_ones();
        let sensed = act.sensed.unwrap();
        // The loop's own delay is some ticks of every step.
        if tick % 150 > 100 {
            error += f64::from((sensed.measured[0] - sensed.reference[0]).powi(2));
            moved += f64::from(sensed.reference[0].powi(2));
        }
    }
    assert!(error < 0.05 * moved, "{error} of {moved}");
    assert!(learned > TICKS, "{learned} lessons of two regressions");
    // The host is gone.
    let mut periods = 0;
    let reason = loop {
        match board.hear() {
            Reply::Act(_) => periods += 1,
            Reply::Stopped { reason, .. } => break reason,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(reason, Reason::LinkLost);
    assert!(periods <= 200, "{periods}");
}
