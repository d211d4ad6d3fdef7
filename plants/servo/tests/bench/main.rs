//! The bench of a servo.

mod backlash;
mod drive;
mod firmware;
mod motion;
mod motor;
mod plant;

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_robot::serial::{Friction, Gear};
use twinrig_runtime::Plant;
use twinrig_servo::{ServoBench, ServoBenchFile, ServoBenchParameters};

const GRAVITY: f64 = 9.80665;

fn sound() -> ServoBenchParameters {
    let file = ServoBenchFile::find("xl330", "".as_ref()).unwrap().unwrap();
    file.bench().unwrap()
}

/// The servo without friction, losses, heating, delays and quantisation.
fn ideal() -> ServoBenchParameters {
    let mut servo = sound();
    servo.friction = frictionless();
    servo.gear = Gear::IDEAL;
    servo.motor.heating = None;
    servo.motor.saturation_current = None;
    servo.supply.resistance = 0.0;
    servo.load.offset = 0.0;
    (
        servo.controller.command_delay,
        servo.controller.reading_delay,
    ) = (0.0, 0.0);
    servo.controller.quantized = false;
    servo
}

fn frictionless() -> Friction {
    Friction {
        viscous: 0.0,
        coulomb: 0.0,
        stribeck: 0.0,
        stribeck_rate: 0.1,
        stribeck_exponent: 1.0,
        motor_load: 0.0,
        external_load: 0.0,
        stribeck_motor_load: 0.0,
        stribeck_external_load: 0.0,
        motor_load_square: 0.0,
        external_load_square: 0.0,
    }
}

/// A bench with some outputs, from a state of angle and rate.
struct Run {
    bench: ServoBench,
    outputs: Vec<f64>,
}

impl Run {
    fn new(servo: &ServoBenchParameters, outputs: &[&str], [angle, rate]: [f64; 2]) -> Self {
        let names: Vec<String> = outputs.iter().map(|&name| name.to_owned()).collect();
        let mut bench = ServoBench::new(servo, &|name| names.iter().any(|it| it == name)).unwrap();
        let state = bench.state().unwrap();
        let state = state
            .with("servo/angle", &[angle])
            .with("servo/rate", &[rate]);
        bench.resume_from(&state).unwrap();
        Self {
            bench,
            outputs: vec![0.0; outputs.len()],
        }
    }

    /// Outputs at an instant \[s\], with the inputs until then.
    fn at(&mut self, seconds: f64, inputs: [f64; 2]) -> Vec<f64> {
        let time = SimTime::ZERO + SimDuration::try_from_secs_f64(seconds).unwrap();
        self.bench.advance(time, &inputs).unwrap();
        self.bench.observe(&mut self.outputs);
        self.outputs.clone()
    }
}

const OFF: [f64; 2] = [0.0, 0.0];
