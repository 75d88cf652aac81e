//! What is in a log: a page with a small picture of each channel.

use std::fmt::Write as _;

use loopsight_recordings::{ChannelFacts, Inventory};

use crate::html::{escape, marked};
use crate::page::{Context, plain_page, section};
use crate::words::inventory::facts;

/// Size of a picture, in its own units.
const WIDTH: f64 = 240.0;
const HEIGHT: f64 = 64.0;
/// Room above and below the curve.
const MARGIN: f64 = 3.0;
/// The pen is lifted over a pause of so many periods.
const PAUSE: f64 = 5.0;
/// Pictures on a page; the others are told in words.
const MOST: usize = 600;

/// A page about what is in a log: each channel as a small picture from its smallest to its largest value, with
/// what is known of it, and the model file that the log asks for.
pub fn inventory_page(
    context: &Context,
    summary: &str,
    inventory: &Inventory,
    model_toml: Option<&str>,
) -> String {
    let (first, last) = span(inventory);
    let mut figures = String::new();
    let mut others: Vec<&ChannelFacts> = Vec::new();
    let mut drawn = 0;
    for channel in &inventory.channels {
        match picture(channel, first, last).filter(|_| drawn < MOST) {
            Some(svg) => {
                drawn += 1;
                let _ = writeln!(
                    figures,
                    "<figure>{svg}<figcaption><code>{}</code><br>{}</figcaption></figure>",
                    escape(&channel.path),
                    escape(&facts(channel))
                );
            }
            None => others.push(channel),
        }
    }
    let mut body = format!("<p>{}</p>\n", marked(summary));
    if drawn > 0 {
        let what = "Each picture goes from the beginning of the log to its end, and from the channel's smallest \
                    value to its largest. Where many values share a place, their whole range is drawn.";
        let grid = format!("<div class=\"grid\">\n{figures}</div>\n");
        body.push_str(&section("Channels", what, &grid));
    }
    if !others.is_empty() {
        let mut list = String::from("<ul>\n");
        for channel in &others {
            let (path, facts) = (escape(&channel.path), escape(&facts(channel)));
            let _ = writeln!(list, "<li><code>{path}</code>: {facts}</li>");
        }
        list.push_str("</ul>\n");
        let title = if drawn > 0 {
            "Without a picture"
        } else {
            "Channels"
        };
        body.push_str(&section(title, "", &list));
    }
    if let Some(toml) = model_toml {
        let what = "What loopsight inspect writes with -o model.toml, before it is fitted.";
        let toml = format!("<pre><code>{}</code></pre>\n", escape(toml));
        body.push_str(&section("A model file for it", what, &toml));
    }
    plain_page(context, &body)
}

/// The beginning and the end of all pictures.
fn span(inventory: &Inventory) -> (f64, f64) {
    let times = inventory
        .channels
        .iter()
        .filter_map(|c| Some(c.clock?.span));
    times.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (a, b)| {
        (low.min(a), high.max(b))
    })
}

/// A channel of numbers as SVG; none where nothing changes.
fn picture(channel: &ChannelFacts, first: f64, last: f64) -> Option<String> {
    let finite = |c: &(f64, f64, f64)| c.1.is_finite() && c.2.is_finite();
    let columns: Vec<(f64, f64, f64)> = channel.picture.columns().filter(finite).collect();
    let (low, high) = columns.iter().fold(
        (f64::INFINITY, f64::NEG_INFINITY),
        |(low, high), (_, a, b)| (low.min(*a), high.max(*b)),
    );
    if low.partial_cmp(&high) != Some(std::cmp::Ordering::Less) {
        return None;
    }
    let (start, end) = match channel.clock {
        Some(_) if last > first => (first, last),
        _ => (columns.first()?.0, columns.last()?.0),
    };
    let pause = match channel.clock {
        Some(clock) => (PAUSE * clock.period).max(8.0 * channel.picture.width()),
        None => f64::INFINITY,
    };
    let path = path(&columns, (start, end), (low, high), pause);
    let label = escape(&channel.path);
    Some(format!(
        "<svg class=\"curve\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" preserveAspectRatio=\"none\" role=\"img\" \
         aria-label=\"{label}\"><path d=\"{path}\"/></svg>"
    ))
}

/// From column to column; a pen that is lifted where nothing was measured.
fn path(
    columns: &[(f64, f64, f64)],
    (start, end): (f64, f64),
    (low, high): (f64, f64),
    pause: f64,
) -> String {
    let x = |time: f64| match end > start {
        true => ((time - start) / (end - start) * WIDTH)
            .clamp(0.0, WIDTH)
            .round(),
        false => 0.0,
    };
    let room = HEIGHT - 2.0 * MARGIN;
    let y = |value: f64| (MARGIN + (high - value) / (high - low) * room).round();
    let mut path = String::new();
    let mut before: Option<(f64, f64)> = None;
    for (time, low, high) in columns {
        let (x, bottom, top) = (x(*time), y(*low), y(*high));
        let near = before.filter(|(at, _)| time - at < pause);
        // First to the end that is nearer.
        let (from, to) = match near {
            Some((_, pen)) if (pen - top).abs() < (pen - bottom).abs() => (top, bottom),
            _ => (bottom, top),
        };
        let _ = match near {
            Some(_) => write!(path, "L{x} {from}"),
            None => write!(path, "M{x} {from}h1"),
        };
        if from != to {
            let _ = write!(path, "V{to}");
        }
        before = Some((*time, to));
    }
    path
}

#[cfg(test)]
mod tests {
    use loopsight_recordings::read_bytes;

    use super::*;
    use crate::packed::library;

    fn page(text: &str) -> String {
        let inventory = read_bytes(text.as_bytes(), "log").unwrap().inventory();
        let context = Context {
            title: "What is in log.csv".into(),
            ..Context::default()
        };
        inventory_page(
            &context,
            "CSV, 3 channels.",
            &inventory,
            Some("[plant.dc_axis]\n"),
        )
    }

    #[test]
    fn each_channel_is_a_picture_and_the_page_is_small() {
        let row = |k: u32| {
            format!(
                "{},{},{},up\n",
                0.01 * f64::from(k),
                k % 7,
                f64::from(k).sqrt()
            )
        };
        let rows: String = (0..20_000).map(row).collect();
        let page = page(&format!("t_s,u_V,<w>,mode\n{rows}"));
        assert_eq!(page.matches("<svg").count(), 3);
        assert!(page.contains("<code>&lt;w&gt;</code>") && !page.contains("<w>"));
        assert!(page.contains("<li><code>mode</code>: 20000 texts"));
        assert!(page.contains("[plant.dc_axis]"));
        assert!(page.len() < 40_000, "{}", page.len());
        assert!(!page.contains(library()) && !page.contains("://"));
    }

    #[test]
    fn what_does_not_change_is_told_in_words() {
        let said = page("t_s,u_V\n0,5\n1,5\n");
        assert!(said.contains("<li><code>u_V</code>: 2 numbers"), "{said}");
        let said = page("t_s,u_V\n0,nan\n1,nan\n");
        assert!(said.contains("<li><code>u_V</code>: 2 numbers"), "{said}");
        let said = page("t_s,u_V\n0,inf\n1,1e300\n");
        assert!(!said.contains("NaN"), "{said}");
    }
}
