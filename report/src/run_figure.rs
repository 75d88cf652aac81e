//! The static picture of a loop at work, for texts.

use crate::figure::{Figure, FigurePanel, FigureTrace, Style};
use crate::record::LoopRecord;
use crate::thin::kept;

/// Points of a line: a picture in a text is not zoomed into.
const MOST_POINTS: usize = 1000;

/// Lines of learned parameters in one panel; more could not be told apart.
const MOST_LEARNED: usize = 4;

/// A picture of a loop: each controlled signal with its reference, the inputs, and by how much the
/// best known parameters have moved away from where they started.
pub fn run_figure(title: &str, record: &LoopRecord) -> Figure {
    let line = |name: &str, style: Style, values: &[f64], step: bool| {
        let values = &values[..values.len().min(record.time.len())];
        let drawn = kept(values, MOST_POINTS);
        FigureTrace {
            name: name.to_owned(),
            style,
            time: drawn.iter().map(|k| record.time[*k]).collect(),
            values: drawn.iter().map(|k| values[*k]).collect(),
            step,
        }
    };
    let mut panels: Vec<FigurePanel> = record
        .controlled
        .iter()
        .map(|c| FigurePanel {
            label: c.id.clone(),
            unit: c.unit.clone(),
            traces: vec![
                line("measured", Style::Measured, &c.measured, false),
                line("reference", Style::Reference, &c.reference, true),
            ],
        })
        .collect();
    for input in &record.inputs {
        let applied = if input.applied.is_empty() {
            &input.commanded
        } else {
            &input.applied
        };
        panels.push(FigurePanel {
            label: input.id.clone(),
            unit: input.unit.clone(),
            traces: vec![line("applied", Style::Other, applied, true)],
        });
    }
    // Parameters that are known best, relative to their size, say most about a change.
    let mut known: Vec<(f64, usize)> = record
        .parameters
        .iter()
        .enumerate()
        .filter_map(|(i, p)| {
            let (value, std) = (p.values.last()?, p.std.as_ref()?.last()?);
            let relative = std / value.abs();
            (relative.is_finite() && relative < 0.5).then_some((relative, i))
        })
        .collect();
    known.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (_, i) in known.into_iter().take(MOST_LEARNED) {
        let p = &record.parameters[i];
        let shown: Vec<f64> = p
            .std
            .iter()
            .flatten()
            .zip(&p.values)
            // A guess that is as uncertain as it is large would hide what is learned later.
            .map(|(std, value)| if *std < value.abs() { *value } else { f64::NAN })
            .collect();
        panels.push(FigurePanel {
            label: p.name.clone(),
            unit: p.unit.clone(),
            traces: vec![line("learned", Style::Model, &shown, false)],
        });
    }
    Figure {
        title: title.to_owned(),
        panels,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure_svg;
    use crate::fixtures::loop_record;

    #[test]
    fn a_picture_has_a_panel_for_each_signal_and_for_what_is_known() {
        let mut record = loop_record(1000);
        for p in &mut record.parameters {
            p.std = Some(p.values.iter().map(|v| 0.01 * v.abs()).collect());
        }
        let figure = run_figure("Twil", &record);
        let n = record.controlled.len() + record.inputs.len() + record.parameters.len();
        assert_eq!(figure.panels.len(), n);
        let svg = figure_svg(&figure);
        for text in ["Twil", "linear_velocity", "reference", "K_A", "applied"] {
            assert!(svg.contains(text), "{text}");
        }
        record.parameters[0].std = None;
        assert_eq!(run_figure("Twil", &record).panels.len(), n - 1);
    }

    #[test]
    fn an_empty_record_is_a_picture() {
        assert!(figure_svg(&run_figure("", &LoopRecord::default())).contains("<svg"));
    }
}
