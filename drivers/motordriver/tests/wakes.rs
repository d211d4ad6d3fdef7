//! How often a running bus is woken: work is counted, not timed.

mod common;

use common::{Bench, at_ms, millis};
use twinrig_kernel::SimDuration;
use twinrig_motordriver::{BusConfig, BusTopology};

#[test]
#[ignore]
fn trace() {
    let mut bench = Bench::new(&BusConfig::default());
    bench.open().unwrap();
    let end = bench.now() + SimDuration::from_secs(1);
    bench.run_cycles(millis(2), end, |_| [0.1; 8]).unwrap();
    bench.passed = Some(vec![]);
    let start = bench.now();
    bench.begin(&[0.1; 8]).unwrap();
    let mut last = start;
    let mut n = 0;
    while bench.step(start + millis(2)).unwrap() {
        let got = std::mem::take(bench.passed.as_mut().unwrap());
        println!(
            "{} {:?} busy {} passed {:?}",
            n,
            (bench.now() - start).as_nanos() as f64 / 1000.0,
            bench.busy,
            got.iter()
                .map(|(_, l, b)| (*l, b.len()))
                .collect::<Vec<_>>()
        );
        n += 1;
        last = bench.now();
    }
    let _ = (last, at_ms(1), BusTopology::Direct);
}
