//! Reading of sensor parameters.

use std::path::Path;

use twinrig_document::{
    Document, DocumentError, Item, Library, Placed, Range, Reported, Table, suggestion,
};
use twinrig_kernel::Unit;

use crate::piezoelectric::PiezoelectricCell;
use crate::piezoresistive::{
    Branch, Characteristic, Creep, PiezoresistiveCell, ResistanceAmplifier,
};
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
        let (sensor, spread) = self.document.check(|table| {
            table.expect(table.keys());
            table.required("sensor", |item| {
                let table = item.table()?;
                let spread = TactileParameters::read_spread(&table);
                Ok((TactileParameters::read(&table)?, spread?))
            })
        })?;
        Ok(sensor.numbered(spread, number)?)
    }
}

impl TactileParameters {
    /// Reads how far the constants of cells are from those of the table of a sensor, as a share of
    /// them \[1\], if the table has it.
    ///
    /// # Errors
    /// For a value that is no share, reported at its place.
    pub fn read_spread(table: &Table<'_>) -> Result<Option<f64>, Reported> {
        table.optional("spread", |item| item.quantity(Unit::One, &ranges::SPREAD))
    }

    /// Reads the table of a sensor.
    ///
    /// # Errors
    /// For every parameter that is missing, of a wrong unit or out of range, reported at its place.
    pub fn read(table: &Table<'_>) -> Result<Self, Reported> {
        let piezoresistive = table.required("piezoresistive", |item| cell(&item.table()?));
        let piezoelectric = table.required("piezoelectric", piezoelectric);
        let (piezoresistive, amplifier) = piezoresistive?;
        Ok(Self {
            piezoresistive,
            amplifier,
            piezoelectric: piezoelectric?,
        })
    }
}

fn cell(table: &Table<'_>) -> Result<(PiezoresistiveCell, ResistanceAmplifier), Reported> {
    let characteristic = match (table.get("saturating"), table.get("hysteretic")) {
        (Some(item), None) => saturating(&item.table()?),
        (None, Some(item)) => hysteretic(&item.table()?),
        (None, None) => Err(table.missing("hysteretic")),
        (Some(_), Some(_)) => {
            let message = "a cell has one characteristic, `saturating` or `hysteretic`";
            Err(table.report("saturating", message, "remove one of the two"))
        }
    };
    let creep = table.required("creep", |item| creep(&item.table()?));
    let amplifier = table.required("amplifier", |item| amplifier(&item.table()?));
    let cell = PiezoresistiveCell {
        characteristic: characteristic?,
        creep: creep?,
    };
    Ok((cell, amplifier?))
}

fn saturating(table: &Table<'_>) -> Result<Characteristic, Reported> {
    let sensitivity = quantity(
        table,
        "sensitivity",
        Unit::SiemensPerNewton,
        &ranges::SENSITIVITY,
    );
    let base = quantity(table, "base", Unit::Siemens, &ranges::BASE);
    let saturation = quantity(table, "saturation", Unit::Newton, &ranges::FORCE);
    Ok(Characteristic::Saturating {
        sensitivity: sensitivity?,
        base: base?,
        saturation: saturation?,
    })
}

fn hysteretic(table: &Table<'_>) -> Result<Characteristic, Reported> {
    let loading = table.required("loading", |item| branch(&item.table()?));
    let unloading = table.required("unloading", |item| branch(&item.table()?));
    let switch = quantity(table, "switch", Unit::NewtonPerSecond, &ranges::RATE);
    Ok(Characteristic::Hysteretic {
        loading: loading?,
        unloading: unloading?,
        switch: switch?,
    })
}

fn branch(table: &Table<'_>) -> Result<Branch, Reported> {
    let base = quantity(table, "base", Unit::Siemens, &ranges::BRANCH_BASE);
    let rise = quantity(table, "rise", Unit::Siemens, &ranges::CONDUCTANCE);
    let mid = quantity(table, "mid", Unit::Newton, &ranges::MID);
    let width = quantity(table, "width", Unit::Newton, &ranges::FORCE);
    Ok(Branch {
        base: base?,
        rise: rise?,
        mid: mid?,
        width: width?,
    })
}

fn creep(table: &Table<'_>) -> Result<Creep, Reported> {
    let share = table.required("share", |item| item.number(&Range::between(0.0, 1.0)));
    let load = quantity(table, "load", Unit::Newton, &ranges::FORCE);
    let time = quantity(table, "time", Unit::Second, &ranges::TIME);
    Ok(Creep {
        share: share?,
        load: load?,
        time: time?,
    })
}

fn amplifier(table: &Table<'_>) -> Result<ResistanceAmplifier, Reported> {
    let feedback = quantity(table, "feedback", Unit::Ohm, &ranges::RESISTANCE);
    let reference = quantity(table, "reference", Unit::Volt, &ranges::VOLTAGE);
    let rail = quantity(table, "rail", Unit::Volt, &ranges::VOLTAGE);
    Ok(ResistanceAmplifier {
        feedback: feedback?,
        reference: reference?,
        rail: rail?,
    })
}

fn piezoelectric(item: &Item<'_>) -> Result<PiezoelectricCell, Reported> {
    let table = &item.table()?;
    let gain = quantity(table, "gain", Unit::VoltSecondPerNewton, &ranges::GAIN);
    let amplifier_time = quantity(table, "amplifier_time", Unit::Second, &ranges::TIME);
    let silicone_time = quantity(table, "silicone_time", Unit::Second, &ranges::TIME);
    let rail = quantity(table, "rail", Unit::Volt, &ranges::VOLTAGE);
    let offset = quantity(table, "offset", Unit::Volt, &ranges::OFFSET);
    let cell = PiezoelectricCell {
        gain: gain?,
        amplifier_time: amplifier_time?,
        silicone_time: silicone_time?,
        rail: rail?,
        offset: offset?,
    };
    match cell.check() {
        Ok(()) => Ok(cell),
        Err(error) => Err(item.report(error.to_string(), "")),
    }
}

/// Accepted values of a tactile sensor, but not what a slip of a unit makes of it.
mod ranges {
    use twinrig_document::Range;

    /// Spread of the constants of cells: time constants must stay apart.
    pub(super) const SPREAD: Range = Range::between(0.0, 0.5);
    /// Conductance of a cell \[S\].
    pub(super) const CONDUCTANCE: Range = Range::between(1e-12, 10.0);
    /// Offset of a conductance \[S\].
    pub(super) const BASE: Range = Range::between(-10.0, 10.0);
    /// Conductance of a branch without load \[S\].
    pub(super) const BRANCH_BASE: Range = Range::between(0.0, 10.0);
    /// Conductance per force \[S/N\].
    pub(super) const SENSITIVITY: Range = Range::between(1e-12, 10.0);
    /// Load of a cell \[N\].
    pub(super) const FORCE: Range = Range::between(1e-4, 1e6);
    /// Load in the middle of a branch \[N\].
    pub(super) const MID: Range = Range::between(-1e6, 1e6);
    /// Rate of the load at which the branch changes \[N/s\].
    pub(super) const RATE: Range = Range::between(1e-6, 1e9);
    /// Time constant \[s\].
    pub(super) const TIME: Range = Range::between(1e-6, 1e6);
    /// Resistor of an amplifier \[Ω\].
    pub(super) const RESISTANCE: Range = Range::between(1.0, 1e12);
    /// Supply or reference \[V\].
    pub(super) const VOLTAGE: Range = Range::between(1e-3, 1e3);
    /// Voltage per rate of the load \[V·s/N\].
    pub(super) const GAIN: Range = Range::between(-1e6, 1e6);
    /// Offset of a voltage \[V\].
    pub(super) const OFFSET: Range = Range::between(-10.0, 10.0);
}

fn quantity(table: &Table<'_>, key: &str, unit: Unit, range: &Range) -> Result<f64, Reported> {
    table.required(key, |item| item.quantity(unit, range))
}
