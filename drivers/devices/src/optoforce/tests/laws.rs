//! The laws of driver and sensor.

use twinrig_kernel::{Port, SimDuration, Unit};
use twinrig_testing::laws::{Detection, DeviceSetup};

use super::wired::sensor;
use crate::optoforce::OptoForceDriver;
use crate::tests::under_laws;

/// Length of a frame with a sample \[bytes\].
const FRAME: usize = 16;

fn setup() -> DeviceSetup<OptoForceDriver> {
    let port = Port::output("leg/LF/foot/force", Unit::Newton, 3);
    under_laws(sensor(), vec![port])
        .with_levels(|level, axis| 10.0 * level as f64 + axis as f64)
        .with_period(SimDuration::from_millis(4))
        .with_deadline(SimDuration::from_millis(1300))
        .with_detection(Detection::WrongBits, FRAME)
}

twinrig_testing::laws!(setup());
