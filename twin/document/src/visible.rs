//! Texts of others in messages: characters that cannot be seen are written out, and long words cut.

/// Longest word of a message \[characters\]; longer ones are cut in their middle.
const WORD_MOST: usize = 120;
/// Characters that remain before and after the cut.
const KEPT: (usize, usize) = (60, 12);

/// Returns `text` as one can read it: control characters and invisible ones as `\u{1b}`, words of
/// more than 120 characters without their middle. Line breaks remain.
///
/// ```
/// use twinrig_document::visible;
///
/// assert_eq!(visible("tr\u{1b}[31mot\u{200b}"), "tr\\u{1b}[31mot\\u{200b}");
/// assert!(visible(&"9".repeat(100_000)).chars().count() < 100);
/// ```
pub fn visible(text: &str) -> String {
    let mut out = String::with_capacity(text.len().min(4096));
    for part in text.split_inclusive([' ', '\n']) {
        let count = part.chars().count();
        if count <= WORD_MOST {
            part.chars().for_each(|c| push(&mut out, c));
            continue;
        }
        let (before, after) = KEPT;
        part.chars().take(before).for_each(|c| push(&mut out, c));
        out.push('…');
        let end = part.chars().skip(count - after);
        end.for_each(|c| push(&mut out, c));
    }
    out
}

/// Returns `text` with control characters and invisible ones written out, as [`visible`] does, and
/// with all of its words.
///
/// ```
/// assert_eq!(twinrig_document::escaped("a\u{7}b"), "a\\u{7}b");
/// ```
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    text.chars().for_each(|c| push(&mut out, c));
    out
}

fn push(out: &mut String, c: char) {
    if (c.is_control() && c != '\n') || is_invisible(c) {
        out.extend(c.escape_unicode());
    } else {
        out.push(c);
    }
}

/// Escapes the five special characters of XML and replaces characters that XML does not allow.
pub fn escape_xml(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&apos;"),
            '\n' => out.push_str("&#10;"),
            '\t' => out.push_str("&#9;"),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// Whether `c` takes no place or changes the direction of the text: soft hyphen, zero-width
/// characters, marks of direction, byte-order mark, tags.
pub(crate) fn is_invisible(c: char) -> bool {
    matches!(
        c,
        '\u{ad}'
            | '\u{61c}'
            | '\u{180e}'
            | '\u{200b}'..='\u{200f}'
            | '\u{202a}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}'
            | '\u{feff}'
            | '\u{e0000}'..='\u{e007f}'
    )
}

/// Returns the name of a character that can be taken for another one: `U+2212`.
pub(crate) fn code_point(c: char) -> String {
    format!("U+{:04X}", u32::from(c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn special_and_invalid_characters_are_escaped() {
        assert_eq!(
            escape_xml("a < b & \"c\"\n\u{1}"),
            "a &lt; b &amp; &quot;c&quot;&#10;\u{fffd}"
        );
    }
}
