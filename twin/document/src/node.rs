//! A document as a tree whose every node knows its place.

use std::sync::Arc;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::source::{Place, Source};

/// A value and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Node {
    pub value: Value,
    pub place: Place,
}

/// A value of a document. Numbers keep their digits: what is exact in the text stays exact.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    Text(String),
    /// Digits in base ten.
    Integer(String),
    /// A decimal number; may be `inf` or `nan`, which TOML allows and nothing here accepts.
    Float(String),
    Boolean(bool),
    /// A date or a time of day, which nothing here accepts.
    Date,
    List(Vec<Node>),
    Table(Vec<Entry>),
}

/// A key of a table, where the key stands, and its value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Entry {
    pub key: String,
    pub key_place: Place,
    pub node: Node,
}

impl Value {
    /// What it is, with its article.
    pub fn what(&self) -> &'static str {
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
    /// The tree of a TOML table as `toml` read it, in the order of the text.
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

    /// The tree of a TOML value.
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

    /// The node at the path `keys` below this one.
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

    /// The values at and below this node with their dotted paths, of which `path` is that of this
    /// one: all but tables that have entries.
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

    /// Puts `node` at the path `keys` below this one, making tables on the way. The error is the key whose value is
    /// no table.
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
