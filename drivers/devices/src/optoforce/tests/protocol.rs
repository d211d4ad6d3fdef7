//! Frames: round trip, detection of damage, and independence of the division into pieces.

use crate::FramedDevice;
use crate::optoforce::OptoForce;
use crate::optoforce::protocol::{Counts, Cutoff, Health, Message, Speed, Status};
use crate::tests::check_frames;
use proptest::array::{uniform3, uniform4, uniform6};
use proptest::prelude::*;
use proptest::sample::select;
use twinrig_testing::framing::{check_damaged_bursts, has_sum16};
use twinrig_wire::{FrameError, FramedMessage};

fn messages() -> impl Strategy<Value = Message> {
    let counts = prop_oneof![
        uniform3(any::<i16>()).prop_map(Counts::Three),
        uniform4(uniform3(any::<i16>())).prop_map(Counts::Four),
        uniform6(any::<i16>()).prop_map(Counts::Six),
    ];
    let data =
        (any::<u16>(), any::<u16>(), counts).prop_map(|(counter, status, counts)| Message::Data {
            counter,
            status: Status(status),
            counts,
        });
    let configuration = (select(Speed::ALL), select(Cutoff::ALL), any::<bool>());
    prop_oneof![
        data,
        configuration.prop_map(|(speed, cutoff, zero)| Message::Configuration {
            speed,
            cutoff,
            zero
        }),
        any::<u8>().prop_map(|status| Message::Acknowledgement { status }),
    ]
}

#[test]
fn frames_match_the_documentation() {
    let data = Message::Data {
        counter: 0x0102,
        status: Status(0),
        counts: Counts::Three([1, -1, 0x0203]),
    };
    let expected = [
        0xaa, 7, 8, 10, 1, 2, 0, 0, 0, 1, 0xff, 0xff, 2, 3, 0x02, 0xca,
    ];
    assert_eq!(data.to_frame(), expected);
    let configuration = Message::Configuration {
        speed: Speed::Hz100,
        cutoff: Cutoff::Hz15,
        zero: true,
    };
    assert_eq!(
        configuration.to_frame(),
        [0xaa, 0, 50, 3, 10, 4, 255, 1, 0xec]
    );
    let acknowledgement = Message::Acknowledgement { status: 0 }.to_frame();
    assert_eq!(acknowledgement, [0xaa, 0, 80, 1, 0, 0, 0xfb]);
    let lengths = [Counts::Four([[0; 3]; 4]), Counts::Six([0; 6])].map(|counts| {
        let status = Status(0);
        let counter = 0;
        let data = Message::Data {
            counter,
            status,
            counts,
        };
        data.to_frame().len()
    });
    assert_eq!(lengths, [34, 22]);
}

#[test]
fn status_bits_are_decoded() {
    // Electronics 010, sensor 100, overloads 100001, one of several: 1, number 101.
    let status = Status(0b0101_0010_0001_1101);
    assert_eq!(
        (status.electronics(), status.health()),
        (2, Health::Temperature)
    );
    assert_eq!(status.overload(), [true, false, false, false, false, true]);
    assert_eq!((status.several(), status.number()), (true, 5));
    let status = Status(0xfc0f).with_overload([false, true, false]);
    assert_eq!(status.overload(), [false, true, false, false, false, false]);
    assert_eq!(status.0 & 0xfc0f, 0xfc0f);
}

#[test]
fn undefined_codes_are_rejected() {
    let configuration = Message::Configuration {
        speed: Speed::Stop,
        cutoff: Cutoff::None,
        zero: false,
    };
    for (at, code) in [(4, 2), (5, 7), (6, 1)] {
        let mut frame = configuration.to_frame();
        frame[at] = code;
        frame[8] += code;
        assert_eq!(Message::decode(&frame), Err(FrameError::Range));
    }
}

#[test]
fn wrong_checksums_are_rejected_without_panic() {
    let data = (0..3_u16).map(|counter| Message::Data {
        counter,
        status: Status(0),
        counts: Counts::Three([1, -2, 300]),
    });
    let messages = data.chain([Message::Acknowledgement { status: 0 }]);
    let frames = messages.map(|message| message.to_frame()).collect();
    let driver = OptoForce::new("optoforce", "force").driver().unwrap();
    check_damaged_bursts::<Message>(frames, has_sum16, driver);
}

#[test]
fn frames_are_found_and_damage_is_detected() {
    let of_headers = select(&[0xaa, 7, 8, 10, 0, 50, 3, 80, 1][..]);
    check_frames(messages(), prop_oneof![3 => of_headers, 1 => any::<u8>()]);
}
