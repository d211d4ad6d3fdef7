//! Parameters of a test bench.

use std::path::Path;

use twinrig_document::{
    Document, DocumentError, Item, Placed, Problem, Range, Reported, Table, suggestion,
};
use twinrig_kernel::Unit;
use twinrig_robot::Motor;
use twinrig_sensor::{BENCHES, TactileParameters};

use crate::cam::{Scratches, check_curvature};
use crate::profile::CamProfile;

/// Parameters of a test bench, read from a file of `benches/`.
#[derive(Clone, Debug, PartialEq)]
pub struct BenchParameters {
    /// Name, for reports.
    pub name: String,
    /// Motor with its gear.
    pub motor: Motor,
    /// Profile of the cam.
    pub profile: CamProfile,
    /// Base radius of the cam \[m\].
    pub base_radius: f64,
    /// Inertia of the cam \[kg·m²\].
    pub cam_inertia: f64,
    /// Viscous friction of cam shaft and gear \[N·m·s/rad\].
    pub cam_friction: f64,
    /// Scratches of the cam.
    pub scratches: Scratches,
    /// Mass of the carriage with its roller \[kg\].
    pub mass: f64,
    /// Viscous friction of the carriage \[N·s/m\].
    pub carriage_friction: f64,
    /// Radius of the roller \[m\].
    pub roller_radius: f64,
    /// Stiffness of the springs together \[N/m\].
    pub stiffness: f64,
    /// Compression of the springs at the lowest point of the cam; negative: gap before the sensor
    /// \[m\].
    pub preload: f64,
    /// Range of the reference cell \[N\].
    pub reference_range: f64,
    /// Tactile sensor.
    pub sensor: TactileParameters,
}

/// File of a test bench, and the values that a scenario sets.
#[derive(Clone, Debug)]
pub struct BenchFile {
    document: Document,
}

/// Values of a scenario in place of those of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BenchSettings {
    /// Greatest lift of a harmonic cam \[m\].
    pub cam: Option<Placed<f64>>,
    /// Compression of the springs at the lowest point of the cam \[m\].
    pub preload: Option<Placed<f64>>,
    /// Number of the cell, drawn within the spread of the file.
    pub cell: Option<Placed<u64>>,
}

impl BenchFile {
    /// Reads the file `name` of [`BENCHES`], for a scenario in the folder `beside`. `None` if there
    /// is none of that name.
    ///
    /// # Errors
    /// If it cannot be read or is not TOML.
    pub fn find(name: &str, beside: &Path) -> Result<Option<Self>, DocumentError> {
        let document = BENCHES.find(name, beside)?;
        Ok(document.map(|document| Self { document }))
    }

    /// Returns a list of the benches that [`BenchFile::find`] finds, with the one meant by `name`.
    pub fn suggestion(name: &str, beside: &Path) -> String {
        let known = BENCHES.names(beside);
        suggestion(name, "benches", known.iter().map(String::as_str))
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

    /// Reads and validates the bench with these settings.
    ///
    /// # Errors
    /// Every parameter that is missing, unknown, of a wrong unit or out of range, at its place: a
    /// cam that is not periodic or cuts under the roller, a load beyond the reference cell; at the
    /// number of a cell, a file without a spread.
    pub fn bench(&self, settings: &BenchSettings) -> Result<BenchParameters, DocumentError> {
        let (mut bench, spread) = self.document.check(bench)?;
        bench.sensor = bench.sensor.numbered(spread, settings.cell.as_ref())?;
        if let Some(cam) = &settings.cam {
            bench.profile = match bench.profile {
                CamProfile::Bump { .. } => CamProfile::Bump { lift: cam.value },
                _ => CamProfile::Harmonic { lift: cam.value },
            };
            let (base, roller) = (bench.base_radius, bench.roller_radius);
            let checked = check_curvature(&bench.profile, base, roller);
            checked.map_err(|error| cam.error(error.to_string(), "choose a lower lift"))?;
        }
        if let Some(preload) = &settings.preload {
            bench.preload = preload.value;
        }
        let set = [&settings.preload, &settings.cam].into_iter().flatten();
        match overload(&bench) {
            Some(message) => Err(match set.last() {
                Some(value) => value.error(message, OVERLOAD_HELP),
                None => Problem::of_file(self.document.file(), message, OVERLOAD_HELP).into(),
            }),
            None => Ok(bench),
        }
    }
}

const OVERLOAD_HELP: &str = "choose a lower cam, less preload or softer springs";

/// Returns the message about a reference cell that the bench would overload.
fn overload(bench: &BenchParameters) -> Option<String> {
    let most = bench.stiffness * (bench.profile.lift() + bench.preload).max(0.0);
    let range = bench.reference_range;
    (most > range)
        .then(|| format!("a load of {most:.2} N saturates the reference cell of {range} N"))
}

/// Reads a bench and the spread of its cells.
fn bench(table: &Table<'_>) -> Result<(BenchParameters, Option<f64>), Reported> {
    let name = table.required("name", |item| item.text().map(str::to_owned));
    let motor = table.required("motor", |item| Motor::read_from(&item.table()?));
    let cam = table.required("cam", |item| cam(&item.table()?));
    let carriage = table.required("carriage", |item| carriage(&item.table()?));
    let range = table.required("reference", |item| {
        quantity(&item.table()?, "range", Unit::Newton, &ranges::FORCE)
    });
    let sensor = table.required("sensor", |item| {
        (TactileParameters::TYPE.read)(item, &TactileParameters::TYPE.shape)
    });
    let (cam, carriage) = (cam?, carriage?);
    let (sensor, spread) = sensor?;
    let bench = BenchParameters {
        name: name?,
        motor: motor?,
        profile: cam.profile,
        base_radius: cam.base_radius,
        cam_inertia: cam.inertia,
        cam_friction: cam.friction,
        scratches: cam.scratches,
        mass: carriage.mass,
        carriage_friction: carriage.friction,
        roller_radius: carriage.roller_radius,
        stiffness: carriage.stiffness,
        preload: carriage.preload,
        reference_range: range?,
        sensor,
    };
    check_curvature(&bench.profile, bench.base_radius, bench.roller_radius)
        .map_err(|error| table.report("cam", error.to_string(), "smooth its profile"))?;
    Ok((bench, spread))
}

struct CamTable {
    profile: CamProfile,
    base_radius: f64,
    inertia: f64,
    friction: f64,
    scratches: Scratches,
}

fn cam(table: &Table<'_>) -> Result<CamTable, Reported> {
    let lift = |item: &Item<'_>| item.quantity(Unit::Meter, &ranges::LIFT);
    let profile = match table.get("profile") {
        Some(item) if item.is_list() => lifts(&item),
        Some(item) => {
            let lift = table.required("lift", lift);
            let bump = item.choice(&[("harmonic", false), ("bump", true)]);
            bump.and_then(|bump| {
                let lift = lift?;
                Ok(if bump {
                    CamProfile::Bump { lift }
                } else {
                    CamProfile::Harmonic { lift }
                })
            })
        }
        None => {
            let lift = table.required("lift", lift);
            lift.map(|lift| CamProfile::Harmonic { lift })
        }
    };
    let base_radius = quantity(table, "base_radius", Unit::Meter, &ranges::RADIUS);
    let inertia = quantity(
        table,
        "inertia",
        Unit::KilogramSquareMeter,
        &ranges::INERTIA,
    );
    let unit = Unit::NewtonMeterSecondPerRadian;
    let friction = quantity(table, "friction", unit, &ranges::SHAFT_FRICTION);
    let scratches = table.required("scratches", |item| scratches(&item.table()?));
    Ok(CamTable {
        profile: profile?,
        base_radius: base_radius?,
        inertia: inertia?,
        friction: friction?,
        scratches: scratches?,
    })
}

/// Bounds of the number of lifts of a table.
const LIFTS: std::ops::RangeInclusive<usize> = 9..=1001;

fn lifts(item: &Item<'_>) -> Result<CamProfile, Reported> {
    let lifts = item.each(|item| item.quantity(Unit::Meter, &ranges::LIFT))?;
    if !LIFTS.contains(&lifts.len()) {
        let message = format!("a cam of {} lifts", lifts.len());
        let help = format!(
            "{} to {} lifts at even distances over a whole turn are required",
            LIFTS.start(),
            LIFTS.end()
        );
        return Err(item.report(message, help));
    }
    let (first, last) = (lifts[0], lifts[lifts.len() - 1]);
    if first != last {
        let message = format!(
            "the cam is not periodic: its lift is {:.3} mm at 0° and {:.3} mm at 360°",
            first * 1e3,
            last * 1e3
        );
        return Err(item.report(message, "repeat the first lift at the end"));
    }
    Ok(CamProfile::Table { lifts })
}

/// Bound of the number of scratches.
const SCRATCHES_MAX: u32 = 100;

fn scratches(table: &Table<'_>) -> Result<Scratches, Reported> {
    let count = table.required("count", |item| {
        let count = item.natural()?;
        let most = u64::from(SCRATCHES_MAX);
        match u32::try_from(count) {
            Ok(count) if u64::from(count) <= most => Ok(count),
            _ => Err(item.report(
                format!("a cam of {count} scratches"),
                format!("at most {most}"),
            )),
        }
    });
    let depth = quantity(table, "depth", Unit::Meter, &ranges::DEPTH);
    let width = quantity(table, "width", Unit::Radian, &ranges::WIDTH);
    Ok(Scratches {
        count: count?,
        depth: depth?,
        width: width?,
    })
}

struct CarriageTable {
    mass: f64,
    friction: f64,
    roller_radius: f64,
    stiffness: f64,
    preload: f64,
}

fn carriage(table: &Table<'_>) -> Result<CarriageTable, Reported> {
    let mass = quantity(table, "mass", Unit::Kilogram, &ranges::MASS);
    let unit = Unit::NewtonSecondPerMeter;
    let friction = quantity(table, "friction", unit, &ranges::FRICTION);
    let roller_radius = quantity(table, "roller_radius", Unit::Meter, &ranges::RADIUS);
    let stiffness = quantity(table, "stiffness", Unit::NewtonPerMeter, &ranges::STIFFNESS);
    let preload = quantity(table, "preload", Unit::Meter, &ranges::PRELOAD);
    Ok(CarriageTable {
        mass: mass?,
        friction: friction?,
        roller_radius: roller_radius?,
        stiffness: stiffness?,
        preload: preload?,
    })
}

/// Accepted values of a bench that fits on a table, but not what a slip of a unit makes of it.
mod ranges {
    use twinrig_document::Range;

    /// Radius of cam or roller \[m\].
    pub(super) const RADIUS: Range = Range::between(1e-4, 1.0);
    /// Lift of the cam \[m\].
    pub(super) const LIFT: Range = Range::between(0.0, 0.5);
    /// Compression of the springs; negative: a gap \[m\].
    pub(super) const PRELOAD: Range = Range::between(-0.05, 0.05);
    /// Inertia of the cam \[kg·m²\].
    pub(super) const INERTIA: Range = Range::between(1e-10, 10.0);
    /// Friction of the cam's shaft \[N·m·s/rad\].
    pub(super) const SHAFT_FRICTION: Range = Range::between(0.0, 100.0);
    /// Mass of the carriage \[kg\].
    pub(super) const MASS: Range = Range::between(1e-4, 100.0);
    /// Friction of the carriage \[N·s/m\].
    pub(super) const FRICTION: Range = Range::between(0.0, 1e5);
    /// Stiffness of the springs \[N/m\].
    pub(super) const STIFFNESS: Range = Range::between(1e-2, 1e8);
    /// Range of the reference cell \[N\].
    pub(super) const FORCE: Range = Range::between(1e-3, 1e6);
    /// Depth of a scratch \[m\].
    pub(super) const DEPTH: Range = Range::between(0.0, 1e-4);
    /// Width of a scratch \[rad\]: narrower ones would fall between the points of the table of the
    /// cam.
    pub(super) const WIDTH: Range = Range::between(0.08, 1.0);
}

fn quantity(table: &Table<'_>, key: &str, unit: Unit, range: &Range) -> Result<f64, Reported> {
    table.required(key, |item| item.quantity(unit, range))
}
