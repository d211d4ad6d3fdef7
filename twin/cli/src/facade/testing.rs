//! Test harnesses, with the cargo feature `testing`: drivers and emulated devices step by step,
//! rigs around a driver, framing, laws of drivers with their devices, plants with commands and
//! signals, robots, other programs.
//!
//! ```toml
//! [dev-dependencies]
//! twinrig = { version = "0.1", features = ["testing"] }
//! ```
//!
//! ```
//! use twinrig::testing::framing;
//! # use twinrig::bus::{FrameError, FrameMatch, FramedMessage};
//! # #[derive(Debug, PartialEq)]
//! # struct Letter(u8);
//! # impl FramedMessage for Letter {
//! #     fn match_frame(front: &[u8]) -> FrameMatch {
//! #         match front {
//! #             [b'[', _, b']', ..] => FrameMatch::Frame(3),
//! #             [] => FrameMatch::Missing(3),
//! #             [b'['] => FrameMatch::Missing(2),
//! #             [b'[', _] => FrameMatch::Missing(1),
//! #             _ => FrameMatch::Garbage,
//! #         }
//! #     }
//! #     fn decode(frame: &[u8]) -> Result<Self, FrameError> { Ok(Self(frame[1])) }
//! #     fn encode(&self, bytes: &mut Vec<u8>) { bytes.extend([b'[', self.0, b']']); }
//! # }
//! // Letters are `[x]`: two frames, the second in two pieces, and a byte of garbage.
//! let (received, garbage) = framing::frames::<Letter>(&[b"[a]?[", b"b]"]);
//! assert_eq!(received, [b"[a]", b"[b]"]);
//! assert_eq!(garbage, 1);
//! ```

#[doc(inline)]
pub use twinrig_testing::*;
