//! The ticks of a loop, from the first to the last.

use loopsight_core::TickError;
use loopsight_model::loop_file::Composed;
use loopsight_recordings::{LogWriter, RecordingError};

use super::recorder::Recorder;
use super::{Loop, RunOptions, RunView};
use crate::words::number;

/// How a run ended.
pub(super) struct End {
    pub(super) text: String,
    pub(super) failed: bool,
}

/// Runs the loop to its end; the driver has been stopped when this returns.
pub(super) fn drive(
    control: &Loop,
    composed: &mut Composed,
    recorder: &mut Recorder,
    mut log: Option<&mut LogWriter>,
    options: &RunOptions,
) -> End {
    let file = &control.parsed;
    let ticks = file.duration_s.map_or(u64::MAX, |d| {
        (d / file.period_s + 1e-9).floor().min(1e15) as u64
    });
    let mut end = End {
        text: format!(
            "the run lasted the {} s asked for",
            number(ticks as f64 * file.period_s)
        ),
        failed: false,
    };
    let judged = composed.judges_learning;
    for index in 0..ticks {
        let time = index as f64 * file.period_s;
        if options.watch.is_cancelled() {
            let who = options.stopped_by.as_deref().unwrap_or("its caller");
            end.text = format!("stopped by {who} at {time:.2} s");
            recorder.happened(time, end.text.clone());
            break;
        }
        let late = match composed.tick(time) {
            Ok(step) => {
                recorder.push(&step, judged);
                if let Some(look) = &options.on_tick {
                    look(&RunView::new(&step, recorder, file.duration_s));
                }
                step.late
            }
            Err(error) => {
                end = End {
                    failed: !error.is_end(),
                    text: match &error {
                        TickError::Driver(e) => e.to_string(),
                        TickError::Control(e) => {
                            let said = composed.host.controller.remark();
                            said.map_or_else(|| e.to_string(), str::to_owned)
                        }
                        TickError::Supervisor(event) => match composed.assumed {
                            None => recorder.words(event),
                            Some(why) => format!("{}; {why}", recorder.words(event)),
                        },
                    },
                };
                if end.failed {
                    recorder.happened(time, end.text.clone());
                }
                break;
            }
        };
        recorder.learn(composed, late);
        if let Some(remark) = composed.host.controller.remark() {
            recorder.happened(time, remark.to_owned());
        }
        if let Some(log) = log.as_mut()
            && let Err(error) = write(log, recorder)
        {
            end = End {
                text: format!("the log cannot be written: {error}"),
                failed: true,
            };
            break;
        }
    }
    if let Err(error) = composed.host.stop() {
        end = End {
            text: format!("the robot could not be stopped safely: {error}"),
            failed: true,
        };
    }
    // The reason why a run ended stands in its log, too.
    if let Some(log) = log {
        for (time, what) in recorder.news() {
            if let Err(error) = log.remark(time, &what) {
                let lacks = format!("the log lacks its last event: {error}");
                recorder.record.notes.push(lacks);
            }
        }
    }
    end
}

/// Writes the present tick, and what happened at it.
fn write(log: &mut LogWriter, recorder: &mut Recorder) -> Result<(), RecordingError> {
    log.write(recorder.row())?;
    for (time, what) in recorder.news() {
        log.remark(time, &what)?;
    }
    Ok(())
}
