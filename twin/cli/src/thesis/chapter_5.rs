//! Chapter 5: scheduling, the bus of Oncilla, and trajectory tracking.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_motordriver::{COMMAND_LEN, REPLY_LEN};
use twinrig_runtime::{Group, Observer, RunEvent};
use twinrig_sbcp::{BYTE_TIME, OVERHEAD};

use crate::error::TwinError;
use crate::thesis::context::{Context, RunReport};
use crate::thesis::item::{Item, Measurements, PrintedFigure};
use crate::thesis::verdict::{Measurement, Rule};

const BOARDS: f64 = 4.0;
/// Bits of a byte on a serial line (eq. 5.1).
const BITS: f64 = 10.0;

const COUNT: Rule = Rule::Within(0.0);
const A_COUNT: &str = "a count";
const HOST: &str = "the rules of the emulated host were chosen to give 400 Hz and 1 kHz";
const CLOCKS: &str = "the clocks of the boards follow from these counts, which therefore confirm the \
                      rule of the buffer, not the clocks";

const fn filled(key: &'static str, quantity: &'static str, count: f64) -> PrintedFigure {
    PrintedFigure::value(key, quantity, "table 5.4", count, "")
        .rule(Rule::Within(2e-3), "phases at the start are not known")
        .remark(CLOCKS)
}

const fn count(
    key: &'static str,
    quantity: &'static str,
    statement: &'static str,
    rule: Rule,
) -> PrintedFigure {
    PrintedFigure::statement(key, quantity, "5.3.3, figure 5.10", statement, "").rule(rule, A_COUNT)
}

pub(super) const ITEMS: &[Item] = &[
    Item {
        id: "fig-5-3",
        title: "Schedule of processes and transfers",
        place: "5.2.2.3, figure 5.3",
        run_s: 0.1,
        figures: &[
            PrintedFigure::value(
                "elapsed",
                "time told to the iteration after an overrun of one step",
                "5.2.2.3, figure 5.3",
                2.0,
                "steps",
            )
            .rule(COUNT, A_COUNT)
            .remark("an iteration takes 1.25 steps; the figure shows one that misses a step"),
            PrintedFigure::value(
                "skipped",
                "steps for which inputs of a late transfer are the old ones",
                "5.2.2.3, figure 5.3",
                1.0,
                "steps",
            )
            .rule(COUNT, A_COUNT)
            .remark("a transfer takes 1.1 steps"),
        ],
        measure: fig_5_3,
        commands: &["cargo test -p twinrig-runtime --test scheduling"],
    },
    Item {
        id: "sec-5-3-1",
        title: "Requirements on the bus",
        place: "5.3.1.2, table 5.3, eq. 5.1",
        run_s: 0.1,
        figures: &[
            PrintedFigure::value(
                "payload",
                "data of a board in a cycle",
                "5.3.1.2",
                20.0,
                "B",
            )
            .rule(COUNT, A_COUNT)
            .remark("table 5.3 has two positions of 12 bits in 2 bytes; the sum needs 4"),
            PrintedFigure::value(
                "effective",
                "data rate at 1 kHz",
                "5.3.1.2",
                800.0,
                "kbit/s",
            )
            .rule(COUNT, "a product of counts")
            .remark("with start and stop bits, ten to a byte"),
            PrintedFigure::value("baud", "least baud rate", "eq. 5.1", 1.28, "Mbit/s")
                .rule(Rule::Within(1e-9), "a product of counts")
                .remark("of the packets of the emulated bus"),
        ],
        measure: sec_5_3_1,
        commands: &["twin run scenarios/thesis/sec-5-3-2-bus-controller.toml"],
    },
    Item {
        id: "sec-5-3-2",
        title: "Rates and delays of the bus",
        place: "5.3.2, figures 5.7 and 5.8, table 5.5",
        run_s: 1.0,
        figures: &[
            PrintedFigure::value(
                "first",
                "first firmware: rate of four boards",
                "5.3.2",
                150.0,
                "Hz",
            )
            .rule(Rule::Within(0.1), ABOUT)
            .remark("guaranteed, by the longest cycle; the mean rate is higher"),
            PrintedFigure::value(
                "first-jitter",
                "first firmware: jitter",
                "5.3.2",
                500.0,
                "µs",
            )
            .rule(Rule::Within(0.1), "\"of the order of\"")
            .remark("half of the range of the response times"),
            PrintedFigure::value(
                "direct",
                "polled boards: rate of four",
                "5.3.2",
                400.0,
                "Hz",
            )
            .rule(Rule::Within(1e-3), "whole microframes")
            .remark(HOST),
            PrintedFigure::value(
                "board",
                "polled boards: time of one",
                "5.3.2, figure 5.7",
                625.0,
                "µs",
            )
            .rule(Rule::Within(1e-3), "whole microframes")
            .remark(HOST),
            PrintedFigure::value(
                "controller",
                "bus controller: rate of four",
                "5.3.2",
                1000.0,
                "Hz",
            )
            .rule(Rule::Within(1e-3), "whole microframes")
            .remark(HOST),
            PrintedFigure::value(
                "usb",
                "bus controller: delay by USB in a cycle",
                "5.3.2, figure 5.8",
                500.0,
                "µs",
            )
            .rule(Rule::Within(0.2), "whole microframes of 125 µs")
            .remark(
                "the cycle less four boards on the bus, of 32 bytes and the response time each",
            ),
            PrintedFigure::value("reaction", "response time of a board", "5.3.2", 10.0, "µs")
                .rule(Rule::AtMost(10.0), "printed as the greatest")
                .remark("the emulated firmware takes the printed time"),
            PrintedFigure::value(
                "jitter",
                "jitter at the boards",
                "5.3.4, table 5.5",
                2.0,
                "µs",
            )
            .rule(Rule::AtMost(2.0), "printed for the whole chain")
            .remark("with a timer of the master that is locked to the frames of USB"),
        ],
        measure: sec_5_3_2,
        commands: &[
            "twin run scenarios/thesis/sec-5-3-2-first-firmware.toml",
            "twin run scenarios/thesis/sec-5-3-2-direct.toml",
            "twin run scenarios/thesis/sec-5-3-2-bus-controller.toml",
        ],
    },
    Item {
        id: "fig-5-9",
        title: "Trajectory tracking at 100 Hz",
        place: "5.3.3, figure 5.9",
        run_s: 0.1,
        figures: &[
            PrintedFigure::statement(
                "plain",
                "least speed between set-points, controller alone",
                "5.3.3, figure 5.9",
                "stops at each set-point",
                "rad/s",
            )
            .rule(Rule::AtMost(0.0), "a stop or less")
            .remark(SET_SPEED),
            PrintedFigure::statement(
                "smooth",
                "the same, interpolated",
                "5.3.3, figure 5.9",
                "even speed",
                "rad/s",
            )
            .rule(Rule::AtLeast(1.2), "half of the speed of the set-points")
            .remark(SET_SPEED),
            PrintedFigure::statement(
                "smooth-50",
                "the same at 50 Hz",
                "5.3.3",
                "no stutter down to 50 Hz",
                "rad/s",
            )
            .rule(Rule::AtLeast(1.2), "half of the speed of the set-points")
            .remark(SET_SPEED),
        ],
        measure: fig_5_9,
        commands: &["twin run scenarios/thesis/fig-5-9.toml"],
    },
    Item {
        id: "fig-5-10",
        title: "Set-points that come late, early and at another rate",
        place: "5.3.3, figure 5.10",
        run_s: 0.5,
        figures: &[
            count(
                "a",
                "a: faults by jitter within a step",
                "no effect",
                Rule::AtMost(0.0),
            )
            .remark("missed points and shortened steps, at a jitter of 0.3 ms"),
            count(
                "b-missed",
                "b: points missed by one late frame",
                "a step without a point",
                Rule::AtLeast(1.0),
            )
            .remark("2.5 ms late: two deadlines of 2 ms pass"),
            count(
                "b-filled",
                "b: steps shortened afterwards",
                "a step with two points",
                Rule::AtLeast(1.0),
            ),
            PrintedFigure::statement(
                "c-slow",
                "c: time between two points at once, slow board",
                "5.3.3, figure 5.10c",
                "a few seconds",
                "s",
            )
            .rule(Rule::Between(1.0, 10.0), "\"in a few seconds\"")
            .remark("at the mismatch of table 5.4, 764 ppm"),
            PrintedFigure::statement(
                "c-fast",
                "c: time between missed points, fast board",
                "5.3.3, figure 5.10c",
                "a few seconds",
                "s",
            )
            .rule(Rule::Between(1.0, 10.0), "\"in a few seconds\"")
            .remark("at the mismatch of table 5.4, 764 ppm"),
        ],
        measure: fig_5_10,
        commands: &["twin run scenarios/thesis/fig-5-10.toml"],
    },
    Item {
        id: "table-5-4",
        title: "2000 s of trajectory tracking at 500 Hz",
        place: "5.3.3, table 5.4",
        run_s: 20.0,
        figures: &[
            PrintedFigure::value("packets", "packets", "table 5.4", 4_000_108.0, "")
                .rule(COUNT, A_COUNT),
            PrintedFigure::value("rate", "cycle frequency", "table 5.4", 500.0135, "Hz")
                .rule(Rule::Within(1e-7), "its digits"),
            PrintedFigure::value(
                "success",
                "transfers without error",
                "table 5.4",
                100.0,
                "%",
            )
            .rule(COUNT, A_COUNT),
            PrintedFigure::value("missed", "missed points, each board", "table 5.4", 0.0, "")
                .rule(COUNT, A_COUNT),
            filled("LF", "filled-buffer steps, board 1", 1528.0),
            filled("RF", "filled-buffer steps, board 2", 1498.0),
            filled("LH", "filled-buffer steps, board 3", 1534.0),
            filled("RH", "filled-buffer steps, board 4", 1524.0),
        ],
        measure: table_5_4,
        commands: &["twin run scenarios/thesis/table-5-4.toml"],
    },
    Item {
        id: "table-5-4-without",
        title: "The same without the heuristics",
        place: "5.3.3, table 5.4",
        run_s: 1.5,
        figures: &[PrintedFigure::statement(
            "lost",
            "time between two lost points",
            "5.3.3, table 5.4",
            "every few seconds",
            "s",
        )
        .rule(Rule::Between(1.0, 10.0), "\"every few seconds\"")],
        measure: table_5_4_without,
        commands: &["twin run scenarios/thesis/table-5-4-without.toml"],
    },
];

const ABOUT: &str = "\"approximately\"";
const SET_SPEED: &str = "the set-points move at 2.4 rad/s";

/// Elapsed times after overruns, and steps for which tasks were skipped.
#[derive(Default)]
struct ScheduleObserver {
    has_overrun: bool,
    elapsed: Vec<SimDuration>,
    /// Consecutive skips of a task, and the greatest number of them.
    skips: u64,
    most_skips: u64,
}

impl Observer for ScheduleObserver {
    fn samples(&mut self, _: SimTime, _: Group, _: &[f64]) {}

    fn event(&mut self, _: SimTime, event: RunEvent) {
        match event {
            RunEvent::Overrun { .. } => self.has_overrun = true,
            RunEvent::ProcessBegin { elapsed } => {
                if std::mem::take(&mut self.has_overrun) {
                    self.elapsed.push(elapsed);
                }
            }
            RunEvent::TaskSkipped { .. } => {
                self.skips += 1;
                self.most_skips = self.most_skips.max(self.skips);
            }
            RunEvent::TaskEnd { .. } => self.skips = 0,
            _ => {}
        }
    }
}

/// Runs the standing robot with modelled times, and returns what its schedule was.
fn schedule(
    context: &Context<'_>,
    key: &str,
    trace: &str,
) -> Result<(ScheduleObserver, SimDuration), TwinError> {
    let value = format!("{{ trace = {trace} }}");
    let assembly = context.assembly_with("stand.toml", &[(key, &value)], "")?;
    let mut observer = ScheduleObserver::default();
    let mut rig = assembly.rig()?;
    let end = SimTime::ZERO + SimDuration::from_millis(100);
    let ran = rig.run_until(end, &mut observer);
    ran.map_err(|error| assembly.rig_error(error))?;
    Ok((observer, assembly.period()))
}

fn fig_5_3(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let mut found = Measurements::default();
    let slow = r#"["0.5 ms", "0.5 ms", "2.5 ms"]"#;
    let (observed, period) = schedule(context, "controller.compute_time", slow)?;
    let steps = |elapsed: &SimDuration| elapsed.as_secs_f64() / period.as_secs_f64();
    let told: Vec<f64> = observed.elapsed.iter().map(steps).collect();
    if let (Some(&first), true) = (told.first(), told.windows(2).all(|two| two[0] == two[1])) {
        found.set("elapsed", first);
    }
    let late = r#"["0.3 ms", "0.3 ms", "2.2 ms"]"#;
    let (observed, _) = schedule(context, "io.transfer_time", late)?;
    if observed.most_skips > 0 {
        found.set("skipped", observed.most_skips as f64);
    }
    Ok(found)
}

fn sec_5_3_1(_: &Context<'_>) -> Result<Measurements, TwinError> {
    const HERTZ: f64 = 1000.0;
    let mut found = Measurements::default();
    let payload = (COMMAND_LEN + REPLY_LEN) as f64;
    let packets = payload + 2.0 * OVERHEAD as f64;
    found.set("payload", payload);
    found.set("effective", 1e-3 * BOARDS * payload * BITS * HERTZ);
    found.set("baud", 1e-6 * BOARDS * packets * BITS * HERTZ);
    Ok(found)
}

/// Returns the inverse of a positive measurement.
fn inverse(found: Measurement) -> Measurement {
    Measurement::exact(1.0 / found.value)
}

fn sec_5_3_2(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let mut found = Measurements::default();
    let microseconds = |found: Measurement| found.times(1e6);
    let run = context.run("thesis/sec-5-3-2-first-firmware.toml")?;
    let longest = run.measured("longest cycle: 6.0 to 6.5 ms, guaranteed 155 to 167 Hz")?;
    found.add("first", longest.map(inverse));
    let jitter = run.measured("jitter of a board's answer, half of its range: 500 µs")?;
    found.add("first-jitter", jitter.map(microseconds));
    let run = context.run("thesis/sec-5-3-2-direct.toml")?;
    let cycle = run.measured("cycle of four boards: 2.5 ms, 400 Hz")?;
    found.add("direct", cycle.map(inverse));
    found.add("board", cycle.map(|cycle| cycle.times(1e6 / BOARDS)));
    let run = context.run("thesis/sec-5-3-2-bus-controller.toml")?;
    let cycle = run.measured("cycle of four boards: 1 ms, 1 kHz")?;
    let reaction = run.measured("boards answer within 10 µs")?;
    found.add("controller", cycle.map(inverse));
    let bytes = (COMMAND_LEN + REPLY_LEN + 2 * OVERHEAD) as f64;
    let usb = cycle.zip(reaction).map(|(cycle, reaction)| {
        let board = bytes * BYTE_TIME.as_secs_f64() + reaction.value;
        Measurement::exact(1e6 * (cycle.value - BOARDS * board))
    });
    found.add("usb", usb);
    found.add("reaction", reaction.map(microseconds));
    let jitter = run.measured("jitter of requests at the boards: 2 µs")?;
    found.add("jitter", jitter.map(microseconds));
    Ok(found)
}

/// Least speed of two hips that follow set-points at −2.4 rad/s, one of them interpolated.
const SPEEDS: &str = r#"
[[expect]]
name = "least speed, plain"
signal = { name = "leg/LF/hip/rate", eventually = { min = "1000 rad/s" } }
after = "0.75 s"
before = "1.1 s"

[[expect]]
name = "least speed, smooth"
signal = { name = "leg/RF/hip/rate", eventually = { min = "1000 rad/s" } }
after = "0.75 s"
before = "1.1 s"
"#;

fn fig_5_9(context: &Context<'_>) -> Result<Measurements, TwinError> {
    const FILE: &str = "thesis/fig-5-9.toml";
    let mut found = Measurements::default();
    // The set-points move towards negative angles.
    let forwards = |rate: Measurement| Measurement::exact(-rate.value);
    let run = context.run_with(FILE, &[], SPEEDS)?;
    found.add("plain", run.measured("least speed, plain")?.map(forwards));
    found.add("smooth", run.measured("least speed, smooth")?.map(forwards));
    let run = context.run_with(FILE, &[("controller.period", "\"20 ms\"")], SPEEDS)?;
    found.add(
        "smooth-50",
        run.measured("least speed, smooth")?.map(forwards),
    );
    Ok(found)
}

/// Returns the mean time between the events that an expectation counts in `seconds` [s].
fn interval(
    run: &RunReport,
    expectation: &str,
    seconds: f64,
) -> Result<Option<Measurement>, TwinError> {
    let count = run.measured(expectation)?;
    let count = count.filter(|count| count.value > 0.0);
    Ok(count.map(|count| Measurement::exact(seconds / count.value)))
}

fn fig_5_10(context: &Context<'_>) -> Result<Measurements, TwinError> {
    const SECONDS: f64 = 12.0;
    let mut found = Measurements::default();
    let run = context.run("thesis/fig-5-10.toml")?;
    let missed = run.measured("a: jitter misses no point")?;
    let filled = run.measured("a: and fills no buffer")?;
    let both = missed.zip(filled);
    found.add(
        "a",
        both.map(|(missed, filled)| Measurement::exact(missed.value + filled.value)),
    );
    found.add(
        "b-missed",
        run.measured("b: a late frame is two missed points")?,
    );
    found.add(
        "b-filled",
        run.measured("b: which the next two steps make up for")?,
    );
    let slow = "c: a slow board shortens a step every 1.31 s";
    found.add("c-slow", interval(&run, slow, SECONDS)?);
    let fast = "c: a fast board misses a point every 1.31 s";
    found.add("c-fast", interval(&run, fast, SECONDS)?);
    Ok(found)
}

fn table_5_4(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let mut found = Measurements::default();
    let run = context.run("thesis/table-5-4.toml")?;
    found.add("packets", run.measured("and not one more")?);
    found.add("rate", run.measured("cycle frequency: 500.0135 Hz")?);
    let success = run.measured("communication success: 100 %")?;
    found.add("success", success.map(|share| share.times(100.0)));
    found.add("missed", run.measured("missed points: none")?);
    for (key, expectation) in [
        ("LF", "filled-buffer steps of board 1: 1528"),
        ("RF", "filled-buffer steps of board 2: 1498"),
        ("LH", "filled-buffer steps of board 3: 1534"),
        ("RH", "filled-buffer steps of board 4: 1524"),
    ] {
        found.add(key, run.measured(expectation)?);
    }
    Ok(found)
}

fn table_5_4_without(context: &Context<'_>) -> Result<Measurements, TwinError> {
    const SECONDS: f64 = 100.0;
    let mut found = Measurements::default();
    let run = context.run("thesis/table-5-4-without.toml")?;
    found.add(
        "lost",
        interval(&run, "set-points lost: one in 2.6 s", SECONDS)?,
    );
    Ok(found)
}
