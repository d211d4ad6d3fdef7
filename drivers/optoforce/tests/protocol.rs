//! Frames: round trip, detection of damage, and independence of the division into pieces.

use proptest::array::{uniform3, uniform4, uniform6};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use twinrig_optoforce::protocol::{
    Counts, Cutoff, Frame, FrameError, Health, Message, Speed, Status, match_frame,
};
use twinrig_testing::framing::{frames, frames_in_any_pieces};

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

fn encoded(message: &Message) -> Vec<u8> {
    let mut bytes = Vec::new();
    message.encode(&mut bytes);
    bytes
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
    assert_eq!(encoded(&data), expected);
    let configuration = Message::Configuration {
        speed: Speed::Hz100,
        cutoff: Cutoff::Hz15,
        zero: true,
    };
    assert_eq!(
        encoded(&configuration),
        [0xaa, 0, 50, 3, 10, 4, 255, 1, 0xec]
    );
    let acknowledgement = encoded(&Message::Acknowledgement { status: 0 });
    assert_eq!(acknowledgement, [0xaa, 0, 80, 1, 0, 0, 0xfb]);
    let lengths = [Counts::Four([[0; 3]; 4]), Counts::Six([0; 6])].map(|counts| {
        let status = Status(0);
        let counter = 0;
        encoded(&Message::Data {
            counter,
            status,
            counts,
        })
        .len()
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
    let mut bytes = encoded(&Message::Configuration {
        speed: Speed::Stop,
        cutoff: Cutoff::None,
        zero: false,
    });
    bytes[4] = 2;
    bytes[8] += 2;
    let result = Message::try_from(Frame::new(&bytes).unwrap());
    assert_eq!(
        result,
        Err(FrameError::Code {
            what: "speed",
            code: 2
        })
    );
}

proptest! {
    #[test]
    fn frames_round_trip(message in messages()) {
        let bytes = encoded(&message);
        prop_assert_eq!(Message::try_from(Frame::new(&bytes).unwrap()), Ok(message));
    }

    #[test]
    fn arbitrary_bytes_in_arbitrary_pieces_do_not_panic(
        bytes in vec(prop_oneof![3 => select(&[0xaa, 7, 8, 10, 0, 50, 3, 80, 1][..]), 1 => any::<u8>()], 0..400),
        cuts in vec(0..400_usize, 0..20),
    ) {
        for frame in &frames_in_any_pieces(match_frame, &bytes, cuts) {
            if let Ok(message) = Message::try_from(Frame::new(frame).unwrap()) {
                prop_assert_eq!(&encoded(&message), frame);
            }
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
}
