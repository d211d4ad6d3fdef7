//! Reading `[[fault]]`.

use twinrig_document::{Item, Placed, Range, Reported, suggestion};
use twinrig_kernel::{SimDuration, SimTime, Unit};
use twinrig_runtime::{
    DriverPhase, FaultDirection, FaultKind, FaultSelection, FrameChoice, FrameCount,
};

use super::changes::time_within_run;
use super::code;
use crate::language::{
    Accepts, Declared, Key, Shape, TableSpec, Type, Words, choice, contextual, quantity, table,
};
use crate::scenario::{BusSpec, FaultSpec};

/// Kind of a fault, without its figures.
#[derive(Clone, Copy)]
pub(super) enum FaultName {
    Drop,
    Flip,
    Delay,
    Duplicate,
    Reorder,
    Unplug,
    Stuck,
    Babble,
    BrownOut,
    Drift,
}

impl Words for FaultName {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("drop", FaultName::Drop),
        ("flip", FaultName::Flip),
        ("delay", FaultName::Delay),
        ("duplicate", FaultName::Duplicate),
        ("reorder", FaultName::Reorder),
        ("unplug", FaultName::Unplug),
        ("stuck", FaultName::Stuck),
        ("babble", FaultName::Babble),
        ("brown-out", FaultName::BrownOut),
        ("drift", FaultName::Drift),
    ];
}

/// Greatest change of the rate of a clock, that of the option `clock` of buses.
const DRIFT_MAX: f64 = 0.1;
const PROBABILITY: Type<f64> = quantity(Unit::One, Range::between(0.0, 1.0));

table! {
    /// Keys of `[[fault]]`.
    pub(super) fault_table = TableSpec::new("[[fault]]", "fault of a wire, or of boards on it").selected_by("kind");
    AT: () = "at", contextual(Shape::One(Accepts::Duration)), "begin", r#"at = "1 s""#,
        default("'0 s'");
    FOR: SimDuration = "for", Type::POSITIVE_DURATION, "length", r#"for = "90 ms""#,
        otherwise("to the end");
    ON: Placed<String> = "on", Type::new(Shape::Pattern("^wire/"), |item, _| item.placed_text()),
        "the wire: `wire/NAME` of a bus, or a place on it, `wire/NAME/PLACE`",
        r#"on = "wire/sbcp/LF""#, required();
    KIND: FaultName = "kind", choice(), "kind of fault", r#"kind = "drop""#, required();
    PROBABILITY: f64 = "probability", super::PROBABILITY, "share of the affected bursts",
        r#"kind = "drop", probability = 0.1"#, default("1"),
        only_with(&["drop", "duplicate", "reorder"]);
    RATE: f64 = "rate", super::PROBABILITY, "probability of an inversion, of each bit",
        r#"kind = "flip", rate = 1e-4"#, required(), only_with(&["flip"]);
    BY: SimDuration = "by", Type::DURATION, "delay of each burst", r#"kind = "delay", by = "2 ms""#,
        required(), only_with(&["delay"]);
    FAILS: bool = "fails", Type::BOOLEAN, "whether the host notices, which ends the run",
        r#"kind = "unplug", fails = true"#, default("false"), only_with(&["unplug"]);
    PAUSE: SimDuration = "pause", Type::DURATION, "mean pause between bursts",
        r#"kind = "babble", pause = "5 ms""#, default("'0 s'"), only_with(&["babble"]);
    BOOT: SimDuration = "boot", Type::DURATION, "time that boards take to boot",
        r#"kind = "brown-out", boot = "200 ms""#, otherwise("that of the board"),
        only_with(&["brown-out"]);
    CLOCK: f64 = "clock", quantity(Unit::One, Range::between(-DRIFT_MAX, DRIFT_MAX)),
        "change of the rate of the clock of boards", r#"kind = "drift", clock = "200 ppm""#,
        required(), only_with(&["drift"]);
    DIRECTION: Direction = "direction", choice(),
        "direction of the bytes: `out` from the host to the boards, `in` from these",
        r#"direction = "in""#, otherwise("both");
    PHASE: Phase = "phase", choice(),
        "phase of the driver: `opening` until the first `transfer` begins", r#"phase = "opening""#,
        otherwise("both");
    ON_FRAME: () = "on_frame", contextual(Shape::Table(frame_table::TABLE)),
        "frames, of those of each direction in the window and the phase",
        "on_frame = { nth = 500 }", otherwise("all bytes");
}

table! {
    /// Keys of `on_frame`.
    pub(super) frame_table = TableSpec::new("on_frame", "frames that a fault harms");
    NTH: u64 = "nth", NUMBER, "number of the only frame, from 1", "nth = 500",
        otherwise("every frame");
    EVERY: u64 = "every", NUMBER, "every how many frames one is harmed", "every = 7",
        otherwise("every frame");
    AFTER: Placed<String> = "after",
        Type::new(Shape::One(Accepts::Text), |item, _| item.placed_text()),
        "kind of a message of the host: only frames behind one are counted, up to the next of another kind",
        r#"after = "ping""#, otherwise("all frames");
}

const NUMBER: Type<u64> = Type::new(
    Shape::One(Accepts::Natural(1..=u64::MAX)),
    |item, _| match item.natural()? {
        0 => Err(item.report("there is no frame 0", "frames are counted from 1")),
        number => Ok(number),
    },
);

/// Direction of a fault in a scenario.
#[derive(Clone, Copy)]
pub(super) struct Direction(FaultDirection);

impl Words for Direction {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("out", Self(FaultDirection::Out)),
        ("in", Self(FaultDirection::In)),
    ];
}

/// Phase of a fault in a scenario.
#[derive(Clone, Copy)]
pub(super) struct Phase(DriverPhase);

impl Words for Phase {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("opening", Self(DriverPhase::Opening)),
        ("transfer", Self(DriverPhase::Transfer)),
    ];
}

/// Reads `[[fault]]`.
pub(super) fn fault(item: &Item<'_>, run: SimDuration) -> Result<FaultSpec, Reported> {
    use fault_table::{
        AT, BOOT, BY, CLOCK, DIRECTION, FAILS, FOR, KIND, ON, ON_FRAME, PAUSE, PHASE, PROBABILITY,
        RATE,
    };
    let table = &item.table()?;
    let table = fault_table::TABLE.of(table);
    let at = table.get_with(&AT, |item| time_within_run(item, run, code::FAULT));
    let (direction, phase) = (table.get(&DIRECTION), table.get(&PHASE));
    let chosen = table.get_with(&ON_FRAME, frames);
    let (on, lasts) = (table.read(&ON), table.get(&FOR));
    let name = table.read(&KIND).inspect_err(|_| table.give_up())?;
    let probability = |kind: fn(f64) -> FaultKind| table.read(&PROBABILITY).map(kind);
    let kind = match name {
        FaultName::Drop => probability(|probability| FaultKind::Drop { probability }),
        FaultName::Duplicate => probability(|probability| FaultKind::Duplicate { probability }),
        FaultName::Reorder => probability(|probability| FaultKind::Reorder { probability }),
        FaultName::Flip => table.read(&RATE).map(|rate| FaultKind::Flip { rate }),
        FaultName::Delay => table.read(&BY).map(|by| FaultKind::Delay { by }),
        FaultName::Unplug => table.read(&FAILS).map(|fails| FaultKind::Unplug { fails }),
        FaultName::Stuck => Ok(FaultKind::Stuck),
        FaultName::Babble => table.read(&PAUSE).map(|pause| FaultKind::Babble { pause }),
        FaultName::BrownOut => table.get(&BOOT).map(|boot| FaultKind::BrownOut { boot }),
        FaultName::Drift => table.read(&CLOCK).map(drift),
    };
    let (kind, (frames, after)) = (kind?, chosen?.unzip());
    let select = FaultSelection {
        direction: direction?.map(|it| it.0),
        phase: phase?.map(|it| it.0),
        frames,
    };
    check_selection(table, &ON_FRAME, select.frames.is_some(), &kind)?;
    check_selection(table, &PHASE, select.phase.is_some(), &kind)?;
    if kind.acts_on_boards() && select.direction.is_some() {
        let message = format!("a fault `{}` acts on boards, not on bytes", kind.name());
        return Err(table.report(&DIRECTION, message, "leave `direction` out"));
    }
    Ok(FaultSpec {
        at: SimTime::ZERO + at?.unwrap_or_default(),
        lasts: lasts?,
        on: on?,
        kind,
        select,
        after: after.flatten(),
    })
}

fn drift(rate: f64) -> FaultKind {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the magnitude of the rate is at most 0.1"
    )]
    let rate_ppb = libm::rint(rate * 1e9) as i64;
    FaultKind::Drift { rate_ppb }
}

/// Rejects a choice of bytes for a fault that acts in a window of time only.
fn check_selection<T>(
    table: Declared<'_, '_>,
    key: &Key<T>,
    given: bool,
    kind: &FaultKind,
) -> Result<(), Reported> {
    if !given || kind.selects() {
        return Ok(());
    }
    let message = format!("a fault `{}` acts in a window of time only", kind.name());
    Err(table.report(key, message, "give `at` and `for`"))
}

/// Reads `on_frame`, with the place of the kind of message.
fn frames(item: &Item<'_>) -> Result<(FrameChoice, Option<Placed<String>>), Reported> {
    use frame_table::{AFTER, EVERY, NTH};
    let table = &item.table()?;
    let table = frame_table::TABLE.of(table);
    let (nth, every, after) = (table.get(&NTH), table.get(&EVERY), table.get(&AFTER));
    let (nth, every, after) = (nth?, every?, after?);
    let count = match (nth, every) {
        (Some(_), Some(_)) => {
            let message = "`nth` and `every` are two choices";
            return Err(table.report(&EVERY, message, "give one of them"));
        }
        (Some(nth), None) => FrameCount::Nth(nth),
        (None, Some(every)) => FrameCount::Every(every),
        (None, None) if after.is_none() => {
            let help = "give `nth`, `every` or `after`; without `on_frame` all bytes are harmed";
            return Err(item.report("this chooses no frames", help));
        }
        (None, None) => FrameCount::All,
    };
    let choice = FrameChoice {
        after: after.as_ref().map(|kind| kind.value.clone()),
        count,
    };
    Ok((choice, after))
}

/// Checks that every fault is on the wire of an existing bus. Other sites are known only to the
/// kind of the bus.
pub(super) fn check_sites(
    root: Declared<'_, '_>,
    key: &Key<()>,
    buses: &[BusSpec],
    faults: &[FaultSpec],
) -> Result<(), Reported> {
    let mut checked = Ok(());
    for (n, fault) in faults.iter().enumerate() {
        let on = &fault.on.value;
        let is_on_bus = |bus: &&BusSpec| {
            let rest = on.strip_prefix("wire/");
            let rest = rest.and_then(|rest| rest.strip_prefix(bus.name.value.as_str()));
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        };
        if buses.iter().any(|bus| is_on_bus(&bus)) {
            continue;
        }
        let wires: Vec<String> = buses
            .iter()
            .map(|bus| format!("wire/{}", bus.name.value))
            .collect();
        let help = if wires.is_empty() {
            "a fault happens on the wire of a bus; this scene has no [bus], signals go straight to the actuators".to_owned()
        } else {
            suggestion(on, "wires", wires.iter().map(String::as_str))
        };
        let message = format!("there is no wire `{on}` in this scene");
        let item = root
            .item(key)
            .and_then(|item| item.list().ok()?.into_iter().nth(n));
        let item = item.and_then(|item| item.peek(fault_table::ON.name));
        checked = Err(match item {
            Some(item) => item.report(message, help),
            None => root.report(key, message, help),
        });
    }
    checked
}
