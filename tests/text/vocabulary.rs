//! Language of the source and the documents: the field's terms, in lines of at most 100 columns.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Columns of documentation.
const COLUMNS: usize = 100;

/// Former compound identifiers, which only the changelog still has.
const FORMER_NAMES: &str = include_str!("former_names.txt");
/// Former phrases.
const FORMER_PHRASES: &[&str] = &[
    "energy books",
    "books close",
    "somebody",
    "nobody",
    "whoever",
    "everybody",
    "of one's own",
    "out of a scenario's words",
    "comes to its end",
    "came to its end",
    "is no number",
    "so to say",
    "looks on",
    "look on",
    "what must be closed",
    "tells of",
    "at hardware",
    "wanted is",
    "is had",
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Tracked text files with one of these extensions, with their contents.
pub fn sources(extensions: &[&str]) -> Vec<(String, String)> {
    let listed = Command::new("git")
        .args(["ls-files", "-z"])
        .current_dir(root())
        .output()
        .expect("git lists the files");
    let names = String::from_utf8(listed.stdout).expect("names are UTF-8");
    let wanted = |name: &&str| {
        let extension = Path::new(name).extension().and_then(|it| it.to_str());
        extension.is_some_and(|it| extensions.contains(&it))
    };
    let read = |name: &str| {
        let text = std::fs::read_to_string(root().join(name)).unwrap_or_default();
        (name.to_owned(), text)
    };
    names.split('\0').filter(wanted).map(read).collect()
}

/// Whether `text` has `phrase` as whole words.
pub fn has(text: &str, phrase: &str) -> bool {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(phrase).any(|(at, found)| {
        let before = text[..at].chars().next_back();
        let after = text[at + found.len()..].chars().next();
        !before.is_some_and(is_word) && !after.is_some_and(is_word)
    })
}

/// Splits a line into identifiers.
fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| !(c.is_alphanumeric() || c == '_'))
}

#[test]
fn former_terms_are_gone() {
    let own = ["tests/text/vocabulary.rs", "CHANGELOG.md"];
    let names: BTreeSet<&str> = FORMER_NAMES.lines().collect();
    let mut found = Vec::new();
    for (name, text) in sources(&["rs", "md", "toml", "sh", "py", "snap"]) {
        if own.contains(&name.as_str()) {
            continue;
        }
        for (number, line) in text.lines().enumerate() {
            let mut former: Vec<&str> = FORMER_PHRASES.to_vec();
            former.retain(|phrase| has(line, phrase));
            former.extend(words(line).filter(|word| names.contains(word)));
            found.extend(
                former
                    .iter()
                    .map(|it| format!("{name}:{}: {it}", number + 1)),
            );
        }
    }
    assert!(
        found.is_empty(),
        "{} former terms:\n{}",
        found.len(),
        found.join("\n")
    );
}

/// Lines of documentation: comments of Rust, prose of Markdown.
fn documentation(name: &str, text: &str) -> Vec<(usize, String)> {
    let is_rust = Path::new(name).extension().is_some_and(|it| it == "rs");
    let mut in_code = false;
    let mut lines = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let trimmed = line.trim_start();
        if !is_rust && trimmed.starts_with("```") {
            in_code = !in_code;
        }
        // Tables and links cannot be wrapped.
        let body = trimmed.trim_start_matches(['/', '!', ' ']);
        let fixed = in_code || body.starts_with('|') || body.starts_with('[');
        if (!is_rust || trimmed.starts_with("//")) && !fixed {
            lines.push((number + 1, line.to_owned()));
        }
    }
    lines
}

#[test]
fn documentation_wraps_at_100_columns() {
    let mut found = Vec::new();
    for (name, text) in sources(&["rs", "md"]) {
        let lines = documentation(&name, &text).into_iter();
        let long = lines.filter(|(_, line)| line.chars().count() > COLUMNS);
        found.extend(long.map(|(number, _)| format!("{name}:{number}")));
    }
    assert!(
        found.is_empty(),
        "{} long lines:\n{}",
        found.len(),
        found.join("\n")
    );
}

#[test]
fn whole_words_are_found_and_parts_of_words_are_not() {
    assert!(has("the energy books close", "books close"));
    assert!(!has("OnGridded", "OnGrid") && !has("a_nobody", "nobody"));
}
