//! The board at work.

use std::fmt::Display;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{JoinHandle, park_timeout};
use std::time::Duration;

use embedded_hal::digital::OutputPin;
use loopsight_core::{Clock, Driver, DriverError as _, DriverFault, Sample};
use loopsight_model::registry::HostDriverError;

use super::LinuxGpio;
use super::bridge::{BoardBridge, BoardPin, Lines};
use super::counter::KernelCounter;
use super::file::{FileError, KernelFile};
use super::pwm::SysfsPwm;
use super::settings::{BridgeKind, Motor, SupplySetting};
use crate::twil_motor::{
    LockedAntiphase, SignMagnitude, Supply, TwilMotor, TwilMotorError, Watchdog, Wheel, WheelError,
    Wheels,
};

/// What a file says, for a model.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) settings: LinuxGpio,
    /// In the order of the model's inputs.
    pub(crate) motors: Vec<(&'static str, Motor)>,
    /// What one count of each motor is in each measured signal.
    pub(crate) gains: Vec<f64>,
    pub(crate) period: f64,
}

/// A wheel of a board.
type BoardWheel<P> = Wheel<f64, BoardBridge<P>, KernelCounter>;

/// The wheels of a board by input; errors name the motor.
struct Row<P>(Vec<(&'static str, BoardWheel<P>)>);

/// Says which motor it was.
fn named(id: &str, error: WheelError<String, FileError>) -> String {
    match error {
        WheelError::Bridge(error) => format!("the motor of `{id}`: {error}"),
        WheelError::Encoder(error) => format!("the encoder of `{id}`: {error}"),
    }
}

impl<P: OutputPin<Error: Display>> Row<P> {
    fn each(
        &mut self,
        mut action: impl FnMut(&mut BoardWheel<P>) -> Result<(), WheelError<String, FileError>>,
    ) -> Result<(), String> {
        let done = self.0.iter_mut().map(|(id, wheel)| {
            let done = action(wheel);
            done.map_err(|error| named(id, error))
        });
        // Each of them, though one fails.
        done.fold(Ok(()), Result::and)
    }
}

impl<P: OutputPin<Error: Display>> Wheels<f64> for Row<P> {
    type Error = String;
    fn count(&self) -> usize {
        self.0.len()
    }
    fn drive(&mut self, index: usize, volts: f64, supply: f64, period: f64) -> Result<f64, String> {
        let (id, wheel) = &mut self.0[index];
        let driven = wheel.drive(volts, supply, period);
        driven.map_err(|error| named(id, error))
    }
    fn counts(&mut self, index: usize) -> Result<i32, String> {
        let (id, wheel) = &mut self.0[index];
        wheel.counts().map_err(|error| named(id, error))
    }
    fn coast(&mut self) -> Result<(), String> {
        self.each(Wheel::coast)
    }
    fn brake(&mut self) -> Result<(), String> {
        self.each(Wheel::brake)
    }
}

/// The voltage behind the bridges.
enum Source {
    Fixed(f64),
    Measured(KernelFile, f64),
}

impl Supply<f64> for Source {
    type Error = FileError;
    fn volts(&mut self) -> Result<f64, FileError> {
        match self {
            Self::Fixed(volts) => Ok(*volts),
            Self::Measured(file, scale) => file.read::<f64>().map(|raw| raw * *scale),
        }
    }
}

type Motors<P> = TwilMotor<f64, Row<P>, Source, Vec<f64>>;

fn locked<P>(motors: &Mutex<Motors<P>>) -> MutexGuard<'_, Motors<P>> {
    // Nothing is left half done in them by a thread that died.
    motors.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Motors that are ready, with the thread that watches over them.
struct Running<P> {
    motors: Arc<Mutex<Motors<P>>>,
    over: Arc<AtomicBool>,
    watching: Option<JoinHandle<()>>,
    /// When they were read last, by the clock.
    read: Option<f64>,
}

impl<P> Drop for Running<P> {
    fn drop(&mut self) {
        self.over.store(true, Ordering::SeqCst);
        if let Some(thread) = self.watching.take() {
            thread.thread().unpark();
            // Whether it died of something else makes no difference here.
            let _ = thread.join();
        }
    }
}

/// The driver; opens everything at the first reading.
pub(crate) struct Board<L: Lines, K> {
    plan: Plan,
    lines: L,
    clock: K,
    running: Option<Running<L::Pin>>,
}

fn failed(fault: DriverFault, message: impl Display) -> HostDriverError {
    HostDriverError {
        fault,
        message: message.to_string(),
    }
}

fn told(error: TwilMotorError<String, FileError, f64>) -> HostDriverError {
    let fault = error.kind();
    match error {
        TwilMotorError::Wheel(why) => failed(fault, why),
        TwilMotorError::Supply(why) => {
            failed(fault, format!("the supply cannot be measured: {why}"))
        }
        other => failed(fault, other),
    }
}

impl<L: Lines<Pin: 'static>, K: Clock + Send> Board<L, K> {
    pub(crate) fn new(plan: Plan, lines: L, clock: K) -> Self {
        Self {
            plan,
            lines,
            clock,
            running: None,
        }
    }

    fn open(&self) -> Result<Running<L::Pin>, String> {
        let file = |error: FileError| error.to_string();
        let LinuxGpio {
            chip,
            sysfs,
            pwm_hz,
            ..
        } = &self.plan.settings;
        // All bridges are off before the first PWM is on.
        let mut pins = Vec::new();
        for (id, motor) in &self.plan.motors {
            for line in [&motor.enable, &motor.brake, &motor.direction] {
                let pin = BoardPin::open(&self.lines, chip, line.as_ref());
                pins.push(pin.map_err(|why| format!("the motor of `{id}`: {why}"))?);
            }
        }
        let mut pins = pins.into_iter();
        let mut row = Vec::new();
        for (id, motor) in &self.plan.motors {
            let (Some(enable), Some(brake), Some(direction)) =
                (pins.next(), pins.next(), pins.next())
            else {
                return Err(format!("the motor of `{id}` has no pins"));
            };
            let [chip, channel] = motor.pwm;
            let pwm = |share| SysfsPwm::open(sysfs, chip, channel, *pwm_hz, share).map_err(file);
            let bridge = match motor.bridge {
                BridgeKind::SignMagnitude => BoardBridge::Signed(
                    SignMagnitude::new(pwm(0.0)?, direction)
                        .with_enable(enable)
                        .with_brake(brake),
                ),
                BridgeKind::LockedAntiphase => BoardBridge::Locked(
                    LockedAntiphase::new(pwm(0.5)?)
                        .with_enable(enable)
                        .with_brake(brake),
                ),
            };
            let [device, count] = motor.counter;
            let counter = KernelCounter::open(sysfs, device, count).map_err(file)?;
            row.push((*id, Wheel::new(bridge, counter, motor.wheel())));
        }
        let supply = match &self.plan.settings.supply {
            SupplySetting::Fixed(volts) => Source::Fixed(*volts),
            SupplySetting::Measured { file: path, scale } => {
                Source::Measured(KernelFile::open(path.clone(), false).map_err(file)?, *scale)
            }
        };
        let settings = &self.plan.settings;
        let watchdog = Watchdog::new(settings.coast_after, settings.then_brake);
        let (gains, period) = (self.plan.gains.clone(), self.plan.period);
        let motors = TwilMotor::new(Row(row), supply, gains, period, watchdog)
            .with_least_supply(settings.least_supply_v);
        self.watch(Arc::new(Mutex::new(motors)))
    }

    /// Starts the thread that ticks the watchdog.
    fn watch(&self, motors: Arc<Mutex<Motors<L::Pin>>>) -> Result<Running<L::Pin>, String> {
        let over = Arc::new(AtomicBool::new(false));
        let pace = Duration::try_from_secs_f64(self.plan.period)
            .map_err(|error| format!("no thread can keep this period: {error}"))?;
        let (watched, seen) = (Arc::clone(&motors), Arc::clone(&over));
        let watching = std::thread::Builder::new()
            .name("watchdog".to_owned())
            .spawn(move || {
                loop {
                    park_timeout(pace);
                    if seen.load(Ordering::SeqCst) {
                        return;
                    }
                    // A pin that fails here fails at the loop's next command, too, and is told there.
                    let _ = locked(&watched).tick();
                }
            })
            .map_err(|error| format!("no thread can watch the motors: {error}"))?;
        Ok(Running {
            motors,
            over,
            watching: Some(watching),
            read: None,
        })
    }
}

impl<L: Lines<Pin: 'static>, K: Clock + Send> Driver<f64> for Board<L, K> {
    type Error = HostDriverError;

    fn read(&mut self, measured: &mut [f64]) -> Result<Sample<f64>, HostDriverError> {
        if self.running.is_none() {
            let opened = self.open();
            self.running = Some(opened.map_err(|why| failed(DriverFault::Io, why))?);
        }
        let Some(running) = &mut self.running else {
            return Err(failed(DriverFault::Io, "the board is not open"));
        };
        let sample = locked(&running.motors).read(measured).map_err(told)?;
        let now = self.clock.now();
        // How many periods the counts are of.
        let periods = running
            .read
            .replace(now)
            .map_or(1.0, |before| (now - before) / self.plan.period);
        let known = periods > 0.0 && periods.is_finite();
        measured
            .iter_mut()
            .for_each(|y| *y = if known { *y / periods } else { 0.0 });
        Ok(Sample {
            time: sample.time,
            fresh: (0.5..=1.5).contains(&periods),
        })
    }

    fn write(&mut self, command: &[f64], applied: &mut [f64]) -> Result<(), HostDriverError> {
        match &self.running {
            Some(running) => locked(&running.motors)
                .write(command, applied)
                .map_err(told),
            None => {
                let why = "a command before the first reading: the board is not open";
                Err(failed(DriverFault::Rejected, why))
            }
        }
    }

    fn safe_stop(&mut self) -> Result<(), HostDriverError> {
        match &self.running {
            Some(running) => locked(&running.motors).safe_stop().map_err(told),
            None => Ok(()),
        }
    }
}

impl<L: Lines, K> Drop for Board<L, K> {
    fn drop(&mut self) {
        if let Some(running) = &self.running {
            // There is nobody left to be told.
            let _ = locked(&running.motors).safe_stop();
        }
    }
}
