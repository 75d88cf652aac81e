//! A Twil with dry bearings, simulated on the board: motors and encoders where there are none.

use loopsight_core::{Physics, Plant, Reading, Role, rk4_step};
use loopsight_onboard::Sensors;
use loopsight_plants::Ddmr;
use loopsight_plants::effects::CoulombFriction;

use crate::PERIOD_US;

/// The robot: `robot.toml`.
const TRUE: [f32; 8] = [-15.146, 0.005, 0.136, -9.573, -3.945, 0.656, 0.131, 0.05];
/// Level of the friction at each wheel, V, and width of its sign, rad/s.
const FRICTION: [f32; 2] = [1.6, 0.3];
/// Counts per turn of a wheel.
const COUNTS: f32 = 8192.0;
/// The battery, V.
const SUPPLY: f32 = 12.0;
/// Steps of the integration in a period.
const STEPS: u16 = 4;

/// Where the robot is, and what its encoders had counted at the last sample.
#[derive(Default)]
pub struct Body {
    x: [f32; 6],
    counts: [f32; 2],
}

impl Body {
    /// What encoders and supply say, after a period.
    pub fn sensors(&mut self) -> Sensors<[f32; 2]> {
        let period = PERIOD_US as f32 * 1e-6;
        let per_turn = COUNTS / core::f32::consts::TAU;
        let mut wheel = [0.0; 2];
        for (i, speed) in wheel.iter_mut().enumerate() {
            let angle = Ddmr::output(4 + i, &self.x, &[0.0; 2], &TRUE);
            // Towards zero, as good as any way to round for a counter.
            let count = (angle * per_turn) as i32 as f32;
            *speed = (count - self.counts[i]) / per_turn / period;
            self.counts[i] = count;
        }
        let (half_track, radius) = (TRUE[6], TRUE[7]);
        Sensors {
            measured: [
                radius * (wheel[0] + wheel[1]) / 2.0,
                radius * (wheel[0] - wheel[1]) / (2.0 * half_track),
            ],
            supply: SUPPLY,
        }
    }

    /// A period with these voltages; none: the motors are at rest.
    pub fn drive(&mut self, volts: Option<&[f32; 2]>) {
        let u = volts.copied().unwrap_or_default();
        let step = PERIOD_US as f32 * 1e-6 / f32::from(STEPS);
        for _ in 0..STEPS {
            rk4_step(&mut self.x, step, |x| {
                let mut w = [0.0; 4];
                for (i, w) in w.iter_mut().take(2).enumerate() {
                    *w = rubbing(Ddmr::output(i, x, &u, &TRUE));
                }
                Ddmr::derivative(x, &u, &w, &TRUE)
            });
        }
    }
}

/// Friction at a wheel that turns at `flow`, rad/s; in V.
fn rubbing(flow: f32) -> f32 {
    let reading = Reading::nothing().with(Role::Flow, &flow);
    CoulombFriction.contribution(&reading, &[], &FRICTION)
}
