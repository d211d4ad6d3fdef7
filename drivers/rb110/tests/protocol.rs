//! Frames: round trip, detection of damage, and independence of the division into pieces.

use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use twinrig_rb110::protocol::{Answer, Frame, Request, TICKS_MAX, match_frame};
use twinrig_testing::framing::{frames, frames_in_any_pieces};
use twinrig_wire::FrameMatch;

fn requests() -> impl Strategy<Value = Request> {
    let pulses = proptest::array::uniform16(option::of(0..=TICKS_MAX));
    let inputs = proptest::array::uniform8(any::<bool>());
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
    let counts = proptest::array::uniform8(option::of(0..1024_u16));
    (any::<u8>(), any::<bool>(), counts).prop_map(|(sequence, replaced, counts)| Answer {
        sequence,
        replaced,
        counts,
    })
}

proptest! {
    #[test]
    fn frames_round_trip(request in requests(), answer in answers()) {
        let (mut encoded_request, mut encoded_answer) = (Vec::new(), Vec::new());
        request.encode(&mut encoded_request);
        answer.encode(&mut encoded_answer);
        prop_assert_eq!(Request::try_from(Frame::new(&encoded_request).unwrap()), Ok(request));
        prop_assert_eq!(Answer::try_from(Frame::new(&encoded_answer).unwrap()), Ok(answer));
        prop_assert!(Request::try_from(Frame::new(&encoded_answer).unwrap()).is_err());
        prop_assert!(Answer::try_from(Frame::new(&encoded_request).unwrap()).is_err());
    }

    #[test]
    fn arbitrary_bytes_in_arbitrary_pieces_do_not_panic(bytes in vec(any::<u8>(), 0..400), cuts in vec(0..400_usize, 0..20)) {
        for frame in &frames_in_any_pieces(match_frame, &bytes, cuts) {
            let frame = Frame::new(frame).unwrap();
            let _ = (Request::try_from(frame), Answer::try_from(frame));
        }
    }

    #[test]
    fn frame_with_a_wrong_bit_is_rejected(request in requests(), bit in any::<prop::sample::Index>()) {
        let mut bytes = Vec::new();
        request.encode(&mut bytes);
        let bit = bit.index(8 * bytes.len());
        bytes[bit / 8] ^= 1 << (bit % 8);
        prop_assert!(Frame::new(&bytes).is_err());
    }

    #[test]
    fn frame_after_garbage_is_found(garbage in vec(any::<u8>(), 0..60), answer in answers()) {
        // Enough bytes to complete a frame that seems to begin in the garbage.
        let mut bytes = garbage.clone();
        let mut encoded = Vec::new();
        answer.encode(&mut encoded);
        for _ in 0..10 {
            bytes.extend(&encoded);
        }
        prop_assert!(frames(match_frame, &[&bytes]).0.contains(&encoded));
    }

    #[test]
    fn decoded_content_re_encodes_identically(body in vec(any::<u8>(), 0..30), header in 0xb1..=0xb2_u8) {
        let mut bytes = vec![header, u8::try_from(body.len() + 5).unwrap(), 7];
        bytes.extend(&body);
        let checksum = twinrig_wire::crc16(&bytes);
        bytes.extend(checksum.to_le_bytes());
        if let Ok(frame) = Frame::new(&bytes) {
            let mut again = Vec::new();
            match (Request::try_from(frame), Answer::try_from(frame)) {
                (Ok(request), Err(_)) => request.encode(&mut again),
                (Err(_), Ok(answer)) => answer.encode(&mut again),
                (Err(_), Err(_)) => again.clone_from(&bytes),
                (Ok(_), Ok(_)) => {}
            }
            prop_assert_eq!(again, bytes);
        }
    }

    #[test]
    fn missing_count_never_exceeds_the_frame(request in requests(), kept in any::<prop::sample::Index>()) {
        let mut bytes = Vec::new();
        request.encode(&mut bytes);
        let kept = kept.index(bytes.len());
        match match_frame(&bytes[..kept]) {
            FrameMatch::Missing(count) => prop_assert!(count >= 1 && kept + count <= bytes.len()),
            other => prop_assert!(false, "{other:?}"),
        }
    }
}
