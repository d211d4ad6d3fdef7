//! The laws of driver and board.

use twinrig_kernel::{Port, SimDuration, Unit};
use twinrig_testing::laws::DeviceSetup;

use super::wired::board;
use crate::rb110::Rb110Driver;
use crate::tests::under_laws;

fn setup() -> DeviceSetup<Rb110Driver> {
    let board = board();
    let servos = board.servos.iter();
    let mut ports: Vec<Port> = servos
        .map(|servo| Port::input(&servo.command, Unit::Radian, 1))
        .collect();
    ports.push(Port::output("battery", Unit::Volt, 1));
    under_laws(board, ports)
        .with_levels(|level, _| 8.0 + 0.5 * level as f64)
        .with_commands(|transfer, servo| 0.005 * (transfer + servo) as f64)
        .with_deadline(SimDuration::from_millis(300))
}

twinrig_testing::laws!(setup());
