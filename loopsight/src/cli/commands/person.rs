//! The person at the terminal.

use std::io::BufRead as _;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use crate::bringup::{Person, Reply};
use crate::cli::output;

/// Answers, line by line, from standard input.
pub(super) struct Terminal {
    answers: Receiver<String>,
}

impl Terminal {
    pub(super) fn new() -> Self {
        let (say, hear) = channel();
        // It ends with the process, or when the receiver is gone.
        std::thread::spawn(move || {
            for line in std::io::stdin().lock().lines() {
                let Ok(line) = line else { return };
                if say.send(line.trim().to_lowercase()).is_err() {
                    return;
                }
            }
        });
        Self { answers: hear }
    }
}

impl Person for Terminal {
    fn ask(&mut self, question: &str) {
        output::note(question);
    }

    fn reply(&mut self, wait: Duration) -> Reply {
        match self.answers.recv_timeout(wait) {
            Ok(answer) => Reply::Said(answer),
            Err(RecvTimeoutError::Timeout) => Reply::NotYet,
            Err(RecvTimeoutError::Disconnected) => Reply::Gone,
        }
    }

    fn tell(&mut self, result: &str) {
        output::result(result);
    }
}
