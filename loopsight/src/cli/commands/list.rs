//! `loopsight list`.

use loopsight_model::registry;
use serde::Serialize;

use crate::cli::arguments::{ListOptions, RoleName};
use crate::cli::failure::Failure;
use crate::cli::output;

#[derive(Serialize)]
struct Entry {
    role: &'static str,
    id: &'static str,
    summary: &'static str,
}

pub(crate) fn run(options: &ListOptions) -> Result<(), Failure> {
    let entries: Vec<Entry> = all()
        .into_iter()
        .filter(|e| wanted(options.role, e.role))
        .collect();
    if options.json {
        return output::json(&entries);
    }
    let mut text = Vec::new();
    let mut role = "";
    let width = entries.iter().map(|e| e.id.len()).max().unwrap_or(0);
    for entry in &entries {
        if entry.role != role {
            if !role.is_empty() {
                text.push(String::new());
            }
            role = entry.role;
            text.push(format!("{role}s"));
        }
        text.push(format!("  {:width$}  {}", entry.id, entry.summary));
    }
    text.push("\n`loopsight explain ID` tells more.".to_owned());
    output::result(&text.join("\n"));
    Ok(())
}

fn all() -> Vec<Entry> {
    let mut entries: Vec<Entry> = registry::plants()
        .iter()
        .map(|m| Entry {
            role: "plant",
            id: m.id,
            summary: m.summary,
        })
        .collect();
    entries.extend(registry::effects().iter().map(|m| Entry {
        role: "effect",
        id: m.id,
        summary: m.summary,
    }));
    let more = registry::written().into_iter().chain(registry::parts());
    entries.extend(more.map(|m| Entry {
        role: m.role,
        id: m.id,
        summary: m.summary,
    }));
    // Those that a model file defines stand behind the library's own.
    let roles = ["plant", "effect"];
    entries.sort_by_key(|e| {
        roles
            .iter()
            .position(|r| *r == e.role)
            .unwrap_or(roles.len())
    });
    entries
}

fn wanted(filter: Option<RoleName>, role: &str) -> bool {
    match filter {
        None => true,
        Some(RoleName::Plants) => role == "plant",
        Some(RoleName::Effects) => role == "effect",
        Some(RoleName::Estimators) => role == "estimator",
        Some(RoleName::Controllers) => role == "controller",
        Some(RoleName::Drivers) => role == "driver",
    }
}
