//! Bridges whose pins and kind a file says.

use std::fmt::Display;

use embedded_hal::digital::{ErrorType, OutputPin, PinState};
use gpiocdev_embedded_hal as gpiocdev;

use super::file::FileError;
use super::pwm::SysfsPwm;
use super::settings::GpioLine;
use crate::twil_motor::{Bridge, BridgeError, LockedAntiphase, SignMagnitude};

/// Opens lines as outputs.
pub(crate) trait Lines: Send {
    /// An output.
    type Pin: OutputPin<Error: Display> + Send;
    /// Opens `line` of the device file `chip` as an output that begins at this level.
    fn open(&self, chip: &str, line: u32, level: PinState) -> Result<Self::Pin, String>;
}

/// The kernel's character devices.
#[derive(Debug)]
pub(crate) struct CharacterDevices;

impl Lines for CharacterDevices {
    type Pin = gpiocdev::OutputPin;
    fn open(&self, chip: &str, line: u32, level: PinState) -> Result<Self::Pin, String> {
        gpiocdev::OutputPin::new(chip, line, level)
            .map_err(|error| format!("line {line} of {chip}: {error}"))
    }
}

/// An output that a file may leave out or turn round.
#[derive(Debug)]
pub(crate) struct BoardPin<P> {
    pin: Option<P>,
    active_low: bool,
}

impl<P: OutputPin> BoardPin<P> {
    /// Opens the pin at its inactive level.
    pub(crate) fn open<L: Lines<Pin = P>>(
        lines: &L,
        chip: &str,
        line: Option<&GpioLine>,
    ) -> Result<Self, String> {
        let Some(line) = line else {
            return Ok(Self {
                pin: None,
                active_low: false,
            });
        };
        let inactive = PinState::from(line.active_low());
        Ok(Self {
            pin: Some(lines.open(chip, line.number(), inactive)?),
            active_low: line.active_low(),
        })
    }
}

impl<P: ErrorType> ErrorType for BoardPin<P> {
    type Error = P::Error;
}

impl<P: OutputPin> OutputPin for BoardPin<P> {
    fn set_low(&mut self) -> Result<(), P::Error> {
        let level = PinState::from(self.active_low);
        self.pin.as_mut().map_or(Ok(()), |p| p.set_state(level))
    }
    fn set_high(&mut self) -> Result<(), P::Error> {
        let level = PinState::from(!self.active_low);
        self.pin.as_mut().map_or(Ok(()), |p| p.set_state(level))
    }
}

/// A bridge of either kind.
#[derive(Debug)]
pub(crate) enum BoardBridge<P> {
    Signed(SignMagnitude<SysfsPwm, BoardPin<P>, BoardPin<P>, BoardPin<P>>),
    Locked(LockedAntiphase<SysfsPwm, BoardPin<P>, BoardPin<P>>),
}

fn told<D: Display, E: Display>(error: BridgeError<FileError, D, E, E>) -> String {
    match error {
        BridgeError::Pwm(error) => format!("its PWM failed: {error}"),
        BridgeError::Direction(error) => format!("its direction pin failed: {error}"),
        BridgeError::Enable(error) => format!("its enable pin failed: {error}"),
        BridgeError::Brake(error) => format!("its brake pin failed: {error}"),
    }
}

impl<P: OutputPin<Error: Display>> Bridge<f64> for BoardBridge<P> {
    type Error = String;
    fn drive(&mut self, share: f64) -> Result<f64, String> {
        match self {
            Self::Signed(bridge) => bridge.drive(share).map_err(told),
            Self::Locked(bridge) => bridge.drive(share).map_err(told),
        }
    }
    fn coast(&mut self) -> Result<(), String> {
        match self {
            Self::Signed(bridge) => Bridge::<f64>::coast(bridge).map_err(told),
            Self::Locked(bridge) => Bridge::<f64>::coast(bridge).map_err(told),
        }
    }
    fn brake(&mut self) -> Result<(), String> {
        match self {
            Self::Signed(bridge) => Bridge::<f64>::brake(bridge).map_err(told),
            Self::Locked(bridge) => Bridge::<f64>::brake(bridge).map_err(told),
        }
    }
}
