//! Tables and values that a document takes from another.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use toml_edit::{DocumentMut, Item, Table, TableLike, TomlError};

use crate::document::Document;
use crate::error::{DocumentError, Problem};
use crate::fitted::FittedRange;
use crate::include::merge;
use crate::library::{Library, is_path};
use crate::near::suggestion;
use crate::node::{Entry, Node, Value};
use crate::source::{Place, Source};

/// Tables and values that a document takes from another of a library.
#[derive(Clone, Copy, Debug)]
pub struct Import<'k> {
    /// Table that gets them; none for the root.
    pub table: Option<&'k str>,
    /// Its key with the name of the other document.
    pub key: &'k str,
    /// What it gets, where the other document has it; none for all.
    pub entries: Option<&'k [&'k str]>,
}

impl Import<'_> {
    /// Whether the entry of this key is imported.
    fn has(&self, key: &str) -> bool {
        self.entries.is_none_or(|entries| entries.contains(&key))
    }
}

impl Document {
    /// Returns the document with the entries of the document of `library` that it names, if it
    /// does: values that it has itself replace those of the other. The text is that of the whole,
    /// so that it needs no other file; places are those in both files. The other document is found
    /// from the folder of this one; for a document in memory it is an embedded one.
    ///
    /// # Errors
    /// The name is no text, there is no document of that name, it cannot be read, or it names
    /// another one itself.
    pub fn with_imported(
        mut self,
        of: &Import<'_>,
        library: &Library,
    ) -> Result<Self, DocumentError> {
        let table = match of.table {
            None => Some(&mut self.root),
            Some(table) => self.root.entry_mut(table),
        };
        let Some(own) = table.and_then(Node::entries_mut) else {
            return Ok(self);
        };
        let Some(index) = own.iter().position(|entry| entry.key == of.key) else {
            return Ok(self);
        };
        let Node { value, place } = own.remove(index).node;
        let Value::Text(name) = value else {
            let message = format!("`{}` is no name of a file", of.key);
            let help = format!("write {} = \"NAME\"", of.key);
            return Err(Problem::at(&place, message, help).into());
        };
        let mut other = find(&name, &place, library, self.folder.as_deref())?;
        if other.root.entry_mut(of.key).is_some() {
            let message = format!("`{name}` has a `{}` itself", of.key);
            return Err(Problem::at(&place, message, "name that, and its values here").into());
        }
        let theirs = other.root.entries_mut().into_iter().flatten();
        for entry in theirs.filter(|entry| of.has(&entry.key)) {
            add(own, entry);
        }
        let text = composed(self.text(), other.text(), of);
        let text = text.map_err(|error| Problem::at(&place, error.message().to_owned(), ""))?;
        self.source = Arc::new(Source::new(self.file(), text));
        self.fitted.extend(ranges(other.fitted, of));
        Ok(self)
    }
}

/// Finds the other document from the folder of the one that names it at `place`.
fn find(
    name: &str,
    place: &Place,
    library: &Library,
    folder: Option<&Path>,
) -> Result<Document, DocumentError> {
    let absent = |folder: &PathBuf| is_path(name) && !folder.join(name).is_file();
    let folder = folder.map(Path::to_owned);
    let (found, known) = match &folder {
        Some(folder) if absent(folder) => (None, library.names(folder)),
        Some(folder) => (library.find(name, folder)?, library.names(folder)),
        None => (library.find_embedded(name)?, library.embedded_names()),
    };
    found.ok_or_else(|| {
        let known = known.iter().map(String::as_str);
        let help = suggestion(name, library.folder, known);
        Problem::at(place, format!("there is no `{name}`"), help).into()
    })
}

/// Adds an entry to those of a table, which keep their values.
fn add(own: &mut Vec<Entry>, entry: &Entry) {
    let Some(there) = own.iter_mut().find(|there| there.key == entry.key) else {
        own.push(entry.clone());
        return;
    };
    let is_interval = there.node.entry_mut("value").is_some();
    if let (Some(inner), Value::Table(theirs), false) =
        (there.node.entries_mut(), &entry.node.value, is_interval)
    {
        for entry in theirs {
            add(inner, entry);
        }
    }
}

/// Returns the text of the document with the entries of the other one.
fn composed(text: &str, other: &str, of: &Import<'_>) -> Result<String, TomlError> {
    let (mut text, theirs): (DocumentMut, DocumentMut) = (text.parse()?, other.parse()?);
    let own = match of.table {
        None => Some(text.as_table_mut() as &mut dyn TableLike),
        Some(table) => text.get_mut(table).and_then(Item::as_table_like_mut),
    };
    if let Some(own) = own {
        own.remove(of.key);
        let theirs = theirs.iter();
        for (key, item) in theirs.filter(|(key, _)| of.has(key)) {
            place_below(own, key, item);
        }
    }
    Ok(text.to_string())
}

/// Puts an item of another text into a table, which keeps its values.
fn place_below(own: &mut dyn TableLike, key: &str, item: &Item) {
    let mut item = item.clone();
    place_anew(&mut item);
    let Some(there) = own.get(key) else {
        own.insert(key, item);
        return;
    };
    // A value in place of a table stays; its reader reports it. One with its interval is a value.
    let values = there.as_table_like().filter(|it| !it.contains_key("value"));
    if let (Some(values), Ok(mut table)) = (values, item.into_table()) {
        // What has no place in the other table stays out; its reader reports it, too.
        merge(&mut table, values).unwrap_or_default();
        own.insert(key, Item::Table(table));
    }
}

/// Takes the places of tables away, which are those of another text.
fn place_anew(item: &mut Item) {
    let of_table = |table: &mut Table| {
        table.set_position(None);
        table.iter_mut().for_each(|(_, item)| place_anew(item));
    };
    match item {
        Item::Table(table) => of_table(table),
        Item::ArrayOfTables(tables) => tables.iter_mut().for_each(of_table),
        _ => {}
    }
}

/// Returns the ranges of the other document as those of this one.
fn ranges(fitted: Vec<FittedRange>, of: &Import<'_>) -> Vec<FittedRange> {
    let fitted = fitted.into_iter();
    let imported = fitted.filter(|range| range.table().is_some_and(|table| of.has(table)));
    imported.map(|range| range.below(of.table)).collect()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    const LIBRARY: Library = Library {
        folder: "parts",
        embedded: &[(
            "motor-a",
            "name = 'A'\nsupply = { voltage = '12 V' }\n[load]\nmass = '1 kg'\n[motor]\n\
             resistance = '4 ohm'  # L\nheat = { capacity = '1 J/K' }\n[gear]\nratio = 3\n",
        )],
    };
    const OF: Import<'_> = Import {
        table: Some("drive"),
        key: "part",
        entries: Some(&["supply", "motor", "gear", "absent"]),
    };

    fn whole(text: &str) -> Result<Document, DocumentError> {
        Document::parse("r.toml", text)?.with_imported(&OF, &LIBRARY)
    }

    #[test]
    fn tables_of_another_document_are_below_the_table_that_names_it() {
        let text = "[a]\nb = 1\n[drive]\npart = 'motor-a'\n[drive.motor]\n\
                    resistance = { value = '5 ohm', from = '4 ohm', to = '6 ohm' }\n[z]\ny = 2\n";
        let whole = whole(text).unwrap();
        let alone = Document::parse("r.toml", whole.text()).unwrap();
        for document in [&whole, &alone] {
            let read = |key: &str| document.place(key).map(|place| place.text().to_owned());
            let resistance = read("drive.motor.resistance.value");
            assert_eq!(resistance.as_deref(), Some("'5 ohm'"));
            let capacity = read("drive.motor.heat.capacity");
            assert_eq!(capacity.as_deref(), Some("'1 J/K'"));
            assert_eq!(read("drive.supply.voltage").as_deref(), Some("'12 V'"));
            assert_eq!(read("drive.gear.ratio").as_deref(), Some("3"));
            let absent = ["drive.part", "drive.load", "load", "name"];
            assert_eq!(absent.map(|key| read(key).is_some()), [false; 4]);
            assert!(read("a.b").is_some() && read("z.y").is_some());
        }
        // Places are those of both files.
        let line = |key: &str| {
            let place = whole.place(key).unwrap();
            (place.source().name.clone(), place.line())
        };
        assert_eq!(line("z.y"), ("r.toml".to_owned(), 8));
        let bench = "parts/motor-a.toml".to_owned();
        assert_eq!(line("drive.gear.ratio"), (bench, 9));
    }

    /// A document for the whole of another.
    const BASE: Import<'_> = Import {
        table: None,
        key: "base",
        entries: None,
    };

    #[test]
    fn whole_document_is_the_base_of_another() {
        const BASES: Library = Library {
            folder: "parts",
            embedded: &[
                (
                    "a",
                    "name = 'A'\nsize = 1\nwidth = { value = 1, from = 0, to = 2 }\n\
                     [leg.x]\nlength = 2\nmass = { value = 3, from = 1, to = 4 }\n\
                     [[mount]]\nat = 1\n[mount.end]\nz = 1\n[[mount]]\nat = 2\n\
                     [ground]\nfriction = 4\n",
                ),
                ("b", "base = 'a'\n"),
            ],
        };
        let read = |text: &str| Document::parse("r.toml", text)?.with_imported(&BASE, &BASES);
        let text = "name = 'B'\nbase = 'a'\nwidth = { value = 7 }\n\
                    [leg.x]\nmass = { value = 5 }\n[other]\nc = 6\n[last]\nd = 8\n";
        let whole = read(text).unwrap();
        let alone = Document::parse("r.toml", whole.text()).unwrap();
        for document in [&whole, &alone] {
            let values = [
                "name",
                "size",
                "leg.x.length",
                "leg.x.mass.value",
                "width.value",
                "mount.0.at",
                "mount.0.end.z",
                "mount.1.at",
                "ground.friction",
                "other.c",
            ];
            let values = values.map(|key| document.place(key).unwrap().text().to_owned());
            assert_eq!(values, ["'B'", "1", "2", "5", "7", "1", "1", "2", "4", "6"]);
            // An interval goes with its value.
            for key in ["base", "width.from", "leg.x.mass.from"] {
                assert!(document.place(key).is_none(), "{key}");
            }
        }
        // Its own tables, then those of the other.
        let headers = whole.text().lines().filter(|line| line.starts_with('['));
        let headers: Vec<&str> = headers.collect();
        assert_eq!(
            headers,
            [
                "[leg.x]",
                "[other]",
                "[last]",
                "[[mount]]",
                "[mount.end]",
                "[[mount]]",
                "[ground]"
            ]
        );
        let error = read("base = 'b'\n").unwrap_err().to_string();
        assert!(error.contains("`b` has a `base` itself"), "{error}");
    }

    #[test]
    fn document_that_names_none_stays() {
        let text = "# as it is\n[drive.motor]\nresistance = '5 ohm'\n";
        assert_eq!(whole(text).unwrap().text(), text);
    }

    #[test]
    fn value_in_place_of_a_table_stays() {
        let whole = whole("[drive]\npart = 'motor-a'\ngear = 3\n").unwrap();
        let gear = whole.place("drive.gear").unwrap();
        assert_eq!((gear.text(), gear.line()), ("3", 3));
    }

    #[test]
    fn wrong_names_are_errors_at_their_place() {
        for (text, message) in [
            ("[drive]\npart = 3\n", "`part` is no name of a file"),
            ("[drive]\npart = 'motor-b'\n", "did you mean `motor-a`?"),
        ] {
            let error = whole(text).unwrap_err().to_string();
            assert!(
                error.contains(message) && error.contains("r.toml:2"),
                "{error}"
            );
        }
    }

    #[test]
    fn files_are_found_beside_the_one_that_names_them() {
        let folder = std::env::temp_dir().join(format!("twin-{}-imported", std::process::id()));
        for (name, text) in [
            ("wholes/a.toml", "[drive]\npart = '../own.toml'\n"),
            ("wholes/b.toml", "[drive]\npart = 'own'\n"),
            ("wholes/c.toml", "[drive]\npart = 'absent.toml'\n"),
            ("wholes/d.toml", "base = '../own.toml'\n"),
            ("own.toml", "include = 'x.fit.toml'\n[gear]\nratio = 1\n"),
            ("parts/own.toml", "[gear]\nratio = 4\n"),
            (
                "x.fit.toml",
                "[fit]\ndata = { gear.ratio = [1, 2] }\n[values]\ngear.ratio = 5\n",
            ),
        ] {
            let path = folder.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        let wholes = Library {
            folder: "wholes",
            embedded: &[],
        };
        let read = |name: &str| {
            let document = wholes.find(name, &folder)?.unwrap();
            document.with_imported(&OF, &LIBRARY)
        };
        let ratio = |document: &Document| {
            let place = document.place("drive.gear.ratio").unwrap();
            place.text().to_owned()
        };
        let by_path = read("a").unwrap();
        assert_eq!(ratio(&by_path), "5");
        // Beyond the data of the overlay that the other file includes.
        assert_eq!(by_path.beyond_fits().len(), 1);
        let derived = wholes.find("d", &folder).unwrap().unwrap();
        let derived = derived.with_imported(&BASE, &LIBRARY).unwrap();
        assert_eq!(derived.beyond_fits().len(), 1);
        assert_eq!(ratio(&read("b").unwrap()), "4");
        let error = read("c").unwrap_err().to_string();
        assert!(error.contains("there is no `absent.toml`"), "{error}");
        assert!(error.contains("c.toml:2"), "{error}");
        fs::remove_dir_all(folder).unwrap();
    }
}
