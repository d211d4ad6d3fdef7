//! The laws of driver and board.

use twinrig_kernel::{Port, SimDuration, Unit};
use twinrig_runtime::Timing;
use twinrig_tactile::{CHANNELS, Tactile, TactileDriver};
use twinrig_testing::laws::DeviceSetup;

const PERIOD: SimDuration = SimDuration::from_millis(4);

/// The bench without noise, whose values are those of the plant.
fn tactile() -> Tactile {
    let mut tactile = Tactile::new("tactile", "bench/force");
    tactile.noise = [0.0; 3];
    tactile.jitter = Timing::Constant(SimDuration::ZERO);
    tactile
}

fn setup() -> DeviceSetup<TactileDriver> {
    let units = [Unit::Volt, Unit::Volt, Unit::Newton];
    let channels = CHANNELS.iter().zip(units);
    let ports = channels.map(|(name, unit)| Port::output(format!("bench/force/{name}"), unit, 1));
    let byte_time = SimDuration::from_nanos(10_851);
    let nodes = || vec![Box::new(tactile().board().unwrap()) as _];
    DeviceSetup::new(
        byte_time,
        ports.collect(),
        || tactile().driver().unwrap(),
        nodes,
    )
    .with_levels(|level, channel| 0.1 * level as f64 + 0.01 * channel as f64)
    .with_period(PERIOD)
    .with_numbered_answers()
}

twinrig_testing::laws!(setup());
