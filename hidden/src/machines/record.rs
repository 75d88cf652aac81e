//! Making a recording of a machine with one command.

use loopsight_model::run::Run;

use super::Sheet;
use crate::error::HiddenError;
use crate::hide::check;
use crate::random::Random;
use crate::recording::Recording;
use crate::truth::{Concealed, Truth};
use crate::{Hidden, Robot};

/// A recording of the machine of `sheet` along the first of each row of commands.
pub(crate) fn along_rig(
    sheet: &'static Sheet,
    robot: Robot,
    effects: &[(Hidden, f64)],
    commands: &[[f64; 2]],
    seed: u64,
    winding_time_constant: f64,
) -> Result<Recording, HiddenError> {
    let mut random = Random::new(seed, 1);
    let phase = [random.uniform(), random.uniform()];
    let mut rig = (sheet.build)(phase, winding_time_constant);
    let lumped = rig.lumped();
    let model_toml = rig.model_toml();
    let hidden = effects
        .iter()
        .map(|(effect, size)| {
            check(*effect, *size)?;
            rig.hide(Concealed::new(*effect, *size, &[]))
                .ok_or(HiddenError::NotHere {
                    effect: *effect,
                    robot: sheet.name,
                })
        })
        .collect::<Result<Vec<Concealed>, HiddenError>>()?;
    let mut run = Run {
        time: (0..commands.len()).map(|k| k as f64 / sheet.rate).collect(),
        n_inputs: sheet.inputs,
        n_measured: sheet.signals(),
        ..Run::default()
    };
    let mut exact = Vec::with_capacity(commands.len() * run.n_measured);
    for [command, _] in commands {
        let row = rig.sample(*command);
        run.inputs.extend(&row.inputs[..sheet.inputs]);
        run.measured.extend(&row.measured[..run.n_measured]);
        exact.extend(&row.exact[..run.n_measured]);
        rig.advance();
    }
    Ok(Recording {
        exact: Run {
            measured: exact,
            ..run.clone()
        },
        run,
        truth: Truth {
            robot,
            hidden,
            lumped,
            winding_time_constant: rig.winding_time_constant(),
        },
        model_toml,
        commands: commands.to_vec(),
    })
}
