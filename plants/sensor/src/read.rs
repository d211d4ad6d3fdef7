//! Reading of sensor parameters.

use std::ops::Bound;
use std::path::Path;

use twinrig_document::{
    Document, DocumentError, Item, Library, Range, Reported, Table, suggestion,
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
        self.document.check(|table| {
            table.expect(table.keys());
            table.required("sensor", |item| TactileParameters::read(&item.table()?))
        })
    }
}

impl TactileParameters {
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
    let sensitivity = positive(table, "sensitivity", Unit::SiemensPerNewton);
    let base = table.required("base", |item| item.quantity(Unit::Siemens, &Range::ANY));
    let saturation = positive(table, "saturation", Unit::Newton);
    Ok(Characteristic::Saturating {
        sensitivity: sensitivity?,
        base: base?,
        saturation: saturation?,
    })
}

fn hysteretic(table: &Table<'_>) -> Result<Characteristic, Reported> {
    let loading = table.required("loading", |item| branch(&item.table()?));
    let unloading = table.required("unloading", |item| branch(&item.table()?));
    let switch = positive(table, "switch", Unit::NewtonPerSecond);
    Ok(Characteristic::Hysteretic {
        loading: loading?,
        unloading: unloading?,
        switch: switch?,
    })
}

fn branch(table: &Table<'_>) -> Result<Branch, Reported> {
    let base = table.required("base", |item| {
        item.quantity(Unit::Siemens, &Range::NOT_NEGATIVE)
    });
    let rise = positive(table, "rise", Unit::Siemens);
    let mid = table.required("mid", |item| item.quantity(Unit::Newton, &Range::ANY));
    let width = positive(table, "width", Unit::Newton);
    Ok(Branch {
        base: base?,
        rise: rise?,
        mid: mid?,
        width: width?,
    })
}

fn creep(table: &Table<'_>) -> Result<Creep, Reported> {
    let share = table.required("share", |item| item.number(&Range::between(0.0, 1.0)));
    let load = positive(table, "load", Unit::Newton);
    let time = positive(table, "time", Unit::Second);
    Ok(Creep {
        share: share?,
        load: load?,
        time: time?,
    })
}

fn amplifier(table: &Table<'_>) -> Result<ResistanceAmplifier, Reported> {
    let feedback = positive(table, "feedback", Unit::Ohm);
    let reference = positive(table, "reference", Unit::Volt);
    let rail = positive(table, "rail", Unit::Volt);
    Ok(ResistanceAmplifier {
        feedback: feedback?,
        reference: reference?,
        rail: rail?,
    })
}

fn piezoelectric(item: &Item<'_>) -> Result<PiezoelectricCell, Reported> {
    let table = &item.table()?;
    let gain = table.required("gain", |item| {
        item.quantity(Unit::VoltSecondPerNewton, &Range::ANY)
    });
    let amplifier_time = positive(table, "amplifier_time", Unit::Second);
    let silicone_time = positive(table, "silicone_time", Unit::Second);
    let rail = positive(table, "rail", Unit::Volt);
    let offset = table.required("offset", |item| item.quantity(Unit::Volt, &VOLTS));
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

const VOLTS: Range = Range {
    min: Bound::Included(-10.0),
    max: Bound::Included(10.0),
};

fn positive(table: &Table<'_>, key: &str, unit: Unit) -> Result<f64, Reported> {
    table.required(key, |item| item.quantity(unit, &Range::POSITIVE))
}
