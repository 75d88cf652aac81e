//! USART2, which the board's ST-LINK hands to the host as a serial port: received and sent by interrupt.

use core::cell::RefCell;

use cortex_m::interrupt::{Mutex, free};
use heapless::Deque;
use stm32f4xx_hal::pac::{NVIC, USART2, interrupt};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::serial::{Rx, Tx};

/// Baud rate, 1/s: an act of a hundred bytes each period is 22 % of it.
pub const BAUD: u32 = 460_800;

/// The line, once it is open.
static LINE: Mutex<RefCell<Option<Line>>> = Mutex::new(RefCell::new(None));

struct Line {
    tx: Tx<USART2>,
    rx: Rx<USART2>,
    /// What has come, and nobody has read. More than the longest frame.
    received: Deque<u8, 2048>,
    /// What is to go.
    to_send: Deque<u8, 1024>,
}

/// Opens the line.
pub fn open(tx: Tx<USART2>, mut rx: Rx<USART2>) {
    rx.listen();
    let line = Line {
        tx,
        rx,
        received: Deque::new(),
        to_send: Deque::new(),
    };
    free(|token| LINE.borrow(token).replace(Some(line)));
    // SAFETY: nothing here relies on this interrupt being masked, and its line is there.
    #[allow(unsafe_code, reason = "cortex-m lets nothing else unmask an interrupt")]
    unsafe {
        NVIC::unmask(interrupt::USART2);
    }
}

fn with<T>(act: impl FnOnce(&mut Line) -> T) -> Option<T> {
    free(|token| LINE.borrow(token).borrow_mut().as_mut().map(act))
}

/// The next byte that has come.
pub fn received() -> Option<u8> {
    with(|line| line.received.pop_front()).flatten()
}

/// Nothing has come that was not read. To be asked where no interrupt is let through.
pub fn is_quiet() -> bool {
    with(|line| line.received.is_empty()).unwrap_or(true)
}

/// Sends a frame in the background. One that has no room any more is dropped whole: the host notices a tick
/// that is missing, and half a frame would cost it two.
pub fn send(frame: &[u8]) {
    let _ = with(|line| {
        if line.to_send.capacity() - line.to_send.len() >= frame.len() {
            for byte in frame {
                let _ = line.to_send.push_back(*byte);
            }
            line.tx.listen();
        }
    });
}

#[interrupt]
fn USART2() {
    let _ = with(|line| {
        // Errors of the line clear themselves by being read; what was lost the frame's sum notices.
        while line.rx.is_rx_not_empty() {
            if let Ok(byte) = line.rx.read() {
                let _ = line.received.push_back(byte);
            }
        }
        while line.tx.is_tx_empty() {
            match line.to_send.pop_front() {
                Some(byte) => {
                    let _ = line.tx.write(byte);
                }
                None => {
                    line.tx.unlisten();
                    break;
                }
            }
        }
    });
}
