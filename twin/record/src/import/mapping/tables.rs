//! Keys of mappings.

use twinrig_document::declaration::{
    Accepts, Key, Shape, TableSpec, Type, choice, contextual, quantity, table,
};
use twinrig_document::{Placed, Range, WrittenUnit};
use twinrig_kernel::{SimDuration, Unit};

use super::contents::{LogFormat, LogGroup, LogOrigin, MissingValues};
use crate::import::signal::{Ratio, Word};

/// Unit of the numbers of a log.
const UNIT_NAME: Type<WrittenUnit> = Type::new(Shape::One(Accepts::Text), |item, _| {
    let spelling = item.text()?;
    let unit = WrittenUnit::parse(spelling);
    unit.map_err(|error| item.report(error.message, error.help))
});

/// A number, or a ratio of two.
const RATIO: Type<Ratio> = Type::new(
    Shape::Either(&[
        Shape::One(Accepts::Quantity {
            unit: Unit::One,
            range: Range::ANY,
        }),
        Shape::One(Accepts::Text),
    ]),
    |item, _| {
        let ratio = if item.is_text() {
            Ratio::parse(item.text()?)
        } else {
            Some(Ratio::of(item.number(&Range::ANY)?))
        };
        let ratio = ratio.filter(|ratio| ratio.numerator != 0.0);
        ratio.ok_or_else(|| {
            let message = format!("`{}` is neither a number nor a ratio", item.key());
            item.report(message, "write it as in 0.25 or \"1/885\"; it is not 0")
        })
    },
);

table! {
    /// Keys of a mapping.
    pub(super) mapping_table = TableSpec::new("log mapping", "mapping of the columns of a log");
    FORMAT: LogFormat = "format", choice(), "format of the log", r#"format = "csv""#,
        otherwise("by the name of the file");
    ROWS: String = "rows", Type::TEXT,
        "path of the list of the rows in JSON, in dots from the top", r#"rows = "entries""#,
        otherwise("the list at the top, or a row in each line");
    TIME: () = "time", contextual(Shape::Table(time_table::TABLE)), "time of the rows",
        r#"time = { column = "timestamp", unit = "s" }"#,
        otherwise("of messages: the time at which they were logged");
    GAP: SimDuration = "gap", Type::POSITIVE_DURATION,
        "longest interval between two rows that is not reported as a gap", r#"gap = "100 ms""#,
        otherwise("ten times the median interval");
    SIGNAL: () = "signal", contextual(Shape::Tables(signal_table::TABLE)), "signals",
        r#"signal = [{ name = "servo/position", column = "position", unit = "rad" }]"#,
        required();
    SETTING: () = "setting", contextual(Shape::Tables(setting_table::TABLE)),
        "constants of the log that are settings of the plant",
        r#"setting = [{ key = "load.mass", column = "mass", unit = "kg" }]"#, otherwise("none");
    NOTE: () = "note", contextual(Shape::Tables(note_table::TABLE)), "remarks",
        r#"note = [{ name = "motor", column = "motor" }]"#, otherwise("none");
}

table! {
    /// Keys of `time`.
    pub(super) time_table = TableSpec::new("time of a log", "time of the rows");
    COLUMN: String = "column", Type::TEXT, "column of the time, in JSON and CSV",
        r#"column = "timestamp""#;
    FIELD: String = "field", Type::TEXT,
        "field of the time in messages of all topics, a number or a time of ROS",
        r#"field = "header.stamp""#, otherwise("the time at which messages were logged");
    UNIT: WrittenUnit = "unit", UNIT_NAME, "unit of the numbers", r#"unit = "ms""#, default("'s'");
    ORIGIN: LogOrigin = "origin", choice(),
        "`keep`: times are kept; `first`: the whole second at or before the first row is 0; \
         `auto`: as `keep` if the log begins in its first hour, otherwise as `first`",
        r#"origin = "first""#, default("'auto'");
}

table! {
    /// Keys of `[[signal]]`.
    pub(super) signal_table = TableSpec::new("signal of a log", "signal of the recording");
    NAME: Placed<String> = "name", Type::PLACED, "path of the signal in the recording",
        r#"name = "servo/position""#, required();
    COLUMN: Placed<String> = "column", Type::PLACED,
        "name of the column, or in JSON a path in dots", r#"column = "position""#, one_of();
    FIELD: Placed<String> = "field", Type::PLACED,
        "path of the field in messages, with elements of lists in brackets",
        r#"field = "position[0]""#, one_of(), needs("topic");
    TOPIC: String = "topic", Type::TEXT, "topic of the messages", r#"topic = "/joint_states""#,
        needs("field");
    UNIT: WrittenUnit = "unit", UNIT_NAME,
        "unit of the numbers, after `scale` and `offset`; `1` is a plain number",
        r#"unit = "deg""#, required();
    WORD: Word = "word", choice(),
        "integers are words in two's complement that were stored without a sign",
        r#"word = "i16""#;
    SCALE: Ratio = "scale", RATIO, "factor of the numbers, or a ratio of two",
        r#"scale = "1/885""#, default("1");
    SIGN: f64 = "sign", quantity(Unit::One, Range::ANY), "1 or −1, a further factor",
        "sign = -1", default("1");
    OFFSET: f64 = "offset", quantity(Unit::One, Range::ANY),
        "number that is added after the factors, in `unit`", "offset = 273.15", default("0");
    GROUP: LogGroup = "group", choice(), "whether it was measured or commanded",
        r#"group = "commanded""#, default("'measured'");
    MISSING: MissingValues = "missing", choice(),
        "rows without a value, or with NaN, are an error, or have that of the row above",
        r#"missing = "hold""#, default("'error'");
    OPTIONAL: bool = "optional", Type::BOOLEAN,
        "whether the signal is left out of logs without the column", "optional = true",
        default("false");
}

table! {
    /// Keys of `[[setting]]`.
    pub(super) setting_table = TableSpec::new("setting of a log", "setting of the plant");
    KEY: Placed<String> = "key", Type::PLACED, "dotted key of a scenario or of its files",
        r#"key = "load.mass""#, required();
    COLUMN: String = "column", Type::TEXT,
        "constant of the log: a path in JSON outside of the rows, or a column with one value",
        r#"column = "mass""#, required();
    UNIT: WrittenUnit = "unit", UNIT_NAME, "unit of the number", r#"unit = "kg""#,
        otherwise("none: a plain number, a text or a boolean");
    OPTIONAL: bool = "optional", Type::BOOLEAN, "whether the constant may be absent",
        "optional = true", default("false");
}

table! {
    /// Keys of `[[note]]`.
    pub(super) note_table = TableSpec::new("note of a log", "remark");
    NAME: Placed<String> = "name", Type::PLACED, "name of the remark", r#"name = "motor""#,
        required();
    COLUMN: String = "column", Type::TEXT, "constant of the log, which may be absent",
        r#"column = "motor""#, one_of();
    TEXT: String = "text", Type::TEXT, "the remark", r#"text = "bench 2, after repair""#,
        one_of();
}
