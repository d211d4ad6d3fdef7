//! The test bench: closed forms, energy, convergence, events, snapshots.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use proptest::prelude::*;
use twinrig_bench::{Bench, BenchFile, BenchParameters, BenchSettings, CamProfile, STEP};
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig_runtime::{Plant, PlantEventKind};

fn parameters() -> BenchParameters {
    let file = BenchFile::find("tactile", Path::new("")).unwrap().unwrap();
    file.bench(&BenchSettings::default()).unwrap()
}

/// The bench without scratches, preload and friction.
fn smooth() -> BenchParameters {
    let mut bench = parameters();
    bench.cam.scratches.count = 0;
    bench.carriage.preload = 0.0;
    bench.cam.friction = 0.0;
    bench.carriage.friction = 0.0;
    bench
}

fn new(parameters: &BenchParameters, step: SimDuration) -> Bench {
    Bench::new(parameters, step, 1, &|_| true).unwrap()
}

/// Advances to a time \[ms\] in milliseconds, at a voltage.
fn advance(bench: &mut Bench, from_ms: u64, to_ms: u64, voltage: f64) {
    for ms in from_ms + 1..=to_ms {
        let now = SimTime::ZERO + SimDuration::from_millis(ms);
        bench.advance(now, &[voltage, 1.0]).unwrap();
    }
}

fn read(bench: &mut Bench, name: &str) -> f64 {
    let layout = Layout::of(&bench.ports(), Direction::Output);
    let mut outputs = vec![0.0; layout.len()];
    bench.observe(&mut outputs);
    outputs[layout.field(name).unwrap().offset]
}

#[test]
fn load_of_the_12_mm_cam_is_that_of_the_thesis() {
    let mut bench = new(&smooth(), STEP);
    let (mut greatest, mut steepest) = (0.0_f64, 0.0_f64);
    for ms in 0..1_000 {
        advance(&mut bench, ms, ms + 1, 4.94);
        let [angle, rate, load, load_rate] = [
            "motor/cam/position",
            "motor/cam/rate",
            "bench/force",
            "bench/force/rate",
        ]
        .map(|name| read(&mut bench, name));
        // F = k h/2 (1 − cos φ); the table of the cam is exact to 1e-12 m.
        let expected = 14.04 * (1.0 - libm::cos(angle));
        assert!((load - expected).abs() < 1e-8, "{load} N at {angle}");
        assert!((load_rate - 14.04 * libm::sin(angle) * rate).abs() < 1e-5);
        greatest = greatest.max(load);
        steepest = steepest.max(load_rate / rate * 4.0 * TAU);
    }
    assert!((greatest - 28.08).abs() < 0.01, "{greatest} N");
    // The greatest rate at 4 Hz, and the frequency that the voltage gives.
    assert!((steepest - 353.0).abs() < 0.5, "{steepest} N/s");
    let hertz = read(&mut bench, "motor/cam/position") / TAU;
    assert!((hertz - 4.0).abs() < 0.1, "{hertz}");
}

/// Accumulated error of the load over a second at 4 Hz, against a tenth of the step \[N\].
fn error(parameters: &BenchParameters, step_us: u64) -> f64 {
    let run = |us| {
        let mut bench = new(parameters, SimDuration::from_micros(us));
        let mut loads = Vec::new();
        for ms in 0..1_000_u64 {
            // A voltage that changes at every millisecond, as that of a board.
            let volts = 5.0 + 0.5 * libm::sin(0.3 * ms as f64);
            advance(&mut bench, ms, ms + 1, volts);
            loads.push(read(&mut bench, "bench/force"));
        }
        loads
    };
    let pairs = run(step_us).into_iter().zip(run(step_us / 10));
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn error_falls_with_the_fourth_power_of_the_step() {
    let bench = smooth();
    let (coarse, fine) = (error(&bench, 500), error(&bench, 250));
    let order = libm::log2(coarse / fine);
    assert!((3.7..5.2).contains(&order), "{coarse} N, {fine} N");
    // With scratches, whose third derivative jumps, at the default step: a resolution of the load
    // cell's noise.
    let scratched = error(&parameters(), 250);
    assert!(scratched < 1e-4, "{scratched} N");
}

#[test]
fn free_shaft_follows_the_exponential_of_its_motor() {
    let mut free = smooth();
    free.cam.profile = CamProfile::Harmonic { lift: 0.0 };
    let mut bench = new(&free, SimDuration::from_micros(100));
    let motor = twinrig_actuator::DcMotor::new(&free.motor).unwrap();
    let inertia = motor.inertia() + free.cam.inertia;
    let (last, decay) = (
        12.0 / 24.0 * motor.no_load_rate(),
        motor.damping() / inertia,
    );
    for ms in 1..20 {
        advance(&mut bench, ms - 1, ms, 12.0);
        let expected = last * -libm::expm1(-decay * 1e-3 * ms as f64);
        let found = read(&mut bench, "motor/cam/rate");
        // Fourth order: (decay · h)⁴/120 of the rate.
        assert!(
            (found - expected).abs() < 1e-6 * last,
            "{found} for {expected}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    /// The energy balance closes for every cam, preload, gap and voltage, through all events.
    #[test]
    fn energy_balance_closes(
        lift in 1e-3..12e-3_f64,
        preload in -6e-3..2e-3_f64,
        mass in 0.05..1.0_f64,
        voltage in -24.0..24.0_f64,
    ) {
        let mut bench = parameters();
        bench.cam.profile = CamProfile::Harmonic { lift };
        bench.carriage.preload = preload;
        bench.carriage.mass = mass;
        let mut bench = new(&bench, SimDuration::from_micros(25));
        for ms in 0..400 {
            advance(&mut bench, ms, ms + 1, if ms < 300 { voltage } else { -voltage });
        }
        let balance = bench.energy();
        prop_assert!(balance.dissipated >= 0.0 && balance.impact >= 0.0);
        // Truncation in scratches, which a cam of 18 Hz passes in a millisecond.
        let allowed = 2e-6 * balance.exchanged + 1e-12;
        prop_assert!(balance.residual.abs() < allowed, "{balance:?} after {:?}", bench.work());
    }

    /// A restored bench continues bit for bit.
    #[test]
    fn restored_bench_continues_bit_for_bit(at in 1_u64..300, preload in -6e-3..2e-3_f64) {
        let mut parameters = parameters();
        parameters.carriage.preload = preload;
        parameters.carriage.mass = 0.5;
        let mut first = new(&parameters, STEP);
        advance(&mut first, 0, at, 20.0);
        let mut second = new(&parameters, STEP);
        second.restore(&first.save()).unwrap();
        advance(&mut first, at, at + 100, 20.0);
        advance(&mut second, at, at + 100, 20.0);
        prop_assert_eq!(first.save(), second.save());
    }
}

/// A bench whose cam turns nearly evenly.
fn flywheel(mut bench: BenchParameters) -> BenchParameters {
    bench.cam.inertia = 10.0;
    bench.motor.voltage = 48.0;
    bench
}

#[test]
fn roller_leaves_the_cam_at_the_rate_of_the_closed_form() {
    for (mass, preload) in [(0.4, 0.0), (0.8, 0.0), (0.5, 1e-3)] {
        let mut heavy = smooth();
        (heavy.carriage.mass, heavy.carriage.preload) = (mass, preload);
        let expected = Bench::separation_rate(&heavy).unwrap();
        // √(2 · 2340 N/m · (12 mm + preload)/(mass · 12 mm)): the springs no longer hold the
        // carriage back at the top, where the cam decelerates it most.
        let closed = (2.0 * 2340.0 * (0.012 + preload) / (mass * 0.012)).sqrt();
        assert!((expected / closed - 1.0).abs() < 1e-12);
        let mut bench = new(&flywheel(heavy), STEP);
        bench.log_events(true);
        let left = |bench: &Bench| {
            let mut events = bench.events().iter();
            events.any(|it| it.part == "bench/roller" && it.kind == PlantEventKind::Released)
        };
        let mut ms = 0;
        while !left(&bench) {
            advance(&mut bench, ms, ms + 1, 48.0);
            ms += 1;
            assert!(ms < 300_000);
        }
        let rate = read(&mut bench, "motor/cam/rate");
        // A turn of the accelerating flywheel passes between two tops.
        assert!(
            (0.998..1.02).contains(&(rate / expected)),
            "{rate} for {expected} rad/s"
        );
    }
}

#[test]
fn gap_is_closed_and_opened_at_the_angles_of_the_lift() {
    let gap = 3e-3;
    let mut with_gap = smooth();
    with_gap.carriage.preload = -gap;
    let mut bench = new(&flywheel(with_gap), STEP);
    bench.log_events(true);
    let mut angles = Vec::new();
    for ms in 0..60_000 {
        let before = read(&mut bench, "motor/cam/position");
        let known = bench.events().len();
        advance(&mut bench, ms, ms + 1, 24.0);
        let (after, rate) = (
            read(&mut bench, "motor/cam/position"),
            read(&mut bench, "motor/cam/rate"),
        );
        for event in &bench.events()[known..] {
            // The flywheel turns evenly within a millisecond.
            let share = event.at_s * 1e3 - ms as f64;
            angles.push((before + share * (after - before), event.kind, rate));
        }
    }
    let touch = libm::acos(1.0 - 2.0 * gap / 0.012);
    assert!(angles.len() > 20);
    for (n, (angle, kind, rate)) in angles.iter().enumerate() {
        let turn = (n / 2) as f64;
        let (expected, direction) = match n % 2 {
            0 => (TAU * turn + touch, PlantEventKind::Reached),
            _ => (TAU * (turn + 1.0) - touch, PlantEventKind::Released),
        };
        assert_eq!(*kind, direction);
        // Angular acceleration of up to 10 rad/s² over half a millisecond, and the location.
        assert!(
            (angle - expected).abs() < 1e-5 + 1e-7 * rate,
            "{angle} for {expected}"
        );
    }
    assert!(touch < PI);
}

#[test]
fn bench_does_not_allocate() {
    let mut bench = Bench::new(&parameters(), STEP, 1, &|_| true).unwrap();
    let mut outputs = vec![0.0; bench.ports().len() - 2];
    advance(&mut bench, 0, 1, 5.0);
    let counted = allocation_counter::measure(|| {
        advance(&mut bench, 1, 1_000, 5.0);
        bench.observe(&mut outputs);
    });
    assert_eq!(counted.count_total, 0);
}

#[test]
fn input_that_is_not_a_number_is_a_fault_at_its_port() {
    let mut bench = new(&parameters(), STEP);
    let now = SimTime::ZERO + SimDuration::from_millis(1);
    let fault = bench.advance(now, &[f64::NAN, 1.0]).unwrap_err();
    assert_eq!(fault.part, "motor/cam/voltage");
    advance(&mut bench, 0, 1, 5.0);
}

proptest! {
    /// The state has all of the motion, with the roller on the cam and free of it.
    #[test]
    fn bench_resumed_from_a_state_moves_bit_for_bit(
        voltage in 2.0_f64..60.0, begin_ms in 1_u64..300,
    ) {
        let mut bench = new(&parameters(), STEP);
        advance(&mut bench, 0, begin_ms, voltage);
        let mut resumed = new(&parameters(), STEP);
        let lines = resumed.resume_from(&bench.state().unwrap()).unwrap();
        prop_assert!(lines.is_empty());
        for bench in [&mut bench, &mut resumed] {
            advance(bench, begin_ms, begin_ms + 100, voltage);
        }
        for name in ["motor/cam/position", "motor/cam/rate", "bench/lift", "bench/force"] {
            let [one, other] = [&mut bench, &mut resumed].map(|it| read(it, name).to_bits());
            prop_assert_eq!(one, other, "{}", name);
        }
    }
}
