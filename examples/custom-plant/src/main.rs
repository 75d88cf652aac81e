//! The command `loopsight` with a ship in it, and other parts that only this crate has.

mod norrbin_damping;
mod random_walk;
mod ship_heading;
mod tcp_lines;
mod three_position;

use std::process::ExitCode;

fn main() -> ExitCode {
    loopsight::cli::run()
}
