//! Tables of synthetic results, in which every value differs.

use twinrig_campaign::spread::{MarginQuantiles, Member};
use twinrig_campaign::sweep::{ExpectationVerdict, ShareInterval, SweepRow};

use super::*;
use crate::page_parts::rows;
use crate::robustness::{Divergence, RobustnessCase, RobustnessPlan};

fn spread(name: &str, held: usize, changes_at: Option<Magnitude>) -> ExpectationSpread {
    ExpectationSpread {
        name: name.to_owned(),
        unit: "m".to_owned(),
        verdict: ExpectationVerdict::Pass,
        margin: Some(1e-3),
        runs: 20,
        held,
        unobserved: 5,
        share: 0.85,
        interval: ShareInterval {
            low: 0.61,
            high: 0.97,
        },
        margins: Some(MarginQuantiles {
            min: 2e-3,
            p5: 3e-3,
            median: 4e-3,
            p95: 6e-3,
            max: 7e-3,
        }),
        changed: 4,
        changes_at,
    }
}

fn run(magnitude: Magnitude, crossed_s: f64, rate: f64) -> EnsembleRun {
    EnsembleRun {
        member: Member {
            magnitude: Some(magnitude),
            row: SweepRow::of_error(""),
        },
        divergence: Divergence {
            distances: Vec::new(),
            crossed_s: Some(crossed_s),
            growth: Growth::Exponential { rate, start: 1e-9 },
        },
    }
}

fn result(kind: EnsembleKind) -> RobustnessResult {
    RobustnessResult {
        case: RobustnessCase {
            scenario: "trot".to_owned(),
            file: "trot.toml".to_owned(),
            plant: "full".to_owned(),
            kind,
            why_seeds: None,
            unit: Some("m".to_owned()),
            duration_s: 9.0,
        },
        expectations: vec![
            spread("upright", 20, None),
            spread("fast", 17, Some(Magnitude::UpTo(1e-9))),
            spread("straight", 18, Some(Magnitude::LastPlace)),
        ],
        perturbed: vec![
            run(Magnitude::LastPlace, 7.5, 1.0),
            run(Magnitude::UpTo(1e-9), 2.5, 1.4),
        ],
        unperturbed: Member {
            magnitude: None,
            row: SweepRow::of_error(""),
        },
        stride_s: Some(0.5),
    }
}

#[test]
fn expectations_have_their_values_below_their_heads() {
    assert_eq!(
        rows(&expectations(&result(EnsembleKind::Starts))),
        [
            "expectation | holds | 95 % interval | least margin | 5 % | median | 95 % | greatest \
             | not observed | changes at",
            "upright | 20 of 20 | 61.0 % … 97.0 % | 2 mm | 3 mm | 4 mm | 6 mm | 7 mm | 5 | ",
            "fast | **17 of 20** | 61.0 % … 97.0 % | 2 mm | 3 mm | 4 mm | 6 mm | 7 mm | 5 \
             | 1.0e-9",
            "straight | **18 of 20** | 61.0 % … 97.0 % | 2 mm | 3 mm | 4 mm | 6 mm | 7 mm | 5 \
             | 1 ulp",
        ]
    );
}

#[test]
fn scenarios_have_their_values_below_their_heads() {
    let study = RobustnessStudy {
        plan: RobustnessPlan {
            runs: 20,
            tolerance: 1e-3,
        },
        results: [EnsembleKind::Starts, EnsembleKind::Seeds]
            .map(result)
            .into(),
        left_out: Vec::new(),
    };
    assert_eq!(
        rows(&cases(&study)),
        [
            "scenario | plant | runs differ by | hold in all 20 runs | horizon | growth rate \
             | changed by 1 ulp",
            "trot | full | start | 1 of 3 | 7.5 s | 1.2/s, 0.6 a stride | straight",
            "trot | full | seed | 1 of 3 | 2.5 s | 1.2/s, 0.6 a stride | straight",
        ]
    );
    assert_eq!(
        facts(&study, &study.results[0]),
        [
            "changes with a perturbation of 1 ulp: straight",
            "predictability horizon of runs 1 ulp apart, tolerance 1 mm: 7.5 s",
            "growth of distances: 1.2/s, 0.6 a stride",
        ]
    );
}
