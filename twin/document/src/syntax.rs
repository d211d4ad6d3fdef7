//! Messages of texts that are not TOML: one for each text, with the mistake that people make.

use std::sync::Arc;

use crate::error::Problem;
use crate::source::{Place, Source};
use crate::toml_text::{is_entry, quoted};
use crate::visible::{code_point, is_invisible};

/// Returns the problem of a text for which the parser has `errors`: the first one, as the others
/// follow from it more often than not.
pub(crate) fn problem(errors: &[toml::de::Error], source: &Arc<Source>) -> Problem {
    if let Some(format) = format_of(source.text.as_bytes()) {
        return other_format(&source.name, format);
    }
    let start = |error: &&toml::de::Error| error.span().map_or(usize::MAX, |span| span.start);
    let Some(error) = errors.iter().min_by_key(start) else {
        return Problem::of_file(&source.name, "this is not TOML", "");
    };
    let place = Place::new(Arc::clone(source), error.span().unwrap_or(0..0));
    let mut lines = error.message().lines();
    let message = lines.next().unwrap_or("it cannot be read");
    if message.starts_with("duplicate key")
        && let Some(problem) = single_bracket(&place, source)
    {
        return problem;
    }
    if let Some(problem) = not_closed(&place, source) {
        return problem;
    }
    if message.starts_with("duplicate key")
        && let Some(problem) = defined_before(&place, source)
    {
        return problem;
    }
    let help = hint(place.line_text(), message);
    let help = help.unwrap_or_else(|| lines.collect::<Vec<_>>().join("; "));
    Problem::at(&place, format!("this is not TOML: {message}"), help)
}

/// Formats of files that are given by mistake, by their first bytes.
const FORMATS: &[(&[u8], &str)] = &[
    (b"\xff\xfe", "UTF-16 text"),
    (b"\xfe\xff", "UTF-16 text"),
    (b"\x1f\x8b", "compressed by gzip"),
    (b"PK\x03\x04", "a ZIP archive"),
    (b"\x89MCAP", "a recording"),
    (b"%PDF", "a PDF document"),
    (b"<", "XML"),
    (b"{", "JSON"),
    (b"---", "YAML"),
];

/// Returns the format of a file that is not TOML.
pub(crate) fn format_of(bytes: &[u8]) -> Option<&'static str> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let found = FORMATS.iter().find(|(begin, _)| bytes.starts_with(begin));
    found.map(|(_, format)| *format)
}

/// Problem of a file in another format.
pub(crate) fn other_format(file: &str, format: &str) -> Problem {
    let help = match format {
        "a recording" => "`twin replay` repeats its run, `twin diff` compares it",
        "UTF-16 text" => "save the file as UTF-8",
        _ => "scenarios, robots and sweeps are TOML files, as text",
    };
    Problem::of_file(file, format!("this file is {format}, not TOML"), help)
}

/// Problem of `[expect]` before `[[expect]]`, which the parser finds at the second one.
fn single_bracket(place: &Place, source: &Arc<Source>) -> Option<Problem> {
    let second = place.line_text().trim();
    let name = second.strip_prefix("[[")?.split("]]").next()?.trim();
    let mut start = 0;
    for line in source.text.split_inclusive('\n') {
        let header = line.trim_start().strip_prefix('[');
        let table = header.and_then(|rest| rest.split(']').next());
        if table.is_some_and(|table| table.trim() == name) {
            let first = Place::new(Arc::clone(source), start..start + line.trim_end().len());
            let message = format!(
                "`[{name}]` is one table, but `[[{name}]]` in line {} begins a list",
                place.line()
            );
            return Some(Problem::at(
                &first,
                message,
                format!("write [[{name}]] here too"),
            ));
        }
        start += line.len();
    }
    None
}

/// Problem of a table or a key that is there twice, which names the line of the first one.
fn defined_before(place: &Place, source: &Arc<Source>) -> Option<Problem> {
    let second = place.line_text().trim();
    let (mut table, mut defined) = (String::new(), Vec::new());
    for (number, line) in source.text.lines().enumerate().take(place.line()) {
        let line = line.trim();
        let header = line
            .strip_prefix('[')
            .and_then(|rest| rest.split(']').next());
        let key = match header.filter(|name| !name.starts_with('[')) {
            Some(name) => {
                name.trim().clone_into(&mut table);
                table.clone()
            }
            None => match line.split_once('=') {
                Some((key, _)) if table.is_empty() => key.trim().to_owned(),
                Some((key, _)) => format!("{table}.{}", key.trim()),
                None => continue,
            },
        };
        defined.push((number + 1, key));
    }
    let (_, key) = defined.pop()?;
    let (line, _) = defined.into_iter().find(|(_, known)| *known == key)?;
    let message = format!("this is not TOML: `{key}` is already in line {line}");
    let help = if second.starts_with('[') {
        format!("write the keys of this table in line {line} and after it")
    } else {
        "remove one of the two".to_owned()
    };
    Some(Problem::at(place, message, help))
}

/// Problem of a bracket that is not closed in its line, which the parser finds in the next one.
fn not_closed(place: &Place, source: &Arc<Source>) -> Option<Problem> {
    if !place.before().trim().is_empty() {
        return None;
    }
    let header = place.line_text().trim_start();
    let begins_anew = header.starts_with('[') || header.contains('=');
    let line_start = place.start() - place.before().len();
    let before = source.text.get(..line_start)?.trim_end();
    let start = before.rfind('\n').map_or(0, |at| at + 1);
    let open = first_open(&before[start..])?;
    if !begins_anew || before[start..].trim_start().starts_with('[') {
        return None;
    }
    let bracket = &before[start + open..=start + open];
    let at = Place::new(Arc::clone(source), start + open..start + open + 1);
    let message = format!("this is not TOML: `{bracket}` is not closed in its line");
    let closing = if bracket == "{" { '}' } else { ']' };
    Some(Problem::at(&at, message, format!("add `{closing}`")))
}

/// Position of the first bracket or brace of a line that is not closed in it.
fn first_open(line: &str) -> Option<usize> {
    let mut open = Vec::new();
    let mut quote = None;
    for (at, c) in line.char_indices() {
        match (quote, c) {
            (Some(mark), c) if mark == c => quote = None,
            (None, '"' | '\'') => quote = Some(c),
            (None, '#') => break,
            (None, '{' | '[') => open.push(at),
            (None, '}' | ']') => drop(open.pop()),
            _ => {}
        }
    }
    open.first().copied()
}

/// Remedy for a line that is not TOML.
fn hint(line: &str, message: &str) -> Option<String> {
    let start = line.trim_start();
    if ["<<<<<<<", "=======", ">>>>>>>"]
        .iter()
        .any(|mark| start.starts_with(mark))
    {
        return Some("a mark of an unresolved merge: keep one of both sides, without marks".into());
    }
    if start.starts_with("```") {
        return Some("a fence of Markdown: delete this line".to_owned());
    }
    if start.starts_with("//") || start.starts_with("/*") {
        return Some("a comment begins with `#`".to_owned());
    }
    let entry = line.trim_end().strip_suffix(',');
    if entry.is_some_and(is_entry) {
        return Some("a line ends without a comma".to_owned());
    }
    if message.contains("escape") {
        return Some("paths have `/`; or put the text in single quotes, without escapes".into());
    }
    if let Some(c) = line.chars().find(|c| is_disallowed(*c)) {
        return Some(named(c));
    }
    if let Some((key, value)) = line.split_once(':').filter(|_| !line.contains('=')) {
        return Some(format!("write {} = {}", key.trim(), as_value(value.trim())));
    }
    let (key, value) = line.split_once('=')?;
    let (key, value) = (key.trim(), value.trim());
    if value.contains(" //") {
        return Some("a comment begins with `#`".to_owned());
    }
    if let Some(hint) = hint_of_number(line, message) {
        return Some(hint);
    }
    let is_bare = value.starts_with(|c: char| c.is_alphanumeric());
    let about_value = ["quote", "boolean", "literal", "number"];
    if !is_bare || !about_value.iter().any(|word| message.contains(word)) {
        return None;
    }
    let text = value.split('#').next().unwrap_or(value).trim();
    Some(match text {
        "True" | "TRUE" | "False" | "FALSE" => {
            format!("write {key} = {}", text.to_lowercase())
        }
        "null" | "None" | "nil" => format!("leave `{key}` out to have its default"),
        text if text.ends_with(';') => {
            let value = as_value(text.trim_end_matches([';', ' ']));
            format!("lines have no `;`: write {key} = {value}")
        }
        text => {
            let text = quoted(text.trim_matches(['"', '\'']));
            format!("texts and quantities are in quotes: {key} = {text}")
        }
    })
}

/// Returns a value in TOML: as it is written, or else as a text.
fn as_value(text: &str) -> String {
    match toml::de::DeValue::parse(text) {
        Ok(_) => text.to_owned(),
        Err(_) => quoted(text.trim_matches(['"', '\''])),
    }
}

/// Remedy for a number or a key in braces, in a line with an equals sign.
fn hint_of_number(line: &str, message: &str) -> Option<String> {
    let bare = line.split('#').next().unwrap_or(line);
    for (at, _) in bare.match_indices('=') {
        let value = bare[at + 1..].trim_start();
        let digits = |text: &str| text.chars().take_while(char::is_ascii_digit).count();
        let whole = digits(value);
        let (number, rest) = value.split_at(whole);
        if let Some(rest) = rest
            .strip_prefix('.')
            .filter(|rest| whole == 0 && digits(rest) > 0)
        {
            return Some(format!(
                "write a zero before the point: 0.{}",
                &rest[..digits(rest)]
            ));
        }
        if let Some(rest) = rest
            .strip_prefix(',')
            .filter(|rest| whole > 0 && digits(rest) > 0)
        {
            let share = &rest[..digits(rest)];
            return Some(format!("write a decimal point: {number}.{share}"));
        }
    }
    let colon = bare.split('{').nth(1)?.split_once(':')?.0;
    let is_key = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | ' ' | '"');
    let is_pair = message.contains("key") && colon.chars().all(is_key);
    is_pair.then(|| {
        format!(
            "write `=` in place of `:`, as in {{ {} = … }}",
            colon.trim()
        )
    })
}

/// Whether `c` stands in no TOML outside of quotes and comments and can be taken for a character
/// that does.
fn is_disallowed(c: char) -> bool {
    (!c.is_ascii() && !c.is_alphabetic())
        || (c.is_control() && c != '\t')
        || is_invisible(c)
        || matches!(c, '\u{370}'..='\u{52f}')
}

/// Names a character that is not accepted.
fn named(c: char) -> String {
    let code = code_point(c);
    match c {
        '\u{201c}'..='\u{201f}' | '\u{2018}'..='\u{201b}' | '«' | '»' => {
            format!("`{c}` is {code}; TOML has straight quotes: \"…\"")
        }
        '\u{a0}' | '\u{202f}' | '\u{2007}' => format!("there is a no-break space ({code})"),
        '\r' => format!("lines end with CR alone ({code}): save the file with LF or CR LF"),
        c if c.is_control() || is_invisible(c) => {
            format!("there is an invisible character, {code}; delete it")
        }
        c => format!("`{c}` is {code}, which is not the character that it looks like"),
    }
}
