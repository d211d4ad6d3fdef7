use twinrig_kernel::{Port, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{Plant, PlantFault, WorkCounts};

/// A first-order lag per channel, in explicit Euler steps over each interval: advances to other
/// instants or under other commands change the bits. Signals `NAME/command`, `NAME/value`, and
/// `NAME/mean`, the mean command since the window began.
pub struct ToyPlant {
    names: Vec<String>,
    pub fails_at: Option<SimTime>,
    now: SimTime,
    channels: Vec<Channel>,
    steps: u64,
}

#[derive(Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
struct Channel {
    value: f64,
    command_seconds: f64,
    window_seconds: f64,
}

impl ToyPlant {
    pub fn new(names: &[String]) -> Self {
        Self {
            names: names.to_vec(),
            fails_at: None,
            now: SimTime::ZERO,
            channels: vec![
                Channel {
                    value: 1.0,
                    ..Channel::default()
                };
                names.len()
            ],
            steps: 0,
        }
    }
}

impl Plant for ToyPlant {
    fn name(&self) -> &'static str {
        "toy plant"
    }

    fn ports(&self) -> Vec<Port> {
        let port = |name: &String| {
            [
                Port::input(format!("{name}/command"), Unit::Volt, 1),
                Port::output(format!("{name}/value"), Unit::Radian, 1),
                Port::output(format!("{name}/mean"), Unit::Volt, 1),
            ]
        };
        self.names.iter().flat_map(port).collect()
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        assert!(
            to > self.now,
            "a plant is never moved back, nor twice to one instant"
        );
        if let Some(time) = self.fails_at.filter(|&at| to >= at) {
            let energy = self
                .channels
                .iter()
                .map(|channel| channel.value * channel.value)
                .sum();
            return Err(PlantFault {
                time,
                part: "toy/spring".into(),
                energy,
                why: "it broke".into(),
            });
        }
        let seconds = (to - self.now).as_secs_f64();
        for (channel, command) in self.channels.iter_mut().zip(inputs) {
            channel.value += 10.0 * seconds * (command - channel.value);
            channel.command_seconds += seconds * command;
            channel.window_seconds += seconds;
        }
        self.now = to;
        self.steps += 1;
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        for (channel, outputs) in self.channels.iter().zip(outputs.chunks_exact_mut(2)) {
            outputs[0] = channel.value;
            outputs[1] = channel.command_seconds / channel.window_seconds.max(1e-12);
        }
    }

    fn begin_window(&mut self) {
        for channel in &mut self.channels {
            (channel.command_seconds, channel.window_seconds) = (0.0, 0.0);
        }
    }

    fn work(&self) -> WorkCounts {
        WorkCounts::of_steps(self.steps)
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(self.now, &self.channels, self.steps))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        (self.now, self.channels, self.steps) = snapshot.read()?;
        Ok(())
    }
}
