//! Tokens of JSON, read in pieces: of a long text only the present token is in memory.
//!
//! `NaN`, `Infinity` and `-Infinity` are accepted as numbers, as programs in Python write them.

use super::cell::Cell;
use super::error::LogFault;
use super::input::Input;

/// Longest text that is kept \[bytes\]: keys, numbers and texts.
const TOKEN_MOST: usize = 64 * 1024;
/// Greatest depth of lists and objects.
const DEPTH_MOST: usize = 100;

/// Kind of the value that follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Next {
    Object,
    List,
    Scalar,
}

/// Reader of JSON.
pub(super) struct JsonReader<'i, 'a> {
    pub input: &'i mut Input<'a>,
    token: Vec<u8>,
    depth: usize,
}

/// Creates an error of syntax.
fn syntax(why: impl Into<String>) -> LogFault {
    LogFault::Syntax {
        format: "JSON",
        why: why.into(),
    }
}

fn unexpected(byte: u8, expected: &str) -> LogFault {
    let found = match byte {
        b'!'..=b'~' => format!("`{}`", char::from(byte)),
        byte => format!("the byte {byte:#04x}"),
    };
    syntax(format!("there is {found}; expected {expected}"))
}

impl<'i, 'a> JsonReader<'i, 'a> {
    pub(super) fn new(input: &'i mut Input<'a>) -> Self {
        let token = Vec::new();
        let depth = 0;
        Self {
            input,
            token,
            depth,
        }
    }

    /// Returns the next byte that is not white space.
    fn peek(&mut self) -> Result<Option<u8>, LogFault> {
        loop {
            match self.input.peek()? {
                Some(b' ' | b'\t' | b'\r' | b'\n') => self.input.next()?,
                other => return Ok(other),
            };
        }
    }

    /// Whether nothing but white space follows.
    pub(super) fn is_at_end(&mut self) -> Result<bool, LogFault> {
        Ok(self.peek()?.is_none())
    }

    fn some(byte: Option<u8>, within: &'static str) -> Result<u8, LogFault> {
        byte.ok_or(LogFault::Truncated { within })
    }

    /// Returns the kind of the value that follows.
    pub(super) fn kind(&mut self) -> Result<Next, LogFault> {
        Ok(match Self::some(self.peek()?, "a value")? {
            b'{' => Next::Object,
            b'[' => Next::List,
            _ => Next::Scalar,
        })
    }

    /// Enters an object or a list, whose kind is known.
    pub(super) fn enter(&mut self) -> Result<(), LogFault> {
        self.depth += 1;
        if self.depth > DEPTH_MOST {
            return Err(syntax(format!("lists are nested {DEPTH_MOST} deep")));
        }
        self.input.next()?;
        Ok(())
    }

    /// Advances to the next key of an object, which [`JsonReader::key`] returns; `false` at its
    /// end, which is left.
    pub(super) fn next_key(&mut self, is_first: bool) -> Result<bool, LogFault> {
        if !self.follows(is_first, b'}', "an object")? {
            return Ok(false);
        }
        match Self::some(self.peek()?, "an object")? {
            b'"' => self.text(true)?,
            byte => return Err(unexpected(byte, "a key in quotes")),
        }
        match Self::some(self.peek()?, "an object")? {
            b':' => self.input.next()?,
            byte => return Err(unexpected(byte, "`:`")),
        };
        Ok(true)
    }

    /// Advances to the next element of a list; `false` at its end, which is left.
    pub(super) fn next_element(&mut self, is_first: bool) -> Result<bool, LogFault> {
        self.follows(is_first, b']', "a list")
    }

    fn follows(&mut self, is_first: bool, end: u8, within: &'static str) -> Result<bool, LogFault> {
        let byte = Self::some(self.peek()?, within)?;
        if byte == end {
            self.input.next()?;
            self.depth = self.depth.saturating_sub(1);
            return Ok(false);
        }
        if is_first {
            return Ok(true);
        }
        if byte != b',' {
            return Err(unexpected(byte, &format!("`,` or `{}`", char::from(end))));
        }
        self.input.next()?;
        match Self::some(self.peek()?, within)? {
            byte if byte == end => Err(unexpected(byte, "a value after `,`")),
            _ => Ok(true),
        }
    }

    /// Returns the present key.
    pub(super) fn key(&self) -> &str {
        std::str::from_utf8(&self.token).unwrap_or_default()
    }

    /// Reads a value that is neither a list nor an object.
    pub(super) fn scalar(&mut self) -> Result<Cell<'_>, LogFault> {
        match Self::some(self.peek()?, "a value")? {
            b'"' => {
                self.text(true)?;
                Ok(Cell::Text(self.key()))
            }
            b'-' | b'0'..=b'9' => self.number(),
            byte if byte.is_ascii_alphabetic() => self.word(),
            byte => Err(unexpected(byte, "a value")),
        }
    }

    fn word(&mut self) -> Result<Cell<'_>, LogFault> {
        self.token.clear();
        while let Some(byte) = self.input.peek()?
            && byte.is_ascii_alphanumeric()
        {
            self.keep(byte)?;
            self.input.next()?;
        }
        match self.token.as_slice() {
            b"null" => Ok(Cell::Missing),
            b"true" => Ok(Cell::Boolean(true)),
            b"false" => Ok(Cell::Boolean(false)),
            b"NaN" => Ok(Cell::Number(f64::NAN)),
            b"Infinity" => Ok(Cell::Number(f64::INFINITY)),
            b"-Infinity" => Ok(Cell::Number(f64::NEG_INFINITY)),
            _ if self.input.peek()?.is_none() => Err(LogFault::Truncated { within: "a value" }),
            _ => Err(syntax(format!("`{}` is not a value", self.key()))),
        }
    }

    fn keep(&mut self, byte: u8) -> Result<(), LogFault> {
        if self.token.len() >= TOKEN_MOST {
            return Err(syntax(format!("a text is longer than {TOKEN_MOST} bytes")));
        }
        self.token.push(byte);
        Ok(())
    }

    fn number(&mut self) -> Result<Cell<'_>, LogFault> {
        self.token.clear();
        while let Some(byte @ (b'-' | b'+' | b'.' | b'e' | b'E' | b'0'..=b'9' | b'I')) =
            self.input.peek()?
        {
            if byte == b'I' && self.token == b"-" {
                return self.infinity();
            }
            self.keep(byte)?;
            self.input.next()?;
        }
        if self.input.peek()?.is_none() && !is_number(&self.token) {
            return Err(LogFault::Truncated { within: "a number" });
        }
        if !is_number(&self.token) {
            return Err(syntax(format!("`{}` is not a number", self.key())));
        }
        Ok(Cell::Digits(self.key()))
    }

    fn infinity(&mut self) -> Result<Cell<'_>, LogFault> {
        match self.word()? {
            Cell::Number(number) => Ok(Cell::Number(-number)),
            _ => Err(syntax("`-` is not followed by a number")),
        }
    }

    /// Reads a text in quotes; without `keeps` its contents are passed over.
    fn text(&mut self, keeps: bool) -> Result<(), LogFault> {
        self.token.clear();
        self.input.next()?;
        loop {
            let at_hand = self.input.fill()?;
            let plain = |byte: &u8| !matches!(byte, b'"' | b'\\' | 0..=0x1f);
            let count = at_hand.iter().position(|byte| !plain(byte));
            let count = count.unwrap_or(at_hand.len());
            if keeps {
                if self.token.len() + count > TOKEN_MOST {
                    return Err(syntax(format!("a text is longer than {TOKEN_MOST} bytes")));
                }
                self.token.extend(&at_hand[..count]);
            }
            self.input.skip(count);
            match self.input.peek()? {
                None => return Err(LogFault::Truncated { within: "a text" }),
                Some(b'"') => break,
                Some(b'\\') => self.escape(keeps)?,
                Some(byte @ 0..=0x1f) => return Err(unexpected(byte, "`\"`")),
                Some(_) => {}
            }
        }
        self.input.next()?;
        if keeps && std::str::from_utf8(&self.token).is_err() {
            return Err(syntax("a text is not UTF-8"));
        }
        Ok(())
    }

    fn escape(&mut self, keeps: bool) -> Result<(), LogFault> {
        self.input.next()?;
        let character = match Self::some(self.input.next()?, "a text")? {
            byte @ (b'"' | b'\\' | b'/') => char::from(byte),
            b'b' => '\u{8}',
            b'f' => '\u{c}',
            b'n' => '\n',
            b'r' => '\r',
            b't' => '\t',
            b'u' => self.code_point()?,
            byte => return Err(unexpected(byte, "an escape sequence")),
        };
        if keeps {
            let mut bytes = [0; 4];
            for byte in character.encode_utf8(&mut bytes).bytes() {
                self.keep(byte)?;
            }
        }
        Ok(())
    }

    fn code_point(&mut self) -> Result<char, LogFault> {
        let first = self.four_digits()?;
        if !(0xd800..0xe000).contains(&first) {
            return Ok(char::from_u32(first.into()).unwrap_or(char::REPLACEMENT_CHARACTER));
        }
        for expected in *b"\\u" {
            if Self::some(self.input.next()?, "a text")? != expected {
                return Err(syntax("half of a surrogate pair"));
            }
        }
        let units = [first, self.four_digits()?];
        match char::decode_utf16(units).next() {
            Some(Ok(character)) => Ok(character),
            _ => Err(syntax("half of a surrogate pair")),
        }
    }

    fn four_digits(&mut self) -> Result<u16, LogFault> {
        let mut value = 0;
        for _ in 0..4 {
            let byte = Self::some(self.input.next()?, "a text")?;
            let digit = char::from(byte).to_digit(16);
            let digit = digit.and_then(|digit| u16::try_from(digit).ok());
            let digit = digit.ok_or_else(|| unexpected(byte, "a hexadecimal digit"))?;
            value = value << 4 | digit;
        }
        Ok(value)
    }

    /// Passes over a value of any kind.
    pub(super) fn pass(&mut self) -> Result<(), LogFault> {
        match self.kind()? {
            Next::Scalar => {
                if self.peek()? == Some(b'"') {
                    self.text(false)
                } else {
                    self.scalar().map(|_| ())
                }
            }
            Next::Object => {
                self.enter()?;
                let mut is_first = true;
                while self.next_key(is_first)? {
                    is_first = false;
                    self.pass()?;
                }
                Ok(())
            }
            Next::List => {
                self.enter()?;
                let mut is_first = true;
                while self.next_element(is_first)? {
                    is_first = false;
                    self.pass()?;
                }
                Ok(())
            }
        }
    }
}

/// Whether bytes are a number of JSON.
fn is_number(token: &[u8]) -> bool {
    let digits = |from: usize| {
        let rest = token.get(from..).unwrap_or_default();
        rest.iter().take_while(|byte| byte.is_ascii_digit()).count()
    };
    let mut at = usize::from(token.first() == Some(&b'-'));
    let whole = digits(at);
    if whole == 0 || (whole > 1 && token.get(at) == Some(&b'0')) {
        return false;
    }
    at += whole;
    if token.get(at) == Some(&b'.') {
        let fraction = digits(at + 1);
        if fraction == 0 {
            return false;
        }
        at += 1 + fraction;
    }
    if matches!(token.get(at), Some(b'e' | b'E')) {
        at += 1 + usize::from(matches!(token.get(at + 1), Some(b'+' | b'-')));
        let exponent = digits(at);
        if exponent == 0 {
            return false;
        }
        at += exponent;
    }
    at == token.len()
}
