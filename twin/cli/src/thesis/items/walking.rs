//! Motion of the robots: speeds, a step down, loads of a leg.

use std::path::PathBuf;

use twinrig_campaign::sweep::{Partition, SweepVerdict};
use twinrig_experiment::options::run::EngineArgs;
use twinrig_experiment::{SweepRequest, sweep};

use crate::error::ThesisError;
use crate::error::TwinError;
use crate::thesis::context::Context;
use crate::thesis::item::{Item, Measurements, PrintedFigure, Source};
use crate::thesis::verdict::{Basis, Input, Measurement, Rule};

/// Greatest speed of Cheetah-cub \[m/s\], its length \[cm\], and the speed in lengths \[1/s\].
const SPEED: f64 = 1.42;
const LENGTH: f64 = 20.1;
const LENGTHS: f64 = 6.9;
/// Height of the robot, and of the step \[mm\].
const HEIGHT: f64 = 158.0;
const STEP: f64 = 20.0;

const OTHER_GAIT: &str = "ours is of the fast trot; the measured gait is not printed, and loads here \
                          are means over an observation of 2 ms";

pub(crate) const SPEEDS: Item = Item {
    id: "speeds",
    title: "Speeds of the robots",
    place: "1.1.3",
    run_s: 1.0,
    figures: &[
        PrintedFigure::value("fast", "Cheetah-cub, greatest speed", "1.1.3", SPEED, "m/s")
            .rule(Rule::AtLeast(SPEED), "a gait of at least this speed")
            .remark(
                "massless legs and servos of 25 rad/s, four times the speed of those of the \
                 robot file, which is ASSUMED; a gait found by optimisation",
            ),
        PrintedFigure::value(
            "slow-servo",
            "the same with the servos of the robot file",
            "1.1.3",
            SPEED,
            "m/s",
        )
        .remark("neither data of the servos nor parameters of the gait are printed"),
        PrintedFigure::value("length", "Cheetah-cub, length", "1.1.3", LENGTH, "cm")
            .rule(Rule::Within(0.01), "two digits of the speed in lengths")
            .remark("6.9 lengths a second are printed, which at 1.42 m/s are of 20.6 cm"),
        PrintedFigure::value(
            "oncilla",
            "Oncilla, trot",
            "not in the thesis; reported of the robot",
            0.63,
            "m/s",
        )
        .rule(Rule::Within(0.05), "the gait is not that of the robot")
        .remark(
            "a gait found by optimisation; friction of the joints is five times that of the \
             robot file",
        ),
    ],
    sources: &[
        Source::of(
            &["fast", "oncilla"],
            Basis::Given,
            &[
                Input::Fitted("the gait, by a search for this speed"),
                Input::Set("servo, friction and compression of the robot file"),
            ],
        ),
        Source::of(
            &["length"],
            Basis::Arithmetic,
            &[Input::Set("printed speeds and height")],
        ),
    ],
    measure: speeds,
    commands: &[
        "twin run scenarios/trot-fast.toml",
        "twin run scenarios/trot-slow-servo.toml",
        "twin run scenarios/oncilla-trot.toml",
    ],
};

pub(crate) const STEP_DOWN: Item = Item {
    id: "step-down",
    title: "Step down, blind",
    place: "1.1.3",
    run_s: 4.0,
    figures: &[
        PrintedFigure::value("share", "falls avoided at 20 mm", "1.1.3", 80.0, "%")
            .rule(
                Rule::AtLeast(80.0),
                "the whole 95 % interval is above the printed share",
            )
            .remark(
                "100 random places of the edge over one stride; the robot does not fall within \
                 7 s",
            ),
        PrintedFigure::value(
            "height",
            "height of the step over the robot's",
            "1.1.3",
            12.0,
            "%",
        )
        .rule(Rule::Within(0.1), "\"approximately\"")
        .remark("printed as a share of the hip's height; 20 mm over the robot's 15.8 cm"),
    ],
    sources: &[
        Source::of(
            &["share"],
            Basis::Substitute,
            &[Input::Set("robot and gait"), Input::Free("falls")],
        ),
        Source::of(
            &["height"],
            Basis::Arithmetic,
            &[Input::Set("printed lengths")],
        ),
    ],
    measure: step_down,
    commands: &[
        "twin run scenarios/step-down.toml",
        "twin sweep scenarios/step-down.toml scenarios/sweeps/step-down.toml",
    ],
};

pub(crate) const LOADS: Item = Item {
    id: "loads",
    title: "Load and stance of a leg",
    place: "4.1.1.2, 4.2.3",
    run_s: 0.5,
    figures: &[
        PrintedFigure::value(
            "peak",
            "greatest load of a leg in a gait",
            "4.1.1.2",
            13.0,
            "N",
        )
        .remark(OTHER_GAIT),
        PrintedFigure::value("stance", "shortest stance", "4.1.1.2", 85.0, "ms").remark(OTHER_GAIT),
        PrintedFigure::value(
            "load",
            "1.4 times the weight of the body",
            "4.2.3",
            15.0,
            "N",
        )
        .rule(Rule::Within(0.05), "\"approximately\""),
    ],
    sources: &[Source::of(
        &["load"],
        Basis::Arithmetic,
        &[Input::Set("printed mass")],
    )],
    measure: loads,
    commands: &["twin run scenarios/trot-fast.toml"],
};

fn speeds(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let mut found = Measurements::default();
    for (key, file) in [
        ("fast", "trot-fast.toml"),
        ("slow-servo", "trot-slow-servo.toml"),
        ("oncilla", "oncilla-trot.toml"),
    ] {
        found.add(key, context.run(file)?.measured("forward speed")?);
    }
    found.set("length", 1e2 * SPEED / LENGTHS);
    Ok(found)
}

/// Folder of the rows of a sweep, removed at the end.
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        // A folder that remains is in the folder of temporary files.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn step_down(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let name = format!("twinrig-thesis-{}", std::process::id());
    let folder = Scratch(std::env::temp_dir().join(name));
    let request = SweepRequest {
        scenario: context.path("step-down.toml")?,
        spec: context.path("sweeps/step-down.toml")?,
        settings: context.settings().to_vec(),
        engine: EngineArgs::default(),
        partition: Partition::WHOLE,
        out: folder.0.clone(),
        record: None,
    };
    let result = sweep(context.registry(), &request, &mut |_| {})?.result;
    if matches!(
        result.verdict,
        SweepVerdict::Error | SweepVerdict::Interrupted
    ) {
        return Err(ThesisError::Run {
            file: result.spec.clone(),
            reason: format!("the sweep has the verdict `{}`", result.verdict.word()),
        }
        .into());
    }
    let mut found = Measurements::default();
    let share = result.shares.first().and_then(|share| {
        let ends = share.interval;
        Some(Measurement::within(share.share?, ends.low, ends.high).times(100.0))
    });
    found.add("share", share);
    found.set("height", 100.0 * STEP / HEIGHT);
    Ok(found)
}

/// Greatest load and shortest stance of any leg while it trots; the limits decide nothing.
const EXTREMES: &str = r#"
[[expect]]
name = "greatest load"
signal = { name = "leg/*/foot/load", always = { max = "1000 N" } }
after = "5 s"

[[expect]]
name = "shortest stance"
footstep = { stance = { min = "1 ms" } }
after = "5 s"
"#;

fn loads(context: &Context<'_>) -> Result<Measurements, TwinError> {
    const FILE: &str = "trot-fast.toml";
    let mut found = Measurements::default();
    let run = context.run_with(FILE, &[], EXTREMES)?;
    found.add("peak", run.measured("greatest load")?);
    let stance = run.measured("shortest stance")?;
    found.add("stance", stance.map(|stance| stance.times(1e3)));
    if let Some(robot) = context.assembly(FILE)?.robot() {
        found.set("load", 1.4 * robot.weight());
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::path::Path;

    use super::*;
    use crate::progress::Progress;
    use crate::thesis::progress::ItemProgress;
    use twinrig_rig::registry::Registry;

    #[test]
    fn extremes_are_those_of_the_worst_leg() {
        let registry = Registry::standard();
        let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
        let progress = ItemProgress::new(&[], Progress::new("", false));
        let context = Context::new(&registry, &scenarios, Vec::new(), progress);
        let mut expectations = EXTREMES.to_owned();
        let legs = ["LF", "RF", "LH", "RH"];
        for leg in legs {
            let own = EXTREMES.replace("\nname = \"", &format!("\nname = \"{leg}, "));
            let own = own.replace("leg/*", &format!("leg/{leg}"));
            let own = own.replace("{ stance", &format!("{{ leg = \"{leg}\", stance"));
            write!(expectations, "{own}").unwrap();
        }
        let run = context.run_with("trot-fast.toml", &[], &expectations);
        let run = run.unwrap_or_else(|error| panic!("{error}"));
        let measured = |name: &str| run.measured(name).unwrap().unwrap().value;
        let of_legs = |name: &str| legs.map(|leg| measured(&format!("{leg}, {name}")));
        let greatest = of_legs("greatest load").into_iter().fold(0.0, f64::max);
        let shortest = of_legs("shortest stance")
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        assert_eq!(measured("greatest load").to_bits(), greatest.to_bits());
        assert_eq!(measured("shortest stance").to_bits(), shortest.to_bits());
        // The legs differ: of fore and hind legs one is loaded more.
        assert!(of_legs("greatest load").iter().any(|load| *load < greatest));
    }
}
