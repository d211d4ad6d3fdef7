//! Tables that a document takes from another.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use toml_edit::{DocumentMut, Item, Table, TomlError};

use crate::document::Document;
use crate::error::{DocumentError, Problem};
use crate::fitted::FittedRange;
use crate::include::merge;
use crate::library::{Library, is_path};
use crate::near::suggestion;
use crate::node::{Entry, Node, Value};
use crate::source::{Place, Source};

/// Tables of other documents for one table of a document.
#[derive(Clone, Copy, Debug)]
pub struct ImportedTables<'k> {
    /// Table that gets them.
    pub table: &'k str,
    /// Its key with the name of the other document.
    pub key: &'k str,
    /// The tables that it gets, where the other document has them.
    pub tables: &'k [&'k str],
}

impl Document {
    /// Returns the document with tables of the document of `library` that it names, if it does:
    /// values that it has itself replace those of the other. The text is that of the whole, so that
    /// it needs no other file; places are those in both files. The other document is found from the
    /// folder of this one; for a document in memory it is an embedded one.
    ///
    /// # Errors
    /// The name is no text, there is no document of that name, or it cannot be read.
    pub fn with_imported(
        mut self,
        of: &ImportedTables<'_>,
        library: &Library,
    ) -> Result<Self, DocumentError> {
        let Some(place) = self.place(&format!("{}.{}", of.table, of.key)) else {
            return Ok(self);
        };
        let Some(own) = self.root.entry_mut(of.table).and_then(Node::entries_mut) else {
            return Ok(self);
        };
        let named = own.iter().position(|entry| entry.key == of.key);
        let named = named.map(|index| own.remove(index).node.value);
        let Some(Value::Text(name)) = named else {
            let message = format!("`{}` is no name of a file", of.key);
            let help = format!("write {} = \"NAME\"", of.key);
            return Err(Problem::at(&place, message, help).into());
        };
        let other = find(&name, &place, library, self.folder.as_deref())?;
        if let Value::Table(theirs) = &other.root.value {
            let theirs = theirs.iter();
            theirs
                .filter(|entry| of.tables.contains(&entry.key.as_str()))
                .for_each(|entry| add(own, entry));
        }
        let text = composed(self.text(), other.text(), of).map_err(|error| {
            let help = "write its tables as [tables]";
            Problem::at(&place, error.message().to_owned(), help)
        })?;
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

/// Returns the text of the document with the tables of the other one.
fn composed(text: &str, other: &str, of: &ImportedTables<'_>) -> Result<String, TomlError> {
    let (mut text, theirs): (DocumentMut, DocumentMut) = (text.parse()?, other.parse()?);
    let Some(own) = text.get_mut(of.table).and_then(Item::as_table_like_mut) else {
        return Ok(text.to_string());
    };
    own.remove(of.key);
    for key in of.tables {
        let table = theirs.get(key).cloned().map(Item::into_table);
        let Some(Ok(mut table)) = table else {
            continue;
        };
        place_anew(&mut table);
        match own.get(key).map(Item::as_table_like) {
            // No table: its reader reports it.
            Some(None) => continue,
            Some(Some(values)) => {
                // What has no place in the other table stays out; its reader reports it, too.
                merge(&mut table, values).unwrap_or_default();
            }
            None => {}
        }
        own.insert(key, Item::Table(table));
    }
    Ok(text.to_string())
}

/// Takes the places of tables away, which are those of another text.
fn place_anew(table: &mut Table) {
    table.set_position(None);
    let items = table.iter_mut().map(|(_, item)| item);
    items.filter_map(Item::as_table_mut).for_each(place_anew);
}

/// Returns the ranges of the other document in the table.
fn ranges(fitted: Vec<FittedRange>, of: &ImportedTables<'_>) -> impl Iterator<Item = FittedRange> {
    let fitted = fitted.into_iter();
    let imported = fitted.filter(|range| range.is_of(of.tables));
    imported.map(|range| range.below(of.table))
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
    const OF: ImportedTables<'_> = ImportedTables {
        table: "drive",
        key: "part",
        tables: &["supply", "motor", "gear", "absent"],
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
        assert_eq!(ratio(&read("b").unwrap()), "4");
        let error = read("c").unwrap_err().to_string();
        assert!(error.contains("there is no `absent.toml`"), "{error}");
        assert!(error.contains("c.toml:2"), "{error}");
        fs::remove_dir_all(folder).unwrap();
    }
}
