//! Calibration files: constants of both cells as an identification found them.

use std::path::Path;

use twinrig_document::{
    Document, DocumentError, Item, Library, Placed, Range, Reported, Table, suggestion,
};
use twinrig_estimate::fit::CreepFit;
use twinrig_estimate::{Calibration, ChargeAmplifier, Decay, Hysteresis, Sigmoid};
use twinrig_kernel::Unit;

/// Calibrations of the sensors of the scenarios.
const CALIBRATIONS: Library = Library {
    folder: "calibrations",
    embedded: &[
        (
            "tactile-1",
            include_str!("../../../files/calibrations/tactile-1.toml"),
        ),
        (
            "tactile-2",
            include_str!("../../../files/calibrations/tactile-2.toml"),
        ),
        (
            "tactile-3",
            include_str!("../../../files/calibrations/tactile-3.toml"),
        ),
        (
            "tactile-4",
            include_str!("../../../files/calibrations/tactile-4.toml"),
        ),
    ],
};

/// File of a calibration.
pub struct CalibrationFile {
    document: Document,
}

impl CalibrationFile {
    /// Finds the file `name` for a scenario in `folder`.
    pub(crate) fn find(name: &Placed<String>, folder: &Path) -> Result<Self, DocumentError> {
        let document = CALIBRATIONS.find(&name.value, folder)?.ok_or_else(|| {
            let known = CALIBRATIONS.names(folder);
            let known = known.iter().map(String::as_str);
            let help = format!(
                "{}; `twin cell calibrate` writes one",
                suggestion(&name.value, "calibrations", known)
            );
            name.error(format!("there is no calibration `{}`", name.value), help)
        })?;
        Ok(Self { document })
    }

    /// Returns the file that a recording keeps as `file`.
    pub(crate) fn of_recording(
        name: &Placed<String>,
        file: &str,
        kept: &[(String, Vec<u8>)],
    ) -> Result<Self, DocumentError> {
        let found = kept.iter().find(|(known, _)| known == file);
        let message = format!("the recording does not contain `{file}`");
        let (_, bytes) = found.ok_or_else(|| name.error(message, ""))?;
        let document = Document::parse(file, &String::from_utf8_lossy(bytes))?;
        Ok(Self { document })
    }

    /// Text of the file.
    pub(crate) fn text(&self) -> &str {
        self.document.text()
    }

    /// Reads the constants.
    ///
    /// # Errors
    /// Every constant that is missing, unknown, of a wrong unit or out of range, at its place.
    pub(crate) fn calibration(&self) -> Result<Calibration, DocumentError> {
        self.document.check(calibration)
    }
}

fn calibration(table: &Table<'_>) -> Result<Calibration, Reported> {
    let run = table.required("run", |item| run(&item.table()?));
    let resistive = table.required("piezoresistive", |item| {
        let table = item.table()?;
        let still = hysteresis(&table);
        let residual = volts(&table, "residual");
        let creep = table.required("creep", |item| creep(&item.table()?));
        Ok((still?, residual?, creep?))
    });
    let electric = table.required("piezoelectric", |item| {
        let table = item.table()?;
        let gain = |key: &str| table.required(key, |item| item.quantity(GAIN, &Range::ANY));
        let time =
            |key: &str| table.required(key, |item| item.quantity(Unit::Second, &Range::POSITIVE));
        let (rate_gain, sensitivity) = (gain("rate_gain"), gain("gain"));
        let (feedback, lag) = (time("amplifier_time"), time("silicone_time"));
        let (rate, acceleration) = (
            table.required("rate", decay),
            table.required("acceleration", decay),
        );
        let residual = volts(&table, "residual");
        let amplifier = ChargeAmplifier {
            // The gain is that of the sensor; the amplifier inverts.
            sensitivity: -sensitivity?,
            feedback_s: feedback?,
            lag_s: lag?,
        };
        Ok((rate_gain?, rate?, acceleration?, amplifier, residual?))
    });
    let (hysteresis, hysteresis_residual, (creep, creep_residual)) = resistive?;
    let (rate_gain, rate, acceleration, amplifier, amplifier_residual) = electric?;
    run?;
    Ok(Calibration {
        hysteresis,
        hysteresis_residual,
        creep,
        creep_residual,
        rate_gain,
        rate,
        acceleration,
        amplifier,
        amplifier_residual,
    })
}

const GAIN: Unit = Unit::VoltSecondPerNewton;

/// Checks where the calibration comes from; on hardware the number of the cell is missing.
fn run(table: &Table<'_>) -> Result<(), Reported> {
    let scenario = table.required("scenario", |item| item.text().map(drop));
    let seed = table.required("seed", |item| item.natural().map(drop));
    let cell = table.optional("cell", |item| item.natural().map(drop));
    let fingerprint = table.required("fingerprint", |item| item.text().map(drop));
    scenario.and(seed).and(cell.map(drop)).and(fingerprint)
}

fn hysteresis(table: &Table<'_>) -> Result<Hysteresis, Reported> {
    let loading = table.required("loading", sigmoid);
    let unloading = table.required("unloading", sigmoid);
    let switch = table.required("switch", |item| {
        item.quantity(Unit::NewtonPerSecond, &Range::POSITIVE)
    });
    Ok(Hysteresis {
        loading: loading?,
        unloading: unloading?,
        switch: 1.0 / switch?,
    })
}

fn sigmoid(item: &Item<'_>) -> Result<Sigmoid, Reported> {
    let table = item.table()?;
    let newtons =
        |key: &str, range: Range| table.required(key, |item| item.quantity(Unit::Newton, &range));
    let (rise, base) = (volts(&table, "rise"), volts(&table, "base"));
    let (mid, width) = (
        newtons("mid", Range::ANY),
        newtons("width", Range::POSITIVE),
    );
    Ok(Sigmoid {
        a: rise?,
        b: -1.0 / width?,
        c: -mid?,
        d: base?,
    })
}

fn creep(table: &Table<'_>) -> Result<(CreepFit, f64), Reported> {
    let hysteresis = hysteresis(table);
    let floor = volts(table, "floor");
    let per_newton = table.required("per_newton", |item| item.number(&Range::ANY));
    let time = table.required("time", |item| item.quantity(Unit::Second, &Range::ANY));
    let residual = volts(table, "residual");
    let fit = CreepFit {
        hysteresis: hysteresis?,
        floor: floor?,
        per_newton: per_newton?,
        time_s: time?,
    };
    Ok((fit, residual?))
}

fn decay(item: &Item<'_>) -> Result<Decay, Reported> {
    let table = item.table()?;
    let value = table.required("value", |item| item.number(&Range::ANY));
    let scale = table.required("scale", |item| item.quantity(Unit::Hertz, &Range::POSITIVE));
    Ok(Decay {
        value: value?,
        scale_hz: scale?,
    })
}

fn volts(table: &Table<'_>, key: &str) -> Result<f64, Reported> {
    table.required(key, |item| item.quantity(Unit::Volt, &Range::ANY))
}
