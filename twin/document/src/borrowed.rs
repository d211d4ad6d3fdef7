//! Tables that a document takes from another.

use std::path::Path;

use toml_edit::{DocumentMut, Item};

use crate::document::Document;
use crate::error::{DocumentError, Problem};
use crate::fitted::FittedRange;
use crate::include::merge;
use crate::library::Library;
use crate::near::suggestion;

/// Tables of other documents for one table of a document.
#[derive(Clone, Copy, Debug)]
pub struct Borrowed<'k> {
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
    /// it needs no other file. Without a folder `beside` only embedded documents are found.
    ///
    /// # Errors
    /// The name is no text, there is no document of that name, or it cannot be read.
    pub fn with_borrowed(
        self,
        of: &Borrowed<'_>,
        library: &Library,
        beside: Option<&Path>,
    ) -> Result<Self, DocumentError> {
        let Some(place) = self.place(&format!("{}.{}", of.table, of.key)) else {
            return Ok(self);
        };
        let problem = |message: String, help: String| Problem::at(&place, message, help);
        let parsed: Result<DocumentMut, _> = self.text().parse();
        let mut text = parsed.map_err(|error| problem(error.to_string(), String::new()))?;
        let own = text
            .get_mut(of.table)
            .and_then(Item::as_table_like_mut)
            .ok_or_else(|| problem(format!("`{}` is no table", of.table), String::new()))?;
        let named = own.remove(of.key);
        let Some(name) = named.as_ref().and_then(Item::as_str) else {
            let message = format!("`{}` is no name of a file", of.key);
            return Err(problem(message, format!("write {} = \"NAME\"", of.key)).into());
        };
        let found = match beside {
            Some(beside) => library.find(name, beside)?,
            None => library.find_embedded(name)?,
        };
        let Some(other) = found else {
            let known = match beside {
                Some(beside) => library.names(beside),
                None => library.embedded_names(),
            };
            let known = known.iter().map(String::as_str);
            let help = suggestion(name, library.folder, known);
            return Err(problem(format!("there is no `{name}`"), help).into());
        };
        let parsed: Result<DocumentMut, _> = other.text().parse();
        let theirs = parsed.map_err(|error| problem(error.to_string(), String::new()))?;
        for key in of.tables {
            let Some(Item::Table(table)) = theirs.get(key) else {
                continue;
            };
            let mut table = table.clone();
            // Otherwise the tables would be between those of the same place in the other text.
            table.set_position(None);
            for (_, item) in table.iter_mut() {
                if let Some(inner) = item.as_table_mut() {
                    inner.set_position(None);
                }
            }
            if let Some(values) = own.get(key).and_then(Item::as_table_like) {
                merge(&mut table, values).map_err(|below| {
                    problem(format!("`{key}.{below}` is below a value"), String::new())
                })?;
            }
            own.insert(key, Item::Table(table));
        }
        let ranges = other.fitted.into_iter().filter(|range| {
            let key = range.keys.first();
            key.is_some_and(|key| of.tables.contains(&key.as_str()))
        });
        let ranges: Vec<FittedRange> = ranges.map(|range| range.below(of.table)).collect();
        let mut whole = Self::parse(self.file(), &text.to_string())?;
        whole.fitted = self.fitted;
        whole.fitted.extend(ranges);
        Ok(whole)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIBRARY: Library = Library {
        folder: "parts",
        embedded: &[(
            "motor-a",
            "name = 'A'\n[load]\nmass = '1 kg'\n[motor]\nresistance = '4 ohm'  # L\n\
             heat = { capacity = '1 J/K' }\n[gear]\nratio = 3\n",
        )],
    };
    const OF: Borrowed<'_> = Borrowed {
        table: "drive",
        key: "part",
        tables: &["motor", "gear", "absent"],
    };

    fn whole(text: &str) -> Result<Document, DocumentError> {
        let document = Document::parse("r.toml", text)?;
        document.with_borrowed(&OF, &LIBRARY, None)
    }

    #[test]
    fn tables_of_another_document_are_below_the_table_that_names_it() {
        let text = "[a]\nb = 1\n[drive]\npart = 'motor-a'\n[drive.motor]\nresistance = '5 ohm'\n\
                    [z]\ny = 2\n";
        let whole = whole(text).unwrap();
        let read = |key: &str| whole.place(key).map(|place| place.text().to_owned());
        assert_eq!(read("drive.motor.resistance").as_deref(), Some("'5 ohm'"));
        assert_eq!(
            read("drive.motor.heat.capacity").as_deref(),
            Some("'1 J/K'")
        );
        assert_eq!(read("drive.gear.ratio").as_deref(), Some("3"));
        assert_eq!(
            ["drive.part", "drive.load", "load", "name"].map(|key| whole.place(key).is_some()),
            [false; 4]
        );
        assert!(read("a.b").is_some() && read("z.y").is_some());
        // The text alone is the same document.
        let alone = Document::parse("r.toml", whole.text()).unwrap();
        assert!(alone.place("drive.gear.ratio").is_some());
    }

    #[test]
    fn document_that_names_none_stays() {
        let text = "# as it is\n[drive.motor]\nresistance = '5 ohm'\n";
        assert_eq!(whole(text).unwrap().text(), text);
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
}
