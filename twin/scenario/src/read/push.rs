//! Reading `[[push]]`.

use std::f64::consts::FRAC_2_PI;

use twinrig_document::{Item, Range, Reported};
use twinrig_kernel::{SimDuration, SimTime, Unit, signal};

use super::changes::time_within_run;
use super::names::distinct_names;
use super::vector::{PLACE, three, vector};
use super::{code, print_duration};
use crate::catalogue::Catalogue;
use crate::language::{
    Accepts, Declared, Key, Shape, TableSpec, Type, Words, choice, contextual, quantity, table,
};
use crate::scenario::{Base, PlantSpec, PulseShape, PushLoad, PushSite, PushSpec};

table! {
    /// Keys of `[[push]]`.
    pub(super) push_table = TableSpec::new("[[push]]", "push on trunk or foot");
    NAME: String = "name", Type::TEXT, "name in messages", r#"name = "shove""#,
        otherwise("`push 1`, `push 2`, …");
    ON: PushSite = "on", Type::new(Shape::Pattern("^(body|leg/[^/]+/foot)$"), |item, _| site(item)),
        "pushed part: `body`, the trunk, or `leg/NAME/foot`", r#"on = "body""#, required();
    AT: () = "at", contextual(Shape::One(Accepts::Duration)), "begin", r#"at = "3 s""#, required();
    FOR: SimDuration = "for", Type::POSITIVE_DURATION, "length", r#"for = "100 ms""#, required();
    FORCE: f64 = "force", quantity(Unit::Newton, Range::positive_to(1e6)), "greatest force",
        r#"force = "20 N""#, one_of();
    TORQUE: f64 = "torque", quantity(Unit::NewtonMeter, Range::positive_to(1e6)),
        "greatest torque, on the trunk only", r#"torque = "0.5 N·m""#, one_of();
    IMPULSE: f64 = "impulse", quantity(Unit::NewtonSecond, Range::positive_to(1e6)),
        "integral of the force over the push", r#"impulse = "2 N·s""#, one_of();
    DIRECTION: [f64; 3] = "direction", DIRECTIONS,
        "direction of force or torque, world axes: forward, left, up", r#"direction = "-y""#,
        required();
    SHAPE: PulseShape = "shape", choice(), "course over the push", r#"shape = "half-sine""#,
        default("'rectangle'");
    POINT: [f64; 3] = "point", PLACE,
        "place of a force on the trunk, trunk axes, from its centre of mass",
        r#"point = ["0 cm", "0 cm", "5 cm"]"#, otherwise("the centre of mass");
}

/// A coordinate axis and its sign.
#[derive(Clone, Copy)]
struct Axis([f64; 3]);

impl Words for Axis {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("x", Axis([1.0, 0.0, 0.0])),
        ("-x", Axis([-1.0, 0.0, 0.0])),
        ("y", Axis([0.0, 1.0, 0.0])),
        ("-y", Axis([0.0, -1.0, 0.0])),
        ("z", Axis([0.0, 0.0, 1.0])),
        ("-z", Axis([0.0, 0.0, -1.0])),
    ];
}

impl Words for PulseShape {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("rectangle", PulseShape::Rectangle),
        ("half-sine", PulseShape::HalfSine),
        ("triangle", PulseShape::Triangle),
    ];
}

const DIRECTION_SHAPES: &[Shape] = &[
    Shape::Choice(Axis::words),
    three(&Shape::One(Accepts::Quantity {
        unit: Unit::One,
        range: Range::ANY,
    })),
];
const DIRECTIONS: Type<[f64; 3]> =
    Type::new(Shape::Either(DIRECTION_SHAPES), |item, _| direction(item));

fn direction(item: &Item<'_>) -> Result<[f64; 3], Reported> {
    if !item.is_list() {
        return Ok(item.choice(Axis::WORDS)?.0);
    }
    let direction = vector(item, Unit::One, &Range::ANY)?;
    let greatest = direction.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    if greatest == 0.0 {
        let help = "give at least one element other than 0";
        return Err(item.report("the vector has no direction", help));
    }
    // Division by the greatest element first: squares may overflow.
    let scaled = direction.map(|x| x / greatest);
    let length = libm::sqrt(scaled.iter().map(|x| x * x).sum());
    Ok(scaled.map(|x| x / length))
}

fn site(item: &Item<'_>) -> Result<PushSite, Reported> {
    let site = item.placed_text()?;
    let foot = signal::parse_leg(&site.value).filter(|(_, part)| *part == "foot");
    match (site.value.as_str(), foot) {
        ("body", _) => Ok(PushSite::Trunk),
        (_, Some((leg, _))) => Ok(PushSite::Foot(twinrig_document::Placed {
            value: leg.to_owned(),
            place: site.place,
        })),
        _ => Err(item.report(
            format!("`{}` cannot be pushed", site.value),
            "push `body`, the trunk, or a foot, as `leg/LF/foot`",
        )),
    }
}

/// Parts of the scenario on which the checks of pushes depend.
pub(super) struct Context<'s> {
    pub run: SimDuration,
    /// None if it is invalid.
    pub plant: Option<&'s PlantSpec>,
    pub catalogue: &'s Catalogue,
}

/// Reads all `[[push]]`.
pub(super) fn pushes(item: &Item<'_>, context: &Context<'_>) -> Result<Vec<PushSpec>, Reported> {
    let items = item.list()?;
    let read = items.iter().enumerate();
    let read: Vec<_> = read.map(|(n, item)| push(item, n, context)).collect();
    let pushes = read.into_iter().collect::<Result<Vec<_>, _>>()?;
    if let (Some(plant), false) = (context.plant, pushes.is_empty()) {
        check_plant(item, plant, context.catalogue)?;
    }
    distinct_names(&items, &pushes, |push| &push.name, "pushes")?;
    Ok(pushes)
}

fn check_plant(item: &Item<'_>, plant: &PlantSpec, catalogue: &Catalogue) -> Result<(), Reported> {
    let known = catalogue
        .plants
        .iter()
        .find(|kind| kind.name == plant.model);
    if known.is_none_or(|kind| kind.takes_pushes) {
        return Ok(());
    }
    let message = format!("the plant `{}` takes no pushes", plant.model);
    let able = catalogue.plants.iter().filter(|kind| kind.takes_pushes);
    let able: Vec<String> = able.map(|kind| format!("`{}`", kind.name)).collect();
    let help = format!(
        "pushes act on trunk and feet of a robot file: take {}, or leave them out",
        able.join(", ")
    );
    Err(item.report(message, help))
}

fn push(item: &Item<'_>, n: usize, context: &Context<'_>) -> Result<PushSpec, Reported> {
    use push_table::{AT, DIRECTION, FOR, FORCE, IMPULSE, NAME, ON, POINT, SHAPE, TORQUE};
    let table = &item.table()?;
    let table = push_table::TABLE.of(table);
    let (name, on) = (table.get(&NAME), table.read(&ON));
    let at = table.read_with(&AT, |item| time_within_run(item, context.run, code::PUSH));
    let (lasts, direction) = (table.read(&FOR), table.read(&DIRECTION));
    let (shape, point) = (table.read(&SHAPE), table.get(&POINT));
    let strengths = Strengths {
        force: table.get(&FORCE),
        torque: table.get(&TORQUE),
        impulse: table.get(&IMPULSE),
    };
    let place = [&FORCE, &TORQUE, &IMPULSE];
    let place = place.into_iter().find_map(|key| table.item(key));
    let place = place.map_or_else(|| item.place(), |it| it.place());
    let (on, shape, lasts) = (on?, shape?, lasts?);
    let (is_torque, peak) = strengths.peak(table, item, &on, shape.mean() * lasts.as_secs_f64())?;
    let load = match (is_torque, point?) {
        (false, point) if on == PushSite::Trunk => PushLoad::Force(point.unwrap_or_default()),
        (is_torque, None) if is_torque => PushLoad::Torque,
        (_, None) => PushLoad::Force([0.0; 3]),
        (_, Some(_)) => {
            let help = "leave it out: a force on the trunk alone has a place";
            return Err(table.report(&POINT, "this push has no place", help));
        }
    };
    if on == PushSite::Trunk && context.plant.is_some_and(|plant| plant.base == Base::Fixed) {
        let message = "the trunk is fixed and cannot be pushed";
        return Err(table.report(&ON, message, "push a foot, or set another `base`"));
    }
    let (at, direction) = (at?, direction?);
    if context
        .plant
        .is_some_and(|plant| plant.base == Base::Planar)
        && leaves_the_plane(load, direction)
    {
        let message = "a planar trunk does not move in this direction";
        let help = "push along x or z, turn about y, or set another `base`";
        return Err(table.report(&DIRECTION, message, help));
    }
    if !peak.is_finite() {
        let help = "give a lesser one, or a longer `for`";
        return Err(item.report("the push has no finite strength", help));
    }
    let end = at.checked_add(lasts);
    if at < context.run
        && end.is_none_or(|end| end > context.run)
        && let Some(item) = table.item(&FOR)
    {
        let message = format!(
            "the run ends at {}, during the push",
            print_duration(context.run)
        );
        item.warn(
            code::PUSH,
            message,
            "give a shorter time, or a longer `duration`",
        );
    }
    Ok(PushSpec {
        name: name?.unwrap_or_else(|| format!("push {}", n + 1)),
        on,
        at: SimTime::ZERO + at,
        lasts,
        load,
        shape,
        peak: direction.map(|x| x * peak),
        place,
    })
}

/// Returns whether a part of the load is not in the vertical plane of x, where it has no effect on
/// a planar robot.
fn leaves_the_plane(load: PushLoad, [x, y, z]: [f64; 3]) -> bool {
    match load {
        PushLoad::Force(_) => y != 0.0,
        PushLoad::Torque => x != 0.0 || z != 0.0,
    }
}

/// Keys of which a push has exactly one.
struct Strengths {
    force: Result<Option<f64>, Reported>,
    torque: Result<Option<f64>, Reported>,
    impulse: Result<Option<f64>, Reported>,
}

impl Strengths {
    /// Returns whether the push is a torque, and its greatest value. `seconds` is the integral of
    /// the shape of the push.
    fn peak(
        self,
        table: Declared<'_, '_>,
        item: &Item<'_>,
        on: &PushSite,
        seconds: f64,
    ) -> Result<(bool, f64), Reported> {
        match (self.force?, self.torque?, self.impulse?) {
            (Some(force), None, None) => Ok((false, force)),
            (None, None, Some(impulse)) => Ok((false, impulse / seconds)),
            (None, Some(torque), None) if *on == PushSite::Trunk => Ok((true, torque)),
            (None, Some(_), None) => {
                let help = "give a `force` or an `impulse`, or push the `body`";
                let message = "a foot is a point and has no torque";
                Err(table.report(&push_table::TORQUE, message, help))
            }
            (None, None, None) => {
                let help = "give `force`, `torque` or `impulse`";
                Err(item.report("the push has no strength", help))
            }
            _ => {
                let message = "`force`, `torque` and `impulse` are strengths of different pushes";
                let help = "give one of them, and the others in a second [[push]]";
                Err(item.report(message, help))
            }
        }
    }
}

impl PulseShape {
    /// Returns the mean over the push, relative to the greatest value.
    fn mean(self) -> f64 {
        match self {
            PulseShape::Rectangle => 1.0,
            PulseShape::HalfSine => FRAC_2_PI,
            PulseShape::Triangle => 0.5,
        }
    }
}
