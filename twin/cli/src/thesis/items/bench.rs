//! Demands on a sensor of the load, and the test bench (sections 4.1.1 and 4.3.2.1).

use twinrig_bench::{BenchFile, BenchParameters, BenchSettings};

use crate::error::ThesisError;
use crate::error::TwinError;
use crate::thesis::context::Context;
use crate::thesis::item::{Item, Measurements, PrintedFigure, Source};
use crate::thesis::verdict::{Basis, Input, Measurement, Rule};

const WEIGHT: &str = "no sensor was made, and masses of cells are not simulated";

const MISPRINT: &str = "of the maker's data of the 90 W motor at 24 V";

const fn demand(
    key: &'static str,
    quantity: &'static str,
    value: f64,
    unit: &'static str,
    rule: Rule,
) -> PrintedFigure {
    PrintedFigure::value(key, quantity, "table 4.1", value, unit).rule(rule, "a demand")
}

pub(crate) const TABLE_4_1: Item = Item {
    id: "table-4-1",
    title: "Demands on a sensor of the load of a leg",
    place: "4.1.1, table 4.1",
    run_s: 0.1,
    figures: &[
        demand("most", "greatest load", 20.0, "N", Rule::AtLeast(20.0))
            .remark("of the reference cell on the bench, 12 mm cam"),
        demand("least", "least load", 0.0, "N", Rule::AtMost(1.0))
            .remark("the springs of the bench have a preload of 0.2 mm"),
        demand(
            "frequency",
            "frequency of the load",
            4.0,
            "Hz",
            Rule::AtLeast(4.0),
        ),
        demand("sensitivity", "sensitivity", 200.0, "mN", Rule::NotRun).remark(
            "the least change that an estimate shows takes a course of small steps; the RMS error of \
             the filters is in docs/tactile.md",
        ),
        demand("sampling", "time of a sample", 10.0, "ms", Rule::AtMost(10.0))
            .remark("period of the board, which is set"),
        demand("tip", "weight at the tip", 2.0, "g", Rule::NotRun).remark(WEIGHT),
        demand("total", "weight on the robot", 20.0, "g", Rule::NotRun).remark(WEIGHT),
    ],
    sources: &[Source::rest(
        Basis::Given,
        &[
            Input::Set("cam, motor and sampling of the bench"),
            Input::Fitted("a demand"),
        ],
    )],
    measure: table_4_1,
    commands: &["twin run scenarios/bench.toml"],
};

pub(crate) const FIG_4_10: Item = Item {
    id: "fig-4-10",
    title: "Test bench",
    place: "4.3.2.1, figure 4.10",
    run_s: 0.2,
    figures: &[
        PrintedFigure::value("cam-1", "greatest force, cam of 1 mm", "4.3.2.1", 2.34, "N")
            .rule(Rule::Within(0.05), "rounding of the cam and scratches"),
        PrintedFigure::value(
            "cam-12",
            "greatest force, cam of 12 mm",
            "4.3.2.1",
            28.0,
            "N",
        )
        .rule(Rule::Within(0.05), "two printed digits"),
        PrintedFigure::value(
            "stall",
            "stall torque of the motor",
            "4.3.2.1",
            51.3,
            "mN·m",
        )
        .rule(Rule::Within(0.05), "data of the maker")
        .remark(MISPRINT),
        PrintedFigure::value(
            "speed",
            "greatest speed of the motor",
            "4.3.2.1",
            163e3,
            "1/min",
        )
        .rule(Rule::Within(0.05), "data of the maker")
        .remark(MISPRINT),
    ],
    sources: &[
        Source::of(
            &["cam-1", "cam-12"],
            Basis::Given,
            &[Input::Set("printed springs and cams")],
        ),
        Source::of(
            &["stall", "speed"],
            Basis::Arithmetic,
            &[Input::Set("the maker's data")],
        ),
    ],
    measure: fig_4_10,
    commands: &["twin run scenarios/bench.toml"],
};

/// Number of samples in the run; the limit decides nothing.
const SAMPLES: &str = r#"
[[expect]]
name = "samples"
signal = { name = "tactile/samples", eventually = { min = 1 } }
after = "7.9 s"
"#;
/// Duration of the run.
const SECONDS: f64 = 8.0;

fn table_4_1(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let mut found = Measurements::default();
    let run = context.run_with("bench.toml", &[], SAMPLES)?;
    found.add("most", run.measured("loads up to 20 N and more")?);
    found.add("least", run.measured("loads down to 1 N and less")?);
    let rate = run.measured("turns 4.2 times a second")?;
    found.add(
        "frequency",
        rate.map(|rate| rate.times(1.0 / std::f64::consts::TAU)),
    );
    let samples = run.measured("samples")?;
    let period = |count: Measurement| Measurement::exact(1e3 * SECONDS / count.value);
    found.add("sampling", samples.map(period));
    Ok(found)
}

/// Greatest force on the sensor.
const GREATEST: &str = r#"
[[expect]]
name = "greatest force"
signal = { name = "bench/force", eventually = { min = "1000 N" } }
after = "2.5 s"
before = "4 s"
"#;

fn fig_4_10(context: &Context<'_>) -> Result<Measurements, TwinError> {
    const FILE: &str = "bench.toml";
    let mut found = Measurements::default();
    for (key, cam) in [("cam-1", "\"1 mm\""), ("cam-12", "\"12 mm\"")] {
        let settings = [("plant.cam", cam), ("plant.preload", "\"0 mm\"")];
        let run = context.run_with(FILE, &settings, GREATEST)?;
        found.add(key, run.measured("greatest force")?);
    }
    let motor = parameters(context, FILE)?.motor;
    let (volts, constant) = (motor.voltage, motor.torque_constant);
    found.set("stall", 1e3 * constant * volts / motor.resistance);
    found.set("speed", 60.0 / std::f64::consts::TAU * volts / constant);
    Ok(found)
}

/// Returns the bench of a scenario.
fn parameters(context: &Context<'_>, scenario: &str) -> Result<BenchParameters, TwinError> {
    let path = context.path(scenario)?;
    let folder = path.parent().unwrap_or("".as_ref());
    let file = BenchFile::find("tactile", folder)?.ok_or_else(|| ThesisError::Lacks {
        file: scenario.to_owned(),
        what: "bench",
    })?;
    Ok(file.bench(&BenchSettings::default())?)
}
