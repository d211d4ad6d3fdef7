//! Outputs that are means over the observation window: forces, which jump from step to step.

use std::ops::Range;

use mujoco_rs::prelude::{MjData, MjModel};

/// Quantity of a mean.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Mean {
    /// Sum of the normal forces of all contacts of these geoms \[N\].
    Load(Vec<i32>),
    /// Sum of all forces on these geoms, world axes \[N\].
    Force(Vec<i32>),
    /// Values of a sensor.
    Sensor(Range<usize>),
}

impl Mean {
    /// Returns the number of values.
    pub(crate) fn size(&self) -> usize {
        match self {
            Self::Load(_) => 1,
            Self::Force(_) => 3,
            Self::Sensor(range) => range.len(),
        }
    }

    /// Writes the present values.
    pub(crate) fn write(&self, data: &MjData<Box<MjModel>>, out: &mut [f64]) {
        out.fill(0.0);
        match self {
            Self::Load(geoms) => {
                for (id, contact) in data.contact().iter().enumerate() {
                    if contact.geom.iter().any(|geom| geoms.contains(geom)) {
                        out[0] += data.contact_force(id)[0];
                    }
                }
            }
            Self::Force(geoms) => {
                for (id, contact) in data.contact().iter().enumerate() {
                    // MuJoCo's contact force acts on the second geom; contacts within the set
                    // cancel.
                    let sign = match contact.geom.map(|geom| geoms.contains(&geom)) {
                        [false, true] => 1.0,
                        [true, false] => -1.0,
                        _ => continue,
                    };
                    let force = data.contact_force(id);
                    // Axes of the contact frame, one per row.
                    let axes = contact.frame.as_chunks::<3>().0.iter();
                    for (along, axis) in force.iter().zip(axes) {
                        for (out, axis) in out.iter_mut().zip(axis) {
                            *out += sign * along * axis;
                        }
                    }
                }
            }
            Self::Sensor(range) => out.copy_from_slice(&data.sensordata()[range.clone()]),
        }
    }
}
