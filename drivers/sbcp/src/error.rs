use thiserror::Error;

/// Invalid packets, values that a packet cannot carry, or invalid parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum SbcpError {
    /// The bytes do not begin with the header, or their number differs from the length byte.
    #[error("{bytes} bytes that are not framed as one packet")]
    NotFramed {
        /// Number of bytes.
        bytes: usize,
    },
    /// The length byte is below the minimum or above the maximum of a packet.
    #[error("invalid length byte {length}")]
    Length {
        /// The length byte.
        length: u8,
    },
    /// The checksum is wrong.
    #[error("checksum {found:#04x}, but the sum of the bytes is {sum:#04x}")]
    Checksum {
        /// Checksum in the packet.
        found: u8,
        /// Sum of its bytes.
        sum: u8,
    },
    /// A class or an id equals the header byte or, where not allowed, is that of a broadcast.
    #[error("class {class:#04x}, id {id:#04x} is not the address of a device")]
    Address {
        /// The class.
        class: u8,
        /// The id.
        id: u8,
    },
    /// A payload that does not fit into a packet.
    #[error(
        "a payload of {len} bytes exceeds the maximum of {}",
        crate::PAYLOAD_MAX
    )]
    Payload {
        /// Its length \[B\].
        len: usize,
    },
    /// Two registers have the same address, or one has an address of the standard head.
    #[error("register {address:#04x} is defined twice")]
    RegisterTwice {
        /// The address.
        address: u8,
    },
    /// The value does not fit into the register.
    #[error("the value {value} does not fit into register {address:#04x}")]
    RegisterValue {
        /// The address.
        address: u8,
        /// The value.
        value: u16,
    },
    /// There is no such register.
    #[error("register {address:#04x} does not exist")]
    NoRegister {
        /// The address.
        address: u8,
    },
    /// The time-out excludes valid answers.
    #[error(
        "a time-out of {nanos} ns is too short: the first byte of a valid answer takes up to {least} ns"
    )]
    Timeout {
        /// The time-out \[ns\].
        nanos: u64,
        /// Required minimum \[ns\].
        least: u64,
    },
    /// The limit excludes the longest response.
    #[error("a limit of {nanos} ns is too short: the longest response takes {least} ns")]
    Limit {
        /// The limit \[ns\].
        nanos: u64,
        /// Required minimum \[ns\].
        least: u64,
    },
    /// A frame without packets, or with more than the bus controller buffers.
    #[error(
        "a frame of {packets} packets, but 1 to {} are allowed",
        crate::FRAME_MAX
    )]
    Frame {
        /// Number of packets.
        packets: usize,
    },
    /// The byte time is zero.
    #[error("the byte time must be longer than zero")]
    ByteTime,
    /// A transfer is already in progress.
    #[error("a transfer is in progress")]
    Busy,
}
