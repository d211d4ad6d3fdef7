//! Tests of outputs besides hips and knees.

use std::f64::consts::TAU;

use twinrig_kernel::SimDuration;
use twinrig_robot::Robot;
use twinrig_robot::leg::Pantograph;
use twinrig_runtime::{Process, VariableError};

use super::{LEGS, PERIOD, cpg, index, run, set};
use crate::{Abduction, Gait, Stand};

#[test]
fn phase_output_follows_the_commands_and_changes_no_bit_of_them() {
    let (mut plain, mut with) = (cpg(Gait::Walk), cpg(Gait::Walk).with_phase_output());
    let (mut without, mut outputs) = ([0.0; 8], [0.0; 12]);
    for _ in 0..400 {
        plain.step(PERIOD, &[], &mut without);
        with.step(PERIOD, &[], &mut outputs);
        assert_eq!(outputs[..8], without);
        assert_eq!(outputs[8..], [0, 1, 2, 3].map(|leg| plain.phase(leg)));
    }
    assert!(with.is_monitor("leg/RH/phase") && !with.is_monitor("leg/RH/hip/command"));
}

#[test]
fn reach_output_is_the_distance_of_the_target_from_the_reach() {
    let (mut plain, mut with) = (cpg(Gait::Trot), cpg(Gait::Trot).with_reach_output());
    let leg = Pantograph::new(&Robot::example().legs[0].leg).unwrap();
    for cpg in [&mut plain, &mut with] {
        set(cpg, "ramp", 0.0);
        set(cpg, "frequency", 0.0);
        set(cpg, "step_length", 0.0);
        set(cpg, "step_height/fore", 0.0);
        set(cpg, "hip_height/fore", leg.length_min());
    }
    assert!(with.is_monitor("leg/RH/out_of_reach"));
    let (mut without, mut outputs) = ([0.0; 8], [0.0; 12]);
    // Targets at one height, farther and farther in front of the hip.
    for n in 0..20 {
        let offset = 0.05 * f64::from(n) * leg.length_max();
        for cpg in [&mut plain, &mut with] {
            set(cpg, "mid_stance_offset/fore", offset);
        }
        plain.step(PERIOD, &[], &mut without);
        with.step(PERIOD, &[], &mut outputs);
        assert_eq!(outputs[..8], without);
        let beyond = libm::hypot(offset, leg.length_min()) - leg.length_max();
        assert!(
            (outputs[8] - beyond.max(0.0)).abs() < 1e-6,
            "{n}: {beyond}, {outputs:?}"
        );
    }
    let [fore, ..] = &with.limit_violations()[..] else {
        panic!("no violation");
    };
    assert!((fore.worst_m - outputs[8]).abs() < 1e-12);
    assert_eq!(fore.first.as_nanos() % PERIOD.as_nanos(), 0);
}

#[test]
fn phase_output_is_below_a_whole_turn() {
    // One rounding error before take-off, which a duty map may take to 2π.
    let mut last = cpg(Gait::Trot).with_phase_output();
    set(&mut last, "frequency", 1.0_f64.next_down());
    last.step(SimDuration::from_secs(1), &[], &mut [0.0; 12]);
    set(&mut last, "frequency", 0.0);
    let mut rounded = 0;
    for n in 1..1000 {
        set(&mut last, "duty_factor/fore", f64::from(n) / 1000.0);
        let mut outputs = [0.0; 12];
        last.step(PERIOD, &[], &mut outputs);
        assert!((0.0..TAU).contains(&outputs[8]), "{n}");
        rounded += u32::from(outputs[8] == 0.0);
    }
    assert!(rounded > 0);
}

#[test]
fn abductions_follow_the_drives_and_change_no_bit_of_them() {
    let mut plain = cpg(Gait::Trot);
    let mut abducting = cpg(Gait::Trot).with_abduction(Abduction::Hold).unwrap();
    set(&mut abducting, "splay", 0.1);
    let ports: Vec<_> = abducting
        .ports()
        .into_iter()
        .map(|port| port.name)
        .collect();
    assert_eq!(ports.len(), 12);
    assert_eq!(
        ports[..8],
        plain
            .ports()
            .into_iter()
            .map(|port| port.name)
            .collect::<Vec<_>>()
    );
    assert_eq!(
        ports[8..],
        LEGS.map(|leg| format!("leg/{leg}/abduction/command"))
    );
    let (without, with) = (run(&mut plain, 300, 8), run(&mut abducting, 300, 12));
    for (without, with) in without.iter().zip(&with) {
        assert_eq!(without[..], with[..8]);
        assert_eq!(with[8..], [0.1, -0.1, 0.1, -0.1]);
    }
}

#[test]
fn stand_abducts_its_active_legs() {
    let stand = Stand::new(&Robot::example(), &["RF", "LH"]).unwrap();
    let mut stand = stand.with_abduction(Abduction::Hold);
    set(&mut stand, "splay", 0.2);
    let names: Vec<_> = stand.ports().into_iter().map(|port| port.name).collect();
    assert_eq!(
        names[4..],
        ["leg/RF/abduction/command", "leg/LH/abduction/command"]
    );
    assert_eq!(run(&mut stand, 1, 6)[0][4..], [-0.2, 0.2]);
}

#[test]
fn splay_is_rejected_without_abduction() {
    let mut cpg = cpg(Gait::Trot);
    let mut stand = Stand::new(&Robot::example(), &LEGS).unwrap();
    set(&mut cpg, "splay", 0.0);
    set(&mut stand, "splay", 0.0);
    let (of_cpg, of_stand) = (index(&cpg, "splay"), index(&stand, "splay"));
    let results = [
        cpg.set_variable(of_cpg, 0.1),
        stand.set_variable(of_stand, 0.1),
    ];
    for result in results {
        assert!(
            matches!(result, Err(VariableError::Refused { .. })),
            "{result:?}"
        );
    }
}
