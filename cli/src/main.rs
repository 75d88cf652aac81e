//! The command `loopsight`.

use std::process::ExitCode;

fn main() -> ExitCode {
    loopsight_cli::run()
}
