//! Receivers of messages: a file, or viewers.

use std::collections::BTreeMap;

/// A channel, by its number in its sink.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChannelId(pub usize);

/// Receiver of messages.
pub trait Sink {
    /// Adds a channel with messages of a type, which is given by name, encoding and definition.
    fn add_channel(
        &mut self,
        topic: &str,
        message_encoding: &str,
        schema: [&str; 3],
        metadata: &BTreeMap<String, String>,
    ) -> ChannelId;

    /// Adds a message of `size` bytes, which `fill` writes.
    fn message(&mut self, channel: ChannelId, time: u64, size: usize, fill: impl FnOnce(&mut [u8]));
}
