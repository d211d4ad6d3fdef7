//! Named texts, and positions in them.

use std::ops::Range;
use std::sync::Arc;

/// A text and its name in messages: the path of a file, or `--set` for a command-line option.
#[derive(Debug, PartialEq, Eq)]
pub struct Source {
    /// Name shown in messages.
    pub name: String,
    /// Complete text.
    pub text: String,
    /// Byte offset of each line start, precomputed because thousands of positions are converted to
    /// lines.
    lines: Vec<usize>,
}

impl Source {
    /// Creates a source of `text`, shown as `name`.
    pub fn new(name: &str, text: String) -> Self {
        let newlines = text.match_indices('\n').map(|(at, _)| at + 1);
        Source {
            name: name.to_owned(),
            lines: std::iter::once(0).chain(newlines).collect(),
            text,
        }
    }

    /// Zero-based number of the line that contains byte `at`.
    fn line_of(&self, at: usize) -> usize {
        self.lines
            .partition_point(|&start| start <= at)
            .saturating_sub(1)
    }
}

/// Position: a byte range of a [`Source`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    source: Arc<Source>,
    span: Range<usize>,
}

impl Place {
    /// Creates the position of bytes `span` of `source`. Bounds beyond the text or within a
    /// character are moved down to a character boundary: a position must never cause a panic.
    pub fn new(source: Arc<Source>, span: Range<usize>) -> Self {
        let start = boundary(&source.text, span.start);
        let end = boundary(&source.text, span.end).max(start);
        Place {
            source,
            span: start..end,
        }
    }

    /// Source of the position.
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// Text at the position.
    pub fn text(&self) -> &str {
        &self.source.text[self.span.clone()]
    }

    /// Whether the position belongs to the instance `source`; another source with the same text
    /// does not count.
    pub(crate) fn is_in(&self, source: &Arc<Source>) -> bool {
        Arc::ptr_eq(&self.source, source)
    }

    /// Whether both positions belong to one instance of a source.
    pub(crate) fn is_beside(&self, other: &Place) -> bool {
        self.is_in(&other.source)
    }

    /// Byte offset in the text.
    pub(crate) fn start(&self) -> usize {
        self.span.start
    }

    /// Line, counted from 1.
    pub fn line(&self) -> usize {
        self.source.line_of(self.span.start) + 1
    }

    /// Column in characters, counted from 1.
    pub fn column(&self) -> usize {
        self.before().chars().count() + 1
    }

    /// Text of the line.
    pub fn line_text(&self) -> &str {
        let start = self.line_start();
        let rest = &self.source.text[start..];
        rest.split('\n')
            .next()
            .unwrap_or(rest)
            .trim_end_matches('\r')
    }

    /// Text of the line behind the position.
    pub(crate) fn after(&self) -> &str {
        let rest = &self.source.text[self.span.end..];
        rest.split('\n').next().unwrap_or(rest)
    }

    /// Text of the line above; empty for the first.
    pub(crate) fn line_above(&self) -> &str {
        let before = &self.source.text[..self.line_start()];
        let before = before.strip_suffix('\n').unwrap_or_default();
        before.rsplit('\n').next().unwrap_or_default()
    }

    /// Text of the line before the position.
    pub(crate) fn before(&self) -> &str {
        &self.source.text[self.line_start()..self.span.start]
    }

    /// Byte range of the part on its first line, within [`line_text`](Self::line_text).
    pub(crate) fn in_line(&self) -> Range<usize> {
        let length = self.line_text().len();
        let start = self.before().len();
        start.min(length)..(start + self.span.len()).min(length)
    }

    /// Position of the first non-empty line of the source.
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
        fn lines_and_columns_match_a_linear_count(
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
