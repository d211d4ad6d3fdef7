//! Values that a robot file marks as assumed, in its comments.

use std::collections::BTreeSet;

use toml_edit::{Decor, DocumentMut, Item, Table};

/// Words of comments that mark a value as a choice of the file's author: robot files define them
/// in their first comment.
pub(crate) const MARKS: [&str; 2] = ["ASSUMED", "SCALED"];

/// Keys whose comment, behind the value or in the lines directly above, has one of [`MARKS`].
#[derive(Debug, Default)]
pub(crate) struct Assumed {
    keys: BTreeSet<String>,
}

impl Assumed {
    /// Reads the comments of a robot file. A file that has been read as a robot is TOML.
    pub fn of_text(text: &str) -> Self {
        let mut found = Self::default();
        if let Ok(document) = text.parse::<DocumentMut>() {
            found.table("", document.as_table());
        }
        found
    }

    /// Returns the assumed keys that are `key`, below it or above it.
    pub fn about<'a>(&'a self, key: &str) -> impl Iterator<Item = &'a str> {
        let key = format!("{key}.");
        let keys = self.keys.iter().map(String::as_str);
        keys.filter(move |found| {
            let found = format!("{found}.");
            found.starts_with(&key) || key.starts_with(&found)
        })
    }

    fn table(&mut self, prefix: &str, table: &Table) {
        for (key, item) in table {
            let path = if prefix.is_empty() {
                key.to_owned()
            } else {
                format!("{prefix}.{key}")
            };
            match item {
                Item::Table(inner) => self.table(&path, inner),
                Item::ArrayOfTables(tables) => {
                    for inner in tables {
                        // The comment above the first of them is about all.
                        self.mark(&path, [suffix_or_prefix(inner.decor(), true)]);
                        self.table(&path, inner);
                    }
                }
                Item::Value(value) => {
                    let above = table.key(key).map(toml_edit::Key::leaf_decor);
                    let above = above.and_then(|decor| suffix_or_prefix(decor, true));
                    self.mark(&path, [above, suffix_or_prefix(value.decor(), false)]);
                }
                Item::None => {}
            }
        }
    }

    fn mark<'a>(&mut self, key: &str, comments: impl IntoIterator<Item = Option<&'a str>>) {
        let mut comments = comments.into_iter().flatten();
        if comments.any(|comment| MARKS.iter().any(|mark| comment.contains(mark))) {
            self.keys.insert(key.to_owned());
        }
    }
}

/// Returns the comment before or behind an item: the lines directly above it, without those that a
/// blank line separates, or the rest of its line.
fn suffix_or_prefix(decor: &Decor, above: bool) -> Option<&str> {
    let raw = if above {
        decor.prefix()
    } else {
        decor.suffix()
    };
    let text = raw.and_then(|raw| raw.as_str())?;
    let start = text.rfind("\n\n").map_or(0, |at| at + 2);
    Some(if above { &text[start..] } else { text })
}
