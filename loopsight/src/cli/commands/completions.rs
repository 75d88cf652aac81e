//! `loopsight completions`.

use clap::CommandFactory as _;

use crate::cli::arguments::Arguments;

pub(crate) fn run(shell: clap_complete::Shell) {
    let mut command = Arguments::command();
    clap_complete::generate(shell, &mut command, "loopsight", &mut std::io::stdout());
}
