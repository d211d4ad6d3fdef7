//! Steps in which the driver prepares a servo.

use twinrig_kernel::SimDuration;

use crate::codes::{ErrorNumber, Errors};
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
    let roles = &servo.model().roles;
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
            Step::Locate(servo.model().present()),
            Step::torque(servo, true),
        ])
}

impl Step {
    /// Lets servos answer all instructions. Servos that answer fewer would not confirm it, so it is
    /// sent to all, which none answers.
    pub(crate) fn answer_all(servo: &ServoConfig) -> Self {
        let roles = &servo.model().roles;
        Self::write(servo, roles.status_level, 2 - roles.status_offset)
    }

    /// Greatest return delay of a servo that is not prepared yet: 254 units of 2 µs.
    pub(crate) const RETURN_DELAY: SimDuration = SimDuration::from_micros(508);

    /// Writes a value to a register. One that is not in the table has a byte.
    fn write(servo: &ServoConfig, address: u16, value: i32) -> Self {
        let item = servo.model().item(address);
        Self::Write {
            address,
            size: item.map_or(1, |item| item.size),
            bytes: item.map_or_else(|| value.to_le_bytes(), |item| item.encode(value)),
            value,
        }
    }

    /// Turns the torque of a servo on or off.
    pub(crate) fn torque(servo: &ServoConfig, on: bool) -> Self {
        Self::write(servo, servo.model().roles.torque, on.into())
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

    /// Returns the effect of an answer of the servo.
    pub(crate) fn outcome(&self, servo: &ServoConfig, status: &Status<'_>) -> StepOutcome {
        let errors = servo.model().errors.of_byte(status.error);
        let number = ErrorNumber(status.error & !ErrorNumber::ALERT);
        if errors.refused && servo.model().errors == Errors::Numbers && number == ErrorNumber::CRC {
            return StepOutcome::Repeat;
        }
        if errors.refused {
            return StepOutcome::Failed(match self {
                Self::Write { address, value, .. } => {
                    let item = servo.model().item(*address);
                    let name = item.map_or("a register", |item| item.name);
                    format!("it refuses {value} as `{name}`: {number}")
                }
                _ => format!("it refuses to be read: {number}"),
            });
        }
        // A servo with a hardware error still turns its torque off.
        if errors.hardware && *self != Self::torque(servo, false) {
            let why = "it reports a hardware error: read its register, remove the cause and \
                       reboot it";
            return StepOutcome::Failed(why.to_owned());
        }
        match self {
            Self::Identify(_) => {
                let item = servo.model().item(servo.model().roles.model);
                let expected = item.map_or(0, |item| item.initial);
                match item.and_then(|item| item.decode(status.data)) {
                    Some(found) if found == expected => StepOutcome::Done,
                    Some(found) => StepOutcome::Failed(format!(
                        "it is of model {found}, not {} ({expected})",
                        servo.model().name
                    )),
                    None => StepOutcome::Unexpected,
                }
            }
            Self::Locate(_) => match servo.model().counts(status.data) {
                Some(counts) => StepOutcome::Located(counts),
                None => StepOutcome::Unexpected,
            },
            Self::Write { .. } if status.data.is_empty() => StepOutcome::Done,
            Self::Write { .. } => StepOutcome::Unexpected,
        }
    }
}

/// Effect of an answer on a step.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum StepOutcome {
    /// The step is complete.
    Done,
    /// The step is complete, with the position.
    Located(i32),
    /// The instruction arrived damaged.
    Repeat,
    /// The answer is that to another instruction.
    Unexpected,
    /// The servo cannot be used, for this reason.
    Failed(String),
}
