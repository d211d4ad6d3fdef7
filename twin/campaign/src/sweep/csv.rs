//! Rows of a sweep as a table.

use twinrig_kernel::Unit;

use super::morris::ElementaryEffect;
use super::result::{ResultRow, SweepResult};
use super::row::SweepRow;

impl SweepResult {
    /// Returns the names of all expectations, in the order of their first occurrence, each with its
    /// units: a fall is measured as a height in one run, and as a tilt in another.
    pub fn expectations(&self) -> Vec<(&str, Vec<&str>)> {
        let mut names: Vec<(&str, Vec<&str>)> = Vec::new();
        for one in self.rows.iter().flat_map(|row| &row.summary.expectations) {
            let unit = one.unit();
            match names.iter_mut().find(|(name, _)| *name == one.name()) {
                Some((_, units)) if units.contains(&unit) => {}
                Some((_, units)) => units.push(unit),
                None => names.push((one.name(), vec![unit])),
            }
        }
        names
    }

    /// Returns the table of the rows as CSV (RFC 4180): point, seed, verdict; for each expectation
    /// verdict, measured value and margin; fingerprint, key and error. Numbers are in the SI units
    /// of the header.
    pub fn table(&self) -> RowTable<'_> {
        let expectations = self.expectations();
        RowTable {
            result: self,
            expectations,
        }
    }
}

/// Table of the rows of a result, line by line.
#[derive(Debug)]
pub struct RowTable<'r> {
    result: &'r SweepResult,
    /// Names of all expectations, with their units.
    expectations: Vec<(&'r str, Vec<&'r str>)>,
}

impl RowTable<'_> {
    /// Returns the line with the names of the columns.
    pub fn header(&self) -> String {
        let in_unit = |name: &str, unit: &str| match unit {
            "1" | "" => name.to_owned(),
            unit => format!("{name} [{unit}]"),
        };
        let mut head = vec!["index".to_owned()];
        for dimension in &self.result.dimensions {
            let unit = dimension.unit.map_or("", Unit::symbol);
            head.push(in_unit(&dimension.key, unit));
        }
        head.extend(["run seed", "verdict", "fell_at_s"].map(str::to_owned));
        for (name, units) in &self.expectations {
            head.push(format!("{name}: verdict"));
            for unit in units {
                head.push(in_unit(&format!("{name}: measured"), unit));
                head.push(in_unit(&format!("{name}: margin"), unit));
            }
        }
        head.extend(["fingerprint", "key", "error"].map(str::to_owned));
        csv_line(head)
    }

    /// Returns the line of a row.
    pub fn line(&self, of: &ResultRow, row: &SweepRow) -> String {
        let mut cells = vec![of.index.to_string()];
        for value in &of.point {
            cells.push(value.cell());
        }
        cells.push(shown(row.seed));
        cells.push(row.verdict.word().to_owned());
        cells.push(shown(row.fell_at_s));
        for (name, units) in &self.expectations {
            let one = row.expectation(name);
            cells.push(shown(one.map(|one| one.verdict.word())));
            for unit in units {
                let one = one.filter(|one| one.unit == *unit);
                cells.push(shown(one.and_then(|one| one.measured)));
                cells.push(shown(one.and_then(|one| one.margin)));
            }
        }
        cells.push(shown(row.fingerprint.as_ref()));
        cells.push(of.key.to_string());
        cells.push(shown(row.error.as_ref()));
        csv_line(cells)
    }
}

fn shown<T: ToString>(value: Option<T>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

/// Returns elementary effects as CSV.
pub fn effects_csv(effects: &[ElementaryEffect]) -> String {
    let head = [
        "measure",
        "unit",
        "dimension",
        "mu",
        "mu_star",
        "sigma",
        "effects",
    ];
    let mut text = csv_line(head.map(str::to_owned));
    for one in effects {
        let sigma = one
            .sigma
            .map_or_else(String::new, |sigma| sigma.to_string());
        text += &csv_line([
            one.measure.clone(),
            one.unit.clone(),
            one.dimension.clone(),
            one.mu.to_string(),
            one.mu_star.to_string(),
            sigma,
            one.effects.to_string(),
        ]);
    }
    text
}

/// Returns a line of CSV.
pub(crate) fn csv_line(cells: impl IntoIterator<Item = String>) -> String {
    let quoted = cells.into_iter().map(|cell| {
        if cell.contains([',', '"', '\n', '\r']) {
            format!("\"{}\"", cell.replace('"', "\"\""))
        } else {
            cell
        }
    });
    quoted.collect::<Vec<_>>().join(",") + "\n"
}
