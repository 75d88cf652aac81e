//! What is in a log, channel by channel.

use loopsight_recordings::{ChannelFacts, Kind};

use super::number;

/// So many values of a kind.
fn values(count: usize, kind: Kind) -> String {
    let (one, several) = match kind {
        Kind::Number => ("number", "numbers"),
        Kind::Boolean => ("boolean", "booleans"),
        Kind::Text => ("text", "texts"),
        Kind::Opaque => ("opaque value", "opaque values"),
    };
    format!("{count} {}", if count == 1 { one } else { several })
}

/// What is known of a channel, on one line: how many values, unit, rate, range, texts, what is missing, pauses.
pub fn facts(channel: &ChannelFacts) -> String {
    let mut parts = vec![values(channel.values, channel.kind)];
    if let Some(unit) = &channel.unit {
        parts.push(match unit.why {
            "the file says so" => unit.unit.clone(),
            why => format!("{} ({why})", unit.unit),
        });
    }
    if let Some(clock) = channel.clock.filter(|c| c.period > 0.0) {
        parts.push(format!("{} Hz", number(1.0 / clock.period)));
    }
    if let Some((low, high)) = channel.range {
        parts.push(format!("{} to {}", number(low), number(high)));
    }
    if !channel.words.is_empty() {
        parts.push(channel.words.join(" | "));
    }
    if channel.missing > 0 {
        let share = channel.missing as f64 / channel.values.max(1) as f64;
        parts.push(format!("{} % missing", number(100.0 * share)));
    }
    if let Some(clock) = channel.clock {
        if clock.gaps > 0 {
            let longest = number(clock.longest_gap);
            parts.push(match clock.gaps {
                1 => format!("a pause of {longest} s"),
                gaps => format!("{gaps} pauses, the longest {longest} s"),
            });
        }
        if clock.backwards > 0 {
            parts.push(format!("time goes back {} times", clock.backwards));
        }
    }
    parts.join(", ")
}

#[cfg(test)]
mod tests {
    use loopsight_recordings::read_bytes;

    use super::*;

    #[test]
    fn a_channel_on_one_line() {
        let text = "t_s,u_V,mode\n0,1,up\n0.1,2,up\n0.2,,down\n1.2,3,up\n";
        let inventory = read_bytes(text.as_bytes(), "log").unwrap().inventory();
        let said: Vec<String> = inventory.channels.iter().map(facts).collect();
        let clock = "10 Hz";
        let pause = "a pause of 1 s";
        assert_eq!(
            said[1],
            format!("4 numbers, V (the end of the name), {clock}, 1 to 3, 25 % missing, {pause}")
        );
        assert_eq!(said[2], format!("4 texts, {clock}, up | down, {pause}"));
    }
}
