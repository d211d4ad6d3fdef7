//! Reading `[[payload]]` and `[[surface]]`.

use std::ops::Range as Extent;

use twinrig_document::{Item, Range, Reported};
use twinrig_kernel::{SimDuration, SimTime, Unit};

use super::changes::time_within_run;
use super::code;
use super::names::distinct_names;
use super::vector::PLACE;
use crate::language::{
    Accepts, Declared, Key, Shape, TableSpec, Type, contextual, quantity, table,
};
use crate::loads::{PayloadSpec, SurfaceSpec};
use crate::scenario::PlantSpec;

/// Greatest payload \[kg\]: beyond, a unit is wrong.
const MASS: Range = Range::between(0.0, 100.0);

table! {
    /// Keys of `[[payload]]`.
    pub(super) payload_table = TableSpec::new("[[payload]]", "point mass on the trunk");
    NAME: String = "name", Type::TEXT, "name", r#"name = "battery""#,
        otherwise("payload 1, payload 2, …");
    MASS_KEY: f64 = "mass", quantity(Unit::Kilogram, MASS), "mass", r#"mass = "200 g""#, required();
    AT: [f64; 3] = "at", PLACE, "place in trunk axes, from the trunk's centre of mass",
        r#"at = ["2 cm", "0 cm", "3 cm"]"#, required();
}

table! {
    /// Keys of `[[surface]]`.
    pub(super) surface_table = TableSpec::new("[[surface]]", "friction of a part of the ground");
    FRICTION: f64 = "friction", quantity(Unit::One, Range::between(0.0, 100.0)),
        "coefficient of Coulomb friction", "friction = 0.2", required();
    FROM: f64 = "from", quantity(Unit::Meter, Range::ANY), "place along x from which it applies",
        r#"from = "1 m", to = "1.4 m""#, otherwise("everywhere before `to`");
    TO: f64 = "to", quantity(Unit::Meter, Range::ANY), "place along x up to which it applies",
        r#"to = "1.4 m""#, otherwise("everywhere after `from`");
    BEGIN: () = "at", contextual(Shape::One(Accepts::Duration)), "time from which it applies",
        r#"at = "3 s""#, otherwise("the start");
    FOR: SimDuration = "for", Type::POSITIVE_DURATION, "time for which it applies",
        r#"at = "3 s", for = "2 s""#, otherwise("to the end");
}

/// Reads all payloads and surfaces into the plant.
pub(super) fn loads(
    root: Declared<'_, '_>,
    [payload_key, surface_key]: [&Key<()>; 2],
    plant: Result<PlantSpec, Reported>,
    run: SimDuration,
) -> Result<PlantSpec, Reported> {
    let payloads = root.get_with(payload_key, |item| {
        let items = item.list()?;
        let numbered = items.iter().enumerate();
        let payloads = numbered.map(|(index, item)| payload(item, index));
        let payloads = payloads.collect::<Result<Vec<PayloadSpec>, _>>()?;
        distinct_names(&items, &payloads, |payload| &payload.name, "payloads")?;
        Ok(payloads)
    });
    let surfaces = root.get_with(surface_key, |item| item.each(|item| surface(item, run)));
    let (mut plant, payloads, surfaces) = (plant?, payloads?, surfaces?);
    if let Some(payloads) = payloads {
        if plant.is_standalone {
            let message = format!("the plant `{}` has no trunk of a robot file", plant.model);
            let help = "leave the payloads out, or put them into the model";
            return Err(root.report(payload_key, message, help));
        }
        plant.payloads = payloads;
    }
    if let Some(surfaces) = surfaces {
        let Some(ground) = &mut plant.ground else {
            let (message, help) = if plant.is_standalone {
                let message = format!("the plant `{}` brings its own ground", plant.model);
                (
                    message,
                    "leave the surfaces out, or put them into the model",
                )
            } else {
                let message = "there is no ground whose friction could change".to_owned();
                (
                    message,
                    "set `ground` in [plant], or leave the surfaces out",
                )
            };
            return Err(root.report(surface_key, message, help));
        };
        ground.surfaces = surfaces;
    }
    Ok(plant)
}

fn payload(item: &Item<'_>, index: usize) -> Result<PayloadSpec, Reported> {
    use payload_table::{AT, MASS_KEY, NAME};
    let table = &item.table()?;
    let table = payload_table::TABLE.of(table);
    let (name, mass, at) = (table.get(&NAME), table.read(&MASS_KEY), table.read(&AT));
    Ok(PayloadSpec {
        name: name?.unwrap_or_else(|| format!("payload {}", index + 1)),
        mass: mass?,
        at: at?,
    })
}

fn surface(item: &Item<'_>, run: SimDuration) -> Result<SurfaceSpec, Reported> {
    use surface_table::{BEGIN, FOR, FRICTION, FROM, TO};
    let table = &item.table()?;
    let table = surface_table::TABLE.of(table);
    let (friction, from, to) = (table.read(&FRICTION), table.get(&FROM), table.get(&TO));
    let begin = table.get_with(&BEGIN, |item| time_within_run(item, run, code::SURFACE));
    let lasts = table.get(&FOR);
    let extent = Extent {
        start: from?.unwrap_or(f64::NEG_INFINITY),
        end: to?.unwrap_or(f64::INFINITY),
    };
    if extent.is_empty() {
        let message = "`to` is not beyond `from`";
        return Err(table.report(&TO, message, "exchange them, or leave one out"));
    }
    let begin = SimTime::ZERO + begin?.unwrap_or_default();
    Ok(SurfaceSpec {
        friction: friction?,
        extent,
        begin,
        end: lasts?.map(|lasts| begin + lasts),
    })
}
