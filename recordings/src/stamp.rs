//! Dates and times as they stand in logs: ISO 8601, and what spreadsheets make of it.
//!
//! `2024-05-01T12:00:00.125Z`, `2024-05-01 12:00:00,125+02:00`, `12:00:00.5`. The date may have slashes
//! (`2024/05/01`), begin with its day (`01.05.2024`) or its month (`5/1/2024 1:30 PM`), or name the month (`01-May-2024`); a time
//! without a zone is taken as it is.
//!
//! Reference: ISO 8601-1:2019; days from H. Hinnant, "chrono-Compatible Low-Level Date Algorithms", 2021.

const DAY: i64 = 86_400;
const NANO: i64 = 1_000_000_000;

/// What a date and time may be, in nanoseconds since 1970, or since midnight where there is no date: with its day before its
/// month, and with its month before its day. Nearly all have one order, and are the same twice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Instant([Option<i64>; 2]);

impl Instant {
    /// None of what is no time.
    pub(crate) fn of(text: &str) -> Option<Self> {
        let text = text.trim();
        let (date, time) = match text.split_once(['T', 't', ' ']) {
            Some((date, time)) if !date.contains(':') => (Some(date), time.trim_start()),
            _ => (None, text),
        };
        let days = date.map_or([Some(0); 2], days);
        let (seconds, nano) = time_of_day(time)?;
        let instant = days.map(|days| {
            let seconds = days?.checked_mul(DAY)?.checked_add(seconds)?;
            seconds.checked_mul(NANO)?.checked_add(nano)
        });
        instant.iter().any(Option::is_some).then_some(Self(instant))
    }

    /// Seconds since an `origin`, both read in the same order: in that which comes nearest to what was `last`.
    pub(crate) fn since(self, origin: Self, last: f64) -> Option<f64> {
        let pairs = self.0.into_iter().zip(origin.0);
        let spans = pairs.filter_map(|(now, origin)| now?.checked_sub(origin?));
        let seconds = spans.map(|span| span as f64 / 1e9);
        seconds.min_by(|a, b| (a - last).abs().total_cmp(&(b - last).abs()))
    }
}

/// Seconds since midnight, in UTC where a zone is given, and nanoseconds.
fn time_of_day(text: &str) -> Option<(i64, i64)> {
    let (time, afternoon) = half_of_day(text);
    let (clock, shift) = zone(time)?;
    let (mut seconds, nano) = of_clock(clock)?;
    if let Some(afternoon) = afternoon {
        let hour = 3600;
        if !(hour..13 * hour).contains(&seconds) {
            return None;
        }
        seconds = seconds % (12 * hour) + if afternoon { 12 * hour } else { 0 };
    }
    Some((seconds - shift, nano))
}

/// A time without `AM` or `PM` behind it, and whether it is one of the afternoon where that is said.
fn half_of_day(text: &str) -> (&str, Option<bool>) {
    let at = text.len().saturating_sub(2);
    let (time, half) = text.split_at_checked(at).unwrap_or((text, ""));
    let afternoon = match half.to_ascii_lowercase().as_str() {
        "am" => false,
        "pm" => true,
        _ => return (text, None),
    };
    (time.trim_end(), Some(afternoon))
}

/// A number of so many digits and nothing else.
fn digits(text: &str, lengths: std::ops::RangeInclusive<usize>) -> Option<i64> {
    let right = lengths.contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit());
    right.then(|| text.parse().ok()).flatten()
}

const MONTHS: [&str; 12] = [
    "jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec",
];

/// The month that a number or the beginning of a name means.
fn month(text: &str) -> Option<i64> {
    let lower = text.to_ascii_lowercase();
    match MONTHS.iter().zip(1..).find(|(name, _)| **name == lower) {
        Some((_, month)) => Some(month),
        None => digits(text, 1..=2).filter(|m| (1..=12).contains(m)),
    }
}

/// Days since 1970 of `2024-05-01`, or of a date that ends with its year: with the day first, and with the month first. Where
/// points or a name say which is which, they are the same.
fn days(text: &str) -> [Option<i64>; 2] {
    let parts: Vec<&str> = text.split(['-', '/', '.']).collect();
    let [first, second, third] = parts[..] else {
        return [None; 2];
    };
    if first.len() == 4 {
        return [days_of(first, second, third); 2];
    }
    let day_first = days_of(third, second, first);
    let named = second.starts_with(|c: char| c.is_ascii_alphabetic());
    match named || text.contains('.') {
        true => [day_first; 2],
        false => [day_first, days_of(third, first, second)],
    }
}

/// Days since 1970 of a year, a month and a day.
fn days_of(year: &str, month_text: &str, day: &str) -> Option<i64> {
    let year = digits(year, 4..=4)?;
    let month = month(month_text)?;
    let day = digits(day, 1..=2).filter(|d| (1..=31).contains(d))?;
    // The year begins in March: the leap day is its last.
    let year = year - i64::from(month <= 2);
    let era = year.div_euclid(400);
    let of_era = year.rem_euclid(400);
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    Some(era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468)
}

/// The time of day, and what its zone is ahead of UTC, s.
fn zone(text: &str) -> Option<(&str, i64)> {
    if let Some(clock) = text.strip_suffix(['Z', 'z']) {
        return Some((clock.trim_end(), 0));
    }
    let Some(at) = text.rfind(['+', '-']) else {
        return Some((text, 0));
    };
    let sign = if text.as_bytes().get(at) == Some(&b'-') {
        -1
    } else {
        1
    };
    let shift = text.get(at + 1..)?;
    let (hours, minutes) = match shift.split_once(':') {
        Some(parts) => parts,
        None => (shift.get(..2)?, shift.get(2..)?),
    };
    let minutes = if minutes.is_empty() {
        0
    } else {
        digits(minutes, 2..=2)?
    };
    let shift = sign * (3600 * digits(hours, 2..=2)? + 60 * minutes);
    Some((text.get(..at)?.trim_end(), shift))
}

/// Seconds and nanoseconds of `12:00:00.125`.
fn of_clock(text: &str) -> Option<(i64, i64)> {
    let mut parts = text.splitn(3, ':');
    let hours = digits(parts.next()?, 1..=2).filter(|h| *h <= 24)?;
    let minutes = digits(parts.next()?, 2..=2).filter(|m| *m < 60)?;
    let (seconds, nano) = match parts.next() {
        None => (0, 0),
        Some(seconds) => match seconds.split_once(['.', ',']) {
            None => (digits(seconds, 2..=2)?, 0),
            Some((seconds, fraction)) => {
                digits(fraction, 1..=18)?;
                let nine: String = fraction
                    .chars()
                    .chain("000000000".chars())
                    .take(9)
                    .collect();
                (digits(seconds, 2..=2)?, digits(&nine, 9..=9)?)
            }
        },
    };
    // 60: a leap second.
    (seconds <= 60).then_some((3600 * hours + 60 * minutes + seconds, nano))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn dates_times_and_zones() {
        for (text, expected) in [
            ("1970-01-01T00:00:00Z", 0),
            ("2024-05-01T12:00:00.125Z", 1_714_564_800_125_000_000),
            ("2024-05-01 14:00:00,125+02:00", 1_714_564_800_125_000_000),
            ("2024/05/01 07:30:00.125 -0430", 1_714_564_800_125_000_000),
            ("2024-05-01T12:00", 1_714_564_800_000_000_000),
            ("2000-02-29T00:00:00", 951_782_400_000_000_000),
            ("12:00:00.5", 43_200_500_000_000),
            ("0:00:01.0000000019", 1_000_000_001),
            ("01.05.2024 12:00:00,125", 1_714_564_800_125_000_000),
            ("01-May-2024 12:00:00.125", 1_714_564_800_125_000_000),
            ("12:00:00.5 AM", 500_000_000),
            ("1:30 pm", 48_600_000_000_000),
        ] {
            let both = Instant([Some(expected); 2]);
            assert_eq!(Instant::of(text), Some(both), "{text}");
        }
        for text in [
            "",
            "1.5",
            "2024-05-01",
            "auto",
            "12:61:00",
            "2024-13-01T00:00:00",
            "1:2",
            "::",
            "13:00 PM",
            "0:30 AM",
            "1.5.24 12:00",
            "1.5.2024. 12:00",
            "13/13/2024 12:00",
            "01-Mai-2024 12:00",
        ] {
            assert_eq!(Instant::of(text), None, "{text}");
        }
    }

    /// The third of April and the fourth of March are told apart by the next day.
    #[test]
    fn the_order_of_a_date_is_that_in_which_the_time_goes_on() {
        let since = |first: &str, now: &str| {
            let origin = Instant::of(first).unwrap();
            Instant::of(now).and_then(|now| now.since(origin, 86_399.0))
        };
        let day = Some(86_400.0);
        assert_eq!(since("03/04/2026 0:00", "03/05/2026 0:00"), day);
        assert_eq!(since("03/04/2026 0:00", "04/04/2026 0:00"), day);
        assert_eq!(since("12/31/2025 0:00", "1/1/2026 0:00"), day);
        assert_eq!(since("31/12/2025 0:00", "1/1/2026 0:00"), day);
        assert_eq!(since("12/31/2025 0:00", "13/1/2026 0:00"), None);
    }

    proptest! {
        #[test]
        fn never_panics(any in ".{0,30}", near in "[0-9TZ:+ .,/APM-]{0,30}") {
            let _ = (Instant::of(&any), Instant::of(&near));
        }
    }
}
