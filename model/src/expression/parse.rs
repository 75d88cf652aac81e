//! From the text of an expression to its tree.
//!
//! The words are checked here, one behind the other, where a mistake can still be pointed at. Which
//! operator binds more tightly is the business of `precedence`.

use std::ops::Range;

use super::lexer::{Word, words};
use super::operation::{Binary, CONSTANTS, FUNCTIONS, Function, constant, function};
use super::precedence::Stacks;
use super::program::MOST_LEAVES;
use super::tree::Tree;
use super::{ExpressionError, Names};
use crate::config::nearest;

/// Deepest nesting of parentheses.
const DEEPEST: usize = 40;

/// Reads an expression; `names` says what the names in it are.
pub(crate) fn parse(text: &str, names: &dyn Names) -> Result<Tree, ExpressionError> {
    let mut reader = Reader {
        text,
        names,
        stacks: Stacks::default(),
        open: vec![Level::default()],
        sign: false,
    };
    let words = words(text)?;
    let mut wanted = Wanted::Operand;
    for (i, (word, place)) in words.iter().enumerate() {
        let called = matches!(words.get(i + 1), Some((Word::Open, _)));
        wanted = match wanted {
            Wanted::Operand => reader.operand(*word, place, called)?,
            Wanted::Open => {
                if let Some(level) = reader.level() {
                    level.place = place.clone();
                }
                Wanted::Operand
            }
            Wanted::Operator => reader.operator(*word, place)?,
        };
    }
    reader.end(wanted)?;
    let tree = reader.stacks.finish();
    let tree = tree.ok_or_else(|| ExpressionError::at(0..text.len(), "there is no expression"))?;
    if tree.has_bad_number() {
        let message = "a part of this without names is not a finite number";
        return Err(ExpressionError::at(0..text.len(), message));
    }
    if tree.size() > MOST_LEAVES {
        return Err(ExpressionError::at(
            0..text.len(),
            "the expression is too long",
        ));
    }
    Ok(tree)
}

/// What must come next.
#[derive(Clone, Copy, PartialEq)]
enum Wanted {
    /// A number, a name, an opening parenthesis or a sign.
    Operand,
    /// The parenthesis behind the name of a function.
    Open,
    /// An operator, a closing parenthesis, or the end.
    Operator,
}

/// Inside one pair of parentheses.
#[derive(Clone, Default)]
struct Level {
    /// Where it was opened.
    place: Range<usize>,
    /// The function called, and how many commas are still to come.
    call: Option<(&'static str, usize)>,
    /// The function takes two arguments.
    two: bool,
    /// There is a power among the last factors.
    power: bool,
}

struct Reader<'t> {
    text: &'t str,
    names: &'t dyn Names,
    stacks: Stacks,
    open: Vec<Level>,
    /// The last word was a sign.
    sign: bool,
}

impl Reader<'_> {
    fn level(&mut self) -> Option<&mut Level> {
        self.open.last_mut()
    }

    fn push(&mut self, tree: Tree) -> Wanted {
        self.stacks.operand(tree);
        self.sign = false;
        Wanted::Operator
    }

    fn operand(
        &mut self,
        word: Word<'_>,
        place: &Range<usize>,
        called: bool,
    ) -> Result<Wanted, ExpressionError> {
        match word {
            Word::Number(x) => Ok(self.push(Tree::Number(x))),
            Word::Name(name) => self.name(name, place, called),
            Word::Open => {
                self.nest(place, None)?;
                Ok(Wanted::Operand)
            }
            Word::Operator('-' | '+') if self.sign => {
                let error = ExpressionError::at(place.clone(), "a second sign");
                Err(error.help("one of them is enough, or parentheses around the inner one"))
            }
            Word::Operator('-') => {
                self.stacks.sign();
                self.sign = true;
                Ok(Wanted::Operand)
            }
            Word::Operator('+') => {
                self.sign = true;
                Ok(Wanted::Operand)
            }
            Word::Operator(_) | Word::Close | Word::Comma => Err(ExpressionError::at(
                place.clone(),
                format!(
                    "a number or a name is missing before `{}`",
                    &self.text[place.clone()]
                ),
            )),
        }
    }

    fn name(
        &mut self,
        name: &str,
        place: &Range<usize>,
        called: bool,
    ) -> Result<Wanted, ExpressionError> {
        let known = constant(name)
            .map(|x| Ok(Tree::Number(x)))
            .or_else(|| self.names.find(name));
        if called {
            let entry = FUNCTIONS.iter().find(|(n, _)| *n == name);
            return match entry {
                Some((name, function)) => {
                    self.nest(place, Some((name, *function)))?;
                    Ok(Wanted::Open)
                }
                None if known.is_some() => {
                    let message = format!("`{name}` is no function");
                    let help = format!("a product is written `{name} * (…)`");
                    Err(ExpressionError::at(place.clone(), message).help(help))
                }
                None => Err(unknown(
                    &format!("unknown function `{name}`"),
                    name,
                    place,
                    FUNCTIONS.iter().map(|(n, _)| *n),
                )),
            };
        }
        match known {
            Some(Ok(tree)) => Ok(self.push(tree)),
            Some(Err(message)) => Err(ExpressionError::at(place.clone(), message)),
            None if function(name).is_some() => {
                let message = format!("the function `{name}` needs its argument in parentheses");
                Err(ExpressionError::at(place.clone(), message))
            }
            None => {
                let known = self.names.known();
                let constants = CONSTANTS.iter().map(|(n, _)| *n);
                let names = known.iter().map(String::as_str);
                Err(unknown(
                    &format!("unknown name `{name}`"),
                    name,
                    place,
                    names.chain(constants),
                ))
            }
        }
    }

    /// Opens a parenthesis, with the function it belongs to.
    fn nest(
        &mut self,
        place: &Range<usize>,
        call: Option<(&'static str, Function)>,
    ) -> Result<(), ExpressionError> {
        if self.open.len() > DEEPEST {
            let message = format!("more than {DEEPEST} parentheses within each other");
            return Err(ExpressionError::at(place.clone(), message));
        }
        let function = call.map(|(_, function)| function);
        self.stacks.open(function);
        let two = matches!(function, Some(Function::Two(_)));
        self.open.push(Level {
            place: place.clone(),
            call: call.map(|(name, _)| (name, usize::from(two))),
            two,
            power: false,
        });
        self.sign = false;
        Ok(())
    }

    fn operator(
        &mut self,
        word: Word<'_>,
        place: &Range<usize>,
    ) -> Result<Wanted, ExpressionError> {
        let wrong = |message: String| Err(ExpressionError::at(place.clone(), message));
        match word {
            Word::Operator(c) => {
                let Some(level) = self.level() else {
                    return Ok(Wanted::Operand);
                };
                if c == '^' && level.power {
                    let error = ExpressionError::at(place.clone(), "a power of a power");
                    return Err(
                        error.help("say with parentheses which is meant: `(a^b)^c` or `a^(b^c)`")
                    );
                }
                level.power = c == '^';
                self.stacks.operator(match c {
                    '+' => Binary::Add,
                    '-' => Binary::Subtract,
                    '*' => Binary::Multiply,
                    '/' => Binary::Divide,
                    _ => Binary::Power,
                });
                Ok(Wanted::Operand)
            }
            Word::Close => {
                if self.open.len() < 2 {
                    return wrong("this parenthesis was never opened".to_owned());
                }
                let Some(level) = self.open.pop() else {
                    return Ok(Wanted::Operator);
                };
                if let Some((name, 1)) = level.call {
                    return wrong(format!("`{name}` takes two arguments, found one"));
                }
                self.stacks.close();
                Ok(Wanted::Operator)
            }
            Word::Comma => {
                let Some(level) = self.level() else {
                    return Ok(Wanted::Operand);
                };
                level.power = false;
                match level.call {
                    Some((name, 1)) => {
                        level.call = Some((name, 0));
                        self.stacks.comma();
                        Ok(Wanted::Operand)
                    }
                    Some((name, _)) => {
                        let takes = if level.two {
                            "two arguments"
                        } else {
                            "one argument"
                        };
                        wrong(format!("`{name}` takes {takes}"))
                    }
                    None => wrong("a comma stands between the arguments of a function".to_owned()),
                }
            }
            Word::Number(_) | Word::Name(_) | Word::Open => wrong(format!(
                "an operator is missing before `{}`",
                &self.text[place.clone()]
            )),
        }
    }

    fn end(&self, wanted: Wanted) -> Result<(), ExpressionError> {
        let end = self.text.trim_end().len();
        let last = self.text[..end].char_indices().next_back();
        let place = last.map_or(0..0, |(i, _)| i..end);
        if wanted != Wanted::Operator {
            let message = if last.is_none() {
                "there is no expression"
            } else {
                "the expression ends where a number or a name is expected"
            };
            return Err(ExpressionError::at(place, message));
        }
        match self.open.last() {
            Some(level) if self.open.len() > 1 => {
                let message = "the parenthesis that begins here is never closed";
                Err(ExpressionError::at(level.place.clone(), message))
            }
            _ => Ok(()),
        }
    }
}

fn unknown<'n>(
    what: &str,
    name: &str,
    place: &Range<usize>,
    known: impl Iterator<Item = &'n str>,
) -> ExpressionError {
    let known: Vec<&str> = known.collect();
    let message = format!("{what}, expected one of {}", known.join(", "));
    let error = ExpressionError::at(place.clone(), message);
    match nearest(name, known) {
        Some(near) => error.help(format!("did you mean `{near}`?")),
        None => error,
    }
}
