//! The firmware on an emulated board, at the other end of a socket.

#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "shared by tests, each of which uses some of it"
)]

use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use loopsight_link::{Decoder, LONGEST, Note, Reply, Request, encode};

/// `-icount shift=6`: one instruction takes 64 ns of the board's time, a count of its timer 40 ns.
const SHIFT: u32 = 6;
/// What a count of the board's timer is worth.
pub(crate) const INSTRUCTIONS_PER_COUNT: f64 = 40.0 / (1u32 << SHIFT) as f64;

/// Where the board's memory begins, and how much there is (`memory.x`).
const RAM: (u32, usize) = (0x2000_0000, 4 << 20);

pub(crate) struct Board {
    machine: Child,
    line: UnixStream,
    /// Socket of the machine's monitor.
    monitor: PathBuf,
    decoder: Decoder,
    /// What has come and was not looked at.
    rest: Vec<u8>,
}

/// The firmware that this variable names.
pub(crate) fn firmware(variable: &str) -> PathBuf {
    std::env::var_os(variable)
        .unwrap_or_else(|| panic!("{variable} names the firmware, built as its README says"))
        .into()
}

/// An emulated board with this program, its line at `serial`.
pub(crate) fn machine(program: &Path, serial: &str) -> Command {
    let mut machine = Command::new("qemu-system-arm");
    machine
        .args(["-machine", "mps2-an386", "-cpu", "cortex-m4"])
        .args(["-display", "none"])
        .args(["-icount", &format!("shift={SHIFT}")])
        .args(["-serial", serial])
        .arg("-kernel")
        .arg(program)
        .stdin(Stdio::null());
    machine
}

impl Board {
    /// Switches a board on and waits for what it says first.
    pub(crate) fn start() -> Self {
        Self::with("LOOPSIGHT_FIRMWARE")
    }

    /// The same with the firmware that this variable names.
    pub(crate) fn with(variable: &str) -> Self {
        static BOARDS: AtomicU32 = AtomicU32::new(0);
        let number = BOARDS.fetch_add(1, Ordering::Relaxed);
        let name = format!("loopsight-{}-{number}.line", std::process::id());
        let socket = std::env::temp_dir().join(name);
        let monitor = socket.with_extension("monitor");
        let line = format!("unix:{},server=on,wait=on", socket.display());
        let machine = machine(&firmware(variable), &line)
            .arg("-monitor")
            .arg(format!("unix:{},server=on,wait=off", monitor.display()))
            .spawn()
            .expect("qemu-system-arm starts");
        // It makes the socket, and waits for who opens it.
        let open = || UnixStream::connect(&socket);
        let line = (0..200).find_map(|_| {
            std::thread::sleep(Duration::from_millis(50));
            open().ok()
        });
        let line = line.expect("the machine opens its line");
        line.set_read_timeout(Some(Duration::from_secs(30)))
            .unwrap();
        std::fs::remove_file(&socket).unwrap();
        let mut board = Self {
            machine,
            line,
            monitor,
            decoder: Decoder::default(),
            rest: Vec::new(),
        };
        assert_eq!(board.listen(), Reply::Log(Note::Started));
        board
    }

    /// The next message.
    pub(crate) fn listen(&mut self) -> Reply {
        loop {
            let mut bytes = std::mem::take(&mut self.rest).into_iter();
            while let Some(byte) = bytes.next() {
                if let Some(reply) = self.decoder.take(byte) {
                    self.rest = bytes.collect();
                    return reply.expect("a frame that is whole");
                }
            }
            let mut buffer = [0; 512];
            let length = self.line.read(&mut buffer).expect("the board answers");
            assert!(length > 0, "the board hung up");
            self.rest.extend_from_slice(&buffer[..length]);
        }
    }

    /// The next message that is no line for the log.
    pub(crate) fn hear(&mut self) -> Reply {
        loop {
            match self.listen() {
                Reply::Log(_) => {}
                reply => return reply,
            }
        }
    }

    /// Bytes between the top of the stack and the lowest one that was ever written. What is static lies at
    /// the bottom of a memory of which nearly all is never touched, and begins as zeros.
    pub(crate) fn stack(&mut self) -> usize {
        let image = self.monitor.with_extension("ram");
        let (from, size) = RAM;
        let mut monitor = UnixStream::connect(&self.monitor).unwrap();
        let ask = format!("pmemsave {from:#x} {size:#x} \"{}\"\n", image.display());
        monitor.write_all(ask.as_bytes()).unwrap();
        let ram = (0..200).find_map(|_| {
            std::thread::sleep(Duration::from_millis(50));
            std::fs::read(&image).ok().filter(|ram| ram.len() == size)
        });
        let ram = ram.expect("the machine saves its memory");
        std::fs::remove_file(&image).unwrap();
        // Static data ends far below the middle, and no stack comes near it.
        let middle = size / 2;
        let lowest = ram[middle..].iter().position(|byte| *byte != 0).unwrap();
        assert!(lowest > 0, "the stack has reached the middle of the memory");
        size - middle - lowest
    }

    /// Writes bytes on the line.
    pub(crate) fn send(&mut self, bytes: &[u8]) {
        self.line.write_all(bytes).unwrap();
    }

    /// Says something; the answer.
    pub(crate) fn ask(&mut self, request: &Request) -> Reply {
        let mut buffer = [0; LONGEST];
        let length = encode(request, &mut buffer).unwrap();
        self.send(&buffer[..length]);
        self.hear()
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        // Nothing is left to be done about a machine that is gone already.
        let _ = self.machine.kill();
        let _ = self.machine.wait();
        let _ = std::fs::remove_file(&self.monitor);
    }
}
