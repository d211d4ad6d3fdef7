//! The recorder allocates when a chunk is closed, not per sample.

use super::common::*;
use twinrig_kernel::{Direction, Layout, SimTime};
use twinrig_record::{Cadence, Fingerprint, RecordedGroup, Recorder};
use twinrig_runtime::{Group, Observer};

#[test]
fn allocations_per_second_are_those_of_a_chunk() {
    let layout = Layout::of(&plant_ports(), Direction::Output);
    let group = RecordedGroup {
        group: Group::Plant,
        layout: &layout,
        keep: &|_| true,
    };
    let cadence = Cadence::default();
    let mut recorder =
        Recorder::new(std::io::sink(), &info(), &[group], &skeleton(), cadence).unwrap();
    let mut fingerprint = Fingerprint::new();
    let values = plant_values(3);
    let mut step = 0;
    let mut seconds = |count: u64| {
        for _ in 0..500 * count {
            let now = SimTime::from_nanos(step * PERIOD_NS);
            recorder.samples(now, Group::Plant, &values);
            fingerprint.samples(now, Group::Plant, &values);
            step += 1;
        }
    };
    seconds(10); // buffers reach their final size
    let measured = allocation_counter::measure(|| seconds(100));
    let per_second = measured.count_total / 100;
    assert!(
        per_second < 20,
        "{per_second} allocations for 500 samples, 50 frames and a chunk"
    );
}
