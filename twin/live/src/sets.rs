//! Named sets of values of process variables: files with the table `[controller]` of a scenario.

use std::fs;
use std::path::{Path, PathBuf};

use toml_edit::{DocumentMut, InlineTable, Item, TableLike, TomlError, Value, table};
use twinrig_document::{TEXT_MOST, parse_quantity, print_quantity, read_file, visible};
use twinrig_kernel::Unit;
use twinrig_runtime::ProcessVariable;

/// Table of the values.
const TABLE: &str = "controller";
/// Length of a name at most.
const LONGEST: usize = 64;

/// The sets of a folder.
pub(crate) struct Sets {
    folder: PathBuf,
    names: Vec<String>,
}

impl Sets {
    pub(crate) fn new(folder: PathBuf) -> Self {
        let files = fs::read_dir(&folder).into_iter().flatten().flatten();
        let names = files.filter_map(|file| {
            let path = file.path();
            let name = path.file_stem()?.to_str()?.to_owned();
            let is_set = path.extension().is_some_and(|it| it == "toml");
            (is_set && is_name(&name)).then_some(name)
        });
        let mut names: Vec<String> = names.collect();
        names.sort();
        Self { folder, names }
    }

    /// Returns the names, sorted.
    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    fn path(&self, name: &str) -> Result<PathBuf, String> {
        if is_name(name) {
            return Ok(self.folder.join(format!("{name}.toml")));
        }
        Err(format!(
            "`{}` is no name of a set: letters, digits, - and _, at most {LONGEST}",
            visible(name)
        ))
    }

    /// Writes values under a name; those of an earlier set of this name are replaced.
    pub(crate) fn save(
        &mut self,
        name: &str,
        comment: &str,
        values: &[(&ProcessVariable, f64)],
    ) -> Result<(), String> {
        let path = self.path(name)?;
        let failed = |error: std::io::Error| format!("cannot write {}: {error}", path.display());
        fs::create_dir_all(&self.folder).map_err(failed)?;
        write_whole(&path, &text(comment, values)).map_err(failed)?;
        if let Err(place) = self.names.binary_search_by(|it| (**it).cmp(name)) {
            self.names.insert(place, name.to_owned());
        }
        Ok(())
    }

    /// Reads the values of a set, in the order of the variables.
    pub(crate) fn read(
        &self,
        name: &str,
        variables: &[ProcessVariable],
    ) -> Result<Vec<(String, f64)>, String> {
        let path = self.path(name)?;
        let at = |why: String| format!("{}: {why}", path.display());
        let text = read_file(&path, TEXT_MOST).map_err(|error| at(error.to_string()))?;
        let text = String::from_utf8(text).map_err(|error| at(error.to_string()))?;
        values(&text, variables).map_err(at)
    }
}

fn is_name(name: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_".contains(c);
    (1..=LONGEST).contains(&name.len()) && name.chars().all(plain)
}

/// Writes a file whole, or not at all.
pub(crate) fn write_whole(path: &Path, text: &str) -> std::io::Result<()> {
    let unfinished = path.with_extension("toml.part");
    fs::write(&unfinished, text)?;
    fs::rename(&unfinished, path)
}

/// Returns the text of a set: variables of groups of legs are in a table of their group's key.
fn text(comment: &str, values: &[(&ProcessVariable, f64)]) -> String {
    let mut document = DocumentMut::new();
    document[TABLE] = table();
    let table = &mut document[TABLE];
    for (variable, value) in values {
        let value: Value = match variable.unit() {
            Unit::One => (*value).into(),
            unit => print_quantity(*value, unit).into(),
        };
        match variable.name().split_once('/') {
            None => table[variable.name()] = Item::Value(value),
            Some((key, group)) => {
                let groups = &mut table[key];
                if groups.is_none() {
                    *groups = Item::Value(InlineTable::new().into());
                }
                groups[group] = Item::Value(value);
            }
        }
    }
    let plain = |c: char| if c.is_control() { ' ' } else { c };
    let comment: String = comment.chars().map(plain).collect();
    format!("# {comment}\n{document}")
}

/// Returns the values of a set; each of its keys is a variable.
fn values(text: &str, variables: &[ProcessVariable]) -> Result<Vec<(String, f64)>, String> {
    let document = text.parse::<DocumentMut>();
    let document = document.map_err(|error: TomlError| error.to_string())?;
    let table = document.get(TABLE).and_then(Item::as_table_like);
    let table = table.ok_or_else(|| format!("there is no table [{TABLE}]"))?;
    let mut found = Vec::new();
    for (name, item) in entries(table) {
        let variable = variables.iter().position(|it| it.name() == name);
        let index = variable.ok_or_else(|| format!("there is no process variable `{name}`"))?;
        let value = number(item, variables[index].unit());
        let value = value.ok_or_else(|| format!("`{name}` is no quantity in its unit"))?;
        found.push((index, name, value));
    }
    found.sort_by_key(|(index, ..)| *index);
    let found = found.into_iter().map(|(_, name, value)| (name, value));
    Ok(found.collect())
}

/// Returns the names of variables in a table, with their items.
fn entries(table: &dyn TableLike) -> Vec<(String, &Item)> {
    let mut entries = Vec::new();
    for (key, item) in table.iter() {
        match item.as_table_like() {
            Some(groups) => {
                let groups = groups.iter();
                entries.extend(groups.map(|(group, item)| (format!("{key}/{group}"), item)));
            }
            None => entries.push((key.to_owned(), item)),
        }
    }
    entries
}

fn number(item: &Item, unit: Unit) -> Option<f64> {
    if let Some(text) = item.as_str() {
        return parse_quantity(text, unit).ok();
    }
    #[expect(
        clippy::cast_precision_loss,
        reason = "a value that someone has written"
    )]
    let whole = item.as_integer().map(|value| value as f64);
    item.as_float().or(whole).filter(|_| unit == Unit::One)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn variables() -> Vec<ProcessVariable> {
        vec![
            ProcessVariable::new("frequency", Unit::Hertz, 0.0.., 3.0),
            ProcessVariable::new("duty", Unit::One, 0.0..=1.0, 0.5),
            ProcessVariable::new("hip_height/fore", Unit::Meter, 0.0.., 0.14),
            ProcessVariable::new("hip_height/hind", Unit::Meter, 0.0.., 0.15),
        ]
    }

    /// The text is a table of a scenario, and has each bit of the values.
    #[test]
    fn sets_are_read_as_they_were_saved() {
        let variables = variables();
        let values = [0.1 + 0.2, 1.0 / 3.0, 1e-9, 0.123];
        let set: Vec<_> = variables.iter().zip(values).collect();
        let text = text("One\nline.", &set);
        assert_eq!(
            text,
            "# One line.\n[controller]\nfrequency = \"0.30000000000000004 Hz\"\n\
             duty = 0.3333333333333333\n\
             hip_height = { fore = \"0.000000001 m\", hind = \"0.123 m\" }\n"
        );
        let read = super::values(&text, &variables).unwrap();
        let expected = variables.iter().map(|it| it.name().to_owned()).zip(values);
        assert_eq!(read, expected.collect::<Vec<_>>());
    }

    #[test]
    fn refusals_of_sets_name_the_key() {
        let read = |text: &str| values(text, &variables()).unwrap_err();
        assert_eq!(read("a = 1"), "there is no table [controller]");
        assert_eq!(
            read("[controller]\npace = 1"),
            "there is no process variable `pace`"
        );
        assert_eq!(
            read("[controller]\nfrequency = \"3 m\""),
            "`frequency` is no quantity in its unit"
        );
        assert!(
            read("[controller").contains("TOML"),
            "{}",
            read("[controller")
        );
        let folder = twinrig_testing::folder::Folder::new("sets");
        let mut sets = Sets::new(folder.path().join("sets"));
        let error = sets.save("../soft", "", &[]).unwrap_err();
        assert!(
            error.starts_with("`../soft` is no name of a set"),
            "{error}"
        );
        sets.save("soft", "", &[]).unwrap();
        assert_eq!(sets.names(), ["soft"]);
        assert_eq!(Sets::new(folder.path().join("sets")).names(), ["soft"]);
    }
}
