use super::*;
use crate::options::Method as Integrator;
use crate::real::Lanes;
use crate::scenes::{self, HARD, PASSIVE, hanging, rms, trace};

#[test]
fn it_does_not_converge_where_stops_are_reached() {
    let robot = scenes::without_toes();
    for pose in [PASSIVE, HARD] {
        let mut right = hanging(&robot, pose);
        right.method = Integrator::Rk4;
        let (right, _) = trace(right, 0.3, 1e-4, |flow, h| flow.step(h).unwrap());
        for h in [2e-3, 5e-4, 1e-4, 2e-5] {
            let (feet, _) = trace(hanging(&robot, pose), 0.3, h, |flow, h| {
                flow.run_thesis(h).unwrap();
            });
            let error = rms(&feet, &right);
            assert!(error > 0.05 && error < 0.5, "{h}: {error}");
        }
    }
}

#[test]
fn energy_that_a_reset_makes_is_what_the_books_miss() {
    let robot = scenes::without_toes();
    // The residual of an Euler step shrinks with the step; that of a reset stays.
    let residuals = [1e-4, 2e-5].map(|h| {
        let (_, flow) = trace(hanging(&robot, PASSIVE), 0.3, h, |flow, h| {
            flow.run_thesis(h).unwrap();
        });
        assert!(flow.ledger.impact >= 0.0);
        flow.ledger.balance().residual
    });
    assert!(
        residuals.iter().all(|&residual| residual > 0.5),
        "{residuals:?}"
    );
}

#[test]
fn between_stops_it_is_the_explicit_method() {
    let (robot, pose) = scenes::between();
    let mut own = hanging(&robot, pose);
    let mut other = own.clone();
    for _ in 0..1000 {
        own.run_thesis(1e-4).unwrap();
        other.run_explicit_euler(1e-4).unwrap();
    }
    assert_eq!(scenes::distance(&own.state, &other.state), 0.0);
    assert_eq!(own.counts.events, 0);
}

#[test]
fn a_reset_stops_the_joint_and_spares_the_others() {
    let mut flow = hanging(&scenes::without_toes(), PASSIVE);
    let apart = Lanes::new([1e-4, -1e-4, -1e-4, -1e-4]);
    // The pantograph closes beyond its stop in all legs but the first; in the second it opens again.
    flow.state.angles[2] = flow.state.angles[0] + apart;
    flow.state.rates = [1.0, 3.0, -5.0].map(Lanes::splat);
    flow.state.rates[2] = flow.state.rates[2].with_lane(1, 5.0);
    // That of the last pushed in the step before.
    flow.mode.active.closed = Lanes::new([0.0, 0.0, 0.0, 1.0]);
    flow.reset();
    assert_eq!(flow.state.rates[0].to_array(), [1.0; 4]);
    assert_eq!(flow.state.rates[1].to_array(), [3.0; 4]);
    assert_eq!(flow.state.rates[2].to_array(), [-5.0, 5.0, 3.0, -5.0]);
}

#[test]
fn a_stop_that_carries_a_leg_keeps_it_where_it_is() {
    // The upper stop of q₃, whose place depends on q₂, is taken back to where it belongs, overdamped.
    let mut flow = hanging(&scenes::without_toes(), PASSIVE);
    let h = 1e-5;
    let mut worst = 0.0_f64;
    for step in 0..20_000 {
        flow.run_thesis(h).unwrap();
        let legs = &flow.model.side_by_side;
        let chain = Chain::new(legs, &flow.state.angles, &flow.state.rates);
        let open = (chain.open(legs), flow.mode.active.open);
        let closed = (
            chain.closed(legs, &flow.state.angles),
            flow.mode.active.closed,
        );
        for (constraint, active) in [open, closed] {
            if step > 0 && active.lane(0) != 0.0 {
                worst = worst.min(constraint.gap.lane(0));
            }
        }
    }
    assert!(worst > -2e-3, "{worst:e}");
}
