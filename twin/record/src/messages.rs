//! Messages of a recording, each type on its own topic.

use serde::{Deserialize, Serialize};

use crate::Topic;
use crate::cdr::{CdrReader, CdrWriter};
use sealed::Encoded;

/// A message of a recording. The JSON encoding of earlier builds is also read.
pub trait Message: Encoded {
    /// Topic of the message.
    const TOPIC: Topic;
}

pub(crate) mod sealed {
    use serde::de::DeserializeOwned;

    use crate::cdr::{CdrReader, CdrWriter};

    /// Encoding of a message, in the order of its definition.
    pub trait Encoded: DeserializeOwned {
        fn write(&self, stamp: [u8; 8], to: &mut CdrWriter<'_>);

        /// Reads a message; `None` if the data are invalid.
        fn read(from: &mut CdrReader<'_>) -> Option<Self>;
    }
}

/// An exceptional event of the schedule; a `diagnostic_msgs/DiagnosticArray` of one status.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct EventMessage {
    /// `task skipped`, `overrun` or `devices are open`.
    pub event: String,
    /// Task that was skipped.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
    /// Number of missed control steps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub count: Option<u64>,
}

/// A change of a process variable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChangeMessage {
    /// Name of the variable.
    pub variable: String,
    /// New value, in the unit of the variable.
    pub value: f64,
}

/// A footstep, written at lift-off.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FootstepMessage {
    /// Name of the leg.
    pub leg: String,
    /// Time of touch-down, since the start of the run \[s\].
    pub touch_down_s: f64,
    /// Time of lift-off \[s\].
    pub lift_off_s: f64,
    /// Position at touch-down, world frame \[m\]; `None` if it was not recorded.
    #[serde(default)]
    pub position_m: Option<[f64; 3]>,
    /// Maximum horizontal distance from there while in contact \[m\].
    #[serde(default = "nan")]
    pub slip_m: f64,
    /// Integral of the load \[N·s\].
    #[serde(default = "nan")]
    pub impulse_ns: f64,
    /// Maximum load \[N\].
    #[serde(default = "nan")]
    pub peak_load_n: f64,
}

/// Verdict of a run, written once, at its end.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct VerdictMessage {
    /// `pass`, `fail` or `error`.
    pub verdict: String,
    /// Whether the user interrupted the run before its end.
    #[serde(default)]
    pub interrupted: bool,
    /// Reason for which the run did not reach its end.
    #[serde(default)]
    pub error: Option<String>,
    /// Outcomes of the expectations.
    #[serde(default)]
    pub expectations: Vec<ExpectationMessage>,
}

/// Outcome of an expectation, in a [`VerdictMessage`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct ExpectationMessage {
    /// Name of the expectation.
    pub name: String,
    /// `pass`, `fail` or `unobserved`.
    pub verdict: String,
    /// Whether the outcome `unobserved` is acceptable.
    pub optional: bool,
    /// Measured value nearest to a violation.
    pub measured: Option<f64>,
    /// Nearest limit.
    pub bound: Option<f64>,
    /// Opposite limit.
    pub other_bound: Option<f64>,
    /// Distance to the limit, negative beyond it.
    pub margin: Option<f64>,
    /// Unit of `measured`, `bound` and `margin`.
    pub unit: String,
    /// Time of the first violation, since the start of the run \[s\].
    pub first_violation_s: Option<f64>,
    /// Leg and footstep concerned, or the reason for `unobserved`.
    pub detail: String,
    /// Leg of the measured value.
    pub leg: Option<String>,
    /// Signal of the measured value.
    pub signal: Option<String>,
    /// Element of a signal with several, counted from 0.
    pub element: Option<u32>,
    /// Instant of the measured value, since the start of the run \[s\].
    pub instant_s: Option<f64>,
    /// The same instant on the time line of recordings \[s\].
    pub recording_s: Option<f64>,
    /// Value of the signal at the instant.
    pub value: Option<f64>,
    /// Least accepted value.
    pub min: Option<f64>,
    /// Greatest accepted value.
    pub max: Option<f64>,
    /// Line of the scenario, counted from 1.
    pub line: Option<u32>,
}

fn nan() -> f64 {
    f64::NAN
}

fn number(value: Option<f64>) -> f64 {
    value.unwrap_or(f64::NAN)
}

fn no_nan(value: f64) -> Option<f64> {
    (!value.is_nan()).then_some(value)
}

fn not_empty(text: String) -> Option<String> {
    (!text.is_empty()).then_some(text)
}

/// Severity levels of a `DiagnosticStatus`.
const OK: u8 = 0;
const WARN: u8 = 1;

/// Status name of an event.
const STATUS_NAME: &str = "schedule";
/// Keys of the values of an event.
const PART: &str = "part";
const COUNT: &str = "count";

/// Event with severity `OK`.
pub(crate) const DEVICES_ARE_OPEN: &str = "devices are open";

impl Message for EventMessage {
    const TOPIC: Topic = Topic::Events;
}

impl Encoded for EventMessage {
    fn write(&self, stamp: [u8; 8], to: &mut CdrWriter<'_>) {
        to.stamp(stamp);
        to.text(""); // no frame
        to.count(1);
        to.u8(if self.event == DEVICES_ARE_OPEN {
            OK
        } else {
            WARN
        });
        to.text(STATUS_NAME);
        to.text(&self.event);
        to.text(""); // no hardware
        let count = self.count.map(|count| count.to_string());
        let values = [(PART, self.part.as_deref()), (COUNT, count.as_deref())];
        let values = values
            .iter()
            .filter_map(|(key, value)| Some((key, (*value)?)));
        to.count(values.clone().count());
        for (key, value) in values {
            to.text(key);
            to.text(value);
        }
    }

    fn read(from: &mut CdrReader<'_>) -> Option<Self> {
        let (_, _) = (from.time()?, from.text()?);
        (from.u32()? == 1).then_some(())?;
        let (_, _, event, _) = (from.u8()?, from.text()?, from.text()?, from.text()?);
        let values = from.each(|from| Some((from.text()?, from.text()?)))?;
        let value = |key: &str| values.iter().find(|(known, _)| known == key);
        let count = value(COUNT).map(|(_, count)| count.parse());
        Some(Self {
            event,
            part: value(PART).map(|(_, part)| part.clone()),
            count: count.transpose().ok()?,
        })
    }
}

impl Message for ChangeMessage {
    const TOPIC: Topic = Topic::Changes;
}

impl Encoded for ChangeMessage {
    fn write(&self, _: [u8; 8], to: &mut CdrWriter<'_>) {
        to.text(&self.variable);
        to.f64(self.value);
    }

    fn read(from: &mut CdrReader<'_>) -> Option<Self> {
        let (variable, value) = (from.text()?, from.f64()?);
        Some(Self { variable, value })
    }
}

impl Message for FootstepMessage {
    const TOPIC: Topic = Topic::Footsteps;
}

impl Encoded for FootstepMessage {
    fn write(&self, _: [u8; 8], to: &mut CdrWriter<'_>) {
        to.text(&self.leg);
        to.f64s(&[self.touch_down_s, self.lift_off_s]);
        to.f64s(&self.position_m.unwrap_or([f64::NAN; 3]));
        to.f64s(&[self.slip_m, self.impulse_ns, self.peak_load_n]);
    }

    fn read(from: &mut CdrReader<'_>) -> Option<Self> {
        let leg = from.text()?;
        let [touch_down_s, lift_off_s] = from.f64s()?;
        let position: [f64; 3] = from.f64s()?;
        let [slip_m, impulse_ns, peak_load_n] = from.f64s()?;
        Some(Self {
            leg,
            touch_down_s,
            lift_off_s,
            position_m: position.iter().all(|x| !x.is_nan()).then_some(position),
            slip_m,
            impulse_ns,
            peak_load_n,
        })
    }
}

impl Message for VerdictMessage {
    const TOPIC: Topic = Topic::Verdict;
}

impl Encoded for VerdictMessage {
    fn write(&self, _: [u8; 8], to: &mut CdrWriter<'_>) {
        to.text(&self.verdict);
        to.bool(self.interrupted);
        to.text(self.error.as_deref().unwrap_or_default());
        to.count(self.expectations.len());
        for expectation in &self.expectations {
            expectation.write(to);
        }
    }

    fn read(from: &mut CdrReader<'_>) -> Option<Self> {
        Some(Self {
            verdict: from.text()?,
            interrupted: from.bool()?,
            error: not_empty(from.text()?),
            expectations: from.each(ExpectationMessage::read)?,
        })
    }
}

impl ExpectationMessage {
    fn write(&self, to: &mut CdrWriter<'_>) {
        to.text(&self.name);
        to.text(&self.verdict);
        to.bool(self.optional);
        for value in [self.measured, self.bound, self.other_bound, self.margin] {
            to.f64(number(value));
        }
        to.text(&self.unit);
        to.f64(number(self.first_violation_s));
        to.text(&self.detail);
        to.text(self.leg.as_deref().unwrap_or_default());
        to.text(self.signal.as_deref().unwrap_or_default());
        to.u32(self.element.map_or(0, |element| element.saturating_add(1)));
        let times = [self.instant_s, self.recording_s];
        for value in times.into_iter().chain([self.value, self.min, self.max]) {
            to.f64(number(value));
        }
        to.u32(self.line.unwrap_or(0));
    }

    fn read(from: &mut CdrReader<'_>) -> Option<Self> {
        let (name, verdict, optional) = (from.text()?, from.text()?, from.bool()?);
        let [measured, bound, other_bound, margin] = from.f64s()?.map(no_nan);
        let (unit, first_violation_s) = (from.text()?, no_nan(from.f64()?));
        let (detail, leg, signal) = (from.text()?, from.text()?, from.text()?);
        let element = from.u32()?.checked_sub(1);
        let [instant_s, recording_s, value, min, max] = from.f64s()?.map(no_nan);
        Some(Self {
            name,
            verdict,
            optional,
            measured,
            bound,
            other_bound,
            margin,
            unit,
            first_violation_s,
            detail,
            leg: not_empty(leg),
            signal: not_empty(signal),
            element,
            instant_s,
            recording_s,
            value,
            min,
            max,
            line: from.u32().map(|line| (line > 0).then_some(line))?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn round_trip<M: Message + PartialEq + std::fmt::Debug>(message: &M) {
        let mut bytes = Vec::new();
        message.write([0; 8], &mut CdrWriter::new(&mut bytes));
        let mut reader = CdrReader::new(&bytes).unwrap();
        assert_eq!(M::read(&mut reader).as_ref(), Some(message));
        assert!(reader.is_at_end());
        for cut in 4..bytes.len() {
            let mut reader = CdrReader::new(&bytes[..cut]).unwrap();
            assert_eq!(M::read(&mut reader), None, "{cut} of {}", bytes.len());
        }
    }

    #[test]
    fn messages_round_trip_and_truncated_ones_are_rejected() {
        round_trip(&EventMessage {
            event: "task skipped".to_owned(),
            part: Some("sbcp".to_owned()),
            count: None,
        });
        round_trip(&EventMessage {
            event: "overrun".to_owned(),
            part: None,
            count: Some(u64::MAX),
        });
        round_trip(&ChangeMessage {
            variable: "frequency".to_owned(),
            value: -0.1,
        });
        round_trip(&FootstepMessage {
            leg: "LF".to_owned(),
            touch_down_s: 0.25,
            lift_off_s: 0.5,
            position_m: Some([0.1, -0.0, 1e-300]),
            slip_m: 1e-3,
            impulse_ns: 0.7,
            peak_load_n: 12.5,
        });
        round_trip(&VerdictMessage {
            verdict: "fail".to_owned(),
            interrupted: true,
            error: Some("µ".to_owned()),
            expectations: vec![
                ExpectationMessage::default(),
                ExpectationMessage {
                    leg: Some("LF".to_owned()),
                    signal: Some("body/rpy".to_owned()),
                    element: Some(0),
                    instant_s: Some(0.5),
                    recording_s: Some(1.5),
                    value: Some(-0.25),
                    min: Some(-1.0),
                    max: Some(1.0),
                    line: Some(41),
                    ..ExpectationMessage::default()
                },
            ],
        });
    }

    #[test]
    fn messages_of_earlier_builds_are_read() {
        let text = r#"{"verdict":"error","interrupted":false,"error":null,"expectations":[{"name":"n","verdict":"pass",
            "measured":null,"bound":1.0,"unit":"m","margin":null,"first_violation_s":null,"other_bound":null,"optional":true,"detail":""}]}"#;
        let verdict: VerdictMessage = serde_json::from_str(text).unwrap();
        assert_eq!(
            (verdict.error, verdict.expectations[0].bound),
            (None, Some(1.0))
        );
        let footstep = r#"{"leg":"LF","touch_down_s":0.1,"lift_off_s":0.2}"#;
        let footstep: FootstepMessage = serde_json::from_str(footstep).unwrap();
        assert!(footstep.position_m.is_none() && footstep.slip_m.is_nan());
    }
}
