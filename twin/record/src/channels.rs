//! Channels of a recording: topic, type with definition, metadata.

use std::collections::BTreeMap;
use std::ops::Range;

use twinrig_kernel::Layout;
use twinrig_runtime::Group;

use crate::schema::{self, GROUP_KEY, SIGNALS_KEY, TRACE_KEY};
use crate::sink::{ChannelId, Sink};
use crate::{RecordError, Topic, cdr, ros};

/// A group of signals that are sampled together, with the selection of those recorded.
pub struct RecordedGroup<'a> {
    /// The group.
    pub group: Group,
    /// Layout of the values of a sample.
    pub layout: &'a Layout,
    /// Predicate that selects the recorded signals by name.
    pub keep: &'a dyn Fn(&str) -> bool,
}

/// Returns the name of a group in a recording.
pub const fn group_name(group: Group) -> &'static str {
    match group {
        Group::Plant => "plant",
        Group::ProcessInputs => "process-inputs",
        Group::ProcessOutputs => "process-outputs",
        Group::Diagnostics => "gauges",
    }
}

/// Channel of a group of signals, and the parts of a sample that its messages contain.
pub(crate) struct Sampled {
    pub channel: ChannelId,
    pub ranges: Vec<Range<usize>>,
    /// Length of its messages \[bytes\].
    pub size: usize,
}

/// Adds a channel that conforms to the profile `ros2`: CDR messages and the offered quality of
/// service.
fn add_channel(
    sink: &mut impl Sink,
    topic: &str,
    (message_type, definition): (&str, &str),
    mut metadata: BTreeMap<String, String>,
) -> ChannelId {
    // Players may choose any quality of service.
    metadata.insert("offered_qos_profiles".to_owned(), "[]".to_owned());
    let name = ros::full_name(message_type);
    let schema = [name.as_str(), "ros2msg", definition];
    sink.add_channel(topic, "cdr", schema, &metadata)
}

pub(crate) fn add_group(
    sink: &mut impl Sink,
    group: &RecordedGroup<'_>,
) -> Result<Sampled, RecordError> {
    let (signals, ranges) = schema::select(group.layout, group.keep);
    let name = group_name(group.group);
    let described = serde_json::to_string(&signals).map_err(|source| RecordError::Describe {
        group: name,
        source,
    })?;
    let metadata = BTreeMap::from([
        (GROUP_KEY.to_owned(), name.to_owned()),
        (SIGNALS_KEY.to_owned(), described),
    ]);
    let message_type = format!("{}/{}", ros::PACKAGE, schema::type_name(name));
    let definition = schema::definition(&signals);
    let channel = add_channel(
        sink,
        &ros::topic_name(name),
        (&message_type, &definition),
        metadata,
    );
    let count: usize = signals.iter().map(|signal| signal.size).sum();
    Ok(Sampled {
        channel,
        ranges,
        size: cdr::HEADER.len() + 8 * count,
    })
}

/// Adds the channels of wire traces. A number distinguishes traces whose ROS 2 topic names would
/// coincide.
pub(crate) fn add_traces(sink: &mut impl Sink, traces: &[String]) -> Vec<ChannelId> {
    const TYPE: &str = "twinrig/Bytes";
    let definition = ros::complete(TYPE);
    let mut topics: Vec<String> = Vec::new();
    let mut channels = Vec::new();
    for trace in traces {
        let name = ros::topic_name(&format!("wire/{trace}"));
        let numbered = (2..).map(|count| format!("{name}_{count}"));
        let mut names = std::iter::once(name.clone()).chain(numbered);
        let topic = names.find(|name| !topics.contains(name)).unwrap_or(name);
        let metadata = BTreeMap::from([(TRACE_KEY.to_owned(), trace.clone())]);
        channels.push(add_channel(sink, &topic, (TYPE, &definition), metadata));
        topics.push(topic);
    }
    channels
}

pub(crate) fn add_topic(sink: &mut impl Sink, topic: Topic) -> ChannelId {
    let message_type = topic.message_type();
    let definition = ros::complete(message_type);
    let of = (message_type, definition.as_str());
    add_channel(sink, topic.name(), of, BTreeMap::new())
}
