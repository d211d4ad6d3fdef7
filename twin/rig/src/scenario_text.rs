//! The text of a scenario with other settings and further changes, for another folder.

use std::path::{Component, Path, PathBuf};

use toml_edit::{ArrayOfTables, DocumentMut, InlineTable, Item, Key, Table, TableLike, Value};
use twinrig_document::{DocumentError, Problem};
use twinrig_kernel::SimTime;
use twinrig_robot::RobotFile;
use twinrig_scenario::{Setting, print_duration};

use crate::error::Error;

/// Comment that names a schema.
const SCHEMA: &str = "#:schema ";
/// Key of the robot.
const ROBOT: &str = "robot";

/// Key of the changes of process variables.
const CHANGES: &str = "change";

/// A scenario file whose text is changed.
pub struct ScenarioText<'t> {
    /// Its path, as given.
    pub path: &'t Path,
    /// Its text.
    pub text: &'t str,
    /// Folder that the changed text is written to.
    pub to: &'t Path,
}

/// A change that is appended to a scenario.
pub struct AppendedChange<'t> {
    /// Time.
    pub at: SimTime,
    /// Process variable.
    pub variable: &'t str,
    /// Its new value, with its unit.
    pub to: String,
}

impl ScenarioText<'_> {
    /// Returns the text with `settings` in place of its values, and with `header` as a comment.
    /// Comments and order stay; paths of files are those from the new folder.
    ///
    /// # Errors
    /// A text that is no TOML, or a setting of a key below one that is no table.
    pub fn with(&self, settings: &[Setting], header: &[String]) -> Result<String, Error> {
        self.with_changes(settings, &[], header)
    }

    /// Returns the text as [`Self::with`] does, with `changes` after those that it has.
    ///
    /// # Errors
    /// As [`Self::with`].
    pub fn with_changes(
        &self,
        settings: &[Setting],
        changes: &[AppendedChange<'_>],
        header: &[String],
    ) -> Result<String, Error> {
        let failed = |error: &dyn ToString, help: &str| {
            let file = self.path.display().to_string();
            let problem = Problem::of_file(file, error.to_string(), help.to_owned());
            Error::from(DocumentError {
                problems: vec![problem],
            })
        };
        let parsed: Result<DocumentMut, _> = self.text.parse();
        let mut document = parsed.map_err(|error| failed(&error, ""))?;
        for setting in settings {
            let keys = Key::parse(&setting.key).map_err(|error| failed(&error, ""))?;
            let value = value_of(&setting.value);
            set(document.as_item_mut(), "", &keys, value).map_err(|name| {
                let message = format!("`{name}` is no table");
                failed(&message, "leave out the setting of a key below it")
            })?;
        }
        if !append_changes(&mut document, changes) {
            return Err(failed(&"`change` is no list of tables", ""));
        }
        self.relocate(document.as_table_mut());
        let text = document.to_string();
        Ok(self.headed(&text, header))
    }

    /// Folder of the scenario.
    fn from(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// Rewrites the paths of files, and the name of a robot that another folder has.
    fn relocate(&self, document: &mut Table) {
        for_texts(document, &mut |text| self.relocated(text));
        let robot = document.get_mut(ROBOT).and_then(Item::as_value_mut);
        if let Some(value) = robot
            && let Some(word) = value.as_str().map(str::to_owned)
            && let Ok(file) = RobotFile::find(&word, self.from())
        {
            let there = RobotFile::find(&word, self.to);
            let is_same = there.is_ok_and(|there| there.text() == file.text());
            let path = Path::new(file.file());
            if !is_same && path.is_file() {
                replace(value, relative(path, self.to).into());
            }
        }
    }

    /// Returns the path from the new folder of a file that a text names from the old one.
    fn relocated(&self, text: &str) -> Option<String> {
        let looks_like_a_path = text.contains(['/', '.']) && Path::new(text).is_relative();
        let path = self.from().join(text);
        (looks_like_a_path && path.is_file()).then(|| relative(&path, self.to))
    }

    /// Returns the text with a comment at its beginning, after the line that names a schema.
    fn headed(&self, text: &str, header: &[String]) -> String {
        // Names may have characters that a comment may not have.
        let plain = |c: char| if c.is_control() { ' ' } else { c };
        let line = |line: &String| line.chars().map(plain).collect::<String>();
        let comments: Vec<String> = header.iter().map(|it| format!("# {}", line(it))).collect();
        let comment = comments.join("\n") + "\n";
        let first = text.lines().next().unwrap_or_default();
        let Some(schema) = first.strip_prefix(SCHEMA) else {
            return format!("{comment}\n{text}");
        };
        let schema = self.relocated(schema.trim());
        let line = schema.map_or_else(|| first.to_owned(), |path| format!("{SCHEMA}{path}"));
        let rest = text[first.len()..].trim_start_matches(['\r', '\n']);
        format!("{line}\n{comment}#\n{rest}")
    }
}

/// Returns the value of a setting, which is a text if it is no TOML.
fn value_of(text: &str) -> Value {
    text.parse().unwrap_or_else(|_| Value::from(text))
}

/// Sets the value at a path of keys below `item`, which is called `name`; returns the name of a
/// value without keys, or of a list without the element.
fn set(item: &mut Item, name: &str, keys: &[Key], value: Value) -> Result<(), String> {
    let [key, rest @ ..] = keys else {
        match item.as_value_mut() {
            Some(old) => replace(old, value),
            // An element of tables with headers remains one.
            None => {
                *item = match value {
                    Value::InlineTable(table) if item.is_table() => Item::Table(table.into_table()),
                    value => Item::Value(value),
                }
            }
        }
        return Ok(());
    };
    let other = || name.to_owned();
    if is_only(item, key.get()) && !rest.is_empty() {
        return set(item, name, rest, value);
    }
    let inner = if let Some(table) = item.as_table_like_mut() {
        if table.get(key.get()).is_none() {
            // A short table reads better in the line of its key.
            table.insert(key.get(), Item::Value(InlineTable::new().into()));
        }
        table.get_mut(key.get())
    } else {
        let index = index_of(item, key.get()).ok_or_else(other)?;
        append(item, index);
        item.get_mut(index)
    };
    set(inner.ok_or_else(other)?, key.get(), rest, value)
}

/// Returns the index that a key of a list means: an index, or the name of one element.
fn index_of(list: &Item, key: &str) -> Option<usize> {
    key.parse().ok().or_else(|| {
        let elements = (0..).map_while(|index| list.get(index));
        let mut named = elements
            .enumerate()
            .filter(|(_, it)| name_of(it) == Some(key));
        let (index, _) = named.next()?;
        named.next().is_none().then_some(index)
    })
}

/// Returns the name of an element of a list: that of a table, or its kind if it has none.
fn name_of(element: &Item) -> Option<&str> {
    let text = |key| element.get(key).and_then(Item::as_str);
    text("name").or_else(|| text("kind"))
}

/// Returns whether an item is a table in place of a list of one element, whose name is `key`.
fn is_only(item: &Item, key: &str) -> bool {
    let has = |key| item.as_table_like().is_some_and(|it| it.contains_key(key));
    has("kind") && !has(key) && name_of(item) == Some(key)
}

/// Appends changes to those of a scenario; returns whether that was possible.
fn append_changes(document: &mut DocumentMut, changes: &[AppendedChange<'_>]) -> bool {
    if changes.is_empty() {
        return true;
    }
    let list = document
        .as_table_mut()
        .entry(CHANGES)
        .or_insert_with(|| Item::ArrayOfTables(ArrayOfTables::new()));
    for change in changes {
        let mut table = InlineTable::new();
        let at = print_duration(change.at.since_start());
        for (key, value) in [("at", &*at), ("set", change.variable), ("to", &change.to)] {
            table.insert(key, value.into());
        }
        match list {
            Item::ArrayOfTables(tables) => tables.push(table.into_table()),
            Item::Value(Value::Array(values)) => values.push(table),
            _ => return false,
        }
    }
    true
}

/// Appends an empty table to a list if `index` is the one after its last.
fn append(list: &mut Item, index: usize) {
    match list {
        Item::ArrayOfTables(tables) if tables.len() == index => tables.push(Table::new()),
        Item::Value(Value::Array(values)) if values.len() == index => {
            values.push(InlineTable::new());
        }
        _ => {}
    }
}

/// Replaces a value; the space and the comment around it stay.
fn replace(old: &mut Value, mut value: Value) {
    *value.decor_mut() = old.decor().clone();
    *old = value;
}

/// Replaces texts by those that `change` returns.
fn for_texts(table: &mut dyn TableLike, change: &mut dyn FnMut(&str) -> Option<String>) {
    for (_, item) in table.iter_mut() {
        if let Some(tables) = item.as_array_of_tables_mut() {
            for table in tables.iter_mut() {
                for_texts(table, change);
            }
        } else if let Some(value) = item.as_value_mut() {
            change_value(value, change);
        } else if let Some(table) = item.as_table_like_mut() {
            for_texts(table, change);
        }
    }
}

fn change_value(value: &mut Value, change: &mut dyn FnMut(&str) -> Option<String>) {
    match value {
        Value::String(text) => {
            if let Some(changed) = change(text.value()) {
                replace(value, changed.into());
            }
        }
        Value::Array(values) => values
            .iter_mut()
            .for_each(|value| change_value(value, change)),
        Value::InlineTable(table) => for_texts(table, change),
        _ => {}
    }
}

/// Returns the path of a file from a folder; an absolute one if they have only the root in common.
fn relative(file: &Path, folder: &Path) -> String {
    let absolute = |path: &Path| {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        // A folder that is yet to be made has no canonical path.
        let known = path
            .ancestors()
            .find_map(|it| Some((it, it.canonicalize().ok()?)));
        known.map_or_else(
            || path.clone(),
            |(known, canonical)| {
                let rest = path.strip_prefix(known).unwrap_or(Path::new(""));
                canonical.components().chain(rest.components()).collect()
            },
        )
    };
    let (file, folder) = (absolute(file), absolute(folder));
    let (ours, theirs): (Vec<Component<'_>>, Vec<_>) =
        (file.components().collect(), folder.components().collect());
    let common = ours
        .iter()
        .zip(&theirs)
        .take_while(|(one, other)| one == other)
        .count();
    if common <= 1 {
        return file.display().to_string();
    }
    let up = std::iter::repeat_n(Component::ParentDir, theirs.len() - common);
    let path: PathBuf = up.chain(ours[common..].iter().copied()).collect();
    let text = path.display().to_string();
    // A path in a scenario is told from a name by its slash.
    if text.contains('/') {
        text
    } else {
        format!("./{text}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn setting(key: &str, value: &str) -> Setting {
        Setting {
            origin: String::new(),
            key: key.to_owned(),
            value: value.to_owned(),
        }
    }

    /// Comments, spaces and order stay; new keys are added where they belong.
    #[test]
    fn settings_are_written_into_the_text() {
        let text = "#:schema ./none.json\n# A walk.\nname = \"walk\"   # short\n\n[controller]\n\
                    # Of both.\nhip_height = { fore = \"12 cm\", hind = \"13 cm\" } # m\n\
                    frequency = \"3 Hz\"\n\n[[expect]]\nbody = { fall = false }\n";
        let source = ScenarioText {
            path: Path::new("walk.toml"),
            text,
            to: Path::new("best"),
        };
        let settings = [
            setting("controller.hip_height.fore", "\"11.5 cm\""),
            setting("controller.frequency", "3.5 Hz"),
            setting("plant.ground.friction", "0.5"),
            setting("controller.ramp", "\"1 s\""),
            setting("expect.0.body.fall", "{ height = 0.4 }"),
            setting("expect.1", "{ body = { fall = false } }"),
        ];
        let written = source.with(&settings, &["Best of 7.".to_owned()]).unwrap();
        let expected = "#:schema ./none.json\n# Best of 7.\n#\n# A walk.\n\
                        name = \"walk\"   # short\nplant = { ground = { friction = 0.5 } }\n\n\
                        [controller]\n# Of both.\n\
                        hip_height = { fore = \"11.5 cm\", hind = \"13 cm\" } # m\n\
                        frequency = \"3.5 Hz\"\nramp = \"1 s\"\n\n\
                        [[expect]]\nbody = { fall = { height = 0.4 } }\n\n\
                        [[expect]]\nbody = { fall = false }\n";
        assert_eq!(written, expected);
        let error = source.with(&[setting("name.first", "1")], &[]).unwrap_err();
        assert!(error.to_string().contains("`name` is no table"), "{error}");
    }

    /// As in the settings of a run, an element of a list has its index or its name as key.
    #[test]
    fn elements_have_names() {
        let with = |text: &str, key: &str| {
            let source = ScenarioText {
                path: Path::new("walk.toml"),
                text,
                to: Path::new("best"),
            };
            source.with(&[setting(key, "-1")], &[])
        };
        let list = "[[bus]]\nkind = \"sbcp\"\n\n[[bus]]\nkind = \"rb110\"\nname = \"arm\"\n";
        let written = with(list, "bus.arm.limit").unwrap();
        assert_eq!(written, format!("\n\n{list}limit = -1\n"));
        let first = "\n\n[[bus]]\nkind = \"sbcp\"\nlimit = -1\n";
        assert!(with(list, "bus.sbcp.limit").unwrap().starts_with(first));
        with(list, "bus.rb110.limit").unwrap_err();
        with(&list.repeat(2), "bus.arm.limit").unwrap_err();
        let only = with("bus = { kind = \"sbcp\" }\n", "bus.sbcp.limit").unwrap();
        assert_eq!(only, "\n\nbus = { kind = \"sbcp\" , limit = -1 }\n");
    }

    #[test]
    fn changes_follow_those_of_the_text() {
        let change = AppendedChange {
            at: SimTime::from_nanos(1_500_000_000),
            variable: "frequency",
            to: "2.5 Hz".to_owned(),
        };
        let with = |text: &str| {
            let source = ScenarioText {
                path: Path::new("walk.toml"),
                text,
                to: Path::new("."),
            };
            source.with_changes(&[], std::slice::from_ref(&change), &[])
        };
        let appended = "[[change]]\nat = \"1500 ms\"\nset = \"frequency\"\nto = \"2.5 Hz\"\n";
        let alone = with("duration = \"3 s\"\n").unwrap();
        assert!(alone.ends_with(&format!("\n{appended}")), "{alone}");
        let first = "[[change]]\nat = \"1 s\"\nset = \"ramp\"\nby = \"1 s\"\n\n[record]\n";
        let after = with(first).unwrap();
        let places = ["ramp", appended, "[record]"].map(|it| after.find(it).unwrap());
        assert!(places.is_sorted(), "{after}");
        let inline = with("change = [{ at = \"1 s\", set = \"ramp\", to = 1 }]\n").unwrap();
        assert!(inline.contains("}, { at = \"1500 ms\""), "{inline}");
        let error = with("change = 1\n").unwrap_err();
        assert!(error.to_string().contains("no list of tables"), "{error}");
    }

    #[test]
    fn paths_lead_from_the_new_folder_to_the_file() {
        for (file, folder, expected) in [
            (
                "/none/a/robots/x.toml",
                "/none/a/best/walk",
                "../../robots/x.toml",
            ),
            ("/none/a/x.toml", "/none/a", "./x.toml"),
            ("/none/a/x.toml", "/nowhere", "/none/a/x.toml"),
        ] {
            assert_eq!(relative(Path::new(file), Path::new(folder)), expected);
        }
    }
}
