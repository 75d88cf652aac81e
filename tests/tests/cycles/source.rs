//! What a Rust file names, read as far as that needs.

use std::collections::BTreeSet;
use std::path::Path;

/// One name that a `use` brings in.
pub(crate) struct Use {
    /// `pub`, or visible in part of the crate.
    pub(crate) public: bool,
    /// As written.
    pub(crate) path: Vec<String>,
    alias: Option<String>,
}

impl Use {
    /// The name that it brings in.
    pub(crate) fn name(&self) -> Option<&String> {
        let of_module = self.path.last().is_some_and(|last| last == "self");
        let last = self.path.iter().rev().nth(usize::from(of_module));
        self.alias.as_ref().or(last)
    }
}

/// What a file says, its tests left out.
#[derive(Default)]
pub(crate) struct Source {
    /// Modules that it declares.
    pub(crate) modules: BTreeSet<String>,
    /// Modules that it declares for tests only.
    pub(crate) for_tests: Vec<String>,
    pub(crate) uses: Vec<Use>,
    /// Paths outside of `use`.
    pub(crate) paths: Vec<Vec<String>>,
    /// Every name outside of `use` and `mod`.
    pub(crate) words: BTreeSet<String>,
}

impl Source {
    pub(crate) fn read(path: &Path) -> Self {
        Self::of(&std::fs::read_to_string(path).unwrap())
    }

    pub(crate) fn of(text: &str) -> Self {
        let words = words(text);
        let mut source = Self::default();
        let (mut at, mut public) = (0, false);
        while at < words.len() {
            let word = words[at].as_str();
            if words[at..].starts_with(&["#", "[", "cfg", "(", "test", ")", "]"].map(String::from))
            {
                at = source.passes_over(&words, at + 7);
                continue;
            }
            match word {
                "mod" => {
                    source.modules.insert(words[at + 1].clone());
                    at += 1;
                }
                "use" => {
                    let end = at + position(&words[at..], ";");
                    source.brings(&words[at + 1..end], &[], public);
                    at = end;
                }
                "pub" => {
                    if words[at + 1] == "(" {
                        at += position(&words[at..], ")");
                    }
                    at += 1;
                    public = true;
                    continue;
                }
                _ if is_name(word) => {
                    let mut path = vec![word.to_owned()];
                    while words.get(at + 1).is_some_and(|w| w == "::")
                        && words.get(at + 2).is_some_and(|w| is_name(w))
                    {
                        at += 2;
                        path.push(words[at].clone());
                    }
                    source.words.extend(path.iter().cloned());
                    if path.len() > 1 {
                        source.paths.push(path);
                    }
                }
                _ => {}
            }
            (at, public) = (at + 1, false);
        }
        source
    }

    /// Passes over an item that is compiled for tests only, from behind its `cfg(test)`; returns where
    /// the next one begins.
    fn passes_over(&mut self, words: &[String], mut at: usize) -> usize {
        while words.get(at).is_some_and(|w| w == "#") {
            at += position(&words[at..], "]") + 1;
        }
        let item = &words[at..];
        let (end, body) = (position(item, ";"), position(item, "{"));
        if body < end {
            return behind_braces(words, at);
        }
        if let Some(of) = item[..end].iter().position(|w| w == "mod") {
            self.for_tests.push(item[of + 1].clone());
        }
        at + end + 1
    }

    /// Takes in the tree of a `use` below `before`.
    fn brings(&mut self, tree: &[String], before: &[String], public: bool) {
        if let Some(open) = tree.iter().position(|w| w == "{") {
            let names = tree[..open].iter().filter(|w| is_name(w)).cloned();
            let before: Vec<String> = before.iter().cloned().chain(names).collect();
            let (mut depth, mut start) = (0, open + 1);
            for (i, word) in tree.iter().enumerate().skip(open + 1) {
                match word.as_str() {
                    "{" => depth += 1,
                    "}" if depth > 0 => depth -= 1,
                    "," | "}" if depth == 0 => {
                        if start < i {
                            self.brings(&tree[start..i], &before, public);
                        }
                        start = i + 1;
                    }
                    _ => {}
                }
            }
            return;
        }
        let names = |words: &[String]| -> Vec<String> {
            words.iter().filter(|w| is_name(w)).cloned().collect()
        };
        let renamed = tree.iter().position(|w| w == "as");
        let path = names(&tree[..renamed.unwrap_or(tree.len())]);
        self.uses.push(Use {
            public,
            path: before.iter().cloned().chain(path).collect(),
            alias: renamed.and_then(|at| tree.get(at + 1).cloned()),
        });
    }
}

fn is_name(word: &str) -> bool {
    word.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// The first place of a word; the end where it is not there.
fn position(words: &[String], word: &str) -> usize {
    let found = words.iter().position(|w| w == word);
    found.unwrap_or(words.len())
}

/// The place behind the brace that closes the first one from `at` on.
fn behind_braces(words: &[String], at: usize) -> usize {
    let mut depth = 0;
    for (i, word) in words.iter().enumerate().skip(at) {
        match word.as_str() {
            "{" => depth += 1,
            "}" if depth == 1 => return i + 1,
            "}" => depth -= 1,
            _ => {}
        }
    }
    words.len()
}

/// Names and signs of a text, without comments, texts, characters and lifetimes.
fn words(text: &str) -> Vec<String> {
    let text: Vec<char> = text.chars().collect();
    let find = |from: usize, sign: &str| -> usize {
        let sign: Vec<char> = sign.chars().collect();
        let at = text[from..].windows(sign.len()).position(|w| w == sign);
        at.map_or(text.len(), |at| from + at + sign.len())
    };
    let mut words = Vec::new();
    let mut at = 0;
    while at < text.len() {
        let (c, next) = (text[at], text.get(at + 1).copied().unwrap_or(' '));
        if c == '/' && next == '/' {
            at = find(at, "\n");
        } else if c == '/' && next == '*' {
            at = find(at, "*/");
        } else if c == 'r' && (next == '"' || next == '#') && !next.is_alphanumeric() {
            let hashes = text[at + 1..].iter().take_while(|c| **c == '#').count();
            if text.get(at + 1 + hashes) == Some(&'"') {
                at = find(at + 2 + hashes, &format!("\"{}", "#".repeat(hashes)));
            } else {
                at += 1 + hashes;
            }
        } else if c == '"' {
            at += 1;
            while at < text.len() && text[at] != '"' {
                at += if text[at] == '\\' { 2 } else { 1 };
            }
            at += 1;
        } else if c == '\'' {
            at = if next == '\\' {
                find(at + 3, "'")
            } else if text.get(at + 2) == Some(&'\'') {
                at + 3
            } else {
                // A lifetime: its name is no name of the file's.
                let name = text[at + 1..].iter();
                at + 1
                    + name
                        .take_while(|c| c.is_alphanumeric() || **c == '_')
                        .count()
            };
        } else if c.is_alphanumeric() || c == '_' {
            let end = text[at..]
                .iter()
                .position(|c| !c.is_alphanumeric() && *c != '_');
            let end = end.map_or(text.len(), |end| at + end);
            words.push(text[at..end].iter().collect());
            at = end;
        } else if c == ':' && next == ':' {
            words.push("::".to_owned());
            at += 2;
        } else {
            if !c.is_whitespace() {
                words.push(c.to_string());
            }
            at += 1;
        }
    }
    words
}
