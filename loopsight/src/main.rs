//! The command `loopsight`.

use std::process::ExitCode;

fn main() -> ExitCode {
    loopsight::cli::run()
}
