//! Speed of the servo bench: a simulated second of commands every 5 ms.

use divan::{Bencher, black_box};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::Plant;
use twinrig_servo::{ServoBench, ServoBenchFile, ServoBenchParameters};

fn main() {
    divan::main();
}

fn parameters() -> ServoBenchParameters {
    let file = ServoBenchFile::find("xl330", "".as_ref()).expect("a file");
    file.expect("a bench").bench().expect("sound")
}

#[divan::bench]
fn second(bencher: Bencher) {
    let parameters = parameters();
    bencher.bench(|| {
        let bench = ServoBench::new(black_box(&parameters), &|name| name == "servo/reading");
        let mut bench = bench.expect("a bench");
        let mut reading = [0.0];
        for step in 1..=200_u32 {
            let to = SimTime::ZERO + SimDuration::from_micros(5_000 * u64::from(step));
            let goal = 1.5 * libm::sin(f64::from(step) * 0.03);
            bench.advance(to, &[goal, 1.0]).expect("a motion");
            bench.observe(&mut reading);
        }
        reading
    });
}
