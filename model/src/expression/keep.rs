//! Declarations that live as long as the program.
//!
//! Declarations are `&'static`, since nearly all of them are constants. Those of a model file are never freed. The
//! same text read again is the same declaration, so there is only one of each.

use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;
use std::sync::{Mutex, PoisonError};

use loopsight_core::Reads;

/// Things kept for ever, by their text.
pub(crate) struct Kept<T: 'static>(Mutex<BTreeMap<String, &'static T>>);

impl<T> Kept<T> {
    pub(crate) const fn new() -> Self {
        Self(Mutex::new(BTreeMap::new()))
    }

    /// What was made of `text` before, or what `make` makes of it now.
    pub(crate) fn get<E>(
        &self,
        text: String,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<&'static T, E> {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = known.get(&text) {
            return Ok(found);
        }
        let new: &'static T = Box::leak(Box::new(make()?));
        known.insert(text, new);
        Ok(new)
    }
}

/// What a channel reads, for ever; kept once.
pub(crate) fn reads(reads: &[Reads]) -> &'static [Reads] {
    static KNOWN: Kept<Vec<Reads>> = Kept::new();
    let found = KNOWN.get(format!("{reads:?}"), || Ok::<_, Infallible>(reads.to_vec()));
    match found {
        Ok(found) => found,
        Err(never) => match never {},
    }
}

/// A text that lives for ever; kept once.
pub(crate) fn text(text: &str) -> &'static str {
    static KNOWN: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(found) = known.get(text) {
        return found;
    }
    let new: &'static str = Box::leak(text.to_owned().into_boxed_str());
    known.insert(new);
    new
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_text_is_kept_once() {
        static NUMBERS: Kept<usize> = Kept::new();
        let get = |key: &str, n| NUMBERS.get(key.to_owned(), || Ok::<_, ()>(n));
        let first = get("a", 1).unwrap();
        assert!(std::ptr::eq(first, get("a", 2).unwrap()));
        assert_eq!(get("b", 2), Ok(&2));
        assert_eq!(NUMBERS.get("c".to_owned(), || Err("no")), Err("no"));
        assert!(std::ptr::eq(text("word"), text("word")));
    }
}
