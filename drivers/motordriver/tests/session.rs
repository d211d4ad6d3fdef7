//! The life of a session: opening, calibrating, following, letting go.

mod common;

use common::{Bench, COUNT, LEGS, at_ms, millis};
use twinrig_motordriver::{BusConfig, BusTopology, Following};
use twinrig_runtime::IoTask;

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
fn opening_calibrates_without_motion_and_takes_some_hundreds_of_milliseconds() {
    for config in [config(), direct()] {
        let mut bench = Bench::new(&config);
        let took = bench.open().unwrap();
        assert!((millis(300)..millis(700)).contains(&took), "{took}");
        assert_eq!(bench.diagnostic("sbcp/errors"), 0.0);
        assert!(bench.plant.fastest.iter().all(|rate| *rate < 1e-9));
        // Driven, and held where they are.
        let bridges = bench.plant.inputs.iter().skip(1).step_by(2);
        assert!(bridges.into_iter().all(|bridge| *bridge == 1.0));
    }
}

#[test]
fn the_first_step_sees_what_the_boards_measure() {
    let mut bench = Bench::new(&config());
    bench.plant.outputs[..8].copy_from_slice(&[0.1, 0.2, -0.1, 0.3, 0.0, 0.4, 0.2, 0.5]);
    bench.plant.outputs[8..14].copy_from_slice(&[0.5, -0.6, 0.7, 1.0, -2.0, 30.0]);
    bench.open().unwrap();
    let seen = bench.task.to_process();
    assert!((seen[0] - 0.1).abs() < COUNT && (seen[1] - 0.2).abs() < COUNT);
    assert!((seen[8] + 0.1).abs() < COUNT && (seen[9] - 0.3).abs() < COUNT);
    for (seen, true_one) in seen[2..5].iter().zip([0.5, -0.6, 0.7]) {
        assert!((seen - true_one).abs() < 0.25 * COUNT);
    }
    for (seen, true_one) in seen[5..8].iter().zip([1.0, -2.0, 30.0]) {
        assert!((seen - true_one).abs() <= 0.025 + 1e-9);
    }
}

#[test]
fn joints_follow_a_smooth_command_at_500_hz() {
    let mut bench = Bench::new(&config());
    bench.open().unwrap();
    let begin = bench.now();
    let wave = |t: f64| 0.3 * (1.0 - libm::cos(6.0 * t));
    let end = begin + millis(2_000);
    let cycles = bench
        .run_cycles(millis(2), end, |now| [wave((now - begin).as_secs_f64()); 8])
        .unwrap();
    assert!((999..=1_000).contains(&cycles), "{cycles}");
    assert_eq!(bench.diagnostic("sbcp/errors"), 0.0);
    let expected = wave((bench.now() - begin).as_secs_f64());
    for n in 0..8 {
        let position = bench.plant.outputs[n];
        assert!((position - expected).abs() < 0.05, "{position} {expected}");
    }
    // 1.8 rad/s are asked for, and a count of the encoder in a tick is 1.5 rad/s.
    let fastest = bench.plant.fastest.iter().copied().fold(0.0, f64::max);
    assert!(fastest < 3.3, "{fastest}");
    for leg in LEGS {
        assert_eq!(bench.diagnostic(&format!("sbcp/{leg}/missed_points")), 0.0);
        assert_eq!(bench.diagnostic(&format!("sbcp/{leg}/watchdog_drops")), 0.0);
    }
}

#[test]
fn the_position_controller_alone_stutters_at_100_hz() {
    let fastest = |following| {
        let mut config = config();
        for board in &mut config.boards {
            board.following = following;
        }
        config.session.period = std::time::Duration::from_millis(10);
        let mut bench = Bench::new(&config);
        bench.open().unwrap();
        let begin = bench.now();
        let end = begin + millis(1_000);
        bench
            .run_cycles(millis(10), end, |now| {
                [0.5 * (now - begin).as_secs_f64(); 8]
            })
            .unwrap();
        bench.plant.fastest[0]
    };
    // The command asks for 0.5 rad/s; counts of the encoder make that 1.1.
    let (smooth, plain) = (fastest(Following::Smooth), fastest(Following::Plain));
    assert!(smooth < 1.3 && plain > 3.0, "{smooth} {plain}");
}

#[test]
fn motors_are_dropped_when_commands_stop_and_taken_up_by_the_next() {
    let mut bench = Bench::new(&config());
    bench.open().unwrap();
    let end = bench.now() + millis(100);
    bench.run_cycles(millis(2), end, |_| [0.2; 8]).unwrap();
    let bridge = |bench: &Bench| bench.plant.inputs[1];
    bench.run_until(end + millis(19)).unwrap();
    assert_eq!(bridge(&bench), 1.0);
    bench.run_until(end + millis(24)).unwrap();
    assert_eq!(bridge(&bench), 0.0);
    for leg in LEGS {
        assert_eq!(bench.diagnostic(&format!("sbcp/{leg}/watchdog_drops")), 1.0);
    }
    let end = bench.now() + millis(100);
    bench.run_cycles(millis(2), end, |_| [0.1; 8]).unwrap();
    assert_eq!(bridge(&bench), 1.0);
    assert!((bench.plant.outputs[0] - 0.1).abs() < 0.01);
}

#[test]
fn a_board_that_is_missing_is_an_error_only_if_it_is_used() {
    let mut config = config();
    config.boards[3].present = false;
    let error = Bench::new(&config).open().unwrap_err();
    assert!(error.contains("board RH (id 4)"), "{error}");
    config.boards[3].used = false;
    let mut bench = Bench::new(&config);
    bench.open().unwrap();
    assert_eq!(bench.diagnostic("sbcp/errors"), 0.0);
    assert_eq!(bench.task.to_process().len(), 3 * 8);
}

#[test]
fn commands_out_of_range_stop_at_its_end_and_are_counted() {
    let mut bench = Bench::new(&config());
    bench.open().unwrap();
    let end = bench.now() + millis(400);
    let cycles = bench
        .run_cycles(millis(2), end, |_| {
            [1.5, -0.5, 1.5, -0.5, 0.0, 0.0, 0.0, 0.0]
        })
        .unwrap();
    assert_eq!(bench.diagnostic("sbcp/saturated"), 4.0 * cycles as f64);
    assert!((bench.plant.outputs[0] - 600.0 * COUNT).abs() < 3.0 * COUNT);
    assert!(bench.plant.outputs[1].abs() < 3.0 * COUNT);
}

#[test]
fn calibration_that_does_not_end_is_given_up() {
    let mut config = config();
    config.session.calibration_timeout = std::time::Duration::from_millis(150);
    let mut bench = Bench::new(&config);
    let error = bench.open().unwrap_err();
    assert!(
        error.contains("did not end its calibration within 150ms"),
        "{error}"
    );
    assert!(bench.now() < at_ms(700));
}
