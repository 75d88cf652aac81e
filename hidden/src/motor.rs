//! Windings, their heat, and the battery they share.

use crate::driven::Motor;

/// The winding of one motor: its current and its temperature.
///
/// Over a step with constant voltage and speed the current is known exactly,
///
/// ```text
/// i(t) = i∞ + (i0 - i∞) exp(-t R/L)     i∞ = (V - K_a Ω/n)/R
/// ```
///
/// and so is its mean, which makes the torque; `L → 0` needs no special case. The copper heats by
/// `C T' = R i² - (T - T_a)/R_th` and its resistance grows by 0.393 % per kelvin.
///
/// Reference: R. Krishnan (2001), "Electric Motor Drives", section 2.4; resistance of copper: IEC
/// 60028.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Winding {
    motor: Motor,
    step: f64,
    /// Current at the start of the step, A.
    pub(crate) current: f64,
    /// Resistance at the present temperature, Ohm.
    resistance: f64,
    decay: f64,
    mean: f64,
    heat: Option<Heat>,
    /// Above the ambient temperature, K.
    pub(crate) warmth: f64,
    lost: f64,
}

/// Thermal properties of a winding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Heat {
    /// Heat capacity, J/K.
    pub(crate) capacity: f64,
    /// Thermal resistance to the surroundings, K/W.
    pub(crate) resistance: f64,
}

/// Relative change of the resistance of copper, 1/K.
pub(crate) const COPPER: f64 = 0.003_93;

impl Winding {
    pub(crate) fn new(motor: Motor, heat: Option<Heat>, step: f64) -> Self {
        let mut winding = Self {
            motor,
            step,
            current: 0.0,
            resistance: motor.resistance,
            decay: 0.0,
            mean: 0.0,
            heat,
            warmth: 0.0,
            lost: 0.0,
        };
        winding.tabulate();
        winding
    }

    fn tabulate(&mut self) {
        self.resistance = self.motor.resistance * (1.0 + COPPER * self.warmth);
        let x = self.step * self.resistance / self.motor.inductance;
        self.decay = (-x).exp();
        self.mean = -(-x).exp_m1() / x;
    }

    /// Mean torque at the gear's output over a step, N m, and the current at its end, A.
    pub(crate) fn torque(&self, voltage: f64, speed: f64) -> (f64, f64) {
        let motor = &self.motor;
        let rotor = speed / motor.gear_ratio;
        let settled = (voltage - motor.back_emf_constant * rotor) / self.resistance;
        let mean = settled + (self.current - settled) * self.mean;
        let end = settled + (self.current - settled) * self.decay;
        let torque = motor.torque_constant * mean - motor.rotor_friction * rotor;
        (torque / motor.gear_ratio, end)
    }

    /// As [`Winding::torque`] with all switches of its bridge open. The current runs on through the diodes against
    /// the supply until it ends. It stays zero unless the back-emf is above the supply, which drives it through the other
    /// diodes.
    pub(crate) fn coasting(&self, supply: f64, speed: f64) -> (f64, f64) {
        let motor = &self.motor;
        let back_emf = motor.back_emf_constant * speed / motor.gear_ratio;
        if self.current == 0.0 {
            return self.torque(back_emf.clamp(-supply, supply), speed);
        }
        let against = -supply * self.current.signum();
        let settled = (against - back_emf) / self.resistance;
        if settled * self.current >= 0.0 {
            return self.torque(against, speed);
        }
        // `i(t) = settled + (current - settled) exp(-t R/L)` is zero after this share of the step.
        let lasts = self.step * self.resistance / motor.inductance;
        let ends = (-self.current / settled).ln_1p() / lasts;
        if ends >= 1.0 {
            return self.torque(against, speed);
        }
        let (first, _) = self.over(ends, self.current).torque(against, speed);
        let (rest, end) = self.over(1.0 - ends, 0.0).coasting(supply, speed);
        (ends * first + (1.0 - ends) * rest, end)
    }

    /// As [`Winding::torque`] with the switches closed for the first share `on` of the step, and open after it.
    pub(crate) fn pulsed(&self, on: f64, voltage: f64, supply: f64, speed: f64) -> (f64, f64) {
        if on >= 1.0 {
            return self.torque(voltage, speed);
        }
        if on <= 0.0 {
            return self.coasting(supply, speed);
        }
        let (first, current) = self.over(on, self.current).torque(voltage, speed);
        let (rest, end) = self.over(1.0 - on, current).coasting(supply, speed);
        (on * first + (1.0 - on) * rest, end)
    }

    /// The winding over a share of its step, with this current at the start.
    fn over(&self, share: f64, current: f64) -> Self {
        let mut part = Self {
            step: share * self.step,
            current,
            ..*self
        };
        part.tabulate();
        part
    }

    /// Takes over the current at the end of a step.
    pub(crate) fn advance(&mut self, current: f64) {
        self.lost += self.resistance * current * current * self.step;
        self.current = current;
    }

    /// Turns the energy lost over the last `period` s into heat.
    pub(crate) fn warm(&mut self, period: f64) {
        if let Some(heat) = self.heat {
            let cooling = self.warmth / heat.resistance * period;
            self.warmth += (self.lost - cooling) / heat.capacity;
            self.tabulate();
        }
        self.lost = 0.0;
    }
}

/// A battery behind the amplifiers, which switch its voltage on for a share of the time.
///
/// ```text
/// duty = V_demanded/V_oc, at most ±1     V_motor = duty (V_oc - V' t - R_i I)     I = max(0, Σ duty i)
/// ```
///
/// Amplifiers know the voltage `V_oc` that it had when it was full.
/// A diode keeps braking motors from charging it, so the voltage only falls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Battery {
    /// Open-circuit voltage, V.
    pub(crate) open_circuit: f64,
    /// Internal resistance, Ohm.
    pub(crate) resistance: f64,
    /// What the voltage falls by per second, V/s.
    pub(crate) discharge: f64,
}

impl Battery {
    /// What reaches the motors of the voltages demanded, at these currents, `time` s after the start.
    pub(crate) fn supply(&self, demanded: [f64; 2], currents: [f64; 2], time: f64) -> [f64; 2] {
        let duty = demanded.map(|v| (v / self.open_circuit).clamp(-1.0, 1.0));
        let load = (duty[0] * currents[0] + duty[1] * currents[1]).max(0.0);
        let voltage = self.open_circuit - self.discharge * time - self.resistance * load;
        duty.map(|d| d * voltage)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Driven;

    #[test]
    fn a_stalled_winding_follows_its_exponential() {
        let motor = Driven::Twil.parts().0;
        let time_constant = motor.inductance / motor.resistance;
        let mut winding = Winding::new(motor, None, 1e-4);
        for k in 1..=50 {
            let (_, end) = winding.torque(9.0, 0.0);
            winding.advance(end);
            let t = 1e-4 * f64::from(k);
            let exact = 9.0 / motor.resistance * (1.0 - (-t / time_constant).exp());
            assert!((end - exact).abs() < 1e-12);
        }
    }

    /// With the supply against it the current of a stalled winding falls from `i` to zero in
    /// `L/R ln(1 + i R/V)`; the charge until then follows from `L i = ∫ (V + R i) dt`.
    #[test]
    fn an_open_bridge_ends_the_current_and_brakes_nothing() {
        let motor = Driven::Twil.parts().0;
        let (supply, started) = (12.0, 0.4);
        let mut winding = Winding::new(motor, None, 1e-6);
        winding.current = started;
        let lasts =
            motor.inductance / motor.resistance * (1.0 + started * motor.resistance / supply).ln();
        let mut charge = 0.0;
        let mut steps = 0;
        while winding.current > 0.0 {
            let (torque, end) = winding.coasting(supply, 0.0);
            charge += torque * motor.gear_ratio / motor.torque_constant * 1e-6;
            winding.advance(end);
            steps += 1;
        }
        assert!(
            (f64::from(steps) * 1e-6 - lasts).abs() < 1.1e-6,
            "{steps} {lasts}"
        );
        let expected = (motor.inductance * started - supply * lasts) / motor.resistance;
        assert!(
            (charge / expected - 1.0).abs() < 1e-6,
            "{charge} {expected}"
        );
        let (torque, end) = winding.coasting(supply, 3.0);
        let friction = -motor.rotor_friction * 3.0 / motor.gear_ratio.powi(2);
        assert_eq!(end, 0.0);
        assert!((torque / friction - 1.0).abs() < 1e-12);
    }

    /// Turned faster than the supply drives it a motor brakes through the diodes of its open bridge, whichever way its
    /// current went before.
    #[test]
    fn a_back_emf_above_the_supply_drives_a_current() {
        let motor = Driven::Twil.parts().0;
        let (supply, resistance) = (12.0, motor.resistance);
        let speed = (supply + 3.0) * motor.gear_ratio / motor.back_emf_constant;
        for started in [0.0, 0.4, -0.4] {
            let mut winding = Winding::new(motor, None, 1e-4);
            winding.current = started;
            for _ in 0..1000 {
                let (_, end) = winding.coasting(supply, speed);
                winding.advance(end);
            }
            let settled = winding.current * resistance;
            assert!((settled + 3.0).abs() < 1e-9, "{started} A: {settled} V");
        }
    }

    /// A step of a pulse and a pause is the two one after the other.
    #[test]
    fn a_pulse_ends_within_a_step() {
        let motor = Driven::Twil.parts().0;
        let whole = Winding::new(motor, None, 1e-4);
        let (torque, end) = whole.pulsed(0.3, 12.0, 12.0, 2.0);
        let mut fine = Winding::new(motor, None, 1e-6);
        let mut mean = 0.0;
        for k in 0..100 {
            let on = if k < 30 { 1.0 } else { 0.0 };
            let (part, current) = fine.pulsed(on, 12.0, 12.0, 2.0);
            mean += 0.01 * part;
            fine.advance(current);
        }
        assert!((torque - mean).abs() < 1e-9 * mean.abs(), "{torque} {mean}");
        assert!((end - fine.current).abs() < 1e-9);
    }

    #[test]
    fn heat_is_what_the_current_loses() {
        let motor = Driven::Twil.parts().0;
        let heat = Heat {
            capacity: 2.0,
            resistance: 10.0,
        };
        let mut winding = Winding::new(motor, Some(heat), 1e-4);
        for k in 0..2_000_000 {
            let (_, end) = winding.torque(9.0, 0.0);
            winding.advance(end);
            if k % 100 == 99 {
                winding.warm(0.01);
            }
        }
        // Balance: 81/(R0 (1 + α T)) = T/R_th.
        let t = winding.warmth;
        let balance = 81.0 / (motor.resistance * (1.0 + COPPER * t)) - t / 10.0;
        assert!(balance.abs() < 1e-3, "{t} K: {balance} W");
    }

    #[test]
    fn the_battery_only_falls() {
        let battery = Battery {
            open_circuit: 12.0,
            discharge: 0.0,
            resistance: 1.0,
        };
        for currents in [[0.5, 0.5], [-0.5, 0.2], [-1.0, -1.0]] {
            for demanded in [[9.0, 9.0], [9.0, -9.0], [-3.0, 0.0], [20.0, 6.0]] {
                let got = battery.supply(demanded, currents, 0.0);
                for (v, d) in got.iter().zip(demanded) {
                    assert!(v.abs() <= d.abs().min(12.0) + 1e-12 && v * d >= 0.0);
                }
            }
        }
    }
}
