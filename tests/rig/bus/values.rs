//! Correctness and completeness of transmitted values.

use std::cell::Cell;
use std::collections::BTreeMap;

use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_motordriver::Following;
use twinrig_wire::FaultKind;

use crate::bus::bus_scenario::{BusScenario, TimedFault, Topology, micros, millis};
use crate::bus::harness::{Harness, SetPoints};
use crate::bus::probe_plant::{LEGS, stamp_of};
use crate::bus::property::{check_property, run};
use crate::bus::strategies::{FaultKinds, any_scenario};

/// A tick of a board whose clock is slow by 2000 ppm, plus the resolution of the plant's time
/// stamps.
const TICK: SimDuration = micros(1_003 + 250);

/// Set-points applied by a board, as indices into those that the master wrote for it; `None` for
/// one that was not written before.
fn applied_indices(harness: &Harness, leg: usize) -> Vec<Option<usize>> {
    let sent = &harness.monitor.sent[leg];
    let numbers: BTreeMap<SetPoints, usize> = sent
        .iter()
        .enumerate()
        .map(|(n, sent)| (sent.set_points, n))
        .collect();
    let applied = harness.applied(leg);
    let set_points = applied
        .iter()
        .filter_map(|applied| match applied.set_points {
            [Some(hip), Some(knee)] if hip != 0 || knee != 0 => Some((applied.from, [hip, knee])),
            _ => None,
        });
    let number = |(from, set_points): (SimTime, SetPoints)| {
        let number = numbers.get(&set_points).copied();
        number.filter(|number| sent[*number].at <= from)
    };
    set_points.map(number).collect()
}

/// Number of received measurements that no board took before.
fn unmeasured(harness: &Harness, scenario: &BusScenario) -> usize {
    let wrong = |leg: usize| {
        harness
            .measurements(leg)
            .filter(|(at, measurements)| match stamp_of(leg, measurements) {
                Some(stamp) => scenario.opened + stamp.since_start() > *at,
                None => true,
            })
            .count()
    };
    (0..4).map(wrong).sum()
}

/// Checks that set-points and measurements are those sent, that set-points are applied in order and
/// once, and that new measurements were taken for the cycle that delivered them.
fn check_values(harness: &Harness, scenario: &BusScenario) -> Result<(), String> {
    if unmeasured(harness, scenario) > 0 {
        return Err("a received measurement was not taken by any board".into());
    }
    for (leg, name) in LEGS.iter().enumerate() {
        if scenario.following == Following::Plain {
            let applied_indices = applied_indices(harness, leg);
            let order: Option<Vec<usize>> = applied_indices.iter().copied().collect();
            let order =
                order.ok_or_else(|| format!("{name} applied a set-point that was not sent"))?;
            if !order.is_sorted_by(|a, b| a < b) {
                return Err(format!(
                    "{name} applied set-points repeatedly or out of order: {order:?}"
                ));
            }
        }
        check_freshness(harness, scenario, leg)?;
    }
    Ok(())
}

/// Checks that a change between two samples of the process originates from the transfer between
/// them.
fn check_freshness(harness: &Harness, scenario: &BusScenario, leg: usize) -> Result<(), String> {
    let mut last = None;
    for (at, measurements) in harness.measurements(leg) {
        let stamp = stamp_of(leg, &measurements);
        if stamp == last {
            continue;
        }
        last = stamp;
        let ended = harness.monitor.cycles.iter().rev();
        let mut ended = ended.skip_while(|cycle| cycle.ended.is_none_or(|end| end > at));
        let (Some(stamp), Some(cycle)) = (stamp, ended.next()) else {
            continue;
        };
        let measured = scenario.opened + stamp.since_start();
        if measured + TICK < cycle.begun {
            return Err(format!(
                "at {at} the process received a measurement of {} taken at {measured}, before the cycle of {}",
                LEGS[leg], cycle.begun
            ));
        }
    }
    Ok(())
}

/// Number of set-points received within a tick of each other, which cannot all be observed. Of two
/// written ones, the first may be delayed by the write jitter.
fn unresolved(harness: &Harness, scenario: &BusScenario, leg: usize) -> usize {
    let sent = &harness.monitor.sent[leg];
    let near = TICK + micros(250) + scenario.write_jitter.longest();
    let close = |pair: &&[crate::bus::harness::SentSetPoints]| pair[1].at - pair[0].at < near;
    1 + sent.windows(2).filter(close).count()
}

#[test]
fn values_are_authentic_unique_ordered_and_fresh_under_losses() {
    check_property(48, any_scenario(FaultKinds::Losses), |scenario| {
        check_values(&run(scenario, millis(50))?, scenario)
    });
}

/// Answers delayed by at most the sum of time-out and quiet time: twice the delay and a round trip.
fn late_answers() -> impl Strategy<Value = BusScenario> {
    let timed_fault = (0..100_000_u64, 0..1_000_u64, 1..100_000_u64);
    (any_scenario(FaultKinds::None), timed_fault).prop_map(|(scenario, (after, share, lasts))| {
        let on = match scenario.topology {
            Topology::Direct => "wire/sbcp",
            Topology::CutThrough | Topology::StoreAndForward => "wire/sbcp/link",
        };
        let (trips, _) = scenario.round_trips();
        let limit = timeout(&scenario) + QUIET;
        let spare = limit
            .checked_sub(scenario.transfer_max() / trips)
            .unwrap_or_default();
        let by = SimDuration::from_nanos(spare.as_nanos() * share / 2_000);
        let timed_fault = TimedFault {
            after: micros(after),
            on: on.into(),
            kind: FaultKind::Delay { by },
            lasts: micros(lasts),
        };
        BusScenario {
            timed_faults: vec![timed_fault],
            ..scenario
        }
    })
}

/// Quiet time for which the master waits after an error.
pub const QUIET: SimDuration = millis(1);

/// Time-out of a packet or frame, as derived by the driver from its configuration.
pub fn timeout(scenario: &BusScenario) -> SimDuration {
    let usb = scenario.usb();
    let usual = match scenario.topology {
        Topology::Direct => millis(1),
        Topology::CutThrough | Topology::StoreAndForward => millis(2),
    };
    usual * usb.microframe.as_nanos().div_ceil(125_000) + usb.latency_timer * 2
}

#[test]
fn late_answers_are_not_assigned_to_later_cycles() {
    check_property(48, late_answers(), |scenario| {
        let harness = run(scenario, millis(50))?;
        if unmeasured(&harness, scenario) > 0 {
            return Err("a received measurement was not taken by any board".into());
        }
        (0..4).try_for_each(|leg| check_freshness(&harness, scenario, leg))
    });
}

#[test]
fn rate_of_wrong_values_is_bounded_by_the_checksum() {
    let (wrong, harmed) = (Cell::new(0_u64), Cell::new(0.0_f64));
    check_property(96, any_scenario(FaultKinds::All), |scenario| {
        let plain = BusScenario {
            following: Following::Plain,
            ..scenario.clone()
        };
        let harness = run(&plain, millis(50))?;
        let unsent = |leg: usize| {
            applied_indices(&harness, leg)
                .iter()
                .filter(|number| number.is_none())
                .count()
        };
        let wrong_set_points: usize = (0..4).map(unsent).sum();
        // A wrong value is retained until the next valid answer and counts once.
        let mut wrong_measurements = 0;
        for leg in 0..LEGS.len() {
            let mut last = Vec::new();
            for (_, values) in harness.measurements(leg) {
                wrong_measurements +=
                    usize::from(values != last && stamp_of(leg, &values).is_none());
                last = values;
            }
        }
        // Altered bytes and bytes in collisions, in packets of at least 10.
        let bytes = harness.sum("harmed") + harness.sum("collisions");
        wrong.set(wrong.get() + (wrong_set_points + wrong_measurements) as u64);
        harmed.set(harmed.get() + bytes / 10.0);
        let allowed = 3.0 + bytes / 10.0 / 20.0;
        if (wrong_set_points + wrong_measurements) as f64 > allowed {
            return Err(format!(
                "{wrong_set_points} set-points and {wrong_measurements} measurements are wrong; {bytes} bytes were altered"
            ));
        }
        Ok(())
    });
    // An 8-bit checksum accepts 1 of 256 randomly damaged packets, and fewer with few damaged bits.
    println!(
        "{} wrong values, {} packets of altered bytes",
        wrong.get(),
        harmed.get()
    );
    assert!(wrong.get() as f64 <= 3.0 + harmed.get() / 128.0);
}

#[test]
fn set_points_are_applied_once_and_in_order_without_faults() {
    check_property(32, any_scenario(FaultKinds::None), |scenario| {
        let harness = run(scenario, millis(300))?;
        check_values(&harness, scenario)?;
        if harness.diagnostic("sbcp/errors") > 0.0 || harness.monitor.skipped > 0 {
            let (errors, skipped) = (harness.diagnostic("sbcp/errors"), harness.monitor.skipped);
            return Err(format!("{errors} errors, {skipped} cycles skipped"));
        }
        for (leg, name) in LEGS.iter().enumerate() {
            let sent = &harness.monitor.sent[leg];
            if harness.leg_diagnostic(leg, "requests") != sent.len() as f64 {
                return Err(format!("{} did not accept {} set-points", name, sent.len()));
            }
            // With or without interpolation every point is reached, except those waiting at the
            // end.
            let applied = harness.applied(leg);
            let mut applied = applied.iter();
            let mut reached = 0;
            while let Some(next) = sent.get(reached) {
                if applied.any(|applied| applied.set_points == next.set_points.map(Some)) {
                    reached += 1;
                } else {
                    break;
                }
            }
            let open = match scenario.following {
                Following::Plain => unresolved(&harness, scenario, leg),
                // The current one, and two that wait.
                Following::Smooth => 3,
            };
            if reached + open < sent.len() && unresolved(&harness, scenario, leg) == 1 {
                return Err(format!(
                    "{} reached {reached} of {} points",
                    name,
                    sent.len()
                ));
            }
        }
        Ok(())
    });
}

#[test]
fn losses_are_accounted_for_by_errors() {
    check_property(48, any_scenario(FaultKinds::Losses), |scenario| {
        let harness = run(scenario, millis(50))?;
        let (mut sent, mut accepted) = (0.0, 0.0);
        for (leg, name) in LEGS.iter().enumerate() {
            let (of_leg, by_leg) = (
                harness.monitor.sent[leg].len() as f64,
                harness.leg_diagnostic(leg, "requests"),
            );
            if by_leg > of_leg {
                return Err(format!("{name} accepted {by_leg} of {of_leg} set-points"));
            }
            if scenario.following == Following::Plain {
                let observed = applied_indices(&harness, leg).len() as f64;
                if observed > by_leg
                    || observed + (unresolved(&harness, scenario, leg) as f64) < by_leg
                {
                    return Err(format!(
                        "{name} counts {by_leg} set-points and applied {observed}"
                    ));
                }
            }
            sent += of_leg;
            accepted += by_leg;
        }
        // Each lost one is an error of the master.
        let errors = harness.diagnostic("sbcp/errors");
        if sent - accepted > errors {
            return Err(format!("{sent} sent, {accepted} accepted, {errors} errors"));
        }
        Ok(())
    });
}

/// If each loss affects a whole packet (10 bytes out or 22 back), errors and lost bytes determine
/// the number of losses in each direction.
#[test]
fn losses_at_one_place_are_exactly_determined_by_the_counters() {
    check_property(48, any_scenario(FaultKinds::LossesAtOnePlace), |scenario| {
        let harness = run(scenario, millis(50))?;
        let sent: usize = harness.monitor.sent.iter().map(Vec::len).sum();
        let accepted: f64 = (0..4)
            .map(|leg| harness.leg_diagnostic(leg, "requests"))
            .sum();
        let (errors, harmed) = (harness.diagnostic("sbcp/errors"), harness.sum("harmed"));
        let on_link = scenario
            .timed_faults
            .iter()
            .any(|timed_fault| timed_fault.on.ends_with("link"));
        // Over the link four requests form one burst: E = 4x + y, H = 40x + 22y; elsewhere E = x +
        // y, H = 10x + 22y.
        let lost = if on_link {
            4.0 * (22.0 * errors - harmed) / 48.0
        } else {
            (22.0 * errors - harmed) / 12.0
        };
        if sent as f64 - accepted != lost {
            return Err(format!(
                "{sent} sent, {accepted} accepted, but {lost} lost according to {errors} errors and {harmed} bytes"
            ));
        }
        Ok(())
    });
}
