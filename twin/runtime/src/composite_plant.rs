use thiserror::Error;
use twinrig_kernel::{Direction, Layout, Port, SimTime, Snapshot, SnapshotError};

use crate::limit::LimitViolation;
use crate::plant::{EnergyBalance, Plant, PlantEvent, PlantFault, WorkCounts};
use crate::plant_state::PlantState;

/// Two independent plants as one: a robot, and drives that its own plant does not integrate.
///
/// Its ports are those of the first, then those of the second; energies and work are sums, the
/// constraint violation is the larger of both, and events are merged in order of time. Each plant
/// advances exactly as it would without the other, bit for bit.
///
/// If the second plant fails, the first has already completed that step; the plant that is more
/// likely to fail should therefore be the first.
pub struct CompositePlant {
    name: String,
    first: Box<dyn Plant>,
    second: Box<dyn Plant>,
    /// Offsets of the second plant's inputs and outputs.
    inputs: usize,
    outputs: usize,
    /// Number of events of each plant already in `events`.
    merged: [usize; 2],
    events: Vec<PlantEvent>,
}

/// Two plants that cannot be combined: both have a port of the same name.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{first} and {second} cannot be combined: both have a port {port}")]
pub struct NameClash {
    /// Name of the first plant.
    pub first: String,
    /// Name of the second.
    pub second: String,
    /// Name of the port.
    pub port: String,
}

impl CompositePlant {
    /// Combines `first` and `second`.
    ///
    /// # Errors
    /// [`NameClash`] if both have a port of the same name.
    pub fn new(first: Box<dyn Plant>, second: Box<dyn Plant>) -> Result<Self, NameClash> {
        let ports = first.ports();
        let known = |port: &Port| ports.iter().any(|other| other.name == port.name);
        if let Some(port) = second.ports().into_iter().find(known) {
            return Err(NameClash {
                first: first.name().to_owned(),
                second: second.name().to_owned(),
                port: port.name,
            });
        }
        Ok(Self {
            name: format!("{} beside {}", first.name(), second.name()),
            inputs: Layout::of(&ports, Direction::Input).len(),
            outputs: Layout::of(&ports, Direction::Output).len(),
            merged: [first.events().len(), second.events().len()],
            first,
            second,
            events: Vec::new(),
        })
    }

    /// Appends the new events of both plants, in order of time.
    fn merge_events(&mut self) {
        let first_new = self.events.len();
        for (plant, merged) in [&self.first, &self.second]
            .into_iter()
            .zip(&mut self.merged)
        {
            let all = plant.events();
            self.events
                .extend_from_slice(all.get(*merged..).unwrap_or_default());
            *merged = all.len();
        }
        // Stable sort: at equal times, events of the first plant precede those of the second.
        self.events[first_new..].sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    }
}

impl Plant for CompositePlant {
    fn name(&self) -> &str {
        &self.name
    }

    fn ports(&self) -> Vec<Port> {
        let mut ports = self.first.ports();
        ports.extend(self.second.ports());
        ports
    }

    fn initial_inputs(&self, inputs: &mut [f64]) {
        let (first, second) = inputs.split_at_mut(self.inputs);
        self.first.initial_inputs(first);
        self.second.initial_inputs(second);
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        let (first, second) = inputs.split_at(self.inputs);
        let advanced = self.first.advance(to, first);
        let advanced = advanced.and_then(|()| self.second.advance(to, second));
        self.merge_events();
        advanced
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        let (first, second) = outputs.split_at_mut(self.outputs);
        self.first.observe(first);
        self.second.observe(second);
    }

    fn begin_window(&mut self) {
        self.first.begin_window();
        self.second.begin_window();
    }

    fn energy(&self) -> EnergyBalance {
        self.first.energy() + self.second.energy()
    }

    fn work(&self) -> WorkCounts {
        self.first.work() + self.second.work()
    }

    fn constraint_violation(&self) -> Option<f64> {
        let (a, b) = (
            self.first.constraint_violation(),
            self.second.constraint_violation(),
        );
        a.into_iter().chain(b).reduce(f64::max)
    }

    fn limit_violations(&self) -> Vec<LimitViolation> {
        let mut violations = self.first.limit_violations();
        violations.extend(self.second.limit_violations());
        violations
    }

    fn least_substep_s(&self) -> Option<f64> {
        let first = self.first.least_substep_s();
        let both = first.into_iter().chain(self.second.least_substep_s());
        both.reduce(f64::min)
    }

    fn log_events(&mut self, enabled: bool) {
        self.first.log_events(enabled);
        self.second.log_events(enabled);
        self.events.clear();
        self.merged = [self.first.events().len(), self.second.events().len()];
    }

    fn events(&self) -> &[PlantEvent] {
        &self.events
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(self.first.save(), self.second.save()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (first, second): (Snapshot, Snapshot) = snapshot.read()?;
        let before = self.first.save();
        self.first.restore(&first)?;
        if let Err(error) = self.second.restore(&second) {
            self.first.restore(&before)?;
            return Err(error);
        }
        self.merged = [self.first.events().len(), self.second.events().len()];
        Ok(())
    }

    fn state(&self) -> Option<PlantState> {
        let (first, second) = (self.first.state()?, self.second.state()?);
        let both = second.iter();
        Some(both.fold(first, |both, (name, values)| both.with(name, values)))
    }

    fn resume_from(&mut self, from: &PlantState) -> Result<Vec<String>, PlantFault> {
        // Values named in the second plant's state go to it, all others to the first plant, which
        // reports unknown ones.
        let second_state = self.second.state();
        let known = |name: &str| {
            second_state
                .as_ref()
                .is_some_and(|second_state| second_state.get(name).is_some())
        };
        let before = self.first.save();
        let mut lines = self.first.resume_from(&from.only(|name| !known(name)))?;
        match self.second.resume_from(&from.only(known)) {
            Ok(more) => lines.extend(more),
            Err(fault) => {
                // The snapshot is the first plant's own: this restore does not fail.
                let _ = self.first.restore(&before);
                return Err(fault);
            }
        }
        self.events.clear();
        self.merged = [self.first.events().len(), self.second.events().len()];
        Ok(lines)
    }
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::{SimDuration, Unit};

    use super::*;
    use crate::plant::PlantEventKind;

    /// First-order lag in explicit Euler steps, so that other instants give other bits; logs an
    /// event every `period` steps; fails on a NaN command.
    #[derive(Clone)]
    struct Lag {
        name: &'static str,
        value: f64,
        window: f64,
        now: SimTime,
        steps: u64,
        period: u64,
        log: Option<Vec<PlantEvent>>,
    }

    fn lag(name: &'static str, value: f64, period: u64) -> Lag {
        Lag {
            name,
            value,
            window: 0.0,
            now: SimTime::ZERO,
            steps: 0,
            period,
            log: None,
        }
    }

    impl Plant for Lag {
        fn name(&self) -> &str {
            self.name
        }
        fn ports(&self) -> Vec<Port> {
            // An output first, so that indices of inputs and outputs differ.
            vec![
                Port::output(format!("{}/value", self.name), Unit::Volt, 2),
                Port::input(format!("{}/command", self.name), Unit::Volt, 1),
            ]
        }
        fn initial_inputs(&self, inputs: &mut [f64]) {
            inputs.fill(self.value);
        }
        fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
            if inputs[0].is_nan() {
                return Err(PlantFault {
                    time: self.now,
                    part: self.name.to_owned(),
                    energy: self.energy().stored(),
                    why: "NaN command".to_owned(),
                });
            }
            let seconds = (to - self.now).as_secs_f64();
            self.value += 10.0 * seconds * (inputs[0] - self.value);
            self.window += seconds * inputs[0];
            (self.now, self.steps) = (to, self.steps + 1);
            if let Some(log) = &mut self.log
                && self.steps.is_multiple_of(self.period)
            {
                log.push(PlantEvent {
                    at_s: to.as_secs_f64() - 1e-4 * self.period as f64,
                    part: self.name.to_owned(),
                    kind: PlantEventKind::Reached,
                });
            }
            Ok(())
        }
        fn observe(&mut self, outputs: &mut [f64]) {
            outputs.copy_from_slice(&[self.value, self.window]);
        }
        fn begin_window(&mut self) {
            self.window = 0.0;
        }
        fn energy(&self) -> EnergyBalance {
            EnergyBalance {
                kinetic: self.value * self.value,
                residual: 0.25,
                ..EnergyBalance::default()
            }
        }
        fn work(&self) -> WorkCounts {
            WorkCounts::of_steps(self.steps)
        }
        fn constraint_violation(&self) -> Option<f64> {
            (self.period > 1).then_some(self.value.abs())
        }
        fn log_events(&mut self, enabled: bool) {
            self.log = enabled.then(Vec::new);
        }
        fn events(&self) -> &[PlantEvent] {
            self.log.as_deref().unwrap_or_default()
        }
        fn save(&self) -> Snapshot {
            Snapshot::of(&(
                self.name.to_owned(),
                self.value,
                self.window,
                self.now,
                self.steps,
            ))
        }
        fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
            let (name, value, window, now, steps): (String, _, _, _, _) = snapshot.read()?;
            if name != self.name {
                return Err(SnapshotError::Mismatch {
                    expected: self.name.to_owned(),
                    found: name,
                });
            }
            (self.value, self.window, self.now, self.steps) = (value, window, now, steps);
            Ok(())
        }
    }

    fn pair() -> (Lag, Lag, CompositePlant) {
        let (one, two) = (lag("one", 1.0, 2), lag("two", -3.0, 3));
        let composite = CompositePlant::new(Box::new(one.clone()), Box::new(two.clone())).unwrap();
        (one, two, composite)
    }

    fn at(ms: u64) -> SimTime {
        SimTime::ZERO + SimDuration::from_millis(ms)
    }

    #[test]
    fn composite_equals_its_parts_bit_for_bit() {
        let (mut one, mut two, mut composite) = pair();
        assert_eq!(composite.name(), "one beside two");
        let ports = [one.ports(), two.ports()].concat();
        assert_eq!(composite.ports(), ports);
        let mut inputs = [0.0; 2];
        composite.initial_inputs(&mut inputs);
        assert_eq!(inputs, [1.0, -3.0]);
        for step in 1..50_u64 {
            let (now, inputs) = (at(step * (step % 5 + 5)), [step as f64, 0.5]);
            if now <= one.now {
                continue;
            }
            composite.advance(now, &inputs).unwrap();
            one.advance(now, &inputs[..1]).unwrap();
            two.advance(now, &inputs[1..]).unwrap();
            let (mut combined, mut separate) = ([0.0; 4], [0.0; 4]);
            composite.observe(&mut combined);
            one.observe(&mut separate[..2]);
            two.observe(&mut separate[2..]);
            assert_eq!(combined, separate);
            if step % 7 == 0 {
                composite.begin_window();
                one.begin_window();
                two.begin_window();
            }
        }
        assert_eq!(
            composite.energy().kinetic,
            one.energy().kinetic + two.energy().kinetic
        );
        assert_eq!(composite.energy().residual, 0.5);
        assert_eq!(composite.work().steps, 2 * one.steps);
        assert_eq!(
            composite.constraint_violation(),
            Some(one.value.abs().max(two.value.abs()))
        );
    }

    #[test]
    fn events_of_both_plants_are_merged_in_order_of_time() {
        let (_, _, mut composite) = pair();
        composite.advance(at(1), &[0.0; 2]).unwrap();
        composite.advance(at(2), &[0.0; 2]).unwrap();
        assert!(composite.events().is_empty());
        composite.log_events(true);
        for ms in 3..=12 {
            composite.advance(at(ms), &[0.0; 2]).unwrap();
        }
        let parts: Vec<&str> = composite
            .events()
            .iter()
            .map(|event| event.part.as_str())
            .collect();
        // Events of `two` at 3 − 0.3 ms, of `one` at 4 − 0.2 ms, both at 6 ms: that of `two` is
        // earlier.
        assert_eq!(
            parts,
            [
                "two", "one", "two", "one", "one", "two", "one", "two", "one"
            ]
        );
        assert!(composite.events().is_sorted_by(|a, b| a.at_s <= b.at_s));
        composite.log_events(true);
        assert!(composite.events().is_empty());
    }

    #[test]
    fn restore_is_exact_and_a_foreign_snapshot_changes_nothing() {
        let (_, _, mut composite) = pair();
        composite.advance(at(4), &[2.0, 3.0]).unwrap();
        let saved = composite.save();
        composite.advance(at(9), &[1.0, 1.0]).unwrap();
        let ahead = composite.save();
        composite.restore(&saved).unwrap();
        composite.advance(at(9), &[1.0, 1.0]).unwrap();
        assert_eq!(composite.save(), ahead);
        let three = lag("three", 0.0, 1);
        let others = CompositePlant::new(Box::new(lag("one", 5.0, 2)), Box::new(three)).unwrap();
        assert!(composite.restore(&others.save()).is_err());
        assert_eq!(composite.save(), ahead);
    }

    #[test]
    fn faults_of_either_plant_are_returned() {
        for (inputs, part) in [([f64::NAN, 0.0], "one"), ([0.0, f64::NAN], "two")] {
            let (_, _, mut composite) = pair();
            let fault = composite.advance(at(1), &inputs).unwrap_err();
            assert_eq!((fault.part.as_str(), fault.time), (part, SimTime::ZERO));
        }
    }

    #[test]
    fn plants_with_a_common_port_name_are_refused() {
        let clash = CompositePlant::new(Box::new(lag("one", 0.0, 1)), Box::new(lag("one", 1.0, 1)));
        assert_eq!(clash.err().unwrap().port, "one/value");
    }
}
