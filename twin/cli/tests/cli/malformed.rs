//! Table of malformed inputs, `malformed/*.toml`: the messages name the mistake and its line.
//!
//! Each list of a file has the name of the base file that its rows edit: `trot`, `robot` (checked
//! as the robot of trot), `sweep` or `space`. A row is a name, a text of the base file (empty: the
//! end), the text in its place, and the words of the message. Rows of `whole` have a whole file,
//! rows of `command` the words of a command line, in place of the edit.
//!
//! A message must point to a line of the edit, or to the line that contains the words after `@`. Of
//! the other words `valid` is for an input that is none, `one` for one problem only. `{text*N}` is
//! the text N times, with `#N` for the number of the copy.

mod remedies;

use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;
use std::ops::RangeInclusive;
use std::path::Path;

use regex_lite::{Captures, Regex};

use super::common::{Done, Folder, twin};

const TROT: &str = include_str!("../../../../scenarios/trot.toml");
const ROBOT: &str = include_str!("../../../../plants/robot/tests/plain.toml");
const STAIRS: &str = include_str!("../../../../scenarios/step-down.toml");
const SWEEP: &str = include_str!("../../../../scenarios/sweeps/step-down.toml");
const SPACE: &str = include_str!("../../../../scenarios/optimizations/trot.toml");

/// Longest problem of a message \[lines\], and its longest line \[characters\].
const LINES_MOST: usize = 14;
const COLUMNS_MOST: usize = 300;

/// Kinds of inputs.
const KINDS: [(&str, &str); 8] = [
    ("units", include_str!("malformed/units.toml")),
    ("range", include_str!("malformed/range.toml")),
    ("structure", include_str!("malformed/structure.toml")),
    ("references", include_str!("malformed/references.toml")),
    ("encoding", include_str!("malformed/encoding.toml")),
    ("sizes", include_str!("malformed/sizes.toml")),
    ("commands", include_str!("malformed/commands.toml")),
    (FRESH_EYE, include_str!("malformed/fresh-eye.toml")),
];

/// Inputs of all kinds, by someone who had not seen the program.
const FRESH_EYE: &str = "fresh eye";

struct Row {
    base: String,
    name: String,
    /// Edited text and its replacement; the text is absent for whole files and command lines.
    old: Option<String>,
    new: String,
    says: Vec<String>,
}

fn rows(table: &str) -> Vec<Row> {
    let table: toml_edit::DocumentMut = table.parse().unwrap();
    let mut rows = Vec::new();
    for (base, list) in table.iter() {
        for row in list.as_array().unwrap() {
            let words = row.as_array().unwrap().iter();
            let mut words = words.map(|word| word.as_str().unwrap().to_owned());
            let name = words.next().unwrap();
            let is_edit = !matches!(base, "whole" | "command");
            rows.push(Row {
                base: base.to_owned(),
                name,
                old: is_edit.then(|| words.next().unwrap()),
                new: words.next().unwrap(),
                says: words.collect(),
            });
        }
    }
    rows
}

/// Converts the escapes `\u{1b}`, `\xff`, `\0`, `\n`, `\r`, `\t` and `\\` to bytes.
fn unescaped(text: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        rest = &rest[c.len_utf8()..];
        if c != '\\' {
            bytes.extend(c.to_string().bytes());
            continue;
        }
        let (escape, after) = rest.split_at(1);
        rest = after;
        match escape {
            "u" => {
                let (code, after) = rest[1..].split_once('}').unwrap();
                let c = char::from_u32(u32::from_str_radix(code, 16).unwrap()).unwrap();
                bytes.extend(c.to_string().bytes());
                rest = after;
            }
            "x" => {
                bytes.push(u8::from_str_radix(&rest[..2], 16).unwrap());
                rest = &rest[2..];
            }
            "0" => bytes.push(0),
            "n" => bytes.push(b'\n'),
            "r" => bytes.push(b'\r'),
            "t" => bytes.push(b'\t'),
            other => bytes.extend(other.bytes()),
        }
    }
    bytes
}

/// Writes out `{text*N}`.
fn repeated(text: &str) -> String {
    let pattern = Regex::new(r"(?s)\{((?:[^*]|\*\D)+?)\*(\d+)\}").unwrap();
    let copies = |captures: &Captures<'_>| {
        let count: usize = captures[2].parse().unwrap();
        let copy = |number: usize| captures[1].replace("#N", &number.to_string());
        (0..count).map(copy).collect::<String>()
    };
    pattern.replace_all(text, copies).into_owned()
}

/// Files of a row.
struct Files {
    folder: Folder,
}

impl Files {
    const NAMES: [(&str, &str, &str); 5] = [
        ("stairs", "stairs.toml", STAIRS),
        ("trot", "trot.toml", TROT),
        ("robot", "robots/mine.toml", ROBOT),
        ("sweep", "sweep.toml", SWEEP),
        ("space", "space.toml", SPACE),
    ];

    /// Makes a folder with this name, which no other test has.
    fn new(name: &str) -> Self {
        let folder = Folder::new(name);
        fs::create_dir_all(folder.join("robots")).unwrap();
        fs::create_dir_all(folder.join("dir")).unwrap();
        Self { folder }
    }

    fn path(&self, base: &str) -> String {
        let name = Self::NAMES.iter().find(|(known, ..)| *known == base);
        self.folder.join(name.map_or(base, |(_, file, _)| *file))
    }

    /// Writes the files of a row; returns the edited lines.
    fn write(&self, row: &Row, kind: &str) -> Option<RangeInclusive<usize>> {
        for (_, file, text) in Self::NAMES {
            fs::write(self.folder.join(file), text).unwrap();
        }
        let new = match kind {
            "encoding" => unescaped(&row.new),
            "sizes" => repeated(&row.new).into_bytes(),
            _ => row.new.clone().into_bytes(),
        };
        let Some(old) = &row.old else {
            if row.base == "whole" {
                fs::write(self.path("trot"), new).unwrap();
            }
            return None;
        };
        let (_, _, base) = Self::NAMES.iter().find(|(base, ..)| *base == row.base)?;
        let mut text = (*base).to_owned();
        let at = if old.is_empty() {
            text.push('\n');
            text.len()
        } else {
            let at = text.find(old.as_str());
            at.unwrap_or_else(|| panic!("{}: the base file has no {old}", row.name))
        };
        let first = text[..at].matches('\n').count() + 1;
        let last = first + new.split(|byte| *byte == b'\n').count() - 1;
        let after = text.split_off(at).split_off(old.len());
        let bytes = [text.as_bytes(), &new, after.as_bytes()].concat();
        fs::write(self.path(&row.base), bytes).unwrap();
        Some(first..=last)
    }

    fn execute(&self, row: &Row) -> Done {
        let line = match row.base.as_str() {
            "trot" | "whole" => "check {trot}",
            "robot" => "check {trot} --set robot=mine",
            // The points of a sweep that is accepted are few.
            "sweep" => "sweep {stairs} {sweep} --out {dir}/o --partition 1/64",
            "space" => "optimize {trot} --space {space} --out {dir}/o",
            _ => &row.new,
        };
        // A blank inside of a word is written `\s`.
        let mut words: Vec<_> = line.split(' ').map(|w| w.replace(r"\s", " ")).collect();
        for word in &mut words {
            for base in ["trot", "robot", "stairs", "sweep", "space", "dir"] {
                *word = word.replace(&format!("{{{base}}}"), &self.path(base));
            }
        }
        twin(&words.iter().map(String::as_str).collect::<Vec<_>>())
    }
}

/// Returns what is wrong with the message of a row.
fn mistakes(
    row: &Row,
    lines: Option<RangeInclusive<usize>>,
    done: &Done,
    file: &Path,
) -> Vec<String> {
    let mut wrong = Vec::new();
    if row.says.iter().any(|word| word == "valid") {
        if done.code != 0 {
            wrong.push(format!("code {}", done.code));
        }
        return wrong;
    }
    if done.code != 2 {
        wrong.push(format!("code {}", done.code));
    }
    let message = format!("{}{}", done.err, done.out);
    let place = Regex::new(r"--> \S+?\.toml:(\d+):").unwrap();
    let placed = |captures: Captures<'_>| captures[1].parse::<usize>().unwrap();
    let places: Vec<usize> = place.captures_iter(&message).map(placed).collect();
    let text = String::from_utf8_lossy(&fs::read(file).unwrap()).into_owned();
    let line_text = |line: &usize| text.lines().nth(line - 1).unwrap_or_default();
    let mut is_elsewhere = false;
    for word in &row.says {
        if word == "one" {
            let count = message.matches("error: ").count();
            (count != 1).then(|| wrong.push(format!("{count} problems")));
        } else if let Some(words) = word.strip_prefix('@') {
            is_elsewhere = true;
            if !places.iter().any(|line| line_text(line).contains(words)) {
                wrong.push(format!("points to lines {places:?}, not to `{words}`"));
            }
        } else if !message.contains(word.as_str()) {
            wrong.push(format!("lacks `{word}`"));
        }
    }
    if let Some(lines) = lines.filter(|_| !is_elsewhere)
        && !places.iter().any(|line| lines.contains(line))
    {
        wrong.push(format!("points to lines {places:?}, not to {lines:?}"));
    }
    let longest = message
        .split("\n\n")
        .map(|problem| problem.lines().count())
        .max();
    if longest > Some(LINES_MOST) {
        wrong.push(format!("a problem of {longest:?} lines"));
    }
    let widest = message
        .lines()
        .filter(|line| !line.contains("-->") && !line.contains(" | "));
    if let Some(widest) = widest
        .map(|line| line.chars().count())
        .max()
        .filter(|w| *w > COLUMNS_MOST)
    {
        wrong.push(format!("a line of {widest} columns"));
    }
    if message.chars().any(|c| c.is_control() && c != '\n') {
        wrong.push("a control character".to_owned());
    }
    if Regex::new(r"\d\.\d*(0000000|9999999)\d")
        .unwrap()
        .is_match(&message)
    {
        wrong.push("digits of binary rounding".to_owned());
    }
    wrong
}

#[test]
fn messages_of_malformed_inputs_name_the_mistake_and_its_line() {
    let files = Files::new("malformed");
    let mut report = String::new();
    for (kind, table) in KINDS {
        for row in rows(table) {
            let lines = files.write(&row, kind);
            let done = files.execute(&row);
            let base = if lines.is_some() {
                row.base.as_str()
            } else {
                "trot"
            };
            let wrong = mistakes(&row, lines, &done, Path::new(&files.path(base)));
            if !wrong.is_empty() {
                let message: String = done.err.chars().take(1200).collect();
                let (name, wrong) = (&row.name, wrong.join("; "));
                writeln!(
                    report,
                    "## {kind}, {}, {name}: {wrong}\n{message}",
                    row.base
                )
                .unwrap();
            }
        }
    }
    assert!(report.is_empty(), "{report}");
}

/// Inputs that differ by a number alone count once.
#[test]
fn each_kind_has_many_different_inputs() {
    let digits = Regex::new(r"\d+").unwrap();
    for (kind, table) in KINDS {
        let rows = rows(table);
        let form = |row: &Row| {
            let edit = format!("{}\n{:?}\n{}", row.base, row.old, row.new);
            digits.replace_all(&edit, "0").into_owned()
        };
        let forms: BTreeSet<String> = rows.iter().map(form).collect();
        assert_eq!(
            forms.len(),
            rows.len(),
            "{kind}: two rows differ by a number alone"
        );
        let least = if kind == FRESH_EYE { 30 } else { 40 };
        assert!(rows.len() >= least, "{kind}: {} inputs", rows.len());
    }
}
