//! Rows of JSON: a list at the top or under a key, or a row in each line.

use super::cell::Cell;
use super::collect::Collector;
use super::error::LogFault;
use super::input::Input;
use super::json::{JsonReader, Next};
use super::paths::{self, Receiver, Sought};

/// Reads all rows of a log.
pub(super) fn read(
    input: &mut Input<'_>,
    rows: Option<&str>,
    constants: &[&str],
    collector: &mut Collector<'_>,
) -> Result<(), LogFault> {
    let sought = collector.sought();
    let mut reader = JsonReader::new(input);
    match rows {
        Some(rows) => {
            let mut top = Top {
                collector,
                sought,
                has_rows: false,
                names: Vec::new(),
            };
            let constants = constants.iter().zip(1..);
            let at_top: Vec<Sought> = std::iter::once((&rows, 0))
                .chain(constants)
                .map(|(path, slot)| Sought {
                    path: (*path).to_owned(),
                    slot,
                })
                .collect();
            paths::read(&mut reader, &at_top, &mut top)?;
            let (has_rows, known) = (top.has_rows, top.names);
            if !has_rows && reader.is_at_end()? {
                let key = rows.to_owned();
                return Err(LogFault::NoList { key, known });
            }
        }
        None if reader.kind()? == Next::List => list(&mut reader, &sought, collector)?,
        None => {
            while !reader.is_at_end()? {
                row(&mut reader, &sought, collector)?;
            }
        }
    }
    if reader.is_at_end()? {
        return Ok(());
    }
    Err(LogFault::Syntax {
        format: "JSON",
        why: "there is text after the end".to_owned(),
    })
}

fn list(
    reader: &mut JsonReader<'_, '_>,
    sought: &[Sought],
    collector: &mut Collector<'_>,
) -> Result<(), LogFault> {
    reader.enter()?;
    let mut is_first = true;
    while reader.next_element(is_first)? {
        is_first = false;
        row(reader, sought, collector)?;
    }
    Ok(())
}

fn row(
    reader: &mut JsonReader<'_, '_>,
    sought: &[Sought],
    collector: &mut Collector<'_>,
) -> Result<(), LogFault> {
    let kind = reader.kind()?;
    collector.begin(Some(reader.input.line));
    if kind == Next::Scalar {
        let cell = reader.scalar()?;
        return Err(LogFault::WrongType {
            column: "row".to_owned(),
            found: cell.words(),
            expected: "an object or a list",
        });
    }
    paths::read(reader, sought, collector)?;
    collector.end()
}

/// Receiver of the values outside of the rows, and of the list of the rows.
struct Top<'c, 'm> {
    collector: &'c mut Collector<'m>,
    sought: Vec<Sought>,
    has_rows: bool,
    names: Vec<String>,
}

impl Receiver for Top<'_, '_> {
    fn cell(&mut self, slot: usize, cell: Cell<'_>) -> Result<(), LogFault> {
        match slot.checked_sub(1) {
            None => Err(LogFault::WrongType {
                column: "rows".to_owned(),
                found: cell.words(),
                expected: "a list",
            }),
            Some(constant) => {
                self.collector.set_outside(constant, cell);
                Ok(())
            }
        }
    }

    fn composite(
        &mut self,
        slot: usize,
        reader: &mut JsonReader<'_, '_>,
    ) -> Result<bool, LogFault> {
        if slot != 0 || reader.kind()? != Next::List {
            return Ok(false);
        }
        self.has_rows = true;
        list(reader, &self.sought, self.collector)?;
        Ok(true)
    }

    fn key(&mut self, key: &str) {
        const NAMES_MOST: usize = 200;
        if self.names.len() < NAMES_MOST {
            self.names.push(key.chars().take(100).collect());
        }
    }
}
