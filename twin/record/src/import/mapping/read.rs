//! Reading of mappings.

use twinrig_document::declaration::{Declared, TableReference};
use twinrig_document::{Document, DocumentError, Item, Placed, Reported, Table, WrittenUnit};
use twinrig_kernel::Unit;

use super::contents::{LogColumn, LogMapping, LogNote, LogOrigin, LogSetting, LogSignal, NoteText};
use super::tables::{mapping_table, note_table, setting_table, signal_table, time_table};
use crate::import::signal::Conversion;

/// Greatest number of signals, and of settings and remarks.
const SIGNALS_MOST: usize = 1000;

/// Time of a mapping.
struct Time {
    column: Option<String>,
    unit: WrittenUnit,
    origin: LogOrigin,
}

impl LogMapping {
    /// Returns the tables of a mapping with their keys, beginning with the top level.
    pub fn tables() -> Vec<TableReference> {
        TableReference::of(mapping_table::TABLE)
    }

    /// Reads a mapping from a document.
    ///
    /// # Errors
    /// All problems, each with its position.
    pub fn read(document: &Document) -> Result<Self, DocumentError> {
        document.check(|table| mapping(document, table))
    }
}

fn mapping(document: &Document, table: &Table<'_>) -> Result<LogMapping, Reported> {
    use mapping_table::{FORMAT, GAP, NOTE, ROWS, SETTING, SIGNAL, TABLE, TIME};
    let keys = TABLE.of(table);
    let (format, rows, gap) = (keys.get(&FORMAT), keys.get(&ROWS), keys.get(&GAP));
    let time = keys.get_with(&TIME, time);
    let signals = keys.read_with(&SIGNAL, signals);
    let settings = keys.get_with(&SETTING, |item| each(item, setting));
    let notes = keys.get_with(&NOTE, |item| each(item, note));
    let (signals, time) = (signals?, time?);
    let has_topics = signals.iter().any(|signal| signal.column.topic.is_some());
    let column = time.as_ref().and_then(|time| time.column.clone());
    if !has_topics && column.is_none() {
        let help = r#"add it as in time = { column = "timestamp", unit = "s" }"#;
        return Err(keys.report(&TIME, "there is no column of the time", help));
    }
    let settings: Vec<Placed<LogSetting>> = settings?.unwrap_or_default();
    if let (true, Some(setting)) = (has_topics, settings.first()) {
        let message = "messages of topics have no constants";
        let help = "give the setting to the command that reads the recording";
        return Err(table.report_at(&setting.place, message, help));
    }
    let notes: Vec<Placed<LogNote>> = notes?.unwrap_or_default();
    unique(table, settings.iter().map(|one| &one.value.key), "settings")?;
    unique(table, notes.iter().map(|one| &one.value.name), "notes")?;
    Ok(LogMapping {
        file: document.file().to_owned(),
        text: document.text().to_owned(),
        format: format?,
        rows: rows?,
        time_unit: match &time {
            Some(time) => time.unit,
            None => seconds(table)?,
        },
        origin: time.map_or(LogOrigin::Auto, |time| time.origin),
        time: column,
        gap: gap?,
        signals,
        settings: settings.into_iter().map(|one| one.value).collect(),
        notes: notes.into_iter().map(|one| one.value).collect(),
    })
}

fn seconds(table: &Table<'_>) -> Result<WrittenUnit, Reported> {
    let unit = WrittenUnit::parse("s");
    unit.map_err(|error| table.report_at(&table.place(), error.message, error.help))
}

/// Reads a list of tables up to a bound.
fn each<T>(
    item: &Item<'_>,
    read: impl Fn(&Item<'_>) -> Result<T, Reported>,
) -> Result<Vec<Placed<T>>, Reported> {
    let read = |item: &Item<'_>| {
        let place = item.place();
        Ok(Placed {
            value: read(item)?,
            place,
        })
    };
    let items = item.each(read)?;
    if items.len() > SIGNALS_MOST {
        let message = format!("there are more than {SIGNALS_MOST} of them");
        return Err(item.report(message, "leave some of them out"));
    }
    Ok(items)
}

/// Reports a name that is there twice.
fn unique<'n>(
    table: &Table<'_>,
    names: impl Iterator<Item = &'n Placed<String>>,
    kind: &str,
) -> Result<(), Reported> {
    let mut known = std::collections::BTreeSet::new();
    for name in names {
        if !known.insert(name.value.as_str()) {
            let message = format!("there are two {kind} `{}`", name.value);
            return Err(table.report_at(&name.place, message, "rename or remove one of them"));
        }
    }
    Ok(())
}

fn time(item: &Item<'_>) -> Result<Time, Reported> {
    use time_table::{COLUMN, FIELD, ORIGIN, TABLE, UNIT};
    let table = &item.table()?;
    let keys = TABLE.of(table);
    let (column, field) = (keys.get(&COLUMN), keys.get(&FIELD));
    let (unit, origin) = (keys.read(&UNIT), keys.read(&ORIGIN));
    let (column, field) = (column?, field?);
    if column.is_some() && field.is_some() {
        let help = "rows have a `column`, messages a `field`: leave one of them out";
        return Err(keys.report(&FIELD, "there are both `column` and `field`", help));
    }
    let unit = unit?;
    if unit.unit != Unit::Second {
        let message = format!("the unit is `{}`; expected a duration", unit.unit);
        return Err(keys.report(&UNIT, message, "units that fit: s, ms, us, ns, min"));
    }
    Ok(Time {
        column: column.or(field),
        unit,
        origin: origin?,
    })
}

fn signals(item: &Item<'_>) -> Result<Vec<LogSignal>, Reported> {
    let signals = each(item, signal)?;
    let table = |place, message, help| Err(item.report_at(place, message, help));
    let Some(first) = signals.first() else {
        return Err(item.report("there are no signals", "add [[signal]]"));
    };
    let has_topics = first.value.column.topic.is_some();
    let mut known = std::collections::BTreeSet::new();
    for signal in &signals {
        let LogSignal { name, column, .. } = &signal.value;
        if !known.insert(name.value.clone()) {
            let message = format!("there are two signals `{}`", name.value);
            return table(&name.place, message, "rename or remove one of them");
        }
        if column.topic.is_some() != has_topics {
            let message = "there are signals with a column and others with a topic".to_owned();
            return table(
                &column.path.place,
                message,
                "a log has columns, or it has topics",
            );
        }
    }
    Ok(signals.into_iter().map(|signal| signal.value).collect())
}

fn signal(item: &Item<'_>) -> Result<LogSignal, Reported> {
    use signal_table::{GROUP, MISSING, NAME, OFFSET, OPTIONAL, SCALE, SIGN, TABLE, UNIT, WORD};
    let table = &item.table()?;
    let keys = TABLE.of(table);
    let (name, column) = (keys.read(&NAME), column(keys));
    let (unit, word) = (keys.read(&UNIT), keys.get(&WORD));
    let (scale, sign, offset) = (keys.read(&SCALE), keys.read(&SIGN), keys.read(&OFFSET));
    let (group, missing) = (keys.read(&GROUP), keys.read(&MISSING));
    let optional = keys.read(&OPTIONAL);
    let (name, sign) = (name?, sign?);
    let is_path = |part: &str| !part.is_empty() && !part.contains(char::is_control);
    if !name.value.split('/').all(is_path) {
        let message = format!("`{}` is not a path of a signal", name.value);
        return Err(table.report_at(&name.place, message, "write it as in servo/position"));
    }
    if sign.abs() != 1.0 {
        let help = "it is 1 or -1; `scale` is for other factors";
        return Err(keys.report(&SIGN, format!("`{SIGN}` is {sign}"), help));
    }
    Ok(LogSignal {
        name,
        column: column?,
        conversion: Conversion {
            word: word?,
            scale: scale?,
            sign,
            offset: offset?,
            unit: unit?,
        },
        group: group?,
        missing: missing?,
        is_optional: optional?,
    })
}

/// Reads the place of a signal: a column, or a topic and a field.
fn column(keys: Declared<'_, '_>) -> Result<LogColumn, Reported> {
    use signal_table::{COLUMN, FIELD, TOPIC};
    let (column, field, topic) = (keys.get(&COLUMN), keys.get(&FIELD), keys.get(&TOPIC));
    match (column?, field?, topic?) {
        (Some(path), None, None) => Ok(LogColumn { topic: None, path }),
        (None, Some(path), topic @ Some(_)) => Ok(LogColumn { topic, path }),
        (None, Some(_), None) => Err(keys.missing(TOPIC.name)),
        (None, None, Some(_)) => Err(keys.missing(FIELD.name)),
        (None, None, None) => Err(keys.missing(COLUMN.name)),
        (Some(_), ..) => {
            let help = "a log has columns, or it has topics: leave `column` out, or the others";
            Err(keys.report(&COLUMN, "there are both a column and a topic", help))
        }
    }
}

fn setting(item: &Item<'_>) -> Result<LogSetting, Reported> {
    use setting_table::{COLUMN, KEY, OPTIONAL, TABLE, UNIT};
    let table = &item.table()?;
    let keys = TABLE.of(table);
    let (key, column, unit) = (keys.read(&KEY), keys.read(&COLUMN), keys.get(&UNIT));
    let optional = keys.read(&OPTIONAL);
    let key = key?;
    let is_key = |part: &str| !part.is_empty() && !part.contains(char::is_whitespace);
    if !key.value.split('.').all(is_key) {
        let message = format!("`{}` is not a dotted key", key.value);
        return Err(table.report_at(&key.place, message, "write it as in load.mass"));
    }
    Ok(LogSetting {
        key,
        column: column?,
        unit: unit?,
        is_optional: optional?,
    })
}

fn note(item: &Item<'_>) -> Result<LogNote, Reported> {
    use note_table::{COLUMN, NAME, TABLE, TEXT};
    let table = &item.table()?;
    let keys = TABLE.of(table);
    let (name, column, text) = (keys.read(&NAME), keys.get(&COLUMN), keys.get(&TEXT));
    let text = match (column?, text?) {
        (Some(column), None) => NoteText::Column(column),
        (None, Some(text)) => NoteText::Text(text),
        (None, None) => return Err(keys.missing(COLUMN.name)),
        (Some(_), Some(_)) => {
            let message = "there are both `column` and `text`";
            return Err(keys.report(&TEXT, message, "leave one of them out"));
        }
    };
    Ok(LogNote { name: name?, text })
}
