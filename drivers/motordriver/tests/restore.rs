//! A bus that is saved and restored goes the same way, at whatever instant that is.

mod common;

use common::{Bench, millis, with_clocks};
use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_motordriver::{BusConfig, BusTopology, Generation};

/// What happens from now on: bytes, motors, counters.
type Story = (Vec<(SimTime, usize, Vec<u8>)>, Vec<f64>, Vec<(String, f64)>);

fn go_on(bench: &mut Bench) -> Story {
    bench.passed = Some(Vec::new());
    let end = bench.now() + millis(12);
    let wave = |now: SimTime| [0.2 * libm::sin(40.0 * now.as_secs_f64()); 8];
    bench.run_cycles(millis(2), end, wave).unwrap();
    let passed = bench.passed.take().unwrap();
    (passed, bench.plant.outputs.clone(), bench.diagnostics())
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
    fn a_restored_bus_exchanges_the_same_bytes(
        micros in 0_u64..4_000,
        opened in any::<bool>(),
        direct in any::<bool>(),
        first in any::<bool>(),
    ) {
        let topology = if direct { BusTopology::Direct } else { BusConfig::default().topology };
        let generation = if first && direct { Generation::First } else { Generation::LowLatency };
        let config = config(topology, generation);
        let mut bench = Bench::new(&config);
        if opened {
            bench.open().unwrap();
            let end = bench.now() + millis(10);
            bench.run_cycles(millis(2), end, |_| [0.1; 8]).unwrap();
        } else {
            // Amid the first requests.
            let _ = bench.open_until(SimTime::ZERO);
        }
        let until = bench.now() + SimDuration::from_micros(micros);
        bench.run_until(until).unwrap();
        let saved = bench.save();
        let mut other = Bench::new(&config);
        other.restore(&saved);
        prop_assert!(other.save() == saved);
        if opened {
            prop_assert_eq!(go_on(&mut other), go_on(&mut bench));
        } else {
            let end = SimTime::ZERO + millis(700);
            bench.run_until_idle(end).unwrap();
            other.run_until_idle(end).unwrap();
            prop_assert!(bench.save() == other.save());
        }
    }
}

#[test]
fn a_snapshot_of_another_bus_is_refused() {
    let saved = Bench::new(&BusConfig::default()).save();
    let other = BusConfig {
        name: "other".into(),
        ..BusConfig::default()
    };
    assert!(Bench::new(&other).try_restore(&saved).is_err());
}
