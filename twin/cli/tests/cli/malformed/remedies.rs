//! Texts that messages tell to write: the problem is gone when they are written.

use std::fmt::Write;
use std::fs;

use regex_lite::Regex;

use super::{Files, KINDS, Row, rows};

/// Edits of trot that are not in the table, by the text of the file that they replace.
const FURTHER: [(&str, &str, &str); 8] = [
    ("trot", "duration = \"20 s\"", "duration: 20 s"),
    ("trot", "name = \"trot\"", "name: a trot"),
    ("trot", "duration = \"20 s\"", "duration = 20 s"),
    ("trot", "duration = \"20 s\"", "duration = 20 s\""),
    ("trot", "dead_band = \"0 deg\"", "kp = 3"),
    ("trot", "", "[[payload]]\nmass = \"100 g\"\nat = \"1 cm\""),
    (
        "robot",
        "inertia = [\"9.375e-4 kg·m²\", \"3.2176e-3 kg·m²\", \"3.7801e-3 kg·m²\"]",
        "inertia = \"1e-3 kg·m²\"",
    ),
    (
        "sweep",
        "key = \"plant.ground.at\"\nfrom = \"2.5 m\"\nto = \"2.766 m\"",
        "key = \"plant.ground.at\"\nvalues = \"2.5 m, 2.6 m\"",
    ),
];

/// A remedy: the line and the columns of the place, and the new text.
struct Remedy {
    line: usize,
    /// First column and number of characters of the marks.
    marked: (usize, usize),
    text: Text,
}

enum Text {
    /// In place of the marked text.
    Marked(String),
    /// An example of the form, in place of the marked text: its value may not suit others.
    Example(String),
    /// Another word in place of one that the message names, or of the marked text.
    Word { named: Vec<String>, new: String },
    /// In place of the key and the value of the line.
    Pair(String),
}

/// Returns the remedy of a problem with a place in `file`, if it shows a text to write as a whole.
fn remedy(problem: &str, file: &str) -> Option<Remedy> {
    let place = Regex::new(r"--> (\S+?\.toml):(\d+):(\d+)").unwrap();
    let place = place.captures(problem)?;
    let marks = problem.lines().find_map(|line| {
        let marks = line.split_once("| ")?.1.trim();
        (!marks.is_empty() && marks.chars().all(|c| c == '^')).then(|| marks.chars().count())
    })?;
    let help = problem.split_once("= help: ")?.1.trim_end();
    let whole = |pattern: &str| {
        let found = Regex::new(pattern).unwrap().captures(help)?;
        let text = found[1].to_owned();
        (!text.contains('…')).then_some(text)
    };
    let marked = whole(r#"^write `("[^`]+")`$"#).map(Text::Marked);
    let example = || whole(r#"write it as in ("[^"]+"); units"#).map(Text::Example);
    let word = || {
        let new = whole(r"^did you mean `([^`]+)`\?(?: numbers have.*)?$")?;
        let message = problem.split("--> ").next()?;
        let named = message.split('`').skip(1).step_by(2).map(str::to_owned);
        let named = named.collect();
        Some(Text::Word { named, new })
    };
    let pair = || {
        whole(r"^(?:.*: )?write (?:it as in )?([A-Za-z_]+ = .+)$")
            .or_else(|| whole(r"are in quotes: (.+)$"))
            .map(Text::Pair)
    };
    (place[1] == *file).then_some(())?;
    let number = |index: usize| place[index].parse::<usize>().unwrap();
    Some(Remedy {
        line: number(2),
        marked: (number(3) - 1, marks),
        text: marked.or_else(example).or_else(word).or_else(pair)?,
    })
}

/// Writes the text of a remedy into a file.
fn follow(remedy: &Remedy, text: &str) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let line = &mut lines[remedy.line - 1];
    let chars: Vec<char> = line.chars().collect();
    let (from, count) = remedy.marked;
    let [before, rest, after] = [&chars[..from], &chars[from..], &chars[from + count..]];
    let [before, rest, after] = [before, rest, after].map(|part| part.iter().collect::<String>());
    match &remedy.text {
        Text::Marked(new) | Text::Example(new) => *line = before + new + &after,
        Text::Word { named, new } => {
            let quoted = Regex::new(r#"^"[^"]*"|^'[^']*'"#).unwrap();
            *line = before
                + &match named.iter().find(|it| rest.contains(*it)) {
                    Some(old) => rest.replacen(old, new, 1),
                    None => quoted.replace(&rest, format!("\"{new}\"")).into_owned(),
                };
        }
        Text::Pair(pair) => {
            let key = pair.split('=').next().unwrap().trim();
            // A pair within braces ends at the next comma or brace.
            let within = Regex::new(&format!(r#"\b{key} *= *(\[[^\]]*\]|"[^"]*"|[^,}}]*)"#));
            let within = within.unwrap();
            *line = if line.trim_start().starts_with(key) {
                pair.clone()
            } else {
                within.replace(line, pair.as_str()).into_owned()
            };
        }
    }
    lines.join("\n") + "\n"
}

#[test]
fn texts_that_messages_tell_to_write_are_accepted() {
    let files = Files::new("remedies");
    let further = FURTHER.iter().map(|(base, old, new)| Row {
        base: (*base).to_owned(),
        name: (*new).to_owned(),
        old: Some((*old).to_owned()),
        new: (*new).to_owned(),
        says: Vec::new(),
    });
    let table = KINDS.iter().flat_map(|(kind, table)| {
        let rows = rows(table).into_iter();
        rows.map(move |row| (*kind, row))
    });
    let (mut report, mut followed) = (String::new(), 0);
    for (kind, row) in table.chain(further.map(|row| ("further", row))) {
        // A search that is accepted takes long.
        if row.base == "space" || files.write(&row, kind).is_none() {
            continue;
        }
        let file = files.path(&row.base);
        let done = files.execute(&row);
        let before = done.err.matches("error: ").count();
        for problem in done.err.split("\n\n") {
            let Some(remedy) = remedy(problem, &file) else {
                continue;
            };
            followed += 1;
            files.write(&row, kind);
            let text = fs::read_to_string(&file).unwrap();
            fs::write(&file, follow(&remedy, &text)).unwrap();
            let after = files.execute(&row);
            let message = problem.split("--> ").next().unwrap().trim_end();
            let place = format!("{file}:{}:", remedy.line);
            let is_word = matches!(remedy.text, Text::Word { .. });
            let mut left = after.err.split("\n\n").filter(|it| it.contains(&place));
            let is_gone = !left.any(|it| !is_word || it.contains(message));
            let is_whole = before == 1 && !is_word && !matches!(remedy.text, Text::Example(_));
            if !is_gone || is_whole && after.code == 2 {
                writeln!(report, "## {}\n{problem}\nthen\n{}", row.name, after.err).unwrap();
            }
        }
    }
    assert!(report.is_empty(), "{followed} followed\n{report}");
    assert!(followed >= 80, "{followed} followed");
}
