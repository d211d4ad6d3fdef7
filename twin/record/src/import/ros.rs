//! Messages of ROS 2: their definitions, and single fields of encoded messages.

mod definition;
mod walk;

pub(super) use definition::Definition;
pub(super) use walk::{FieldPath, NoField, field};
