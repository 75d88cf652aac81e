//! Motors with encoders on the pins of a board: volts in, counts out, on embedded-hal 1.0.
//!
//! [`TwilMotor`] is the driver. It is made of a [`Wheel`] per motor, each of a [`Bridge`]
//! ([`SignMagnitude`] or [`LockedAntiphase`], with or without enable and brake pins) and a
//! [`Quadrature`] counter, of a [`Supply`] and a [`Watchdog`]. Nothing here knows a board, allocates, or
//! needs an operating system.

mod bridge;
mod pins;
mod quadrature;
mod supply;
#[cfg(test)]
#[cfg(feature = "std")]
mod tests;
mod watchdog;
mod wheel;

use core::fmt;

use loopsight_core::{Driver, DriverError, DriverFault, Real, Sample};

pub use bridge::{Bridge, BridgeError, LockedAntiphase, SignMagnitude};
pub use pins::{ActiveLow, NoPin};
pub use quadrature::{Quadrature, turned};
pub use supply::{FixedSupply, Supply};
pub use watchdog::{Guard, Watchdog};
pub use wheel::{Pair, PairError, Wheel, WheelError, WheelSettings, Wheels};

/// Why the motors were not driven, or not read.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TwilMotorError<W, V, S> {
    /// A wheel: which one, which pin, and what the pin said.
    Wheel(W),
    /// The meter of the supply.
    Supply(V),
    /// The supply is below the least that the motors are driven with, or is not a number.
    SupplyLow {
        /// What it is, V.
        volts: S,
        /// The least, V.
        least: S,
    },
    /// The command for this motor is no finite number.
    NotFinite(usize),
    /// The motors were stopped before, by the watchdog or by hand, and wait to be armed again.
    Halted(Guard),
    /// A slice of the wrong length was handed over.
    Length {
        /// How many numbers there were.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
}

impl<W: fmt::Debug, V: fmt::Debug, S: fmt::Debug> fmt::Display for TwilMotorError<W, V, S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Wheel(error) => write!(f, "a wheel failed: {error:?}"),
            Self::Supply(error) => write!(f, "the supply cannot be measured: {error:?}"),
            Self::SupplyLow { volts, least } => {
                write!(
                    f,
                    "the supply is {volts:?} V, expected at least {least:?} V"
                )
            }
            Self::NotFinite(motor) => write!(f, "the command for motor {motor} is not a number"),
            Self::Halted(Guard::Stopped) => f.write_str("the motors were stopped before"),
            Self::Halted(_) => f.write_str("no command came in time: the motors were stopped"),
            Self::Length { found, expected } => write!(f, "{found} numbers, expected {expected}"),
        }
    }
}

impl<W: fmt::Debug, V: fmt::Debug, S: fmt::Debug> core::error::Error for TwilMotorError<W, V, S> {}

impl<W: fmt::Debug, V: fmt::Debug, S: fmt::Debug> DriverError for TwilMotorError<W, V, S> {
    fn kind(&self) -> DriverFault {
        match self {
            Self::Wheel(_) | Self::Supply(_) | Self::SupplyLow { .. } => DriverFault::Io,
            Self::NotFinite(_) | Self::Length { .. } => DriverFault::Rejected,
            Self::Halted(Guard::Stopped) => DriverFault::Rejected,
            // Whoever should have sent commands was gone.
            Self::Halted(_) => DriverFault::Disconnected,
        }
    }
}

/// Motors with encoders as a driver: voltages in, what the counts say out.
///
/// ```text
/// y_i = Σ_j g_ij n_j      n_j: counts of wheel j since the last reading
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `g_ij` | `gains`, row by row: what one count of wheel `j` is in signal `i` | of the signal |
///
/// For velocities of a robot with wheels of radius `r`, `2 b` apart, `N` counts per turn and the period
/// `T`, see [`velocity_gains`]; ones and zeros give the counts themselves. A tick's reading is always
/// fresh. Commands that are not numbers, a supply below [`TwilMotor::with_least_supply`] and any failing
/// pin stop all motors before the error is told. Motors are stopped by shorting them, which is the 0 V of
/// every model here.
///
/// The [`Watchdog`] counts calls of [`TwilMotor::tick`]: from a timer that goes on when the loop does
/// not, once per period. After it tripped, and after a stop, commands are refused until
/// [`TwilMotor::rearm`].
///
/// Reference: `docs/bring-up.md`; the equations of [`Wheel`], [`SignMagnitude`] and [`LockedAntiphase`].
///
/// ```
/// use core::convert::Infallible;
/// use embedded_hal::{digital, pwm};
/// use loopsight_core::Driver;
/// use loopsight_drivers::twil_motor::*;
/// # #[derive(Default)] struct Pin(bool);
/// # impl digital::ErrorType for Pin { type Error = Infallible; }
/// # impl digital::OutputPin for Pin {
/// #     fn set_low(&mut self) -> Result<(), Infallible> { self.0 = false; Ok(()) }
/// #     fn set_high(&mut self) -> Result<(), Infallible> { self.0 = true; Ok(()) }
/// # }
/// # struct Timer;
/// # impl pwm::ErrorType for Timer { type Error = Infallible; }
/// # impl pwm::SetDutyCycle for Timer {
/// #     fn max_duty_cycle(&self) -> u16 { 1000 }
/// #     fn set_duty_cycle(&mut self, _: u16) -> Result<(), Infallible> { Ok(()) }
/// # }
/// # struct Counter(u32);
/// # impl Quadrature for Counter {
/// #     type Error = Infallible;
/// #     fn position(&mut self) -> Result<u32, Infallible> { self.0 += 100; Ok(self.0) }
/// # }
/// let wheel = || {
///     let bridge = SignMagnitude::new(Timer, Pin::default()).with_enable(Pin::default());
///     Wheel::new(bridge, Counter(0), WheelSettings::new(12.0f32))
/// };
/// let wheels = Pair { right: wheel(), left: wheel() };
/// let gains = velocity_gains(0.05, 0.131, 8192.0, 0.01);
/// let mut driver = TwilMotor::new(wheels, FixedSupply(12.0), gains, 0.01, Watchdog::new(5, 20));
/// let (mut measured, mut applied) = ([0.0; 2], [0.0; 2]);
/// driver.read(&mut measured)?;
/// driver.read(&mut measured)?; // both wheels by 100 counts: 0.38 m/s, no turning
/// assert!((measured[0] - 0.3835).abs() < 1e-4 && measured[1] == 0.0);
/// driver.write(&[6.0, -6.0], &mut applied)?;
/// assert_eq!(applied, [6.0, -6.0]);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct TwilMotor<S, W, V, G> {
    wheels: W,
    supply: V,
    gains: G,
    period: S,
    least_supply: S,
    watchdog: Watchdog,
    readings: u32,
}

/// Linear and angular velocity from the counts of a right and a left wheel, for [`TwilMotor`].
///
/// ```text
/// v = r/2 (φ_r' + φ_l')     ω = r/(2 b) (φ_r' - φ_l')     φ' = 2 π n/(N T)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `r`, `b` | wheel radius, half the track | m |
/// | `N`, `n` | counts per turn, counts in a period | 1 |
/// | `T` | period | s |
///
/// Reference: W. C. Alves, W. F. Lages, R. V. B. Henriques (2018), the kinematics of the Twil.
pub fn velocity_gains<S: Real>(
    wheel_radius: f64,
    half_track: f64,
    counts: f64,
    period: f64,
) -> [S; 4] {
    let rate = core::f64::consts::TAU / (counts * period);
    let forward = S::of(0.5 * wheel_radius * rate);
    let turning = S::of(0.5 * wheel_radius / half_track * rate);
    [forward, forward, turning, -turning]
}

impl<S: Real, W: Wheels<S>, V: Supply<S>, G: AsRef<[S]>> TwilMotor<S, W, V, G> {
    /// Motors that a loop with this period (s) drives. `gains` has a row per measured signal and a
    /// column per wheel.
    pub fn new(wheels: W, supply: V, gains: G, period: S, watchdog: Watchdog) -> Self {
        Self {
            wheels,
            supply,
            gains,
            period,
            least_supply: S::zero(),
            watchdog,
            readings: 0,
        }
    }

    /// The same, refusing to drive with a supply below `volts` V.
    #[must_use]
    pub fn with_least_supply(mut self, volts: S) -> Self {
        self.least_supply = volts;
        self
    }

    /// A tick of the watchdog. Returns what it did to the motors if it did something.
    ///
    /// # Errors
    ///
    /// A pin that fails.
    pub fn tick(&mut self) -> Result<Option<Guard>, TwilMotorError<W::Error, V::Error, S>> {
        let changed = self.watchdog.tick();
        match changed {
            Some(Guard::Coasting) => self.wheels.coast().map_err(TwilMotorError::Wheel)?,
            Some(Guard::Braking) => self.wheels.brake().map_err(TwilMotorError::Wheel)?,
            Some(Guard::Awake | Guard::Stopped) | None => {}
        }
        Ok(changed)
    }

    /// How far the watchdog has gone.
    pub fn guard(&self) -> Guard {
        self.watchdog.guard()
    }

    /// Takes commands again after the watchdog tripped or the motors were stopped.
    pub fn rearm(&mut self) {
        self.watchdog.rearm();
    }

    /// Gives the wheels and the supply back.
    pub fn free(self) -> (W, V) {
        (self.wheels, self.supply)
    }

    fn check(&self, found: usize) -> Result<(), TwilMotorError<W::Error, V::Error, S>> {
        let expected = self.wheels.count();
        if found == expected {
            Ok(())
        } else {
            Err(TwilMotorError::Length { found, expected })
        }
    }

    fn drive(
        &mut self,
        command: &[S],
        applied: &mut [S],
    ) -> Result<(), TwilMotorError<W::Error, V::Error, S>> {
        if let Some(motor) = command.iter().position(|c| !c.is_finite()) {
            return Err(TwilMotorError::NotFinite(motor));
        }
        let volts = self.supply.volts().map_err(TwilMotorError::Supply)?;
        let least = self.least_supply;
        // A supply that is not a number is not above anything.
        if !(volts.is_finite() && volts >= least && volts > S::zero()) {
            return Err(TwilMotorError::SupplyLow { volts, least });
        }
        for (index, (command, applied)) in command.iter().zip(applied.iter_mut()).enumerate() {
            *applied = self
                .wheels
                .drive(index, *command, volts, self.period)
                .map_err(TwilMotorError::Wheel)?;
        }
        Ok(())
    }
}

impl<S, W, V, G> Driver<S> for TwilMotor<S, W, V, G>
where
    S: Real,
    W: Wheels<S> + Send,
    V: Supply<S> + Send,
    G: AsRef<[S]> + Send,
{
    type Error = TwilMotorError<W::Error, V::Error, S>;

    fn read(&mut self, measured: &mut [S]) -> Result<Sample<S>, Self::Error> {
        let (wheels, gains) = (self.wheels.count(), self.gains.as_ref());
        if measured.len() * wheels != gains.len() {
            return Err(TwilMotorError::Length {
                found: measured.len(),
                expected: gains.len() / wheels.max(1),
            });
        }
        measured.fill(S::zero());
        for wheel in 0..wheels {
            let counts = self.wheels.counts(wheel).map_err(TwilMotorError::Wheel)?;
            let counts = S::of(f64::from(counts));
            for (row, signal) in measured.iter_mut().enumerate() {
                *signal += self.gains.as_ref()[row * wheels + wheel] * counts;
            }
        }
        let time = S::of(f64::from(self.readings)) * self.period;
        self.readings = self.readings.wrapping_add(1);
        Ok(Sample { time, fresh: true })
    }

    fn write(&mut self, command: &[S], applied: &mut [S]) -> Result<(), Self::Error> {
        self.check(command.len())?;
        self.check(applied.len())?;
        if self.watchdog.guard() != Guard::Awake {
            applied.fill(S::zero());
            return Err(TwilMotorError::Halted(self.watchdog.guard()));
        }
        if let Err(error) = self.drive(command, applied) {
            applied.fill(S::zero());
            // The first error is the one that matters; a failing stop cannot be helped here.
            let _ = self.safe_stop();
            return Err(error);
        }
        self.watchdog.fed();
        Ok(())
    }

    fn safe_stop(&mut self) -> Result<(), Self::Error> {
        self.watchdog.stop();
        self.wheels.brake().map_err(TwilMotorError::Wheel)
    }
}
