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
    /// The outputs from the first to the last that is measured, sampled in one call.
    pub(crate) sampled: Range<usize>,
    /// Places of the measurements within `sampled`.
    pub(crate) positions: Vec<usize>,
    pub(crate) angles: Option<Range<usize>>,
    pub(crate) force: Option<Range<usize>>,
}

/// Places of a motor's signals in the plant.
#[derive(Clone, Debug)]
pub(crate) struct MotorSignals {
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
        let find = |port: Port| plant.find(owner, &port);
        let find_motor = |of_motor: &dyn Fn(&str) -> String| {
            let position = find(Port::input(of_motor("position"), Unit::Radian, 1))?;
            let motor = MotorSignals {
                voltage: find(Port::output(of_motor("voltage"), Unit::Volt, 1))?,
                bridge: find(Port::output(of_motor("bridge"), Unit::One, 1))?,
            };
            Ok((position, motor))
        };
        if attachment == Attachment::Shaft {
            let motor = find_motor(&|what| signal::of_motor(name, what))?;
            return Ok(Self::new(vec![motor], None, None));
        }
        let of_leg = |what: &str| signal::of_leg(name, what);
        let motors =
            Joint::ALL.map(|joint| find_motor(&|what| of_leg(&format!("{}/{what}", joint.name()))));
        let angles = Port::input(of_leg(signal::ANGLES), Unit::Radian, 3);
        let force = Port::input(of_leg(signal::FOOT_FORCE), Unit::Newton, 3);
        Ok(Self::new(
            motors.into_iter().collect::<Result<_, _>>()?,
            find(angles).ok(),
            find(force).ok(),
        ))
    }

    /// The signals of motors, each with the place of its position, and of sensors.
    fn new(
        motors: Vec<(Range<usize>, MotorSignals)>,
        angles: Option<Range<usize>>,
        force: Option<Range<usize>>,
    ) -> Self {
        let (positions, motors): (Vec<_>, Vec<_>) = motors.into_iter().unzip();
        let all = || positions.iter().chain(&angles).chain(&force);
        let first = all().map(|range| range.start).min().unwrap_or_default();
        let end = all().map(|range| range.end).max().unwrap_or_default();
        let within = |range: Range<usize>| range.start - first..range.end - first;
        Self {
            sampled: first..end,
            positions: positions.iter().map(|place| place.start - first).collect(),
            angles: angles.map(within),
            force: force.map(within),
            motors,
        }
    }
}
