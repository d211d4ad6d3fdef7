//! Plant with tactile sensors.

use serde::{Deserialize, Serialize};
use twinrig_kernel::{
    Direction, Layout, Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit,
};
use twinrig_runtime::{Plant, PlantFault, PlantState};

use crate::error::SensorError;
use crate::sensor::{TactileParameters, TactileSensor, TactileState};

/// Maximum step over which a load counts as linear in time. The voltages of loads of up to 5 Hz are
/// then exact to a thousandth.
const STEP_MAX: SimDuration = SimDuration::from_millis(1);

/// Measurements of a sensor, by the last part of their names.
const MEASURED: [(&str, Unit); 3] = [
    ("conductance", Unit::Siemens),
    ("piezoresistive", Unit::Volt),
    ("piezoelectric", Unit::Volt),
];

/// A plant with tactile sensors at some of its loads: of a test bench, under the feet of a robot.
///
/// A sensor at the load `leg/LF/foot/load` \[N\] adds the outputs `leg/LF/foot/load/conductance`
/// \[S\], `…/piezoresistive` \[V\] and `…/piezoelectric` \[V\]. Sensors do not act on the plant.
///
/// The load is linear between the instants to which the plant is advanced, which are at most a
/// millisecond apart; the plant takes no longer steps than that.
pub struct SensedPlant {
    plant: Box<dyn Plant>,
    sensors: Vec<Mounted>,
    ports: Vec<Port>,
    /// Outputs of the plant at the present time.
    outputs: Vec<f64>,
    now: SimTime,
}

/// Sensor and its places in the outputs.
struct Mounted {
    sensor: TactileSensor,
    load: usize,
    /// For each requested output, its index in [`MEASURED`].
    requested: Vec<usize>,
}

#[derive(Serialize, Deserialize)]
struct Saved {
    plant: Snapshot,
    sensors: Vec<TactileState>,
    outputs: Vec<f64>,
    now: SimTime,
}

impl SensedPlant {
    /// Returns the outputs of a sensor at the load `signal`.
    pub fn ports_at(signal: &str) -> Vec<Port> {
        let port = |(name, unit): &(&str, Unit)| Port::output(format!("{signal}/{name}"), *unit, 1);
        MEASURED.iter().map(port).collect()
    }

    /// Mounts sensors at loads of the plant, by signal name. `requested` selects their outputs; the
    /// plant itself must compute the loads.
    ///
    /// # Errors
    /// [`SensorError`] where the plant has no such load.
    pub fn new(
        mut plant: Box<dyn Plant>,
        sensors: &[(String, TactileParameters)],
        requested: &dyn Fn(&str) -> bool,
    ) -> Result<Self, SensorError> {
        let mut ports = plant.ports();
        let layout = Layout::of(&ports, Direction::Output);
        let mut outputs = vec![0.0; layout.len()];
        plant.observe(&mut outputs);
        let mut mounted = Vec::new();
        for (signal, parameters) in sensors {
            let field = layout.field(signal);
            let field =
                field.filter(|field| field.port.size == 1 && field.port.unit == Unit::Newton);
            let load = field.ok_or_else(|| SensorError::NoLoad {
                signal: signal.clone(),
            })?;
            let load = load.offset;
            let mut chosen = Vec::new();
            for (index, port) in Self::ports_at(signal).into_iter().enumerate() {
                if requested(&port.name) {
                    ports.push(port);
                    chosen.push(index);
                }
            }
            mounted.push(Mounted {
                sensor: TactileSensor::new(*parameters, outputs[load])?,
                load,
                requested: chosen,
            });
        }
        Ok(Self {
            plant,
            sensors: mounted,
            ports,
            outputs,
            now: SimTime::ZERO,
        })
    }

    fn advance_piece(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        self.plant.advance(to, inputs)?;
        let seconds = (to - self.now).as_secs_f64();
        self.plant.observe(&mut self.outputs);
        for mounted in &mut self.sensors {
            mounted.sensor.advance(seconds, self.outputs[mounted.load]);
        }
        self.now = to;
        Ok(())
    }
}

impl Mounted {
    fn measured(&self, index: usize) -> f64 {
        match index {
            0 => self.sensor.conductance(),
            1 => self.sensor.piezoresistive_volts(),
            _ => self.sensor.piezoelectric_volts(),
        }
    }
}

impl Plant for SensedPlant {
    fn inner(&self) -> Option<&dyn Plant> {
        Some(&*self.plant)
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Plant> {
        Some(&mut *self.plant)
    }

    fn name(&self) -> &str {
        self.plant.name()
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        while to - self.now > STEP_MAX {
            self.advance_piece(self.now + STEP_MAX, inputs)?;
        }
        self.advance_piece(to, inputs)
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        // Not the outputs kept: a new window changes those that are means over one.
        let (of_plant, of_sensors) = outputs.split_at_mut(self.outputs.len());
        self.plant.observe(of_plant);
        let mut rest = of_sensors;
        for mounted in &self.sensors {
            let (own, others) = rest.split_at_mut(mounted.requested.len());
            for (output, &index) in own.iter_mut().zip(&mounted.requested) {
                *output = mounted.measured(index);
            }
            rest = others;
        }
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            plant: self.plant.save(),
            sensors: self.sensors.iter().map(|it| it.sensor.state()).collect(),
            outputs: self.outputs.clone(),
            now: self.now,
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        if saved.sensors.len() != self.sensors.len() || saved.outputs.len() != self.outputs.len() {
            return Err(SnapshotError::Mismatch {
                expected: format!("a plant with {} tactile sensors", self.sensors.len()),
                found: format!("one with {}", saved.sensors.len()),
            });
        }
        self.plant.restore(&saved.plant)?;
        for (mounted, state) in self.sensors.iter_mut().zip(saved.sensors) {
            mounted.sensor.set_state(state);
        }
        (self.outputs, self.now) = (saved.outputs, saved.now);
        Ok(())
    }

    fn resume_from(&mut self, from: &PlantState) -> Result<Vec<String>, PlantFault> {
        let lines = self.plant.resume_from(from)?;
        self.now = from.time;
        self.plant.observe(&mut self.outputs);
        Ok(lines)
    }
}
