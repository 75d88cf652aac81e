//! The first time that a robot moves: steps that check whether it is wired as the files say.

mod bench;
mod judge;
mod person;
mod walk;

pub(crate) use person::{Person, Reply};

use loopsight_model::config::TomlSource;
use loopsight_model::loop_file::LoopFile;

use crate::error::{Error, Result};
use crate::files::Reads;
use crate::run::Loop;
use crate::watch::CancelToken;
use crate::words::number;
use bench::Bench;
use walk::Walk;

/// Share of the limit that is tried first.
const FIRST: f64 = 0.25;

/// How a robot is brought up.
#[derive(Clone, Debug)]
pub(crate) struct BringupOptions {
    /// Input of the first motions, in the unit of the inputs; by default a quarter of the smallest limit.
    pub(crate) volts: Option<f64>,
    /// How long a motor is driven at a time, s.
    pub(crate) seconds: f64,
    /// Ends it at once, the robot at rest.
    pub(crate) cancel: CancelToken,
}

/// Brings the robot of `control` up, with `person` in front of it.
pub(crate) fn bring_up(
    control: &Loop,
    options: &BringupOptions,
    person: &mut dyn Person,
) -> Result<()> {
    let (file, source) = (&control.parsed, control.source()?);
    if file.driver.runs_law() {
        let id = file.driver.meta().id;
        return Err(Error::request(format!(
            "the robot behind `{id}` runs its loop itself, and its motors cannot be driven one by one from here: \
             bring-up needs a driver that takes inputs, like `linux_gpio`"
        )));
    }
    let model = control.model()?.composed;
    let composed = control.compose(&model, &Reads::default())?;
    let ids: Vec<&str> = model.plant.inputs.iter().map(|s| s.id).collect();
    let limits = ids.iter().map(|id| limit_of(&source, file, id));
    let limits: Vec<f64> = limits.collect::<Result<_>>()?;
    let least = limits.iter().copied().fold(f64::INFINITY, f64::min);
    let volts = options.volts.unwrap_or(FIRST * least);
    for (name, value, most) in [
        ("--volts", volts, least),
        ("--seconds", options.seconds, 60.0),
    ] {
        if !(value > 0.0 && value <= most) {
            return Err(Error::request(format!(
                "{name} is {}, expected a number above 0 and up to {}",
                number(value),
                number(most)
            )));
        }
    }
    for question in [
        "Do all wheels turn freely, off the ground, with nothing and nobody in their way? [yes/no]",
        "Can you cut the power of the motors at once? [yes/no]",
    ] {
        if person::answer(person, &options.cancel, question)? != "yes" {
            return Err(Error::work(
                "nothing was moved: begin again when the answer to both is yes",
            ));
        }
    }
    let host = composed.host;
    let bench = Bench::new(
        &model,
        host.driver,
        host.clock,
        host.input_limits,
        file.period_s,
        options.cancel.clone(),
    );
    let mut walk = Walk {
        model: &model,
        ids,
        limits,
        volts,
        seconds: options.seconds,
        bench,
        person,
        cancel: options.cancel.clone(),
    };
    walk.at_rest()?;
    walk.signs()?;
    walk.limits()?;
    walk.scale_and_stop()
}

/// The largest magnitude of an input; one without it is refused.
fn limit_of(source: &TomlSource, file: &LoopFile, id: &str) -> Result<f64> {
    let limit = file.limits.get(id).and_then(|l| l.magnitude);
    limit.filter(|l| l.is_finite()).ok_or_else(|| {
        let message = format!(
            "`{id}` has no limit: a robot whose wires nobody has checked is not driven without one"
        );
        let help = format!("add `{id} = {{ magnitude = 6.0 }}` to [limits]");
        let path = if file.limits.is_empty() {
            vec![]
        } else {
            vec!["limits".into()]
        };
        source.error(&path, &message, Some(help)).into()
    })
}
