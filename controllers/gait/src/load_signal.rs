//! Signal from which a controller reads the load of each leg.

use twinrig_kernel::{Port, Unit, signal};

use crate::GaitError;

/// Number of components of a force.
const FORCE: usize = 3;
/// Place of the leg in a name.
const LEG: &str = "*";

/// Name of the load of every leg, with `*` for the leg.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct LoadSignal {
    name: String,
    /// Index of the load in a force; none for a signal that is the load.
    component: Option<usize>,
}

impl Default for LoadSignal {
    fn default() -> Self {
        Self {
            name: signal::of_leg(LEG, signal::FOOT_LOAD),
            component: None,
        }
    }
}

impl LoadSignal {
    /// Creates the signal of `legs` legs.
    pub(crate) fn new(
        name: &str,
        component: Option<usize>,
        legs: usize,
    ) -> Result<Self, GaitError> {
        if legs > 1 && !name.contains(LEG) {
            return Err(GaitError::OneLoad {
                name: name.to_owned(),
            });
        }
        match component {
            Some(index) if index >= FORCE => Err(GaitError::OutOfRange {
                what: "load_component",
                value: index as f64,
                min: 0.0,
                max: (FORCE - 1) as f64,
            }),
            _ => Ok(Self {
                name: name.to_owned(),
                component,
            }),
        }
    }

    /// Port of the load of `leg`.
    pub(crate) fn port(&self, leg: &str) -> Port {
        Port::input(self.name.replace(LEG, leg), Unit::Newton, self.size())
    }

    /// Number of its components.
    pub(crate) fn size(&self) -> usize {
        self.component.map_or(1, |_| FORCE)
    }

    /// Loads among the inputs, in the order of the ports.
    pub(crate) fn values<'i>(&self, inputs: &'i [f64]) -> impl Iterator<Item = f64> + use<'i> {
        let index = self.component.unwrap_or(0);
        inputs
            .chunks_exact(self.size())
            .map(move |signal| signal[index])
    }
}
