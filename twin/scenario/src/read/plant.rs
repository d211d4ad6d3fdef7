//! Reading `[plant]` and `[actuator]`.

use twinrig_document::{Item, Range, Reported, Table};
use twinrig_kernel::{SimDuration, Unit};

use super::coupling::coupling;
use super::{code, kind, print_duration};
use crate::catalogue::{Catalogue, Kind};
use crate::expect::placed_text;
use crate::options::Options;
use crate::scenario::{
    ActuatorKind, ActuatorSpec, Base, Ground, Heights, Placed, PlantSpec, Profile, ServoOverride,
    StartPose,
};
use twinrig_runtime::Coupling;

/// Reads `[plant]`.
pub(super) fn plant(
    item: &Item<'_>,
    catalogue: &Catalogue,
    observe: SimDuration,
) -> Result<PlantSpec, Reported> {
    let table = item.table()?;
    let coupling = table.optional("coupling", |item| coupling(item, observe));
    let model = table.required("model", |item| kind(item, "plant", &catalogue.plants));
    if let Ok(model) = model
        && model.is_standalone
    {
        return standalone(&table, model, coupling?.unwrap_or_default());
    }
    let base = table.optional("base", |item| {
        item.choice(&[
            ("free", Base::Free),
            ("planar", Base::Planar),
            ("fixed", Base::Fixed),
        ])
    });
    let legs = table.optional("legs", legs);
    let ground = table.optional("ground", ground);
    let start = table.optional("start", start);
    let step = table.optional("step", step);
    let model = model.inspect_err(|_| table.give_up())?;
    let options = Options::read(&table, &model.options);
    Ok(PlantSpec {
        place: item.place(),
        model: model.name.clone(),
        is_standalone: false,
        base: base?.unwrap_or(Base::Free),
        legs: legs?,
        ground: ground?,
        start: start?,
        step: step?,
        coupling: coupling?.unwrap_or_default(),
        options: options?,
    })
}

/// Reads `[plant]` of a standalone model, which defines base, legs, ground and start itself.
fn standalone(table: &Table<'_>, model: &Kind, coupling: Coupling) -> Result<PlantSpec, Reported> {
    let step = table.optional("step", step);
    let options = Options::read(table, &model.options);
    Ok(PlantSpec {
        place: table.place(),
        model: model.name.clone(),
        is_standalone: true,
        base: Base::Free,
        legs: None,
        ground: None,
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
    let legs = item.each(placed_text)?;
    if legs.is_empty() {
        return Err(item.report("no leg is named", "leave `legs` out for all of them"));
    }
    Ok(legs)
}

fn start(item: &Item<'_>) -> Result<StartPose, Reported> {
    let table = item.table()?;
    let read = |key: &str, unit| {
        let value = table.optional(key, |item| item.quantity(unit, &Range::ANY));
        value.map(Option::unwrap_or_default)
    };
    let q = ["q1", "q2", "q3"].map(|key| read(key, Unit::Radian));
    let rates = ["q1_rate", "q2_rate", "q3_rate"].map(|key| read(key, Unit::RadianPerSecond));
    let ([q1, q2, q3], [hip, knee, ankle]) = (q, rates);
    Ok(StartPose {
        q: [q1?, q2?, q3?],
        rates: [hip?, knee?, ankle?],
    })
}

fn ground(item: &Item<'_>) -> Result<Ground, Reported> {
    #[derive(Clone, Copy)]
    enum Shape {
        Flat,
        StepDown,
        Heights,
    }
    let table = item.table()?;
    let friction = table.optional("friction", |item| item.number(&Range::NOT_NEGATIVE));
    let restitution = table.optional("restitution", |item| item.number(&Range::between(0.0, 1.0)));
    let shape = table.optional("profile", |item| {
        item.choice(&[
            ("flat", Shape::Flat),
            ("step-down", Shape::StepDown),
            ("heights", Shape::Heights),
        ])
    });
    let shape = shape
        .inspect_err(|_| table.give_up())?
        .unwrap_or(Shape::Flat);
    let length =
        |key: &str, range: Range| table.required(key, |item| item.quantity(Unit::Meter, &range));
    let profile = match shape {
        Shape::Flat => Profile::Flat,
        Shape::StepDown => {
            let (at, height) = (
                length("at", Range::ANY),
                length("height", Range::NOT_NEGATIVE),
            );
            Profile::StepDown {
                at: at?,
                height: height?,
            }
        }
        Shape::Heights => {
            let spacing = length("spacing", Range::POSITIVE);
            let heights = heights(&table);
            Profile::Heights {
                spacing: spacing?,
                heights: heights?,
            }
        }
    };
    Ok(Ground {
        friction: friction?,
        restitution: restitution?.unwrap_or_default(),
        profile,
    })
}

fn heights(table: &Table<'_>) -> Result<Heights, Reported> {
    let values = table.optional("values", |item| {
        let rows = item.each(|row| {
            row.each(|height| height.quantity(Unit::Meter, &Range::ANY))
        })?;
        let columns = rows.first().map_or(0, Vec::len);
        if columns == 0 || rows.iter().any(|row| row.len() != columns) {
            let help = "as in [[\"0 mm\", \"5 mm\"], [\"2 mm\", \"0 mm\"]]: rows of the same length, each along x";
            return Err(item.report("`values` is not a grid", help));
        }
        Ok(rows)
    });
    let amplitude = table.optional("amplitude", |item| {
        item.quantity(Unit::Meter, &Range::NOT_NEGATIVE)
    });
    let seed = table.optional("seed", Item::natural);
    match (values?, amplitude?, seed?) {
        (Some(rows), None, None) => Ok(Heights::Given(rows)),
        (None, Some(amplitude), seed) => Ok(Heights::Random { amplitude, seed }),
        (Some(_), _, _) => {
            let message = "heights are either listed or random";
            Err(table.report(
                "values",
                message,
                "give `values`, or `amplitude` and optionally `seed`",
            ))
        }
        (None, None, _) => {
            let message = "the ground has no heights";
            Err(table.report(
                "profile",
                message,
                "give `values`, or `amplitude` and optionally `seed`",
            ))
        }
    }
}

/// Reads `[actuator]`.
pub(super) fn actuator(table: &Table<'_>, run: SimDuration) -> Result<ActuatorSpec, Reported> {
    let kind = table.optional("kind", |item| {
        item.choice(&[
            ("servo", ActuatorKind::Servo),
            ("ideal", ActuatorKind::Ideal),
            ("none", ActuatorKind::None),
            ("motor", ActuatorKind::Motor),
        ])
    });
    let both = servo(table, run);
    let hip = table.optional("hip", |item| servo(&item.table()?, run));
    let knee = table.optional("knee", |item| servo(&item.table()?, run));
    let (kind, both) = (kind?.unwrap_or_default(), both?);
    let (hip, knee) = (hip?.unwrap_or_default(), knee?.unwrap_or_default());
    let has_overrides = [both, hip, knee]
        .iter()
        .any(|servo| *servo != ServoOverride::default());
    let subject = match kind {
        ActuatorKind::Servo => None,
        ActuatorKind::Ideal => Some("an ideal actuator has"),
        ActuatorKind::None => Some("a leg without actuators has"),
        ActuatorKind::Motor => Some("a motor has"),
    };
    if let Some(subject) = subject
        && has_overrides
    {
        let message = format!("{subject} no lag, speed, torque or dead band");
        return Err(table.report(
            "kind",
            message,
            "write kind = \"servo\", or leave the figures out",
        ));
    }
    Ok(ActuatorSpec {
        kind,
        hip: hip.over(both),
        knee: knee.over(both),
    })
}

impl ServoOverride {
    fn over(self, other: Self) -> Self {
        ServoOverride {
            lag: self.lag.or(other.lag),
            speed: self.speed.or(other.speed),
            torque: self.torque.or(other.torque),
            dead_band: self.dead_band.or(other.dead_band),
        }
    }
}

fn servo(table: &Table<'_>, run: SimDuration) -> Result<ServoOverride, Reported> {
    let parameter =
        |key: &str, unit, range: Range| table.optional(key, |item| item.quantity(unit, &range));
    let lag = table.optional("lag", |item| {
        let lag = item.quantity(Unit::Second, &Range::POSITIVE)?;
        if lag > run.as_secs_f64() {
            let help = format!(
                "the run lasts {}: the servo hardly moves in it",
                print_duration(run)
            );
            item.warn(code::LAG, "the lag is longer than the run", help);
        }
        Ok(lag)
    });
    let speed = parameter("speed", Unit::RadianPerSecond, Range::POSITIVE);
    let torque = parameter("torque", Unit::NewtonMeter, Range::POSITIVE);
    let dead_band = parameter("dead_band", Unit::Radian, Range::NOT_NEGATIVE);
    Ok(ServoOverride {
        lag: lag?,
        speed: speed?,
        torque: torque?,
        dead_band: dead_band?,
    })
}
