//! The Twil's firmware on a Nucleo-F446RE, with motors and encoders of its own.
//!
//! It runs its loop by its own timer; the host, over the board's serial port, tells it what it is and where
//! it should be, and hears what it did. All that decides anything is in `loopsight-onboard`, which runs on a
//! desk, too; all that turns volts into pins is in `loopsight-drivers`. Here is a board.

#![no_std]
#![no_main]

mod line;
mod motors;

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::Peripherals as Core;
use cortex_m::interrupt::free;
use cortex_m::peripheral::DWT;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::{entry, exception};
use loopsight_link::{LONGEST, Note, Reply, encode};
use loopsight_onboard::{Meter, Session, Twil};
use stm32f4xx_hal::pac::Peripherals;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Config;
use stm32f4xx_hal::serial::{Serial, config::Config as LineConfig};
use stm32f4xx_hal::watchdog::IndependentWatchdog;

/// Period of the loop, µs.
const PERIOD_US: u32 = 10_000;
/// Clock of the core, Hz.
const CLOCK: u32 = 168_000_000;
/// A loop that hangs for so long, ms, resets the chip: its pins are let go, and the bridge rests.
const HANGS_MS: u32 = 50;

/// Periods that are over, and were not looked at.
static PERIODS: AtomicU32 = AtomicU32::new(0);

#[entry]
fn main() -> ! {
    let (Some(chip), Some(mut core)) = (Peripherals::take(), Core::take()) else {
        // Peripherals are taken once; there is no second time.
        halt()
    };
    // The ST-LINK gives its 8 MHz, of a crystal: a speed is counts over a period that must be right.
    let clock = Config::hse(8.MHz()).bypass_hse_oscillator();
    let mut rcc = chip.RCC.freeze(clock.sysclk(CLOCK.Hz()));
    let (a, b, c) = (
        chip.GPIOA.split(&mut rcc),
        chip.GPIOB.split(&mut rcc),
        chip.GPIOC.split(&mut rcc),
    );
    let hardware = motors::Hardware {
        pwm: (chip.TIM1, a.pa8, a.pa9),
        directions: (b.pb5, b.pb10),
        right: (chip.TIM2, a.pa0, a.pa1),
        left: (chip.TIM3, a.pa6, a.pa7),
        supply: (chip.ADC1, c.pc0),
    };
    let mut motors = motors::start(hardware, f64::from(PERIOD_US) * 1e-6, &mut rcc);
    let mut light = a.pa5.into_push_pull_output();
    let serial = LineConfig::default().baudrate(line::BAUD.bps());
    let Ok(serial) = Serial::new(chip.USART2, (a.pa2, a.pa3), serial, &mut rcc) else {
        // The clock divides to this rate, or the board does not talk at all.
        halt()
    };
    let (tx, rx) = serial.split();
    line::open(tx, rx);
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST
        .set_reload(rcc.clocks.hclk().raw() / 1_000_000 * PERIOD_US - 1);
    core.SYST.clear_current();
    core.SYST.enable_counter();
    core.SYST.enable_interrupt();
    let mut hangs = IndependentWatchdog::new(chip.IWDG);
    hangs.start(HANGS_MS.millis());

    // Cleared once: each message writes over what it needs.
    let mut buffer = [0; LONGEST];
    let mut say = |reply: &Reply| {
        // Every message fits (a test of `loopsight-link`); one that did not would be noticed as lost.
        if let Ok(length) = encode(reply, &mut buffer) {
            line::send(&buffer[..length]);
        }
    };
    let mut robot = Session::<Twil, _>::with_sensors(PERIOD_US, Cycles(0));
    say(&Reply::Log(Note::Started));
    loop {
        while let Some(byte) = line::received() {
            robot.take(byte, &mut say);
        }
        let periods = PERIODS.swap(0, Ordering::Relaxed);
        if periods > 0 {
            hangs.feed();
            robot.sensed(motors.sense(periods), &mut say);
            let drives = motors.drive(robot.output());
            light.set_state(drives.into());
        }
        free(|_| {
            if line::is_quiet() && PERIODS.load(Ordering::Relaxed) == 0 {
                // An interrupt that is pending ends the sleep, so none is missed.
                cortex_m::asm::wfi();
            }
        });
    }
}

#[exception]
fn SysTick() {
    PERIODS.fetch_add(1, Ordering::Relaxed);
}

/// Cycles of the core that a tick takes.
struct Cycles(u32);

impl Meter for Cycles {
    fn start(&mut self) {
        self.0 = DWT::cycle_count();
    }

    fn stop(&mut self) -> u32 {
        DWT::cycle_count().wrapping_sub(self.0)
    }
}

fn halt() -> ! {
    loop {
        cortex_m::asm::wfi();
    }
}

/// The watchdog of the chip resets it, and with it the pins.
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    halt()
}
