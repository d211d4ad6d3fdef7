//! Cost of a millisecond of the bench, with and without its sensor.

use divan::Bencher;
use twinrig_bench::{Bench, BenchFile, BenchSettings, LOAD, STEP};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::Plant;
use twinrig_sensor::{SensedPlant, TactileParameters};

const MILLISECONDS: u32 = 1_000;

fn main() {
    divan::main();
}

fn turn(bencher: Bencher<'_, '_>, build: impl Fn() -> Box<dyn Plant> + Sync) {
    let bencher = bencher.counter(divan::counter::ItemsCount::new(MILLISECONDS));
    bencher.with_inputs(&build).bench_local_values(|mut plant| {
        let mut now = SimTime::ZERO;
        let mut outputs = vec![0.0; plant.ports().len() - 2];
        for _ in 0..MILLISECONDS {
            now += SimDuration::from_millis(1);
            plant.advance(now, &[5.0, 1.0]).expect("the bench runs");
            plant.observe(&mut outputs);
        }
        outputs
    });
}

fn bench() -> (Bench, TactileParameters) {
    let file = BenchFile::find("tactile", "".as_ref()).expect("it reads");
    let file = file.expect("it is embedded");
    let parameters = file.bench(&BenchSettings::default()).expect("it is valid");
    let bench = Bench::new(&parameters, STEP, 1, &|name| name == LOAD);
    (bench.expect("it is built"), parameters.sensor)
}

#[divan::bench]
fn plant(bencher: Bencher<'_, '_>) {
    turn(bencher, || Box::new(bench().0));
}

#[divan::bench]
fn plant_and_sensor(bencher: Bencher<'_, '_>) {
    turn(bencher, || {
        let (bench, sensor) = bench();
        let sensors = [(LOAD.to_owned(), sensor)];
        let plant = SensedPlant::new(Box::new(bench), &sensors, &|_| true);
        Box::new(plant.expect("it has a load"))
    });
}
