//! The plant is moved to exactly the instants at which something acts on it or looks at it, and to no
//! others.

use std::sync::{Arc, Mutex};

use proptest::prelude::*;
use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{
    DirectIo, EnergyBalance, Group, Observer, Plant, PlantFault, Process, Rig, RunEvent, Schedule,
    Timing, WorkCounts,
};

/// A plant that is a clock, and writes down where it was moved to under which command.
#[derive(Default)]
struct Clock {
    now: SimTime,
    windows: f64,
    moves: Arc<Mutex<Vec<(SimTime, f64)>>>,
}

fn nanos(time: SimTime) -> f64 {
    time.since_start().as_nanos() as f64
}

impl Plant for Clock {
    fn name(&self) -> &'static str {
        "clock"
    }
    fn ports(&self) -> Vec<Port> {
        vec![
            Port::input("count", Unit::One, 1),
            Port::output("windows", Unit::One, 1),
            Port::output("now", Unit::Second, 1),
        ]
    }
    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        assert!(to > self.now);
        self.now = to;
        self.moves.lock().unwrap().push((to, inputs[0]));
        Ok(())
    }
    fn observe(&mut self, outputs: &mut [f64]) {
        outputs.copy_from_slice(&[self.windows, nanos(self.now)]);
    }
    fn begin_window(&mut self) {
        self.windows += 1.0;
    }
    fn energy(&self) -> EnergyBalance {
        EnergyBalance::default()
    }
    fn work(&self) -> WorkCounts {
        WorkCounts::default()
    }
    fn save(&self) -> Snapshot {
        Snapshot::default()
    }
    fn restore(&mut self, _: &Snapshot) -> Result<(), SnapshotError> {
        Ok(())
    }
}

/// Counts its iterations, and reads the clock.
struct Counter(f64);

impl Process for Counter {
    fn name(&self) -> &'static str {
        "counter"
    }
    fn ports(&self) -> Vec<Port> {
        vec![
            Port::output("count", Unit::One, 1),
            Port::input("now", Unit::Second, 1),
        ]
    }
    fn step(&mut self, _: SimDuration, _: &[f64], outputs: &mut [f64]) {
        self.0 += 1.0;
        outputs[0] = self.0;
    }
    fn save(&self) -> Snapshot {
        Snapshot::default()
    }
    fn restore(&mut self, _: &Snapshot) -> Result<(), SnapshotError> {
        Ok(())
    }
}

#[derive(Default)]
struct Seen {
    observed: Vec<(SimTime, f64, f64)>,
    read: Vec<f64>,
    begun: Vec<SimTime>,
    ended: Vec<SimTime>,
}

impl Observer for Seen {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        match group {
            Group::Plant => self.observed.push((now, values[0], values[1])),
            Group::ProcessInputs => self.read.push(values[0]),
            Group::ProcessOutputs | Group::Diagnostics => {}
        }
    }
    fn event(&mut self, now: SimTime, event: RunEvent) {
        match event {
            RunEvent::TaskBegin { .. } => self.begun.push(now),
            RunEvent::TaskEnd { .. } => self.ended.push(now),
            _ => {}
        }
    }
}

proptest! {
    #[test]
    fn the_plant_goes_exactly_to_where_it_is_needed(
        period in 100_u64..2_000, observe in 100_u64..2_000, shortest in 0_u64..500, spread in 0_u64..3_000,
        compute in 0_u64..3_000, seed in any::<u64>(),
    ) {
        let micros = SimDuration::from_micros;
        let transfer = Timing::Uniform { min: micros(shortest), max: micros(shortest + spread) };
        let io = DirectIo::for_process("direct", &Counter(0.0).ports(), transfer, seed).unwrap();
        let mut schedule = Schedule::with_period(micros(period));
        schedule.observe = micros(observe);
        schedule.compute = Timing::Uniform { min: micros(0), max: micros(compute) };
        let plant = Clock::default();
        let moves = plant.moves.clone();
        let mut rig = Rig::new(&schedule, Box::new(Counter(0.0)), vec![Box::new(io)], Box::new(plant)).unwrap();
        let mut seen = Seen::default();
        rig.run_until(SimTime::ZERO + micros(40_000), &mut seen).unwrap();

        // Half-way through each transfer the clock was read; what the process reads is one of those.
        let halves: Vec<SimTime> =
            seen.begun.iter().zip(&seen.ended).map(|(from, to)| *from + (*to - *from) / 2).collect();
        let brought: Vec<f64> = halves.iter().copied().map(nanos).collect();
        for read in &seen.read[1..] {
            prop_assert!(*read == 0.0 || brought.contains(read), "{read} ns was no instant of exchange");
        }

        // Observations see their own instant, and how often the grid was passed before.
        for (n, (at, windows, now)) in seen.observed.iter().enumerate() {
            prop_assert_eq!((*windows, *now), (n as f64, nanos(*at)));
            prop_assert_eq!(*at, SimTime::ZERO + micros(observe) * n as u64);
        }

        // It went to these instants and no others, each stretch under the command that held in it: that
        // of the last exchange before its end.
        let mut instants: Vec<SimTime> = halves.iter().copied().chain(seen.observed.iter().map(|o| o.0)).collect();
        instants.sort_unstable();
        instants.dedup();
        let moves = moves.lock().unwrap();
        // The last transfer may still be under way, its exchange past or not.
        let certain = seen.ended.last().copied().unwrap_or_default();
        let moved: Vec<SimTime> = moves.iter().map(|m| m.0).filter(|at| *at <= certain).collect();
        let expected: Vec<SimTime> =
            instants.into_iter().filter(|at| *at > SimTime::ZERO && *at <= certain).collect();
        prop_assert_eq!(moved, expected);
        // Transfers carry increasing counts; before the first exchange the command is zero.
        for (to, command) in moves.iter().filter(|m| m.0 <= certain) {
            let exchanges_before = halves.iter().filter(|half| *half < to).count();
            prop_assert_eq!(*command == 0.0, exchanges_before == 0);
        }
        prop_assert!(moves.windows(2).all(|pair| pair[0].1 <= pair[1].1));
    }
}
