//! Frames: round trip, detection of damage, and independence of the division into pieces.

use proptest::array::{uniform2, uniform3};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;
use twinrig_tactile::protocol::{Command, Message, Status};
use twinrig_testing::framing::{check_arbitrary_bytes, check_message, check_wrong_bit};
use twinrig_wire::{FrameError, FrameMatch, FramedMessage, crc16};

const HEADERS: [u8; 6] = [0xb0, 0xb1, 0xb2, 0xb3, 0xb8, 0xb9];

fn messages() -> impl Strategy<Value = Message> {
    use Command::{Start, Stop, Unknown, Zero};
    let start = (1..=65_u16, select(&[1_u8, 2, 4][..]));
    let start = start.prop_map(|(millis, oversampling)| Message::Start {
        period_us: 1000 * millis,
        oversampling,
    });
    let clock = (any::<u8>(), any::<u32>(), any::<u64>());
    let clock = clock.prop_map(|(boot, stamp, host_ns)| Message::Clock {
        boot,
        stamp,
        host_ns,
    });
    let command = (select(&[Start, Stop, Zero, Unknown][..]), any::<bool>());
    let numbers = (any::<u8>(), any::<u16>(), any::<u32>());
    let readings = (uniform2(any::<i16>()), -0x80_0000..0x80_0000_i32);
    let status = (uniform3(any::<bool>()), any::<bool>(), any::<bool>());
    let data = (numbers, readings, status).prop_map(
        |((boot, sequence, stamp), (volts, bridge), (saturated, overrun, anti_aliased))| {
            Message::Data {
                boot,
                sequence,
                stamp,
                volts,
                bridge,
                status: Status {
                    saturated,
                    overrun,
                    anti_aliased,
                },
            }
        },
    );
    prop_oneof![
        start,
        Just(Message::Stop),
        Just(Message::Zero),
        clock,
        command.prop_map(|(command, done)| Message::Acknowledgement { command, done }),
        data,
    ]
}

/// Returns a frame with this content.
fn framed(content: &[u8]) -> Vec<u8> {
    [content, &crc16(content).to_le_bytes()].concat()
}

#[test]
fn frames_match_the_documentation() {
    let start = Message::Start {
        period_us: 0x03e8,
        oversampling: 4,
    };
    let clock = Message::Clock {
        boot: 7,
        stamp: 0x0102_0304,
        host_ns: 0x0506_0708_090a_0b0c,
    };
    let rejected = Message::Acknowledgement {
        command: Command::Zero,
        done: false,
    };
    let data = Message::Data {
        boot: 7,
        sequence: 0x0102,
        stamp: 0x0304_0506,
        volts: [1, -2],
        bridge: -0x80_0000,
        status: Status {
            saturated: [false, true, true],
            overrun: false,
            anti_aliased: true,
        },
    };
    let contents: [(Message, &[u8]); 6] = [
        (start, &[0xb0, 0xe8, 0x03, 4]),
        (Message::Stop, &[0xb1]),
        (Message::Zero, &[0xb2]),
        (clock, &[0xb3, 7, 4, 3, 2, 1, 12, 11, 10, 9, 8, 7, 6, 5]),
        (rejected, &[0xb8, 0xb2, 1]),
        (
            data,
            &[
                0xb9, 7, 2, 1, 6, 5, 4, 3, 1, 0, 0xfe, 0xff, 0, 0, 0x80, 0b1_0110,
            ],
        ),
    ];
    for (message, content) in contents {
        assert_eq!(message.to_frame(), framed(content));
    }
}

#[test]
fn undefined_codes_are_rejected() {
    let mut data = [0; 16];
    (data[0], data[15]) = (0xb9, 0x20);
    let contents: [&[u8]; 6] = [
        &[0xb0, 0, 0, 1],
        &[0xb0, 0xe9, 3, 1],
        &[0xb0, 0xe8, 3, 3],
        &[0xb8, 0xb3, 0],
        &[0xb8, 0xb0, 2],
        &data,
    ];
    for content in contents {
        let decoded = Message::decode(&framed(content));
        assert_eq!(decoded, Err(FrameError::Range), "{content:02x?}");
    }
}

proptest! {
    #[test]
    fn message_is_decoded_identically_amid_garbage(
        message in messages(), garbage in vec(any::<u8>(), 0..60),
    ) {
        check_message(&message, &garbage);
    }

    #[test]
    fn arbitrary_bytes_in_arbitrary_pieces_do_not_panic(
        bytes in vec(prop_oneof![select(&HEADERS[..]), any::<u8>()], 0..400),
        cuts in vec(0..400_usize, 0..20),
    ) {
        check_arbitrary_bytes::<Message>(&bytes, cuts);
    }

    #[test]
    fn frame_with_a_wrong_bit_is_rejected(message in messages(), bit in any::<usize>()) {
        check_wrong_bit(&message, bit);
    }

    /// The reason for a CRC: a sum detects neither.
    #[test]
    fn exchanged_bytes_and_triple_errors_are_rejected(
        message in messages(), places in uniform3(any::<prop::sample::Index>()),
    ) {
        let frame = message.to_frame();
        let mut damaged = frame.clone();
        let [a, b, _] = places.map(|place| place.index(frame.len() - 1) + 1);
        damaged.swap(a, b);
        // The length is that of the header, which is unchanged.
        if damaged != frame {
            prop_assert_ne!(Message::match_frame(&damaged), FrameMatch::Frame(frame.len()));
        }
        damaged.clone_from(&frame);
        for place in places {
            let bit = 8 + place.index(8 * (frame.len() - 1));
            damaged[bit / 8] ^= 1 << (bit % 8);
        }
        if damaged != frame {
            prop_assert_ne!(Message::match_frame(&damaged), FrameMatch::Frame(frame.len()));
        }
    }

    #[test]
    fn decoded_content_re_encodes_identically(message in messages(), content in vec(any::<u8>(), 20)) {
        let frame = message.to_frame();
        let content = &content[..frame.len() - 3];
        check_arbitrary_bytes::<Message>(&framed(&[&frame[..1], content].concat()), Vec::new());
    }
}
