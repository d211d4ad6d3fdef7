//! Life cycle of a session: opening, calibration, following, dropping the motors.

use twinrig_motordriver::{BusConfig, BusTopology, Following};
use twinrig_runtime::IoTask;

use super::harness::{COUNT, Harness, LEGS, at_ms, millis};

fn config() -> BusConfig {
    BusConfig::default()
}

fn direct() -> BusConfig {
    BusConfig {
        topology: BusTopology::Direct,
        ..config()
    }
}

#[test]
fn opening_calibrates_without_motion_in_300_to_700_ms() {
    for config in [config(), direct()] {
        let mut harness = Harness::new(&config);
        let duration = harness.open().unwrap();
        assert!((millis(300)..millis(700)).contains(&duration), "{duration}");
        assert_eq!(harness.diagnostic("sbcp/errors"), 0.0);
        assert!(harness.plant.fastest.iter().all(|rate| *rate < 1e-9));
        // Driven, and held in place.
        let bridges = harness.plant.inputs.iter().skip(1).step_by(2);
        assert!(bridges.into_iter().all(|bridge| *bridge == 1.0));
    }
}

#[test]
fn first_step_receives_the_measurements_of_the_boards() {
    let mut harness = Harness::new(&config());
    harness.plant.outputs[..8].copy_from_slice(&[0.1, 0.2, -0.1, 0.3, 0.0, 0.4, 0.2, 0.5]);
    harness.plant.outputs[8..14].copy_from_slice(&[0.5, -0.6, 0.7, 1.0, -2.0, 30.0]);
    harness.open().unwrap();
    let measured = harness.task.to_process();
    assert!((measured[0] - 0.1).abs() < COUNT && (measured[1] - 0.2).abs() < COUNT);
    assert!((measured[8] + 0.1).abs() < COUNT && (measured[9] - 0.3).abs() < COUNT);
    for (measured, exact) in measured[2..5].iter().zip([0.5, -0.6, 0.7]) {
        assert!((measured - exact).abs() < 0.25 * COUNT);
    }
    for (measured, exact) in measured[5..8].iter().zip([1.0, -2.0, 30.0]) {
        assert!((measured - exact).abs() <= 0.025 + 1e-9);
    }
}

#[test]
fn joints_follow_a_smooth_command_at_500_hz() {
    let mut harness = Harness::new(&config());
    harness.open().unwrap();
    let begin = harness.now();
    let wave = |t: f64| 0.3 * (1.0 - libm::cos(6.0 * t));
    let end = begin + millis(2_000);
    let cycles = harness
        .run_cycles(millis(2), end, |now| [wave((now - begin).as_secs_f64()); 8])
        .unwrap();
    assert!((999..=1_000).contains(&cycles), "{cycles}");
    assert_eq!(harness.diagnostic("sbcp/errors"), 0.0);
    let expected = wave((harness.now() - begin).as_secs_f64());
    for n in 0..8 {
        let position = harness.plant.outputs[n];
        assert!((position - expected).abs() < 0.05, "{position} {expected}");
    }
    // The command reaches 1.8 rad/s; one count of the encoder per tick is 1.5 rad/s.
    let fastest = harness.plant.fastest.iter().copied().fold(0.0, f64::max);
    assert!(fastest < 3.3, "{fastest}");
    for leg in LEGS {
        assert_eq!(
            harness.diagnostic(&format!("sbcp/{leg}/missed_points")),
            0.0
        );
        assert_eq!(
            harness.diagnostic(&format!("sbcp/{leg}/watchdog_drops")),
            0.0
        );
    }
}

#[test]
fn position_control_without_interpolation_stutters_at_100_hz() {
    let fastest = |following| {
        let mut config = config();
        for board in &mut config.boards {
            board.following = following;
        }
        config.session.period = std::time::Duration::from_millis(10);
        let mut harness = Harness::new(&config);
        harness.open().unwrap();
        let begin = harness.now();
        let end = begin + millis(1_000);
        harness
            .run_cycles(millis(10), end, |now| {
                [0.5 * (now - begin).as_secs_f64(); 8]
            })
            .unwrap();
        harness.plant.fastest[0]
    };
    // The command is 0.5 rad/s; the resolution of the encoder makes that 1.1.
    let (smooth, plain) = (fastest(Following::Smooth), fastest(Following::Plain));
    assert!(smooth < 1.3 && plain > 3.0, "{smooth} {plain}");
}

#[test]
fn motors_are_dropped_without_commands_and_re_engaged_by_the_next() {
    let mut harness = Harness::new(&config());
    harness.open().unwrap();
    let end = harness.now() + millis(100);
    harness.run_cycles(millis(2), end, |_| [0.2; 8]).unwrap();
    let bridge = |harness: &Harness| harness.plant.inputs[1];
    harness.run_until(end + millis(19)).unwrap();
    assert_eq!(bridge(&harness), 1.0);
    harness.run_until(end + millis(24)).unwrap();
    assert_eq!(bridge(&harness), 0.0);
    for leg in LEGS {
        assert_eq!(
            harness.diagnostic(&format!("sbcp/{leg}/watchdog_drops")),
            1.0
        );
    }
    let end = harness.now() + millis(100);
    harness.run_cycles(millis(2), end, |_| [0.1; 8]).unwrap();
    assert_eq!(bridge(&harness), 1.0);
    assert!((harness.plant.outputs[0] - 0.1).abs() < 0.01);
}

#[test]
fn missing_board_is_an_error_only_if_used() {
    let mut config = config();
    config.boards[3].present = false;
    let error = Harness::new(&config).open().unwrap_err();
    assert!(error.contains("board RH (id 4)"), "{error}");
    config.boards[3].used = false;
    let mut harness = Harness::new(&config);
    harness.open().unwrap();
    assert_eq!(harness.diagnostic("sbcp/errors"), 0.0);
    assert_eq!(harness.task.to_process().len(), 3 * 8);
}

#[test]
fn commands_out_of_range_are_saturated_and_counted() {
    let mut harness = Harness::new(&config());
    harness.open().unwrap();
    let end = harness.now() + millis(400);
    let cycles = harness
        .run_cycles(millis(2), end, |_| {
            [1.5, -0.5, 1.5, -0.5, 0.0, 0.0, 0.0, 0.0]
        })
        .unwrap();
    assert_eq!(harness.diagnostic("sbcp/saturated"), 4.0 * cycles as f64);
    assert!((harness.plant.outputs[0] - 600.0 * COUNT).abs() < 3.0 * COUNT);
    assert!(harness.plant.outputs[1].abs() < 3.0 * COUNT);
}

#[test]
fn calibration_is_given_up_after_its_timeout() {
    let mut config = config();
    config.session.calibration_timeout = std::time::Duration::from_millis(150);
    let mut harness = Harness::new(&config);
    let error = harness.open().unwrap_err();
    assert!(
        error.contains("did not end its calibration within 150ms"),
        "{error}"
    );
    assert!(harness.now() < at_ms(700));
}
