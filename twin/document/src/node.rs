//! A document as a tree of values with positions.

use std::sync::Arc;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::near::nearest;
use crate::source::{Place, Source};

/// A value with its position.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Node {
    pub value: Value,
    pub place: Place,
}

/// A value of a document. Numbers keep their digits, so that exact decimal values remain exact.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    Text(String),
    /// Decimal digits.
    Integer(String),
    /// Decimal number; may be `inf` or `nan`, which are valid TOML and rejected by every accessor.
    Float(String),
    Boolean(bool),
    /// Date or time of day; rejected by every accessor.
    Date,
    List(Vec<Node>),
    Table(Vec<Entry>),
}

/// Reason why a value cannot be inserted.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum InsertError {
    /// The parent of a key has no keys.
    NoTable { key: String },
    /// A list has no element of that index or name.
    NoElement {
        key: String,
        count: usize,
        /// Name of an element that resembles the key.
        near: Option<String>,
    },
}

impl InsertError {
    /// Message and remedy.
    pub fn message_and_help(&self) -> (String, String) {
        match self {
            Self::NoTable { key } => (
                format!("`{key}` cannot be set: its parent is not a table"),
                "set the whole parent, or make it a table in the file: `{ … }`".to_owned(),
            ),
            Self::NoElement { key, count, near } => {
                let elements = if *count == 1 { "element" } else { "elements" };
                let message =
                    format!("`{key}` cannot be set: its parent is a list with {count} {elements}");
                let mut help = match count {
                    0 => "0 appends the first one".to_owned(),
                    1 => "0 is its element, and 1 appends another one".to_owned(),
                    _ => {
                        let last = count - 1;
                        format!("0 to {last} are its elements, and {count} appends another one")
                    }
                };
                if let Some(near) = near {
                    help = format!("did you mean `{near}`? {help}");
                }
                (message, help)
            }
        }
    }
}

/// Returns the index that a key of a list means: an index, or the name of one element.
fn index_of(items: &[Node], key: &str) -> Option<usize> {
    if let Ok(index) = key.parse::<usize>() {
        // One spelling for each element.
        return (index.to_string() == key).then_some(index);
    }
    let mut named = (0..items.len()).filter(|&index| items[index].name() == Some(key));
    named.next().filter(|_| named.next().is_none())
}

/// Returns a name as a part of a dotted key.
fn key_of(name: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if !name.is_empty() && name.chars().all(is_bare) {
        return name.to_owned();
    }
    format!("{name:?}")
}

/// A key of a table, its position and its value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Entry {
    pub key: String,
    pub key_place: Place,
    pub node: Node,
}

impl Value {
    /// Name of the type with its article.
    pub fn type_name(&self) -> &'static str {
        match self {
            Value::Text(_) => "a text",
            Value::Integer(_) => "a whole number",
            Value::Float(_) => "a number",
            Value::Boolean(_) => "true or false",
            Value::Date => "a date",
            Value::List(_) => "a list",
            Value::Table(_) => "a table",
        }
    }
}

impl Node {
    /// Converts a parsed TOML table, in the order of the text.
    pub fn of_table(table: &Spanned<DeTable<'_>>, source: &Arc<Source>) -> Node {
        let place = Place::new(Arc::clone(source), table.span());
        let mut entries: Vec<_> = table.get_ref().iter().collect();
        entries.sort_by_key(|(key, value)| (key.span().start, value.span().start));
        let entries = entries
            .into_iter()
            .map(|(key, value)| Entry {
                key: key.get_ref().to_string(),
                key_place: Place::new(Arc::clone(source), key.span()),
                node: Node::of_value(value, source),
            })
            .collect();
        Node {
            value: Value::Table(entries),
            place,
        }
    }

    /// Converts a parsed TOML value.
    pub fn of_value(value: &Spanned<DeValue<'_>>, source: &Arc<Source>) -> Node {
        let place = Place::new(Arc::clone(source), value.span());
        let value = match value.get_ref() {
            DeValue::String(text) => Value::Text(text.to_string()),
            DeValue::Integer(number) => {
                let value = i128::from_str_radix(number.as_str(), number.radix());
                Value::Integer(value.map_or_else(|_| number.to_string(), |n| n.to_string()))
            }
            DeValue::Float(number) => Value::Float(number.as_str().to_owned()),
            DeValue::Boolean(value) => Value::Boolean(*value),
            DeValue::Datetime(_) => Value::Date,
            DeValue::Array(items) => Value::List(
                items
                    .iter()
                    .map(|item| Node::of_value(item, source))
                    .collect(),
            ),
            DeValue::Table(table) => {
                return Node::of_table(&Spanned::new(value.span(), table.clone()), source);
            }
        };
        Node { value, place }
    }

    /// Returns the entries of a table.
    pub fn entries_mut(&mut self) -> Option<&mut Vec<Entry>> {
        match &mut self.value {
            Value::Table(entries) => Some(entries),
            _ => None,
        }
    }

    /// Returns the value of a key of a table.
    pub fn entry_mut(&mut self, key: &str) -> Option<&mut Node> {
        let mut entries = self.entries_mut()?.iter_mut();
        let entry = entries.find(|entry| entry.key == key)?;
        Some(&mut entry.node)
    }

    fn text(&self, key: &str) -> Option<&str> {
        let Value::Table(entries) = &self.value else {
            return None;
        };
        match &entries.iter().find(|entry| entry.key == key)?.node.value {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }

    /// Returns the name of an element of a list: that of a table, or its kind if it has none.
    pub fn name(&self) -> Option<&str> {
        self.text("name").or_else(|| self.text("kind"))
    }

    /// Whether this is a table in place of a list of one element, whose name is `key`.
    fn is_only(&self, key: &str) -> bool {
        self.text("kind").is_some() && self.name() == Some(key)
    }

    /// Returns the node at the path `keys` below this one; an element of a list has its index,
    /// from 0, or its name as key.
    pub fn find(&self, keys: &[String]) -> Option<&Node> {
        let [key, rest @ ..] = keys else {
            return Some(self);
        };
        let node = match &self.value {
            Value::Table(entries) => match entries.iter().find(|entry| entry.key == *key) {
                Some(entry) => &entry.node,
                None if self.is_only(key) => self,
                None => return None,
            },
            Value::List(items) => items.get(index_of(items, key)?)?,
            _ => return None,
        };
        node.find(rest)
    }

    /// Collects the values at and below this node (all but non-empty tables) with their dotted
    /// paths; `path` is the path of this node. Elements of a list follow it where they are from
    /// another source.
    pub fn leaves<'n>(&'n self, path: &str, leaves: &mut Vec<(String, &'n Node)>) {
        match &self.value {
            Value::Table(entries) if !entries.is_empty() => {
                for entry in entries {
                    entry.node.leaves(&format!("{path}.{}", entry.key), leaves);
                }
            }
            Value::List(items) => {
                leaves.push((path.to_owned(), self));
                let mut inner = Vec::new();
                for (index, item) in items.iter().enumerate() {
                    item.leaves(&format!("{path}.{index}"), &mut inner);
                }
                inner.retain(|(_, leaf)| !leaf.place.is_beside(&self.place));
                leaves.extend(inner);
            }
            _ => leaves.push((path.to_owned(), self)),
        }
    }

    /// Inserts `node` at the path `keys` below this one, creating tables as needed. An element of a
    /// list has its index or its name as key; the index after the last one appends an element, and
    /// the only element may be a table in place of a list. A missing parent becomes a table also if
    /// the key is a number: tables may have such keys.
    pub fn insert(
        &mut self,
        keys: &[String],
        place: &Place,
        node: Node,
    ) -> Result<(), InsertError> {
        let [key, rest @ ..] = keys else {
            *self = node;
            return Ok(());
        };
        let empty = || Node {
            value: Value::Table(Vec::new()),
            place: place.clone(),
        };
        let is_only = !rest.is_empty() && self.is_only(key);
        let entries = match &mut self.value {
            Value::Table(entries) => entries,
            Value::List(items) => {
                let count = items.len();
                let index = index_of(items, key).filter(|&index| index <= count);
                let index = index.ok_or_else(|| InsertError::NoElement {
                    key: key.clone(),
                    count,
                    near: nearest(key, items.iter().filter_map(Node::name)).map(key_of),
                })?;
                if index == count {
                    items.push(empty());
                }
                return items[index].insert(rest, place, node);
            }
            _ => return Err(InsertError::NoTable { key: key.clone() }),
        };
        let known = entries.iter().position(|entry| entry.key == *key);
        if known.is_none() && is_only {
            return self.insert(rest, place, node);
        }
        let index = if let Some(index) = known {
            if rest.is_empty() {
                // Messages about the key point to where its value is from.
                entries[index].key_place = place.clone();
            }
            index
        } else {
            entries.push(Entry {
                key: key.clone(),
                key_place: place.clone(),
                node: empty(),
            });
            entries.len() - 1
        };
        entries[index].node.insert(rest, place, node)
    }
}
