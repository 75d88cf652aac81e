//! Dates and times as they stand in logs: ISO 8601, and what spreadsheets make of it.
//!
//! `2024-05-01T12:00:00.125Z`, `2024-05-01 12:00:00,125+02:00`, `12:00:00.5`. The date may have slashes
//! (`2024/05/01`); a time without a zone is taken as it is.
//!
//! Reference: ISO 8601-1:2019; days from H. Hinnant, "chrono-Compatible Low-Level Date Algorithms", 2021.

const DAY: i64 = 86_400;
const NANO: i64 = 1_000_000_000;

/// Nanoseconds since 1970, or since midnight where there is no date; none for anything else.
pub(crate) fn nanoseconds(text: &str) -> Option<i64> {
    let text = text.trim();
    let (date, time) = match text.split_once(['T', 't', ' ']) {
        Some((date, time)) => (Some(date), time.trim_start()),
        None => (None, text),
    };
    let days = date.map_or(Some(0), days)?;
    let (clock, shift) = zone(time)?;
    let (seconds, nano) = of_clock(clock)?;
    let seconds = days.checked_mul(DAY)?.checked_add(seconds - shift)?;
    seconds.checked_mul(NANO)?.checked_add(nano)
}

/// A number of so many digits and nothing else.
fn digits(text: &str, lengths: std::ops::RangeInclusive<usize>) -> Option<i64> {
    let right = lengths.contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit());
    right.then(|| text.parse().ok()).flatten()
}

/// Days since 1970 of `2024-05-01`.
fn days(text: &str) -> Option<i64> {
    let mut parts = text.split(['-', '/']);
    let year = digits(parts.next()?, 4..=4)?;
    let month = digits(parts.next()?, 1..=2).filter(|m| (1..=12).contains(m))?;
    let day = digits(parts.next()?, 1..=2).filter(|d| (1..=31).contains(d))?;
    if parts.next().is_some() {
        return None;
    }
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
        ] {
            assert_eq!(nanoseconds(text), Some(expected), "{text}");
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
        ] {
            assert_eq!(nanoseconds(text), None, "{text}");
        }
    }

    proptest! {
        #[test]
        fn never_panics(any in ".{0,30}", near in "[0-9TZ:+ .,/-]{0,30}") {
            let _ = (nanoseconds(&any), nanoseconds(&near));
        }
    }
}
