//! `loopsight improve`.

use loopsight_diagnosis::{Improvement, Measurements, Work, improve};
use loopsight_model::config::{Source, Step};
use loopsight_model::model::{Attached, Model, ModelParameter};
use loopsight_report::{improvement_page, save};

use crate::cli::arguments::ImproveOptions;
use crate::cli::commands::diagnose::{context, pictures, sentence};
use crate::cli::failure::Failure;
use crate::cli::load::{join, model_and_log, save_text, test_runs, writable};
use crate::cli::{output, progress};

pub(crate) fn run(options: &ImproveOptions) -> Result<(), Failure> {
    options.output.as_deref().map_or(Ok(()), writable)?;
    options.html.as_deref().map_or(Ok(()), writable)?;
    let mut loaded = model_and_log(&options.files)?;
    join(&mut loaded, &options.also)?;
    let test = test_runs(&mut loaded, options.test.as_deref())?;
    let bar = progress::bar("round 1", 1);
    let improvement = improve(
        &loaded.model,
        &Measurements::new(&loaded.runs)
            .tested_on(test.as_deref())
            .with_faults(&loaded.faults),
        &Work::reporting(&progress::shown(&bar)),
    );
    bar.finish_and_clear();
    let improvement = improvement?;
    output::people(&text(&improvement), options.json);
    if options.json {
        output::json(&improvement)?;
    }
    if let (Some(path), Some(best)) = (&options.output, &improvement.best) {
        save_text(path, &best_text(&loaded.source, &loaded.model, &best.model))?;
    }
    if let Some(path) = &options.html {
        let shown = test.as_deref().unwrap_or(&loaded.runs);
        let first = improvement.diagnoses.first();
        let before = pictures(first.and_then(|d| d.model.as_ref()), shown);
        let after = pictures(improvement.best.as_ref().map(|b| &b.model), shown);
        let context = context(&loaded, options.test.as_deref(), "what was missing");
        let page = improvement_page(&context, &improvement, before.as_ref(), after.as_ref());
        save(path, &page)?;
        output::note(&format!("wrote {}", path.display()));
    }
    Ok(())
}

/// The model file with the effects of `best` and all fitted values; what it has not is taken out.
fn best_text(source: &Source, before: &Model, best: &Model) -> String {
    let is = |a: &Attached, b: &Attached| {
        a.meta.id == b.meta.id && a.at.iter().map(|c| c.id).eq(b.at.iter().map(|c| c.id))
    };
    let mut text = source.text.clone();
    let mut edit = |change: &dyn Fn(&Source) -> String| {
        if let Ok(present) = Source::parse(&source.file, &text) {
            text = change(&present);
        }
    };
    for (index, effect) in before.effects.iter().enumerate().rev() {
        if !best.effects.iter().any(|e| is(e, effect)) {
            edit(&|present| present.without_effect(index));
        }
    }
    for effect in &best.effects {
        if before.effects.iter().any(|e| is(e, effect)) {
            continue;
        }
        let at: Vec<&str> = effect.at.iter().map(|c| c.id).collect();
        let own = best.parameters.iter().skip(effect.first_parameter);
        let parameters: Vec<(&str, f64)> = own
            .zip(effect.meta.parameters)
            .filter_map(|(parameter, declaration)| Some((declaration.id, parameter.value?)))
            .collect();
        edit(&|present| present.with_effect(effect.meta.id, &at, &parameters));
    }
    // Where they stand now.
    let Ok((model, present)) = Model::from_toml(&source.file, &text) else {
        return text;
    };
    let mut pairs: Vec<(&ModelParameter, &ModelParameter)> = Vec::new();
    let n = |m: &Model| {
        m.effects
            .first()
            .map_or(m.parameters.len(), |e| e.first_parameter)
    };
    let plant = model.parameters.iter().take(n(&model));
    pairs.extend(plant.zip(best.parameters.iter().take(n(best))));
    for effect in &model.effects {
        if let Some(found) = best.effects.iter().find(|e| is(e, effect)) {
            let to = model.parameters.iter().skip(effect.first_parameter);
            let from = best.parameters.iter().skip(found.first_parameter);
            pairs.extend(to.zip(from).take(effect.meta.parameters.len()));
        }
    }
    let values: Vec<(Vec<Step>, f64)> = pairs
        .into_iter()
        .filter(|(_, from)| from.free)
        .filter_map(|(to, from)| Some((to.path.clone(), from.value?)))
        .collect();
    present.with_values(&values)
}

fn text(improvement: &Improvement) -> String {
    let rows: Vec<Vec<String>> = improvement
        .steps
        .iter()
        .map(|step| {
            vec![
                step.added.as_ref().map_or_else(
                    || "the model as it is".to_owned(),
                    |p| format!("+ {}", output::place(p)),
                ),
                output::percent(step.nrmse_fit),
                output::percent(step.nrmse_test),
            ]
        })
        .collect();
    let mut text = String::new();
    if !rows.is_empty() {
        text.push_str(&output::table(
            &["step", "error, fitted", "error, unseen"],
            &rows,
        ));
        text.push('\n');
    }
    for step in &improvement.steps {
        let others: Vec<String> = improvement
            .not_told_from(step)
            .iter()
            .map(|p| output::place(p))
            .collect();
        if let (Some(added), [_, ..]) = (&step.added, &others[..]) {
            text.push_str(&format!(
                "not told from {} when it was added: {}\n",
                output::place(added),
                others.join(", ")
            ));
        }
    }
    if let Some(last) = improvement.diagnoses.last() {
        text.push_str(&sentence(last));
        if last.observer.is_some() {
            text.push('\n');
            text.push_str(output::held(last.observer.as_ref()).trim_end());
        }
        if let Some(force) = &last.residual_force {
            text.push_str(&output::residual_force(force));
        }
    }
    if let Some(best) = &improvement.best {
        text.push_str("\n\n");
        text.push_str(&output::fit(best));
    }
    text
}
