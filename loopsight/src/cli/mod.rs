//! The command line: a crate with plants of its own gets the whole
//! command with
//!
//! ```no_run
//! // use my_plants as _;
//! fn main() -> std::process::ExitCode {
//!     loopsight::cli::run()
//! }
//! ```
//!
//! Exit status: 0 done, 1 the work failed or was interrupted, 2 the request or a file is wrong.

mod arguments;
mod commands;
mod failure;
mod files;
mod interrupt;
mod output;
mod progress;

use std::process::ExitCode;

use clap::Parser as _;

use arguments::{Arguments, Command};

use crate::error::Result;

/// Runs the command with the arguments of the process.
pub fn run() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            let wrong = error.use_stderr();
            // Help goes to standard output and is no error; a closed pipe is not ours to report.
            let _ = error.print();
            return if wrong {
                ExitCode::from(2)
            } else {
                ExitCode::SUCCESS
            };
        }
    };
    match execute(&arguments) {
        Ok(()) if interrupt::cut_work() => {
            output::note("interrupted: this is what was found until then");
            ExitCode::FAILURE
        }
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            failure::print(&error);
            ExitCode::from(error.exit_status())
        }
    }
}

fn execute(arguments: &Arguments) -> Result<()> {
    crate::model::check_registry()?;
    match &arguments.command {
        Command::New(options) => commands::new::run(options),
        Command::Check(options) => commands::check::run(options),
        Command::Inspect(options) => commands::inspect::run(options),
        Command::Convert(options) => commands::convert::run(options),
        Command::List(options) => commands::list::run(options),
        Command::Explain(options) => commands::explain::run(options),
        Command::Simulate(options) => commands::simulate::run(options),
        Command::Compare(options) => commands::compare::run(options),
        Command::Fit(options) => commands::fit::run(options),
        Command::Diagnose(options) => commands::diagnose::run(options),
        Command::Experiment(options) => commands::experiment::run(options),
        Command::Add(options) => commands::add::run(options),
        Command::Improve(options) => commands::improve::run(options),
        Command::Bringup(options) => commands::bringup::run(options),
        Command::Run(options) => commands::run::run(options),
        Command::Send(options) => commands::send::run(options),
        Command::Completions { shell } => {
            commands::completions::run(*shell);
            Ok(())
        }
    }
}
