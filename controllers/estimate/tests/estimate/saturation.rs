//! A saturated cell: no information, growing deviation, and the way back.

use crate::support::{CELL, MS, f1, push, settings};
use twinrig_estimate::{Channel, ForceEstimator, ForceResponse, RECOVERY, Settings};

fn cell(recovery: Option<f64>) -> Settings {
    let mut settings = settings(f1(), ForceResponse::Hysteresis(CELL));
    settings.recovery = recovery;
    settings
}

/// A force of 6 N is followed by 200 N for 2 s and 6 N again, while a bias of the rate carries the
/// estimate further into saturation. Returns the deviations before and at the end of saturation,
/// and the estimate 0.5 s after it.
fn through_saturation(recovery: Option<f64>) -> [f64; 3] {
    let mut estimator = ForceEstimator::new(&cell(recovery)).unwrap();
    let (mut known, mut unknown) = (0.0, 0.0);
    for ms in 1..=3500_u64 {
        let force = if (1000..3000).contains(&ms) {
            200.0
        } else {
            6.0
        };
        let at_ns = ms * MS;
        let voltage = CELL.at(force, 0.0).voltage;
        push(&mut estimator, at_ns, Channel::Piezoresistive, voltage);
        // 40 N/s in excess while saturated; the step itself is too fast for the cell.
        let excess = if force > 100.0 { 40.0 } else { 0.0 };
        push(&mut estimator, at_ns, Channel::Piezoelectric, 0.02 * excess);
        match ms {
            999 => known = estimator.estimate().deviation,
            2999 => unknown = estimator.estimate().deviation,
            _ => (),
        }
    }
    [known, unknown, estimator.estimate().force]
}

#[test]
fn estimate_returns_from_saturation() {
    let [known, unknown, force] = through_saturation(Some(RECOVERY));
    assert!(unknown > 10.0 * known, "{known} {unknown}");
    // 6 N, at rate 0 between both branches: noise of 0.03 V over 0.4 V/N leaves tenths.
    assert!((force - 6.0).abs() < 0.5, "{force}");
}

/// The reason for the threshold: at the estimate the gradient is zero, and stays so.
#[test]
fn estimate_is_lost_without_recovery() {
    let [.., force] = through_saturation(None);
    assert!(force > 20.0, "{force}");
}

#[test]
fn saturated_cell_is_no_information() {
    let settings = cell(None);
    let mut with = ForceEstimator::new(&settings).unwrap();
    let mut without = ForceEstimator::new(&Settings {
        piezoresistive: None,
        ..settings
    })
    .unwrap();
    // From 2000 N the gradient underflows to zero.
    let far = 2000.0;
    for estimator in [&mut with, &mut without] {
        push(estimator, 0, Channel::Piezoelectric, 0.02 * far * 1e3);
        push(estimator, 1000 * MS, Channel::Piezoelectric, 0.02 * far);
    }
    assert!(with.estimate().force > far);
    for ms in 1001..1100 {
        push(&mut with, ms * MS, Channel::Piezoresistive, 4.5);
        for estimator in [&mut with, &mut without] {
            push(estimator, ms * MS, Channel::Piezoelectric, 0.0);
        }
    }
    assert_eq!(with.state(), without.state());
    assert_eq!(with.covariance(), without.covariance());
}
