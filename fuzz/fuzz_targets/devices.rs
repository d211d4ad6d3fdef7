//! Drivers of all devices but the boards of SBCP under arbitrary bytes, in arbitrary pieces and at
//! arbitrary times: no panic, and no endless sequence of time-outs in the past.

#![no_main]

use libfuzzer_sys::fuzz_target;
use twinrig_kernel::HostTime;
use twinrig_tactile::Tactile;

fuzz_target!(|data: &[u8]| {
    let mut drivers = twinrig_devices::drivers().unwrap();
    drivers.push(Box::new(Tactile::new("tactile", "force").driver().unwrap()));
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
