//! Reading of sensor parameters.

use std::path::Path;

use twinrig_document::declaration::{Key, Shape, TableSpec, Type, quantity, table};
use twinrig_document::{Document, DocumentError, Library, Placed, Reported, Table, suggestion};
use twinrig_kernel::Unit;

use crate::piezoelectric::PiezoelectricCell;
use crate::piezoresistive::{
    Characteristic, Creep, Hysteretic, PiezoresistiveCell, ResistanceAmplifier, Saturating,
};
use crate::ranges;
use crate::sensor::TactileParameters;

/// Files of test benches, whose `[sensor]` tables describe tactile sensors.
pub const BENCHES: Library = Library {
    folder: "benches",
    embedded: &[("tactile", include_str!("../files/tactile.toml"))],
};

/// File with the `[sensor]` table of a tactile sensor.
#[derive(Clone, Debug)]
pub struct SensorFile {
    document: Document,
}

impl SensorFile {
    /// Reads the file `name` of [`BENCHES`], for a scenario in the folder `beside`. `None` if there
    /// is none of that name.
    ///
    /// # Errors
    /// If it cannot be read or is not TOML.
    pub fn find(name: &str, beside: &Path) -> Result<Option<Self>, DocumentError> {
        let document = BENCHES.find(name, beside)?;
        Ok(document.map(|document| Self { document }))
    }

    /// Returns a list of the files that [`SensorFile::find`] finds, with the one meant by `name`.
    pub fn suggestion(name: &str, beside: &Path) -> String {
        let known = BENCHES.names(beside);
        suggestion(name, "sensors", known.iter().map(String::as_str))
    }

    /// Parses `text`, with `file` as its name in messages.
    ///
    /// # Errors
    /// If it is not TOML.
    pub fn parse(file: &str, text: &str) -> Result<Self, DocumentError> {
        let document = Document::parse(file, text)?;
        Ok(Self { document })
    }

    /// Text of the file.
    pub fn text(&self) -> &str {
        self.document.text()
    }

    /// Reads the sensor; the other tables of the file are ignored.
    ///
    /// # Errors
    /// Every parameter that is missing, unknown, of a wrong unit or out of range, at its place.
    pub fn sensor(&self) -> Result<TactileParameters, DocumentError> {
        self.cell(None)
    }

    /// Reads the sensor; with a number that cell, drawn within the spread of the file.
    ///
    /// # Errors
    /// As [`SensorFile::sensor`]; at the number, if the file has no spread.
    pub fn cell(&self, number: Option<&Placed<u64>>) -> Result<TactileParameters, DocumentError> {
        let sensor = self.document.check(|table| {
            table.expect(table.keys());
            file_table::TABLE.of(table).read(&file_table::SENSOR)
        })?;
        Ok(sensor.numbered(number)?)
    }
}

table! {
    /// Keys of a file with a sensor.
    file_table = TableSpec::new("top level", "a sensor, and other tables");
    SENSOR: TactileParameters = "sensor", TactileParameters::TYPE, "sensor", "",
        required();
}

table! {
    /// Keys of `[sensor]`.
    sensor_table = TableSpec::new("[sensor]", "tactile sensor");
    SPREAD: f64 = "spread", quantity(Unit::One, ranges::SPREAD),
        "share by which the constants of numbered cells differ from those of the file", "";
    PIEZORESISTIVE: (PiezoresistiveCell, ResistanceAmplifier) = "piezoresistive",
        Type::new(Shape::Table(piezoresistive_table::TABLE), |item, _| cell(&item.table()?)),
        "piezoresistive cell, for the load itself", "", required();
    PIEZOELECTRIC: PiezoelectricCell = "piezoelectric", PiezoelectricCell::TYPE,
        "piezoelectric cell with its amplifier, for the changes of the load", "", required();
}

table! {
    /// Keys of `piezoresistive`.
    piezoresistive_table = TableSpec::new("piezoresistive", "piezoresistive cell");
    SATURATING: Saturating = "saturating", Saturating::TYPE, "linear characteristic with saturation",
        "", one_of();
    HYSTERETIC: Hysteretic = "hysteretic", Hysteretic::TYPE, "characteristic of two sigmoids", "",
        one_of();
    CREEP: Creep = "creep", Creep::TYPE, "slow rise of the conductance under load", "", required();
    AMPLIFIER: ResistanceAmplifier = "amplifier", ResistanceAmplifier::TYPE, "its amplifier", "",
        required();
}

impl TactileParameters {
    /// Type of the table of a sensor.
    pub const TYPE: Type<Self> = Type::new(Shape::Table(sensor_table::TABLE), |item, _| {
        sensor(&item.table()?)
    });
}

fn sensor(table: &Table<'_>) -> Result<TactileParameters, Reported> {
    use sensor_table::{PIEZOELECTRIC, PIEZORESISTIVE, SPREAD, TABLE};
    let keys = TABLE.of(table);
    let spread = keys.get(&SPREAD);
    let (resistive, piezoelectric) = (keys.read(&PIEZORESISTIVE), keys.read(&PIEZOELECTRIC));
    let (piezoresistive, amplifier) = resistive?;
    Ok(TactileParameters {
        piezoresistive,
        amplifier,
        piezoelectric: piezoelectric?,
        spread: spread?,
    })
}

fn cell(table: &Table<'_>) -> Result<(PiezoresistiveCell, ResistanceAmplifier), Reported> {
    use piezoresistive_table::{AMPLIFIER, CREEP, HYSTERETIC, SATURATING, TABLE};
    let keys = TABLE.of(table);
    let characteristic = match (keys.item(&SATURATING), keys.item(&HYSTERETIC)) {
        (Some(_), Some(_)) => {
            let message = "a cell has one characteristic, `saturating` or `hysteretic`";
            Err(keys.report(&SATURATING, message, "remove one of the two"))
        }
        (Some(_), None) => keys.read(&SATURATING).map(Characteristic::Saturating),
        _ => keys.read(&HYSTERETIC).map(Characteristic::Hysteretic),
    };
    let (creep, amplifier) = (keys.read(&CREEP), keys.read(&AMPLIFIER));
    let cell = PiezoresistiveCell {
        characteristic: characteristic?,
        creep: creep?,
    };
    Ok((cell, amplifier?))
}
