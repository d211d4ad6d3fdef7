//! Channels of Foxglove's protocol.

use std::collections::BTreeMap;
use std::sync::Arc;

use foxglove::{ChannelBuilder, Context, FoxgloveError, PartialMetadata, RawChannel, Schema};
use serde::Serialize;
use twinrig_kernel::SimTime;
use twinrig_record::{ChannelId, EPOCH, Sink};

/// Channels with the messages that a recording has.
pub(super) struct Topics {
    context: Arc<Context>,
    channels: Vec<Option<Arc<RawChannel>>>,
    message: Vec<u8>,
    failure: Option<FoxgloveError>,
}

impl Topics {
    pub(super) fn new(context: &Arc<Context>) -> Self {
        Self {
            context: context.clone(),
            channels: Vec::new(),
            message: Vec::new(),
            failure: None,
        }
    }

    /// Returns the first failure to declare a channel.
    pub(super) fn failure(&mut self) -> Result<(), FoxgloveError> {
        self.failure.take().map_or(Ok(()), Err)
    }
}

impl Sink for Topics {
    fn add_channel(
        &mut self,
        topic: &str,
        message_encoding: &str,
        [name, encoding, definition]: [&str; 3],
        metadata: &BTreeMap<String, String>,
    ) -> ChannelId {
        let channel = ChannelBuilder::new(topic)
            .context(&self.context)
            .message_encoding(message_encoding)
            .schema(Schema::new(name, encoding, definition.as_bytes().to_vec()))
            .metadata(metadata.clone())
            .build_raw();
        let channel = channel.map_err(|error| self.failure = self.failure.take().or(Some(error)));
        self.channels.push(channel.ok());
        ChannelId(self.channels.len() - 1)
    }

    fn message(
        &mut self,
        channel: ChannelId,
        time: u64,
        size: usize,
        fill: impl FnOnce(&mut [u8]),
    ) {
        if let Some(channel) = &self.channels[channel.0]
            && channel.has_sinks()
        {
            self.message.resize(size, 0);
            fill(&mut self.message);
            channel.log_with_meta(&self.message, PartialMetadata::with_log_time(time));
        }
    }
}

/// A channel with messages in JSON.
pub(super) struct Json(Arc<RawChannel>);

impl Json {
    pub(super) fn new(context: &Arc<Context>, topic: &str) -> Result<Self, FoxgloveError> {
        let schema = br#"{"type":"object"}"#;
        let name = topic.trim_start_matches('/').replace('/', ".");
        let channel = ChannelBuilder::new(topic)
            .context(context)
            .message_encoding("json")
            .schema(Schema::new(name, "jsonschema", schema.to_vec()))
            .build_raw()?;
        Ok(Self(channel))
    }

    /// Returns whether a visitor has subscribed.
    pub(super) fn is_wanted(&self) -> bool {
        self.0.has_sinks()
    }

    pub(super) fn publish(&self, at: SimTime, message: &impl Serialize) {
        let time = at.as_nanos().saturating_add(EPOCH.as_nanos());
        // Numbers and texts can always be serialised.
        let message = serde_json::to_vec(message).unwrap_or_default();
        self.0
            .log_with_meta(&message, PartialMetadata::with_log_time(time));
    }
}
