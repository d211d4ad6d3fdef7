//! A document: one TOML file and the values set on top of it.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use toml::de::DeTable;

use crate::error::{DocumentError, Problem, Warning};
use crate::file::{TEXT_MOST, read_file};
use crate::fitted::FittedRange;
use crate::node::{Node, Value};
use crate::overrides::{Overrides, SET_TWICE};
use crate::problems::{Problems, Reported};
use crate::source::{Place, Source};
use crate::syntax;
use crate::table::Table;
use crate::toml_text::{is_entry, quoted};

/// A document in memory. The crate page has an example.
#[derive(Clone, Debug)]
pub struct Document {
    pub(crate) source: Arc<Source>,
    /// Folder of its file; none of a document in memory.
    pub(crate) folder: Option<PathBuf>,
    pub(crate) root: Node,
    warnings: Vec<Warning>,
    /// Ranges of the data to which included values were fitted.
    pub(crate) fitted: Vec<FittedRange>,
}

impl Document {
    /// Reads the file at `path`; messages show the path as passed.
    ///
    /// # Errors
    /// The file cannot be read or is too long ([`read_file`]), is not UTF-8, or is not TOML.
    pub fn read(path: &Path) -> Result<Self, DocumentError> {
        let file = path.display().to_string();
        match read_file(path, TEXT_MOST) {
            Err(error) => {
                let help = not_found(path);
                Err(Problem::of_file(file, unreadable(&error), help).into())
            }
            Ok(bytes) => Document::from_bytes(&file, bytes),
        }
    }

    /// Reads a document from the bytes of `file`.
    ///
    /// # Errors
    /// They are not UTF-8 or not TOML.
    pub fn from_bytes(file: &str, bytes: Vec<u8>) -> Result<Self, DocumentError> {
        match String::from_utf8(bytes) {
            Ok(text) => Document::parse(file, &text),
            Err(error) => {
                if let Some(format) = syntax::format_of(error.as_bytes()) {
                    return Err(syntax::other_format(file, format).into());
                }
                let at = error.utf8_error().valid_up_to();
                // The text before is the same; the byte becomes a replacement character.
                let text = String::from_utf8_lossy(error.as_bytes()).into_owned();
                let source = Arc::new(Source::new(file, text));
                let place = Place::new(source, at..at + char::REPLACEMENT_CHARACTER.len_utf8());
                let message = format!("line {} is not UTF-8 text", place.line());
                Err(Problem::at(&place, message, "save the file as UTF-8").into())
            }
        }
    }

    /// Reads a document from `text`, which messages call `file`.
    ///
    /// # Errors
    /// It is not TOML; of several syntax errors the first is reported, as most others follow from
    /// it.
    pub fn parse(file: &str, text: &str) -> Result<Self, DocumentError> {
        let source = Arc::new(Source::new(file, text.to_owned()));
        let (table, errors) = DeTable::parse_recoverable(text);
        if errors.is_empty() {
            let root = Node::of_table(&table, &source);
            return Ok(Document {
                source,
                folder: None,
                root,
                warnings: Vec::new(),
                fitted: Vec::new(),
            });
        }
        Err(syntax::problem(&errors, &source).into())
    }

    /// Name shown in messages.
    pub fn file(&self) -> &str {
        &self.source.name
    }

    /// Text as read, without the values set on top of it.
    pub fn text(&self) -> &str {
        &self.source.text
    }

    /// Keys of the root table, in the order of the text.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        let entries = match &self.root.value {
            Value::Table(entries) => entries.as_slice(),
            _ => &[],
        };
        entries.iter().map(|entry| entry.key.as_str())
    }

    /// Returns the values, to replace those of another document.
    pub fn overrides(&self) -> Overrides {
        Overrides::of(&self.root)
    }

    /// Returns the place of the value at a dotted key without quotes; none if there is none.
    pub fn place(&self, key: &str) -> Option<Place> {
        let keys: Vec<String> = key.split('.').map(str::to_owned).collect();
        Some(self.root.find(&keys)?.place.clone())
    }

    /// Sets `value` at the dotted `key`, replacing an existing value:
    /// `set("--set", "plant.step", "0.5 ms")`. A value that is not TOML is taken as a string, so
    /// that a shell needs no second pair of quotes. Messages about the value show `origin` as the
    /// file. Replacing a value set by an earlier call is a warning: the last one is used.
    ///
    /// Elements of a list have their name, or their kind if they have none, or are counted from 0:
    /// `bus.sbcp.gains`, `change.0.at`. The number after the last one appends an element; a list
    /// that is not there is set as a whole.
    ///
    /// # Errors
    /// The key is not a dotted key, a part of its path is not a table, or a list has no such
    /// element.
    pub fn set(&mut self, origin: &str, key: &str, value: &str) -> Result<(), DocumentError> {
        let text = format!("{key} = {value}");
        let text = if is_entry(&text) {
            text
        } else {
            format!("{key} = {}", quoted(value))
        };
        let source = Arc::new(Source::new(origin, text));
        let key_place = Place::new(Arc::clone(&source), 0..key.len());
        let (table, errors) = DeTable::parse_recoverable(&source.text);
        if !errors.is_empty() || !is_entry(&source.text) {
            let help = "write KEY=VALUE, as in plant.step=\"0.5 ms\"";
            return Err(Problem::at(&key_place, format!("`{key}` is not a key"), help).into());
        }
        let mut keys = Vec::new();
        let mut node = Node::of_table(&table, &source);
        while let Value::Table(entries) = &mut node.value {
            // An inline table on the right is the value, not a part of the key.
            let deeper = entries.len() == 1 && entries[0].key_place.column() <= key.len();
            if !deeper {
                break;
            }
            let entry = entries.remove(0);
            keys.push(entry.key);
            node = entry.node;
        }
        self.warn_of_earlier_settings(&keys, &source);
        self.insert(&keys, &key_place, node)
    }

    /// Adds a warning for each value at and below the path `keys` that was set on top of the file:
    /// it is about to be replaced.
    fn warn_of_earlier_settings(&mut self, keys: &[String], by: &Arc<Source>) {
        let mut leaves = Vec::new();
        if let Some(node) = self.root.find(keys) {
            node.leaves(&keys.join("."), &mut leaves);
        }
        leaves.retain(|(_, leaf)| !leaf.place.is_in(&self.source));
        let warning = |(key, leaf): (String, &Node)| Warning {
            code: SET_TWICE,
            problem: Problem::at(
                &leaf.place,
                format!("`{key}` is set twice, and the last one counts"),
                format!("leave this one out, or `{}`", by.text),
            ),
        };
        self.warnings.extend(leaves.into_iter().map(warning));
    }

    /// Replaces the values whose keys occur in `overrides` (a table of another document). A key may
    /// be a dotted path, quoted or not; a table replaces only the keys it contains.
    ///
    /// # Errors
    /// A part of a key's path is not a table.
    pub fn override_with(&mut self, overrides: &Overrides) -> Result<(), DocumentError> {
        for (keys, place, node) in &overrides.leaves {
            self.insert(keys, place, node.clone())?;
        }
        Ok(())
    }

    /// Reads the document with `read`, to which the root table is passed, and returns its result if
    /// no problem was reported and every key was requested.
    ///
    /// # Errors
    /// All problems.
    pub fn check<T>(
        &self,
        read: impl FnOnce(&Table<'_>) -> Result<T, Reported>,
    ) -> Result<T, DocumentError> {
        self.check_and_warn(read).map(|(value, _)| value)
    }

    /// As [`Document::check`], with the warnings of `read` and of [`Document::set`], sorted by
    /// position.
    ///
    /// # Errors
    /// All problems.
    pub fn check_and_warn<T>(
        &self,
        read: impl FnOnce(&Table<'_>) -> Result<T, Reported>,
    ) -> Result<(T, Vec<Warning>), DocumentError> {
        let problems = Problems::default();
        let result = {
            let root = Table::new(&self.root, "", &problems);
            read(&root)
        };
        let (errors, of_reader) = problems.into_inner();
        match result {
            Ok(value) if errors.is_empty() => {
                let mut warnings = self.warnings.clone();
                warnings.extend(of_reader);
                Warning::sort(&mut warnings);
                Ok((value, warnings))
            }
            _ => Err(DocumentError::of(errors)),
        }
    }

    fn insert(&mut self, keys: &[String], place: &Place, node: Node) -> Result<(), DocumentError> {
        let inserted = self.root.insert(keys, place, node);
        inserted.map_err(|error| {
            let (message, help) = error.message_and_help();
            Problem::at(place, message, help).into()
        })
    }
}

/// Remedy for a file that cannot be read: what was meant.
fn not_found(path: &Path) -> String {
    let file = path.display().to_string();
    let with_extension = path.with_extension("toml");
    if file == "-" {
        "this command does not read standard input: give a file".to_owned()
    } else if let Some(option) = file.strip_prefix(['—', '–', '−']) {
        format!("an option begins with two hyphens: --{option}")
    } else if file.starts_with('~') {
        "`~` is not expanded here: write the whole path".to_owned()
    } else if path.extension().is_none() && with_extension.is_file() {
        format!("did you mean {}?", with_extension.display())
    } else {
        "`twin examples` lists the scenarios that the program contains".to_owned()
    }
}

/// Describes why a file cannot be read, in words that no system differs in.
fn unreadable(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "cannot be read: there is no such file".to_owned(),
        ErrorKind::IsADirectory => "cannot be read: it is a folder".to_owned(),
        ErrorKind::PermissionDenied => "cannot be read: permission denied".to_owned(),
        _ => format!("cannot be read: {error}"),
    }
}
