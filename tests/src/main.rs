//! The command `loopsight`, as the tests of this crate run it.

use std::process::ExitCode;

fn main() -> ExitCode {
    loopsight::cli::run()
}
