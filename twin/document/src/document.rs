//! A document: one TOML file, and what was set on top of it.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use toml::de::{DeTable, DeValue};

use crate::error::{DocumentError, Problem, Warning};
use crate::file::{TEXT_MOST, read_file};
use crate::node::{Node, Value};
use crate::source::{Place, Source};
use crate::table::{Problems, Reported, Table};

/// Code of the warning that a key is set twice.
pub(crate) const SET_TWICE: &str = "set-twice";

/// A document in memory. See the crate's page for an example.
#[derive(Clone, Debug)]
pub struct Document {
    source: Arc<Source>,
    root: Node,
    warnings: Vec<Warning>,
}

impl Document {
    /// Reads the file at `path`; messages show the path as it is given here.
    ///
    /// # Errors
    /// The file cannot be read or is too long ([`read_file`]), is not UTF-8, or is not TOML.
    pub fn read(path: &Path) -> Result<Self, DocumentError> {
        let file = path.display().to_string();
        match read_file(path, TEXT_MOST) {
            Err(error) => {
                Err(Problem::of_file(file, format!("cannot be read: {error}"), "").into())
            }
            Ok(bytes) => Document::from_bytes(&file, bytes),
        }
    }

    /// Reads a document out of the bytes of `file`.
    ///
    /// # Errors
    /// They are not UTF-8 or not TOML.
    pub fn from_bytes(file: &str, bytes: Vec<u8>) -> Result<Self, DocumentError> {
        match String::from_utf8(bytes) {
            Ok(text) => Document::parse(file, &text),
            Err(error) => {
                let at = error.utf8_error().valid_up_to();
                let before = &error.as_bytes()[..at];
                let line = before.split(|&byte| byte == b'\n').count();
                let message = format!("line {line} is not UTF-8 text");
                Err(Problem::of_file(file, message, "save the file as UTF-8").into())
            }
        }
    }

    /// Reads a document out of `text`, which messages call `file`.
    ///
    /// # Errors
    /// It is not TOML; every mistake that can be told apart is reported.
    pub fn parse(file: &str, text: &str) -> Result<Self, DocumentError> {
        let source = Arc::new(Source::new(file, text.to_owned()));
        let (table, errors) = DeTable::parse_recoverable(text);
        if errors.is_empty() {
            let root = Node::of_table(&table, &source);
            return Ok(Document {
                source,
                root,
                warnings: Vec::new(),
            });
        }
        let problems = errors.iter().map(|error| toml_problem(error, &source));
        Err(DocumentError::of(problems.collect()))
    }

    /// The name that messages show.
    pub fn file(&self) -> &str {
        &self.source.name
    }

    /// The text as it was read, without what was set on top of it.
    pub fn text(&self) -> &str {
        &self.source.text
    }

    /// Puts `value` at the dotted `key`, in place of what was there or new: `set("--set",
    /// "plant.step", "0.5 ms")`. A value that is not TOML is taken as a text, so that a shell needs
    /// no second pair of quotes. Messages about the value show `origin` for a file. What an earlier
    /// call put there is a warning: the last one counts.
    ///
    /// # Errors
    /// The key is not a dotted key, or leads through something that is not a table.
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
            // An inline table on the right is the value itself, not a part of the key.
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

    /// Notes the values at and below the path `keys` that do not stand in the file itself: they are
    /// about to be replaced.
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

    /// Puts every entry of `overrides` (a table of another document) in place of what has the same key here. A key may
    /// be a dotted path, quoted or not; a table replaces only the keys that it holds.
    ///
    /// # Errors
    /// A key leads through something that is not a table.
    pub fn override_with(&mut self, overrides: &Overrides) -> Result<(), DocumentError> {
        for (keys, place, node) in &overrides.leaves {
            self.insert(keys, place, node.clone())?;
        }
        Ok(())
    }

    /// Reads the document with `read`, which is given its outermost table, and gives what `read` gives if nothing was
    /// wrong: no accessor complained and no key was left unasked for.
    ///
    /// # Errors
    /// Everything that was wrong.
    pub fn check<T>(
        &self,
        read: impl FnOnce(&Table<'_>) -> Result<T, Reported>,
    ) -> Result<T, DocumentError> {
        self.check_and_warn(read).map(|(value, _)| value)
    }

    /// The same with the warnings of `read` and of [`Document::set`], by place.
    ///
    /// # Errors
    /// Everything that was wrong.
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
        self.root.insert(keys, place, node).map_err(|key| {
            let message = format!("`{key}` cannot be set: what it is a part of is not a table");
            Problem::at(place, message, "").into()
        })
    }
}

/// Values that are to replace those of another document; made by [`crate::Item::overrides`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides {
    pub(crate) leaves: Vec<(Vec<String>, Place, Node)>,
}

impl Overrides {
    /// Whether nothing is replaced.
    pub fn is_empty(&self) -> bool {
        self.leaves.is_empty()
    }

    /// The dotted keys of what is replaced.
    pub fn keys(&self) -> impl Iterator<Item = String> + use<'_> {
        self.leaves.iter().map(|(keys, ..)| keys.join("."))
    }

    /// Keys that stand here twice, in different spellings: `leg.aslp.l1` and `"leg.aslp".l1`. Each
    /// but the last is shown.
    pub(crate) fn set_twice(&self) -> Vec<Problem> {
        let mut last: BTreeMap<&[String], &Place> = BTreeMap::new();
        let mut problems = Vec::new();
        for (keys, place, _) in &self.leaves {
            if let Some(earlier) = last.insert(keys, place) {
                let message = format!("`{}` is set twice, and the last one counts", keys.join("."));
                problems.push(Problem::at(earlier, message, "leave one of them out"));
            }
        }
        problems
    }

    pub(crate) fn of(node: &Node) -> Self {
        let mut leaves = Vec::new();
        collect(node, &mut Vec::new(), &mut leaves);
        Overrides { leaves }
    }
}

fn collect(node: &Node, path: &mut Vec<String>, leaves: &mut Vec<(Vec<String>, Place, Node)>) {
    let Value::Table(entries) = &node.value else {
        return;
    };
    for entry in entries {
        let depth = path.len();
        path.extend(entry.key.split('.').map(str::to_owned));
        if matches!(entry.node.value, Value::Table(_)) {
            collect(&entry.node, path, leaves);
        } else {
            leaves.push((path.clone(), entry.key_place.clone(), entry.node.clone()));
        }
        path.truncate(depth);
    }
}

/// Whether `text` is TOML and one entry, no more.
fn is_entry(text: &str) -> bool {
    DeTable::parse(text).is_ok_and(|table| table.get_ref().len() == 1) && !text.contains('\n')
}

/// `value` as a TOML text.
/// `value` as a TOML string; control characters, which no key or name has, become blanks.
pub fn quoted(value: &str) -> String {
    let mut out = String::from("\"");
    for c in value.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out.push('"');
    debug_assert!(DeValue::parse(&out).is_ok());
    out
}

fn toml_problem(error: &toml::de::Error, source: &Arc<Source>) -> Problem {
    let span = error.span().unwrap_or(0..0);
    let place = Place::new(Arc::clone(source), span);
    let mut lines = error.message().lines();
    let message = format!(
        "this is not TOML: {}",
        lines.next().unwrap_or("cannot be read")
    );
    let help = lines.collect::<Vec<_>>().join("; ");
    Problem::at(&place, message, help)
}
