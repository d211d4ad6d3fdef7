//! Reading `[plant]` and its ground.

use std::f64::consts::TAU;

use twinrig_document::{Item, Placed, Range, Reported};
use twinrig_kernel::{SimDuration, Unit};
use twinrig_runtime::Coupling;

use super::coupling::{coupling, coupling_table};
use super::names::kind;
use super::options::options;
use crate::catalogue::{Catalogue, Kind};
use crate::language::{
    Accepts, Declared, Key, Part, Shape, Special, TableSpec, Type, Words, choice, contextual,
    quantity, table,
};
use crate::scenario::{Abduction, Base, Contacts, Ground, Heights, PlantSpec, Profile, StartPose};

table! {
    /// Keys of `[plant]` of every model.
    pub(super) plant_table = TableSpec::new("[plant]", "model of the physics, ground, initial pose")
        .selected_by("model");
    MODEL: () = "model", contextual(Shape::Other(Special::Kind(Part::Plant))), "model", r#"model = "lcp""#,
        required();
    BASE: Base = "base", choice(), "mobility of the trunk", r#"base = "fixed""#, default("'free'");
    ABDUCTION: Abduction = "abduction", choice(), "joints of hip abduction",
        r#"abduction = "free""#, default("'locked'");
    CONTACTS: Contacts = "contacts", choice(),
        "parts that have contact with the ground: feet; trunk as well; knees and ankles as well",
        r#"contacts = "all""#, default("'feet'");
    LEGS: Vec<Placed<String>> = "legs", super::LEGS, "simulated legs", r#"legs = ["LF", "RH"]"#,
        otherwise("all");
    GROUND: Ground = "ground", Type::new(Shape::Table(ground_table::TABLE), |item, _| ground(item)),
        "ground", "ground = { friction = 0.6 }", otherwise("none: the robot hangs in the air");
    START: StartPose = "start", Type::new(Shape::Table(start_table::TABLE), |item, _| start(item)),
        "initial joint angles and rates of all legs", r#"start = { q1 = "10 deg" }"#,
        otherwise("the first commands of the controller; upright without one");
    STEP: SimDuration = "step",
        Type::new(Shape::One(Accepts::PositiveDuration), |item, _| step(item)),
        "maximum time step, up to 10 ms", r#"step = "1 ms""#, otherwise("of the model");
    COUPLING: () = "coupling",
        contextual(Shape::Either(&[
            Shape::Choice(|| vec!["exact"]), Shape::Table(coupling_table::TABLE),
        ])),
        "coupling with boards and transfers: at each of their instants, or on a fixed grid",
        r#"coupling = { grid = "1 ms" }"#, otherwise("`exact`");
}

/// Returns the keys of the models of a robot: standalone ones have none of them.
pub(crate) fn robot_keys() -> [&'static str; 6] {
    use plant_table::{ABDUCTION, BASE, CONTACTS, GROUND, LEGS, START};
    [
        BASE.name,
        ABDUCTION.name,
        CONTACTS.name,
        LEGS.name,
        GROUND.name,
        START.name,
    ]
}

const LEGS: Type<Vec<Placed<String>>> =
    Type::new(Shape::set(&Shape::One(Accepts::Name), 1), |item, _| {
        legs(item)
    });

/// A joint turns no further.
const ANGLE: Type<f64> = quantity(Unit::Radian, Range::between(-TAU, TAU));
/// The speed of the fastest servo of a robot file.
const RATE: Type<f64> = quantity(Unit::RadianPerSecond, Range::between(-1e5, 1e5));
/// Extent of a ground along an axis \[m\].
const EXTENT: f64 = 1e5;
/// Greatest height of a ground \[m\].
const HEIGHT_MOST: f64 = 1e3;

table! {
    /// Keys of `start`.
    pub(super) start_table = TableSpec::new("start", "initial joint angles and rates");
    Q1: f64 = "q1", ANGLE, "angle of the hip", r#"q1 = "10 deg""#, default("'0 rad'");
    Q2: f64 = "q2", ANGLE, "angle of the knee", r#"q2 = "-9.5 deg""#, default("'0 rad'");
    Q3: f64 = "q3", ANGLE, "angle of the ankle", r#"q3 = "9.5 deg""#, default("'0 rad'");
    Q1_RATE: f64 = "q1_rate", RATE, "rate of the hip", r#"q1_rate = "1 rad/s""#,
        default("'0 rad/s'");
    Q2_RATE: f64 = "q2_rate", RATE, "rate of the knee", r#"q2_rate = "-1 rad/s""#,
        default("'0 rad/s'");
    Q3_RATE: f64 = "q3_rate", RATE, "rate of the ankle", r#"q3_rate = "1 rad/s""#,
        default("'0 rad/s'");
}

/// Shape of the ground, without its sizes.
#[derive(Clone, Copy)]
pub(super) enum ProfileName {
    Flat,
    StepDown,
    Hole,
    Bar,
    Heights,
}

impl Words for ProfileName {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("flat", ProfileName::Flat),
        ("step-down", ProfileName::StepDown),
        ("hole", ProfileName::Hole),
        ("bar", ProfileName::Bar),
        ("heights", ProfileName::Heights),
    ];
}

table! {
    /// Keys of `ground`.
    pub(super) ground_table = TableSpec::new("ground", "friction and shape of the ground")
        .selected_by("profile");
    FRICTION: f64 = "friction", quantity(Unit::One, Range::between(0.0, 100.0)),
        "coefficient of Coulomb friction", "friction = 0.6", otherwise("the robot file's");
    RESTITUTION: f64 = "restitution", quantity(Unit::One, Range::between(0.0, 1.0)),
        "coefficient of restitution: a ratio of speeds, in `lcp` by `rk4` and `rodas4` of impulses",
        "restitution = 0.3", default("0");
    PROFILE: ProfileName = "profile", choice(), "shape", r#"profile = "flat""#, default("'flat'");
    AT: f64 = "at", quantity(Unit::Meter, Range::between(-EXTENT, EXTENT)),
        "place of the step, or of the near edge of a hole or bar",
        r#"profile = "step-down", at = "1 m", height = "20 mm""#, required(),
        only_with(&["step-down", "hole", "bar"]);
    HEIGHT: f64 = "height", quantity(Unit::Meter, Range::between(0.0, HEIGHT_MOST)),
        "depth of the step or of the hole, height of the bar",
        r#"profile = "step-down", at = "1 m", height = "20 mm""#, required(),
        only_with(&["step-down", "hole", "bar"]);
    LENGTH: f64 = "length", quantity(Unit::Meter, Range::positive_to(EXTENT)),
        "extent of a hole or bar along x",
        r#"profile = "hole", at = "1 m", length = "5 cm", height = "20 mm""#, required(),
        only_with(&["hole", "bar"]);
    SPACING: f64 = "spacing", quantity(Unit::Meter, Range::positive_to(HEIGHT_MOST)), "distance of grid points",
        r#"profile = "heights", spacing = "5 cm", amplitude = "4 mm""#, required(),
        only_with(&["heights"]);
    VALUES: Vec<Vec<f64>> = "values", Type::new(ROWS, |item, _| rows(item)),
        "given heights, each row along x",
        r#"profile = "heights", spacing = "5 cm", values = [["0 mm", "5 mm"], ["2 mm", "0 mm"]]"#,
        one_of(), only_with(&["heights"]);
    AMPLITUDE: f64 = "amplitude", quantity(Unit::Meter, Range::between(0.0, HEIGHT_MOST)),
        "greatest of random heights",
        r#"profile = "heights", spacing = "5 cm", amplitude = "4 mm""#, one_of(),
        only_with(&["heights"]);
    SEED: u64 = "seed", Type::NATURAL, "seed of random heights",
        r#"profile = "heights", spacing = "5 cm", amplitude = "4 mm", seed = 3"#,
        otherwise("the run's"), needs("amplitude"), only_with(&["heights"]);
}

/// Given heights \[m\].
const HEIGHTS: Range = Range::between(-HEIGHT_MOST, HEIGHT_MOST);

const ROWS: Shape = Shape::List {
    of: &Shape::list(
        &Shape::One(Accepts::Quantity {
            unit: Unit::Meter,
            range: HEIGHTS,
        }),
        1,
    ),
    least: 1,
    distinct: false,
};

/// Reads `[plant]`.
pub(super) fn plant(
    item: &Item<'_>,
    catalogue: &Catalogue,
    observe: SimDuration,
) -> Result<PlantSpec, Reported> {
    use plant_table::{ABDUCTION, BASE, CONTACTS, COUPLING, GROUND, LEGS, MODEL, START, STEP};
    let table = &item.table()?;
    let table = plant_table::TABLE.of(table);
    let coupling = table.get_with(&COUPLING, |item| coupling(item, observe));
    let model = table.read_with(&MODEL, |item| kind(item, Part::Plant, &catalogue.plants));
    if let Ok(model) = model
        && !model.has_robot_keys()
    {
        return standalone(table, model, coupling?.unwrap_or_default());
    }
    let (base, legs) = (table.read(&BASE), table.get(&LEGS));
    let (abduction, contacts) = (table.read(&ABDUCTION), table.read(&CONTACTS));
    let (ground, start, step) = (table.get(&GROUND), table.get(&START), table.get(&STEP));
    let model = model.inspect_err(|_| table.give_up())?;
    let options = options(&table, &model.options);
    Ok(PlantSpec {
        place: item.place(),
        model: model.name.clone(),
        is_standalone: model.standalone.is_some(),
        base: base?,
        abduction: abduction?,
        contacts: contacts?,
        legs: legs?,
        ground: ground?,
        payloads: Vec::new(),
        start: start?,
        step: step?,
        coupling: coupling?.unwrap_or_default(),
        options: options?,
    })
}

/// Reads `[plant]` of a standalone model, which defines base, legs, ground and start itself.
fn standalone(
    table: Declared<'_, '_>,
    model: &Kind,
    coupling: Coupling,
) -> Result<PlantSpec, Reported> {
    let step = table.get(&plant_table::STEP);
    let options = options(&table, &model.options);
    Ok(PlantSpec {
        place: table.place(),
        model: model.name.clone(),
        is_standalone: true,
        base: Base::Free,
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        legs: None,
        ground: None,
        payloads: Vec::new(),
        start: None,
        step: step?,
        coupling,
        options: options?,
    })
}

/// Greatest step of a plant; a body falls half a millimetre in it.
const GREATEST_STEP: SimDuration = SimDuration::from_millis(10);

fn step(item: &Item<'_>) -> Result<SimDuration, Reported> {
    let step = item.positive_duration()?;
    if step > GREATEST_STEP {
        let message = format!("`step` is {step}, which is out of range");
        let help = format!("it must be longer than 0 s, at most {GREATEST_STEP}");
        return Err(item.report(message, help));
    }
    Ok(step)
}

fn legs(item: &Item<'_>) -> Result<Vec<Placed<String>>, Reported> {
    let legs = item.each(Item::placed_text)?;
    if legs.is_empty() {
        return Err(item.report("no leg is named", "leave `legs` out for all of them"));
    }
    Ok(legs)
}

fn start(item: &Item<'_>) -> Result<StartPose, Reported> {
    use start_table::{Q1, Q1_RATE, Q2, Q2_RATE, Q3, Q3_RATE};
    let table = &item.table()?;
    let table = start_table::TABLE.of(table);
    let [q1, q2, q3] = [Q1, Q2, Q3].map(|key| table.read(&key));
    let [hip, knee, ankle] = [Q1_RATE, Q2_RATE, Q3_RATE].map(|key| table.read(&key));
    let place = |key| {
        table
            .item(&key)
            .map_or_else(|| item.place(), |it| it.place())
    };
    Ok(StartPose {
        q: [q1?, q2?, q3?],
        rates: [hip?, knee?, ankle?],
        places: [Q1, Q2, Q3].map(place),
    })
}

fn ground(item: &Item<'_>) -> Result<Ground, Reported> {
    use ground_table::{AT, FRICTION, HEIGHT, LENGTH, PROFILE, RESTITUTION, SPACING};
    let table = &item.table()?;
    let table = ground_table::TABLE.of(table);
    let (friction, restitution) = (table.get(&FRICTION), table.read(&RESTITUTION));
    let profile = table.read(&PROFILE).inspect_err(|_| table.give_up())?;
    let profile = match profile {
        ProfileName::Flat => Profile::Flat,
        ProfileName::StepDown => {
            let (at, height) = (table.read(&AT), table.read(&HEIGHT));
            Profile::StepDown {
                at: at?,
                height: height?,
            }
        }
        ProfileName::Hole | ProfileName::Bar => {
            let (at, height) = (table.read(&AT), table.read(&HEIGHT));
            let length = table.read(&LENGTH);
            let (at, length, height) = (at?, length?, height?);
            match profile {
                ProfileName::Hole => Profile::Hole { at, length, height },
                _ => Profile::Bar { at, length, height },
            }
        }
        ProfileName::Heights => {
            let (spacing, heights) = (table.read(&SPACING), heights(table));
            Profile::Heights {
                spacing: spacing?,
                heights: heights?,
            }
        }
    };
    Ok(Ground {
        friction: friction?,
        restitution: restitution?,
        profile,
        surfaces: Vec::new(),
        place: item.place(),
    })
}

fn heights(table: Declared<'_, '_>) -> Result<Heights, Reported> {
    use ground_table::{AMPLITUDE, PROFILE, SEED, VALUES};
    const HELP: &str = "give `values`, or `amplitude` and optionally `seed`";
    let (values, amplitude) = (table.get(&VALUES), table.get(&AMPLITUDE));
    let seed = table.get(&SEED);
    match (values?, amplitude?, seed?) {
        (Some(rows), None, None) => Ok(Heights::Given(rows)),
        (None, Some(amplitude), seed) => Ok(Heights::Random { amplitude, seed }),
        (Some(_), _, _) => Err(table.report(&VALUES, "heights are either listed or random", HELP)),
        (None, None, _) => Err(table.report(&PROFILE, "the ground has no heights", HELP)),
    }
}

fn rows(item: &Item<'_>) -> Result<Vec<Vec<f64>>, Reported> {
    let rows = item.each(|row| row.each(|height| height.quantity(Unit::Meter, &HEIGHTS)))?;
    let columns = rows.first().map_or(0, Vec::len);
    if let Some(ragged) = rows.iter().position(|row| row.len() != columns) {
        let found = rows[ragged].len();
        let message = format!(
            "`values` is not a grid: row 1 has {columns} values, row {} has {found}",
            ragged + 1
        );
        return Err(item.report(message, "every row has the same number of values, along x"));
    }
    if columns == 0 {
        let help = "as in [[\"0 mm\", \"5 mm\"], [\"2 mm\", \"0 mm\"]]: rows of the same length, each along x";
        return Err(item.report("`values` is not a grid", help));
    }
    Ok(rows)
}
