//! A plant with sensors: the plant is as without them, and the sensors are part of its state.

use twinrig_kernel::{
    Direction, Layout, Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit,
};
use twinrig_runtime::{Plant, PlantFault};
use twinrig_sensor::{SensedPlant, SensorError, SensorFile, TactileParameters};

/// Load of 10 N/s, and the number of steps.
#[derive(Default)]
struct Ramp {
    now: SimTime,
    steps: u64,
}

impl Plant for Ramp {
    fn name(&self) -> &'static str {
        "ramp"
    }
    fn ports(&self) -> Vec<Port> {
        vec![
            Port::output("load", Unit::Newton, 1),
            Port::output("steps", Unit::One, 1),
            Port::output("force", Unit::Newton, 3),
        ]
    }
    fn advance(&mut self, to: SimTime, _: &[f64]) -> Result<(), PlantFault> {
        (self.now, self.steps) = (to, self.steps + 1);
        Ok(())
    }
    fn observe(&mut self, outputs: &mut [f64]) {
        outputs.fill(0.0);
        outputs[0] = 10.0 * self.now.since_start().as_secs_f64();
        outputs[1] = self.steps as f64;
    }
    fn save(&self) -> Snapshot {
        Snapshot::of(&(self.now, self.steps))
    }
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        (self.now, self.steps) = snapshot.read()?;
        Ok(())
    }
}

fn parameters() -> TactileParameters {
    let file = SensorFile::find("tactile", "".as_ref()).unwrap().unwrap();
    file.sensor().unwrap()
}

fn sensed(requested: &dyn Fn(&str) -> bool) -> SensedPlant {
    let sensors = [("load".to_owned(), parameters())];
    SensedPlant::new(Box::<Ramp>::default(), &sensors, requested).unwrap()
}

fn at(ms: u64) -> SimTime {
    SimTime::ZERO + SimDuration::from_millis(ms)
}

fn read(plant: &mut SensedPlant, name: &str) -> f64 {
    let layout = Layout::of(&plant.ports(), Direction::Output);
    let mut outputs = vec![0.0; layout.len()];
    plant.observe(&mut outputs);
    outputs[layout.field(name).unwrap().offset]
}

#[test]
fn voltages_are_those_of_the_load_and_only_the_requested_ones_exist() {
    let mut plant = sensed(&|name| name == "load/piezoelectric");
    let names: Vec<String> = plant.ports().into_iter().map(|port| port.name).collect();
    assert_eq!(names, ["load", "steps", "force", "load/piezoelectric"]);
    // Any division of the time gives the voltage of a ramp: a sum of two exponentials.
    for ms in [1, 2, 5, 40, 41, 200, 1_500] {
        plant.advance(at(ms), &[]).unwrap();
    }
    let cell = parameters().piezoelectric;
    let settled = |time: f64| time * -libm::expm1(-1.5 / time);
    let (slow, fast) = (settled(cell.amplifier_time), settled(cell.silicone_time));
    let closed = -cell.gain * 10.0 * (slow - fast) / (cell.amplifier_time - cell.silicone_time);
    let volts = read(&mut plant, "load/piezoelectric");
    assert!((volts - closed).abs() < 1e-9, "{volts} for {closed}");
}

#[test]
fn long_advances_are_divided_into_milliseconds() {
    let mut plant = sensed(&|_| true);
    plant.advance(at(20), &[]).unwrap();
    assert_eq!(read(&mut plant, "steps"), 20.0);
}

#[test]
fn restored_plant_has_the_state_of_its_sensors() {
    let mut first = sensed(&|_| true);
    first.advance(at(70), &[]).unwrap();
    let mut second = sensed(&|_| true);
    second.restore(&first.save()).unwrap();
    for plant in [&mut first, &mut second] {
        plant.advance(at(95), &[]).unwrap();
    }
    assert_eq!(first.save(), second.save());
    let all = |plant: &mut SensedPlant| {
        [
            "load/conductance",
            "load/piezoresistive",
            "load/piezoelectric",
        ]
        .map(|name| read(plant, name).to_bits())
    };
    assert_eq!(all(&mut first), all(&mut second));
}

#[test]
fn sensor_is_refused_where_there_is_no_load() {
    for signal in ["weight", "force", "steps"] {
        let sensors = [(signal.to_owned(), parameters())];
        let refused = SensedPlant::new(Box::<Ramp>::default(), &sensors, &|_| true);
        assert!(
            matches!(refused.err(), Some(SensorError::NoLoad { .. })),
            "{signal}"
        );
    }
}
