//! The grammar of units: recursive descent without an allocation.

use super::symbols::lookup;
use super::{Problem, Unit, UnitError};

/// Parentheses nest no deeper.
const MAX_DEPTH: usize = 8;

/// A text and how far it was read.
pub(super) struct Parser<'t> {
    text: &'t str,
    at: usize,
}

impl<'t> Parser<'t> {
    pub(super) fn new(text: &'t str) -> Self {
        Self { text, at: 0 }
    }

    pub(super) fn peek(&self) -> Option<char> {
        self.text
            .get(self.at..)
            .and_then(|rest| rest.chars().next())
    }

    fn error(&self, from: usize, problem: Problem) -> UnitError {
        UnitError {
            position: from,
            length: self.at.saturating_sub(from),
            problem,
        }
    }

    pub(super) fn here(&self, problem: Problem) -> UnitError {
        let length = self.peek().map_or(0, char::len_utf8);
        UnitError {
            position: self.at,
            length,
            problem,
        }
    }

    fn take_while(&mut self, accept: impl Fn(char) -> bool) -> usize {
        let from = self.at;
        while let Some(c) = self.peek().filter(|c| accept(*c)) {
            self.at += c.len_utf8();
        }
        from
    }

    pub(super) fn product(&mut self, depth: usize) -> Result<Unit, UnitError> {
        let mut total = Unit::ONE;
        let mut behind_per = false;
        let mut divide = false;
        let mut wanted = true; // a factor must follow
        loop {
            self.take_while(char::is_whitespace);
            let from = self.at;
            match self.peek() {
                None | Some(')') if wanted => return Err(self.here(Problem::MissingUnit)),
                None | Some(')') => return Ok(total),
                Some(c @ ('*' | '·' | '⋅' | '.' | '_' | '/')) => {
                    if wanted {
                        return Err(self.here(Problem::MissingUnit));
                    }
                    self.at += c.len_utf8();
                    wanted = true;
                    divide = c == '/';
                }
                Some(_) => {
                    let Some(factor) = self.factor(depth)? else {
                        behind_per = true;
                        wanted = true;
                        divide = false;
                        self.take_while(|c| c == '_');
                        continue;
                    };
                    let power = self.power()?;
                    let power = if divide || behind_per { -power } else { power };
                    total = total
                        .times(factor, power)
                        .ok_or_else(|| self.error(from, Problem::TooLarge))?;
                    wanted = false;
                    divide = false;
                }
            }
        }
    }

    /// One factor without its power; none for the word `per`.
    fn factor(&mut self, depth: usize) -> Result<Option<Unit>, UnitError> {
        let from = self.at;
        match self.peek() {
            Some('(') if depth >= MAX_DEPTH => Err(self.here(Problem::Parenthesis)),
            Some('(') => {
                self.at += 1;
                let unit = self.product(depth + 1)?;
                if self.peek() != Some(')') {
                    return Err(self.error(from, Problem::Parenthesis));
                }
                self.at += 1;
                Ok(Some(unit))
            }
            Some('1') => {
                self.take_while(|c| c.is_ascii_digit());
                if self.at == from + 1 {
                    Ok(Some(Unit::ONE))
                } else {
                    Err(self.error(from, Problem::UnknownSymbol))
                }
            }
            Some(c) if is_letter(c) => {
                self.take_while(is_letter);
                let word = &self.text[from..self.at];
                if word == "per" {
                    return Ok(None);
                }
                lookup(word)
                    .map(Some)
                    .ok_or_else(|| self.error(from, Problem::UnknownSymbol))
            }
            _ => Err(self.here(Problem::UnknownSymbol)),
        }
    }

    /// The power behind a factor; 1 when there is none.
    fn power(&mut self) -> Result<i8, UnitError> {
        let from = self.at;
        if self.peek() == Some('^') {
            self.at += 1;
        }
        let digits = self.take_while(|c| is_sign(c) || digit(c).is_some());
        let text = &self.text[digits..self.at];
        if text.is_empty() {
            return if from == self.at {
                Ok(1)
            } else {
                Err(self.error(from, Problem::Power))
            };
        }
        let negative = text.starts_with(is_sign);
        let mut magnitudes = text.chars().skip(usize::from(negative)).map(digit);
        match (magnitudes.next(), magnitudes.next()) {
            (Some(Some(power @ 1..=9)), None) => Ok(if negative { -power } else { power }),
            _ => Err(self.error(from, Problem::Power)),
        }
    }
}

fn is_letter(c: char) -> bool {
    // Superscript digits are no letters; `µ`, `μ`, `Ω` (both code points) and `°`, `%` act as ones.
    c.is_alphabetic() || c == '%' || c == '°'
}

fn is_sign(c: char) -> bool {
    matches!(c, '-' | '⁻' | '−')
}

fn digit(c: char) -> Option<i8> {
    let superscripts = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let value = match c.to_digit(10) {
        Some(value) => value as usize,
        None => superscripts.iter().position(|s| *s == c)?,
    };
    i8::try_from(value).ok()
}
