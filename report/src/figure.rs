//! Static pictures for texts: panels above each other over one time axis, as SVG.

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::numbers::axis;
use crate::thin::kept;

/// Twice the size shown: the backend draws to whole pixels.
const WIDTH: u32 = 1600;
const PANEL_HEIGHT: u32 = 440;
pub(crate) const TEXT: i32 = 30;
/// Most points of a line: two for each pixel across.
const MOST_POINTS: usize = 2 * WIDTH as usize;
pub(crate) const INK: RGBColor = RGBColor(0x33, 0x33, 0x33);

/// A picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figure {
    /// A title; may be empty.
    pub title: String,
    /// From top to bottom; all show the same stretch of time.
    pub panels: Vec<FigurePanel>,
}

/// One panel of a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FigurePanel {
    /// What the vertical axis shows.
    pub label: String,
    /// Its unit.
    pub unit: String,
    /// The lines, drawn in this order.
    pub traces: Vec<FigureTrace>,
}

/// One line of a panel.
#[derive(Clone, Debug, PartialEq)]
pub struct FigureTrace {
    /// Entry of the legend.
    pub name: String,
    /// What it looks like.
    pub style: Style,
    /// Time, s.
    pub time: Vec<f64>,
    /// Values; NaN leaves a gap.
    pub values: Vec<f64>,
    /// Drawn as steps: each value stays until the next sample.
    pub step: bool,
}

/// What a line of a picture stands for. The colours differ for the colour-blind too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// A measurement: a broad grey line that still shows below others.
    Measured,
    /// A model, or an ideal response: orange.
    Model,
    /// A reference: green.
    Reference,
    /// Anything else: blue.
    Other,
}

impl Style {
    fn color(self) -> RGBColor {
        match self {
            Style::Measured => RGBColor(0xa4, 0xa4, 0xa4),
            Style::Model => RGBColor(0xd5, 0x5e, 0x00),
            Style::Reference => RGBColor(0x00, 0x8f, 0x6b),
            Style::Other => RGBColor(0x00, 0x72, 0xb2),
        }
    }

    fn width(self) -> u32 {
        if self == Style::Measured { 8 } else { 3 }
    }
}

/// `figure` as the text of an SVG file, on a white ground.
pub fn figure_svg(figure: &Figure) -> String {
    let mut svg = String::new();
    let title = if figure.title.is_empty() { 0 } else { 60 };
    let height = title + PANEL_HEIGHT * figure.panels.len().max(1) as u32;
    {
        let root = SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area();
        // Drawing into a string cannot fail; were it to, the picture so far is the picture.
        let _ = draw(figure, &root, title);
        let _ = root.present();
    }
    svg
}

pub(crate) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(crate) type Drawn<'a> =
    Result<(), DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>>;

pub(crate) fn font(size: i32) -> TextStyle<'static> {
    ("Helvetica, Arial, sans-serif", size)
        .into_font()
        .color(&INK)
}

fn draw<'a>(figure: &Figure, root: &Area<'a>, title: u32) -> Drawn<'a> {
    root.fill(&WHITE)?;
    if title > 0 {
        root.draw(&Text::new(figure.title.as_str(), (30, 20), font(TEXT + 6)))?;
    }
    let (_, below) = root.split_vertically(title);
    let span = span(
        figure
            .panels
            .iter()
            .flat_map(|p| &p.traces)
            .flat_map(|t| &t.time),
        0.0,
    );
    let areas = below.split_evenly((figure.panels.len().max(1), 1));
    for (at, (panel, area)) in figure.panels.iter().zip(&areas).enumerate() {
        draw_panel(panel, area, span.clone(), at + 1 == figure.panels.len())?;
    }
    Ok(())
}

pub(crate) fn draw_panel<'a>(
    panel: &FigurePanel,
    area: &Area<'a>,
    span_of_time: std::ops::Range<f64>,
    last: bool,
) -> Drawn<'a> {
    let values = span(panel.traces.iter().flat_map(|t| &t.values), 0.06);
    let mut chart = ChartBuilder::on(area)
        .margin_right(40)
        .margin_top(56)
        .margin_bottom(if last { 10 } else { 0 })
        .y_label_area_size(130)
        .x_label_area_size(if last { 76 } else { 44 })
        .build_cartesian_2d(span_of_time, values.clone())?;
    let high = values.end - values.start;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(0xdd, 0xdd, 0xdd).stroke_width(2))
        .axis_style(INK.stroke_width(2))
        .label_style(font(TEXT - 4))
        .x_labels(10)
        .y_labels(6)
        .x_label_formatter(&|t| format!("{}", (t * 1000.0).round() / 1000.0))
        .y_label_formatter(&|v| ticks(*v, high))
        .x_desc(if last { "time, s" } else { "" })
        .axis_desc_style(font(TEXT))
        .draw()?;
    for trace in &panel.traces {
        let style = trace.style.color().stroke_width(trace.style.width());
        for stretch in stretches(trace) {
            chart.draw_series(LineSeries::new(stretch, style))?;
        }
    }
    legend(panel, area)
}

/// A value at an axis of this range, with as many digits as tell its marks apart.
pub(crate) fn ticks(value: f64, range: f64) -> String {
    let digits = (1 - (range / 6.0).log10().floor() as i32).clamp(0, 6) as usize;
    let decimals = digits.saturating_sub(1);
    // A rounding error below zero is no −0.00.
    let zero = value.abs() < 0.5 * 10f64.powi(-(decimals as i32));
    format!("{:.decimals$}", if zero { 0.0 } else { value }).replace('-', "−")
}

/// What the axis shows at the left above the panel, the traces' names after it.
fn legend<'a>(panel: &FigurePanel, area: &Area<'a>) -> Drawn<'a> {
    let mut x = 40;
    let text = |text: &str, x: &mut i32| {
        let drawn = area.draw(&Text::new(text.to_owned(), (*x, 16), font(TEXT)));
        // Roughly the width of a letter: the backend knows no fonts.
        *x += (text.chars().count() as f64 * f64::from(TEXT) * 0.45) as i32;
        drawn
    };
    text(&axis(&panel.label, &panel.unit), &mut x)?;
    for trace in &panel.traces {
        x += 60;
        let style = trace.style.color().stroke_width(6);
        area.draw(&PathElement::new(vec![(x, 30), (x + 50, 30)], style))?;
        x += 62;
        text(&trace.name, &mut x)?;
    }
    Ok(())
}

/// The points of a trace, cut at gaps.
fn stretches(trace: &FigureTrace) -> Vec<Vec<(f64, f64)>> {
    let values = &trace.values[..trace.values.len().min(trace.time.len())];
    let mut out: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
    for k in kept(values, MOST_POINTS) {
        let (time, value) = (trace.time[k], values[k]);
        let open = out.len() - 1;
        if !(time.is_finite() && value.is_finite()) {
            out.push(Vec::new());
            continue;
        }
        if let Some(&(_, before)) = out[open].last().filter(|_| trace.step) {
            out[open].push((time, before));
        }
        out[open].push((time, value));
    }
    out.retain(|stretch| !stretch.is_empty());
    out
}

/// From the least to the greatest finite value, widened by `margin` of it; never empty.
pub(crate) fn span<'a>(values: impl Iterator<Item = &'a f64>, margin: f64) -> std::ops::Range<f64> {
    let (low, high) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(*v), high.max(*v))
        });
    if low > high {
        0.0..1.0
    } else if high - low <= 1e-12 * high.abs() {
        low - 0.5..high + 0.5
    } else {
        low - margin * (high - low)..high + margin * (high - low)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::fixtures::friction_runs;

    pub(crate) fn velocities(n: usize) -> Figure {
        let run = friction_runs(1, n).remove(0);
        let panels = run
            .signals
            .iter()
            .map(|s| {
                let trace = |name: &str, style, values: &[f64]| FigureTrace {
                    name: name.into(),
                    style,
                    time: run.time.clone(),
                    values: values.to_vec(),
                    step: false,
                };
                FigurePanel {
                    label: s.id.clone(),
                    unit: s.unit.clone(),
                    traces: vec![
                        trace("measured", Style::Measured, &s.measured),
                        trace("model", Style::Model, &s.free_run),
                    ],
                }
            })
            .collect();
        Figure {
            title: "Model against measurements".into(),
            panels,
        }
    }

    #[test]
    fn a_picture_has_axes_and_a_legend() {
        let svg = figure_svg(&velocities(800));
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
        for text in [
            "linear_velocity, m/s",
            "time, s",
            "measured",
            "model",
            "#D55E00",
        ] {
            assert!(svg.contains(text), "{text}");
        }
        assert_eq!(svg, figure_svg(&velocities(800)));
        assert!(figure_svg(&velocities(100_000)).len() < 300_000);
    }

    #[test]
    fn gaps_and_steps() {
        let trace = FigureTrace {
            name: "x".into(),
            style: Style::Other,
            time: vec![0.0, 1.0, 2.0, 3.0, 4.0],
            values: vec![1.0, 2.0, f64::NAN, 3.0],
            step: true,
        };
        assert_eq!(
            stretches(&trace),
            [vec![(0.0, 1.0), (1.0, 1.0), (1.0, 2.0)], vec![(3.0, 3.0)]]
        );
    }

    #[test]
    fn nothing_to_draw_is_no_panic() {
        assert!(figure_svg(&Figure::default()).contains("</svg>"));
        let mut figure = velocities(3);
        figure.panels[0].traces[0].values.fill(f64::NAN);
        figure.panels[0].traces[1].values.clear();
        figure.panels[1].traces.clear();
        figure.panels[1].label = "<b>&\"".into();
        let svg = figure_svg(&figure);
        assert!(svg.contains("</svg>") && !svg.contains("<b>"));
    }
}
