//! Drivers of servo board, force sensor, bridge, interface kit and acquisition board under
//! arbitrary bytes, in arbitrary pieces and at arbitrary times: no panic, and no endless sequence
//! of time-outs in the past.

#![no_main]

use libfuzzer_sys::fuzz_target;
use twinrig_kernel::HostTime;
use twinrig_devices::optoforce::{OptoForce, SampleChoice};
use twinrig_devices::phidget::{Board, Phidget};
use twinrig_devices::rb110::{AnalogInput, PulseMap, Rb110};
use twinrig_runtime::Driver;
use twinrig_tactile::Tactile;

fn drivers() -> Option<[Box<dyn Driver>; 5]> {
    let mut servos = Rb110::with_servos("rb110", PulseMap::ONCILLA, &[(15, "LF")]);
    servos.analog = vec![AnalogInput {
        channel: 3,
        analog_source: None,
    }];
    let mut sensor = OptoForce::new("optoforce", "force");
    sensor.take = SampleChoice::Fresh;
    Some([
        Box::new(servos.driver().ok()?),
        Box::new(sensor.driver().ok()?),
        Box::new(Phidget::new("bridge", Board::default()).driver().ok()?),
        Box::new(Phidget::new("kit", Board::INTERFACE_KIT).driver().ok()?),
        Box::new(Tactile::new("tactile", "force").driver().ok()?),
    ])
}

fuzz_target!(|data: &[u8]| {
    let Some(mut drivers) = drivers() else {
        return;
    };
    let mut transmitted = Vec::new();
    for driver in &mut drivers {
        let mut data = data;
        let mut now = HostTime::from_nanos(0);
        driver.open(now);
        while let Some((&[length, pause_ms], rest)) = data.split_first_chunk() {
            let (bytes, remaining) = rest.split_at(rest.len().min(usize::from(length)));
            data = remaining;
            now = HostTime::from_nanos(now.as_nanos() + 1_000_000 * u64::from(pause_ms));
            driver.handle_bytes(now, bytes);
            let mut woken = 0;
            while driver.poll_timeout().is_some_and(|at| at <= now) {
                driver.handle_timeout(now);
                woken += 1;
                assert!(
                    woken < 10,
                    "{} sets time-outs in the past without end",
                    driver.name()
                );
            }
            while driver.poll_transmit(&mut transmitted) {}
            if driver.is_busy() == Ok(false) {
                driver.begin(now, &[0.1]);
            }
            assert!(driver.to_process().iter().all(|value| value.is_finite()));
        }
        driver.close(now);
    }
});
