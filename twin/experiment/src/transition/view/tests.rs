//! Tables of synthetic results, in which every value differs.

use twinrig_kernel::SimTime;

use super::*;
use crate::gait::run::GaitRun;
use crate::page_parts::rows;
use crate::transition::{
    GaitCycle, Hysteresis, Transition, TransitionCase, TransitionInput, TransitionPlan,
};

fn cycle(class: &str, oscillators: &str, [begin_s, end_s]: [f64; 2], contacts: f64) -> GaitCycle {
    GaitCycle {
        begin_s,
        end_s,
        class: class.to_owned(),
        oscillators: Some(oscillators.to_owned()),
        oscillator_phases: Vec::new(),
        deviation: None,
        phases: Vec::new(),
        contacts: Some(contacts),
        value: 0.0,
        slip_m: 0.0,
    }
}

fn change(established_s: Option<f64>, way: RampDirection) -> Transition {
    Transition {
        from: "walk".to_owned(),
        to: "trot".to_owned(),
        begin_s: 11.25,
        established_s,
        value: 2.0,
        way,
        slip_m: 0.013,
    }
}

/// Of a walk of 5 s, a trot of 3 s and a fall, with cycles before the transitions.
fn result(plant: &str) -> TransitionResult {
    TransitionResult {
        case: TransitionCase {
            plant: plant.to_owned(),
            plateau_s: 1.0,
            values: Vec::new(),
            end: SimTime::ZERO,
        },
        run: GaitRun {
            fell_at_s: Some(9.5),
            ..GaitRun::default()
        },
        cycles: vec![
            cycle("trot", "trot", [0.0, 3.0], 1.0),
            cycle("walk", "walk", [3.0, 5.0], 1.25),
            cycle("walk", "trot", [5.0, 8.0], 1.5),
        ],
        transitions: vec![
            change(Some(12.5), RampDirection::Up),
            change(None, RampDirection::Down),
        ],
        hysteresis: vec![Hysteresis {
            classes: ["walk", "trot"].map(str::to_owned),
            up: vec![2.0, 2.5],
            down: vec![1.5],
        }],
        speeds: Vec::new(),
        slips: vec![[1.0, 0.021], [2.0, 0.034], [3.0, 0.005]],
        why: None,
    }
}

fn study(cases: Vec<TransitionResult>) -> TransitionStudy {
    TransitionStudy {
        input: TransitionInput {
            name: "gaits".to_owned(),
            file: String::new(),
            variable: "frequency".to_owned(),
            unit: Unit::RadianPerSecond,
            patterns: Vec::new(),
            cases: Vec::new(),
            left_out: Vec::new(),
        },
        plan: TransitionPlan::default(),
        cases,
    }
}

#[test]
fn transitions_have_their_values_below_their_heads() {
    let mut failed = result("other");
    (failed.transitions, failed.why) = (Vec::new(), Some("it snapped".to_owned()));
    assert_eq!(
        rows(&transitions(&study(vec![result("full"), failed]))),
        [
            "run | from | to | begins [s] | established [s] | value | way | feet slip [mm] | why",
            "full | walk | trot | 11.25 | 12.50 | 2 rad/s | up | 13 | ",
            "full | walk | trot | 11.25 | never | 2 rad/s | down | 13 | ",
            "other |  |  |  |  |  |  |  | it snapped",
        ]
    );
}

#[test]
fn gaits_have_their_values_below_their_heads() {
    let mut slow = result("full");
    slow.case.plateau_s = 2.0;
    let study = study(vec![result("full"), slow]);
    let [plateau, slower] = ["full, plateaus of 1 s", "full, plateaus of 2 s"];
    let table = |head: &str, values: &str| {
        let row = |run| format!("{run} | {values}");
        [format!("run | {head}"), row(plateau), row(slower)]
    };
    assert_eq!(
        rows(&hysteresis(&study)),
        table(
            "between | and | up | down",
            "walk | trot | 2 rad/s, 2.5 rad/s | 1.5 rad/s"
        )
    );
    assert_eq!(
        rows(&shares(&study)),
        table(
            "gaits | most slip in one second",
            "walk 5.0 s, trot 3.0 s, fell at 9.5 s | 34 mm at 2 s"
        )
    );
    assert_eq!(
        rows(&cycles(&study)),
        table(
            "contacts of a leg | class by oscillators the same",
            "1.25 | 66.7 % of 3"
        )
    );
}
