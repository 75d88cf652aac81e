//! H-bridges: what a share of the supply means to their pins.

use core::convert::Infallible;
use core::fmt;

use embedded_hal::digital::{OutputPin, PinState};
use embedded_hal::pwm::SetDutyCycle;
use loopsight_core::Real;

use super::pins::NoPin;

/// An H-bridge with a motor.
pub trait Bridge<S: Real> {
    /// The bridge's own error.
    type Error: fmt::Debug;
    /// Puts this share of the supply on the motor, from -1 to 1; returns the share that the steps of
    /// the PWM allow.
    ///
    /// # Errors
    ///
    /// A pin failed.
    fn drive(&mut self, share: S) -> Result<S, Self::Error>;
    /// Opens the bridge where it can be opened: the motor turns freely.
    ///
    /// # Errors
    ///
    /// A pin failed.
    fn coast(&mut self) -> Result<(), Self::Error>;
    /// Shorts the motor.
    ///
    /// # Errors
    ///
    /// A pin failed.
    fn brake(&mut self) -> Result<(), Self::Error>;
}

/// Which pin of a bridge failed, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BridgeError<P, D, E, B> {
    /// The PWM output.
    Pwm(P),
    /// The direction pin.
    Direction(D),
    /// The enable pin.
    Enable(E),
    /// The brake pin.
    Brake(B),
}

/// What the pins were last set to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    /// Nothing was set yet, or a pin failed: all of them have to be set.
    Unknown,
    Driving,
    Stopped,
}

/// A share from 0 to 1 as steps of a PWM, rounded.
fn steps<S: Real>(share: S, max: u16) -> u16 {
    let steps = (share * S::of(f64::from(max)) + S::of(0.5)).value() as u16;
    steps.min(max)
}

/// The share that `steps` of `max` are; 0 of a PWM that has no steps.
fn share_of<S: Real>(steps: u16, max: u16) -> S {
    S::of(f64::from(steps)) / S::of(f64::from(max.max(1)))
}

/// A bridge with a direction pin and a PWM input for the magnitude.
///
/// ```text
/// duty = |s| max     direction = high where s > 0
/// coast: duty 0, enable low, brake low     brake: duty 0, enable high, brake high
/// ```
///
/// The direction changes at duty 0 only. While the PWM is low the motor is shorted (slow decay), so
/// that duty 0 brakes also without a brake pin. Without an enable pin it cannot coast: duty 0 is all
/// it has. A brake pin has to short the motor whatever the duty; leave it out where it does not.
///
/// Reference: N. Mohan, T. M. Undeland, W. P. Robbins (2003), "Power Electronics", 3rd edition,
/// section 7-7, unipolar voltage switching.
#[derive(Debug)]
pub struct SignMagnitude<P, D, E = NoPin, B = NoPin> {
    pwm: P,
    direction: D,
    enable: E,
    brake: B,
    max: u16,
    mode: Mode,
    forward: bool,
}

impl<P: SetDutyCycle, D: OutputPin> SignMagnitude<P, D> {
    /// A bridge of a PWM output and a direction pin. Nothing is set until the first command.
    pub fn new(pwm: P, direction: D) -> Self {
        Self {
            max: pwm.max_duty_cycle(),
            pwm,
            direction,
            enable: NoPin,
            brake: NoPin,
            mode: Mode::Unknown,
            forward: true,
        }
    }
}

impl<P, D, E, B> SignMagnitude<P, D, E, B> {
    /// The same with an enable pin.
    pub fn with_enable<F: OutputPin>(self, enable: F) -> SignMagnitude<P, D, F, B> {
        SignMagnitude {
            pwm: self.pwm,
            direction: self.direction,
            enable,
            brake: self.brake,
            max: self.max,
            mode: self.mode,
            forward: self.forward,
        }
    }

    /// The same with a brake pin.
    pub fn with_brake<F: OutputPin>(self, brake: F) -> SignMagnitude<P, D, E, F> {
        SignMagnitude {
            pwm: self.pwm,
            direction: self.direction,
            enable: self.enable,
            brake,
            max: self.max,
            mode: self.mode,
            forward: self.forward,
        }
    }

    /// Gives the pins back.
    pub fn free(self) -> (P, D, E, B) {
        (self.pwm, self.direction, self.enable, self.brake)
    }
}

impl<S, P, D, E, B> Bridge<S> for SignMagnitude<P, D, E, B>
where
    S: Real,
    P: SetDutyCycle,
    D: OutputPin,
    E: OutputPin,
    B: OutputPin,
{
    type Error = BridgeError<P::Error, D::Error, E::Error, B::Error>;

    fn drive(&mut self, share: S) -> Result<S, Self::Error> {
        // Duty 0 has no direction: the pin stays.
        let forward = if share == S::zero() {
            self.forward
        } else {
            share > S::zero()
        };
        let mode = core::mem::replace(&mut self.mode, Mode::Unknown);
        if mode == Mode::Unknown || forward != self.forward {
            self.pwm.set_duty_cycle(0).map_err(BridgeError::Pwm)?;
            self.direction
                .set_state(PinState::from(forward))
                .map_err(BridgeError::Direction)?;
            self.forward = forward;
        }
        if mode != Mode::Driving {
            self.brake.set_low().map_err(BridgeError::Brake)?;
            self.enable.set_high().map_err(BridgeError::Enable)?;
        }
        let duty = steps(share.abs(), self.max);
        self.pwm.set_duty_cycle(duty).map_err(BridgeError::Pwm)?;
        self.mode = Mode::Driving;
        let magnitude: S = share_of(duty, self.max);
        Ok(if forward { magnitude } else { -magnitude })
    }

    fn coast(&mut self) -> Result<(), Self::Error> {
        // Each pin is set whatever became of the others; the first error is told.
        self.mode = Mode::Unknown;
        let pwm = self.pwm.set_duty_cycle(0).map_err(BridgeError::Pwm);
        let enable = self.enable.set_low().map_err(BridgeError::Enable);
        let brake = self.brake.set_low().map_err(BridgeError::Brake);
        pwm.and(enable).and(brake)?;
        self.mode = Mode::Stopped;
        Ok(())
    }

    fn brake(&mut self) -> Result<(), Self::Error> {
        self.mode = Mode::Unknown;
        let pwm = self.pwm.set_duty_cycle(0).map_err(BridgeError::Pwm);
        let brake = self.brake.set_high().map_err(BridgeError::Brake);
        let enable = self.enable.set_high().map_err(BridgeError::Enable);
        pwm.and(brake).and(enable)?;
        self.mode = Mode::Stopped;
        Ok(())
    }
}

/// A bridge whose one PWM input turns the motor one way while it is high and the other way while it
/// is low.
///
/// ```text
/// duty = max (1 + s)/2
/// coast: duty 1/2, enable low, brake low     brake: duty 1/2, enable high, brake high
/// ```
///
/// At duty 1/2 the mean voltage is 0: that brakes as well as a short, at the price of the ripple. It
/// cannot coast without an enable pin. A PWM with an odd number of steps has no middle: the motor then
/// rests on half a step, and [`Bridge::drive`] says so.
///
/// Reference: N. Mohan, T. M. Undeland, W. P. Robbins (2003), "Power Electronics", 3rd edition,
/// section 7-7, bipolar voltage switching.
#[derive(Debug)]
pub struct LockedAntiphase<P, E = NoPin, B = NoPin> {
    pwm: P,
    enable: E,
    brake: B,
    max: u16,
    mode: Mode,
}

impl<P: SetDutyCycle> LockedAntiphase<P> {
    /// A bridge of one PWM output. Nothing is set until the first command.
    pub fn new(pwm: P) -> Self {
        Self {
            max: pwm.max_duty_cycle(),
            pwm,
            enable: NoPin,
            brake: NoPin,
            mode: Mode::Unknown,
        }
    }
}

impl<P, E, B> LockedAntiphase<P, E, B> {
    /// The same with an enable pin.
    pub fn with_enable<F: OutputPin>(self, enable: F) -> LockedAntiphase<P, F, B> {
        LockedAntiphase {
            pwm: self.pwm,
            enable,
            brake: self.brake,
            max: self.max,
            mode: self.mode,
        }
    }

    /// The same with a brake pin.
    pub fn with_brake<F: OutputPin>(self, brake: F) -> LockedAntiphase<P, E, F> {
        LockedAntiphase {
            pwm: self.pwm,
            enable: self.enable,
            brake,
            max: self.max,
            mode: self.mode,
        }
    }

    /// Gives the pins back.
    pub fn free(self) -> (P, E, B) {
        (self.pwm, self.enable, self.brake)
    }

    /// The duty whose mean voltage is 0.
    fn middle(&self) -> u16 {
        self.max.div_ceil(2)
    }
}

impl<S, P, E, B> Bridge<S> for LockedAntiphase<P, E, B>
where
    S: Real,
    P: SetDutyCycle,
    E: OutputPin,
    B: OutputPin,
{
    type Error = BridgeError<P::Error, Infallible, E::Error, B::Error>;

    fn drive(&mut self, share: S) -> Result<S, Self::Error> {
        let mode = core::mem::replace(&mut self.mode, Mode::Unknown);
        let one = S::one();
        let duty = steps((one + share) / (one + one), self.max);
        self.pwm.set_duty_cycle(duty).map_err(BridgeError::Pwm)?;
        if mode != Mode::Driving {
            self.brake.set_low().map_err(BridgeError::Brake)?;
            self.enable.set_high().map_err(BridgeError::Enable)?;
        }
        self.mode = Mode::Driving;
        let high: S = share_of(duty, self.max);
        Ok(high + high - one)
    }

    fn coast(&mut self) -> Result<(), Self::Error> {
        self.mode = Mode::Unknown;
        let enable = self.enable.set_low().map_err(BridgeError::Enable);
        let middle = self.middle();
        let pwm = self.pwm.set_duty_cycle(middle).map_err(BridgeError::Pwm);
        let brake = self.brake.set_low().map_err(BridgeError::Brake);
        enable.and(pwm).and(brake)?;
        self.mode = Mode::Stopped;
        Ok(())
    }

    fn brake(&mut self) -> Result<(), Self::Error> {
        self.mode = Mode::Unknown;
        let middle = self.middle();
        let pwm = self.pwm.set_duty_cycle(middle).map_err(BridgeError::Pwm);
        let brake = self.brake.set_high().map_err(BridgeError::Brake);
        let enable = self.enable.set_high().map_err(BridgeError::Enable);
        pwm.and(brake).and(enable)?;
        self.mode = Mode::Stopped;
        Ok(())
    }
}
