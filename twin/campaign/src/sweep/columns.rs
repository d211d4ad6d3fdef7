//! Rows of a sweep as a table.

use twinrig_kernel::Unit;

use super::result::{ResultRow, SweepResult};
use super::row::{RowExpectation, SweepRow, label};

/// An expectation of the runs. Several of a run may have the same name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExpectationColumn<'r> {
    /// Name.
    pub name: &'r str,
    /// Number among those of the same name in a run, from 1.
    pub number: usize,
    /// Units of its measured values: a fall is a height in one run, and a tilt in another.
    pub units: Vec<&'r str>,
}

impl ExpectationColumn<'_> {
    /// Returns the label: `name`, and `name #2` for the second one of this name.
    pub fn label(&self) -> String {
        label(self.name, self.number)
    }

    /// Returns the outcome in a run.
    pub fn of<'a>(&self, row: &'a SweepRow) -> Option<&'a RowExpectation> {
        row.expectation(self.name, self.number)
    }
}

impl SweepResult {
    /// Returns all expectations, in the order of their first occurrence.
    pub fn expectations(&self) -> Vec<ExpectationColumn<'_>> {
        let mut columns: Vec<ExpectationColumn<'_>> = Vec::new();
        for (one, number) in self.rows.iter().flat_map(|row| row.row.numbered()) {
            let unit = one.unit.as_str();
            let known = columns
                .iter_mut()
                .find(|column| column.name == one.name && column.number == number);
            match known {
                Some(column) if column.units.contains(&unit) => {}
                Some(column) => column.units.push(unit),
                None => columns.push(ExpectationColumn {
                    name: &one.name,
                    number,
                    units: vec![unit],
                }),
            }
        }
        columns
    }

    /// Returns the rows as CSV (RFC 4180): point, seed, verdict; for each expectation verdict,
    /// measured value and margin; fingerprint, key and error. Numbers are in the SI units of the
    /// header.
    pub fn csv(&self) -> String {
        let columns = self.expectations();
        let in_unit = |name: &str, unit: &str| match unit {
            "1" | "" => name.to_owned(),
            unit => format!("{name} [{unit}]"),
        };
        let mut head = vec!["index".to_owned()];
        for dimension in &self.dimensions {
            let unit = dimension.unit.map_or("", Unit::symbol);
            head.push(in_unit(&dimension.key, unit));
        }
        head.extend(["run seed", "verdict", "fell_at_s"].map(str::to_owned));
        for column in &columns {
            let label = column.label();
            head.push(format!("{label}: verdict"));
            for unit in &column.units {
                head.push(in_unit(&format!("{label}: measured"), unit));
                head.push(in_unit(&format!("{label}: margin"), unit));
            }
        }
        head.extend(["fingerprint", "key", "error"].map(str::to_owned));
        let mut text = line(head);
        for row in &self.rows {
            text += &line(cells(row, &columns));
        }
        text
    }
}

fn cells(row: &ResultRow, columns: &[ExpectationColumn<'_>]) -> Vec<String> {
    fn shown<T: ToString>(value: Option<T>) -> String {
        value.map_or_else(String::new, |value| value.to_string())
    }
    let mut cells = vec![row.index.to_string()];
    for value in &row.point {
        cells.push(value.cell());
    }
    cells.push(shown(row.row.seed));
    cells.push(row.row.verdict.word().to_owned());
    cells.push(shown(row.row.fell_at_s));
    for column in columns {
        let one = column.of(&row.row);
        cells.push(shown(one.map(|one| one.verdict.word())));
        for unit in &column.units {
            let one = one.filter(|one| one.unit == *unit);
            cells.push(shown(one.and_then(|one| one.measured)));
            cells.push(shown(one.and_then(|one| one.margin)));
        }
    }
    cells.push(shown(row.row.fingerprint.as_ref()));
    cells.push(row.key.to_string());
    cells.push(shown(row.row.error.as_ref()));
    cells
}

/// Returns a line of CSV.
fn line(cells: Vec<String>) -> String {
    let quoted = cells.into_iter().map(|cell| {
        if cell.contains([',', '"', '\n', '\r']) {
            format!("\"{}\"", cell.replace('"', "\"\""))
        } else {
            cell
        }
    });
    quoted.collect::<Vec<_>>().join(",") + "\n"
}
