//! The picture of a symptom: a stretch of measurements beside a model that lacks an effect, and what its error
//! depends on.

use plotters::prelude::*;

use crate::figure::{Area, Drawn, FigurePanel, INK, TEXT, draw_panel, font, span, ticks};
use crate::numbers::axis;

const WIDTH: u32 = 2000;
const HEIGHT: u32 = 560;
const TITLE: u32 = 60;
/// What is drawn forwards, and backwards: as in all pictures, they differ for the colour-blind too.
const COLORS: [RGBColor; 2] = [RGBColor(0x00, 0x72, 0xb2), RGBColor(0xd5, 0x5e, 0x00)];

/// A mean over a quantity, with its standard error.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeanOver {
    /// What the horizontal axis shows.
    pub quantity: String,
    /// Its unit.
    pub quantity_unit: String,
    /// What the vertical axis shows.
    pub label: String,
    /// Its unit.
    pub unit: String,
    /// At most two curves, each with its name, which may be empty.
    pub curves: Vec<(String, Vec<MeanAt>)>,
}

/// A point of a [`MeanOver`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanAt {
    /// The quantity.
    pub at: f64,
    /// The mean there.
    pub mean: f64,
    /// Standard error of the mean.
    pub std_error: f64,
}

/// The text of an SVG file: `stretch` over time at the left, `over` at the right.
pub fn symptom_svg(title: &str, stretch: &FigurePanel, over: &MeanOver) -> String {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (WIDTH, TITLE + HEIGHT)).into_drawing_area();
        // Drawing into a string cannot fail; were it to, the picture so far is the picture.
        let _ = draw(title, stretch, over, &root);
        let _ = root.present();
    }
    svg
}

fn draw<'a>(title: &str, stretch: &FigurePanel, over: &MeanOver, root: &Area<'a>) -> Drawn<'a> {
    root.fill(&WHITE)?;
    root.draw(&Text::new(title.to_owned(), (30, 20), font(TEXT + 6)))?;
    let (_, below) = root.split_vertically(TITLE);
    let (left, right) = below.split_horizontally(WIDTH * 3 / 5);
    let time = span(stretch.traces.iter().flat_map(|t| &t.time), 0.0);
    draw_panel(stretch, &left, time, true)?;
    draw_over(over, &right)
}

fn draw_over<'a>(over: &MeanOver, area: &Area<'a>) -> Drawn<'a> {
    let points = || over.curves.iter().flat_map(|(_, points)| points);
    let x: Vec<f64> = points().map(|p| p.at).collect();
    let y: Vec<f64> = points()
        .flat_map(|p| [p.mean - p.std_error, p.mean + p.std_error])
        .collect();
    let (x, y) = (span(x.iter(), 0.05), span(y.iter(), 0.06));
    let (wide, high) = (x.end - x.start, y.end - y.start);
    let mut chart = ChartBuilder::on(area)
        .margin_right(40)
        .margin_top(56)
        .margin_bottom(10)
        .y_label_area_size(130)
        .x_label_area_size(76)
        .build_cartesian_2d(x, y)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(0xdd, 0xdd, 0xdd).stroke_width(2))
        .axis_style(INK.stroke_width(2))
        .label_style(font(TEXT - 4))
        .x_labels(7)
        .y_labels(6)
        .x_label_formatter(&|v| ticks(*v, wide))
        .y_label_formatter(&|v| ticks(*v, high))
        .x_desc(axis(&over.quantity, &over.quantity_unit))
        .axis_desc_style(font(TEXT))
        .draw()?;
    for ((_, points), color) in over.curves.iter().zip(COLORS) {
        let finite = || {
            points
                .iter()
                .filter(|p| p.at.is_finite() && p.mean.is_finite() && p.std_error.is_finite())
        };
        chart.draw_series(finite().map(|p| {
            let ends = vec![(p.at, p.mean - p.std_error), (p.at, p.mean + p.std_error)];
            PathElement::new(ends, color.stroke_width(4))
        }))?;
        chart.draw_series(finite().map(|p| Circle::new((p.at, p.mean), 8, color.filled())))?;
    }
    heading(over, area)
}

/// What the vertical axis shows, and the names of the curves.
fn heading<'a>(over: &MeanOver, area: &Area<'a>) -> Drawn<'a> {
    let label = axis(&over.label, &over.unit);
    area.draw(&Text::new(label.clone(), (40, 16), font(TEXT)))?;
    let letter = f64::from(TEXT) * 0.45;
    let mut x = 100 + (label.chars().count() as f64 * letter) as i32;
    for ((name, _), color) in over.curves.iter().zip(COLORS) {
        if !name.is_empty() {
            area.draw(&Circle::new((x, 30), 9, color.filled()))?;
            area.draw(&Text::new(name.clone(), (x + 20, 16), font(TEXT)))?;
            x += 70 + (name.chars().count() as f64 * letter) as i32;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::tests::velocities;

    fn over() -> MeanOver {
        let curve = |sign: f64| -> Vec<MeanAt> {
            (0..8)
                .map(|k| MeanAt {
                    at: f64::from(k),
                    mean: sign * f64::from(k).cos(),
                    std_error: 0.1,
                })
                .collect()
        };
        MeanOver {
            quantity: "speed".into(),
            quantity_unit: "rad/s".into(),
            label: "missing force".into(),
            unit: "V".into(),
            curves: vec![
                ("forwards".into(), curve(1.0)),
                ("backwards".into(), curve(-1.0)),
            ],
        }
    }

    #[test]
    fn both_halves_have_their_axes_and_every_point_is_drawn() {
        let panel = velocities(400).panels.remove(0);
        let svg = symptom_svg("dry friction", &panel, &over());
        for text in [
            "dry friction",
            "time, s",
            "speed, rad/s",
            "missing force, V",
            "backwards",
        ] {
            assert!(svg.contains(text), "{text}");
        }
        // A point is its circle; two more are in the legend.
        assert_eq!(svg.matches("<circle").count(), 16 + 2);
    }

    #[test]
    fn nothing_and_not_a_number_are_no_panic() {
        let empty = symptom_svg("", &FigurePanel::default(), &MeanOver::default());
        assert!(empty.trim_end().ends_with("</svg>"));
        let mut odd = over();
        odd.curves[0].1[0].mean = f64::NAN;
        let svg = symptom_svg("", &FigurePanel::default(), &odd);
        assert_eq!(svg.matches("<circle").count(), 15 + 2);
    }
}
