//! `loopsight bringup`.

use super::person::Terminal;
use crate::bringup::{BringupOptions, bring_up};
use crate::cli::arguments::BringupArguments;
use crate::cli::{interrupt, output};
use crate::error::Result;
use crate::run::Loop;

pub(crate) fn run(arguments: &BringupArguments) -> Result<()> {
    let control = Loop::from_file(&arguments.file)?;
    let options = BringupOptions {
        volts: arguments.volts,
        seconds: arguments.seconds,
        cancel: interrupt::token(),
    };
    bring_up(&control, &options, &mut Terminal::new())?;
    output::result(
        "\nThe robot is as the files say. Now `loopsight run`, on the ground, at low speed.",
    );
    Ok(())
}
