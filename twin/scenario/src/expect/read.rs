//! Reading expectations.

use std::f64::consts::PI;

use twinrig_document::{Item, Range, Reported, Table};
use twinrig_kernel::{SimDuration, SimTime, Unit};

use super::beyond_end;
use super::read_footstep;
use super::{
    Along, BodyClaim, Claim, CostMeasure, Expectation, SignalClaim, SignalMode, TimingClaim,
    TimingMeasure, Until,
};
use crate::limits::{Domain, Limits};
use crate::scenario::Placed;

pub(crate) const SUBJECTS: [&str; 6] = ["footstep", "body", "timing", "signal", "energy", "cost"];

pub(crate) const BODY_MEASURES: [&str; 10] = [
    "speed",
    "height",
    "roll",
    "pitch",
    "roll_range",
    "pitch_range",
    "height_range",
    "yaw_drift",
    "fall",
    "settles",
];

pub(crate) const TIMING_MEASURES: [(&str, TimingMeasure); 6] = [
    ("deadline_misses", TimingMeasure::DeadlineMisses),
    ("cycle_rate", TimingMeasure::CycleRate),
    ("jitter", TimingMeasure::Jitter),
    ("latency", TimingMeasure::Latency),
    ("longest_cycle", TimingMeasure::LongestCycle),
    ("half_range", TimingMeasure::HalfRange),
];

pub(crate) const SIGNAL_MODES: [&str; 3] = ["always", "eventually", "settles"];

/// Properties of the scenario that its expectations are checked against.
pub(crate) struct Context<'c> {
    /// Names of the known plants.
    pub plants: Vec<&'c str>,
    /// Duration of the run.
    pub duration: SimDuration,
    /// Time of the first change.
    pub first_change: Option<SimTime>,
}

/// Reads one `[[expect]]`.
pub(crate) fn expectation(item: &Item<'_>, context: &Context<'_>) -> Result<Expectation, Reported> {
    let table = item.table()?;
    let name = table.optional("name", |item| item.text().map(str::to_owned));
    let after = table.optional("after", |item| instant(item, context));
    let before = table.optional("before", |item| instant(item, context));
    let optional = table.optional("optional", Item::boolean);
    let plants = table.optional("plants", |item| {
        let plants = item.each(|item| plant(item, context))?;
        if plants.is_empty() {
            return Err(item.report("no plant is named", "leave `plants` out for all of them"));
        }
        Ok(plants)
    });
    let subject = one_of(item, &table, &SUBJECTS, "nothing is expected")?;
    let claim = table.required(subject, |item| match subject {
        "footstep" => read_footstep::claim(item).map(Claim::Footstep),
        "body" => body(item).map(Claim::Body),
        "timing" => timing(item),
        "signal" => signal(item).map(Claim::Signal),
        "energy" => energy(item),
        _ => cost(item),
    });
    let (explicit_after, before, claim) = (after?, before?, claim?);
    let mut expectation = Expectation {
        name: String::new(),
        after: explicit_after.unwrap_or(SimTime::ZERO),
        before,
        optional: optional?.unwrap_or(false),
        plants: plants?.unwrap_or_default(),
        claim,
    };
    if expectation.needs_reference() {
        match (explicit_after, context.first_change) {
            (None, Some(first)) => expectation.after = first,
            (_, None) => {
                let message =
                    "a displacement against the run without changes requires a [[change]]";
                return Err(item.report(message, "add a [[change]]"));
            }
            _ => {}
        }
    }
    if before.is_some_and(|before| before <= expectation.after) {
        return Err(table.report("before", "`before` is not later than `after`", ""));
    }
    if let Some(item) = table.get(subject) {
        beyond_end::warn(&item, &expectation, context.duration);
    }
    let measure = table
        .get(subject)
        .map_or(String::new(), |item| measure_name(&item));
    expectation.name = match name? {
        Some(name) => name,
        None => format!("{subject} {measure}").trim_end().replace('_', " "),
    };
    Ok(expectation)
}

/// Reads the name of a plant.
fn plant(item: &Item<'_>, context: &Context<'_>) -> Result<String, Reported> {
    let name = item.text()?;
    let mut plants = context.plants.iter().copied();
    if plants.clone().any(|known| known == name) {
        return Ok(name.to_owned());
    }
    let message = format!("there is no plant `{name}`");
    Err(item.report_word(message, name, "plants", &mut plants))
}

/// Returns the keys that name the measure, for an expectation without a name.
fn measure_name(item: &Item<'_>) -> String {
    const QUALIFIERS: [&str; 9] = [
        "leg",
        "tolerance",
        "cycle",
        "axis",
        "against",
        "along",
        "of",
        "component",
        "name",
    ];
    let Some(keys) = item.keys() else {
        return String::new();
    };
    let keys: Vec<_> = keys.filter(|key| !QUALIFIERS.contains(key)).collect();
    keys.join(" ")
}

/// Returns the one key of `keys` that `table` has. `missing` is the error if there is none.
pub(super) fn one_of<'k>(
    item: &Item<'_>,
    table: &Table<'_>,
    keys: &[&'k str],
    missing: &str,
) -> Result<&'k str, Reported> {
    table.expect(keys.iter().copied());
    let present: Vec<&str> = keys
        .iter()
        .copied()
        .filter(|key| table.keys().any(|known| known == *key))
        .collect();
    match present[..] {
        [key] => Ok(key),
        [] => {
            table.give_up();
            Err(item.report(missing, format!("give one of {}", keys.join(", "))))
        }
        [first, second, ..] => {
            table.give_up();
            let message = format!("`{first}` and `{second}` are two expectations");
            Err(table.report(second, message, "write a second [[expect]]"))
        }
    }
}

/// Reads a time since the start, within the run.
fn instant(item: &Item<'_>, context: &Context<'_>) -> Result<SimTime, Reported> {
    let since = item.duration()?;
    if since > context.duration {
        let message = format!("`{}` is later than the end of the run", item.key());
        return Err(item.report(message, format!("the run lasts {}", context.duration)));
    }
    Ok(SimTime::ZERO + since)
}

fn body(item: &Item<'_>) -> Result<BodyClaim, Reported> {
    let table = item.table()?;
    let missing = "no measure of the body is given";
    let measure = one_of(item, &table, &BODY_MEASURES, missing)?;
    let limits = |unit, domain| table.required(measure, |item| Limits::read(item, unit, &domain));
    let angle = |domain| limits(Unit::Radian, domain);
    Ok(match measure {
        "speed" => {
            let choices = [("heading", Along::Heading), ("path", Along::Path)];
            let along = table.optional("along", |item| item.choice(&choices));
            let along = along.map(|along| along.unwrap_or(Along::Heading));
            let domain = match along {
                Ok(Along::Path) => Domain::NOT_NEGATIVE,
                _ => Domain::ANY,
            };
            let limits = limits(Unit::MeterPerSecond, domain)?;
            BodyClaim::Speed(along?, limits)
        }
        "height" => BodyClaim::Height(limits(Unit::Meter, Domain::ANY)?),
        "roll" => BodyClaim::Roll(angle(Domain::HALF_TURN)?),
        "pitch" => BodyClaim::Pitch(angle(Domain::QUARTER_TURN)?),
        "roll_range" => BodyClaim::RollRange(angle(Domain::TURN)?),
        "pitch_range" => BodyClaim::PitchRange(angle(Domain::HALF_TURN)?),
        "height_range" => BodyClaim::HeightRange(limits(Unit::Meter, Domain::NOT_NEGATIVE)?),
        "yaw_drift" => BodyClaim::YawDrift(angle(Domain::NOT_NEGATIVE)?),
        "fall" => table.required("fall", fall)?,
        _ => table.required("settles", |item| {
            let (within, by) = settles(item, Unit::Meter)?;
            Ok(BodyClaim::Settles { within, by })
        })?,
    })
}

fn fall(item: &Item<'_>) -> Result<BodyClaim, Reported> {
    const HEIGHT: f64 = 0.5;
    const TILT: f64 = PI / 4.0;
    if !item.is_table() {
        if item.boolean()? {
            let message = "a fall cannot be expected";
            return Err(item.report(message, "write `fall = false`: the robot does not fall"));
        }
        return Ok(BodyClaim::Upright {
            height: HEIGHT,
            tilt: TILT,
            end: false,
        });
    }
    let table = item.table()?;
    let (height, tilt, end) = thresholds(&table);
    let (height, tilt) = (height?.unwrap_or(HEIGHT), tilt?.unwrap_or(TILT));
    if height == 0.0 && tilt >= PI {
        let help = "a `height` above 0, or a `tilt` below 180 deg";
        return Err(item.report("no state is a fall by these thresholds", help));
    }
    let end = end?.unwrap_or(false);
    Ok(BodyClaim::Upright { height, tilt, end })
}

/// Height, tilt and end of a fall.
type Thresholds = (
    Result<Option<f64>, Reported>,
    Result<Option<f64>, Reported>,
    Result<Option<bool>, Reported>,
);

/// Reads `height`, `tilt` and `end` of a fall.
pub(crate) fn thresholds(table: &Table<'_>) -> Thresholds {
    let share = Range::between(0.0, 1.0);
    let half_turn = Range::between(0.0, PI);
    (
        table.optional("height", |item| item.number(&share)),
        table.optional("tilt", |item| item.quantity(Unit::Radian, &half_turn)),
        table.optional("end", Item::boolean),
    )
}

fn settles(item: &Item<'_>, unit: Unit) -> Result<(f64, SimTime), Reported> {
    let table = item.table()?;
    let within = table.required("within", |item| item.quantity(unit, &Range::NOT_NEGATIVE));
    let by = table.required("by", Item::duration);
    Ok((within?, SimTime::ZERO + by?))
}

fn timing(item: &Item<'_>) -> Result<Claim, Reported> {
    let table = item.table()?;
    let of = table.required("of", placed_text);
    let keys = TIMING_MEASURES.map(|(key, _)| key);
    let key = one_of(item, &table, &keys, "no measure of the timing is given")?;
    let measure = TIMING_MEASURES
        .into_iter()
        .find(|(known, _)| *known == key)
        .map_or(TimingMeasure::Latency, |(_, measure)| measure);
    let limits = table.required(key, |item| {
        Limits::read(item, measure.unit(), &measure.domain())
    });
    Ok(Claim::Timing(TimingClaim {
        of: Some(of?).filter(|of| of.value != "control"),
        measure,
        limits: limits?,
    }))
}

fn signal(item: &Item<'_>) -> Result<SignalClaim, Reported> {
    let table = item.table()?;
    let name = table.required("name", placed_text);
    let component = table.optional("component", element);
    let within = table.optional("within", Item::positive_duration);
    let until = table.optional("until", until);
    let missing = "no condition on the signal is given";
    let mode = one_of(item, &table, &SIGNAL_MODES, missing)?;
    let (within, until) = (within?, until?);
    if within.is_some() && mode != "eventually" {
        let help = "`within` requires `eventually`";
        return Err(table.report(
            "within",
            format!("`within` has no meaning with `{mode}`"),
            help,
        ));
    }
    if until.is_some() && mode != "always" {
        let help = "`until` requires `always`";
        return Err(table.report(
            "until",
            format!("`until` has no meaning with `{mode}`"),
            help,
        ));
    }
    let (unit, mode) = table.required(mode, |item| {
        // The unit of the signal is only known to the scene, which compares the two.
        let unit = unit_of_limits(item)?;
        let mode = match mode {
            "settles" => {
                let (within, by) = settles(item, unit)?;
                SignalMode::Settles { within, by }
            }
            "eventually" => SignalMode::Eventually(Limits::read(item, unit, &Domain::ANY)?, within),
            _ => {
                let limits = Limits::read(item, unit, &Domain::ANY)?;
                match until {
                    None => SignalMode::Always(limits),
                    Some(until) => SignalMode::Until(limits, until),
                }
            }
        };
        Ok((unit, mode))
    })?;
    Ok(SignalClaim {
        name: name?,
        component: component?,
        unit,
        mode,
    })
}

fn until(item: &Item<'_>) -> Result<Until, Reported> {
    let table = item.table()?;
    let name = table.required("name", placed_text);
    let component = table.optional("component", element);
    let unit = unit_of_limits(item)?;
    let limits = Limits::read_from(&table, unit, &|message, help| item.report(message, help));
    Ok(Until {
        name: name?,
        component: component?.unwrap_or(0),
        unit,
        limits: limits?,
    })
}

/// Returns the unit of the first limit of a table of limits.
fn unit_of_limits(item: &Item<'_>) -> Result<Unit, Reported> {
    let keys = ["min", "max", "near", "within"];
    let first = keys.iter().find_map(|key| item.peek(key));
    first.map_or(Ok(Unit::One), |first| first.any_unit())
}

/// Reads an element of a signal: its index, or `x`, `y`, `z` for the first three.
fn element(item: &Item<'_>) -> Result<usize, Reported> {
    if item.is_text() {
        return item.choice(&[("x", 0), ("y", 1), ("z", 2)]);
    }
    let index = item.natural()?;
    usize::try_from(index).map_err(|_| item.report("no signal has that many elements", ""))
}

fn energy(item: &Item<'_>) -> Result<Claim, Reported> {
    let table = item.table()?;
    let limits = table.required("residual", |item| {
        Limits::read(item, Unit::One, &Domain::NOT_NEGATIVE)
    });
    Ok(Claim::EnergyResidual(limits?))
}

fn cost(item: &Item<'_>) -> Result<Claim, Reported> {
    let table = item.table()?;
    let mut keys = CostMeasure::counts().to_vec();
    keys.push(CostMeasure::FACTOR);
    let key = one_of(item, &table, &keys, "no measure of the cost is given")?;
    let (measure, domain) = if key == CostMeasure::FACTOR {
        (CostMeasure::RealTimeFactor, Domain::POSITIVE)
    } else {
        (CostMeasure::Count(key), Domain::COUNT)
    };
    let limits = table.required(key, |item| Limits::read(item, Unit::One, &domain))?;
    Ok(Claim::Cost(measure, limits))
}

/// Reads a text with its position.
pub(crate) fn placed_text(item: &Item<'_>) -> Result<Placed<String>, Reported> {
    Ok(Placed {
        value: item.text()?.to_owned(),
        place: item.place(),
    })
}
