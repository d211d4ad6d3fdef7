//! Comparisons of two signals against closed forms of sines, and what remains unobserved.

mod common;

use std::f64::consts::TAU;
use std::path::Path;

use proptest::prelude::*;
use twinrig_kernel::{Direction, Layout, Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{Group, Observer};
use twinrig_scenario::{Facts, Judge, Layouts, Outcome, RunEnd, Scenario, Scene, Verdict};

const TRUTH: &str = "bench/force";
/// An estimate that is observed with the truth.
const BESIDE: &str = "bench/force/beside";
/// An estimate in the inputs of the controller.
const ESTIMATE: &str = "bench/force/estimate";

/// Observation period \[s\]: that of the scenarios here.
const STEP: f64 = 1e-3;

fn scene(signal: &str, expect: &str, control_ms: u64) -> Scene {
    let text = format!(
        "robot = 'cheetah-cub'\nduration = '100 s'\nplant = {{ model = 'massless' }}\n\
         controller = {{ kind = 'cpg', period = '{control_ms} ms' }}\nobserve = {{ period = '1 ms' }}\n\
         [[expect]]\ncompare = {{ signal = '{signal}', with = '{TRUTH}', {expect} }}\n"
    );
    let catalogue = common::catalogue();
    let scenario = Scenario::parse("run.toml", &text, Path::new("."), &[], &catalogue);
    let facts = Facts {
        weight: 10.8,
        plant_outputs: [TRUTH, BESIDE]
            .map(|name| Port::output(name, Unit::Newton, 1))
            .into(),
        process_ports: vec![Port::input(ESTIMATE, Unit::Newton, 1)],
        ..Facts::default()
    };
    let scene = scenario.and_then(|scenario| scenario.scene(&facts));
    scene.unwrap_or_else(|error| panic!("{error}"))
}

/// A run of two signals, as functions of the time \[s\].
struct Run<'r> {
    truth: &'r dyn Fn(f64) -> f64,
    estimate: &'r dyn Fn(f64) -> f64,
    /// Times of the observations \[ms\].
    observed_ms: &'r dyn Fn(u64) -> bool,
    lasts_ms: u64,
    /// Period of the control cycle \[ms\] and its offset \[µs\].
    control: (u64, u64),
}

const NOTHING: Run<'static> = Run {
    truth: &|_| 0.0,
    estimate: &|_| 0.0,
    observed_ms: &|_| true,
    lasts_ms: 5_000,
    control: (1, 0),
};

/// Judges a run whose plant has the truth and an estimate, and whose controller reads the estimate.
fn judge(signal: &str, expect: &str, run: &Run<'_>) -> Outcome {
    let scene = scene(signal, expect, run.control.0);
    let ports: Vec<Port> = scene
        .wanted
        .iter()
        .map(|name| Port::output(name, Unit::Newton, 1))
        .collect();
    let plant = Layout::of(&ports, Direction::Output);
    let inputs = Layout::of(&[Port::input(ESTIMATE, Unit::Newton, 1)], Direction::Input);
    let none = Layout::default();
    let layouts = Layouts {
        plant: &plant,
        process_inputs: &inputs,
        process_outputs: &none,
        diagnostics: &none,
        tasks: &[],
    };
    let mut judge = Judge::new(&scene, layouts);
    let place = |name: &str| plant.find(name).unwrap().start;
    let (truth, beside) = (place(TRUTH), place(BESIDE));
    let mut values = vec![0.0; plant.len()];
    let period = SimDuration::from_millis(run.control.0);
    let mut control = SimTime::ZERO + SimDuration::from_micros(run.control.1);
    for ms in 0..run.lasts_ms {
        let now = SimTime::ZERO + SimDuration::from_millis(ms);
        if (run.observed_ms)(ms) {
            let seconds = STEP * ms as f64;
            values[truth] = (run.truth)(seconds);
            values[beside] = (run.estimate)(seconds);
            judge.samples(now, Group::Plant, &values);
        }
        while control < now + SimDuration::from_millis(1) {
            let seconds = control.since_start().as_secs_f64();
            judge.samples(control, Group::ProcessInputs, &[(run.estimate)(seconds)]);
            control += period;
        }
    }
    let end = RunEnd {
        at: scene.scenario.end(),
        energy: None,
        work: None,
        real_time_factor: None,
    };
    judge.finish(&end).remove(0)
}

fn measured(signal: &str, expect: &str, run: &Run<'_>) -> f64 {
    let found = judge(signal, expect, run);
    found
        .measured
        .unwrap_or_else(|| panic!("{expect}: {found:?}"))
}

/// Lags on either side of zero at a range of 100 ms and a step of 1 ms, with a neighbour.
const LAGS: u64 = 101;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    /// The truth is a + sin ωt with amplitude 10, the estimate gain · truth(t − delay) + offset,
    /// over whole periods.
    #[test]
    fn sines_give_the_closed_forms(
        // From 0.5 to 5 Hz: a range of ±100 ms contains one maximum.
        period_ms in 200_u64..2_000,
        periods in 3_u64..8,
        delay in -0.095..0.095_f64,
        gain in 0.2..3.0_f64,
        offset in -20.0..20.0_f64,
    ) {
        let omega = TAU / (STEP * period_ms as f64);
        let truth = |t: f64| 10.0 * libm::sin(omega * t) + 14.0;
        let estimate = |t: f64| gain * (truth(t - delay) - 14.0) + 14.0 + offset;
        let run = Run { truth: &truth, estimate: &estimate, lasts_ms: periods * period_ms, ..NOTHING };
        let cos = libm::cos(omega * delay);
        let amplitude = (gain * gain + 1.0 - 2.0 * gain * cos).sqrt() * 10.0;

        // Sums over whole periods are exact to rounding.
        let rms = (0.5 * amplitude * amplitude + offset * offset).sqrt();
        let found = measured(BESIDE, "error = { max = '1 N' }", &run);
        prop_assert!((found - rms).abs() < 1e-9 * rms, "error {found} {rms}");
        let found = measured(BESIDE, "correlation = { min = 0.5 }", &run);
        prop_assert!((found - cos).abs() < 1e-9, "correlation {found} {cos}");
        let found = measured(BESIDE, "gain = { min = 0.5 }", &run);
        prop_assert!((found - gain * cos).abs() < 1e-9, "gain {found} {}", gain * cos);

        // Samples miss a maximum by up to half a step: 1 − cos(ω h / 2) of the amplitude.
        let missed = |amplitude: f64| amplitude * 0.5 * (0.5 * omega * STEP) * (0.5 * omega * STEP);
        let peak = amplitude + offset.abs();
        let found = measured(BESIDE, "error_peak = { max = '1 N' }", &run);
        prop_assert!((-1e-9..missed(amplitude) + 1e-9).contains(&(peak - found)), "{found} {peak}");

        // Centres over whole periods.
        let run = Run { lasts_ms: run.lasts_ms + 2 * LAGS, ..run };
        let found = measured(BESIDE, "delay = { max = '10 ms' }", &run);
        // The parabola through three points of a cosine, in closed form.
        let lag = (delay / STEP).round();
        let (b, part) = (omega * STEP, delay / STEP - lag);
        let refined = STEP * (lag + libm::tan(b * part) / (2.0 * libm::tan(0.5 * b)));
        prop_assert!((found - refined).abs() < 1e-9, "delay {found} {refined} {delay}");
        prop_assert!((found - delay).abs() <= 0.0161 * b * b * STEP + 1e-9);
    }

    /// Any number of periods: the bias of an incomplete period remains.
    #[test]
    fn delay_over_incomplete_periods_is_right_to_a_millisecond(
        period_ms in 250_u64..1_000,
        lasts_ms in 4_000_u64..8_000,
        delay in -0.09..0.09_f64,
    ) {
        let omega = TAU / (STEP * period_ms as f64);
        let truth = |t: f64| 14.0 * (1.0 - libm::cos(omega * t));
        let run = Run { truth: &truth, estimate: &|t| truth(t - delay), lasts_ms, ..NOTHING };
        let found = measured(BESIDE, "delay = { max = '10 ms' }", &run);
        prop_assert!((found - delay).abs() < 1e-3, "{found} {delay}");
    }

    /// The estimate of a controller is compared at its own instants, with interpolated truth.
    #[test]
    fn signals_of_other_instants_are_compared_without_bias(
        control in prop_oneof![Just(1_u64), Just(2), Just(10)],
        offset_us in 0..10_000_u64,
        delay in -0.05..0.05_f64,
        late in 0.0..5.0_f64,
    ) {
        let truth = |t: f64| 14.0 * (1.0 - libm::cos(TAU * 2.0 * t));
        let run = Run {
            truth: &truth,
            estimate: &|t| truth(t - delay) + late,
            lasts_ms: 20_000,
            control: (control, offset_us),
            ..NOTHING
        };
        let found = measured(ESTIMATE, "delay = { max = '10 ms' }", &run);
        // The bias of the incomplete period of 0.5 s.
        prop_assert!((found - delay).abs() < 2e-4, "{found} {delay}");
        let exact = Run { estimate: &truth, ..run };
        // Linear interpolation errs by ω² a h² / 8.
        let error = measured(ESTIMATE, "error_peak = { max = '1 N' }", &exact);
        prop_assert!(error < 14.0 * (TAU * 2.0 * STEP) * (TAU * 2.0 * STEP) / 8.0 + 1e-9, "{error}");
    }
}

fn bump(t: f64) -> f64 {
    14.0 * (1.0 - libm::cos(TAU * 2.0 * t))
}

fn with_estimate(estimate: &dyn Fn(f64) -> f64) -> Run<'_> {
    Run {
        truth: &bump,
        estimate,
        ..NOTHING
    }
}

#[test]
fn peaks_are_the_ratio_of_the_maxima() {
    // Maxima 1.1 and 0.9 times the truth's in turns, at samples; a quarter of a period late.
    let scaled = |t: f64| {
        let late = t - 0.06;
        bump(late)
            * if (late * 2.0).floor() % 2.0 == 0.0 {
                1.1
            } else {
                0.9
            }
    };
    let run = with_estimate(&scaled);
    let found = judge(BESIDE, "peaks = { near = 1, within = '1 %' }", &run);
    // The first period of the truth begins within its second bump: eight of ten are complete.
    assert_eq!(
        (found.verdict, found.detail.as_str()),
        (Verdict::Pass, "over 8 periods")
    );
    assert!((found.measured.unwrap() - 1.0).abs() < 1e-9, "{found:?}");
    // A ripple below the hysteresis begins no period.
    let rippled = |t: f64| bump(t) + libm::sin(TAU * 50.0 * t);
    let run = Run {
        truth: &rippled,
        estimate: &rippled,
        ..NOTHING
    };
    assert_eq!(
        judge(BESIDE, "peaks = { min = 1 }", &run).detail,
        "over 8 periods"
    );
}

#[test]
fn each_limit_can_hold_and_fail() {
    let run = with_estimate(&|t| 0.9 * bump(t - 0.020));
    for (measure, held, violated) in [
        ("error", "{ max = '5 N' }", "{ max = '1 N' }"),
        ("error_peak", "{ max = '10 N' }", "{ max = '2 N' }"),
        (
            "delay",
            "{ near = '20 ms', within = '10 us' }",
            "{ max = '19.9 ms' }",
        ),
        (
            "delay",
            "{ min = '15 ms' }",
            "{ min = '-30 ms', max = '10 ms' }",
        ),
        ("correlation", "{ min = 0.9 }", "{ min = 0.99 }"),
        ("gain", "{ near = 0.87, within = '1 %' }", "{ min = 0.89 }"),
        ("peaks", "{ near = 0.9, within = '1 %' }", "{ min = 0.95 }"),
    ] {
        for (limits, verdict) in [(held, Verdict::Pass), (violated, Verdict::Fail)] {
            let found = judge(BESIDE, &format!("{measure} = {limits}"), &run);
            assert_eq!(found.verdict, verdict, "{measure} = {limits}: {found:?}");
            assert_eq!(found.margin.unwrap() >= 0.0, verdict == Verdict::Pass);
        }
    }
    // The first excess has a time: 28 · (1 − 0.9) and more near the first flank.
    let found = judge(BESIDE, "error_peak = { max = '2 N' }", &run);
    assert!(
        found
            .first_violation
            .is_some_and(|at| at < SimTime::ZERO + SimDuration::from_millis(250))
    );
}

/// A noise without memory: the fractional parts of large multiples of a sine.
fn noise(seed: f64) -> impl Fn(f64) -> f64 {
    move |t: f64| {
        let large = 43_758.545 * libm::sin(7_919.0 * t + seed);
        large - large.floor()
    }
}

#[test]
fn missing_evidence_is_unobserved_with_its_reason() {
    let (one, two) = (noise(1.0), noise(2.0));
    let delayed = |t: f64| bump(t - 0.02);
    // A ramp of one and a half periods per second, so that the delay has one maximum.
    let slow = |t: f64| libm::sin(TAU * 0.5 * t);
    let (far, steady) = (|t: f64| slow(t - 0.3), |_: f64| 3.0);
    let run = |truth, estimate, lasts_ms| Run {
        truth,
        estimate,
        lasts_ms,
        ..NOTHING
    };
    for (expect, run, reason) in [
        (
            "delay = { max = '1 s' }",
            run(&bump, &steady, 5_000),
            "the signal is constant",
        ),
        (
            "delay = { max = '1 s' }",
            run(&steady, &bump, 5_000),
            "the signal that it is compared with is constant",
        ),
        (
            "correlation = { max = 0.5 }",
            run(&bump, &steady, 5_000),
            "the signal is constant",
        ),
        (
            "gain = { max = 1 }",
            run(&steady, &bump, 5_000),
            "the signal that it is compared with is constant",
        ),
        (
            "delay = { max = '1 s' }",
            run(&bump, &delayed, 404),
            "too short",
        ),
        (
            "delay = { max = '1 s' }",
            run(&slow, &far, 5_000),
            "the delay is beyond `delay_range`",
        ),
        (
            "delay = { max = '1 s' }",
            run(&one, &two, 5_000),
            "the signals are not related",
        ),
        (
            "peaks = { max = 2 }",
            run(&bump, &delayed, 1_900),
            "2 periods",
        ),
        (
            "peaks = { max = 2 }",
            run(&steady, &bump, 5_000),
            "0 periods",
        ),
        (
            "error = { max = '1 kN' }",
            run(&bump, &delayed, 9),
            "9 samples, and 10 are needed",
        ),
    ] {
        let found = judge(BESIDE, expect, &run);
        assert_eq!(found.verdict, Verdict::Unobserved, "{expect}: {found:?}");
        assert!(found.detail.contains(reason), "{expect}: {found:?}");
        assert!(!found.holds());
    }
    let run = run(&bump, &delayed, 405);
    let found = judge(BESIDE, "delay = { max = '1 s' }", &run);
    assert_eq!(found.verdict, Verdict::Pass, "{found:?}");
}

#[test]
fn nan_fails() {
    let broken = |t: f64| if t > 2.0 { f64::NAN } else { bump(t) };
    for expect in [
        "error = { max = '1 N' }",
        "delay = { max = '1 s' }",
        "peaks = { max = 3 }",
    ] {
        let found = judge(BESIDE, expect, &with_estimate(&broken));
        assert_eq!(
            (found.verdict, found.detail.as_str()),
            (Verdict::Fail, "not a number"),
            "{expect}"
        );
    }
}

#[test]
fn least_of_the_equal_delays_of_a_periodic_signal_counts() {
    let fast = |t: f64| libm::sin(TAU * 20.0 * t);
    for delay in [-0.012, 0.005, 0.0123] {
        let estimate = |t: f64| fast(t - delay);
        let run = Run {
            truth: &fast,
            estimate: &estimate,
            ..NOTHING
        };
        let found = measured(BESIDE, "delay = { max = '1 s' }", &run);
        assert!((found - delay).abs() < 2e-5, "{found} {delay}");
    }
}

#[test]
fn gaps_interrupt_the_correlation() {
    // Without the interruption the second part would be 30 ms late on the grid.
    let delayed = |t: f64| bump(t - 0.02);
    let run = Run {
        observed_ms: &|ms| !(2_000..2_030).contains(&ms),
        ..with_estimate(&delayed)
    };
    let found = measured(BESIDE, "delay = { max = '1 s' }", &run);
    assert!((found - 0.02).abs() < 2e-4, "{found}");
    // Every interval has the wrong length.
    let run = Run {
        observed_ms: &|ms| ms % 3 == 0,
        ..run
    };
    let found = judge(BESIDE, "delay = { max = '1 s' }", &run);
    assert!(found.detail.contains("evenly spaced"), "{found:?}");
}

#[test]
fn long_range_thins_out_the_lags() {
    // ±0.5 s at 1 ms: every fourth pair.
    let delayed = |t: f64| bump(t / 4.0 - 0.0721);
    let truth = |t: f64| bump(t / 4.0);
    let run = Run {
        truth: &truth,
        estimate: &delayed,
        lasts_ms: 10_000,
        ..NOTHING
    };
    let found = measured(
        BESIDE,
        "delay = { max = '1 s' }, delay_range = '500 ms'",
        &run,
    );
    // Incomplete periods of 2 s.
    assert!((found - 4.0 * 0.0721).abs() < 5e-3, "{found}");
}

#[test]
fn window_restricts_the_pairs() {
    let late_after = |t: f64| if t < 2.0 { bump(t) } else { bump(t - 0.02) };
    let run = with_estimate(&late_after);
    let within = |window: &str| {
        let expect = format!("error = {{ max = '1 mN' }} }}\n{window}\n#");
        judge(BESIDE, &expect, &run).verdict
    };
    assert_eq!(within("before = '1.999 s'"), Verdict::Pass);
    assert_eq!(within("after = '2 s'"), Verdict::Fail);
}

#[test]
fn optional_comparison_with_an_absent_signal_is_unobserved() {
    let text = common::text(
        "[[expect]]\noptional = true\ncompare = { signal = 'absent', with = 'leg/LF/foot/load', error = { max = '1 N' } }",
    );
    let scene = common::scene(&text).unwrap();
    let (outcomes, _) = common::run::judge_with(&scene, &common::run::Run::default(), None);
    assert_eq!(outcomes[0].verdict, Verdict::Unobserved);
    assert!(outcomes[0].holds() && outcomes[0].detail.contains("absent"));
}

#[test]
fn both_signals_are_required() {
    let text = common::text(
        "record = { signals = [] }\n[[expect]]\ncompare = { signal = 'leg/RH/foot/load', with = 'leg/LF/cable/tension', error = { max = '1 N' } }",
    );
    let text = text.replace("record = { signals = [] }\n", "");
    let text = format!("record = {{ signals = [], frames = '0 Hz' }}\n{text}");
    let wanted = common::scene(&text).unwrap().wanted;
    assert_eq!(wanted, ["leg/LF/cable/tension", "leg/RH/foot/load"]);
}
