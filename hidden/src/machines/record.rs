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
    let mut run = Run::empty(sheet.inputs, sheet.signals());
    let mut exact = Vec::with_capacity(commands.len() * sheet.signals());
    for (k, [command, _]) in commands.iter().enumerate() {
        let row = rig.sample(*command);
        run.push(
            k as f64 / sheet.rate,
            &row.inputs[..sheet.inputs],
            &row.measured[..sheet.signals()],
        )?;
        exact.extend(&row.exact[..sheet.signals()]);
        rig.advance();
    }
    Ok(Recording {
        exact: run.clone().with_measured(exact)?,
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
