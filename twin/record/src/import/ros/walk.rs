//! A field of a message in CDR: the fields before it are passed over.

use super::definition::{Base, Count, Definition, Field, Plain};
use crate::import::cell::Cell;

/// Greatest depth of types within types.
const DEPTH_MOST: usize = 32;

/// Path of a field: `header.stamp`, `position[0]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct FieldPath(Vec<Step>);

#[derive(Debug, Clone, PartialEq, Eq)]
struct Step {
    name: String,
    element: Option<usize>,
}

impl FieldPath {
    /// Parses a path; none for other text.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let mut steps: Vec<Step> = Vec::new();
        for part in text.split('.') {
            let last = steps.last_mut().filter(|step| step.element.is_none());
            if let (Some(step), Ok(element)) = (last, part.parse()) {
                step.element = Some(element);
                continue;
            }
            let (name, element) = match part.strip_suffix(']') {
                None => (part, None),
                Some(part) => {
                    let (name, element) = part.split_once('[')?;
                    (name, Some(element.parse().ok()?))
                }
            };
            if name.is_empty() {
                return None;
            }
            let name = name.to_owned();
            steps.push(Step { name, element });
        }
        Some(Self(steps))
    }
}

/// Why a field has no value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum NoField {
    /// The type has no such field; it has these.
    Unknown(Vec<String>),
    /// The message is shorter, or a list has fewer elements.
    Short(String),
    /// The message has another encoding than plain CDR.
    Encoding,
    /// The type of the field, or of one before it, cannot be read.
    Unreadable(String),
}

/// Returns the value of a field of a message.
pub(crate) fn field<'m>(
    definition: &Definition,
    path: &FieldPath,
    message: &'m [u8],
) -> Result<Cell<'m>, NoField> {
    let (header, body) = message.split_at_checked(4).ok_or_else(ended)?;
    let is_little = match header {
        [0, 0, ..] => false,
        [0, 1, ..] => true,
        _ => return Err(NoField::Encoding),
    };
    let mut walk = Walk {
        definition,
        body,
        position: 0,
        is_little,
    };
    walk.find(&definition.main, &path.0, 0)
}

fn ended() -> NoField {
    NoField::Short("it ends before the field".to_owned())
}

struct Walk<'d, 'm> {
    definition: &'d Definition,
    body: &'m [u8],
    position: usize,
    is_little: bool,
}

impl<'d, 'm> Walk<'d, 'm> {
    fn take(&mut self, size: usize, count: usize) -> Result<&'m [u8], NoField> {
        let start = self.position.next_multiple_of(size.max(1));
        let length = size.checked_mul(count).ok_or_else(ended)?;
        let end = start.checked_add(length).ok_or_else(ended)?;
        let taken = self.body.get(start..end).ok_or_else(ended)?;
        self.position = end;
        Ok(taken)
    }

    /// Reads a whole number of at most eight bytes.
    fn bits(&mut self, size: usize) -> Result<u64, NoField> {
        let bytes = self.take(size, 1)?;
        let add = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
        Ok(if self.is_little {
            bytes.iter().rev().fold(0, add)
        } else {
            bytes.iter().fold(0, add)
        })
    }

    fn count(&mut self, count: Count) -> Result<usize, NoField> {
        match count {
            Count::One => Ok(1),
            Count::Fixed(count) => Ok(count),
            Count::Sequence => usize::try_from(self.bits(4)?).map_err(|_| ended()),
        }
    }

    fn fields(&self, name: &str) -> &'d [Field] {
        let definition = self.definition;
        definition.types.get(name).map_or(&[], Vec::as_slice)
    }

    fn find(&mut self, fields: &[Field], path: &[Step], depth: usize) -> Result<Cell<'m>, NoField> {
        let names = || fields.iter().map(|field| field.name.clone()).collect();
        let Some((step, deeper)) = path.split_first() else {
            return self.whole(fields);
        };
        if depth > DEPTH_MOST {
            return Err(NoField::Unreadable("types are nested too deep".to_owned()));
        }
        if !fields.iter().any(|field| field.name == step.name) {
            return Err(NoField::Unknown(names()));
        }
        for field in fields {
            if field.name != step.name {
                self.pass(field, depth)?;
                continue;
            }
            let count = self.count(field.count)?;
            let element = match (field.count, step.element) {
                (Count::One, None) => 0,
                (Count::One, Some(_)) => {
                    return Err(NoField::Unreadable(format!("`{}` is no list", field.name)));
                }
                (_, None) => {
                    return Ok(Cell::Composite(
                        "a list, of which `[0]` is the first element",
                    ));
                }
                (_, Some(element)) if element < count => element,
                (_, Some(element)) => {
                    let why = format!("`{}` has {count} elements, not {element}", field.name);
                    return Err(NoField::Short(why));
                }
            };
            self.pass_values(&field.base, element, depth)?;
            return self.value(&field.base, deeper, depth);
        }
        Err(NoField::Unknown(names()))
    }

    fn value(&mut self, base: &Base, path: &[Step], depth: usize) -> Result<Cell<'m>, NoField> {
        match base {
            Base::Message(name) => self.find(self.fields(name), path, depth + 1),
            _ if !path.is_empty() => Err(NoField::Unknown(Vec::new())),
            Base::Text => {
                let length = usize::try_from(self.bits(4)?).map_err(|_| ended())?;
                let bytes = self.take(1, length)?;
                let bytes = bytes.strip_suffix(b"\0").unwrap_or(bytes);
                Ok(Cell::Text(std::str::from_utf8(bytes).unwrap_or("…")))
            }
            Base::WideText => Ok(Cell::Composite("a wide text")),
            Base::Plain(plain) => self.plain(*plain),
        }
    }

    fn plain(&mut self, plain: Plain) -> Result<Cell<'m>, NoField> {
        let bits = self.bits(plain.size())?;
        let high = 64 - 8 * u32::try_from(plain.size()).unwrap_or(8);
        Ok(match plain {
            Plain::Bool => Cell::Boolean(bits != 0),
            Plain::Unsigned(_) => Cell::Integer(bits.into()),
            Plain::Signed(_) => Cell::Integer(((bits << high).cast_signed() >> high).into()),
            Plain::Float(4) => {
                let bits = u32::try_from(bits).unwrap_or_default();
                Cell::Number(f32::from_bits(bits).into())
            }
            Plain::Float(_) => Cell::Number(f64::from_bits(bits)),
        })
    }

    /// Returns the value of a message as a whole, which is one only of times.
    fn whole(&mut self, fields: &[Field]) -> Result<Cell<'m>, NoField> {
        let is_time = fields.len() == 2
            && fields
                .iter()
                .zip(["sec", "nanosec"])
                .all(|(field, name)| field.name == name);
        if !is_time {
            return Ok(Cell::Composite("a message"));
        }
        let seconds = i128::from(
            u32::try_from(self.bits(4)?)
                .unwrap_or_default()
                .cast_signed(),
        );
        let nanos = i128::from(self.bits(4)?);
        Ok(Cell::Nanos(seconds * 1_000_000_000 + nanos))
    }

    fn pass(&mut self, field: &Field, depth: usize) -> Result<(), NoField> {
        let count = self.count(field.count)?;
        self.pass_values(&field.base, count, depth)
    }

    fn pass_values(&mut self, base: &Base, count: usize, depth: usize) -> Result<(), NoField> {
        match base {
            // Nothing is aligned where nothing follows.
            Base::Plain(_) | Base::WideText if count == 0 => Ok(()),
            Base::Plain(plain) => self.take(plain.size(), count).map(|_| ()),
            Base::Text => (0..count).try_for_each(|_| {
                let length = usize::try_from(self.bits(4)?).map_err(|_| ended())?;
                self.take(1, length).map(|_| ())
            }),
            Base::WideText => {
                let why = "a wide text is before the field, and its size is not standard";
                Err(NoField::Unreadable(why.to_owned()))
            }
            Base::Message(_) if depth > DEPTH_MOST => {
                Err(NoField::Unreadable("types are nested too deep".to_owned()))
            }
            Base::Message(name) => {
                let fields = self.fields(name);
                (0..count).try_for_each(|_| {
                    if fields.is_empty() {
                        // A message without fields has one byte.
                        return self.take(1, 1).map(|_| ());
                    }
                    fields
                        .iter()
                        .try_for_each(|field| self.pass(field, depth + 1))
                })
            }
        }
    }
}
