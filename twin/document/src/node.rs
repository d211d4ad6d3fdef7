//! A document as a tree of values with positions.

use std::sync::Arc;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

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

    /// Returns the node at the path `keys` below this one.
    pub fn find(&self, keys: &[String]) -> Option<&Node> {
        let [key, rest @ ..] = keys else {
            return Some(self);
        };
        let Value::Table(entries) = &self.value else {
            return None;
        };
        entries
            .iter()
            .find(|entry| entry.key == *key)?
            .node
            .find(rest)
    }

    /// Collects the values at and below this node (all but non-empty tables) with their dotted
    /// paths; `path` is the path of this node.
    pub fn leaves<'n>(&'n self, path: &str, leaves: &mut Vec<(String, &'n Node)>) {
        match &self.value {
            Value::Table(entries) if !entries.is_empty() => {
                for entry in entries {
                    entry.node.leaves(&format!("{path}.{}", entry.key), leaves);
                }
            }
            _ => leaves.push((path.to_owned(), self)),
        }
    }

    /// Inserts `node` at the path `keys` below this one, creating tables as needed. The error is
    /// the first key whose parent is not a table.
    pub fn insert(&mut self, keys: &[String], place: &Place, node: Node) -> Result<(), String> {
        let [key, rest @ ..] = keys else {
            *self = node;
            return Ok(());
        };
        let Value::Table(entries) = &mut self.value else {
            return Err(key.clone());
        };
        let index = if let Some(index) = entries.iter().position(|entry| entry.key == *key) {
            index
        } else {
            entries.push(Entry {
                key: key.clone(),
                key_place: place.clone(),
                node: Node {
                    value: Value::Table(Vec::new()),
                    place: place.clone(),
                },
            });
            entries.len() - 1
        };
        entries[index].node.insert(rest, place, node)
    }
}
