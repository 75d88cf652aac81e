//! The command `loopsight` with a ship in it.

mod norrbin_damping;
mod ship_heading;

use std::process::ExitCode;

fn main() -> ExitCode {
    loopsight_cli::run()
}
