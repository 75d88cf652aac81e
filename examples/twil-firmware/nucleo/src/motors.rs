//! The robot's motors, encoders and supply on the pins of the board.

use core::convert::Infallible;
use core::sync::atomic::{AtomicU32, Ordering};

use loopsight_core::Driver;
use loopsight_drivers::twil_motor::{
    Pair, Quadrature, SignMagnitude, Supply, TwilMotor, Watchdog, Wheel, WheelSettings, Wheels,
    velocity_gains,
};
use loopsight_onboard::Sensors;
use stm32f4xx_hal::adc::Adc;
use stm32f4xx_hal::adc::config::{AdcConfig, Clock, SampleTime};
use stm32f4xx_hal::gpio::{Analog, PA0, PA1, PA6, PA7, PA8, PA9, PB5, PB10, PC0};
use stm32f4xx_hal::pac::{ADC1, TIM1, TIM2, TIM3};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::qei::Qei;
use stm32f4xx_hal::rcc::Rcc;

/// Radius of the wheels, m.
const WHEEL_RADIUS: f64 = 0.05;
/// Half the distance between the wheels, m.
const HALF_TRACK: f64 = 0.131;
/// Edges of an encoder per turn of its wheel.
const COUNTS_PER_TURN: f64 = 8192.0;
/// Frequency of the PWM, Hz.
const PWM_HZ: u32 = 20_000;
/// Volts at the divider's top per volt at the pin: 100 kΩ over 22 kΩ.
const DIVIDER: f32 = (100.0 + 22.0) / 22.0;
/// The largest voltage of a motor, V.
const LIMIT: f32 = 12.0;
/// Motor and encoder of the right wheel are wired the other way round, and those of the left one: its shaft
/// points the other way, so forwards is backwards for both.
const RIGHT_REVERSED: (bool, bool) = (false, false);
const LEFT_REVERSED: (bool, bool) = (true, true);
/// Periods without a command until the motors coast, and from there until they brake.
const WATCHDOG: (u32, u32) = (5, 20);

/// Pins and timers, as the README's table has them.
pub struct Hardware {
    /// PWM of right and left.
    pub pwm: (TIM1, PA8, PA9),
    /// Direction of right and left.
    pub directions: (PB5, PB10),
    /// Encoder of the right wheel.
    pub right: (TIM2, PA0, PA1),
    /// Encoder of the left wheel.
    pub left: (TIM3, PA6, PA7),
    /// The supply behind its divider.
    pub supply: (ADC1, PC0),
}

/// An encoder on a timer of 32 bits.
struct Right(Qei<TIM2>);

impl Quadrature for Right {
    type Error = Infallible;
    fn position(&mut self) -> Result<u32, Infallible> {
        Ok(self.0.count())
    }
}

/// An encoder on a timer of 16 bits.
struct Left(Qei<TIM3>);

impl Quadrature for Left {
    type Error = Infallible;
    fn position(&mut self) -> Result<u32, Infallible> {
        Ok(u32::from(self.0.count()))
    }
    fn range(&self) -> u64 {
        1 << 16
    }
}

/// The supply, V, as it was measured last: bits of an `f32`.
static SUPPLY: AtomicU32 = AtomicU32::new(0);

/// The supply that the motors are driven from.
struct Battery;

impl Supply<f32> for Battery {
    type Error = Infallible;
    fn volts(&mut self) -> Result<f32, Infallible> {
        Ok(f32::from_bits(SUPPLY.load(Ordering::Relaxed)))
    }
}

/// Motors, encoders and supply of the robot.
pub struct Motors<W> {
    motors: TwilMotor<f32, W, Battery, [f32; 4]>,
    adc: Adc<ADC1>,
    divider: PC0<Analog>,
    driving: bool,
    failed: bool,
}

/// Starts timers and converter; the motors are at rest.
pub fn start(
    hardware: Hardware,
    period_s: f64,
    rcc: &mut Rcc,
) -> Motors<impl Wheels<f32> + Send + use<>> {
    let (timer, right_pwm, left_pwm) = hardware.pwm;
    let (_, (right, left, ..)) = timer.pwm_hz(PWM_HZ.Hz(), rcc);
    let (mut right, mut left) = (right.with(right_pwm), left.with(left_pwm));
    right.enable();
    left.enable();
    let directions = hardware.directions;
    let right = SignMagnitude::new(right, directions.0.into_push_pull_output());
    let left = SignMagnitude::new(left, directions.1.into_push_pull_output());
    let (timer, a, b) = hardware.right;
    let right_encoder = Right(Qei::new(
        timer,
        (a.into_alternate(), b.into_alternate()),
        rcc,
    ));
    let (timer, a, b) = hardware.left;
    let left_encoder = Left(Qei::new(
        timer,
        (a.into_alternate(), b.into_alternate()),
        rcc,
    ));
    let settings = |reversed: (bool, bool)| WheelSettings {
        motor_reversed: reversed.0,
        encoder_reversed: reversed.1,
        ..WheelSettings::new(LIMIT)
    };
    let wheels = Pair {
        right: Wheel::new(right, right_encoder, settings(RIGHT_REVERSED)),
        left: Wheel::new(left, left_encoder, settings(LEFT_REVERSED)),
    };
    let gains = velocity_gains(WHEEL_RADIUS, HALF_TRACK, COUNTS_PER_TURN, period_s);
    let watchdog = Watchdog::new(WATCHDOG.0, WATCHDOG.1);
    let (adc, divider) = hardware.supply;
    // At a quarter of its bus: at half, 42 MHz, it would be faster than it may be.
    let config = AdcConfig::default().clock(Clock::Pclk2_div_4);
    let mut adc = Adc::new(adc, true, config, rcc);
    // The reference is what the factory measured, not what the board's 3.3 V should be.
    adc.calibrate();
    Motors {
        motors: TwilMotor::new(wheels, Battery, gains, period_s as f32, watchdog),
        adc,
        divider: divider.into_analog(),
        driving: false,
        failed: false,
    }
}

impl<W: Wheels<f32> + Send> Motors<W> {
    /// What encoders and supply say after so many periods, of which there should be one; `None` where something
    /// failed since the last time.
    pub fn sense(&mut self, periods: u32) -> Option<Sensors<[f32; 2]>> {
        let sample = self.adc.convert(&self.divider, SampleTime::Cycles_480);
        let supply = 1e-3 * f32::from(self.adc.sample_to_millivolts(sample)) * DIVIDER;
        SUPPLY.store(supply.to_bits(), Ordering::Relaxed);
        let mut measured = [0.0; 2];
        let read = self.motors.read(&mut measured).is_ok();
        // The driver takes counts for those of one period.
        let measured = measured.map(|speed| speed / periods as f32);
        let failed = core::mem::take(&mut self.failed);
        (read && !failed).then_some(Sensors { measured, supply })
    }

    /// Drives with these voltages, or brings the motors to rest; true while they are driven.
    pub fn drive(&mut self, volts: Option<&[f32; 2]>) -> bool {
        let done = match volts {
            Some(volts) => {
                if !self.driving {
                    self.motors.rearm();
                }
                self.motors.write(volts, &mut [0.0; 2])
            }
            None if self.driving => self.motors.safe_stop(),
            None => Ok(()),
        };
        self.failed |= done.is_err();
        self.driving = volts.is_some() && done.is_ok();
        // Pins that fail are told of once; there is no third way to stop.
        self.failed |= self.motors.tick().is_err();
        self.driving
    }
}
