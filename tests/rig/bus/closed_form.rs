//! Comparison with closed-form results.

use proptest::prelude::*;
use twinrig_kernel::SimDuration;
use twinrig_motordriver::Following;
use twinrig_runtime::Timing;
use twinrig_wire::UsbPreset;

use crate::bus::bus_scenario::{BusScenario, Topology, micros, millis};
use crate::bus::harness::Harness;
use crate::bus::probe_plant::LEGS;
use crate::bus::property::{before_step, check_property, harness_for, run};
use crate::bus::strategies::{FaultKinds, any_scenario};

/// Upper bound of the mean cycle time of a free-running session: for each round trip, its whole
/// microframes and those of turnaround and jitters; fractions of a microframe are absorbed by the
/// microframe grid.
fn cycle_max(scenario: &BusScenario) -> SimDuration {
    let (trips, grid) = scenario.round_trips();
    let frame = scenario.usb().microframe;
    (grid + frame * (scenario.host_delay_max().as_nanos() / frame.as_nanos())) * trips
}

#[test]
fn free_running_cycle_time_is_bounded_by_the_closed_form() {
    let scenarios = any_scenario(FaultKinds::None).prop_map(|scenario| BusScenario {
        free_running: true,
        ..scenario
    });
    check_property(32, scenarios, |scenario| {
        let harness = run(scenario, millis(300))?;
        // Measured from the first requests of the cycles, which the master writes at their begin,
        // not from the diagnostic.
        let begins = &harness.monitor.sent[0];
        let span = begins[begins.len() - 1].at - begins[0].at;
        let mean = span.as_secs_f64() / (begins.len() - 1) as f64;
        let (reported, errors) = (
            harness.diagnostic("sbcp/cycle/mean"),
            harness.diagnostic("sbcp/errors"),
        );
        if (reported - mean).abs() > 1e-9 {
            return Err(format!(
                "diagnostic: {reported} s per cycle, measured: {mean} s"
            ));
        }
        let mean_max = cycle_max(scenario).as_secs_f64();
        // The delays of the first and last completion are distributed over all cycles.
        let spread = scenario.jitter.longest().as_secs_f64() / harness.diagnostic("sbcp/cycles");
        if errors > 0.0 || mean > mean_max + spread {
            return Err(format!(
                "mean cycle time {mean} s, at most {mean_max} s; {errors} errors"
            ));
        }
        let without_jitter = scenario.jitter == Timing::ZERO
            && scenario.write_jitter == Timing::ZERO
            && scenario.turnaround < micros(99);
        let with_latency_timer = scenario.latency_timer > micros(120);
        if without_jitter && !with_latency_timer && scenario.preset == UsbPreset::Thesis {
            // Except for frame clocks off by a ten-thousandth, and the incomplete first microframe.
            let exact = mean_max / 1.002;
            let tolerance = 1.1e-4 * exact + 125e-6 / harness.diagnostic("sbcp/cycles");
            if (mean - exact).abs() > tolerance {
                return Err(format!("mean cycle time {mean} s, expected {exact} s"));
            }
        }
        Ok(())
    });
}

/// Smooth boards on a bus without faults, with a total request delay below a millisecond.
fn smooth() -> impl Strategy<Value = BusScenario> {
    any_scenario(FaultKinds::None).prop_map(|scenario| {
        let preset = match scenario.preset {
            UsbPreset::FullSpeed => UsbPreset::Thesis,
            preset => preset,
        };
        // Without a bus controller, a late answer delays the request to the next board.
        let jitter = match scenario.topology {
            Topology::Direct => Timing::ZERO,
            _ => scenario.jitter.clone(),
        };
        let late = scenario.compute.longest() + scenario.write_jitter.longest();
        let write_jitter = match scenario.topology {
            Topology::CutThrough | Topology::StoreAndForward if late < micros(900) => {
                scenario.write_jitter.clone()
            }
            _ => Timing::ZERO,
        };
        BusScenario {
            preset,
            jitter,
            write_jitter,
            following: Following::Smooth,
            ..scenario
        }
    })
}

fn count_difference(harness: &Harness, leg: usize) -> f64 {
    harness.leg_diagnostic(leg, "filled_steps") - harness.leg_diagnostic(leg, "missed_points")
}

/// A point lasts a period of N ticks; a filled step shortens it by one tick and a missed point
/// lengthens it by one. Therefore filled − missed = mismatch × points × N, the number of ticks
/// by which the elapsed time is short of N per point. From reception to its deadline a point may
/// wait up to N ticks, and both counts are integers: tolerance N + 1.
#[test]
fn filled_minus_missed_equals_clock_mismatch_times_points_times_ticks() {
    check_property(16, smooth(), |scenario| {
        let mut harness = harness_for(scenario);
        // After the initial transient.
        let begin = before_step(scenario, scenario.opened + scenario.period * 20);
        let end = before_step(scenario, begin + SimDuration::from_secs(10));
        harness.run_until(begin)?;
        let before = [0, 1, 2, 3].map(|leg| {
            (
                count_difference(&harness, leg),
                harness.leg_diagnostic(leg, "requests"),
            )
        });
        harness.run_until(end)?;
        for (leg, (counts, points)) in before.into_iter().enumerate() {
            let (counts, points) = (
                count_difference(&harness, leg) - counts,
                harness.leg_diagnostic(leg, "requests") - points,
            );
            let ticks = (scenario.period.as_nanos() / 1_000_000) as f64;
            let rate_error = scenario.rates_ppb[leg] as f64 * 1e-9;
            let expected = -rate_error * points * ticks;
            let lost = harness.leg_diagnostic(leg, "lost_points");
            if (counts - expected).abs() > ticks + 1.0 || lost > 0.0 {
                return Err(format!(
                    "{}: filled - missed = {counts}, expected {expected} of {points} points; {lost} lost",
                    LEGS[leg]
                ));
            }
        }
        Ok(())
    });
}

/// The thesis states 10 µs at most, independent of previously received bytes and of other traffic.
#[test]
fn low_latency_response_time_is_at_most_ten_microseconds() {
    check_property(48, any_scenario(FaultKinds::All), |scenario| {
        let harness = run(scenario, millis(20))?;
        for (leg, name) in LEGS.iter().enumerate() {
            let longest = harness.leg_diagnostic(leg, "response/longest");
            if longest > 10e-6 + 1e-12 {
                return Err(format!("response time of {name}: {longest} s"));
            }
        }
        Ok(())
    });
}
