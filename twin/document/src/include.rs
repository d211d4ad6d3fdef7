//! Overlays: files whose values replace those of the file that includes them.

use std::path::Path;

use toml_edit::{DocumentMut, Item, Table, TableLike, Value};

use crate::document::Document;
use crate::error::{DocumentError, Problem, Warning};
use crate::fitted::FittedRange;

/// Key of the root with the path of an overlay, or a list of them.
const INCLUDE: &str = "include";
/// Table of an overlay with the values.
const VALUES: &str = "values";

impl Document {
    /// Returns the document with the values of the overlays that it includes in place of its own:
    /// their paths are relative to `folder`, and a later one replaces values of those before. The
    /// text is that of the whole, so that it needs no other file.
    ///
    /// # Errors
    /// An overlay that cannot be read, is not TOML or has no table `values`; a value below one that
    /// is no table.
    pub fn with_overlays(self, folder: &Path) -> Result<Self, DocumentError> {
        let Some(place) = self.place(INCLUDE) else {
            return Ok(self);
        };
        let problem = |message: String, help: &str| Problem::at(&place, message, help);
        let parsed: Result<DocumentMut, _> = self.text().parse();
        let mut text = parsed.map_err(|error| problem(error.to_string(), ""))?;
        let named = text
            .remove(INCLUDE)
            .map(|item| names(&item))
            .unwrap_or_default();
        let Some(named) = named else {
            let message = format!("`{INCLUDE}` is neither a path nor a list of paths");
            return Err(problem(message, "write include = \"NAME.fit.toml\"").into());
        };
        let mut fitted = Vec::new();
        for name in &named {
            let overlay = Document::read(&folder.join(name))?;
            let parsed: Result<DocumentMut, _> = overlay.text().parse();
            let parsed = parsed.map_err(|error| problem(error.to_string(), ""))?;
            let Some(values) = parsed.get(VALUES).and_then(Item::as_table_like) else {
                let message = format!("{} has no table `{VALUES}`", overlay.file());
                return Err(problem(message, "`twin fit` writes such files").into());
            };
            let ranges = FittedRange::of(name, parsed.as_table()).map_err(|key| {
                problem(
                    format!("`{key}` of {} is no range", overlay.file()),
                    "write the least and the greatest value, as in [\"100 g\", \"200 g\"]",
                )
            })?;
            fitted.extend(ranges);
            merge(text.as_table_mut(), values).map_err(|key| {
                problem(
                    format!(
                        "`{key}` of {} is below a value that is no table",
                        overlay.file()
                    ),
                    "leave the value out of the overlay",
                )
            })?;
        }
        let plain = |c: char| if c.is_control() { ' ' } else { c };
        let named: String = named.join(", ").chars().map(plain).collect();
        let mut whole = Document::parse(self.file(), &format!("# Included: {named}\n{text}"))?;
        whole.fitted = fitted;
        Ok(whole)
    }

    /// Returns a warning for each value outside of the data to which parameters of an included
    /// overlay were fitted.
    pub fn beyond_fits(&self) -> Vec<Warning> {
        let found = self.fitted.iter();
        found
            .filter_map(|range| range.warning(&self.root))
            .collect()
    }
}

/// Returns the paths of an include; none of another value.
fn names(item: &Item) -> Option<Vec<String>> {
    if let Some(name) = item.as_str() {
        return Some(vec![name.to_owned()]);
    }
    let names = item.as_array()?.iter();
    names.map(|name| name.as_str().map(str::to_owned)).collect()
}

/// Puts values into a table; returns the key of one that has no place.
pub(crate) fn merge(table: &mut dyn TableLike, values: &dyn TableLike) -> Result<(), String> {
    for (key, item) in values.iter() {
        // A value with its interval is a value.
        let inner = item.as_table_like();
        if let Some(inner) = inner.filter(|inner| !inner.contains_key("value")) {
            let there = table
                .entry(key)
                .or_insert_with(|| Item::Table(Table::new()));
            let Some(there) = there.as_table_like_mut() else {
                return Err(key.to_owned());
            };
            merge(there, inner).map_err(|below| format!("{key}.{below}"))?;
        } else if let Some(value) = item.as_value() {
            put(table, key, value.clone());
        } else {
            table.insert(key, item.clone());
        }
    }
    Ok(())
}

/// Sets a value; the comment beside the old one goes, as it describes that.
fn put(table: &mut dyn TableLike, key: &str, mut value: Value) {
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(old) => {
            let prefix = old.decor().prefix().cloned();
            let decor = value.decor_mut();
            if let Some(prefix) = prefix {
                decor.set_prefix(prefix);
            }
            *old = value;
        }
        None => {
            table.insert(key, Item::Value(value));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn folder(name: &str) -> std::path::PathBuf {
        let folder = std::env::temp_dir().join(format!("twin-{}-{name}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        folder
    }

    #[test]
    fn values_of_an_overlay_replace_those_of_the_file() {
        let folder = folder("overlay");
        let overlay = "[fit]\nname = 'x'\n[values]\nmotor.resistance = '3 ohm'  # 95 %\n\
                       load = { offset = '1 rad' }\nnew.key = 2\n";
        fs::write(folder.join("x.fit.toml"), overlay).unwrap();
        let text = "include = 'x.fit.toml'\n[motor]\nresistance = '4 ohm'  # guess\ninertia = '1'\n\
                    [load]\nmass = '1 kg'\n";
        let whole = Document::parse("b.toml", text)
            .unwrap()
            .with_overlays(&folder)
            .unwrap();
        let read = |key: &str| {
            let place = whole.place(key);
            place.map(|place| place.text().to_owned())
        };
        assert_eq!(read("motor.resistance").as_deref(), Some("'3 ohm'"));
        assert_eq!(read("motor.inertia").as_deref(), Some("'1'"));
        assert_eq!(read("load.offset").as_deref(), Some("'1 rad'"));
        assert_eq!(read("new.key").as_deref(), Some("2"));
        assert!(whole.place("include").is_none());
        assert!(whole.text().contains("# 95 %") && !whole.text().contains("guess"));
        // The text alone is the same document.
        let alone = Document::parse("b.toml", whole.text()).unwrap();
        assert!(alone.place("load.mass").is_some());
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn value_beyond_the_data_of_a_fit_is_a_warning() {
        let folder = folder("beyond");
        let overlay = "[fit]\nname = 'x'\n[fit.data]\ncontroller.gain = [100, 800.0]\n\
                       load = { mass = ['0.49 kg', '490 g'], length = ['1 m', '2 m'] }\n\
                       [values]\nmotor.resistance = '3 ohm'\n";
        fs::write(folder.join("x.fit.toml"), overlay).unwrap();
        let warnings = |gain: &str, mass: &str| {
            let text = format!(
                "include = 'x.fit.toml'\n[load]\nmass = '1 t'\n[controller]\ngain = {gain}\n"
            );
            let mut document = Document::parse("b.toml", &text).unwrap();
            document = document.with_overlays(&folder).unwrap();
            let scenario = format!("override.load.mass = '{mass}'");
            let scenario = Document::parse("s.toml", &scenario).unwrap();
            let overrides = scenario.check(|root| root.get("override").unwrap().overrides());
            document.override_with(&overrides.unwrap()).unwrap();
            let found = document.beyond_fits().into_iter();
            let found: Vec<String> = found.map(|it| it.problem.message).collect();
            found
        };
        // Whatever the unit, at both ends; a key that the file does not have is none.
        assert!(warnings("100", "490 g").is_empty());
        assert!(warnings("800", "0.49 kg").is_empty());
        let expected = "`controller.gain` is outside of the data of x.fit.toml, from 100 to 800";
        assert_eq!(warnings("801", "0.49 kg"), [expected]);
        assert_eq!(warnings("99.5", "0.49 kg"), [expected]);
        for mass in ["491 g", "0.489 kg"] {
            let found = warnings("400", mass);
            let [message] = &found[..] else {
                panic!("{found:?}");
            };
            assert!(message.contains("`load.mass`"), "{message}");
        }
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn overlay_that_is_missing_or_has_no_values_is_reported() {
        let folder = folder("no-overlay");
        fs::write(folder.join("empty.toml"), "x = 1\n").unwrap();
        let range = |range: &str| {
            let text = format!("fit.data.load.mass = {range}\n[values]\n");
            fs::write(folder.join("range.toml"), text).unwrap();
        };
        let including = Document::parse("b.toml", "include = 'range.toml'\n").unwrap();
        for sound in ["[100, 100.0]", "[0x10, 1_000]", "['1 g', '1 kg']"] {
            range(sound);
            including.clone().with_overlays(&folder).unwrap();
        }
        for unsound in [
            "[nan, 1]",
            "[2, 1]",
            "['1 g', '1 m']",
            "[1]",
            "[1, 2, 3]",
            "3",
        ] {
            range(unsound);
            assert!(
                including.clone().with_overlays(&folder).is_err(),
                "{unsound}"
            );
        }
        for (name, expected) in [
            ("gone.toml", "gone.toml"),
            ("empty.toml", "no table `values`"),
            ("range.toml", "`fit.data.load.mass` of"),
        ] {
            let text = format!("include = '{name}'\n");
            let document = Document::parse("b.toml", &text).unwrap();
            let error = document.with_overlays(&folder).unwrap_err();
            assert!(error.to_string().contains(expected), "{error}");
        }
        let document = Document::parse("b.toml", "include = 3\n").unwrap();
        assert!(document.with_overlays(&folder).is_err());
        fs::remove_dir_all(folder).unwrap();
    }
}
