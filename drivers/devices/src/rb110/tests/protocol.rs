//! Frames: round trip, detection of damage, and independence of the division into pieces.

use crate::FramedDevice;
use crate::rb110::protocol::{Answer, Request, TICKS_MAX};
use crate::rb110::{PulseMap, Rb110};
use crate::tests::{check_frames, framed};
use proptest::array::{uniform8, uniform16};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use twinrig_testing::framing::{check_arbitrary_bytes, check_damaged_bursts, has_crc16};
use twinrig_wire::{FrameError, FrameMatch, FramedMessage};

fn requests() -> impl Strategy<Value = Request> {
    let pulses = uniform16(option::of(0..=TICKS_MAX));
    let inputs = uniform8(any::<bool>());
    (any::<u8>(), any::<bool>(), pulses, inputs).prop_map(|(sequence, twice, pulses, inputs)| {
        Request {
            sequence,
            twice,
            pulses,
            inputs,
        }
    })
}

fn answers() -> impl Strategy<Value = Answer> {
    let counts = uniform8(option::of(0..1024_u16));
    (any::<u8>(), any::<bool>(), counts).prop_map(|(sequence, replaced, counts)| Answer {
        sequence,
        replaced,
        counts,
    })
}

#[test]
fn frames_match_the_documentation() {
    let mut request = Request {
        sequence: 7,
        twice: true,
        ..Request::default()
    };
    request.pulses[1] = Some(0);
    request.pulses[15] = Some(60_000);
    request.inputs[3] = true;
    let content = [0xb1, 15, 7, 1, 0x02, 0x80, 0x08, 0, 0, 0, 0x60, 0xea, 0];
    assert_eq!(request.to_frame(), framed(&content));
    let mut answer = Answer {
        sequence: 7,
        replaced: true,
        ..Answer::default()
    };
    answer.counts[3] = Some(1023);
    assert_eq!(
        answer.to_frame(),
        framed(&[0xb2, 9, 7, 1, 0x08, 0xff, 0x03])
    );
}

#[test]
fn invalid_content_is_rejected_with_its_reason() {
    let request = |content: &[u8]| Request::decode(&framed(content)).unwrap_err();
    let answer = |content: &[u8]| Answer::decode(&framed(content)).unwrap_err();
    // Range 2; a pulse of 500 001 ticks; two lines, but one width; a width without a line.
    assert_eq!(request(&[0xb1, 9, 0, 2, 0, 0, 0]), FrameError::Range);
    let long_pulse = [0xb1, 12, 0, 0, 1, 0, 0, 0x21, 0xa1, 7];
    assert_eq!(request(&long_pulse), FrameError::Range);
    let missing_width = [0xb1, 12, 0, 0, 3, 0, 0, 1, 0, 0];
    assert_eq!(request(&missing_width), FrameError::Length);
    let excess_width = [0xb1, 12, 0, 0, 0, 0, 0, 1, 0, 0];
    assert_eq!(request(&excess_width), FrameError::Length);
    // Status 2; a count of 1024; half a count.
    assert_eq!(answer(&[0xb2, 7, 0, 2, 0]), FrameError::Range);
    assert_eq!(answer(&[0xb2, 9, 0, 0, 1, 0, 4]), FrameError::Range);
    assert_eq!(answer(&[0xb2, 8, 0, 0, 1, 0]), FrameError::Length);
    let other_direction = Answer::default().to_frame();
    let error = Request::decode(&other_direction).unwrap_err();
    assert_eq!(error, FrameError::WrongDirection);
}

#[test]
fn lengths_outside_the_range_of_a_direction_are_garbage() {
    for (header, shortest, longest) in [(0xb1, 9, 57), (0xb2, 7, 23)] {
        for length in 0..=255 {
            let expected = if (shortest..=longest).contains(&length) {
                FrameMatch::Missing(usize::from(length) - 2)
            } else {
                FrameMatch::Garbage
            };
            assert_eq!(Request::match_frame(&[header, length]), expected);
        }
    }
}

/// The examples of `docs/rb110.md`.
#[test]
fn frames_of_the_page_are_decoded_and_encoded() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/rb110.md");
    let page = std::fs::read_to_string(page).unwrap();
    let frames = |beginning: &'static str| {
        let lines = page.lines().filter(move |line| line.starts_with(beginning));
        let byte = |text: &str| u8::from_str_radix(text, 16).unwrap();
        lines.map(move |line| line.split(' ').skip(1).map(byte).collect::<Vec<u8>>())
    };
    let requests: Vec<_> = frames("> B1 ").collect();
    assert_eq!(requests.len(), 2);
    for frame in &requests {
        assert_eq!(Request::decode(frame).unwrap().to_frame(), *frame);
    }
    let last = Request::decode(&requests[1]).unwrap();
    assert_eq!((last.sequence, last.pulses[15]), (2, Some(60_000)));
    for frame in frames("< B2 ") {
        assert_eq!(Answer::decode(&frame).unwrap().to_frame(), frame);
    }
}

#[test]
fn wrong_checksums_are_rejected_without_panic() {
    let servos = |sequence| Request {
        sequence,
        twice: sequence == 2,
        pulses: [Some(75_000); 16],
        inputs: [true; 8],
    };
    let answers = |sequence| Answer {
        sequence,
        replaced: false,
        counts: [Some(512); 8],
    };
    let frames = (0..3).flat_map(|n| [servos(n).to_frame(), answers(n).to_frame()]);
    let board = Rb110::with_servos("rb110", PulseMap::ONCILLA, &[(15, "LF")]);
    check_damaged_bursts::<Request>(frames.collect(), has_crc16, board.driver().unwrap());
}

#[test]
fn frames_are_found_and_damage_is_detected() {
    check_frames(requests(), any::<u8>());
    check_frames(answers(), any::<u8>());
}

proptest! {
    #[test]
    fn decoded_content_re_encodes_identically(
        fields in vec(any::<u8>(), 0..30), header in 0xb1..=0xb2_u8,
    ) {
        let length = u8::try_from(fields.len() + 4).unwrap();
        let frame = framed(&[&[header, length][..], &fields].concat());
        check_arbitrary_bytes::<Request>(&frame, Vec::new());
        check_arbitrary_bytes::<Answer>(&frame, Vec::new());
    }
}
