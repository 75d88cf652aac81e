//! No ring of files: within a crate, files that need each other in a circle are at most three.
//!
//! A file needs another where its code, tests left out, names something of it: by `use`, or by a path
//! that begins with `crate`, `self`, `super` or a module of its own. A name that a third file passes on
//! (`pub use`) counts for the file that defines it, and passing on alone needs nothing.

#![allow(
    clippy::unwrap_used,
    reason = "sources that cannot be read are how this program fails"
)]

mod source;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use loopsight_tests::repository;
use source::Source;

/// A module by its path within the crate; the crate itself is the empty path.
type Module = Vec<String>;

/// Files of each crate, and the most of them that may need each other in a circle.
const MOST: [(&str, usize); 3] = [("core", 3), ("model", 3), ("diagnosis", 3)];

/// The sources of a crate by module, without those that are compiled for tests only.
fn sources(folder: &Path) -> BTreeMap<Module, Source> {
    let mut found = BTreeMap::new();
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(&next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let inside = path.strip_prefix(folder).unwrap().with_extension("");
                let mut module: Module = inside
                    .iter()
                    .map(|part| part.to_string_lossy().into_owned())
                    .collect();
                if module.last().is_some_and(|m| m == "mod" || m == "lib") {
                    module.pop();
                }
                found.insert(module, Source::read(&path));
            }
        }
    }
    let below = |module: &[String], name: &String| [module, std::slice::from_ref(name)].concat();
    let for_tests: Vec<Module> = found
        .iter()
        .flat_map(|(module, s)| s.for_tests.iter().map(|name| below(module, name)))
        .collect();
    found.retain(|module, _| !for_tests.iter().any(|t| module.starts_with(t)));
    found
}

/// What the path, as it stands in `module`, is from the root of the crate; `None` for a path into
/// another crate.
fn absolute(module: &Module, source: &Source, path: &[String]) -> Option<Module> {
    let mut base = match path.first()?.as_str() {
        "crate" => return Some(path[1..].to_vec()),
        "self" | "super" => module.clone(),
        first if source.modules.contains(first) => module.clone(),
        _ => return None,
    };
    let mut rest = path;
    while let Some((first, after)) = rest.split_first() {
        match first.as_str() {
            "self" => {}
            "super" => drop(base.pop()),
            _ => break,
        }
        rest = after;
    }
    base.extend_from_slice(rest);
    Some(base)
}

/// The file that defines what `path` names, found through what other files pass on.
fn defines(path: &[String], sources: &BTreeMap<Module, Source>, depth: usize) -> Option<Module> {
    let path = match path.split_last() {
        Some((last, before)) if last == "self" => before,
        _ => path,
    };
    let module = (0..=path.len())
        .rev()
        .map(|n| path[..n].to_vec())
        .find(|m| sources.contains_key(m))?;
    let source = &sources[&module];
    let passed = path.get(module.len()).and_then(|name| {
        let passes = source.uses.iter().filter(|u| u.public);
        passes.into_iter().find(|u| u.name() == Some(name))
    });
    if let (Some(passed), true) = (passed, depth < 8)
        && let Some(mut to) = absolute(&module, source, &passed.path)
        && to != path
    {
        to.extend_from_slice(&path[module.len() + 1..]);
        return defines(&to, sources, depth + 1);
    }
    Some(module)
}

/// The files that each file needs.
fn needs(sources: &BTreeMap<Module, Source>) -> BTreeMap<Module, BTreeSet<Module>> {
    let of = |module: &Module, source: &Source| {
        let used = source.uses.iter().filter(|u| {
            let named = |name: &String| source.words.contains(name);
            !u.public || u.name().is_some_and(named)
        });
        let paths = used.map(|u| &u.path).chain(&source.paths);
        let paths = paths.filter_map(|path| absolute(module, source, path));
        let files = paths.filter_map(|path| defines(&path, sources, 0));
        files.filter(|file| file != module).collect()
    };
    let all = sources.iter();
    all.map(|(module, source)| (module.clone(), of(module, source)))
        .collect()
}

/// Everything that can be reached from `from` along `needs`.
fn reached(from: &Module, needs: &BTreeMap<Module, BTreeSet<Module>>) -> BTreeSet<Module> {
    let mut reached = BTreeSet::new();
    let mut open: Vec<&Module> = needs[from].iter().collect();
    while let Some(next) = open.pop() {
        if reached.insert(next.clone()) {
            open.extend(&needs[next]);
        }
    }
    reached
}

/// The rings of files that need each other in a circle, the largest first.
fn rings(needs: &BTreeMap<Module, BTreeSet<Module>>) -> Vec<BTreeSet<Module>> {
    let reach: BTreeMap<&Module, BTreeSet<Module>> =
        needs.keys().map(|m| (m, reached(m, needs))).collect();
    let mut rings: BTreeSet<BTreeSet<Module>> = BTreeSet::new();
    for (module, others) in &reach {
        if others.contains(*module) {
            let back = others.iter().filter(|other| reach[other].contains(*module));
            rings.insert(back.cloned().collect());
        }
    }
    let mut rings: Vec<_> = rings.into_iter().collect();
    rings.sort_by_key(|ring| std::cmp::Reverse(ring.len()));
    rings
}

#[test]
fn no_ring_of_files_is_large() {
    let mut large = String::new();
    for (room, most) in MOST {
        let sources = sources(&repository().join(room).join("src"));
        let needs = needs(&sources);
        let arrows: usize = needs.values().map(BTreeSet::len).sum();
        assert!(arrows > sources.len(), "{room}: {arrows} arrows");
        for ring in rings(&needs).iter().filter(|ring| ring.len() > most) {
            large.push_str(&format!("{room}: {} files, at most {most}\n", ring.len()));
            for from in ring {
                for to in needs[from].intersection(ring) {
                    large.push_str(&format!("  {} -> {}\n", from.join("::"), to.join("::")));
                }
            }
        }
    }
    assert!(large.is_empty(), "files that need each other:\n{large}");
}

#[test]
fn a_ring_is_found() {
    let sources: BTreeMap<Module, Source> = [
        ("", "mod a; mod b; mod c; pub use c::C;"),
        ("a", "use crate::b::B; struct A(B); #[cfg(test)] mod tests { use crate::C; }"),
        ("b", "pub use crate::C; pub struct B(super::C);"),
        ("c", "// crate::b\npub struct C; const X: &str = \"crate::b::B\"; fn f(_: &'static crate::a::A) {}"),
    ]
    .into_iter()
    .map(|(name, text)| {
        let module = name.split_whitespace().map(str::to_owned).collect();
        (module, Source::of(text))
    })
    .collect();
    let of = |name: &str| vec![name.to_owned()];
    let needs = needs(&sources);
    assert_eq!(needs[&of("a")], BTreeSet::from([of("b")]));
    assert_eq!(needs[&of("b")], BTreeSet::from([of("c")]));
    assert_eq!(needs[&of("c")], BTreeSet::from([of("a")]));
    assert_eq!(needs[&Vec::new()], BTreeSet::new());
    let ring = BTreeSet::from([of("a"), of("b"), of("c")]);
    assert_eq!(rings(&needs), vec![ring]);
}
