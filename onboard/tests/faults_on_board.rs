//! The firmware on an emulated board comes to rest by itself, and says why.
//!
//! What each fault does is held to the letter on a desk (`session.rs`); here the whole chain is: a line, an
//! interrupt, the board's own timer. Needs what `lockstep.rs` needs.

#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

mod board;
mod twil;

use board::Board;
use loopsight_link::*;
use twil::*;

/// A robot in the middle of a run on the board.
struct Driving {
    board: Board,
    body: Body,
    measured: [f32; 2],
    session: u32,
    tick: u32,
}

impl Driving {
    fn new() -> Self {
        Self {
            board: Board::start(),
            body: Body::default(),
            measured: [0.0; 2],
            session: 0,
            tick: 0,
        }
    }

    /// A new session, and two hundred ticks of it. The watchdog waits for two seconds: this machine may be
    /// busy with other things.
    fn begin(&mut self) {
        self.begin_with(200);
    }

    fn begin_with(&mut self, watchdog_ticks: u16) {
        self.session += 1;
        (self.tick, self.measured, self.body) = (0, [0.0; 2], Body::default());
        let mut configuration = configuration();
        configuration.safety.watchdog_ticks = watchdog_ticks;
        let said = self.board.ask(&hello(self.session));
        assert!(matches!(said, Reply::Hello(_)), "{said:?}");
        let said = self.board.ask(&configure(self.session, configuration));
        let session = self.session;
        assert_eq!(said, Reply::Configured { session });
        for _ in 0..200 {
            let act = self.go(&self.next());
            self.measured = self.body.drive(&act.command);
        }
    }

    fn next(&self) -> Measured {
        step(self.session, self.tick, self.measured)
    }

    fn go(&mut self, step: &Measured) -> Act {
        let said = self.board.ask(&Request::Step(step.clone()));
        let Reply::Act(act) = said else {
            panic!("tick {}: {said:?}", self.tick)
        };
        self.tick += 1;
        act
    }

    /// What it says next, but for lines of the log, is why it rests; a step does not move it.
    fn rests(&mut self, expected: Reason) {
        let said = self.board.hear();
        let Reply::Stopped { reason, .. } = said else {
            panic!("{said:?} where {expected:?} was expected")
        };
        assert_eq!(reason, expected);
        // Half a frame would take the next one with it.
        self.board.send(&[0]);
        let said = self.board.ask(&Request::Step(self.next()));
        assert!(matches!(said, Reply::Stopped { .. }), "{said:?}");
    }

    fn spoilt(&mut self, spoil: impl Fn(&mut Measured), expected: Reason) {
        self.begin();
        let mut step = self.next();
        spoil(&mut step);
        self.board.send(&frame(&Request::Step(step)));
        self.rests(expected);
    }
}

#[test]
#[ignore = "needs qemu-system-arm and the firmware, named by LOOPSIGHT_FIRMWARE"]
fn every_fault_ends_at_rest_with_its_reason() {
    let mut robot = Driving::new();

    // The link is cut: nothing comes any more.
    robot.begin_with(10);
    robot.rests(Reason::LinkLost);

    // Half a frame, and the line goes on with nothing.
    robot.begin_with(10);
    let bytes = frame(&Request::Step(robot.next()));
    robot.board.send(&bytes[..bytes.len() / 2]);
    robot.rests(Reason::LinkLost);

    // Flipped bits: what was accepted would be answered by an act.
    robot.begin_with(30);
    let good = frame(&Request::Step(robot.next()));
    for bit in (0..8 * good.len()).step_by(3) {
        let mut bytes = good.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        bytes.push(0);
        robot.board.send(&bytes);
    }
    robot.rests(Reason::LinkLost);

    // The host is started anew, and greets.
    robot.begin();
    robot.board.send(&frame(&hello(99)));
    let stopped = robot.board.hear();
    let session = robot.session;
    let reason = Reason::HostRestarted;
    assert!(
        matches!(stopped, Reply::Stopped { session: s, reason: r, .. } if s == session && r == reason),
        "{stopped:?}"
    );
    assert!(matches!(robot.board.hear(), Reply::Hello(_)));

    // The firmware is started anew, and knows of no session.
    robot.begin();
    robot.board = Board::start();
    let step = Request::Step(robot.next());
    robot.board.send(&frame(&step));
    robot.rests(Reason::OtherSession);

    robot.spoilt(|s| s.measured[0] = f32::NAN, Reason::NotFinite);
    robot.spoilt(|s| s.reference[1] = f32::NAN, Reason::NotFinite);
    robot.spoilt(|s| s.supply = 7.0, Reason::SupplyLow);

    // Stale samples, one after the other.
    robot.begin();
    for _ in 0..configuration().safety.stale_ticks {
        let mut old = robot.next();
        old.age_us = 30_000;
        let act = robot.go(&old);
        assert_eq!(act.learned, 0);
        robot.measured = robot.body.drive(&act.command);
    }
    let mut old = robot.next();
    old.age_us = 30_000;
    robot.board.send(&frame(&Request::Step(old)));
    robot.rests(Reason::Stale);

    // An encoder is disconnected: both signals stay at rest, however hard the motors are driven.
    robot.begin();
    let said = loop {
        let mut dead = robot.next();
        dead.measured = list(&[0.0, 0.0]);
        dead.reference = list(&[0.2, 0.0]);
        match robot.board.ask(&Request::Step(dead)) {
            Reply::Act(_) if robot.tick < 1000 => robot.tick += 1,
            said => break said,
        }
    };
    let Reply::Stopped { reason, .. } = said else {
        panic!("{said:?}")
    };
    assert_eq!(reason, Reason::EncoderLost(0));
}
