//! The Twil's firmware: a robot that is told by its host what it is, and then drives, learns, and stops by
//! itself when it must.
//!
//! All that decides anything is in `loopsight-onboard`, which runs on a desk, too. Here is a board: bytes from a
//! serial line, a timer of 100 Hz, and what they cost. With the feature `body` there are motors and encoders, too:
//! those of a robot that the board simulates.

#![no_std]
#![no_main]

#[cfg(feature = "body")]
mod body;
mod mps2;

use core::panic::PanicInfo;

use cortex_m_rt::entry;
use loopsight_link::{LONGEST, Note, Reply, encode};
use loopsight_onboard::{Session, Twil};

/// Period of the loop, µs.
const PERIOD_US: u32 = 10_000;

#[entry]
fn main() -> ! {
    let Some((mut line, meter)) = mps2::start(PERIOD_US) else {
        // Peripherals are taken once; there is no second time.
        halt()
    };
    // Cleared once: each message writes over what it needs.
    let mut buffer = [0; LONGEST];
    let mut say = |reply: &Reply| {
        // Every message fits (a test of `loopsight-link`); one that did not would be noticed as lost.
        if let Ok(length) = encode(reply, &mut buffer) {
            line.write(&buffer[..length]);
        }
    };
    #[cfg(feature = "body")]
    let mut body = body::Body::default();
    #[cfg(feature = "body")]
    let mut robot = Session::<Twil, _>::with_sensors(PERIOD_US, meter);
    #[cfg(not(feature = "body"))]
    let mut robot = Session::<Twil, _>::new(PERIOD_US, meter);
    say(&Reply::Log(Note::Started));
    loop {
        while let Some(byte) = mps2::received() {
            robot.take(byte, &mut say);
        }
        if mps2::period_is_over() {
            #[cfg(feature = "body")]
            {
                robot.sensed(Some(body.sensors()), &mut say);
                body.drive(robot.output());
            }
            #[cfg(not(feature = "body"))]
            robot.elapsed(&mut say);
        }
        mps2::sleep();
    }
}

fn halt() -> ! {
    loop {
        cortex_m::asm::wfi();
    }
}

/// Motors hang on commands that come every period: without them they are let go.
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    halt()
}
