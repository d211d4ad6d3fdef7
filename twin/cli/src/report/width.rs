//! Width of the terminal, and text that fits it.

use std::io::IsTerminal;

use unicode_width::UnicodeWidthChar;

/// Least width for which text is laid out \[columns\].
const LEAST: usize = 40;
/// Indentation of the rest of a line, in addition to that of the line \[columns\].
const HANGING: usize = 2;

/// Returns the columns of standard output: `COLUMNS`, else the size of the terminal; none for files
/// and pipes, whose lines are not limited. At least 40.
pub fn columns() -> Option<usize> {
    let named = std::env::var("COLUMNS").ok();
    let named = named.and_then(|text| text.trim().parse().ok());
    // The first of the program's streams that is a terminal has the size of all of them.
    let is_terminal = std::io::stdout().is_terminal();
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

fn fit_line(line: &str, columns: usize) -> String {
    if width(line) <= columns {
        return line.to_owned();
    }
    let indent = line.chars().take_while(|c| *c == ' ').count();
    let hanging = (indent + HANGING).min(columns / 2);
    let mut out = " ".repeat(indent.min(columns / 2));
    let (mut column, mut gap, mut first) = (out.len(), 0, true);
    for (word, blanks) in words(&line[indent..]) {
        let wide = width(&word);
        if !first && column + gap + wide > columns {
            out.push('\n');
            out.push_str(&" ".repeat(hanging));
            column = hanging;
        } else {
            out.push_str(&" ".repeat(gap));
            column += gap;
        }
        out.push_str(&word);
        column += wide;
        (gap, first) = (blanks, false);
    }
    out
}

/// Returns the words of a line, each with the number of spaces after it. A number and the unit
/// after it are one word.
fn words(line: &str) -> Vec<(String, usize)> {
    let mut words: Vec<(String, usize)> = Vec::new();
    for part in line.split(' ') {
        match words.last_mut() {
            Some((_, blanks)) if part.is_empty() => *blanks += 1,
            Some((word, blanks)) if *blanks == 1 && is_number(word) && is_unit(part) => {
                word.push(' ');
                word.push_str(part);
            }
            _ => words.push((part.to_owned(), 1)),
        }
    }
    words
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
    use crate::report::style::{BOLD, styled};

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

    #[test]
    fn numbers_stay_with_their_units() {
        let text = fit(&format!("{} is 12.5 m/s", "x".repeat(33)), 40);
        assert_eq!(text, format!("{} is\n  12.5 m/s", "x".repeat(33)));
    }
}
