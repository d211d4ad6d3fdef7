//! Printed formulas and counts whose arithmetic needs no run (chapters 2 and 3).

use std::f64::consts::{PI, TAU};

use crate::thesis::item::{Item, Measurements, PrintedFigure, Source};
use crate::thesis::verdict::{Basis, Input, Rule};

/// Points of the phase at which the map of eq. 3.1 is evaluated.
const PHASES: u32 = 100_000;
/// Duty factor of the example.
const DUTY: f64 = 0.5;

pub(crate) const SEC_2_6_1: Item = Item {
    id: "sec-2-6-1",
    title: "The model in maximal coordinates",
    place: "2.6.1, 2.6.2",
    run_s: 0.1,
    figures: &[
        PrintedFigure::value(
            "generalised",
            "variables in generalised coordinates",
            "2.6.2",
            19.0,
            "",
        )
        .rule(Rule::Within(0.0), "a count")
        .remark("position and quaternion of the trunk, and three angles of each leg"),
        PrintedFigure::value(
            "maximal",
            "variables in maximal coordinates",
            "2.6.2",
            198.0,
            "",
        )
        .remark(
            "six for each of 33 bodies, which are not printed; the model for Webots decides it",
        ),
        PrintedFigure::value(
            "energy",
            "energy of the robot over that of the simulation",
            "2.6.1",
            15.0,
            "×",
        )
        .remark(
            "the robot's consumption is not printed; it takes logs of its supply, and servos with \
             losses that were measured",
        ),
    ],
    sources: &[Source::of(
        &["generalised"],
        Basis::Arithmetic,
        &[Input::Set("degrees of freedom of the robot")],
    )],
    measure: |_| Ok(sec_2_6_1()),
    commands: &[],
};

pub(crate) const EQ_3_1: Item = Item {
    id: "eq-3-1",
    title: "Duty factor by a map of the phase",
    place: "3.2.2, eq. 3.1",
    run_s: 0.1,
    figures: &[
        PrintedFigure::value(
            "printed",
            "stance at d = 0.5, as printed",
            "eq. 3.1",
            DUTY,
            "",
        )
        .rule(Rule::Within(1e-3), "resolution of the phase")
        .remark("the printed map spends (1 + d)/2 of the cycle in stance"),
        PrintedFigure::value("corrected", "the same, corrected", "eq. 3.1", DUTY, "")
            .rule(Rule::Within(1e-3), "resolution of the phase")
            .remark(
                "θ/(2(1 − d)) below 2π(1 − d), then π + (θ − 2π(1 − d))/(2d): the map of `cpg`",
            ),
    ],
    sources: &[Source::rest(
        Basis::Arithmetic,
        &[Input::Set("printed formula")],
    )],
    measure: |_| Ok(eq_3_1()),
    commands: &[],
};

pub(crate) const TABLE_3_4: Item = Item {
    id: "table-3-4",
    title: "Staged fitness",
    place: "3.2.4, table 3.4",
    run_s: 0.1,
    figures: &[
        PrintedFigure::statement(
            "mismatch",
            "mismatch of a perfect gait, less the threshold of stage 1",
            "table 3.4",
            "c_mis > 0.3",
            "",
        )
        .rule(Rule::AtLeast(0.0), "as printed")
        .remark("c_mis is the share of mismatch, which is 0 in a perfect gait: < 0.3 is meant"),
        PrintedFigure::statement(
            "second",
            "threshold of stage 2 less that of stage 1",
            "table 3.4",
            "stage 2 is one of its own",
            "",
        )
        .rule(Rule::AtMost(-1e-9), "a stricter one")
        .remark("both are 0.3, so that no gait ends in stage 2"),
    ],
    sources: &[Source::rest(
        Basis::Arithmetic,
        &[Input::Set("printed thresholds")],
    )],
    measure: |_| Ok(table_3_4()),
    commands: &["twin run scenarios/trot.toml"],
};

fn sec_2_6_1() -> Measurements {
    const POSE: f64 = 7.0;
    const LEGS: f64 = 4.0;
    const ANGLES: f64 = 3.0;
    let mut found = Measurements::default();
    found.set("generalised", POSE + LEGS * ANGLES);
    found
}

/// Returns the share of the cycle in which a map of the phase is in stance, which is [π, 2π[.
fn stance(map: impl Fn(f64) -> f64) -> f64 {
    let phases = (0..PHASES).map(|n| TAU * f64::from(n) / f64::from(PHASES));
    let in_stance = phases.filter(|&phase| map(phase) >= PI).count();
    in_stance as f64 / f64::from(PHASES)
}

fn eq_3_1() -> Measurements {
    let d = DUTY;
    let mut found = Measurements::default();
    let printed = |phase: f64| {
        if phase < PI * (1.0 - d) {
            phase / (1.0 - d)
        } else {
            (phase + TAU * d) / (1.0 + d)
        }
    };
    let swing = TAU * (1.0 - d);
    let corrected = |phase: f64| {
        if phase < swing {
            phase / (2.0 * (1.0 - d))
        } else {
            PI + (phase - swing) / (2.0 * d)
        }
    };
    found.set("printed", stance(printed));
    found.set("corrected", stance(corrected));
    found
}

fn table_3_4() -> Measurements {
    /// Thresholds of `c_mis` in stages 1 and 2.
    const THRESHOLDS: [f64; 2] = [0.3, 0.3];
    const PERFECT: f64 = 0.0;
    let mut found = Measurements::default();
    found.set("mismatch", PERFECT - THRESHOLDS[0]);
    found.set("second", THRESHOLDS[1] - THRESHOLDS[0]);
    found
}
