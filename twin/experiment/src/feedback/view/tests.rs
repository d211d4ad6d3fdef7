//! Tables of synthetic results, in which every value differs.

use twinrig_kernel::SimTime;

use super::*;
use crate::feedback::{FeedbackCase, FeedbackInput, FeedbackPlan, LegLoad, StepSlope};
use crate::modulation::ModulationPlan;
use crate::page_parts::rows;

fn result(source: &str) -> FeedbackResult {
    let load = |error_n: f64, delay_s: f64, rest_n: f64| LegLoad {
        leg: "LF".to_owned(),
        error_n,
        delay_s: Some(delay_s),
        rest_n: Some(rest_n),
    };
    let slope = |step: usize, slope: f64, r_squared: f64| StepSlope {
        step,
        slope,
        r_squared: Some(r_squared),
    };
    FeedbackResult {
        case: FeedbackCase {
            plant: "full".to_owned(),
            source: source.to_owned(),
            signal: format!("load/*/{source}"),
            lag_s: 0.08,
            reference: 0,
            fore: Vec::new(),
            end: SimTime::ZERO,
        },
        fell_at_s: Some(9.5),
        speed_m_s: Some(0.11),
        duty: [Some(0.12), Some(0.13)],
        differs_after_s: Some(0.14),
        phases_rad: Some(0.15),
        // Roots of the mean squares: 5 and 13; the mean: 3 ms.
        loads: vec![load(1.0, 2e-3, 7.0), load(7.0, 4e-3, 17.0)],
        steps: vec![slope(1, 1.5, 0.91), slope(2, -2.5, 0.92)],
        undisplaced: None,
        curves: Default::default(),
        why: None,
    }
}

fn study(cases: Vec<FeedbackResult>) -> FeedbackStudy {
    FeedbackStudy {
        input: FeedbackInput {
            name: "loads".to_owned(),
            files: Vec::new(),
            cases: cases.iter().map(|it| it.case.clone()).collect(),
            left_out: Vec::new(),
        },
        plan: FeedbackPlan {
            after_s: 1.0,
            phases_s: 2.0,
            modulation: ModulationPlan {
                steps: 2,
                ..ModulationPlan::default()
            },
        },
        variable: "step length".to_owned(),
        cases,
    }
}

/// The reference has neither phases nor commands to differ by.
#[test]
fn gaits_have_their_values_below_their_heads() {
    let mut same = result("filtered");
    same.differs_after_s = None;
    let mut failed = result("measured");
    (failed.differs_after_s, failed.fell_at_s) = (None, None);
    failed.why = Some("it snapped".to_owned());
    assert_eq!(
        rows(&gaits(&study(vec![
            result("true"),
            result("estimated"),
            same,
            failed
        ]))),
        [
            "plant | loads | speed [m/s] | duty, fore | hind | phases off [rad] \
             | commands differ after [s] | fall | why",
            "full | true | 0.110 | 0.120 | 0.130 |  |  | fell at 9.5 s | ",
            "full | estimated | 0.110 | 0.120 | 0.130 | 0.150 | 0.140 | fell at 9.5 s | ",
            "full | filtered | 0.110 | 0.120 | 0.130 | 0.150 | never: void | fell at 9.5 s | ",
            "full | measured | 0.110 | 0.120 | 0.130 | 0.150 |  |  | it snapped",
        ]
    );
}

#[test]
fn loads_and_displacements_have_their_values_below_their_heads() {
    let study = study(vec![result("true")]);
    assert_eq!(
        rows(&loads(&study)),
        [
            "plant | loads | signal | error [N] | delay [ms] | error without it [N]",
            "full | true | load/\\*/true | 5.00 | 3.0 | 13.00",
        ]
    );
    assert_eq!(
        rows(&displacements(&study)),
        [
            "plant | loads | step 1 | step 2",
            "full | true | 1.50 (0.91) | −2.50 (0.92)",
        ]
    );
}
