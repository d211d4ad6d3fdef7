//! Tables of synthetic walks, in which every value is another: a column with the value of another
//! one fails.

use twinrig_kernel::SimDuration;
use twinrig_rig::{MethodSetting, PlantId, Scales, Variant};

use super::{contact, ensemble, footsteps, transport};
use crate::page_parts::tables;
use crate::plants::contact::{ContactResiduals, GaitContact, RestContact};
use crate::plants::dominance_tests::{page, study};
use crate::plants::ensemble::{Ensemble, Interval, QuantityInterval};
use crate::plants::footsteps::Footstep;
use crate::plants::row::{Status, VariantKey};
use crate::plants::transport::{Cost, Transport};

fn key(plant: &str) -> VariantKey {
    VariantKey::from(&Variant {
        plant: PlantId::new(plant),
        method: "euler".to_owned(),
        setting: MethodSetting::Step(SimDuration::from_millis(2)),
        scales: Scales::AS_IS,
    })
}

#[test]
fn cost_of_transport_is_shown_by_its_definition() {
    let cost = Cost {
        from_s: 1.0,
        to_s: 5.0,
        distance_m: 2.0,
        speed_m_s: 0.51,
        work_j: 4.2,
        drive_work_j: Some(4.3),
        positive_work_j: Some(5.0),
        dissipated_j: 3.1,
        impact_j: 0.32,
        stored_j: 0.033,
        residual_j: 0.42,
        appears_most_j: 0.1,
        vanishes_most_j: 0.2,
        cost_of_transport: Some(0.61),
        covered_cost_of_transport: Some(0.62),
        positive_cost_of_transport: Some(0.63),
    };
    let walk = |cost| Transport {
        key: key("full"),
        status: Status::Ok,
        why: None,
        fell_at_s: None,
        converged: None,
        cost: Some(cost),
    };
    // The drives' own work is another one: their positive work is not known.
    let doubtful = Cost {
        drive_work_j: Some(8.4),
        ..cost
    };
    let mut study = study(Vec::new());
    study.transports = vec![walk(cost), walk(doubtful)];
    assert_eq!(
        tables(&transport::section(&study))[0],
        [
            "plant | method | speed [m/s] | cost, net | covered | positive | work, net | residual \
             | friction | impacts | stored",
            "full | euler (2 ms) | 0.510 | 0.610 | 0.620 | 0.630 | 4.2 J | 420 mJ, 10.00 % \
             | 3.1 J | 320 mJ | 33 mJ",
            "full | euler (2 ms) | 0.510 | 0.610 | 0.620 |  | 4.2 J | 420 mJ, 10.00 % | 3.1 J \
             | 320 mJ | 33 mJ",
        ]
    );
}

#[test]
fn contacts_have_their_residuals_below_their_heads() {
    let mut study = study(Vec::new());
    study.contacts = vec![ContactResiduals {
        key: key("full"),
        status: Status::Ok,
        why: Some("a remark".to_owned()),
        rest: Some(RestContact {
            load_n: 1.0,
            penetration_m: 2e-3,
            expected_m: Some(3e-3),
            stiffness_realised: Some(0.4),
            speed_m_s: 0.0,
        }),
        gait: Some(GaitContact {
            signorini_j: 5e-3,
            penetration_m: 6e-3,
            coulomb_n: Some(7.0),
            along_slip_j: 8e-3,
            created_j: 9e-3,
            dissipated_j: 10e-3,
        }),
    }];
    assert_eq!(
        tables(&contact::section(&study))[0],
        [
            "plant | method | load at rest | penetration | load / k | stiffness realised \
             | Signorini | greatest penetration | Coulomb | along slip | created | dissipated | why",
            "full | euler (2 ms) | 1 N | 2 mm | 3 mm | 0.4 | 5 mJ | 6 mm | 7 N | 8 mJ | 9 mJ \
             | 10 mJ | a remark",
        ]
    );
}

#[test]
fn ensembles_show_the_error_of_the_method_below_the_interval() {
    let mut study = study(Vec::new());
    study.ensembles = vec![Ensemble {
        key: key("full"),
        simulated_s: 3.0,
        completed: 8,
        fell: 1,
        failed: 2,
        why: None,
        quantities: vec![QuantityInterval {
            quantity: "speed".to_owned(),
            unit: "m/s".to_owned(),
            interval: Interval {
                mean: 0.5,
                low: 0.48,
                high: 0.52,
                deviation: 0.02,
            },
            method_error: Some(0.003),
        }],
    }];
    let section = ensemble::section(&study);
    assert_eq!(
        tables(&section)[0],
        [
            "plant | method | walks | speed",
            "full | euler (2 ms) | 8, 1 fell, 2 failed | 0.500 ± 0.020 m/s (3 mm/s)",
        ]
    );
    assert!(page(&study).contains("<span class=\"wrap soft\">3 mm/s</span>"));
}

#[test]
fn touch_downs_within_the_uncertainty_are_grey() {
    let mut study = study(Vec::new());
    let step = |number: usize, unsure_s: f64| Footstep {
        plant: PlantId::new("other"),
        leg: "LF".to_owned(),
        number,
        at_s: Some(0.25),
        later_s: Some(2e-3),
        apart_m: Some(3e-3),
        unsure_s: Some(unsure_s),
        unsure_m: Some(1e-3),
    };
    study.footsteps = vec![step(1, 1e-3), step(2, 3e-3)];
    let section = footsteps::section(&study);
    let [_, first, second] = &tables(&section)[0][..] else {
        panic!("{section:?}");
    };
    assert_eq!(first, "1 | 0.250 s | +2 ms | 3 mm");
    assert_eq!(second, "2 | 0.250 s | +2 ms | 3 mm");
    let html = page(&study);
    assert_eq!(html.matches("<span class=\"soft\">+2 ms</span>").count(), 1);
    let (before, _) = html.split_once("<span class=\"soft\">+2 ms").unwrap();
    assert!(before.contains(">+2 ms<"), "the second one is grey");
}
