//! ARM MPS2 with application note 386, as QEMU has it: UART0, SysTick, and how long a tick takes.
//!
//! Reference: ARM DAI 0386, "ARM Cortex-M4 SMM on V2M-MPS2"; ARM DDI 0479, "Cortex-M System Design Kit", section
//! 4.3 (APB UART).

use core::cell::RefCell;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::interrupt::{Mutex, free};
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{NVIC, SYST};
use cortex_m_rt::exception;
use heapless::Deque;
use loopsight_onboard::Meter;

/// Clock of core and SysTick, Hz.
const CLOCK: u32 = 25_000_000;
/// Baud rate, 1/s. QEMU has none; a board would.
const BAUD: u32 = 1_000_000;

/// What the line has brought, and nobody has read. More than the longest frame.
static RECEIVED: Mutex<RefCell<Deque<u8, 2048>>> = Mutex::new(RefCell::new(Deque::new()));
/// Periods that are over, and were not looked at.
static PERIODS: AtomicU32 = AtomicU32::new(0);

/// UART0 of the board.
pub struct Line(());

/// Registers of UART0, by their distance from its base.
#[derive(Clone, Copy)]
enum Register {
    Data = 0x0,
    State = 0x4,
    Control = 0x8,
    Interrupt = 0xC,
    Divider = 0x10,
}

const UART0: usize = 0x4000_4000;
const TX_FULL: u32 = 1;
const RX_FULL: u32 = 2;
const TX_AND_RX_WITH_RX_INTERRUPT: u32 = 0b1011;

fn read(register: Register) -> u32 {
    // SAFETY: a register of UART0, aligned, readable at any time; nobody else uses this device.
    unsafe { core::ptr::read_volatile((UART0 + register as usize) as *const u32) }
}

fn write(register: Register, value: u32) {
    // SAFETY: a register of UART0, aligned, writable at any time; nobody else uses this device.
    unsafe { core::ptr::write_volatile((UART0 + register as usize) as *mut u32, value) }
}

/// The receive interrupt of UART0.
#[derive(Clone, Copy)]
struct Uart0Receive;

// SAFETY: number 0 is that of UART0's receiver on this board.
unsafe impl cortex_m::interrupt::InterruptNumber for Uart0Receive {
    fn number(self) -> u16 {
        0
    }
}

/// Starts line and timer. `None` the second time.
pub fn start(period_us: u32) -> Option<(Line, Stopwatch)> {
    let mut core = cortex_m::Peripherals::take()?;
    write(Register::Divider, CLOCK / BAUD);
    write(Register::Control, TX_AND_RX_WITH_RX_INTERRUPT);
    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.set_reload(CLOCK / 1_000_000 * period_us - 1);
    core.SYST.clear_current();
    core.SYST.enable_counter();
    core.SYST.enable_interrupt();
    // SAFETY: nothing here relies on this interrupt being masked.
    unsafe { NVIC::unmask(Uart0Receive) };
    let mut stopwatch = Stopwatch {
        from: 0,
        of_itself: 0,
    };
    stopwatch.start();
    stopwatch.of_itself = stopwatch.stop();
    Some((Line(()), stopwatch))
}

impl Line {
    /// Writes all of it.
    pub fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            while read(Register::State) & TX_FULL != 0 {}
            write(Register::Data, u32::from(*byte));
        }
    }
}

/// The next byte of the line.
pub fn received() -> Option<u8> {
    free(|token| RECEIVED.borrow(token).borrow_mut().pop_front())
}

/// True once per period that went by.
pub fn period_is_over() -> bool {
    let over = |n: u32| n.checked_sub(1);
    let order = Ordering::Relaxed;
    PERIODS.fetch_update(order, order, over).is_ok()
}

/// Waits for something to do. What is looked at here cannot change before the core sleeps, so no wake-up is
/// missed: an interrupt that is pending ends the sleep.
pub fn sleep() {
    free(|token| {
        let nothing = RECEIVED.borrow(token).borrow().is_empty();
        if nothing && PERIODS.load(Ordering::Relaxed) == 0 {
            cortex_m::asm::wfi();
        }
    });
}

#[exception]
fn SysTick() {
    PERIODS.fetch_add(1, Ordering::Relaxed);
}

/// UART0 is the only device whose interrupt is let through.
#[exception]
unsafe fn DefaultHandler(_number: i16) {
    free(|token| {
        // Cleared first: a byte that comes while the others are read asks again.
        write(Register::Interrupt, 0b10);
        let mut queue = RECEIVED.borrow(token).borrow_mut();
        while read(Register::State) & RX_FULL != 0 {
            // Where nothing is read for so long a byte is lost, and with it its frame.
            let _ = queue.push_back(read(Register::Data) as u8);
        }
    });
}

/// Counts of SysTick (40 ns) between start and stop, its own left out.
pub struct Stopwatch {
    from: u32,
    of_itself: u32,
}

impl Meter for Stopwatch {
    #[inline(always)]
    fn start(&mut self) {
        self.from = SYST::get_current();
    }

    #[inline(always)]
    fn stop(&mut self) -> u32 {
        let now = SYST::get_current();
        // It counts down, and begins again at its reload.
        let span = match self.from.checked_sub(now) {
            Some(span) => span,
            None => self.from + SYST::get_reload() + 1 - now,
        };
        span.saturating_sub(self.of_itself)
    }
}
