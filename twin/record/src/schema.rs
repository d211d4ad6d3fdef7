//! Conversion of a group of signals to a ROS 2 message type.

use std::fmt::Write as _;
use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Layout, SimDuration};

/// Time of the start of a run on the time line of its recording.
///
/// Greater than 0, because readers interpret a log time of 0 as absent.
pub const EPOCH: SimDuration = SimDuration::from_nanos(1_000_000_000);

/// Description of a recorded signal.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Signal {
    /// Path of the signal, e.g. `leg/LF/hip/position`.
    pub name: String,
    /// Symbol of the unit, e.g. `rad`.
    pub unit: String,
    /// Number of components.
    pub size: usize,
    /// Name of the message field, e.g. `leg_lf_hip_position`.
    pub field: String,
}

/// Keys of the metadata of a channel: description of the signals, name of the group, name of the
/// trace.
pub(crate) const SIGNALS_KEY: &str = "signals";
pub(crate) const GROUP_KEY: &str = "group";
pub(crate) const TRACE_KEY: &str = "lane";

/// Selects the signals of `layout` for which `keep` is true, with their ranges, adjacent ones
/// merged.
pub(crate) fn select(
    layout: &Layout,
    keep: &dyn Fn(&str) -> bool,
) -> (Vec<Signal>, Vec<Range<usize>>) {
    let mut signals: Vec<Signal> = Vec::new();
    let mut ranges: Vec<Range<usize>> = Vec::new();
    for field in layout
        .fields()
        .filter(|field| field.port.size > 0 && keep(&field.port.name))
    {
        let range = field.range();
        match ranges.last_mut() {
            Some(last) if last.end == range.start => last.end = range.end,
            _ => ranges.push(range),
        }
        let mut name = field_name(&field.port.name);
        let mut count = 2;
        while signals.iter().any(|other| other.field == name) {
            name = format!("{}_{count}", field_name(&field.port.name));
            count += 1;
        }
        signals.push(Signal {
            name: field.port.name.clone(),
            unit: field.port.unit.symbol().to_owned(),
            size: field.port.size,
            field: name,
        });
    }
    (signals, ranges)
}

/// Converts a signal name to a valid ROS 2 field name: lower-case letters, digits and single
/// underscores, beginning with a letter and not ending with an underscore.
fn field_name(signal: &str) -> String {
    let mut name = String::with_capacity(signal.len());
    for character in signal.chars() {
        if character.is_ascii_alphanumeric() {
            name.push(character.to_ascii_lowercase());
        } else if !name.is_empty() && !name.ends_with('_') {
            name.push('_');
        }
    }
    let name = name.trim_end_matches('_');
    if name.starts_with(|first: char| first.is_ascii_lowercase()) {
        name.to_owned()
    } else {
        format!("signal_{name}").trim_end_matches('_').to_owned()
    }
}

/// Converts a group name to a valid ROS 2 message type name in camel case: `ProcessInputs` for
/// `process-inputs`.
pub(crate) fn type_name(group: &str) -> String {
    let mut name = String::new();
    for word in field_name(group).split('_') {
        let mut letters = word.chars();
        name.extend(letters.next().map(|first| first.to_ascii_uppercase()));
        name.extend(letters);
    }
    name
}

/// Returns the ROS 2 message definition, with one `float64` field per signal.
pub(crate) fn definition(signals: &[Signal]) -> String {
    let mut text = String::new();
    for Signal {
        name,
        unit,
        size,
        field,
    } in signals
    {
        let bound = if *size == 1 {
            String::new()
        } else {
            format!("[{size}]")
        };
        // Writing to a string cannot fail.
        let _ = writeln!(text, "float64{bound} {field}  # {name} [{unit}]");
    }
    text
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use twinrig_kernel::{Direction, Port, Unit};

    use super::*;

    #[test]
    fn definition_is_a_ros_message() {
        let ports = [
            Port::output("leg/LF/hip/position", Unit::Radian, 1),
            Port::output("leg/LF/cable/tension", Unit::Newton, 1),
            Port::output("body/position", Unit::Meter, 3),
        ];
        let layout = Layout::of(&ports, Direction::Output);
        let (signals, ranges) = select(&layout, &|name| !name.ends_with("tension"));
        assert_eq!(ranges, [0..1, 2..5]);
        assert_eq!(
            definition(&signals),
            "float64 leg_lf_hip_position  # leg/LF/hip/position [rad]\n\
             float64[3] body_position  # body/position [m]\n"
        );
    }

    #[test]
    fn coinciding_field_names_are_numbered() {
        let ports = ["a/b", "a_b", "A/B"].map(|name| Port::output(name, Unit::One, 1));
        let (signals, ranges) = select(&Layout::of(&ports, Direction::Output), &|_| true);
        let fields: Vec<_> = signals.iter().map(|signal| signal.field.as_str()).collect();
        assert_eq!(fields, ["a_b", "a_b_2", "a_b_3"]);
        assert_eq!(ranges.first(), Some(&(0..3)));
    }

    proptest! {
        #[test]
        fn every_field_name_is_valid_in_ros(name in ".*") {
            let field = field_name(&name);
            prop_assert!(field.starts_with(|c: char| c.is_ascii_lowercase()), "{field}");
            prop_assert!(field.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_'));
            prop_assert!(!field.contains("__") && !field.ends_with('_'));
        }
    }
}
