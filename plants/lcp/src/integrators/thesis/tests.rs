use super::*;
use crate::fixtures::{self, HARD, PASSIVE, hanging, rms, trace};
use crate::model::real::Lanes;
use crate::options::Method as Integrator;

#[test]
fn error_does_not_converge_when_stops_are_reached() {
    let robot = fixtures::without_toes();
    for pose in [PASSIVE, HARD] {
        let mut reference = hanging(&robot, pose);
        reference.method = Integrator::Rk4;
        let (reference, _) = trace(reference, 0.3, 1e-4, |flow, h| flow.step(h).unwrap());
        for h in [2e-3, 5e-4, 1e-4, 2e-5] {
            let (feet, _) = trace(hanging(&robot, pose), 0.3, h, |flow, h| {
                flow.fixed_step
                    .thesis(&flow.model, &mut flow.run, h)
                    .unwrap();
            });
            let error = rms(&feet, &reference);
            assert!(error > 0.05 && error < 0.5, "{h}: {error}");
        }
    }
}

#[test]
fn energy_created_by_resets_appears_as_residual() {
    let robot = fixtures::without_toes();
    // The residual of an Euler step decreases with the step size; that of a reset does not.
    let residuals = [1e-4, 2e-5].map(|h| {
        let (_, flow) = trace(hanging(&robot, PASSIVE), 0.3, h, |flow, h| {
            flow.fixed_step
                .thesis(&flow.model, &mut flow.run, h)
                .unwrap();
        });
        assert!(flow.run.ledger.impact >= 0.0);
        flow.run.ledger.balance().residual
    });
    assert!(
        residuals.iter().all(|&residual| residual > 0.5),
        "{residuals:?}"
    );
}

#[test]
fn method_equals_explicit_euler_between_stops() {
    let (robot, pose) = fixtures::between_stops();
    let mut thesis = hanging(&robot, pose);
    let mut other = thesis.clone();
    for _ in 0..1000 {
        thesis
            .fixed_step
            .thesis(&thesis.model, &mut thesis.run, 1e-4)
            .unwrap();
        other
            .fixed_step
            .explicit_euler(&other.model, &mut other.run, 1e-4)
            .unwrap();
    }
    assert_eq!(fixtures::distance(&thesis.run.state, &other.run.state), 0.0);
    assert_eq!(thesis.run.counts.events, 0);
}

#[test]
fn reset_stops_only_the_joint_of_the_reached_stop() {
    let mut flow = hanging(&fixtures::without_toes(), PASSIVE);
    let gaps = Lanes::new([1e-4, -1e-4, -1e-4, -1e-4]);
    // The pantograph is beyond its closed stop in all legs but the first; in the second it is
    // opening.
    flow.run.state.angles[2] = flow.run.state.angles[0] + gaps;
    flow.run.state.rates = [1.0, 3.0, -5.0].map(Lanes::splat);
    flow.run.state.rates[2] = flow.run.state.rates[2].with_lane(1, 5.0);
    // The stop of the last leg was active in the previous step.
    flow.run.mode.active.closed = Lanes::new([0.0, 0.0, 0.0, 1.0]);
    reset(&flow.model, &mut flow.run);
    assert_eq!(flow.run.state.rates[0].to_array(), [1.0; 4]);
    assert_eq!(flow.run.state.rates[1].to_array(), [3.0; 4]);
    assert_eq!(flow.run.state.rates[2].to_array(), [-5.0, 5.0, 3.0, -5.0]);
}

#[test]
fn loaded_stop_keeps_its_position() {
    // The upper stop of q₃, whose position depends on q₂, is corrected with overdamping.
    let mut flow = hanging(&fixtures::without_toes(), PASSIVE);
    let h = 1e-5;
    let mut worst = 0.0_f64;
    for step in 0..20_000 {
        flow.fixed_step
            .thesis(&flow.model, &mut flow.run, h)
            .unwrap();
        let legs = &flow.model.side_by_side;
        let chain = Chain::new(legs, &flow.run.state.angles, &flow.run.state.rates);
        let open = (chain.open(legs), flow.run.mode.active.open);
        let closed = (
            chain.closed(legs, &flow.run.state.angles),
            flow.run.mode.active.closed,
        );
        for (constraint, active) in [open, closed] {
            if step > 0 && active.lane(0) != 0.0 {
                worst = worst.min(constraint.gap.lane(0));
            }
        }
    }
    assert!(worst > -2e-3, "{worst:e}");
}
