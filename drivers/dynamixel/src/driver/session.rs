//! Steps in which the driver prepares a servo.

use twinrig_kernel::SimDuration;

use crate::codes::ErrorNumber;
use crate::config::ServoConfig;
use crate::protocol::Status;
use crate::request::{Request, Span};
use crate::table::ReturnDelay;

/// Step of the preparation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// Reads the model.
    Identify(Span),
    /// Writes a value to a register of so many bytes.
    Write {
        /// Address.
        address: u16,
        /// Number of bytes.
        size: u8,
        /// Bytes.
        bytes: [u8; 4],
        /// Value.
        value: i32,
    },
    /// Reads the position.
    Locate(Span),
}

/// Returns the steps that prepare a servo: its model, torque off, a return delay of 0, its
/// settings, its position, torque on.
pub(crate) fn steps(servo: &ServoConfig) -> impl Iterator<Item = Step> + '_ {
    let roles = &servo.model.roles;
    let model = Span {
        address: roles.model,
        length: 2,
    };
    let write = |address: u16, value: i32| Step::write(servo, address, value);
    let settings = servo.settings.iter();
    let delay = match roles.return_delay {
        ReturnDelay::Register(address) => Some(write(address, 0)),
        ReturnDelay::Fixed(_) => None,
    };
    [Step::Identify(model), Step::torque(servo, false)]
        .into_iter()
        .chain(delay)
        .chain(settings.map(move |&(address, value)| write(address, value)))
        .chain([
            Step::Locate(servo.model.present()),
            Step::torque(servo, true),
        ])
}

impl Step {
    /// Greatest return delay of a servo that is not prepared yet: 254 units of 2 µs.
    pub(crate) const RETURN_DELAY: SimDuration = SimDuration::from_micros(508);

    /// Writes a value to a register. One that is not in the table has a byte.
    fn write(servo: &ServoConfig, address: u16, value: i32) -> Self {
        let item = servo.model.item(address);
        Self::Write {
            address,
            size: item.map_or(1, |item| item.size),
            bytes: item.map_or_else(|| value.to_le_bytes(), |item| item.encode(value)),
            value,
        }
    }

    /// Turns the torque of a servo on or off.
    pub(crate) fn torque(servo: &ServoConfig, on: bool) -> Self {
        Self::write(servo, servo.model.roles.torque, on.into())
    }

    /// Returns the request.
    pub(crate) fn request(&self) -> Request<'_> {
        match self {
            Self::Identify(span) | Self::Locate(span) => Request::Read(*span),
            Self::Write {
                address,
                size,
                bytes,
                ..
            } => Request::Write {
                address: *address,
                data: &bytes[..usize::from(*size).min(4)],
            },
        }
    }

    /// Checks the answer of a servo; returns its position, if that is what was read.
    pub(crate) fn check(
        &self,
        servo: &ServoConfig,
        status: &Status<'_>,
    ) -> Result<Option<i32>, String> {
        let errors = servo.model.errors.of_byte(status.error);
        if errors.hardware {
            return Err(
                "it reports a hardware error: read its register, remove the cause and \
                        reboot it"
                    .to_owned(),
            );
        }
        if errors.refused {
            let error = ErrorNumber(status.error);
            return Err(match self {
                Self::Write { address, value, .. } => {
                    let item = servo.model.item(*address);
                    let name = item.map_or("a register", |item| item.name);
                    format!("it refuses {value} as `{name}`: {error}")
                }
                _ => format!("it refuses to be read: {error}"),
            });
        }
        match self {
            Self::Identify(_) => {
                let expected = servo.model.item(servo.model.roles.model);
                let expected = expected.map_or(0, |item| item.initial);
                match *status.data {
                    [low, high] if i32::from(u16::from_le_bytes([low, high])) == expected => {
                        Ok(None)
                    }
                    [low, high] => Err(format!(
                        "it is of model {}, not {} ({expected})",
                        u16::from_le_bytes([low, high]),
                        servo.model.name
                    )),
                    _ => Err("its answer has another length".to_owned()),
                }
            }
            Self::Locate(_) => servo
                .model
                .counts(status.data)
                .map(Some)
                .ok_or_else(|| "its answer has another length".to_owned()),
            Self::Write { .. } => Ok(None),
        }
    }
}
