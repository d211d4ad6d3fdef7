//! The laws of the driver and two boards on SBCP.

use std::time::Duration;

use twinrig_kernel::{Port, SimDuration, Unit};
use twinrig_motordriver::{Bus, BusConfig, BusTopology, MotorBoard, MotorDriver};
use twinrig_testing::laws::{Detection, DeviceSetup, Traffic};

/// Length of a reply with measurements \[bytes\].
const REPLY: usize = 32;
const PERIOD: SimDuration = SimDuration::from_millis(4);

fn config() -> BusConfig {
    let mut config = BusConfig {
        topology: BusTopology::Direct,
        ..BusConfig::default()
    };
    config.boards.truncate(2);
    config.session.period = Duration::from_millis(4);
    config.session.error_threshold = -1;
    config
}

fn setup() -> DeviceSetup<MotorDriver> {
    let config = config();
    let ports = config.boards.iter().flat_map(|board| {
        let of = |what: &str| format!("leg/{}/{what}", board.name);
        let motors = ["hip", "knee"].into_iter().flat_map(move |joint| {
            let of = |what: &str| of(&format!("{joint}/{what}"));
            [
                Port::input(of("voltage"), Unit::Volt, 1),
                Port::input(of("bridge"), Unit::One, 1),
                Port::output(of("position"), Unit::Radian, 1),
            ]
        });
        let of = |what: &str| format!("leg/{}/{what}", board.name);
        let sensors = [
            Port::output(of("angles"), Unit::Radian, 3),
            Port::output(of("foot/force"), Unit::Newton, 3),
        ];
        motors.chain(sensors)
    });
    let (ports, byte_time) = (ports.collect(), config.byte_time);
    let emulated = config.clone();
    let nodes = move || {
        let boards = emulated.boards.iter().map(|board| {
            let node = MotorBoard::new("sbcp", board).unwrap();
            Box::new(node.with_bytewise_reception(true)) as _
        });
        boards.collect()
    };
    DeviceSetup::new(
        byte_time,
        ports,
        move || Bus::driver(&config).unwrap(),
        nodes,
    )
    .with_levels(|level, component| 0.05 * level as f64 + 0.01 * component as f64)
    .with_commands(|transfer, joint| 0.01 * (transfer + joint) as f64)
    .with_period(PERIOD)
    .with_deadline(SimDuration::from_secs(8))
    .with_detection(Detection::WrongBits, REPLY)
    .with_traffic(|driver, _| {
        let discarded = ["garbage", "damaged", "strays"];
        Traffic::of_diagnostics(driver, [&["answers"], &["errors"], &discarded[..]])
    })
}

// Not `cuts_change_nothing`: a packet behind a damaged answer, which ends the wait, is counted as a
// stray if both are received in one piece, as bytes of garbage if not.
twinrig_testing::laws!(
    setup();
    values_were_sent, traffic_adds_up, looks_change_nothing, restores_in_mid_frame, recovers,
    queues_stay_bounded, meets_the_deadline
);
