//! Feetech servos of the STS and SCS series. Their packets are those of Dynamixel's protocol 1.0,
//! those of STS with sync read as in 2.0; `twinrig-dynamixel` has them, the driver, the emulated
//! servo and the bus. This crate adds the control tables as data ([`STS3215`], [`SCS0009`]) and the
//! firmware ([`FeetechFirmware`]). Numbers of the SCS series have the high byte first.
//!
//! - Writes are not refused: values are limited, and answers report hardware errors alone. A servo
//!   does not answer damaged and unknown instructions. ASSUMED.
//! - Writes to the EEPROM take effect at once, and are lost at a restart while the lock is on.
//! - The return delay is constant: the register has no effect (manual of the STS series).
//!
//! ```
//! use twinrig_dynamixel::{ProtocolVersion, Request, Responder, Span};
//! use twinrig_feetech::STS3215;
//! use twinrig_kernel::{SimDuration, SimTime};
//! use twinrig_wire::Piece;
//!
//! let byte_time = SimDuration::from_micros(10);
//! let mut servo = Responder::new(STS3215.model, 1, byte_time);
//! let mut request = Vec::new();
//! let model = Span { address: 3, length: 2 };
//! Request::Read(model).encode(ProtocolVersion::One, 1, &mut request)?;
//! let first = SimTime::ZERO + byte_time;
//! let piece = Piece { first, spacing: byte_time, bytes: &request, framing_error: false };
//! servo.receive(piece);
//! servo.handle(piece.last());
//! let mut answer = Vec::new();
//! servo.poll_transmit(&mut answer);
//! // Model 777: header, identifier, length, error, data, checksum.
//! assert_eq!(answer, [0xff, 0xff, 1, 4, 0, 9, 3, 0xee]);
//! # Ok::<(), twinrig_dynamixel::PacketError>(())
//! ```
//!
//! Out of scope: step mode, bits 0 and 7 of the phase; the time of a motion of the SCS series; the
//! gains `D` and `I` of the position and both of the speed, of which no source says the effect.

mod firmware;
pub mod register;
mod scs0009;
mod sts3215;

pub use firmware::FeetechFirmware;
pub use scs0009::SCS0009;
pub use sts3215::STS3215;
