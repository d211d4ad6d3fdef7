//! Frames: round trip, detection of damage, and independence of the division into pieces.

use proptest::array::{uniform4, uniform8};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use twinrig_phidget::protocol::{Frame, Gain, Message, Setup, match_frame};
use twinrig_testing::framing::{frames, frames_in_any_pieces};
use twinrig_wire::crc16;

fn messages() -> impl Strategy<Value = Message> {
    let bridge = (1..=1000_u16, select(&Gain::ALL[..]));
    let bridge = bridge.prop_map(|(interval_ms, gain)| Setup::Bridge { interval_ms, gain });
    let kit = (0..=1000_u16).prop_map(|trigger| Setup::InterfaceKit { trigger });
    let ratios = (
        any::<u8>(),
        uniform4(any::<bool>()),
        uniform4(-0x80_0000..0x80_0000_i32),
    );
    let readings = (any::<u8>(), uniform8(0..=1000_u16));
    prop_oneof![
        prop_oneof![bridge, kit].prop_map(Message::Setup),
        any::<bool>().prop_map(|done| Message::Accepted { done }),
        ratios.prop_map(|(sequence, overload, counts)| Message::Bridge {
            sequence,
            overload,
            counts
        }),
        readings.prop_map(|(sequence, readings)| Message::InterfaceKit { sequence, readings }),
    ]
}

fn encoded(message: &Message) -> Vec<u8> {
    let mut bytes = Vec::new();
    message.encode(&mut bytes);
    bytes
}

proptest! {
    #[test]
    fn frames_round_trip(message in messages()) {
        let bytes = encoded(&message);
        prop_assert_eq!(Message::try_from(Frame::new(&bytes).unwrap()), Ok(message));
    }

    #[test]
    fn arbitrary_bytes_in_arbitrary_pieces_do_not_panic(
        bytes in vec(prop_oneof![0xf0..=0xf3_u8, any::<u8>()], 0..400),
        cuts in vec(0..400_usize, 0..20),
    ) {
        for frame in &frames_in_any_pieces(match_frame, &bytes, cuts) {
            let _ = Message::try_from(Frame::new(frame).unwrap());
        }
    }

    #[test]
    fn frame_with_a_wrong_bit_is_rejected(message in messages(), bit in any::<Index>()) {
        let mut bytes = encoded(&message);
        let bit = bit.index(8 * bytes.len());
        bytes[bit / 8] ^= 1 << (bit % 8);
        prop_assert!(Frame::new(&bytes).is_err());
    }

    #[test]
    fn frame_after_garbage_is_found(garbage in vec(any::<u8>(), 0..60), message in messages()) {
        let one = encoded(&message);
        let mut bytes = garbage;
        for _ in 0..10 {
            bytes.extend(&one);
        }
        prop_assert!(frames(match_frame, &[&bytes]).0.contains(&one));
    }

    #[test]
    fn decoded_content_re_encodes_identically(message in messages(), body in vec(any::<u8>(), 20)) {
        let mut bytes = encoded(&message);
        let length = bytes.len();
        bytes[1..length - 2].copy_from_slice(&body[..length - 3]);
        let checksum = crc16(&bytes[..length - 2]).to_le_bytes();
        bytes[length - 2..].copy_from_slice(&checksum);
        if let Ok(message) = Message::try_from(Frame::new(&bytes).unwrap()) {
            prop_assert_eq!(encoded(&message), bytes);
        }
    }
}
