//! Text with a name, and places in it.

use std::ops::Range;
use std::sync::Arc;

/// A text and the name it is shown under: a file's path, or `--set` for what came from the command line.
#[derive(Debug, PartialEq, Eq)]
pub struct Source {
    /// The name shown in messages.
    pub name: String,
    /// The whole text.
    pub text: String,
    /// Where each line begins: thousands of places ask for their lines.
    lines: Vec<usize>,
}

impl Source {
    /// `text`, shown under `name`.
    pub fn new(name: &str, text: String) -> Self {
        let newlines = text.match_indices('\n').map(|(at, _)| at + 1);
        Source {
            name: name.to_owned(),
            lines: std::iter::once(0).chain(newlines).collect(),
            text,
        }
    }

    /// The number of the line with the byte `at`, from 0.
    fn line_of(&self, at: usize) -> usize {
        self.lines
            .partition_point(|&start| start <= at)
            .saturating_sub(1)
    }
}

/// Where something stands: a range of bytes of a [`Source`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    source: Arc<Source>,
    span: Range<usize>,
}

impl Place {
    /// The place of bytes `span` of `source`. A span beyond the text, or one that cuts a character in two, is moved to the
    /// nearest character boundary: a place is for showing and must never be the cause of a panic.
    pub fn new(source: Arc<Source>, span: Range<usize>) -> Self {
        let start = boundary(&source.text, span.start);
        let end = boundary(&source.text, span.end).max(start);
        Place {
            source,
            span: start..end,
        }
    }

    /// The source it stands in.
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// Whether it stands in `source`: that very one, not one of the same text.
    pub(crate) fn is_in(&self, source: &Arc<Source>) -> bool {
        Arc::ptr_eq(&self.source, source)
    }

    /// Line, counted from 1.
    pub fn line(&self) -> usize {
        self.source.line_of(self.span.start) + 1
    }

    /// Column in characters, counted from 1.
    pub fn column(&self) -> usize {
        self.before().chars().count() + 1
    }

    /// The text of its line.
    pub fn line_text(&self) -> &str {
        let start = self.line_start();
        let rest = &self.source.text[start..];
        rest.split('\n')
            .next()
            .unwrap_or(rest)
            .trim_end_matches('\r')
    }

    /// The text of its line before it.
    pub(crate) fn before(&self) -> &str {
        &self.source.text[self.line_start()..self.span.start]
    }

    /// Length in characters of the part that stands on its first line, at least 1.
    pub(crate) fn width(&self) -> usize {
        let text = &self.source.text[self.span.clone()];
        let first = text.split('\n').next().unwrap_or(text);
        first.trim_end_matches('\r').chars().count().max(1)
    }

    /// The start of the first line of its source that is not empty.
    pub(crate) fn first_line(&self) -> Place {
        let text = &self.source.text;
        let start = text.find(|c: char| !c.is_whitespace()).unwrap_or(0);
        let line = text[start..].lines().next().unwrap_or("");
        Place::new(Arc::clone(&self.source), start..start + line.len())
    }

    fn line_start(&self) -> usize {
        let line = self.source.line_of(self.span.start);
        self.source.lines.get(line).copied().unwrap_or(0)
    }
}

fn boundary(text: &str, at: usize) -> usize {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn lines_and_columns_are_those_that_counting_gives(
            text in "([a-zµ]{0,4}\r?\n?){0,8}",
            at in 0_usize..64,
        ) {
            let place = Place::new(Arc::new(Source::new("text", text.clone())), at..at);
            let before = &text[..boundary(&text, at)];
            prop_assert_eq!(place.line(), before.matches('\n').count() + 1);
            let last = before.rsplit('\n').next().unwrap_or_default();
            prop_assert_eq!(place.column(), last.chars().count() + 1);
            prop_assert_eq!(place.before(), last);
            let line = text.split('\n').nth(place.line() - 1).unwrap_or_default();
            prop_assert_eq!(place.line_text(), line.trim_end_matches('\r'));
        }
    }
}
