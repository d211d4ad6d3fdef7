//! A running rig does not allocate.

use crate::toys::{ToyPlant, ToyProcess};
use twinrig_kernel::{Port, SimDuration, SimTime};
use twinrig_runtime::{Change, DirectIo, Plant, Process, ProcessVariable, Rig, Schedule, Timing};

/// Process with the toy plant's own signals.
struct Direct(ToyProcess, Vec<Port>);

impl Process for Direct {
    fn name(&self) -> &'static str {
        "direct process"
    }
    fn ports(&self) -> Vec<Port> {
        self.1.clone()
    }
    fn variables(&self) -> &[ProcessVariable] {
        self.0.variables()
    }
    fn variables_mut(&mut self) -> &mut [ProcessVariable] {
        self.0.variables_mut()
    }
    fn step(&mut self, elapsed: SimDuration, inputs: &[f64], outputs: &mut [f64]) {
        self.0.step(elapsed, inputs, outputs);
    }
}

#[test]
fn running_rig_does_not_allocate() {
    let names: Vec<String> = (0..8).map(|n| format!("toy{n}")).collect();
    let plant = ToyPlant::new(&names);
    let ports: Vec<Port> = plant.ports().iter().map(Port::mirrored).collect();
    let micros = SimDuration::from_micros;
    let transfer = Timing::Uniform {
        min: micros(100),
        max: micros(1_400),
    };
    let io = DirectIo::for_process("direct", &ports, transfer, 1).unwrap();
    let mut schedule = Schedule::with_period(SimDuration::from_millis(1));
    schedule.compute = Timing::Normal {
        mean: micros(300),
        deviation: micros(300),
        min: micros(0),
        max: micros(2_500),
    };
    let process = Direct(ToyProcess::new(&names), ports);
    let mut rig = Rig::new(
        &schedule,
        Box::new(process),
        vec![Box::new(io)],
        Box::new(plant),
    )
    .unwrap();
    let at = |millis| SimTime::ZERO + SimDuration::from_millis(millis);
    rig.schedule(at(500), "offset", Change::By(0.1)).unwrap();
    rig.run_until(at(10), &mut ()).unwrap();
    let allocations = allocation_counter::measure(|| rig.run_until(at(2_000), &mut ()).unwrap());
    assert_eq!(allocations.count_total, 0);
    assert!(rig.plant().work().steps > 2_000);

    // The counter itself works.
    assert!(allocation_counter::measure(|| drop(rig.save())).count_total > 0);
}
