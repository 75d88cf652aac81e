//! A Twil to test with: its configuration, and a robot that hides friction behind its motors.

#![allow(
    dead_code,
    clippy::unwrap_used,
    reason = "shared by tests, each of which uses some of it"
)]

use heapless::Vec;
use loopsight_core::{Physics, Plant, Reading, Role, rk4_step};
use loopsight_link::*;
use loopsight_onboard::{Session, Twil};
use loopsight_plants::Ddmr;
use loopsight_plants::effects::CoulombFriction;

/// Period, µs.
pub(crate) const PERIOD_US: u32 = 10_000;
/// The robot, as it is.
pub(crate) const TRUE: [f64; 8] = [-15.146, 0.005, 0.136, -9.573, -3.945, 0.656, 0.131, 0.05];
/// The robot, as it is believed to be.
pub(crate) const BELIEVED: [f32; 8] = [-12.0, 0.0, 0.11, -8.0, -3.0, 0.55, 0.131, 0.05];
/// Friction at the wheels, V, and the speed below which its sign is smoothed, rad/s.
pub(crate) const FRICTION: [f64; 2] = [0.9, 0.3];

pub(crate) fn list<T: Clone, const N: usize>(values: &[T]) -> Vec<T, N> {
    Vec::from_slice(values).unwrap()
}

/// Adaptive, friction compensated, the paper's gains.
pub(crate) fn configuration() -> Configuration {
    let open = 1e3;
    Configuration {
        plant: "ddmr".try_into().unwrap(),
        parameters: list(&BELIEVED),
        effects: list(&[Attachment {
            id: "coulomb_friction".try_into().unwrap(),
            channels: list(&[0, 1]),
            values: list(&FRICTION.map(|v| v as f32)),
        }]),
        bands: list(&[0.04, 0.3]),
        means: true,
        learning: Some(Learning {
            forgetting: 0.999,
            initial_covariance: 1e4,
            covariance_limit: 1e4,
            low: list(&[-open, -open, 0.02, -open, -open, 0.1, 0.0, 0.0]),
            high: list(&[0.0, open, open, 0.0, open, open, open, open]),
            scale: list(&[1.0, 0.1, 0.1, 1.0, 1.0, 0.1, 0.1, 0.1]),
            dead_zone: list(&[0.0, 0.0]),
            least_excitation: list(&[0.0125, 0.05]),
            window: 200.0,
            certainty_equivalence: true,
        }),
        controller: ControllerGains {
            proportional: list(&[17.78, 17.78]),
            integral: list(&[79.01, 79.01]),
            limit: list(&[12.0, 12.0]),
        },
        safety: Safety {
            watchdog_ticks: 10,
            stale_us: 5_000,
            stale_ticks: 20,
            least_supply: 9.6,
            encoder_ticks: 50,
            encoder_input: 2.5,
        },
    }
}

/// The steps of the Twil's loop: one after the other, held for 1.5 s.
pub(crate) fn reference(tick: u32) -> [f32; 2] {
    const FORWARD: [f32; 10] = [0.0, 0.05, 0.1, 0.05, 0.0, -0.05, -0.1, -0.05, 0.03, 0.08];
    const TURN: [f32; 7] = [0.0, 0.2, 0.6, 0.3, -0.3, -0.6, -0.2];
    let of = |list: &[f32], held: u32| list[(tick / held) as usize % list.len()];
    [of(&FORWARD, 150), of(&TURN, 210)]
}

/// A robot with friction and encoders.
pub(crate) struct Body {
    pub(crate) x: [f64; 6],
    /// Counts of the encoders at the last sample.
    counts: [f64; 2],
    pub(crate) friction: [f64; 2],
    /// Braking of the yaw, of its rate, 1/s.
    pub(crate) yaw_drag: f64,
}

impl Default for Body {
    fn default() -> Self {
        Self {
            x: [0.0; 6],
            counts: [0.0; 2],
            friction: FRICTION,
            yaw_drag: 0.0,
        }
    }
}

impl Body {
    /// One period with these voltages; forward speed and yaw rate by odometry from 8192 counts per turn.
    pub(crate) fn drive(&mut self, volts: &[f32]) -> [f32; 2] {
        let u = [f64::from(volts[0]), f64::from(volts[1])];
        let (friction, drag) = (self.friction, self.yaw_drag);
        for _ in 0..4 {
            rk4_step(&mut self.x, 0.0025, |x| {
                let mut w = [0.0; 4];
                for (i, w) in w.iter_mut().take(2).enumerate() {
                    *w = rubbing(Ddmr::output(i, x, &u, &TRUE), &friction);
                }
                w[3] = -drag * x[1];
                Ddmr::derivative(x, &u, &w, &TRUE)
            });
        }
        let (half_track, radius) = (TRUE[6], TRUE[7]);
        let per_turn = 8192.0 / core::f64::consts::TAU;
        let mut wheel = [0.0; 2];
        for (i, speed) in wheel.iter_mut().enumerate() {
            let count = (Ddmr::output(4 + i, &self.x, &u, &TRUE) * per_turn).round();
            *speed = (count - self.counts[i]) / per_turn / (f64::from(PERIOD_US) * 1e-6);
            self.counts[i] = count;
        }
        let v = radius * (wheel[0] + wheel[1]) / 2.0;
        let omega = radius * (wheel[0] - wheel[1]) / (2.0 * half_track);
        [v as f32, omega as f32]
    }
}

/// Friction at a wheel that turns at `flow`, rad/s; in V.
fn rubbing(flow: f64, friction: &[f64; 2]) -> f64 {
    let reading = Reading::nothing().with(Role::Flow, &flow);
    CoulombFriction.contribution(&reading, &[], friction)
}

/// A robot on the other end of a line that is a function call.
pub(crate) struct Line {
    pub(crate) robot: Session<Twil, ()>,
}

impl Default for Line {
    fn default() -> Self {
        Self {
            robot: Session::new(PERIOD_US, ()),
        }
    }
}

impl Line {
    /// Sends bytes; what the robot says.
    pub(crate) fn bytes(&mut self, bytes: &[u8]) -> std::vec::Vec<Reply> {
        let mut said = std::vec::Vec::new();
        for byte in bytes {
            self.robot
                .take(*byte, &mut |reply| said.push(reply.clone()));
        }
        said
    }

    pub(crate) fn send(&mut self, request: &Request) -> std::vec::Vec<Reply> {
        self.bytes(&frame(request))
    }

    /// A period of the robot's own timer.
    pub(crate) fn elapsed(&mut self) -> std::vec::Vec<Reply> {
        let mut said = std::vec::Vec::new();
        self.robot.elapsed(&mut |reply| said.push(reply.clone()));
        said
    }
}

pub(crate) fn frame(request: &Request) -> std::vec::Vec<u8> {
    let mut buffer = [0; LONGEST];
    let length = encode(request, &mut buffer).unwrap();
    buffer[..length].to_vec()
}

pub(crate) fn hello(session: u32) -> Request {
    Request::Hello(Hello {
        version: VERSION,
        session,
    })
}

pub(crate) fn configure(session: u32, configuration: Configuration) -> Request {
    Request::Configure {
        session,
        configuration,
    }
}

pub(crate) fn step(session: u32, tick: u32, measured: [f32; 2]) -> Measured {
    Measured {
        session,
        tick,
        age_us: 200,
        supply: 12.0,
        measured: list(&measured),
        reference: list(&reference(tick)),
    }
}
