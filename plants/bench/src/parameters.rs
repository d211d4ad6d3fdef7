//! Parameters of a test bench.

use std::path::Path;

use twinrig_document::declaration::{
    Accepts, Key, Shape, TableReference, TableSpec, Type, contextual, quantity, record, table,
};
use twinrig_document::{
    Document, DocumentError, Item, Placed, Problem, Reported, Table, suggestion,
};
use twinrig_kernel::Unit;
use twinrig_robot::Motor;
use twinrig_sensor::{BENCHES, TactileParameters};

use crate::cam::{Scratches, check_curvature};
use crate::profile::CamProfile;
use crate::ranges;

record! {
    /// Parameters of a test bench, read from a file of `benches/`.
    #[derive(Clone, Debug, PartialEq)]
    pub struct BenchParameters = "bench file", checked by check_cam {
        /// Name, for reports.
        pub name: String = Type::TEXT,
        /// Motor with its gear.
        pub motor: Motor = Motor::TYPE,
        /// Cam on the shaft.
        pub cam: CamParameters = CamParameters::TYPE,
        /// Carriage with its roller, between cam and sensor.
        pub carriage: Carriage = Carriage::TYPE,
        /// Reference cell behind the sensor.
        pub reference: ReferenceCell = ReferenceCell::TYPE,
        /// Tactile sensor.
        pub sensor: TactileParameters = TactileParameters::TYPE,
    }
}

/// Cam on the shaft.
#[derive(Clone, Debug, PartialEq)]
pub struct CamParameters {
    /// Profile.
    pub profile: CamProfile,
    /// Base radius \[m\].
    pub base_radius: f64,
    /// Inertia \[kg·m²\].
    pub inertia: f64,
    /// Viscous friction of cam shaft and gear \[N·m·s/rad\].
    pub friction: f64,
    /// Scratches.
    pub scratches: Scratches,
}

record! {
    /// Reference cell behind the sensor.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ReferenceCell = "[reference]" {
        /// Range \[N\].
        pub range: f64 = quantity(Unit::Newton, ranges::FORCE),
    }
}

record! {
    /// Carriage with its roller, between cam and sensor.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Carriage = "[carriage]" {
        /// Mass with the roller \[kg\].
        pub mass: f64 = quantity(Unit::Kilogram, ranges::MASS),
        /// Viscous friction \[N·s/m\].
        pub friction: f64 = quantity(Unit::NewtonSecondPerMeter, ranges::FRICTION),
        /// Radius of the roller \[m\].
        pub roller_radius: f64 = quantity(Unit::Meter, ranges::RADIUS),
        /// Stiffness of the springs together \[N/m\].
        pub stiffness: f64 = quantity(Unit::NewtonPerMeter, ranges::STIFFNESS),
        /// Compression of the springs at the lowest point of the cam; negative: gap before the
        /// sensor \[m\].
        pub preload: f64 = quantity(Unit::Meter, ranges::PRELOAD),
    }
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
    /// Returns the tables of a file of a test bench with their keys, beginning with the top level.
    pub fn tables() -> Vec<TableReference> {
        TableReference::of(BenchParameters::TABLE)
    }

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
        let mut bench = self.document.check(BenchParameters::read_from)?;
        bench.sensor = bench.sensor.numbered(settings.cell.as_ref())?;
        if let Some(lift) = &settings.cam {
            bench.cam.profile = match bench.cam.profile {
                CamProfile::Bump { .. } => CamProfile::Bump { lift: lift.value },
                _ => CamProfile::Harmonic { lift: lift.value },
            };
            let (cam, roller) = (&bench.cam, bench.carriage.roller_radius);
            let checked = check_curvature(&cam.profile, cam.base_radius, roller);
            checked.map_err(|error| lift.error(error.to_string(), "choose a lower lift"))?;
        }
        if let Some(preload) = &settings.preload {
            bench.carriage.preload = preload.value;
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
    let Carriage {
        stiffness, preload, ..
    } = bench.carriage;
    let most = stiffness * (bench.cam.profile.lift() + preload).max(0.0);
    let range = bench.reference.range;
    (most > range)
        .then(|| format!("a load of {most:.2} N saturates the reference cell of {range} N"))
}

fn check_cam(table: &Table<'_>, bench: &BenchParameters) -> Result<(), Reported> {
    let (cam, roller) = (&bench.cam, bench.carriage.roller_radius);
    let checked = check_curvature(&cam.profile, cam.base_radius, roller);
    checked.map_err(|error| table.report("cam", error.to_string(), "smooth its profile"))
}

table! {
    /// Keys of `[cam]`.
    cam_table = TableSpec::new("[cam]", "cam on the shaft");
    PROFILE: () = "profile",
        contextual(Shape::Either(&[
            Shape::Choice(|| vec!["harmonic", "bump"]),
            Shape::List {
                of: &Shape::One(Accepts::Quantity { unit: Unit::Meter, range: ranges::LIFT }),
                least: 9, distinct: false,
            },
        ])),
        "shape, or a table of lifts at even distances over a whole turn", "", default("'harmonic'");
    LIFT: f64 = "lift", quantity(Unit::Meter, ranges::LIFT), "greatest lift, of a named profile", "",
        required();
    BASE_RADIUS: f64 = "base_radius", quantity(Unit::Meter, ranges::RADIUS), "base radius", "",
        required();
    INERTIA: f64 = "inertia", quantity(Unit::KilogramSquareMeter, ranges::INERTIA), "inertia", "",
        required();
    FRICTION: f64 = "friction",
        quantity(Unit::NewtonMeterSecondPerRadian, ranges::SHAFT_FRICTION),
        "viscous friction of cam shaft and gear", "", required();
    SCRATCHES: Scratches = "scratches", Scratches::TYPE, "scratches at random angles", "",
        required();
}

impl CamParameters {
    const TYPE: Type<Self> =
        Type::new(
            Shape::Table(cam_table::TABLE),
            |item, _| cam(&item.table()?),
        );
}

fn cam(table: &Table<'_>) -> Result<CamParameters, Reported> {
    use cam_table::{BASE_RADIUS, FRICTION, INERTIA, LIFT, PROFILE, SCRATCHES, TABLE};
    let keys = TABLE.of(table);
    let profile = match keys.item(&PROFILE) {
        Some(item) if item.is_list() => lifts(&item),
        Some(item) => {
            let lift = keys.read(&LIFT);
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
        None => keys.read(&LIFT).map(|lift| CamProfile::Harmonic { lift }),
    };
    let (base_radius, inertia) = (keys.read(&BASE_RADIUS), keys.read(&INERTIA));
    let (friction, scratches) = (keys.read(&FRICTION), keys.read(&SCRATCHES));
    Ok(CamParameters {
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
