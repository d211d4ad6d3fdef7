//! Rows of tables of text: a header, and fields between commas, semicolons or tabs.

use super::cell;
use super::collect::Collector;
use super::error::LogFault;
use super::input::Input;
use super::paths::Receiver;

/// Longest row that is read \[bytes\].
const ROW_MOST: usize = 1 << 20;
/// Separators, in the order of preference.
const SEPARATORS: [u8; 3] = [b',', b';', b'\t'];

/// Creates an error of syntax.
fn syntax(why: impl Into<String>) -> LogFault {
    LogFault::Syntax {
        format: "CSV",
        why: why.into(),
    }
}

/// Reads all rows of a log.
pub(super) fn read(input: &mut Input<'_>, collector: &mut Collector<'_>) -> Result<(), LogFault> {
    let mut table = Table::default();
    if table.line(input, &SEPARATORS)?.is_none() {
        return Err(LogFault::NoRows);
    }
    if table.text.starts_with(b"\xef\xbb\xbf") {
        table.text.drain(..3);
    }
    let separator = separator(&table.text);
    table.split(separator)?;
    let header: Vec<String> = table.fields()?.map(str::to_owned).collect();
    let mut selected = Vec::new();
    for sought in collector.sought() {
        let mut found = header
            .iter()
            .enumerate()
            .filter(|(_, name)| **name == sought.path);
        let first = found.next();
        if found.next().is_some() {
            return Err(syntax(format!("there are two columns `{}`", sought.path)));
        }
        selected.extend(first.map(|(field, _)| (field, sought.slot)));
    }
    selected.sort_unstable();
    collector.names.clone_from(&header);
    while let Some(line) = table.line(input, &[separator])? {
        table.split(separator)?;
        collector.begin(Some(line));
        let found = table.ends.len();
        if found != header.len() {
            let expected = header.len();
            return Err(LogFault::RowLength { found, expected });
        }
        let mut rest = selected.as_slice();
        for (index, field) in table.fields()?.enumerate() {
            while let Some(((_, slot), others)) = rest.split_first()
                && rest.first().is_some_and(|(field, _)| *field == index)
            {
                collector.cell(*slot, cell::of_field(field))?;
                rest = others;
            }
        }
        collector.end()?;
    }
    Ok(())
}

/// Returns the separator of a header: the commonest outside of quotes.
fn separator(header: &[u8]) -> u8 {
    let count = |separator: u8| {
        let mut quoted = false;
        let outside = header.iter().filter(|&&byte| {
            quoted ^= byte == b'"';
            byte == separator && !quoted
        });
        outside.count()
    };
    let mut best = (b',', 0);
    for separator in SEPARATORS {
        if count(separator) > best.1 {
            best = (separator, count(separator));
        }
    }
    best.0
}

/// The present row.
#[derive(Default)]
struct Table {
    /// The row as written.
    text: Vec<u8>,
    /// Its fields without quotes, one after the other, and the end of each.
    plain: Vec<u8>,
    ends: Vec<usize>,
}

impl Table {
    /// Reads the next row that is neither empty nor a comment, and returns its line; none at the
    /// end. A field in quotes, which begins after a separator, may have line breaks.
    fn line(&mut self, input: &mut Input<'_>, separators: &[u8]) -> Result<Option<u64>, LogFault> {
        loop {
            let line = input.line;
            if !self.logical_line(input, separators)? {
                return Ok(None);
            }
            let is_blank = self.text.iter().all(u8::is_ascii_whitespace);
            if !is_blank && !self.text.starts_with(b"#") {
                return Ok(Some(line));
            }
        }
    }

    fn logical_line(&mut self, input: &mut Input<'_>, separators: &[u8]) -> Result<bool, LogFault> {
        self.text.clear();
        let (mut quoted, mut closed, mut is_start) = (false, false, true);
        let mut is_comment = false;
        loop {
            let Some(byte) = input.next()? else {
                if quoted {
                    let within = "a field in quotes";
                    return Err(LogFault::Truncated { within });
                }
                return Ok(!self.text.is_empty());
            };
            if byte == b'\n' && !quoted {
                return Ok(true);
            }
            is_comment |= self.text.is_empty() && byte == b'#';
            if is_comment {
                // Of a comment only the beginning is kept.
                self.text.clear();
                self.text.push(b'#');
                continue;
            }
            if byte == b'"' {
                let opens = !quoted && (is_start || closed);
                closed = quoted;
                quoted = opens;
            } else {
                closed = false;
            }
            is_start = !quoted && separators.contains(&byte) || is_start && byte == b' ';
            if self.text.len() >= ROW_MOST {
                return Err(syntax(format!("a row is longer than {ROW_MOST} bytes")));
            }
            self.text.push(byte);
        }
    }

    /// Splits the row into fields.
    fn split(&mut self, separator: u8) -> Result<(), LogFault> {
        self.plain.clear();
        self.ends.clear();
        let mut rest = self.text.strip_suffix(b"\r").unwrap_or(&self.text);
        loop {
            let start = without_blanks(rest, separator);
            let used = if let Some(quoted) = start.strip_prefix(b"\"") {
                let blank = rest.len() - start.len();
                blank + 1 + unquote(quoted, &mut self.plain)?
            } else {
                let end = rest.iter().position(|&byte| byte == separator);
                let end = end.unwrap_or(rest.len());
                self.plain
                    .extend(rest.get(..end).unwrap_or_default().trim_ascii());
                end
            };
            self.ends.push(self.plain.len());
            let behind = rest.get(used..).unwrap_or_default();
            let behind = without_blanks(behind, separator);
            match behind.split_first() {
                None => return Ok(()),
                Some((byte, after)) if *byte == separator => rest = after,
                Some(_) => return Err(syntax("there is text behind a field in quotes")),
            }
        }
    }

    /// Returns the fields.
    fn fields(&self) -> Result<impl Iterator<Item = &str>, LogFault> {
        let plain = std::str::from_utf8(&self.plain);
        let plain = plain.map_err(|_| syntax("the row is not UTF-8"))?;
        let mut start = 0;
        Ok(self.ends.iter().map(move |&end| {
            let field = plain.get(start..end).unwrap_or_default();
            start = end;
            field
        }))
    }
}

/// Returns bytes without the blanks at their start that are no separators.
fn without_blanks(bytes: &[u8], separator: u8) -> &[u8] {
    let is_blank = |byte: &&u8| byte.is_ascii_whitespace() && **byte != separator;
    let blank = bytes.iter().take_while(is_blank).count();
    bytes.get(blank..).unwrap_or_default()
}

/// Appends a field up to its closing quote to `plain`, and returns the bytes that it takes with
/// that quote.
fn unquote(field: &[u8], plain: &mut Vec<u8>) -> Result<usize, LogFault> {
    let mut at = 0;
    loop {
        match (field.get(at), field.get(at + 1)) {
            (None, _) => {
                let within = "a field in quotes";
                return Err(LogFault::Truncated { within });
            }
            (Some(b'"'), Some(b'"')) => {
                plain.push(b'"');
                at += 2;
            }
            (Some(b'"'), _) => return Ok(at + 1),
            (Some(byte), _) => {
                plain.push(*byte);
                at += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::input::Hash;

    fn rows(text: &str, separator: u8) -> Result<Vec<Vec<String>>, LogFault> {
        let mut input = Input::new(text.as_bytes(), &Hash::default(), 1 << 20)?;
        let mut table = Table::default();
        let mut rows = Vec::new();
        while table.line(&mut input, &[separator])?.is_some() {
            table.split(separator)?;
            rows.push(table.fields()?.map(str::to_owned).collect());
        }
        Ok(rows)
    }

    #[test]
    fn fields_are_split_at_separators_outside_of_quotes() {
        let text = "# a comment, long\na, \"b,\"\"x\"\"\nc\" ,d\r\n\n1,,\" \"\n5\" disk,2,3";
        let expected = [
            vec!["a", "b,\"x\"\nc", "d"],
            vec!["1", "", " "],
            vec!["5\" disk", "2", "3"],
        ];
        assert_eq!(rows(text, b',').unwrap(), expected);
        assert_eq!(rows("a\t\tb", b'\t').unwrap(), [["a", "", "b"]]);
        assert_eq!(rows("a;", b';').unwrap(), [["a", ""]]);
    }

    #[test]
    fn unbalanced_quotes_are_errors() {
        assert!(matches!(
            rows("a,\"b", b','),
            Err(LogFault::Truncated { .. })
        ));
        assert!(matches!(
            rows("a,\"b\"c", b','),
            Err(LogFault::Syntax { .. })
        ));
    }

    #[test]
    fn separator_is_the_commonest_of_the_header() {
        assert_eq!(separator(b"a,b;c;d"), b';');
        assert_eq!(separator(b"\"a,b,c\"\td"), b'\t');
        assert_eq!(separator(b"alone"), b',');
    }
}
