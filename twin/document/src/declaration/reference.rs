//! Reference of the tables of a file, from their declarations.

use super::{Dialect, KeySpec, Presence, TableSpec};

/// A table: its keys, and its place in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TableReference {
    /// Name in the documentation.
    pub name: &'static str,
    /// One-line description.
    pub about: &'static str,
    /// Keys from the root table to this one, for the first place at which it occurs.
    pub path: Vec<&'static str>,
    /// Its keys.
    pub keys: Vec<KeyReference>,
}

/// A key of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyReference {
    /// The key.
    pub name: &'static str,
    /// Description of its values, its default, and the keys that it depends on.
    pub value: String,
    /// One-line description.
    pub about: &'static str,
    /// Line of TOML with the key and those that it requires.
    pub example: &'static str,
    /// Whether it must be present in every table, or with these values of the selector.
    pub is_required: bool,
    /// Whether it is one of the keys of which the table has exactly one.
    pub is_alternative: bool,
    /// Values of the table's key `kind` or `profile` with which it is valid; empty for all.
    pub only_with: &'static [&'static str],
}

fn add<X: Dialect>(table: &TableSpec<X>, path: &[&'static str], tables: &mut Vec<TableReference>) {
    if tables.iter().any(|known| known.name == table.name) {
        return;
    }
    let keys = table.all_keys();
    tables.push(TableReference {
        name: table.name,
        about: table.about,
        path: path.to_vec(),
        keys: keys.iter().map(key_reference).collect(),
    });
    for key in keys {
        for table in key.shape.tables() {
            add(table, &[path, &[key.name]].concat(), tables);
        }
    }
}

fn key_reference<X: Dialect>(key: &KeySpec<X>) -> KeyReference {
    let words = key.shape.words();
    let mut value = vec![match key.presence {
        Presence::Default(toml) if toml != "{}" => {
            format!("{words} (`{}`)", toml.trim_matches('\''))
        }
        Presence::Otherwise(default) => format!("{words} ({default})"),
        _ => words,
    }];
    match key.presence {
        Presence::Required => value.push("*required*".to_owned()),
        Presence::OneOf => value.push("*one of*".to_owned()),
        _ => {}
    }
    value.extend(key.needs.map(|other| format!("requires `{other}`")));
    if !key.only_with.is_empty() {
        value.push(format!("with `{}`", key.only_with.join("`, `")));
    }
    KeyReference {
        name: key.name,
        value: value.join("; "),
        about: key.about,
        example: key.example,
        is_required: key.presence == Presence::Required,
        is_alternative: key.presence == Presence::OneOf,
        only_with: key.only_with,
    }
}

impl TableReference {
    /// Returns the tables of a file, beginning with the root table.
    pub fn of<X: Dialect>(root: &TableSpec<X>) -> Vec<Self> {
        let mut tables = Vec::new();
        add(root, &[], &mut tables);
        tables
    }

    /// Returns the table of the documentation, in Markdown; without examples where there are none.
    pub fn markdown(&self) -> String {
        let has_examples = self.keys.iter().any(|key| !key.example.is_empty());
        let line = |cells: [&str; 3], example: String| {
            let example = if has_examples {
                format!(" {example} |")
            } else {
                String::new()
            };
            format!("| {} |{example}", cells.join(" | "))
        };
        let mut lines = vec![line(["key", "value", "meaning"], "example".to_owned())];
        lines.push(format!(
            "|---|---|---|{}",
            if has_examples { "---|" } else { "" }
        ));
        lines.extend(self.keys.iter().map(|key| {
            let (name, about) = (format!("`{}`", key.name), key.about.trim());
            let cells = [name.as_str(), &key.value, about.trim_end_matches('.')];
            line(cells, format!("`{}`", key.example))
        }));
        lines.join("\n")
    }
}
