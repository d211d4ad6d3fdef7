//! The laws of driver and boards.

use twinrig_kernel::{Port, SimDuration, Unit};
use twinrig_testing::laws::DeviceSetup;

use super::wired;
use crate::phidget::{Phidget, PhidgetDriver};
use crate::tests::under_laws;

fn setup(board: Phidget) -> DeviceSetup<PhidgetDriver> {
    let port = Port::output("leg/LF/foot/force", Unit::Newton, 3);
    under_laws(board, vec![port])
        .with_levels(|level, axis| 5.0 * level as f64 + axis as f64)
        .with_period(SimDuration::from_millis(16))
        .with_deadline(SimDuration::from_millis(1300))
}

mod bridge {
    twinrig_testing::laws!(super::setup(super::wired::bridge(8)));
}

mod kit {
    twinrig_testing::laws!(super::setup(super::wired::kit()));
}
