//! A saved and restored bus continues identically, at any instant.

use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_motordriver::{BusConfig, BusTopology, Generation};

use super::harness::{Harness, millis, with_clocks};

/// Bytes, motor positions and diagnostics of a run.
type Trajectory = (Vec<(SimTime, usize, Vec<u8>)>, Vec<f64>, Vec<(String, f64)>);

fn continue_run(harness: &mut Harness) -> Trajectory {
    harness.passed = Some(Vec::new());
    let end = harness.now() + millis(12);
    let wave = |now: SimTime| [0.2 * libm::sin(40.0 * now.as_secs_f64()); 8];
    harness.run_cycles(millis(2), end, wave).unwrap();
    let passed = harness.passed.take().unwrap();
    (passed, harness.plant.outputs.clone(), harness.diagnostics())
}

fn config(topology: BusTopology, generation: Generation) -> BusConfig {
    let config = BusConfig {
        topology,
        trace: true,
        ..BusConfig::default()
    };
    let phases = [10, 300, 500, 990].map(SimDuration::from_micros);
    let mut config = with_clocks(config, [900_000, -20_000, 0, 40_000], phases);
    for board in &mut config.boards {
        board.firmware.generation = generation;
    }
    config
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn restored_bus_continues_byte_for_byte(
        micros in 0_u64..4_000,
        opened in any::<bool>(),
        direct in any::<bool>(),
        first in any::<bool>(),
    ) {
        let topology = if direct { BusTopology::Direct } else { BusConfig::default().topology };
        let generation = if first && direct { Generation::First } else { Generation::LowLatency };
        let config = config(topology, generation);
        let mut harness = Harness::new(&config);
        if opened {
            harness.open().unwrap();
            let end = harness.now() + millis(10);
            harness.run_cycles(millis(2), end, |_| [0.1; 8]).unwrap();
        } else {
            // During the first requests.
            let _ = harness.open_until(SimTime::ZERO);
        }
        let until = harness.now() + SimDuration::from_micros(micros);
        harness.run_until(until).unwrap();
        let saved = harness.save();
        let mut other = Harness::new(&config);
        other.restore(&saved);
        prop_assert!(other.save() == saved);
        if opened {
            prop_assert_eq!(continue_run(&mut other), continue_run(&mut harness));
        } else {
            let end = SimTime::ZERO + millis(700);
            harness.run_until_idle(end).unwrap();
            other.run_until_idle(end).unwrap();
            prop_assert!(harness.save() == other.save());
        }
    }
}

#[test]
fn snapshot_of_another_bus_is_rejected() {
    let saved = Harness::new(&BusConfig::default()).save();
    let other = BusConfig {
        name: "other".into(),
        ..BusConfig::default()
    };
    assert!(Harness::new(&other).try_restore(&saved).is_err());
}
