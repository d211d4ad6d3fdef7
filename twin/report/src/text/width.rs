//! Width of the terminal, and text that fits it.

use std::io::IsTerminal;

use unicode_width::UnicodeWidthChar;

/// Least width for which text is laid out \[columns\].
const LEAST: usize = 40;
/// Indentation of the rest of a line, in addition to that of the line \[columns\].
const HANGING: usize = 2;
/// Greatest width of a text between backquotes that is not broken \[columns\].
const QUOTED_MOST: usize = 24;
/// End of all styles.
const RESET: &str = "\u{1b}[0m";

/// Returns the columns of standard output: `COLUMNS`, else the size of the terminal; none for files
/// and pipes, whose lines are not limited. At least 40.
pub fn columns() -> Option<usize> {
    limit(std::io::stdout().is_terminal())
}

/// Returns the columns of standard error, as [`columns`] does.
pub fn error_columns() -> Option<usize> {
    limit(std::io::stderr().is_terminal())
}

fn limit(is_terminal: bool) -> Option<usize> {
    let named = std::env::var("COLUMNS").ok();
    let named = named.and_then(|text| text.trim().parse().ok());
    // The first of the program's streams that is a terminal has the size of all of them.
    let of_terminal = || is_terminal.then(terminal_size::terminal_size).flatten();
    named
        .filter(|columns| *columns > 0)
        .or_else(|| of_terminal().map(|(wide, _)| usize::from(wide.0)))
        .map(|columns| columns.max(LEAST))
}

/// Returns styled text whose lines are broken at spaces, so that they fit `columns`. Words and
/// numbers with their units are not cut; the rest of a line is indented further than the line.
pub fn fit(text: &str, columns: usize) -> String {
    let lines = text.split('\n').map(|line| fit_line(line, columns));
    lines.collect::<Vec<_>>().join("\n")
}

/// Returns the message of an error or a warning so that its lines fit `columns`, except those of
/// files: excerpts, which have been cut where they are wide, and places, which are copied as one.
pub fn fit_message(text: &str, columns: usize) -> String {
    let is_of_file = |line: &str| {
        let rest = line.trim_start_matches(|c: char| c == ' ' || c.is_ascii_digit());
        rest.starts_with(['|', '…']) || rest.starts_with("...") || rest.starts_with("--> ")
    };
    let lines = text.split('\n').map(|line| {
        if is_of_file(line) {
            line.to_owned()
        } else {
            fit_line(line, columns)
        }
    });
    lines.collect::<Vec<_>>().join("\n")
}

pub(super) fn fit_line(line: &str, columns: usize) -> String {
    if width(line) <= columns {
        return line.to_owned();
    }
    let indent = line.chars().take_while(|c| *c == ' ').count();
    let first = indent.min(columns / 2);
    let hanging = (indent + HANGING).min(columns / 2);
    let lines = wrap_hanging(&line[indent..], columns - first, columns - hanging);
    let mut out = " ".repeat(first);
    out.push_str(&lines.join(&format!("\n{}", " ".repeat(hanging))));
    out
}

/// Breaks styled text at spaces into lines of `columns`. Longer words are lines of their own. A
/// style that is broken ends with its line and begins again with the next one.
pub fn wrap(text: &str, columns: usize) -> Vec<String> {
    wrap_hanging(text, columns, columns)
}

fn wrap_hanging(text: &str, first: usize, rest: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    let (mut line, mut column, mut gap) = (String::new(), 0, 0);
    let mut style = String::new();
    for (word, blanks) in words(text) {
        let wide = width(&word);
        let most = if lines.is_empty() { first } else { rest };
        if column > 0 && column + gap + wide > most {
            if !style.is_empty() {
                line.push_str(RESET);
            }
            lines.push(std::mem::replace(&mut line, style.clone()));
            column = 0;
        } else {
            line.push_str(&" ".repeat(gap));
            column += gap;
        }
        line.push_str(&word);
        (column, gap) = (column + wide, blanks);
        keep_style(&word, &mut style);
    }
    lines.push(line);
    lines
}

/// Adds the styles that begin in `word` to the open ones, or removes those that it ends.
fn keep_style(word: &str, style: &mut String) {
    for part in word.split('\u{1b}').skip(1) {
        let Some(end) = part.find('m') else { continue };
        let sequence = format!("\u{1b}{}", &part[..=end]);
        if sequence == RESET {
            style.clear();
        } else {
            style.push_str(&sequence);
        }
    }
}

/// Returns the words of a line, each with the number of spaces after it. A number and the unit
/// after it are one word, as is a short text between backquotes, which is to be copied.
pub(super) fn words(line: &str) -> Vec<(String, usize)> {
    let mut words: Vec<(String, usize)> = Vec::new();
    for part in line.split(' ') {
        match words.last_mut() {
            Some((_, blanks)) if part.is_empty() => *blanks += 1,
            Some((word, blanks)) if *blanks == 1 && belong_together(word, part) => {
                word.push(' ');
                word.push_str(part);
            }
            _ => words.push((part.to_owned(), 1)),
        }
    }
    words
}

fn belong_together(word: &str, next: &str) -> bool {
    let is_open = word.matches('`').count() % 2 == 1;
    is_open && next.contains('`') && width(word) + width(next) < QUOTED_MOST
        || is_number(word) && is_unit(next)
}

fn is_number(word: &str) -> bool {
    let word = anstream::adapter::strip_str(word).to_string();
    word.parse::<f64>().is_ok()
}

/// Units are short: `m/s`, `rad/s`, `N m`.
fn is_unit(word: &str) -> bool {
    (1..=6).contains(&width(word)) && !word.starts_with(|c: char| c.is_ascii_digit())
}

/// Returns the columns that styled text takes; wide characters take two.
pub fn width(text: &str) -> usize {
    let plain = anstream::adapter::strip_str(text).to_string();
    plain.chars().map(|c| c.width().unwrap_or(0)).sum()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::text::style::{BOLD, styled};

    proptest! {
        #[test]
        fn lines_fit_and_no_word_is_lost(
            words in proptest::collection::vec("[a-z0-9äµ脚]{1,12}", 1..40),
            indent in 0..12_usize,
            columns in 40..200_usize,
        ) {
            let line = words.iter().map(|word| styled(BOLD, word)).collect::<Vec<_>>().join(" ");
            let text = fit(&format!("{}{line}", " ".repeat(indent)), columns);
            for line in text.lines() {
                prop_assert!(width(line) <= columns, "{line:?}");
            }
            let plain = anstream::adapter::strip_str(&text).to_string();
            prop_assert!(plain.split_whitespace().eq(words.iter().map(String::as_str)));
        }
    }

    proptest! {
        #[test]
        fn every_line_ends_its_styles(
            texts in proptest::collection::vec("[a-z]{1,9}( [a-z]{1,9}){0,5}", 1..9),
        ) {
            let text = texts.iter().map(|text| styled(BOLD, text)).collect::<Vec<_>>().join(" ");
            let lines = wrap(&text, 20);
            prop_assert_eq!(plain(&lines.join(" ")), plain(&text));
            for line in &lines {
                prop_assert!(width(line) <= 20);
                prop_assert_eq!(line.matches("\u{1b}[1m").count(), line.matches(RESET).count());
            }
        }
    }

    fn plain(text: &str) -> String {
        anstream::adapter::strip_str(text).to_string()
    }

    #[test]
    fn places_and_excerpts_stay_whole() {
        let place = format!(" --> {}/a b.toml:7:6", "x".repeat(40));
        let excerpt = format!("7 | l1 = {}", "\"12 Hz\" ".repeat(9));
        let text = format!("error: one two three four five six seven eight\n{place}\n{excerpt}");
        let expected =
            format!("error: one two three four five six seven\n  eight\n{place}\n{excerpt}");
        assert_eq!(fit_message(&text, 40), expected);
    }

    #[test]
    fn short_texts_between_backquotes_stay_whole() {
        let text = fit(&format!("{} by `--scenarios DIR`", "x".repeat(24)), 40);
        assert_eq!(text, format!("{} by\n  `--scenarios DIR`", "x".repeat(24)));
    }

    #[test]
    fn numbers_stay_with_their_units() {
        let text = fit(&format!("{} is 12.5 m/s", "x".repeat(33)), 40);
        assert_eq!(text, format!("{} is\n  12.5 m/s", "x".repeat(33)));
        assert_eq!(text, format!("{} is\n  12.5 m/s", "x".repeat(33)));
        let text = fit(&format!("{} is 12 cycles", "x".repeat(33)), 40);
        assert_eq!(text, format!("{} is\n  12 cycles", "x".repeat(33)));
    }
}
