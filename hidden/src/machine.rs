//! The machine in motion: forces, contacts, and the integrator.

use crate::amplifier::Amplifier;
use crate::driven::Driven;
use crate::friction::{Row, solve};
use crate::motor::Winding;
use crate::physics::{GRAVITY, Physics};

/// Integration step, s.
pub(crate) const STEP: f64 = 1e-4;

/// Velocities: of the body, and of what is loose from it.
#[derive(Clone, Copy, Debug, Default)]
struct Velocities {
    /// `v`, `ω`; on the axis the shaft's speed.
    body: [f64; 2],
    /// Wheels, when they can slip, rad/s.
    wheel: [f64; 2],
    /// Gear outputs on the motor's side, when there is play, rad/s.
    rotor: [f64; 2],
    /// A load behind a shaft that twists, rad/s.
    far: f64,
}

/// The places of dry friction: both shafts and the yaw axis.
#[derive(Clone, Copy, Debug, Default)]
struct Grips {
    /// Velocity at each place per velocity of the body.
    levers: [[f64; 2]; 3],
    /// Velocities of the body per impulse at each place.
    responses: [[f64; 2]; 3],
    /// Velocity at every place per impulse at each.
    compliance: [[f64; 3]; 3],
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// A machine with its state, advanced by 0.1 ms at a time.
///
/// ```text
/// M u' = Σ_k J_kᵀ τ_k + (m d ω², -m d v ω) + loads      φ'_k = J_k u      J_k = (1/r_k, ±b/r_k)
/// ```
///
/// `M` contains the inertia of whatever is rigidly connected to the body: wheels that roll and
/// rotors without play. The equations are those of a body with its centre of mass `d` ahead of the
/// axle, which cannot move sideways, written at the midpoint of the axle.
///
/// The integrator is the midpoint rule, with the midpoint velocity found by one fixed-point
/// iteration; currents are exact within a step ([`Winding`]); dry friction acts as an impulse at the
/// end of the step ([`solve`]). Second order where the motion is smooth, first order in the instant
/// at which something sticks.
///
/// Reference: midpoint rule: E. Hairer, C. Lubich, G. Wanner (2006), "Geometric Numerical
/// Integration", 2nd edition, section II.1; body: Alves, Lages, Henriques (2018), equation (17).
#[derive(Clone, Debug)]
pub(crate) struct Machine {
    physics: Physics,
    drives: usize,
    jacobian: [[f64; 2]; 2],
    mass: f64,
    inertia: f64,
    /// Inverse of `M`.
    inverse: [[f64; 2]; 2],
    /// Inertia of a wheel that can slip, with what it carries, kg m².
    wheel_inertia: f64,
    grips: Grips,
    windings: [Winding; 2],
    amplifiers: [Amplifier; 2],
    /// Share of this step in which the switches of the bridges are closed.
    on: [f64; 2],
    velocities: Velocities,
    /// Angles of the wheels where the encoders sit. With slip: of measuring wheels that roll.
    angles: [f64; 2],
    wheel_angles: [f64; 2],
    rotor_angles: [f64; 2],
    /// How far the load behind a twisting shaft is behind, rad.
    twist: f64,
    /// `x`, `y`, heading.
    pose: [f64; 3],
    impulses: [f64; 3],
    dry: bool,
    steps: u64,
}

impl Machine {
    /// At rest, at the origin.
    pub(crate) fn new(physics: Physics) -> Self {
        let winding = Winding::new(physics.motor, physics.heat, STEP);
        let amplifiers = physics.amplifiers.map(|parts| Amplifier::new(parts, STEP));
        let dry = physics.scrub > 0.0 || physics.friction.iter().any(|f| f.is_dry());
        let mut machine = Self {
            drives: physics.robot.drives(),
            jacobian: physics.jacobian(),
            mass: physics.body.mass,
            inertia: physics.body.inertia,
            inverse: [[0.0; 2]; 2],
            wheel_inertia: 0.0,
            grips: Grips::default(),
            windings: [winding; 2],
            amplifiers,
            on: [1.0; 2],
            velocities: Velocities::default(),
            angles: [0.0; 2],
            wheel_angles: [0.0; 2],
            rotor_angles: [0.0; 2],
            twist: 0.0,
            pose: [0.0; 3],
            impulses: [0.0; 3],
            dry,
            steps: 0,
            physics,
        };
        machine.weigh();
        machine
    }

    /// The matrix `M` as it is now.
    fn matrix(&self) -> [[f64; 2]; 2] {
        let physics = &self.physics;
        let rotor = physics.motor.reflected_inertia;
        let behind_gap = if physics.gap.is_some() { 0.0 } else { rotor };
        let rigid = if physics.tyre.is_some() {
            0.0
        } else {
            physics.body.wheel_inertia + behind_gap
        };
        let mut m = [[self.mass, 0.0], [0.0, self.inertia]];
        for j in &self.jacobian[..self.drives] {
            for (row, a) in m.iter_mut().zip(j) {
                for (entry, b) in row.iter_mut().zip(j) {
                    *entry += rigid * a * b;
                }
            }
        }
        m
    }

    fn weigh(&mut self) {
        let [[a, b], [c, d]] = self.matrix();
        let det = a * d - b * c;
        self.inverse = [[d / det, -b / det], [-c / det, a / det]];
        let rotor = self.physics.motor.reflected_inertia;
        let carried = if self.physics.gap.is_some() {
            0.0
        } else {
            rotor
        };
        self.wheel_inertia = self.physics.body.wheel_inertia + carried;
        self.grips = self.grip();
    }

    /// Where dry friction acts, and what an impulse there does.
    fn grip(&self) -> Grips {
        let none = [0.0; 2];
        let slips = self.physics.tyre.is_some();
        let levers = match (slips, self.physics.robot) {
            (true, _) => [none, none, [0.0, 1.0]],
            (false, Driven::Twil) => [self.jacobian[0], self.jacobian[1], [0.0, 1.0]],
            (false, Driven::Axis) => [self.jacobian[0], none, none],
        };
        let responses = levers.map(|lever| self.inverse.map(|row| dot(row, lever)));
        let mut compliance = responses.map(|response| levers.map(|l| dot(l, response)));
        if slips {
            compliance[0][0] = 1.0 / self.wheel_inertia;
            compliance[1][1] = 1.0 / self.wheel_inertia;
        }
        Grips {
            levers,
            responses,
            compliance,
        }
    }

    /// One step of [`STEP`] with these commands, V.
    pub(crate) fn step(&mut self, commands: [f64; 2]) {
        self.load_payload();
        let mut demanded = [0.0; 2];
        for k in 0..self.drives {
            let demand = self.amplifiers[k].step(commands[k]);
            demanded[k] = demand.voltage;
            self.on[k] = demand.on;
        }
        let currents = self.windings.map(|w| w.current);
        let voltages = {
            let battery = &self.physics.battery;
            battery.supply(demanded, currents, self.steps as f64 * STEP)
        };
        let start = self.velocities;
        let (predicted, _) = self.pass(&start, &start, voltages);
        let middle = start.mean(&predicted);
        let (end, currents) = self.pass(&start, &middle, voltages);
        self.move_on(&start.mean(&end));
        self.velocities = end;
        for (winding, current) in self.windings.iter_mut().zip(currents) {
            winding.advance(current);
        }
        self.steps += 1;
        if self.physics.heat.is_some() && self.steps.is_multiple_of(100) {
            for winding in &mut self.windings {
                winding.warm(100.0 * STEP);
            }
        }
    }

    /// Velocities and currents at the end of a step, with the forces at `middle`.
    fn pass(
        &mut self,
        start: &Velocities,
        middle: &Velocities,
        voltages: [f64; 2],
    ) -> (Velocities, [f64; 2]) {
        let physics = &self.physics;
        let time = (self.steps as f64 + 0.5) * STEP;
        let mut force = self.body_force(middle.body);
        let mut end = *start;
        let mut currents = [0.0; 2];
        for k in 0..self.drives {
            let j = self.jacobian[k];
            let ground = j[0] * middle.body[0] + j[1] * middle.body[1];
            let slips = physics.tyre.is_some();
            let wheel = if slips { middle.wheel[k] } else { ground };
            let wheel_angle = self.wheel_angles[k] + 0.5 * STEP * wheel;
            let rotor = if physics.gap.is_some() {
                middle.rotor[k]
            } else {
                wheel
            };
            let supply = physics.battery.open_circuit;
            let (driven, current) = self.windings[k].pulsed(self.on[k], voltages[k], supply, rotor);
            currents[k] = current;
            let mut torque = match physics.gap {
                None => driven,
                Some(gap) => {
                    let ahead = self.rotor_angles[k] + 0.5 * STEP * rotor - wheel_angle;
                    let through = gap.torque(ahead, rotor - wheel);
                    end.rotor[k] += STEP * (driven - through) / physics.motor.reflected_inertia;
                    through
                }
            };
            torque += physics.friction[k].smooth(wheel, time);
            let cogging = &physics.cogging[k];
            if cogging.amplitude != 0.0 {
                let angle = cogging.count * wheel_angle + cogging.phase;
                torque -= cogging.amplitude * angle.sin();
            }
            if physics.robot == Driven::Axis {
                torque += physics.load.torque(wheel_angle);
                torque -= physics.joint.moved(0.5 * STEP * wheel).force;
                torque -= physics.seal.moved(wheel, 0.5 * STEP).torque;
                if let Some(stops) = physics.stops {
                    torque += stops.force(wheel_angle, wheel);
                }
                if let Some(shaft) = physics.twisting {
                    let rate = wheel - middle.far;
                    let through = shaft.torque(self.twist + 0.5 * STEP * rate, rate);
                    end.far += STEP * through / shaft.inertia;
                    torque -= through;
                }
            }
            if let Some(tyre) = physics.tyre {
                let r = physics.body.wheel_radius;
                let load = 0.5 * self.mass * GRAVITY;
                let pushed = r * tyre.force(r * (wheel - ground), load);
                end.wheel[k] += STEP * (torque - pushed) / self.wheel_inertia;
                torque = pushed;
            }
            force[0] += j[0] * torque;
            force[1] += j[1] * torque;
        }
        for (row, u) in self.inverse.iter().zip(&mut end.body) {
            *u += STEP * (row[0] * force[0] + row[1] * force[1]);
        }
        if self.dry {
            self.stick(start, &mut end);
        }
        (end, currents)
    }

    /// What acts on the body itself, N and N m.
    fn body_force(&self, [v, omega]: [f64; 2]) -> [f64; 2] {
        let physics = &self.physics;
        let unbalance = physics.body.mass * physics.mass_offset;
        let mut force = [unbalance * omega * omega, -unbalance * v * omega];
        if let Some(slope) = physics.slope {
            let down = GRAVITY * slope.angle.sin();
            let away = self.pose[2] + 0.5 * STEP * omega - slope.direction;
            force[0] -= self.mass * down * away.cos();
            force[1] += unbalance * down * away.sin();
        }
        force
    }

    /// Dry friction of the shafts and of turning, on the velocities at the end of a step.
    fn stick(&mut self, start: &Velocities, end: &mut Velocities) {
        let physics = &self.physics;
        let slips = physics.tyre.is_some();
        let mut rows = [Row::default(); 3];
        for (i, row) in rows.iter_mut().enumerate() {
            let lever = self.grips.levers[i];
            row.compliance = self.grips.compliance[i];
            row.free = dot(lever, end.body);
            if i == 2 {
                row.bounds = [-STEP * physics.scrub, STEP * physics.scrub];
            } else if i < self.drives {
                let mut before = dot(lever, start.body);
                if slips {
                    row.free = end.wheel[i];
                    before = start.wheel[i];
                }
                row.bounds = physics.friction[i].bounds(before).map(|t| STEP * t);
            }
        }
        solve(&rows, &mut self.impulses);
        for (i, impulse) in self.impulses.into_iter().enumerate() {
            let response = self.grips.responses[i];
            end.body[0] += response[0] * impulse;
            end.body[1] += response[1] * impulse;
            if slips && i < 2 {
                end.wheel[i] += impulse / self.wheel_inertia;
            }
        }
    }

    /// Angles and pose over a step with these mean velocities.
    fn move_on(&mut self, mean: &Velocities) {
        for k in 0..self.drives {
            let j = self.jacobian[k];
            let ground = j[0] * mean.body[0] + j[1] * mean.body[1];
            self.angles[k] += STEP * ground;
            let wheel = match self.physics.tyre {
                Some(_) => mean.wheel[k],
                None => ground,
            };
            self.wheel_angles[k] += STEP * wheel;
            if k == 0 {
                self.physics.joint = self.physics.joint.moved(STEP * wheel);
                self.physics.seal = self.physics.seal.moved(wheel, STEP);
                self.twist += STEP * (wheel - mean.far);
            }
            self.rotor_angles[k] += STEP * mean.rotor[k];
        }
        if self.physics.robot == Driven::Twil {
            let [v, omega] = mean.body;
            let (sin, cos) = (self.pose[2] + 0.5 * STEP * omega).sin_cos();
            self.pose[0] += STEP * v * cos;
            self.pose[1] += STEP * v * sin;
            self.pose[2] += STEP * omega;
        }
    }

    /// Puts the payload on board when its time has come.
    fn load_payload(&mut self) {
        let Some(payload) = self.physics.payload else {
            return;
        };
        if (self.steps as f64) * STEP < payload.time {
            return;
        }
        self.physics.payload = None;
        let [[a, b], [c, d]] = self.matrix();
        let [v, omega] = self.velocities.body;
        let momentum = [a * v + b * omega, c * v + d * omega];
        self.mass += payload.mass;
        self.inertia += payload.inertia;
        self.weigh();
        self.velocities.body = self
            .inverse
            .map(|row| row[0] * momentum[0] + row[1] * momentum[1]);
    }

    /// Angles that the encoders read, rad.
    pub(crate) fn angles(&self) -> [f64; 2] {
        self.angles
    }

    /// `x`, `y`, heading.
    #[cfg(test)]
    pub(crate) fn pose(&self) -> [f64; 3] {
        self.pose
    }

    /// Velocities of the body.
    #[cfg(test)]
    pub(crate) fn body(&self) -> [f64; 2] {
        self.velocities.body
    }

    /// How much warmer than the surroundings each winding is, K.
    pub(crate) fn warmth(&self) -> [f64; 2] {
        self.windings.map(|w| w.warmth)
    }
}

impl Velocities {
    fn mean(&self, other: &Self) -> Self {
        let half = |a: [f64; 2], b: [f64; 2]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        Self {
            body: half(self.body, other.body),
            wheel: half(self.wheel, other.wheel),
            rotor: half(self.rotor, other.rotor),
            far: 0.5 * (self.far + other.far),
        }
    }
}

#[cfg(test)]
mod tests;
