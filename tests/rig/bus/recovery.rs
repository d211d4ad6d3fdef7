//! Behaviour during and after faults.

use std::collections::BTreeSet;

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_wire::FaultKind;

use crate::bus::bus_scenario::{BusScenario, micros, millis};
use crate::bus::harness::Cycle;
use crate::bus::probe_plant::LEGS;
use crate::bus::property::{before_step, check_property, harness_for, run};
use crate::bus::strategies::{FaultKinds, any_scenario};
use crate::bus::values::{QUIET, timeout};

/// Maximum time after the last fault during which its effects may still reach the host: the sum of
/// all delays; half a millisecond for copied and delayed bursts; data waiting in the converter. A
/// stuck line produces one burst of its whole duration, repeated once for one place that copies or
/// holds it, three times for two, and so on. Traffic that arrives there meanwhile is queued behind
/// it: for a wire with at most a quarter load (four packets with their answers, 106 µs each, in 2
/// ms or more), a third of that time in addition.
fn residual_time(scenario: &BusScenario) -> SimDuration {
    let usb = scenario.usb();
    let converter = usb.latency_timer + usb.microframe * 5 + scenario.host_delay_max();
    let (mut delays, mut noise) = (SimDuration::ZERO, SimDuration::ZERO);
    let mut places = BTreeSet::new();
    for timed_fault in &scenario.timed_faults {
        match timed_fault.kind {
            FaultKind::Delay { by } => delays += by,
            FaultKind::Stuck | FaultKind::Babble { .. } => noise += timed_fault.lasts,
            FaultKind::Duplicate { .. } | FaultKind::Reorder { .. } => {
                places.insert(&timed_fault.on);
            }
            _ => {}
        }
    }
    let copies = noise * ((1 << places.len()) - 1);
    micros(500) + converter + delays + copies + copies / 3
}

/// Maximum duration of a transfer without unsolicited bytes: the quiet time, then one time-out per
/// packet, or one for the frame.
fn transfer_max(scenario: &BusScenario) -> SimDuration {
    let (trips, _) = scenario.round_trips();
    QUIET + timeout(scenario) * trips
}

/// Time after which cycles must succeed: after the residual effects of the faults and the transfer
/// then in progress.
fn recovered(scenario: &BusScenario) -> SimTime {
    scenario.last_fault() + residual_time(scenario) + transfer_max(scenario)
}

#[test]
fn cycles_succeed_and_boards_follow_after_the_residual_time() {
    check_property(128, any_scenario(FaultKinds::All), |scenario| {
        let recovered_at = recovered(scenario);
        let harness = run(
            scenario,
            recovered_at - scenario.last_fault() + scenario.period * 40,
        )?;
        let errors = harness.diagnostic("sbcp/errors");
        let first = harness
            .monitor
            .cycles
            .iter()
            .find(|cycle| cycle.begun >= recovered_at);
        let first = first.ok_or("no cycle begins after the recovery")?;
        if errors > first.errors_before {
            let more = errors - first.errors_before;
            return Err(format!("{more} errors in cycles after {recovered_at}"));
        }
        let late = |cycle: &&Cycle| {
            cycle.begun > recovered_at
                && cycle
                    .ended
                    .is_none_or(|end| end - cycle.begun > QUIET + scenario.transfer_max())
        };
        if let Some(cycle) = harness.monitor.cycles.iter().find(late) {
            return Err(format!("{cycle:?} takes too long"));
        }
        for (leg, name) in LEGS.iter().enumerate() {
            let (applied, sent) = (harness.applied(leg), &harness.monitor.sent[leg]);
            let last = applied.last().ok_or("no set-point was applied")?;
            // A board lags by at most its capacity: 8 points in the buffer, the current one, and
            // the incoming one.
            let recent = sent.iter().rev().take(10);
            let is_near = |set_points: [i64; 2]| {
                let off = |n: usize| Some((last.set_points[n]? - set_points[n]).abs());
                let lag_max =
                    i64::try_from(30 * (scenario.period.as_nanos() / 1_000_000 - 1)).unwrap();
                off(0) <= Some(lag_max) && off(1) <= Some(lag_max) && off(0).is_some()
            };
            if !recent.into_iter().any(|sent| is_near(sent.set_points)) {
                return Err(format!("{name} does not follow the commands: {last:?}"));
            }
        }
        Ok(())
    });
}

#[test]
fn transfers_end_within_their_maximum_after_the_residual_time() {
    check_property(96, any_scenario(FaultKinds::All), |scenario| {
        let harness = run(scenario, millis(200))?;
        let duration_max = transfer_max(scenario);
        let residual_end = scenario.last_fault() + residual_time(scenario);
        for cycle in &harness.monitor.cycles {
            let by = cycle.begun.max(residual_end) + duration_max;
            let ended = cycle.ended.is_some_and(|end| end <= by);
            if !ended && by < harness.rig.now() {
                return Err(format!("{cycle:?} has not ended by {by}"));
            }
        }
        Ok(())
    });
}

#[test]
fn opening_under_faults_succeeds_or_reports_the_board() {
    check_property(48, any_scenario(FaultKinds::All), |scenario| {
        // From power-on, before the boards are ready.
        let early = BusScenario {
            opened: SimTime::ZERO,
            ..scenario.clone()
        };
        let mut harness = harness_for(&early);
        let end = before_step(&early, SimTime::ZERO + SimDuration::from_secs(8));
        match harness.run_until(end) {
            Ok(()) if harness.monitor.opened.is_none() => Err("the devices do not open".into()),
            Err(why) if !why.contains("board ") => {
                Err(format!("the error does not name a board: {why}"))
            }
            _ => Ok(()),
        }
    });
}

/// Bytes in transit \[B\]: the traffic of a wire with 333 bytes per millisecond during its longest
/// delay, in both directions, at two places; a frame at each side of master, controller and boards;
/// and the associated times, at most 14 bytes per stretch of bytes.
#[test]
fn bytes_in_transit_are_bounded_by_wire_rate_times_delay() {
    check_property(32, any_scenario(FaultKinds::All), |scenario| {
        let mut harness = harness_for(scenario);
        harness.run_until(scenario.opened)?;
        let initial_size = harness.rig.save().0.len();
        let delays = residual_time(scenario) + millis(2);
        let in_transit = delays.as_nanos() / 3_000 * 2 * 2 * (1 + 14);
        let size_max = initial_size + usize::try_from(in_transit).unwrap() + 4_096;
        let mut at = scenario.opened;
        while at < scenario.last_fault() + millis(20) {
            at += micros(1_700);
            harness.run_until(at)?;
            let size = harness.rig.save().0.len();
            if size > size_max {
                return Err(format!(
                    "{size} bytes of state at {at}, {initial_size} without faults, at most {size_max}"
                ));
            }
        }
        Ok(())
    });
}
