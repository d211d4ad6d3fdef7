//! What can be calculated in closed form.

use proptest::prelude::*;
use twinrig_kernel::SimDuration;
use twinrig_motordriver::Following;
use twinrig_runtime::Timing;
use twinrig_wire::UsbPreset;

use crate::any::{Kinds, any_setting};
use crate::bench::Bench;
use crate::run::{ask, before_step, bench_of, run};
use crate::scope::LEGS;
use crate::setting::{Between, Setting, micros, millis};

/// Longest cycle of a free-running session in the mean: each round trip, and as many whole microframes as turnaround and jitters
/// have; within a microframe the grid swallows them.
fn cycle_max(setting: &Setting) -> SimDuration {
    let (trips, grid) = setting.round_trips();
    let frame = setting.usb().microframe;
    (grid + frame * (setting.late_max().as_nanos() / frame.as_nanos())) * trips
}

#[test]
fn a_free_running_session_is_at_least_as_fast_as_the_closed_form_and_in_the_thesis_case_exactly() {
    let settings = any_setting(Kinds::Nothing).prop_map(|setting| Setting {
        free_running: true,
        ..setting
    });
    ask(32, settings, |setting| {
        let bench = run(setting, millis(300))?;
        // Counted, not as the gauge has it: the first requests of the cycles, which the master writes when one begins.
        let begins = &bench.watch.sent[0];
        let span = begins[begins.len() - 1].at - begins[0].at;
        let mean = span.as_secs_f64() / (begins.len() - 1) as f64;
        let (told, errors) = (
            bench.diagnostic("sbcp/cycle/mean"),
            bench.diagnostic("sbcp/errors"),
        );
        if (told - mean).abs() > 1e-9 {
            return Err(format!(
                "the gauge says {told} s a cycle, but {mean} s were counted"
            ));
        }
        let most = cycle_max(setting).as_secs_f64();
        // What the first and last completions are late is spread over all cycles.
        let spread = setting.jitter.longest().as_secs_f64() / bench.diagnostic("sbcp/cycles");
        if errors > 0.0 || mean > most + spread {
            return Err(format!(
                "{mean} s a cycle in the mean, {most} s at most; {errors} errors"
            ));
        }
        let calm = setting.jitter == Timing::ZERO
            && setting.write_jitter == Timing::ZERO
            && setting.turnaround < micros(99);
        let timed = setting.latency_timer > micros(120);
        if calm && !timed && setting.preset == UsbPreset::Thesis {
            // But for clocks of frames that are off by a ten-thousandth, and the first microframe, which is not whole.
            let exact = most / 1.002;
            let off = 1.1e-4 * exact + 125e-6 / bench.diagnostic("sbcp/cycles");
            if (mean - exact).abs() > off {
                return Err(format!("{mean} s a cycle, not {exact} s"));
            }
        }
        Ok(())
    });
}

/// Smooth boards on a bus without faults, requests late by less than a millisecond in all.
fn smooth() -> impl Strategy<Value = Setting> {
    any_setting(Kinds::Nothing).prop_map(|setting| {
        let preset = match setting.preset {
            UsbPreset::FullSpeed => UsbPreset::Thesis,
            preset => preset,
        };
        // Directly, a late answer makes the next board's request late.
        let jitter = match setting.between {
            Between::Nothing => Timing::ZERO,
            _ => setting.jitter.clone(),
        };
        let late = setting.compute.longest() + setting.write_jitter.longest();
        let write_jitter = match setting.between {
            Between::CutThrough | Between::StoreAndForward if late < micros(900) => {
                setting.write_jitter.clone()
            }
            _ => Timing::ZERO,
        };
        Setting {
            preset,
            jitter,
            write_jitter,
            following: Following::Smooth,
            ..setting
        }
    })
}

fn counted(bench: &Bench, leg: usize) -> f64 {
    bench.of_leg(leg, "filled_steps") - bench.of_leg(leg, "missed_points")
}

/// A point is worth a period of N ticks; a filled step takes one off, a missed point puts one on. So filled − missed is by how
/// many ticks fewer than N for each point have passed: mismatch × points × N. Between its coming and its end as a deadline a point
/// may wait any part of N ticks, and both ends of the count are whole: N + 1.
#[test]
fn filled_less_missed_is_mismatch_times_points_times_ticks_of_a_period() {
    ask(16, smooth(), |setting| {
        let mut bench = bench_of(setting);
        // Past the beginning.
        let begin = before_step(setting, setting.opened + setting.period * 20);
        let end = before_step(setting, begin + SimDuration::from_secs(10));
        bench.run_until(begin)?;
        let before = [0, 1, 2, 3].map(|leg| (counted(&bench, leg), bench.of_leg(leg, "requests")));
        bench.run_until(end)?;
        for (leg, (counts, points)) in before.into_iter().enumerate() {
            let (counts, points) = (
                counted(&bench, leg) - counts,
                bench.of_leg(leg, "requests") - points,
            );
            let ticks = (setting.period.as_nanos() / 1_000_000) as f64;
            let fast = setting.rates_ppb[leg] as f64 * 1e-9;
            let expected = -fast * points * ticks;
            let lost = bench.of_leg(leg, "lost_points");
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

/// The thesis gives 10 µs at most; what the board heard before, and what goes on elsewhere, adds nothing.
#[test]
fn a_board_answers_the_low_latency_instruction_within_ten_microseconds_whatever_happens() {
    ask(48, any_setting(Kinds::All), |setting| {
        let bench = run(setting, millis(20))?;
        for (leg, name) in LEGS.iter().enumerate() {
            let longest = bench.of_leg(leg, "response/longest");
            if longest > 10e-6 + 1e-12 {
                return Err(format!("{name} took {longest} s"));
            }
        }
        Ok(())
    });
}
