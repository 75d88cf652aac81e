//! The words of an expression, with their places.

use std::ops::Range;

use super::ExpressionError;

/// A word of an expression.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Word<'t> {
    Number(f64),
    Name(&'t str),
    /// `+ - * / ^`
    Operator(char),
    Open,
    Close,
    Comma,
}

/// Most words of one expression.
const MOST_WORDS: usize = 1000;

/// Splits an expression into words with their places in bytes.
pub(crate) fn words(text: &str) -> Result<Vec<(Word<'_>, Range<usize>)>, ExpressionError> {
    let mut words = Vec::new();
    let mut at = 0;
    while let Some(first) = text[at..].chars().next() {
        let rest = &text[at..];
        let (word, length) = match first {
            ' ' | '\t' | '\n' | '\r' => {
                at += first.len_utf8();
                continue;
            }
            '(' => (Word::Open, 1),
            ')' => (Word::Close, 1),
            ',' => (Word::Comma, 1),
            '*' if rest.starts_with("**") => {
                let error = ExpressionError::at(at..at + 2, "`**` is no operator");
                return Err(error.help("a power is written `x^2`"));
            }
            '+' | '-' | '*' | '/' | '^' => (Word::Operator(first), 1),
            '·' | '×' => (Word::Operator('*'), first.len_utf8()),
            '−' => (Word::Operator('-'), first.len_utf8()),
            '0'..='9' | '.' => number(rest, at)?,
            c if starts_name(c) => {
                let length = name(rest);
                (Word::Name(&rest[..length]), length)
            }
            other => {
                let place = at..at + other.len_utf8();
                let message = format!("`{other}` has no meaning in an expression");
                return Err(ExpressionError::at(place, message));
            }
        };
        words.push((word, at..at + length));
        at += length;
        if words.len() > MOST_WORDS {
            let message = format!("the expression has more than {MOST_WORDS} words");
            let error = ExpressionError::at(0..text.len(), message);
            return Err(error.help("divide it among further outputs of the plant"));
        }
    }
    Ok(words)
}

/// Digits, at most one point, an exponent.
fn number(rest: &str, at: usize) -> Result<(Word<'_>, usize), ExpressionError> {
    let bytes = rest.as_bytes();
    let digits = |mut i: usize| {
        while bytes.get(i).is_some_and(u8::is_ascii_digit) {
            i += 1;
        }
        i
    };
    let mut end = digits(0);
    if bytes.get(end) == Some(&b'.') {
        end = digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let last = digits(end + 1 + sign);
        if last > end + 1 + sign {
            end = last;
        }
    }
    let text = &rest[..end];
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok((Word::Number(x), end)),
        _ => {
            let message = format!("`{text}` is no number");
            Err(ExpressionError::at(at..at + end, message))
        }
    }
}

pub(crate) fn starts_name(c: char) -> bool {
    c.is_alphabetic() || c == '_'
}

/// Length of the name at the start of `rest`; a point joins the pieces of a channel's name.
fn name(rest: &str) -> usize {
    let mut end = 0;
    let mut letters = rest.char_indices().peekable();
    while let Some((i, c)) = letters.next() {
        let joins = c == '.' && letters.peek().is_some_and(|(_, next)| starts_name(*next));
        if !(starts_name(c) || c.is_numeric() || joins) {
            break;
        }
        end = i + c.len_utf8();
    }
    end
}

/// Whether `text` is one name without points.
pub(crate) fn is_name(text: &str) -> bool {
    text.chars().next().is_some_and(starts_name)
        && text.chars().all(|c| starts_name(c) || c.is_numeric())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_have_their_places() {
        let found = words("-2.5e-3*wheel.right ^ .5").unwrap();
        let expected = [
            (Word::Operator('-'), 0..1),
            (Word::Number(2.5e-3), 1..7),
            (Word::Operator('*'), 7..8),
            (Word::Name("wheel.right"), 8..19),
            (Word::Operator('^'), 20..21),
            (Word::Number(0.5), 22..24),
        ];
        assert_eq!(found, expected);
        // A letter behind a number is not its exponent.
        assert_eq!(words("2e").unwrap()[1].0, Word::Name("e"));
    }
}
