//! One motor with its bridge and its encoder.

use core::fmt;

use loopsight_core::{Limits, Real};

use super::bridge::Bridge;
use super::quadrature::{Quadrature, turned};

/// The limits of a wheel, and which way round it is wired.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WheelSettings<S> {
    /// Largest magnitude of the voltage, V.
    pub limit: S,
    /// Largest rate of the voltage, V/s; infinite: no limit.
    pub slew: S,
    /// Ticks at 0 V between one direction and the other, so that both sides of the bridge are off
    /// and the current has died away before it turns.
    pub dead_ticks: u16,
    /// A positive voltage turns the wheel backwards.
    pub motor_reversed: bool,
    /// Counts fall while the wheel turns forwards.
    pub encoder_reversed: bool,
}

impl<S: Real> WheelSettings<S> {
    /// At most `limit` V, without any other limit, wired the right way round.
    pub fn new(limit: S) -> Self {
        Self {
            limit,
            slew: S::of(f64::INFINITY),
            dead_ticks: 0,
            motor_reversed: false,
            encoder_reversed: false,
        }
    }
}

/// Which part of a wheel failed, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum WheelError<B, Q> {
    /// A pin of the bridge.
    Bridge(B),
    /// The encoder's counter.
    Encoder(Q),
}

/// A motor on a bridge, with an encoder on its shaft.
///
/// ```text
/// c = clamp(u, -m, m)        changed by r T per period at most
/// c = 0                      for n ticks where its sign changes
/// s = clamp(c/U, -1, 1)      share of the supply, rounded to steps of the PWM
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `u` | voltage that is wanted | V |
/// | `m`, `r`, `n` | [`WheelSettings::limit`], [`slew`](WheelSettings::slew), [`dead_ticks`](WheelSettings::dead_ticks) | V, V/s, 1 |
/// | `U` | present supply | V |
/// | `s U` | what is applied | V |
///
/// Dividing by the present supply makes a volt a volt while a battery runs down. It takes the mean of
/// the PWM for the voltage of the motor: true of a bridge that conducts both ways, at a PWM much
/// faster than the winding.
///
/// Reference: N. Mohan, T. M. Undeland, W. P. Robbins (2003), "Power Electronics", 3rd edition,
/// section 7-7.
#[derive(Debug)]
pub struct Wheel<S, B, Q> {
    bridge: B,
    encoder: Q,
    settings: WheelSettings<S>,
    limits: Limits<[S; 1]>,
    /// Direction it was driven in last, and for how many ticks it has had 0 V since.
    direction: i8,
    rested: u16,
    position: Option<u32>,
}

fn direction<S: Real>(volts: S) -> i8 {
    i8::from(volts > S::zero()) - i8::from(volts < S::zero())
}

impl<S: Real, B: Bridge<S>, Q: Quadrature> Wheel<S, B, Q> {
    /// A wheel at rest. Nothing is set or read yet.
    pub fn new(bridge: B, encoder: Q, settings: WheelSettings<S>) -> Self {
        Self {
            bridge,
            encoder,
            limits: Limits::new([settings.limit], [settings.slew], [S::zero()]),
            settings,
            direction: 0,
            rested: 0,
            position: None,
        }
    }

    /// Puts `volts` on the motor, `period` s after the last ones, from a supply of `supply` V.
    /// Returns the voltage that is really applied.
    ///
    /// # Errors
    ///
    /// A pin that fails.
    pub fn drive(
        &mut self,
        volts: S,
        supply: S,
        period: S,
    ) -> Result<S, WheelError<B::Error, Q::Error>> {
        let mut limited = [volts];
        self.limits.clamp(period, &mut limited);
        let wanted = direction(limited[0]);
        if wanted == -self.direction && wanted != 0 && self.rested < self.settings.dead_ticks {
            limited[0] = S::zero();
        }
        let [volts] = limited.map(|v| v.clamp(-supply, supply));
        match direction(volts) {
            0 => self.rested = self.rested.saturating_add(1),
            now => (self.direction, self.rested) = (now, 0),
        }
        // A slew goes on from what the motor has.
        self.limits.start(&[volts]);
        let share = volts / supply;
        let reversed = self.settings.motor_reversed;
        let set = self
            .bridge
            .drive(if reversed { -share } else { share })
            .map_err(WheelError::Bridge)?;
        Ok(supply * if reversed { -set } else { set })
    }

    /// Lets the motor turn freely; a later slew starts at 0 V.
    ///
    /// # Errors
    ///
    /// A pin that fails.
    pub fn coast(&mut self) -> Result<(), WheelError<B::Error, Q::Error>> {
        self.limits.start(&[S::zero()]);
        self.bridge.coast().map_err(WheelError::Bridge)
    }

    /// Shorts the motor; a later slew starts at 0 V.
    ///
    /// # Errors
    ///
    /// A pin that fails.
    pub fn brake(&mut self) -> Result<(), WheelError<B::Error, Q::Error>> {
        self.limits.start(&[S::zero()]);
        self.bridge.brake().map_err(WheelError::Bridge)
    }

    /// Counts since the last call, positive forwards; 0 at the first.
    ///
    /// # Errors
    ///
    /// A counter that fails.
    pub fn counts(&mut self) -> Result<i32, WheelError<B::Error, Q::Error>> {
        let now = self.encoder.position().map_err(WheelError::Encoder)?;
        let before = self.position.replace(now).unwrap_or(now);
        let counts = turned(before, now, self.encoder.range());
        Ok(if self.settings.encoder_reversed {
            counts.saturating_neg()
        } else {
            counts
        })
    }

    /// Gives bridge and encoder back.
    pub fn free(self) -> (B, Q) {
        (self.bridge, self.encoder)
    }
}

/// Several wheels of a robot, by number.
pub trait Wheels<S: Real> {
    /// The error of one of them, with which it is.
    type Error: fmt::Debug;
    /// How many there are.
    fn count(&self) -> usize;
    /// As [`Wheel::drive`], of the wheel `index`.
    ///
    /// # Errors
    ///
    /// That of the wheel, with its number.
    fn drive(&mut self, index: usize, volts: S, supply: S, period: S) -> Result<S, Self::Error>;
    /// As [`Wheel::counts`], of the wheel `index`.
    ///
    /// # Errors
    ///
    /// That of the wheel, with its number.
    fn counts(&mut self, index: usize) -> Result<i32, Self::Error>;
    /// As [`Wheel::coast`], of all wheels, whatever becomes of one of them; the first error is told.
    ///
    /// # Errors
    ///
    /// That of the first wheel that failed.
    fn coast(&mut self) -> Result<(), Self::Error>;
    /// As [`Wheel::brake`], of all wheels, whatever becomes of one of them; the first error is told.
    ///
    /// # Errors
    ///
    /// That of the first wheel that failed.
    fn brake(&mut self) -> Result<(), Self::Error>;
}

/// The right and the left wheel, each with pins of its own types; the right one is number 0.
#[derive(Debug)]
pub struct Pair<R, L> {
    /// The right wheel.
    pub right: R,
    /// The left wheel.
    pub left: L,
}

/// Which of a [`Pair`] of wheels failed, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum PairError<R, L> {
    /// The right wheel.
    Right(R),
    /// The left wheel.
    Left(L),
}

impl<S, RB, RQ, LB, LQ> Wheels<S> for Pair<Wheel<S, RB, RQ>, Wheel<S, LB, LQ>>
where
    S: Real,
    RB: Bridge<S>,
    RQ: Quadrature,
    LB: Bridge<S>,
    LQ: Quadrature,
{
    type Error = PairError<WheelError<RB::Error, RQ::Error>, WheelError<LB::Error, LQ::Error>>;

    fn count(&self) -> usize {
        2
    }
    fn drive(&mut self, index: usize, volts: S, supply: S, period: S) -> Result<S, Self::Error> {
        match index {
            0 => self
                .right
                .drive(volts, supply, period)
                .map_err(PairError::Right),
            _ => self
                .left
                .drive(volts, supply, period)
                .map_err(PairError::Left),
        }
    }
    fn counts(&mut self, index: usize) -> Result<i32, Self::Error> {
        match index {
            0 => self.right.counts().map_err(PairError::Right),
            _ => self.left.counts().map_err(PairError::Left),
        }
    }
    fn coast(&mut self) -> Result<(), Self::Error> {
        let right = self.right.coast().map_err(PairError::Right);
        right.and(self.left.coast().map_err(PairError::Left))
    }
    fn brake(&mut self) -> Result<(), Self::Error> {
        let right = self.right.brake().map_err(PairError::Right);
        right.and(self.left.brake().map_err(PairError::Left))
    }
}
