use twinrig_contact::{Ground, Terrain};
use twinrig_legged::{Base, Ledger};
use twinrig_robot::Robot;

use super::*;
use crate::fixtures::{self, HARD, PASSIVE, Pose, flow, hanging, rms, trace};
use crate::options::Method as Integrator;
use crate::plant::flow::Flow;

type Step = fn(&mut Flow<3>, f64) -> Result<(), StepError>;

const EXPLICIT: Step = |flow, h| {
    flow.fixed_step
        .explicit_euler(&flow.model, &mut flow.run, h)
};
const SEMI_IMPLICIT: Step = |flow, h| flow.fixed_step.semi_implicit(&flow.model, &mut flow.run, h);

/// Returns the error of the foot over 0.3 s at these steps \[m\].
fn errors<const M: usize>(robot: &Robot, pose: Pose, step: Step, lengths: [f64; M]) -> [f64; M] {
    let mut reference = hanging(robot, pose);
    reference.method = Integrator::Rk4;
    let (reference, _) = trace(reference, 0.3, 1e-4, |flow, h| flow.step(h).unwrap());
    lengths.map(|h| {
        let (feet, _) = trace(hanging(robot, pose), 0.3, h, |flow, h| {
            step(flow, h).unwrap();
        });
        rms(&feet, &reference)
    })
}

#[test]
fn both_methods_are_of_first_order_between_stops() {
    let (robot, pose) = fixtures::between_stops();
    for (step, lengths, most) in [
        (SEMI_IMPLICIT, [2e-3, 1e-3, 5e-4], 1e-4),
        (EXPLICIT, [1e-4, 5e-5, 2.5e-5], 5e-5),
    ] {
        let [coarse, middle, fine] = errors(&robot, pose, step, lengths);
        assert!(coarse < most, "{coarse:e}");
        for ratio in [coarse / middle, middle / fine] {
            assert!((1.9..2.1).contains(&ratio), "{ratio}");
        }
    }
}

#[test]
fn both_methods_converge_with_stops() {
    let robot = fixtures::without_toes();
    for (pose, step, most, lengths) in [
        (PASSIVE, SEMI_IMPLICIT, 3e-3, [2e-3, 1e-4, 1e-5]),
        (PASSIVE, EXPLICIT, 1e-3, [2e-3, 1e-4, 1e-5]),
        (HARD, SEMI_IMPLICIT, 2e-2, [2e-3, 1e-4, 1e-5]),
        (HARD, EXPLICIT, 2e-2, [2e-3, 1e-4, 1e-5]),
    ] {
        let [coarse, middle, fine] = errors(&robot, pose, step, lengths);
        assert!(coarse < most && coarse > 1e-4, "{coarse:e}");
        assert!(
            middle < coarse / 8.0 && fine < middle / 4.0,
            "{coarse:e} {middle:e} {fine:e}"
        );
    }
}

#[test]
fn explicit_euler_gains_energy_and_semi_implicit_euler_does_not() {
    let (robot, pose) = fixtures::between_stops();
    let residual = |step: Step, h: f64| {
        let (_, flow) = trace(hanging(&robot, pose), 0.3, h, |flow, h| {
            step(flow, h).unwrap();
        });
        flow.run.ledger.balance().residual
    };
    // 2 ms is far above the stability limit 2ζ/ω of the explicit method and far below that of the
    // symplectic one.
    assert!(residual(EXPLICIT, 2e-3) > 1.0);
    assert!(residual(SEMI_IMPLICIT, 2e-3).abs() < 1e-3);
    let [coarse, fine] = [1e-4, 5e-5].map(|h| residual(EXPLICIT, h));
    assert!(
        coarse > 0.0 && (1.8..2.4).contains(&(coarse / fine)),
        "{coarse:e} {fine:e}"
    );
}

#[test]
fn error_estimate_bounds_the_error_of_one_step() {
    let (robot, pose) = fixtures::between_stops();
    for step in [EXPLICIT, SEMI_IMPLICIT] {
        let [coarse, fine] = [1e-3, 5e-4].map(|h| {
            let mut flow = hanging(&robot, pose);
            step(&mut flow, h).unwrap();
            let mut reference = hanging(&robot, pose);
            reference.method = Integrator::Rk4;
            reference.step(h).unwrap();
            let error = rms(&[fixtures::foot(&flow)], &[fixtures::foot(&reference)]);
            // The estimate adds absolute values that may cancel in the error.
            assert!(
                flow.fixed_step.estimate > error && flow.fixed_step.estimate < 100.0 * error,
                "{error:e}"
            );
            flow.fixed_step.estimate
        });
        assert!((3.5..4.5).contains(&(coarse / fine)), "{coarse:e} {fine:e}");
    }
}

#[test]
fn stops_never_add_energy() {
    let robot = fixtures::without_toes();
    let mut flow = hanging(&robot, HARD);
    let before: f64 = flow.stored().iter().sum();
    for _ in 0..30_000 {
        SEMI_IMPLICIT(&mut flow, 1e-5).unwrap();
        let stored: f64 = flow.stored().iter().sum();
        assert!(stored < before * (1.0 + 1e-3), "{before} to {stored}");
    }
    assert!(flow.run.ledger.impact > 0.0 && flow.run.ledger.dissipated > 0.0);
    assert!(
        flow.run.ledger.balance().residual.abs() < 1e-3,
        "{:?}",
        flow.run.ledger.balance()
    );
}

/// The robot on the ground with its motors on.
fn standing(base: Base) -> Flow<3> {
    let robot = fixtures::without_toes();
    let servos = fixtures::servo_drives(&robot);
    let pose = ([0.0; 3], [0.0; 3]);
    let mut flow = flow::<3>(&robot, base, pose, servos, Some(fixtures::flat()));
    let foot = fixtures::foot(&flow);
    flow.run.state.position = [
        0.0,
        0.0,
        1e-3 - foot[1] - flow.model.legs[0].constants.hip[2],
    ];
    let stored = flow.stored();
    flow.run.ledger = Ledger::opened(stored);
    flow
}

#[test]
fn ground_carries_the_weight_after_a_drop() {
    for (base, step, h, count) in [
        (Base::Free, SEMI_IMPLICIT, 1e-3, 500),
        (Base::Planar, SEMI_IMPLICIT, 1e-3, 500),
        (Base::Free, EXPLICIT, 5e-5, 10_000),
    ] {
        let mut flow = standing(base);
        for _ in 0..2 * count {
            step(&mut flow, h).unwrap();
        }
        let before = flow
            .run
            .impulse_sums
            .ground
            .iter()
            .map(|leg| leg[2])
            .sum::<f64>();
        for _ in 0..count {
            step(&mut flow, h).unwrap();
        }
        let after = flow
            .run
            .impulse_sums
            .ground
            .iter()
            .map(|leg| leg[2])
            .sum::<f64>();
        let weight = flow.model.trunk.mass * twinrig_robot::GRAVITY;
        let borne = (after - before) / 0.5;
        assert!(
            (borne / weight - 1.0).abs() < 0.02,
            "{base:?}: {borne} of {weight}"
        );
        assert!(
            flow.run.state.velocity[2].abs() < 5e-2,
            "{:?}",
            flow.run.state.velocity
        );
    }
}

#[test]
fn energy_balance_includes_impact_losses_with_restitution() {
    let mut flow = standing(Base::Free);
    flow.model.ground = Some(Ground::new(Terrain::Flat, 0.6, 0.5).unwrap());
    flow.run.state.velocity[2] = -0.5;
    let stored = flow.stored();
    flow.run.ledger = Ledger::opened(stored);
    for _ in 0..2000 {
        SEMI_IMPLICIT(&mut flow, 1e-5).unwrap();
    }
    let balance = flow.run.ledger.balance();
    assert!(
        flow.run.counts.events > 0 && balance.impact > 1e-3,
        "{balance:?}"
    );
    assert!(balance.residual.abs() < 0.1 * balance.impact, "{balance:?}");
}

#[test]
fn steps_evaluations_and_events_are_counted() {
    let robot = fixtures::without_toes();
    for step in [EXPLICIT, SEMI_IMPLICIT] {
        let mut flow = hanging(&robot, PASSIVE);
        for _ in 0..150 {
            step(&mut flow, 2e-3).unwrap();
        }
        assert_eq!(
            (flow.run.counts.steps, flow.run.counts.evaluations),
            (150, 150)
        );
        // Two events per leg: the end stop, then the closed stop.
        assert_eq!(flow.run.counts.events, 8);
    }
}

#[test]
fn nan_state_is_an_error() {
    for step in [EXPLICIT, SEMI_IMPLICIT] {
        let mut flow = hanging(&fixtures::without_toes(), PASSIVE);
        flow.run.state.rates[1] = flow.run.state.rates[1].with_lane(2, f64::NAN);
        assert!(step(&mut flow, 1e-3).is_err());
    }
}
