use std::sync::{Arc, Mutex};

use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{Change, IoTask, Rig, Schedule, Timing};

use super::{Log, ToyPlant, ToyProcess, ToyTask, WireTransfer};

/// Specification of a rig of toys, built as often as a test requires.
#[derive(Clone, Debug)]
pub struct Fixture {
    pub schedule: Schedule,
    /// Maximum delay between two chunks of each task.
    pub delays: Vec<SimDuration>,
    /// Order of registration of the tasks.
    pub order: Vec<usize>,
    pub changes: Vec<(SimTime, Change)>,
    pub duration: SimTime,
}

/// A finished run.
pub struct Run {
    pub rig: Rig,
    pub log: Log,
    /// Bytes of each task's wire, in the order of the tasks' names.
    pub wires: Vec<Vec<WireTransfer>>,
}

type Wires = Vec<Arc<Mutex<Vec<WireTransfer>>>>;

impl Fixture {
    pub fn names(&self) -> Vec<String> {
        (0..self.delays.len()).map(|n| format!("toy{n}")).collect()
    }

    /// Builds a rig; returns it with the wires of its tasks, in the order of their names.
    pub fn build(&self) -> (Rig, Wires) {
        let names = self.names();
        let mut wires: Wires = vec![Arc::default(); names.len()];
        let mut tasks: Vec<Box<dyn IoTask>> = Vec::new();
        for &n in &self.order {
            let task = ToyTask::new(&names[n], self.schedule.seed, self.delays[n]);
            wires[n] = task.wire.clone();
            tasks.push(Box::new(task));
        }
        let (process, plant) = (ToyProcess::new(&names), ToyPlant::new(&names));
        let mut rig = Rig::new(&self.schedule, Box::new(process), tasks, Box::new(plant)).unwrap();
        for (at, change) in &self.changes {
            rig.schedule(*at, "offset", *change).unwrap();
        }
        (rig, wires)
    }

    pub fn run(&self) -> Run {
        let (mut rig, wires) = self.build();
        let mut log = Log::default();
        rig.run_until(self.duration, &mut log).unwrap();
        let wires = wires
            .iter()
            .map(|wire| wire.lock().unwrap().clone())
            .collect();
        Run { rig, log, wires }
    }
}

fn micros(range: std::ops::RangeInclusive<u64>) -> impl Strategy<Value = SimDuration> {
    range.prop_map(SimDuration::from_micros)
}

/// Compute times from zero to several periods (periods are 100 to 900 µs).
fn any_compute() -> impl Strategy<Value = Timing> {
    let two = (micros(0..=400), micros(0..=2_000));
    prop_oneof![
        Just(Timing::ZERO),
        micros(0..=2_000).prop_map(Timing::Constant),
        two.prop_map(|(min, width)| Timing::Uniform {
            min,
            max: min + width
        }),
        (micros(0..=400), micros(0..=500)).prop_map(|(mean, deviation)| {
            Timing::Normal {
                mean,
                deviation,
                min: SimDuration::ZERO,
                max: SimDuration::from_millis(2),
            }
        }),
        prop::collection::vec(micros(0..=1_000), 1..6).prop_map(Timing::Trace),
    ]
}

/// Rigs of one to four tasks, fast and slow, with processes in time and late. All times are random
/// multiples of 1 µs, so that events often coincide.
pub fn any_fixture() -> impl Strategy<Value = Fixture> {
    let schedule = (
        micros(100..=300),
        1_u64..=3,
        micros(50..=1_000),
        any_compute(),
        any::<u64>(),
    );
    let delays =
        prop::collection::vec(prop_oneof![Just(SimDuration::ZERO), micros(0..=700)], 1..=4);
    let change = (0_u64..20_000, -1.0..1.0_f64, any::<bool>());
    (schedule, delays, prop::collection::vec(change, 0..4)).prop_map(
        |(schedule, delays, changes)| {
            let (step, every, observe, compute, seed) = schedule;
            Fixture {
                schedule: Schedule {
                    step,
                    every,
                    observe,
                    compute,
                    seed,
                    events_max: 1_000,
                },
                order: (0..delays.len()).collect(),
                delays,
                changes: changes
                    .into_iter()
                    .map(|(at, value, to)| {
                        let at = SimTime::ZERO + SimDuration::from_micros(at);
                        (
                            at,
                            if to {
                                Change::To(value)
                            } else {
                                Change::By(value)
                            },
                        )
                    })
                    .collect(),
                duration: SimTime::ZERO + SimDuration::from_millis(20),
            }
        },
    )
}
