//! A free shaft: the board of a motor that rotates without limit.

use core::f64::consts::TAU;
use std::ops::Range;
use std::time::Duration;

use proptest::prelude::*;
use twinrig_kernel::{Port, SimDuration, SimTime, Unit};
use twinrig_motordriver::{Attachment, BoardConfig, BusConfig};
use twinrig_runtime::{IoTask, PlantAccess, PlantFault, PlantSignals};

use super::harness::{COUNT, Harness, Plant, at_ms, millis, turn};

/// Motor of the robot behind its gear, without load, on a shaft that can be blocked.
#[derive(Clone, PartialEq)]
struct Cam {
    now: SimTime,
    moved_to: SimTime,
    /// Voltage and bridge.
    inputs: [f64; 2],
    /// Position \[rad\].
    position: f64,
    rate: f64,
    blocked: bool,
}

impl Cam {
    fn at(position: f64) -> Self {
        Self {
            now: SimTime::ZERO,
            moved_to: SimTime::ZERO,
            inputs: [0.0; 2],
            position,
            rate: 0.0,
            blocked: false,
        }
    }

    fn signals() -> PlantSignals {
        PlantSignals::of(&[
            Port::input("motor/cam/voltage".to_owned(), Unit::Volt, 1),
            Port::input("motor/cam/bridge".to_owned(), Unit::One, 1),
            Port::output("motor/cam/position".to_owned(), Unit::Radian, 1),
        ])
    }

    fn advance_to_now(&mut self) {
        let seconds = (self.now - self.moved_to).as_secs_f64();
        self.moved_to = self.now;
        if self.blocked {
            self.rate = 0.0;
        } else if seconds > 0.0 {
            let voltage = (self.inputs[1] != 0.0).then_some(self.inputs[0]);
            turn(&mut self.position, &mut self.rate, voltage, seconds);
        }
    }
}

impl Plant for Cam {
    fn now(&self) -> SimTime {
        self.now
    }

    fn set_now(&mut self, now: SimTime) {
        self.now = now;
    }
}

impl PlantAccess for Cam {
    fn sample(&mut self, signals: Range<usize>) -> Result<&[f64], PlantFault> {
        self.advance_to_now();
        Ok(&core::slice::from_ref(&self.position)[signals])
    }

    fn actuate(&mut self, signals: Range<usize>) -> Result<&mut [f64], PlantFault> {
        self.advance_to_now();
        Ok(&mut self.inputs[signals])
    }
}

const PERIOD: SimDuration = millis(10);

fn config(rate_ppb: i64) -> BusConfig {
    let board = BoardConfig::shaft("cam", 5);
    let board = board.with_clock(rate_ppb, SimDuration::from_micros(300));
    let mut config = BusConfig {
        boards: vec![board.unwrap()],
        ..BusConfig::default()
    };
    config.session.period = Duration::from_millis(10);
    // 8 Hz are more than the default of 7.8.
    config.session.gains.max_speed = 40_000;
    config
}

fn harness(config: &BusConfig, position: f64) -> Harness<Cam> {
    Harness::with_plant(config, &Cam::signals(), Cam::at(position))
}

fn opened(config: &BusConfig, position: f64) -> Harness<Cam> {
    let mut harness = harness(config, position);
    harness.open().unwrap();
    harness
}

/// Runs at a constant rate \[Hz\] for a duration.
fn run(harness: &mut Harness<Cam>, hertz: f64, lasts: SimDuration) {
    let end = harness.now() + lasts;
    harness.run_cycles(PERIOD, end, |_| [TAU * hertz]).unwrap();
    harness.plant.advance_to_now();
}

/// Largest ripple of the position \[counts\]: the encoder resolves one count, and the loop
/// answers to it.
const RIPPLE: f64 = 3.0;

#[test]
fn mean_speed_is_exact_to_the_board_clock_without_drift_over_100_turns() {
    for (hertz, rate_ppb) in [
        (0.5, 0),
        (2.0, -764_000),
        (4.0, 50_000),
        (-4.0, 0),
        (8.0, 20_000),
    ] {
        let mut harness = opened(&config(rate_ppb), 0.3);
        // The ramp to 8 Hz takes 1.02 s; the integral settles in 0.2 s.
        run(&mut harness, hertz, millis(3_000));
        let (begin, from) = (harness.now(), harness.plant.position);
        let seconds = 100.0 / f64::abs(hertz);
        let mut reached = 0.0;
        while reached < seconds {
            run(&mut harness, hertz, millis(2_000));
            reached = (harness.now() - begin).as_secs_f64();
            let expected = TAU * hertz * (1.0 + rate_ppb as f64 * 1e-9) * reached;
            let error = (harness.plant.position - from - expected) / COUNT;
            assert!(
                error.abs() < RIPPLE,
                "{hertz} Hz: {error} counts after {reached} s"
            );
        }
        assert_eq!(harness.diagnostic("sbcp/saturated"), 0.0);
        assert_eq!(harness.diagnostic("sbcp/cam/stalled"), 0.0);
        assert_eq!(harness.diagnostic("sbcp/ambiguous"), 0.0);
    }
}

#[test]
fn host_measures_position_and_rate() {
    let mut harness = opened(&config(0), -TAU * 3.0 - 0.3);
    // Whole turns before the session are unknown.
    assert!((harness.task.to_process()[0] + 0.3).abs() < COUNT);
    assert_eq!(harness.task.to_process()[1], 0.0);
    for hertz in [4.0, -1.5] {
        run(&mut harness, hertz, millis(2_000));
        let &[position, rate] = harness.task.to_process() else {
            panic!("a shaft has two outputs");
        };
        let exact = harness.plant.position + 3.0 * TAU;
        // The last cycle began up to a period ago, with a position of up to a tick before.
        let moved = TAU * f64::abs(hertz) * 11e-3;
        assert!(
            (position - exact).abs() < moved + COUNT,
            "{position} {exact}"
        );
        // Two readings with one count of resolution each, and the ripple, over 80 ms.
        let resolution = (1.0 + RIPPLE) * COUNT / 0.08;
        assert!((rate - TAU * hertz).abs() < resolution, "{rate} {hertz}");
    }
}

#[test]
fn ports_are_those_of_the_shaft() {
    let harness = harness(&config(0), 0.0);
    let names: Vec<String> = harness
        .task
        .ports()
        .into_iter()
        .map(|port| port.name)
        .collect();
    assert_eq!(
        names,
        [
            "motor/cam/rate/command",
            "motor/cam/position",
            "motor/cam/rate"
        ]
    );
}

#[test]
fn acceleration_is_limited() {
    let mut config = config(0);
    config.session.gains.max_acceleration = 8_192; // 2 turns/s²
    let mut harness = opened(&config, 0.0);
    run(&mut harness, 4.0, millis(1_000));
    assert!(
        (harness.plant.rate / TAU - 2.0).abs() < 0.1,
        "{}",
        harness.plant.rate / TAU
    );
    run(&mut harness, 4.0, millis(1_500));
    assert!(
        (harness.plant.rate / TAU - 4.0).abs() < 0.1,
        "{}",
        harness.plant.rate / TAU
    );
}

#[test]
fn speeds_above_the_maximum_are_saturated_and_counted() {
    let mut harness = opened(&config(0), 0.0);
    run(&mut harness, 11.0, millis(3_000));
    let (begin, from) = (harness.now(), harness.plant.position);
    run(&mut harness, 11.0, millis(1_000));
    let turned = (harness.plant.position - from) / COUNT;
    let expected = 40_000.0 * (harness.now() - begin).as_secs_f64();
    assert!((turned - expected).abs() < RIPPLE, "{turned}");
    assert!(harness.diagnostic("sbcp/saturated") >= 399.0);
}

#[test]
fn watchdog_drops_the_motor_and_the_next_command_continues_at_its_speed() {
    let mut harness = opened(&config(0), 0.0);
    run(&mut harness, 2.0, millis(1_000));
    let silent_from = harness.now();
    harness.run_until(silent_from + millis(95)).unwrap();
    assert_eq!(harness.plant.inputs[1], 1.0);
    harness.run_until(silent_from + millis(115)).unwrap();
    assert_eq!(harness.plant.inputs, [0.0; 2]);
    assert_eq!(harness.diagnostic("sbcp/cam/watchdog_drops"), 1.0);
    // It coasts on without friction; one count of travel in a tick resolves 0.24 Hz.
    let mut slowest = f64::MAX;
    for _ in 0..20 {
        run(&mut harness, 2.0, PERIOD);
        slowest = slowest.min(harness.plant.rate / TAU);
    }
    assert_eq!(harness.plant.inputs[1], 1.0);
    assert!(slowest > 1.5, "{slowest}");
    // The command 0 stops it where it is after its ramp.
    run(&mut harness, 0.0, millis(1_000));
    let stopped_at = harness.plant.position;
    run(&mut harness, 0.0, millis(1_000));
    assert!((harness.plant.position - stopped_at).abs() < RIPPLE * COUNT);
    assert!(harness.diagnostic("sbcp/cam/lag").abs() < RIPPLE);
}

#[test]
fn stalled_motor_is_reported_at_its_maximum_torque() {
    let mut config = config(0);
    config.session.gains.max_torque = 500;
    let mut harness = opened(&config, 0.0);
    run(&mut harness, 2.0, millis(1_000));
    assert_eq!(harness.diagnostic("sbcp/cam/stalled"), 0.0);
    harness.plant.advance_to_now();
    harness.plant.blocked = true;
    run(&mut harness, 2.0, millis(1_000));
    assert_eq!(harness.diagnostic("sbcp/cam/lag"), 1_024.0);
    // Of 1000 ticks, those before a quarter of a turn of following error: 125 ms.
    let stalled = harness.diagnostic("sbcp/cam/stalled");
    assert!((870.0..=880.0).contains(&stalled), "{stalled}");
    // 10 A across 0.593 ohm: the torque limit.
    assert!(
        (harness.plant.inputs[0] - 5.86).abs() < 0.01,
        "{}",
        harness.plant.inputs[0]
    );
    harness.plant.blocked = false;
    run(&mut harness, 2.0, millis(1_000));
    assert!((harness.plant.rate / TAU - 2.0).abs() < 0.1);
    let after = harness.diagnostic("sbcp/cam/stalled");
    run(&mut harness, 2.0, millis(1_000));
    assert_eq!(harness.diagnostic("sbcp/cam/stalled"), after);
}

#[test]
fn board_without_continuous_rotation_is_refused() {
    let mut config = config(0);
    config.boards[0].position_limits[0] &= 0x7FFF;
    let error = harness(&config, 0.0).open().unwrap_err();
    assert!(error.contains("bit 15 of its PositionLimit"), "{error}");
}

#[test]
fn leg_and_shaft_share_a_bus() {
    let config = BusConfig::default();
    let ports = |config: &BusConfig| {
        let driver = twinrig_motordriver::Bus::driver(config).unwrap();
        let ports = twinrig_runtime::Driver::ports(&driver);
        ports.into_iter().map(|port| port.name).collect::<Vec<_>>()
    };
    let mut mixed = config.clone();
    mixed.boards.insert(1, BoardConfig::shaft("cam", 5));
    mixed.boards.pop();
    assert_eq!(mixed.boards[1].attachment, Attachment::Shaft);
    let (legs, mixed) = (ports(&config), ports(&mixed));
    // Six ports of LF, three of the shaft, six each of RF and LH.
    assert_eq!(mixed.len(), 21);
    assert_eq!(mixed[..6], legs[..6]);
    assert_eq!(mixed[9..], legs[6..18]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    /// At any instant, also while the shaft wraps and ramps.
    #[test]
    fn restored_shaft_continues_bit_for_bit(
        micros in 0_u64..400_000,
        hertz in -8.0..8.0_f64,
    ) {
        let config = config(900_000);
        let mut first = opened(&config, 0.0);
        let end = first.now() + SimDuration::from_micros(micros);
        first.run_cycles(PERIOD, end, |_| [TAU * hertz]).unwrap();
        let saved = first.save();
        let mut second = harness(&config, 0.0);
        second.restore(&saved);
        prop_assert!(second.save() == saved);
        for harness in [&mut first, &mut second] {
            run(harness, -hertz, millis(300));
        }
        prop_assert!(first.save() == second.save());
        prop_assert_eq!(first.diagnostics(), second.diagnostics());
        prop_assert!(first.now() > at_ms(300));
    }
}
