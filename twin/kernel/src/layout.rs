use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::{Direction, Port};

/// Concatenation of signals in one flat `[f64]`, in the order of their ports.
///
/// ```
/// use twinrig_kernel::{Direction, Layout, Port, Unit};
///
/// let ports = [
///     Port::input("leg/LF/hip/command", Unit::Radian, 1),
///     Port::output("body/position", Unit::Meter, 3),
///     Port::output("body/orientation", Unit::One, 4),
/// ];
/// let outputs = Layout::of(&ports, Direction::Output);
/// assert_eq!(outputs.len(), 7);
/// assert_eq!(outputs.find("body/orientation"), Some(3..7));
/// assert_eq!(outputs.find("leg/LF/hip/command"), None);
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Layout {
    fields: Vec<Field>,
    len: usize,
}

/// One signal of a [`Layout`].
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Field {
    /// The signal.
    pub port: Port,
    /// Index of its first component in the flat vector.
    pub offset: usize,
}

impl Field {
    /// Index range of the signal in the flat vector.
    pub fn range(&self) -> Range<usize> {
        self.offset..self.offset + self.port.size
    }
}

impl Layout {
    /// Lays out the ports of `direction`, in order.
    pub fn of<'a>(ports: impl IntoIterator<Item = &'a Port>, direction: Direction) -> Self {
        let mut layout = Self::default();
        for port in ports.into_iter().filter(|port| port.direction == direction) {
            layout.fields.push(Field {
                port: port.clone(),
                offset: layout.len,
            });
            layout.len += port.size;
        }
        layout
    }

    /// Length of the flat vector: the sum of the signal sizes.
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Whether the flat vector is empty.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The signals, in order.
    pub fn fields(&self) -> impl ExactSizeIterator<Item = &Field> + Clone {
        self.fields.iter()
    }

    /// Returns the signal named `name`.
    pub fn field(&self, name: &str) -> Option<&Field> {
        self.fields.iter().find(|field| field.port.name == name)
    }

    /// Returns the index range of the signal named `name` in the flat vector.
    pub fn find(&self, name: &str) -> Option<Range<usize>> {
        self.field(name).map(Field::range)
    }

    /// Returns the signal that contains component `index` of the flat vector.
    pub fn field_at(&self, index: usize) -> Option<&Field> {
        self.fields
            .iter()
            .find(|field| field.range().contains(&index))
    }
}
