//! `loopsight run`.

use std::sync::{Arc, Mutex};

use super::dashboard::Dashboard;
use crate::cli::arguments::RunArguments;
use crate::cli::{files, interrupt, output};
use crate::error::Result;
use crate::words::{figures, report};
use crate::{LogTo, Loop, RunOptions, Session};

pub(crate) fn run(arguments: &RunArguments) -> Result<()> {
    let control = Loop::from_file(&arguments.file)?;
    let session = Session::of_model(control.model()?);
    let inputs = [arguments.file.clone(), control.model_file()];
    let outputs = arguments.html.iter().chain(&arguments.svg);
    files::check(outputs.chain(&arguments.output), &[&inputs])?;
    let dashboard = Arc::new(Mutex::new(Dashboard::new()));
    let shown = Arc::clone(&dashboard);
    let log = arguments.output.clone();
    let options = RunOptions::default()
        .log(log.map_or(LogTo::AsWritten, LogTo::File))
        .pages(arguments.html.iter().chain(&arguments.svg))
        .series(arguments.series)
        .stopped_by("Ctrl-C")
        .cancel(&interrupt::token())
        .on_tick(move |view| {
            if let Ok(mut dashboard) = shown.lock() {
                dashboard.take(view);
            }
        });
    let answer = session.run(&control, &options);
    if let Ok(mut dashboard) = dashboard.lock() {
        let _ = dashboard.clear();
    }
    let answer = answer?;
    if let Some(written) = answer.log_written() {
        files::wrote(written);
    }
    output::answer(
        &answer,
        &report::run::text(&figures(&answer)),
        arguments.json,
    )?;
    if let Some(path) = &arguments.svg {
        files::save(path, &answer.svg())?;
    }
    if let Some(path) = &arguments.html {
        files::save(path, &answer.page(&output::command_line()))?;
    }
    answer.failure().map_or(Ok(()), Err)
}
