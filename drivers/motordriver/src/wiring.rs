use std::ops::Range;

use twinrig_kernel::{Port, Unit, signal};
use twinrig_runtime::{PlantSignals, WiringError};

use crate::config::Attachment;
use crate::units::Joint;

/// Places of a board's signals in the plant.
#[derive(Clone, Debug, Default)]
pub(crate) struct Signals {
    /// The connected motors: hip and knee of a leg, or that of a shaft.
    pub(crate) motors: Vec<MotorSignals>,
    pub(crate) angles: Option<Range<usize>>,
    pub(crate) force: Option<Range<usize>>,
}

/// Places of a motor's signals in the plant.
#[derive(Clone, Debug)]
pub(crate) struct MotorSignals {
    pub(crate) position: Range<usize>,
    pub(crate) voltage: Range<usize>,
    pub(crate) bridge: Range<usize>,
}

impl Signals {
    /// Returns the places of the signals of a leg or shaft with that name.
    pub(crate) fn find(
        owner: &str,
        name: &str,
        attachment: Attachment,
        plant: &PlantSignals,
    ) -> Result<Self, WiringError> {
        if attachment == Attachment::Shaft {
            let motor = find_motor(owner, plant, &|what| signal::of_motor(name, what))?;
            return Ok(Self {
                motors: vec![motor],
                ..Self::default()
            });
        }
        let of_leg = |what: &str| signal::of_leg(name, what);
        let motors = Joint::ALL.map(|joint| {
            let of_motor = |what: &str| of_leg(&format!("{}/{what}", joint.name()));
            find_motor(owner, plant, &of_motor)
        });
        let angles = Port::input(of_leg(signal::ANGLES), Unit::Radian, 3);
        let force = Port::input(of_leg(signal::FOOT_FORCE), Unit::Newton, 3);
        Ok(Self {
            motors: motors.into_iter().collect::<Result<_, _>>()?,
            angles: plant.find(owner, &angles).ok(),
            force: plant.find(owner, &force).ok(),
        })
    }
}

fn find_motor(
    owner: &str,
    plant: &PlantSignals,
    name: &dyn Fn(&str) -> String,
) -> Result<MotorSignals, WiringError> {
    let find = |port: Port| plant.find(owner, &port);
    Ok(MotorSignals {
        position: find(Port::input(name("position"), Unit::Radian, 1))?,
        voltage: find(Port::output(name("voltage"), Unit::Volt, 1))?,
        bridge: find(Port::output(name("bridge"), Unit::One, 1))?,
    })
}
