//! Frames: round trip, detection of damage, and independence of the division into pieces.

use crate::FramedDevice;
use crate::phidget::protocol::{Gain, Message, Setup};
use crate::phidget::{Board, Phidget};
use crate::tests::{check_frames, framed};
use proptest::array::{uniform4, uniform8};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;
use twinrig_testing::framing::{check_arbitrary_bytes, check_damaged_bursts, has_crc16};
use twinrig_wire::{FrameError, FramedMessage};

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

#[test]
fn frames_match_the_documentation() {
    let bridge = Setup::Bridge {
        interval_ms: 0x0108,
        gain: Gain::X64,
    };
    let kit = Setup::InterfaceKit { trigger: 0x0203 };
    let ratios = Message::Bridge {
        sequence: 9,
        overload: [false, true, false, true],
        counts: [1, -1, 0x01_0203, -0x80_0000],
    };
    let readings = Message::InterfaceKit {
        sequence: 9,
        readings: [0, 1, 2, 3, 4, 5, 6, 1000],
    };
    let expected: [(Message, &[u8]); 6] = [
        (Message::Setup(bridge), &[0xf0, 1, 0x08, 0x01, 5]),
        (Message::Setup(kit), &[0xf0, 2, 0x03, 0x02, 0]),
        (Message::Accepted { done: true }, &[0xf1, 0]),
        (Message::Accepted { done: false }, &[0xf1, 1]),
        (
            ratios,
            &[0xf2, 9, 0b1010, 1, 0, 0, 255, 255, 255, 3, 2, 1, 0, 0, 128],
        ),
        (
            readings,
            &[0xf3, 9, 0, 0, 1, 0, 2, 0, 3, 0, 4, 0, 5, 0, 6, 0, 0xe8, 3],
        ),
    ];
    for (message, content) in expected {
        assert_eq!(message.to_frame(), framed(content));
    }
}

#[test]
fn numbers_out_of_range_are_rejected() {
    let mut readings = [0; 18];
    (readings[0], readings[2], readings[3]) = (0xf3, 0xe9, 3);
    let mut ratios = [0; 15];
    (ratios[0], ratios[2]) = (0xf2, 0x10);
    let contents: [&[u8]; 9] = [
        &[0xf0, 1, 0, 0, 1],
        &[0xf0, 1, 0xe9, 3, 1],
        &[0xf0, 1, 8, 0, 0],
        &[0xf0, 1, 8, 0, 7],
        &[0xf0, 2, 10, 0, 1],
        &[0xf0, 2, 10, 0, 7],
        &[0xf1, 2],
        &readings,
        &ratios,
    ];
    for content in contents {
        let decoded = Message::decode(&framed(content));
        assert_eq!(decoded, Err(FrameError::Range), "{content:02x?}");
    }
}

#[test]
fn wrong_checksums_are_rejected_without_panic() {
    let messages = [
        Message::Accepted { done: true },
        Message::Bridge {
            sequence: 1,
            overload: [false; 4],
            counts: [1, -1, 70_000, 0],
        },
        Message::InterfaceKit {
            sequence: 2,
            readings: [500; 8],
        },
    ];
    let frames = messages.map(|message| message.to_frame());
    let driver = Phidget::new("phidget", Board::default()).driver().unwrap();
    check_damaged_bursts::<Message>(frames.into(), has_crc16, driver);
}

#[test]
fn frames_are_found_and_damage_is_detected() {
    check_frames(messages(), prop_oneof![0xf0..=0xf3_u8, any::<u8>()]);
}

proptest! {
    #[test]
    fn decoded_content_re_encodes_identically(message in messages(), content in vec(any::<u8>(), 20)) {
        let frame = message.to_frame();
        let content = &content[..frame.len() - 3];
        check_arbitrary_bytes::<Message>(&framed(&[&frame[..1], content].concat()), Vec::new());
    }
}
