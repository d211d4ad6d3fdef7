use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::{Direction, Port};

/// Signals laid end to end in one flat `[f64]`, in the order of their ports.
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
    /// Where the signal lies in the flat vector.
    pub fn range(&self) -> Range<usize> {
        self.offset..self.offset + self.port.size
    }
}

impl Layout {
    /// Lays out the ports of one direction, in order.
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

    /// Length of the flat vector: the sum of the sizes.
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Whether there is nothing in it.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The signals, in order.
    pub fn fields(&self) -> impl ExactSizeIterator<Item = &Field> + Clone {
        self.fields.iter()
    }

    /// The signal of that name.
    pub fn field(&self, name: &str) -> Option<&Field> {
        self.fields.iter().find(|field| field.port.name == name)
    }

    /// Where the signal of that name lies in the flat vector.
    pub fn find(&self, name: &str) -> Option<Range<usize>> {
        self.field(name).map(Field::range)
    }

    /// The signal to which component `index` of the flat vector belongs.
    pub fn field_at(&self, index: usize) -> Option<&Field> {
        self.fields
            .iter()
            .find(|field| field.range().contains(&index))
    }
}
