//! Every transaction of every pin, against the mocks of embedded-hal.

mod bridges;
mod motors;

use std::convert::Infallible;
use std::io::ErrorKind;
use std::sync::{Arc, Mutex};

use embedded_hal::digital::{self, OutputPin};
use embedded_hal::pwm::{self, SetDutyCycle};
use embedded_hal_mock::eh1::MockError;
use embedded_hal_mock::eh1::digital::{Mock as Pin, State, Transaction as Level};
use embedded_hal_mock::eh1::pwm::{Mock as Pwm, Transaction as Duty};

use super::*;

const STEPS: u16 = 1000;

fn pwm(duties: &[u16]) -> Pwm {
    let first = std::iter::once(Duty::max_duty_cycle(STEPS));
    let set = duties.iter().map(|d| Duty::set_duty_cycle(*d));
    Pwm::new(&first.chain(set).collect::<Vec<_>>())
}

/// A pin that is set to these levels: `h` and `l`.
fn pin(levels: &str) -> Pin {
    let state = |c| if c == 'h' { State::High } else { State::Low };
    let set = levels.chars().map(|c| Level::set(state(c)));
    Pin::new(&set.collect::<Vec<_>>())
}

fn broken() -> MockError {
    MockError::Io(ErrorKind::NotConnected)
}

/// A counter that is read at these positions, and then no more.
struct Positions(Vec<u32>);

impl Quadrature for Positions {
    type Error = &'static str;
    fn position(&mut self) -> Result<u32, &'static str> {
        if self.0.is_empty() {
            return Err("the counter is gone");
        }
        Ok(self.0.remove(0))
    }
    fn range(&self) -> u64 {
        1 << 16
    }
}

/// A meter that shows these voltages, and then no more.
struct Meter(Vec<f32>);

impl Supply<f32> for Meter {
    type Error = &'static str;
    fn volts(&mut self) -> Result<f32, &'static str> {
        if self.0.is_empty() {
            return Err("the meter is gone");
        }
        Ok(self.0.remove(0))
    }
}

/// What happened at all pins of a board, in the order in which it did.
#[derive(Clone, Default)]
struct Tape(Arc<Mutex<Vec<String>>>);

struct Taped(Tape, &'static str);

impl digital::ErrorType for Taped {
    type Error = Infallible;
}

impl OutputPin for Taped {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.say(format!("{} low", self.1));
        Ok(())
    }
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.say(format!("{} high", self.1));
        Ok(())
    }
}

impl pwm::ErrorType for Taped {
    type Error = Infallible;
}

impl SetDutyCycle for Taped {
    fn max_duty_cycle(&self) -> u16 {
        STEPS
    }
    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.0.say(format!("{} {duty}", self.1));
        Ok(())
    }
}

impl Tape {
    fn say(&self, what: String) {
        self.0.lock().unwrap().push(what);
    }
    fn heard(&self) -> Vec<String> {
        std::mem::take(&mut *self.0.lock().unwrap())
    }
    fn pin(&self, name: &'static str) -> Taped {
        Taped(self.clone(), name)
    }
    fn bridge(&self) -> SignMagnitude<Taped, Taped, Taped, Taped> {
        SignMagnitude::new(self.pin("pwm"), self.pin("direction"))
            .with_enable(self.pin("enable"))
            .with_brake(self.pin("brake"))
    }
}

/// A PWM and a direction that remember what they were set to.
struct Last(Arc<Mutex<(u16, bool)>>, u16);

impl digital::ErrorType for Last {
    type Error = Infallible;
}

impl OutputPin for Last {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.lock().unwrap().1 = false;
        Ok(())
    }
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.lock().unwrap().1 = true;
        Ok(())
    }
}

impl pwm::ErrorType for Last {
    type Error = Infallible;
}

impl SetDutyCycle for Last {
    fn max_duty_cycle(&self) -> u16 {
        self.1
    }
    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.0.lock().unwrap().0 = duty;
        Ok(())
    }
}
