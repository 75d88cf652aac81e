//! Charts as data: what `page.js` hands to plotly.js.

use serde::Serialize;

use crate::numbers::rounded_times;
use crate::packed::packed;
use crate::thin::{MOST_POINTS, kept};
use crate::words::significant;

/// Significant digits of a drawn value.
const DIGITS: usize = 5;

/// What a trace shows; decides colour, width and dashes in `page.js`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Role {
    Measured,
    Model,
    /// A model after it was changed.
    After,
    OneStep,
    Reference,
    Commanded,
    Residual,
    Points,
    Mean,
    /// As [`Role::Mean`], of a model after it was changed.
    MeanAfter,
    /// Means without a line between them; the other is a second series of the same kind.
    Dots,
    DotsAfter,
    /// One of several alike: inputs, parameters.
    Series,
}

/// Abscissae: the chart's own time stamps, or a trace's own.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub(crate) enum Abscissae {
    Shared,
    Own(Vec<f64>),
}

/// A line or a cloud of points.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Trace {
    pub(crate) name: String,
    pub(crate) role: Role,
    pub(crate) x: Abscissae,
    pub(crate) y: Vec<f64>,
    /// Half the height of an error bar or a band.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) spread: Option<Vec<f64>>,
    /// Drawn as steps: each value stays until the next sample.
    pub(crate) step: bool,
    /// Drawn only when its entry in the legend is chosen.
    pub(crate) hidden: bool,
}

/// Traces that share a vertical axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Panel {
    /// What the vertical axis shows, with its unit.
    pub(crate) title: String,
    /// What the traces belong to, where their names alone do not say it.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub(crate) of: String,
    /// Height, pixels.
    pub(crate) height: u32,
    pub(crate) traces: Vec<Trace>,
    /// What the vertical axis spans at first; absent: everything.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) range: Option<[f64; 2]>,
    /// Intervals of the horizontal axis to shade.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) shaded: Vec<[f64; 2]>,
}

/// Panels above each other with one horizontal axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Chart {
    pub(crate) x_title: String,
    times: Vec<f64>,
    pub(crate) panels: Vec<Panel>,
    /// What the horizontal axis spans at first; absent: everything.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) x_range: Option<[f64; 2]>,
    /// Numbered vertical lines.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) events: Vec<f64>,
    /// Without legend and tool bar.
    pub(crate) small: bool,
    #[serde(skip)]
    time: Vec<f64>,
    #[serde(skip)]
    thinned: bool,
}

impl Chart {
    /// A chart over `time`.
    pub(crate) fn over_time(time: &[f64]) -> Self {
        let time = rounded_times(time);
        Self {
            x_title: "time, s".into(),
            times: if time.len() <= MOST_POINTS {
                time.clone()
            } else {
                Vec::new()
            },
            time,
            ..Self::default()
        }
    }

    /// A chart whose traces bring their abscissae.
    pub(crate) fn over(x_title: String) -> Self {
        Self {
            x_title,
            ..Self::default()
        }
    }

    /// Adds an empty panel; traces go into the panel added last.
    pub(crate) fn panel(&mut self, title: String, height: u32) {
        self.panels.push(Panel {
            title,
            height,
            ..Panel::default()
        });
    }

    /// As [`Chart::panel`], for traces of `of`.
    pub(crate) fn panel_of(&mut self, of: &str, title: String, height: u32) {
        self.panels.push(Panel {
            title,
            of: of.into(),
            height,
            ..Panel::default()
        });
    }

    /// Adds a trace over the chart's time to the last panel; thinned where it is long.
    pub(crate) fn line(&mut self, name: &str, role: Role, values: &[f64]) -> Option<&mut Trace> {
        self.band(name, role, values, None)
    }

    /// As [`Chart::line`], with a band of half-height `spread` around it.
    pub(crate) fn band(
        &mut self,
        name: &str,
        role: Role,
        values: &[f64],
        spread: Option<&[f64]>,
    ) -> Option<&mut Trace> {
        let values = &values[..values.len().min(self.time.len())];
        let kept = kept(values, MOST_POINTS);
        let pick = |from: &[f64]| {
            kept.iter()
                .map(|k| significant(from.get(*k).copied().unwrap_or(f64::NAN), DIGITS))
                .collect::<Vec<f64>>()
        };
        let x = if self.times.is_empty() {
            self.thinned |= kept.len() < values.len();
            Abscissae::Own(kept.iter().map(|k| self.time[*k]).collect())
        } else {
            Abscissae::Shared
        };
        let trace = Trace {
            name: name.into(),
            role,
            x,
            y: pick(values),
            spread: spread.map(pick),
            step: false,
            hidden: false,
        };
        self.push(trace)
    }

    /// Adds a trace with abscissae of its own to the last panel.
    pub(crate) fn push(&mut self, trace: Trace) -> Option<&mut Trace> {
        let panel = self.panels.last_mut()?;
        panel.traces.push(trace);
        panel.traces.last_mut()
    }

    /// Shades the intervals of time in which `flags` are set in the last panel.
    pub(crate) fn shade(&mut self, flags: &[bool]) {
        let intervals = intervals(&self.time, flags);
        if let Some(panel) = self.panels.last_mut() {
            panel.shaded = intervals;
        }
    }

    /// Limits what the last panel shows at first, where the first fifth of its traces would dwarf the rest: a
    /// recursive estimate starts with wild guesses.
    pub(crate) fn settle(&mut self) {
        let Some(panel) = self.panels.last_mut() else {
            return;
        };
        let span = |share: f64| {
            let mut span = [f64::INFINITY, f64::NEG_INFINITY];
            for trace in &panel.traces {
                let first = (share * trace.y.len() as f64) as usize;
                for (k, y) in trace.y.iter().enumerate().skip(first) {
                    let half = trace.spread.as_ref().map_or(0.0, |s| s[k]);
                    let half = if half.is_finite() { half } else { 0.0 };
                    span = [span[0].min(y - half), span[1].max(y + half)];
                }
            }
            span
        };
        let (all, late) = (span(0.0), span(0.2));
        let height = late[1] - late[0];
        let room = (0.5 * height).max(0.1 * late[0].abs().max(late[1].abs()));
        if height.is_finite() && room > 0.0 && all[1] - all[0] > 10.0 * (height + 2.0 * room) {
            panel.range = Some([late[0] - room, late[1] + room].map(|v| significant(v, 3)));
        }
    }

    /// What `page.js` reads.
    fn json(&self) -> String {
        // Plain data of numbers and texts always serialises.
        serde_json::to_string(self).unwrap_or_else(|_| "null".into())
    }

    /// The chart as an element of a page, its data packed.
    pub(crate) fn html(&self) -> String {
        // As page.js lays it out: a title above each panel, the horizontal axis below.
        let above = if self.events.is_empty() { 0 } else { 22 };
        let height: u32 = self.panels.iter().map(|p| p.height + 34).sum::<u32>() + 40 + above;
        let legend = if self.small {
            ""
        } else {
            "<div class=\"legend\"></div>"
        };
        let caption = if self.thinned {
            "<figcaption>Drawn with fewer points than were recorded: the least and the greatest value of \
             every short stretch.</figcaption>"
        } else {
            ""
        };
        format!(
            "<figure>{legend}<div class=\"chart\" style=\"height:{height}px\">\
             <script type=\"application/gzip\">{}</script></div>\
             {caption}</figure>\n",
            packed(&self.json())
        )
    }
}

/// The stretches of `time` with a flag; those too close to be told apart in a drawing are one.
fn intervals(time: &[f64], flags: &[bool]) -> Vec<[f64; 2]> {
    let (Some(first), Some(last)) = (time.first(), time.last()) else {
        return Vec::new();
    };
    let apart = (last - first) / 1000.0;
    let mut found: Vec<[f64; 2]> = Vec::new();
    for (k, _) in flags
        .iter()
        .take(time.len())
        .enumerate()
        .filter(|(_, flag)| **flag)
    {
        let end = time.get(k + 1).copied().unwrap_or(*last);
        match found.last_mut() {
            Some(interval) if time[k] - interval[1] <= apart => interval[1] = end,
            _ => found.push([time[k], end]),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seconds(n: u32) -> Vec<f64> {
        (0..n).map(f64::from).collect()
    }

    #[test]
    fn missing_values_are_null() {
        let mut chart = Chart::over_time(&seconds(3));
        chart.panel("speed, m/s".into(), 100);
        chart.line("measured", Role::Measured, &[1.0, f64::NAN, 3.000_000_1]);
        let json = chart.json();
        assert!(json.contains("\"y\":[1.0,null,3.0]"), "{json}");
        assert!(json.contains("\"times\":[0.0,1.0,2.0]") && json.contains("\"x\":null"));
        let html = chart.html();
        assert!(html.contains(&packed(&json)) && !html.contains("fewer points"));
    }

    #[test]
    fn long_series_are_thinned_and_it_is_said() {
        let n = 100_000;
        let mut values: Vec<f64> = seconds(n).iter().map(|t| t.sin()).collect();
        values[77_777] = 50.0;
        let mut chart = Chart::over_time(&seconds(n));
        chart.panel("x".into(), 100);
        let trace = chart.line("x", Role::Series, &values).unwrap();
        assert!(trace.y.len() <= MOST_POINTS && trace.y.contains(&50.0));
        let Abscissae::Own(x) = &trace.x else {
            panic!("own abscissae")
        };
        assert_eq!(x.len(), trace.y.len());
        let html = chart.html();
        assert!(
            html.contains("fewer points") && html.len() < 60_000,
            "{}",
            html.len()
        );
    }

    #[test]
    fn nothing_breaks_out_of_the_data() {
        let mut chart = Chart::over("</script><b>".into());
        assert!(chart.line("no panel", Role::Model, &[1.0]).is_none());
        chart.panel("</script><script>alert(1)</script>".into(), 100);
        let html = chart.html();
        assert_eq!(html.matches("</script>").count(), 1);
        assert!(!html.contains("<b>") && !html.contains("alert"));
    }

    #[test]
    fn a_series_longer_than_time_is_cut() {
        let mut chart = Chart::over_time(&[0.0]);
        chart.panel("x".into(), 100);
        assert_eq!(chart.line("x", Role::Model, &[1.0, 2.0]).unwrap().y, [1.0]);
    }

    #[test]
    fn wild_guesses_at_the_start_do_not_dwarf_the_rest() {
        let mut chart = Chart::over_time(&seconds(100));
        let values: Vec<f64> = seconds(100)
            .iter()
            .map(|t| 2.0 - 1e4 * (-t).exp())
            .collect();
        chart.panel("K".into(), 100);
        chart.line("estimate", Role::Model, &values);
        chart.settle();
        let [low, high] = chart.panels[0].range.unwrap();
        assert!(
            (1.7..2.0).contains(&low) && (2.0..2.3).contains(&high),
            "{low} {high}"
        );
        chart.panel("calm".into(), 100);
        chart.line("estimate", Role::Model, &seconds(100));
        chart.settle();
        assert_eq!(chart.panels[1].range, None);
    }

    #[test]
    fn flags_become_intervals() {
        let time = seconds(6);
        let flags = [true, true, false, false, true, true];
        assert_eq!(intervals(&time, &flags), [[0.0, 2.0], [4.0, 5.0]]);
        assert_eq!(intervals(&time, &[]), Vec::<[f64; 2]>::new());
        let fine: Vec<f64> = (0..100_000).map(|k| 0.01 * f64::from(k)).collect();
        let chatter: Vec<bool> = (0..100_000).map(|k| k % 2 == 0).collect();
        assert_eq!(intervals(&fine, &chatter).len(), 1);
    }
}
