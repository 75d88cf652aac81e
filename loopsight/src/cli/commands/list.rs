//! `loopsight list`.

use crate::answers::{Answer as _, ListAnswer};
use crate::cli::arguments::{ListArguments, RoleName};
use crate::cli::output;
use crate::error::{Error, Result};
use crate::{ListOptions, PartRole, effects_for, list};

pub(crate) fn run(arguments: &ListArguments) -> Result<()> {
    let role = arguments.role.map(|role| match role {
        RoleName::Plants => PartRole::Plant,
        RoleName::Effects => PartRole::Effect,
        RoleName::Estimators => PartRole::Estimator,
        RoleName::Controllers => PartRole::Controller,
        RoleName::Drivers => PartRole::Driver,
    });
    let answer = match &arguments.plant {
        None => list(&ListOptions { role }),
        Some(plant) if matches!(role, None | Some(PartRole::Effect)) => effects_for(plant)?,
        Some(plant) => {
            return Err(Error::request(format!(
                "`--for {plant}` lists the effects that fit a plant: `loopsight list effects --for {plant}`"
            )));
        }
    };
    output::result(&if arguments.json {
        answer.to_json()?
    } else {
        text(&answer)
    });
    Ok(())
}

fn text(answer: &ListAnswer) -> String {
    let mut text = Vec::new();
    let mut role = "";
    let width = answer.parts.iter().map(|p| p.id.len()).max().unwrap_or(0);
    for part in &answer.parts {
        if part.role != role {
            if !role.is_empty() {
                text.push(String::new());
            }
            role = part.role;
            text.push(format!("{role}s"));
        }
        text.push(format!("  {:width$}  {}", part.id, part.summary));
        if !part.at.is_empty() {
            text.push(format!("  {:width$}    at {}", "", part.at.join(", ")));
        }
    }
    text.push("\n`loopsight explain ID` tells more.".to_owned());
    text.join("\n")
}
