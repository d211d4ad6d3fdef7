//! Trajectory tracking over the bus (section 5.3.3).

use crate::error::TwinError;
use crate::thesis::context::{Context, RunReport};
use crate::thesis::item::{Item, Measurements, PrintedFigure, Source};
use crate::thesis::verdict::{Basis, Input, Measurement, Rule};

const COUNT: Rule = Rule::Within(0.0);
const A_COUNT: &str = "a count";
const SET_SPEED: &str = "the set-points move at 2.4 rad/s";

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

pub(crate) const FIG_5_9: Item = Item {
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
    sources: &[Source::rest(
        Basis::Outcome,
        &[
            Input::Set("gains of the position controller"),
            Input::Free("speed between set-points"),
        ],
    )],
    measure: fig_5_9,
    commands: &["twin run scenarios/thesis/fig-5-9.toml"],
};

pub(crate) const FIG_5_10: Item = Item {
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
    sources: &[
        Source::of(
            &["c-slow", "c-fast"],
            Basis::Given,
            &[Input::Fitted("clocks of the boards, to table 5.4")],
        ),
        Source::rest(
            Basis::Outcome,
            &[
                Input::Set("the printed rule of the buffer, delays and jitter"),
                Input::Free("missed and shortened steps"),
            ],
        ),
    ],
    measure: fig_5_10,
    commands: &["twin run scenarios/thesis/fig-5-10.toml"],
};

pub(crate) const TABLE_5_4: Item = Item {
    id: "table-5-4",
    title: "2000 s of trajectory tracking at 500 Hz",
    place: "5.3.3, table 5.4",
    run_s: 13.0,
    figures: &[
        PrintedFigure::value("packets", "packets", "table 5.4", 4_000_108.0, "")
            .rule(COUNT, A_COUNT),
        PrintedFigure::value("rate", "cycle frequency", "table 5.4", 500.0135, "Hz")
            .rule(Rule::Within(1e-7), "its digits"),
        PrintedFigure::value(
            "period",
            "the same in the conclusion, as a period",
            "6",
            2.0,
            "ms",
        )
        .rule(Rule::Within(1e-3), "its digit")
        .remark("the requirement of 5.3.1.2 is 1 ms, which the bus keeps, not the boards"),
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
        PrintedFigure::statement(
            "mismatch",
            "mismatch of all four clocks, by the printed steps",
            "5.3.3, table 5.4",
            "frequency mismatch of slave and master",
            "ppm",
        )
        .remark(
            "all boards are slow, by 749 to 767 ppm: one common cause, as a divider of their timer \
             or the clock of the master, explains that better than four crystals of some 50 ppm; \
             it takes the boards to find it",
        ),
    ],
    sources: &[
        Source::of(
            &["packets", "rate", "period"],
            Basis::Given,
            &[Input::Set("duration and period of the run")],
        ),
        Source::of(
            &["LF", "RF", "LH", "RH"],
            Basis::Given,
            &[Input::Fitted("clocks of the boards")],
        ),
        Source::rest(
            Basis::Outcome,
            &[
                Input::Set("jitter of the host"),
                Input::Fitted("clocks of the boards"),
                Input::Free("errors and missed points"),
            ],
        ),
    ],
    measure: table_5_4,
    commands: &["twin run scenarios/thesis/table-5-4.toml"],
};

pub(crate) const TABLE_5_4_WITHOUT: Item = Item {
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
    sources: &[Source::rest(
        Basis::Given,
        &[Input::Fitted("clocks of the boards")],
    )],
    measure: table_5_4_without,
    commands: &["twin run scenarios/thesis/table-5-4-without.toml"],
};

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

/// Mean mismatch of clocks, of which each filled-buffer step makes up half a period \[ppm\].
fn printed_mismatch() -> f64 {
    const FILLED: [f64; 4] = [1528.0, 1498.0, 1534.0, 1524.0];
    const PERIODS: f64 = 4_000_108.0 / 4.0;
    1e6 * 0.5 * FILLED.iter().sum::<f64>() / 4.0 / PERIODS
}

fn table_5_4(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let mut found = Measurements::default();
    let run = context.run("thesis/table-5-4.toml")?;
    found.add("packets", run.measured("and not one more")?);
    let rate = run.measured("cycle frequency: 500.0135 Hz")?;
    found.add("rate", rate);
    found.add(
        "period",
        rate.map(|rate| Measurement::exact(1e3 / rate.value)),
    );
    let success = run.measured("communication success: 100 %")?;
    found.add("success", success.map(|share| share.times(100.0)));
    found.add("missed", run.measured("missed points: none")?);
    found.set("mismatch", printed_mismatch());
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
