//! `loopsight improve`.

use loopsight_core::config::{Source, Step};
use loopsight_diagnosis::{Fit, Improvement, improve};
use loopsight_report::{improvement_page, save};

use crate::arguments::ImproveOptions;
use crate::commands::diagnose::{context, pictures, sentence};
use crate::failure::Failure;
use crate::load::{join, model_and_log, save_text, test_runs, writable};
use crate::{output, progress};

pub(crate) fn run(options: &ImproveOptions) -> Result<(), Failure> {
    options.output.as_deref().map_or(Ok(()), writable)?;
    options.html.as_deref().map_or(Ok(()), writable)?;
    let mut loaded = model_and_log(&options.files)?;
    join(&mut loaded, &options.also)?;
    let test = test_runs(&mut loaded, options.test.as_deref())?;
    let bar = progress::bar("round 1", 1);
    let improvement = improve(
        &loaded.model,
        &loaded.runs,
        test.as_deref(),
        &loaded.faults,
        &|round, done, total| {
            bar.set_prefix(format!("round {}", round + 1));
            bar.set_length(total);
            bar.set_position(done);
        },
    );
    bar.finish_and_clear();
    let improvement = improvement?;
    output::people(&text(&improvement), options.json);
    if options.json {
        output::json(&improvement)?;
    }
    if let (Some(path), Some(best)) = (&options.output, &improvement.best) {
        save_text(
            path,
            &best_text(&loaded.source, loaded.model.effects.len(), best),
        )?;
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

/// The model file with the added effects and all fitted values.
fn best_text(source: &Source, effects_before: usize, best: &Fit) -> String {
    let mut text = source.text.clone();
    for effect in &best.model.effects[effects_before..] {
        let at: Vec<&str> = effect.at.iter().map(|c| c.id).collect();
        let parameters: Vec<(&str, f64)> = effect
            .meta
            .parameters
            .iter()
            .enumerate()
            .filter_map(|(i, p)| {
                Some((
                    p.id,
                    best.model.parameters[effect.first_parameter + i].value?,
                ))
            })
            .collect();
        let Ok(present) = Source::parse(&source.file, &text) else {
            return text;
        };
        text = present.with_effect(effect.meta.id, &at, &parameters);
    }
    let values: Vec<(Vec<Step>, f64)> = best
        .model
        .parameters
        .iter()
        .filter(|p| p.free)
        .filter_map(|p| Some((p.path.clone(), p.value?)))
        .collect();
    match Source::parse(&source.file, &text) {
        Ok(present) => present.with_values(&values),
        Err(_) => text,
    }
}

fn text(improvement: &Improvement) -> String {
    let rows: Vec<Vec<String>> = improvement
        .steps
        .iter()
        .map(|step| {
            vec![
                step.added.as_ref().map_or_else(
                    || "the model as it is".to_owned(),
                    |p| format!("+ {} @ {}", p.effect, p.at.join("+")),
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
