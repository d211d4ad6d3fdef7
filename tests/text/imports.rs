//! Imports between the source files of a crate, each followed through re-exports to the file that
//! defines the imported item. Read from the text: modules and `use` trees are resolved as the
//! compiler does, items of macros are not seen. Tests and comments are left out.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Files of a crate, its modules, with the imports between them.
pub struct Imports {
    /// Paths relative to the folder of sources.
    pub files: Vec<PathBuf>,
    /// Pairs of importing and imported file.
    pub arrows: BTreeSet<(usize, usize)>,
}

/// A module that has a file.
struct Module {
    file: PathBuf,
    parent: Option<usize>,
    children: BTreeMap<String, usize>,
    /// Imported names with their paths, as written.
    names: BTreeMap<String, Vec<String>>,
    /// Paths of `use …::*`.
    globs: Vec<Vec<String>>,
    /// Paths of imports that are not re-exports, and of expressions.
    used: Vec<Vec<String>>,
}

/// Item that a path names.
#[derive(Clone, Copy, PartialEq)]
enum Target {
    Module(usize),
    /// An item that this module defines.
    Item(usize),
}

impl Imports {
    /// Reads the crate whose root is `lib.rs` or `main.rs` in `folder`.
    pub fn read(folder: &Path) -> Self {
        let root = ["lib.rs", "main.rs"].map(|name| folder.join(name));
        let root = root.iter().find(|path| path.exists()).unwrap();
        let mut modules = Vec::new();
        read_module(&mut modules, root, folder, None);
        let mut arrows = BTreeSet::new();
        for (from, module) in modules.iter().enumerate() {
            for path in &module.used {
                match resolve(&modules, from, path, 0) {
                    Some(Target::Module(to) | Target::Item(to)) if to != from => {
                        arrows.insert((from, to));
                    }
                    _ => (),
                }
            }
        }
        let relative = |module: &Module| module.file.strip_prefix(folder).unwrap().to_owned();
        let files = modules.iter().map(relative).collect();
        Self { files, arrows }
    }

    /// Returns the circles of files: sets of two or more that reach each other.
    pub fn circles_of_files(&self) -> Vec<Vec<String>> {
        let name = |index: usize| self.files[index].display().to_string();
        let arrows = self.arrows.iter();
        circles(arrows.map(|&(from, to)| (name(from), name(to))))
    }

    /// Returns the circles of rooms: files and folders beside the root of the crate.
    pub fn circles_of_rooms(&self) -> Vec<Vec<String>> {
        circles(self.arrows_of_rooms())
    }

    /// Returns the imports between files and folders beside the root of the crate, which imports
    /// all of them.
    pub fn arrows_of_rooms(&self) -> impl Iterator<Item = (String, String)> {
        let room = |index: usize| {
            let first = self.files[index].iter().next().unwrap();
            Path::new(first)
                .file_stem()
                .unwrap()
                .to_str()
                .unwrap()
                .to_owned()
        };
        let rooms = self
            .arrows
            .iter()
            .map(move |&(from, to)| (room(from), room(to)));
        rooms.filter(|(from, to)| from != to && from != "lib" && from != "main")
    }
}

/// Returns the sets of two or more nodes of a graph that reach each other.
fn circles(arrows: impl Iterator<Item = (String, String)>) -> Vec<Vec<String>> {
    let mut next = BTreeMap::<String, BTreeSet<String>>::new();
    for (from, to) in arrows {
        next.entry(from).or_default().insert(to);
    }
    let mut reached = BTreeMap::<&String, BTreeSet<&String>>::new();
    for from in next.keys() {
        let found = reached.entry(from).or_default();
        let mut left = vec![from];
        while let Some(node) = left.pop() {
            let after = next.get(node).into_iter().flatten();
            left.extend(after.filter(|to| found.insert(to)));
        }
    }
    let circle = |(node, nodes): (&&String, &BTreeSet<&String>)| -> Vec<String> {
        let back = |other: &&&String| reached.get(**other).is_some_and(|it| it.contains(*node));
        nodes.iter().filter(back).map(|it| (*it).clone()).collect()
    };
    let circles: BTreeSet<Vec<String>> = reached.iter().map(circle).collect();
    circles
        .into_iter()
        .filter(|nodes| nodes.len() > 1)
        .collect()
}

/// Reads a module and its children; returns its index.
fn read_module(
    modules: &mut Vec<Module>,
    file: &Path,
    below: &Path,
    parent: Option<usize>,
) -> usize {
    let tokens = tokens(&std::fs::read_to_string(file).unwrap());
    let index = modules.len();
    modules.push(Module {
        file: file.to_owned(),
        parent,
        children: BTreeMap::new(),
        names: BTreeMap::new(),
        globs: Vec::new(),
        used: Vec::new(),
    });
    let mut at = 0;
    while at < tokens.len() {
        let is_public = at > 0 && ["pub", ")"].contains(&&*tokens[at - 1]);
        match &*tokens[at] {
            "mod" if tokens[at + 2] == ";" => {
                let name = tokens[at + 1].clone();
                let inside = below.join(&name);
                let alone = below.join(format!("{name}.rs"));
                let file = if alone.exists() {
                    alone
                } else {
                    inside.join("mod.rs")
                };
                if file.exists() {
                    let child = read_module(modules, &file, &inside, Some(index));
                    modules[index].children.insert(name, child);
                }
                at += 3;
            }
            "use" => {
                at += 1;
                read_use(&mut modules[index], &tokens, &mut at, &[], is_public);
            }
            word if is_name(word) => {
                let mut path = vec![word.to_owned()];
                while tokens.get(at + 1).is_some_and(|it| it == "::")
                    && tokens.get(at + 2).is_some_and(|it| is_name(it))
                {
                    at += 2;
                    path.push(tokens[at].clone());
                }
                if path.len() > 1 {
                    modules[index].used.push(path);
                }
                at += 1;
            }
            _ => at += 1,
        }
    }
    index
}

/// Reads a tree of imports up to its end, with the path `before` it.
fn read_use(
    module: &mut Module,
    tokens: &[String],
    at: &mut usize,
    before: &[String],
    is_public: bool,
) {
    let mut path = before.to_vec();
    loop {
        let token = &*tokens[*at];
        *at += 1;
        match token {
            "::" => (),
            "{" => {
                while tokens[*at] != "}" {
                    read_use(module, tokens, at, &path, is_public);
                    *at += usize::from(tokens[*at] == ",");
                }
                *at += 1;
                return;
            }
            "*" => {
                module.globs.push(path.clone());
                if !is_public {
                    module.used.push(path);
                }
                return;
            }
            name => {
                // `{self, …}` imports the path itself.
                if name != "self" || path.is_empty() {
                    path.push(name.to_owned());
                }
                let mut alias = path.last().unwrap().clone();
                if tokens[*at] == "as" {
                    alias.clone_from(&tokens[*at + 1]);
                    *at += 2;
                }
                if tokens[*at] != "::" {
                    if !is_public {
                        module.used.push(path.clone());
                    }
                    module.names.insert(alias, path);
                    return;
                }
            }
        }
    }
}

/// Returns what a path in a module names; none for another crate.
fn resolve(modules: &[Module], from: usize, path: &[String], depth: usize) -> Option<Target> {
    // Two modules may import all of each other.
    if depth > 9 {
        return None;
    }
    let module = &modules[from];
    let (first, rest) = path.split_first()?;
    let start = match &**first {
        "crate" => 0,
        "self" => from,
        "super" => module.parent?,
        name => {
            if let Some(&child) = module.children.get(name) {
                child
            } else {
                let named = module.names.get(name)?;
                // A name that stands for itself is that of another crate.
                let same = named.first() == Some(first);
                match resolve(modules, from, named, depth + 1 + usize::from(same) * 9)? {
                    Target::Module(index) => index,
                    item @ Target::Item(_) => return Some(item),
                }
            }
        }
    };
    descend(modules, start, rest, depth)
}

/// Returns what the rest of a path names within a module.
fn descend(modules: &[Module], from: usize, path: &[String], depth: usize) -> Option<Target> {
    let Some((name, rest)) = path.split_first() else {
        return Some(Target::Module(from));
    };
    let module = &modules[from];
    if name == "super" {
        return descend(modules, module.parent?, rest, depth);
    }
    if let Some(&child) = module.children.get(name) {
        return descend(modules, child, rest, depth);
    }
    if let Some(named) = module.names.get(name) {
        return match resolve(modules, from, named, depth + 1)? {
            Target::Module(index) => descend(modules, index, rest, depth),
            item @ Target::Item(_) => Some(item),
        };
    }
    let globs = module.globs.iter();
    let mut found = globs.filter_map(|glob| match resolve(modules, from, glob, depth + 1)? {
        Target::Module(index) if index != from => {
            let found = descend(modules, index, path, depth + 1)?;
            // Whether it defines the name is not known: only what it passes on is taken.
            (found != Target::Item(index)).then_some(found)
        }
        _ => None,
    });
    Some(found.next().unwrap_or(Target::Item(from)))
}

fn is_name(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Returns names and marks of a source without comments, literals and items under `cfg(test)`.
fn tokens(source: &str) -> Vec<String> {
    let all = lexed(source);
    let mut kept = Vec::new();
    let mut at = 0;
    while at < all.len() {
        let is_test = all[at..]
            .iter()
            .take(6)
            .map(String::as_str)
            .eq(["#", "[", "cfg", "(", "test", ")"]);
        if !is_test {
            kept.push(all[at].clone());
            at += 1;
            continue;
        }
        // The item ends with a semicolon or a block, whichever is first.
        let mut depth = 0;
        at += 7;
        while let Some(token) = all.get(at) {
            at += 1;
            match &**token {
                "{" => depth += 1,
                "}" if depth == 1 => break,
                "}" => depth -= 1,
                ";" if depth == 0 => break,
                _ => (),
            }
        }
    }
    kept
}

/// Returns names, `::` and single marks of a source without comments and literals.
fn lexed(source: &str) -> Vec<String> {
    let chars: Vec<char> = source.chars().collect();
    let mut found = Vec::new();
    let mut at = 0;
    let starts = |at: usize, text: &str| {
        text.chars()
            .enumerate()
            .all(|(i, c)| chars.get(at + i) == Some(&c))
    };
    while at < chars.len() {
        let c = chars[at];
        if starts(at, "//") {
            while at < chars.len() && chars[at] != '\n' {
                at += 1;
            }
        } else if starts(at, "/*") {
            while at < chars.len() && !starts(at, "*/") {
                at += 1;
            }
            at += 2;
        } else if c == '"' {
            at += 1;
            while at < chars.len() && chars[at] != '"' {
                at += 1 + usize::from(chars[at] == '\\');
            }
            at += 1;
        } else if c == 'r' && (starts(at, "r\"") || starts(at, "r#")) {
            let marks = chars[at + 1..].iter().take_while(|c| **c == '#').count();
            let end = format!("\"{}", "#".repeat(marks));
            at += marks + 2;
            while at < chars.len() && !starts(at, &end) {
                at += 1;
            }
            at += end.len();
        } else if c == '\'' {
            // A character, or the mark of a lifetime.
            let length = if chars.get(at + 1) == Some(&'\\') {
                chars[at + 3..]
                    .iter()
                    .position(|c| *c == '\'')
                    .map(|it| it + 4)
            } else {
                (chars.get(at + 2) == Some(&'\'')).then_some(3)
            };
            at += length.unwrap_or(1);
        } else if c.is_alphabetic() || c == '_' {
            let name: String = chars[at..]
                .iter()
                .take_while(|c| c.is_alphanumeric() || **c == '_')
                .collect();
            at += name.chars().count();
            found.push(name);
        } else if starts(at, "::") {
            found.push("::".to_owned());
            at += 2;
        } else {
            if !c.is_whitespace() {
                found.push(c.to_string());
            }
            at += 1;
        }
    }
    found
}
