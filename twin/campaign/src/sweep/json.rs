//! Result of a sweep for programs.

use std::cell::RefCell;

use serde::ser::{Error as _, SerializeMap, SerializeSeq};
use serde::{Serialize, Serializer};
use serde_json::{Map, Value, json};
use twinrig_kernel::Unit;

use super::result::{CompleteRow, ResultDimension, ResultRow, SweepResult};
use super::row::{RowKey, SweepRow};
use super::value::SweepValue;

/// Key of the list of rows.
const ROWS: &str = "rows";

/// Result for programs, whose rows are read while it is written. It depends on nothing but
/// specification, scenario and build.
pub struct SweepJson<'r, E> {
    result: &'r SweepResult,
    /// Everything but the rows, in whose place there is an empty list.
    head: Map<String, Value>,
    rows: RefCell<Rows<'r, E>>,
}

/// Reads rows, up to the first error.
struct Rows<'r, E> {
    read: &'r mut dyn FnMut(&ResultRow) -> Result<CompleteRow, E>,
    failed: Option<E>,
}

impl SweepResult {
    /// Returns the result for programs. `read` is called for each row, in their order.
    pub fn json<'r, E>(
        &'r self,
        read: &'r mut dyn FnMut(&ResultRow) -> Result<CompleteRow, E>,
    ) -> SweepJson<'r, E> {
        let settings = self.settings.iter();
        let settings = settings.map(|(key, value)| (key.clone(), json!(value)));
        let dimensions = self.dimensions.iter();
        let dimensions =
            dimensions.map(|it| json!({ "key": it.key, "unit": it.unit.map(Unit::symbol) }));
        let mut object = json!({
            "sweep": self.name,
            "spec": self.spec,
            "scenario": self.scenario,
            "file": self.file,
            "verdict": self.verdict,
            "hash": self.hash,
            "build": self.build,
            "design": self.design,
            "partition": (!self.partition.is_whole()).then_some(self.partition),
            "settings": settings.collect::<Map<_, _>>(),
            "dimensions": dimensions.collect::<Vec<_>>(),
            "counts": self.counts,
            "shares": self.shares,
            "warning": self.warning(),
            "error": self.error(),
            ROWS: [],
        });
        if self.design.levels.is_some() {
            object["effects"] = json!(self.elementary_effects());
        }
        let failed = None;
        SweepJson {
            result: self,
            head: match object {
                Value::Object(head) => head,
                _ => Map::new(),
            },
            rows: RefCell::new(Rows { read, failed }),
        }
    }
}

/// A row with its point.
#[derive(Serialize)]
struct RowJson<'r> {
    index: usize,
    #[serde(serialize_with = "point")]
    point: (&'r [ResultDimension], &'r [SweepValue]),
    #[serde(flatten)]
    row: &'r SweepRow,
    key: RowKey,
    command: &'r str,
}

fn point<S: Serializer>(
    (dimensions, values): &(&[ResultDimension], &[SweepValue]),
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let keys = dimensions.iter().map(|dimension| &dimension.key);
    serializer.collect_map(keys.zip(*values))
}

impl<E> SweepJson<'_, E> {
    /// Returns the error of reading a row, with which the serialisation has failed.
    pub fn failed(self) -> Option<E> {
        self.rows.into_inner().failed
    }
}

impl<E> Serialize for SweepJson<'_, E> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.head.len()))?;
        for (key, value) in &self.head {
            if key == ROWS {
                map.serialize_entry(key, &RowList(self))?;
            } else {
                map.serialize_entry(key, value)?;
            }
        }
        map.end()
    }
}

/// List of the rows.
struct RowList<'j, 'r, E>(&'j SweepJson<'r, E>);

impl<E> Serialize for RowList<'_, '_, E> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let SweepJson { result, rows, .. } = self.0;
        let Rows { read, failed } = &mut *rows.borrow_mut();
        let mut list = serializer.serialize_seq(Some(result.rows.len()))?;
        for row in &result.rows {
            let CompleteRow {
                command,
                row: found,
            } = &read(row).map_err(|error| {
                *failed = Some(error);
                S::Error::custom("a row cannot be read")
            })?;
            list.serialize_element(&RowJson {
                index: row.index,
                point: (&result.dimensions, &row.point),
                row: found,
                key: row.key,
                command,
            })?;
        }
        list.end()
    }
}
