//! Plain text as a printer would set it.

/// `text` with true minus signs, powers of ten and of units raised, and numbers that stay on one line with their
/// units: `-1.2e-7 m/s^2` becomes `−1.2·10⁻⁷ m/s²`. What is not a number stays as it is.
pub(crate) fn typeset(text: &str) -> String {
    if text == "-" {
        return "–".into();
    }
    let letters: Vec<char> = text.chars().collect();
    let at = |k: usize| letters.get(k).copied().unwrap_or(' ');
    let digit = |k: usize| at(k).is_ascii_digit();
    let mut out = String::with_capacity(text.len() + 8);
    let mut in_number = false;
    let mut k = 0;
    while k < letters.len() {
        let before = k.checked_sub(1).map_or(' ', at);
        match at(k) {
            // Not the hyphen of `run-2`.
            '-' if (digit(k + 1) || at(k + 1) == '∞') && !before.is_alphanumeric() => {
                out.push('−')
            }
            'e' if in_number && exponent(&letters[k + 1..]).is_some() => {
                let (power, length) = exponent(&letters[k + 1..]).unwrap_or_default();
                out.push_str(&format!("·10{power}"));
                k += length;
            }
            ' ' if in_number && begins_unit(&letters[k + 1..]) => out.push('\u{a0}'),
            '^' if at(k + 1) == '2' => {
                out.push('²');
                k += 1;
            }
            '^' if at(k + 1) == '3' => {
                out.push('³');
                k += 1;
            }
            other => out.push(other),
        }
        // A digit within a name (`run2`, `x_1`, `a/2e5`, `run-2`) begins no number.
        let alone = |c: char| c.is_whitespace() || "([±+".contains(c);
        let sign = before == '-' && alone(k.checked_sub(2).map_or(' ', at));
        in_number = match at(k) {
            '0'..='9' => in_number || alone(before) || sign,
            '.' => in_number,
            _ => false,
        };
        k += 1;
    }
    out
}

/// Whether a unit, or `%`, stands behind a number: it is short, or has a power or a fraction in it.
fn begins_unit(letters: &[char]) -> bool {
    let word = letters
        .iter()
        .take_while(|c| !c.is_whitespace() && !",;:.)".contains(**c));
    let word: String = word.collect();
    let fraction = word.starts_with("1/");
    let short = word.chars().count() <= 3 || word.contains(['/', '^', '²', '·']);
    word == "%" || fraction || (short && word.starts_with(char::is_alphabetic))
}

/// The raised exponent at the beginning of `letters`, with its length; none where there is none.
fn exponent(letters: &[char]) -> Option<(String, usize)> {
    let raised = |c: &char| {
        Some(['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][c.to_digit(10)? as usize])
    };
    let sign = usize::from(letters.first() == Some(&'-'));
    let digits: String = letters[sign..].iter().map_while(raised).collect();
    let length = sign + digits.chars().count();
    let ends = letters.get(length).is_none_or(|c| !c.is_alphanumeric());
    (!digits.is_empty() && ends).then(|| {
        let sign = if sign == 1 { "⁻" } else { "" };
        (format!("{sign}{digits}"), length)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_set() {
        for (plain, set) in [
            ("-", "–"),
            ("-15.146 1/s", "−15.146\u{a0}1/s"),
            ("1.2e-7 m/s^2", "1.2·10⁻⁷\u{a0}m/s²"),
            ("-1.00e12", "−1.00·10¹²"),
            ("-13 … -12", "−13 … −12"),
            ("14.9 %, on data", "14.9\u{a0}%, on data"),
            ("0.013 m/s rms.", "0.013\u{a0}m/s rms."),
            ("> 10000 %", "> 10000\u{a0}%"),
            ("-∞", "−∞"),
            ("12 samples, 3 kg m^2", "12 samples, 3\u{a0}kg m²"),
        ] {
            assert_eq!(typeset(plain), set);
        }
    }

    #[test]
    fn names_stay() {
        for name in [
            "run-2",
            "K_2 is",
            "x1e5",
            "loop-2e5 b",
            "2e5b",
            "prbs_9V_25s.csv",
            "e",
            "1e",
            "",
            "^",
            "a-b",
            "b/2e5.csv",
        ] {
            assert_eq!(typeset(name), name);
        }
    }
}
