use thiserror::Error;

/// What is refused: bytes that are no packet, values that no packet can carry, parameters that cannot be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum SbcpError {
    /// The bytes do not begin with the header, or are not as many as their length byte says.
    #[error("{bytes} bytes that are not framed as one packet")]
    NotFramed {
        /// How many there are.
        bytes: usize,
    },
    /// The length byte says less than is always there, or more than any buffer holds.
    #[error("length byte {length}, which no packet has")]
    Length {
        /// The length byte.
        length: u8,
    },
    /// The checksum is wrong.
    #[error("checksum {found:#04x} where the bytes add up to {sum:#04x}")]
    Checksum {
        /// What the packet says.
        found: u8,
        /// What its bytes add up to.
        sum: u8,
    },
    /// A class or an id that is the header, or a response that comes from everybody.
    #[error("class {class:#04x}, id {id:#04x} is nobody's address")]
    Address {
        /// The class.
        class: u8,
        /// The id.
        id: u8,
    },
    /// A payload that does not fit into a packet.
    #[error(
        "a payload of {len} bytes, where a packet holds {}",
        crate::PAYLOAD_MAX
    )]
    Payload {
        /// Its length \[B\].
        len: usize,
    },
    /// Two registers have one address, or one has an address of the standard head.
    #[error("register {address:#04x} is there twice")]
    RegisterTwice {
        /// The address.
        address: u8,
    },
    /// A register cannot hold what it shall hold.
    #[error("register {address:#04x} cannot hold {value}")]
    RegisterValue {
        /// The address.
        address: u8,
        /// The value.
        value: u16,
    },
    /// There is no such register.
    #[error("there is no register {address:#04x}")]
    NoRegister {
        /// The address.
        address: u8,
    },
    /// A time-out in which no board could answer.
    #[error(
        "a time-out of {nanos} ns, where the first byte of a good answer takes up to {least} ns"
    )]
    Timeout {
        /// The time-out \[ns\].
        nanos: u64,
        /// The least that makes sense \[ns\].
        least: u64,
    },
    /// A limit on a response in which the longest one does not fit.
    #[error("a limit of {nanos} ns, where the longest response takes {least} ns")]
    Limit {
        /// The limit \[ns\].
        nanos: u64,
        /// The least that makes sense \[ns\].
        least: u64,
    },
    /// A frame without packets, or with more than the bus controller buffers.
    #[error(
        "a frame of {packets} packets, where it takes 1 to {}",
        crate::FRAME_MAX
    )]
    Frame {
        /// How many packets.
        packets: usize,
    },
    /// Bytes that take no time.
    #[error("a byte must take some time")]
    ByteTime,
    /// A transfer is begun while another one goes on.
    #[error("a transfer is going on")]
    Busy,
}
