//! The plant is advanced to exactly the instants at which it is sampled, actuated or observed, and
//! to no others.

use std::sync::{Arc, Mutex};

use proptest::prelude::*;
use twinrig_kernel::{Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{
    DirectIo, Group, Observer, Plant, PlantFault, Process, Rig, RunEvent, Schedule, Timing,
};

/// Plant whose output is its time; records each advance with its command.
#[derive(Default)]
struct ClockPlant {
    now: SimTime,
    windows: f64,
    advances: Arc<Mutex<Vec<(SimTime, f64)>>>,
}

fn nanos(time: SimTime) -> f64 {
    time.since_start().as_nanos() as f64
}

impl Plant for ClockPlant {
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
        self.advances.lock().unwrap().push((to, inputs[0]));
        Ok(())
    }
    fn observe(&mut self, outputs: &mut [f64]) {
        outputs.copy_from_slice(&[self.windows, nanos(self.now)]);
    }
    fn begin_window(&mut self) {
        self.windows += 1.0;
    }
}

/// Process that counts its iterations, and reads the clock.
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
}

#[derive(Default)]
struct RunLog {
    observed: Vec<(SimTime, f64, f64)>,
    read: Vec<f64>,
    begun: Vec<SimTime>,
    ended: Vec<SimTime>,
}

impl Observer for RunLog {
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
    fn plant_is_advanced_to_the_instants_of_access_only(
        period in 100_u64..2_000, observe in 100_u64..2_000, shortest in 0_u64..500, spread in 0_u64..3_000,
        compute in 0_u64..3_000, seed in any::<u64>(),
    ) {
        let micros = SimDuration::from_micros;
        let transfer = Timing::Uniform { min: micros(shortest), max: micros(shortest + spread) };
        let io = DirectIo::for_process("direct", &Counter(0.0).ports(), transfer, seed).unwrap();
        let mut schedule = Schedule::with_period(micros(period));
        schedule.observe = micros(observe);
        schedule.compute = Timing::Uniform { min: micros(0), max: micros(compute) };
        let plant = ClockPlant::default();
        let advances = plant.advances.clone();
        let mut rig = Rig::new(&schedule, Box::new(Counter(0.0)), vec![Box::new(io)], Box::new(plant)).unwrap();
        let mut log = RunLog::default();
        rig.run_until(SimTime::ZERO + micros(40_000), &mut log).unwrap();

        // The clock is read at half of each transfer; the process reads one of these values.
        let exchange_times: Vec<SimTime> =
            log.begun.iter().zip(&log.ended).map(|(from, to)| *from + (*to - *from) / 2).collect();
        let clock_readings: Vec<f64> = exchange_times.iter().copied().map(nanos).collect();
        for read in &log.read[1..] {
            prop_assert!(*read == 0.0 || clock_readings.contains(read), "{read} ns is not an instant of exchange");
        }

        // Observations contain their own time, and the number of earlier windows.
        for (n, (at, windows, now)) in log.observed.iter().enumerate() {
            prop_assert_eq!((*windows, *now), (n as f64, nanos(*at)));
            prop_assert_eq!(*at, SimTime::ZERO + micros(observe) * n as u64);
        }

        // The plant was advanced to these instants and no others, each interval under the command
        // of the last exchange before its end.
        let mut instants: Vec<SimTime> = exchange_times.iter().copied().chain(log.observed.iter().map(|o| o.0)).collect();
        instants.sort_unstable();
        instants.dedup();
        let advances = advances.lock().unwrap();
        // The last transfer may still be in progress, before or after its exchange.
        let certain = log.ended.last().copied().unwrap_or_default();
        let advanced: Vec<SimTime> = advances.iter().map(|m| m.0).filter(|at| *at <= certain).collect();
        let expected: Vec<SimTime> =
            instants.into_iter().filter(|at| *at > SimTime::ZERO && *at <= certain).collect();
        prop_assert_eq!(advanced, expected);
        // Transfers carry increasing counts; before the first exchange the command is zero.
        for (to, command) in advances.iter().filter(|m| m.0 <= certain) {
            let exchanges_before = exchange_times.iter().filter(|at| *at < to).count();
            prop_assert_eq!(*command == 0.0, exchanges_before == 0);
        }
        prop_assert!(advances.windows(2).all(|pair| pair[0].1 <= pair[1].1));
    }
}
