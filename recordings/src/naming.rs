//! Units at the end of a name: `speed_rpm`, `speed [rpm]`, `Speed (RPM)`, `room_degC`.

use loopsight_core::unit::{parse, split_name};

use crate::table::ColumnName;

/// Kelvin of a degree, and kelvin at zero.
const CELSIUS: (f64, f64) = (1.0, 273.15);
const FAHRENHEIT: (f64, f64) = (5.0 / 9.0, 459.67 * 5.0 / 9.0);

/// Words that mean a temperature whatever they stand for.
const TEMPERATURES: [(&str, (f64, f64)); 12] = [
    ("°C", CELSIUS),
    ("℃", CELSIUS),
    ("degC", CELSIUS),
    ("deg_C", CELSIUS),
    ("deg C", CELSIUS),
    ("celsius", CELSIUS),
    ("°F", FAHRENHEIT),
    ("℉", FAHRENHEIT),
    ("degF", FAHRENHEIT),
    ("deg_F", FAHRENHEIT),
    ("deg F", FAHRENHEIT),
    ("fahrenheit", FAHRENHEIT),
];

/// Beginnings of the names of columns of time stamps.
const TIME_NAMES: [&str; 4] = ["time", "timestamp", "stamp", "elapsed"];
/// Words of time that stand at the end of names.
const TIMES: [(&str, &str); 20] = [
    ("second", "s"),
    ("seconds", "s"),
    ("minute", "min"),
    ("minutes", "min"),
    ("hour", "h"),
    ("hours", "h"),
    ("millis", "ms"),
    ("millisecond", "ms"),
    ("milliseconds", "ms"),
    ("msec", "ms"),
    ("micros", "us"),
    ("microsecond", "us"),
    ("microseconds", "us"),
    ("usec", "us"),
    ("nanos", "ns"),
    ("nanosecond", "ns"),
    ("nanoseconds", "ns"),
    ("nsec", "ns"),
    ("sec", "s"),
    ("secs", "s"),
];

/// The name and the unit of a header that ends with a word of time: `time_millis`, `timeMillis`, `millis`.
fn time(text: &str) -> Option<(&str, &'static str)> {
    let lower = text.to_ascii_lowercase();
    let ends = |(word, _): &&(&str, &str)| lower.ends_with(word);
    let (word, unit) = TIMES
        .iter()
        .filter(ends)
        .max_by_key(|(word, _)| word.len())?;
    let (name, ending) = text.split_at_checked(text.len() - word.len())?;
    let apart = name.ends_with(['_', ' ', '-', '.']);
    let camel = name.ends_with(char::is_lowercase) && ending.starts_with(char::is_uppercase);
    let name = name.trim_end_matches(['_', ' ', '-', '.']);
    match name.is_empty() {
        // `millis` alone is a time; `sec` is an effort somewhere, and `hours` may be those of a day.
        true if word.len() > 4 && !["s", "min", "h"].contains(unit) => Some((text, unit)),
        false if apart || camel => Some((name, unit)),
        _ => None,
    }
}

/// Factor and offset to kelvin of a scale of temperatures; `C` and `F` are one where a temperature is expected.
pub(crate) fn temperature(unit: &str, expected: bool) -> Option<(f64, f64)> {
    match unit {
        "C" if expected => return Some(CELSIUS),
        "F" if expected => return Some(FAHRENHEIT),
        _ => {}
    }
    let found = TEMPERATURES
        .iter()
        .find(|(word, _)| word.eq_ignore_ascii_case(unit));
    found.map(|(_, scale)| *scale)
}

/// Whether a text is a unit, of temperatures as well.
pub(crate) fn is_unit(text: &str) -> bool {
    temperature(text, false).is_some() || parse(text).is_ok()
}

/// The name and the unit of a header.
pub(crate) fn split(text: &str) -> (&str, Option<String>) {
    if let Some((name, unit)) = brackets(text) {
        return (name, Some(unit));
    }
    if let (name, Some(unit)) = split_name(text) {
        return (name, Some(ending(unit)));
    }
    if let Some((name, unit)) = time(text) {
        return (name, Some(unit.to_owned()));
    }
    for (word, _) in TEMPERATURES {
        let at = text.len().saturating_sub(word.len());
        let is_end = text
            .get(at..)
            .is_some_and(|end| end.eq_ignore_ascii_case(word));
        let name = text
            .get(..at)
            .and_then(|name| name.strip_suffix(['_', ' ']));
        if let Some(name) = name.filter(|name| is_end && !name.is_empty()) {
            return (name, Some(word.to_owned()));
        }
    }
    (text, None)
}

/// The unit that the end of a name means: `m_per_s` where it is `m_s`, and `rad_per_s2` where it is `rad_s2`. A way, an angle
/// or a volume times a time is measured by nobody.
pub(crate) fn ending(unit: &str) -> String {
    let whose = |text: &str, base: &str| {
        parse(base).is_ok_and(|base| parse(text).is_ok_and(|unit| unit.dimension == base.dimension))
    };
    match unit.rsplit_once('_') {
        Some((way, time))
            if !way.contains('_')
                && ["m", "rad", "m^3"].iter().any(|base| whose(way, base))
                && (whose(time, "s") || whose(time, "s2")) =>
        {
            format!("{way}_per_{time}")
        }
        _ => unit.to_owned(),
    }
}

/// `Speed (RPM)`: the name, and the unit in brackets, in small letters where it is none otherwise.
pub(crate) fn brackets(text: &str) -> Option<(&str, String)> {
    for (open, close) in [('(', ')'), ('[', ']')] {
        let inside = text.strip_suffix(close).and_then(|t| t.rsplit_once(open));
        let Some((name, unit)) = inside else { continue };
        let (name, unit) = (name.trim_end().trim_end_matches('_'), unit.trim());
        let lower = unit.to_lowercase();
        // An index is no unit.
        let fits =
            |u: &&str| u.contains(|c: char| c.is_alphabetic() || "%°℃℉".contains(c)) && is_unit(u);
        if let Some(unit) = [unit, lower.as_str()].into_iter().find(fits)
            && !name.is_empty()
        {
            return Some((name, unit.to_owned()));
        }
    }
    None
}

/// Whether a name is that of a column of time stamps.
pub(crate) fn is_time(name: &str) -> bool {
    let name = plain(name);
    let alone = || time(&name).is_some_and(|(rest, _)| rest == name);
    name == "t" || TIME_NAMES.iter().any(|n| name.starts_with(n)) || alone()
}

/// Whether a unit is one of time.
pub(crate) fn is_unit_of_time(unit: &str) -> bool {
    parse("s").is_ok_and(|s| parse(unit).is_ok_and(|unit| unit.dimension == s.dimension))
}

/// The unit of a column of times, by its header: one that ends with a unit of time, or is nothing else.
pub(crate) fn unit_of_time(column: &ColumnName) -> Option<&str> {
    let unit = column.unit.as_deref().filter(|unit| is_unit_of_time(unit));
    let lower = column.text.to_lowercase();
    let word = || {
        TIMES
            .iter()
            .find(|(word, _)| *word == lower)
            .map(|(_, unit)| *unit)
    };
    let short = || {
        ["ms", "us", "µs", "ns", "min"]
            .into_iter()
            .find(|unit| *unit == lower)
    };
    unit.or_else(word).or_else(short)
}

/// A name as ids are written: small letters, words joined by `_`.
pub(crate) fn plain(name: &str) -> String {
    let mut out = String::with_capacity(name.len());
    for c in name.chars() {
        match c {
            ' ' | '-' => out.push('_'),
            c => out.extend(c.to_lowercase()),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_behind_a_line_or_in_brackets() {
        for (text, name, unit) in [
            ("speed_rpm", "speed", Some("rpm")),
            ("pump_l_min", "pump", Some("l_per_min")),
            ("speed [rpm]", "speed", Some("rpm")),
            ("Left Speed (M/s)", "Left Speed", Some("m/s")),
            ("u(V)", "u", Some("V")),
            ("duty [%]", "duty", Some("%")),
            ("room_degC", "room", Some("degC")),
            ("room [°F]", "room", Some("°F")),
            ("Room Celsius", "Room", Some("celsius")),
            ("weights[1]", "weights[1]", None),
            ("time_millis", "time", Some("ms")),
            ("timeMillis", "time", Some("ms")),
            ("timestamp_usec", "timestamp", Some("us")),
            ("millis", "millis", Some("ms")),
            ("elapsed_sec", "elapsed", Some("s")),
            ("climb_m_s", "climb", Some("m_per_s")),
            ("gyro_z_deg_s", "gyro_z", Some("deg_per_s")),
            ("acc_m_s2", "acc", Some("m_per_s2")),
            ("torque_N_m", "torque", Some("N_m")),
            ("flux_V_s", "flux", Some("V_s")),
            ("parsec", "parsec", None),
            ("omega", "omega", None),
            ("(V)", "(V)", None),
        ] {
            assert_eq!(split(text), (name, unit.map(str::to_owned)), "{text}");
        }
    }

    #[test]
    fn scales_of_temperatures() {
        let kelvin = |unit, value: f64| {
            let (factor, offset) = temperature(unit, true).unwrap();
            value * factor + offset
        };
        assert_eq!(kelvin("°C", 20.0), 293.15);
        assert!((kelvin("F", 68.0) - 293.15).abs() < 1e-9);
        assert_eq!(temperature("C", false), None);
    }
}
