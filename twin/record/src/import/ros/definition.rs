//! Definitions of messages, as MCAP files have them under `ros2msg`: the definition of a type, and
//! those of the types that it uses, each after a line of `=` and `MSG: PACKAGE/TYPE`.

use std::collections::BTreeMap;

/// Greatest number of types of a definition, and of fields of a type.
const MOST: usize = 1000;

/// A type with a fixed size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Plain {
    Bool,
    Unsigned(usize),
    Signed(usize),
    Float(usize),
}

impl Plain {
    /// Size of a value \[bytes\].
    pub(super) fn size(self) -> usize {
        match self {
            Plain::Bool => 1,
            Plain::Unsigned(size) | Plain::Signed(size) | Plain::Float(size) => size,
        }
    }
}

/// Type of one value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Base {
    Plain(Plain),
    Text,
    WideText,
    /// A type of the definition, with package.
    Message(String),
}

/// Number of values of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Count {
    One,
    Fixed(usize),
    Sequence,
}

/// A field of a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Field {
    pub name: String,
    pub base: Base,
    pub count: Count,
}

/// Definition of a type with the types that it uses.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Definition {
    pub(super) main: Vec<Field>,
    pub(super) types: BTreeMap<String, Vec<Field>>,
}

impl Definition {
    /// Parses the definition of the type `name`.
    ///
    /// # Errors
    /// A line that is no field, or a type that is not defined.
    pub(crate) fn parse(name: &str, text: &str) -> Result<Self, String> {
        let mut main = Vec::new();
        let mut types: BTreeMap<String, Vec<Field>> = BTreeMap::new();
        types.insert(
            "builtin_interfaces/Time".to_owned(),
            vec![
                plain("sec", Plain::Signed(4)),
                plain("nanosec", Plain::Unsigned(4)),
            ],
        );
        types.insert(
            "builtin_interfaces/Duration".to_owned(),
            vec![
                plain("sec", Plain::Signed(4)),
                plain("nanosec", Plain::Unsigned(4)),
            ],
        );
        for (index, part) in parts(text).into_iter().enumerate() {
            let header = part.trim_start().strip_prefix("MSG:");
            let (of, body) = match header {
                Some(rest) if index > 0 => {
                    let (of, body) = rest.split_once('\n').unwrap_or((rest, ""));
                    (of.trim(), body)
                }
                _ => (name, part.as_str()),
            };
            let package = of.split('/').next().unwrap_or_default();
            let fields = fields(package, body)?;
            if index == 0 {
                main = fields;
            } else {
                types.insert(short(of), fields);
            }
            if types.len() > MOST {
                return Err(format!("it has more than {MOST} types"));
            }
        }
        let definition = Self { main, types };
        definition.check()?;
        Ok(definition)
    }

    fn check(&self) -> Result<(), String> {
        for field in self.types.values().flatten().chain(&self.main) {
            if let Base::Message(name) = &field.base
                && !self.types.contains_key(name)
            {
                return Err(format!("the type `{name}` is not defined"));
            }
        }
        Ok(())
    }
}

fn plain(name: &str, plain: Plain) -> Field {
    Field {
        name: name.to_owned(),
        base: Base::Plain(plain),
        count: Count::One,
    }
}

/// Splits a definition at lines of `=`.
fn parts(text: &str) -> Vec<String> {
    let mut parts = vec![String::new()];
    for line in text.lines() {
        let is_rule = line.len() >= 3 && line.bytes().all(|byte| byte == b'=');
        if is_rule {
            parts.push(String::new());
        } else if let Some(part) = parts.last_mut() {
            part.push_str(line);
            part.push('\n');
        }
    }
    parts
}

/// Returns `PACKAGE/TYPE` of `PACKAGE/msg/TYPE`.
fn short(name: &str) -> String {
    name.replace("/msg/", "/")
}

fn fields(package: &str, text: &str) -> Result<Vec<Field>, String> {
    let mut fields = Vec::new();
    for line in text.lines() {
        let line = line.split('#').next().unwrap_or_default().trim();
        let mut words = line.split_whitespace();
        let Some(kind) = words.next() else {
            continue;
        };
        let name = words
            .next()
            .ok_or_else(|| format!("`{line}` has no name"))?;
        // A constant: `byte OK=0`, `byte OK = 0`.
        if name.contains('=') || words.next().is_some_and(|word| word.starts_with('=')) {
            continue;
        }
        let field = field(package, kind, name).ok_or_else(|| format!("`{line}` is no field"))?;
        fields.push(field);
        if fields.len() > MOST {
            return Err(format!("a type has more than {MOST} fields"));
        }
    }
    Ok(fields)
}

fn field(package: &str, kind: &str, name: &str) -> Option<Field> {
    let (kind, count) = match kind.strip_suffix(']') {
        None => (kind, Count::One),
        Some(kind) => {
            let (kind, size) = kind.rsplit_once('[')?;
            let count = if size.is_empty() || size.starts_with("<=") {
                Count::Sequence
            } else {
                // Elements without bytes could be repeated without end.
                Count::Fixed(size.parse().ok().filter(|&size| size > 0)?)
            };
            (kind, count)
        }
    };
    // A bound of a text: `string<=10`.
    let kind = kind.split("<=").next().unwrap_or(kind);
    let base = match kind {
        "bool" => Base::Plain(Plain::Bool),
        "byte" | "char" | "uint8" => Base::Plain(Plain::Unsigned(1)),
        "int8" => Base::Plain(Plain::Signed(1)),
        "uint16" => Base::Plain(Plain::Unsigned(2)),
        "int16" => Base::Plain(Plain::Signed(2)),
        "uint32" => Base::Plain(Plain::Unsigned(4)),
        "int32" => Base::Plain(Plain::Signed(4)),
        "uint64" => Base::Plain(Plain::Unsigned(8)),
        "int64" => Base::Plain(Plain::Signed(8)),
        "float32" => Base::Plain(Plain::Float(4)),
        "float64" => Base::Plain(Plain::Float(8)),
        "string" => Base::Text,
        "wstring" => Base::WideText,
        "time" | "duration" | "" => return None,
        "Header" => Base::Message("std_msgs/Header".to_owned()),
        kind if kind.contains('/') => Base::Message(short(kind)),
        kind => Base::Message(format!("{package}/{kind}")),
    };
    Some(Field {
        name: name.to_owned(),
        base,
        count,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_constants_and_types_are_told_apart() {
        let text = "# a comment\n\
            byte OK=0\n\
            string NAME = \"x # y\"\n\
            std_msgs/Header header\n\
            Inner[<=3] inner  # some\n\
            float64[36] covariance\n\
            string<=10 text \"default\"\n\
            int8 x -1\n\
            ================================================================================\n\
            MSG: std_msgs/msg/Header\n\
            builtin_interfaces/Time stamp\n\
            string frame_id\n\
            ===\n\
            MSG: own/Inner\n\
            uint16[] values\n";
        let definition = Definition::parse("own/msg/Outer", text).unwrap();
        let names: Vec<&str> = definition
            .main
            .iter()
            .map(|field| field.name.as_str())
            .collect();
        assert_eq!(names, ["header", "inner", "covariance", "text", "x"]);
        assert_eq!(
            definition.main[1].base,
            Base::Message("own/Inner".to_owned())
        );
        assert_eq!(definition.main[1].count, Count::Sequence);
        assert_eq!(definition.main[2].count, Count::Fixed(36));
        assert_eq!(definition.types["std_msgs/Header"].len(), 2);
        assert_eq!(definition.types["own/Inner"][0].count, Count::Sequence);
    }

    #[test]
    fn invalid_lines_and_unknown_types_are_errors() {
        for text in [
            "float64",
            "float64[x] a",
            "uint8[0] a",
            "Other a",
            "[3] a",
            "time t",
        ] {
            assert!(Definition::parse("own/Outer", text).is_err(), "{text}");
        }
    }
}
