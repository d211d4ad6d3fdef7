//! Packets in streams: any content survives, any division into pieces is the same, and damage is
//! found as far as the checksum can.

use proptest::prelude::*;
use twinrig_dynamixel::{Instruction, Packet, Parser, ProtocolVersion, Received, Request};
use twinrig_wire::FrameMatch;

/// Packet as it is received.
type Content = (u8, u8, Vec<u8>);

fn protocols() -> impl Strategy<Value = ProtocolVersion> {
    prop_oneof![Just(ProtocolVersion::One), Just(ProtocolVersion::Two)]
}

/// Bytes of which many are those of headers and stuffing.
fn bytes(most: usize) -> impl Strategy<Value = Vec<u8>> {
    let byte = prop_oneof![any::<u8>(), Just(0xff), Just(0xfd), Just(0)];
    prop::collection::vec(byte, 0..=most)
}

fn contents() -> impl Strategy<Value = Content> {
    (0_u8..=0xfc, any::<u8>(), bytes(40))
}

fn encoded(protocol: ProtocolVersion, (id, code, parameters): &Content) -> Vec<u8> {
    let packet = Packet {
        id: *id,
        code: *code,
        parameters,
    };
    let mut bytes = Vec::new();
    protocol.encode(&packet, &mut bytes).unwrap();
    bytes
}

/// Returns the packets of a stream in pieces of these lengths, the numbers of damaged packets and
/// of bytes outside packets.
fn parsed(
    protocol: ProtocolVersion,
    mut stream: &[u8],
    pieces: &[usize],
) -> (Vec<Content>, usize, u64) {
    let mut parser = Parser::new(protocol);
    let (mut found, mut damaged) = (Vec::new(), 0);
    let mut pieces = pieces.iter().copied().chain(std::iter::repeat(usize::MAX));
    while !stream.is_empty() {
        let (piece, rest) = stream.split_at(pieces.next().unwrap().min(stream.len()));
        stream = rest;
        parser.push(piece);
        loop {
            match parser.next_packet() {
                Some(Received::Packet(it)) => {
                    found.push((it.id, it.code, it.parameters.to_vec()));
                }
                Some(Received::Damaged { .. }) => damaged += 1,
                None => break,
            }
        }
        assert!(parser.missing() >= 1);
    }
    (found, damaged, parser.skipped())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1_000))]

    #[test]
    fn packets_of_any_content_are_found_in_any_pieces(
        protocol in protocols(), sent in prop::collection::vec(contents(), 1..6),
        pieces in prop::collection::vec(1_usize..40, 0..40),
    ) {
        let stream: Vec<u8> = sent.iter().flat_map(|it| encoded(protocol, it)).collect();
        prop_assert_eq!(parsed(protocol, &stream, &pieces), (sent, 0, 0));
    }

    #[test]
    fn division_of_arbitrary_bytes_makes_no_difference(
        protocol in protocols(), stream in bytes(300),
        pieces in prop::collection::vec(1_usize..40, 0..40),
    ) {
        prop_assert_eq!(parsed(protocol, &stream, &pieces), parsed(protocol, &stream, &[]));
    }

    /// No header but that of the packet: the search for one cannot begin within it.
    #[test]
    fn stuffed_packets_have_one_header(content in contents()) {
        let packet = encoded(ProtocolVersion::Two, &content);
        let inside = &packet[4..packet.len() - 2];
        prop_assert!(!inside.windows(4).any(|it| it[..3] == [0xff, 0xff, 0xfd] && it[3] != 0xfd));
    }

    #[test]
    fn the_beginning_of_a_packet_is_incomplete(protocol in protocols(), content in contents()) {
        let packet = encoded(protocol, &content);
        for kept in 0..packet.len() {
            let FrameMatch::Missing(count) = protocol.match_frame(&packet[..kept]) else {
                panic!("{kept} bytes of {packet:02x?}");
            };
            prop_assert!(count >= 1 && kept + count <= packet.len());
        }
        prop_assert_eq!(protocol.match_frame(&packet), FrameMatch::Frame(packet.len()));
    }

    #[test]
    fn packets_behind_garbage_are_found(
        protocol in protocols(), garbage in bytes(30), content in contents(),
    ) {
        // Enough bytes to complete what seems to begin in the garbage.
        let packet = encoded(protocol, &content);
        let stream = [garbage, packet.repeat(100)].concat();
        prop_assert!(parsed(protocol, &stream, &[]).0.contains(&content));
    }

    #[test]
    fn requests_of_arbitrary_parameters_do_not_panic(protocol in protocols(), content in contents()) {
        let packet = encoded(protocol, &content);
        let mut buffer = Vec::new();
        let packet = protocol.decode(&packet, &mut buffer).unwrap();
        if let Ok(request) = Request::decode(protocol, &packet) {
            let mut bytes = Vec::new();
            request.encode(protocol, content.0, &mut bytes).unwrap();
            let mut buffer = Vec::new();
            let again = protocol.decode(&bytes, &mut buffer).unwrap();
            prop_assert_eq!(Request::decode(protocol, &again), Ok(request));
        }
    }
}

/// Of 10⁵ packets with one wrong bit, none is accepted in protocol 2.0: a CRC of 16 bits finds
/// each. In protocol 1.0 fewer than 1 % are: a wrong length makes a packet of other bytes, of whose
/// sums one in 256 is right by chance.
#[test]
fn wrong_bits_are_found() {
    for protocol in [ProtocolVersion::One, ProtocolVersion::Two] {
        let mut random = twinrig_kernel::stream(1, "wrong bits");
        let mut accepted = 0;
        for _ in 0..100_000 {
            let mut number = |end: u64| usize::try_from(random.between(0, end - 1)).unwrap();
            let content = (
                u8::try_from(number(253)).unwrap(),
                u8::try_from(number(256)).unwrap(),
                (0..number(20))
                    .map(|_| u8::try_from(number(256)).unwrap())
                    .collect(),
            );
            let mut packet = encoded(protocol, &content);
            let bit = number(8 * packet.len() as u64);
            packet[bit / 8] ^= 1 << (bit % 8);
            let followed = [packet, encoded(protocol, &content)].concat();
            let (found, ..) = parsed(protocol, &followed, &[]);
            accepted += found.iter().filter(|it| **it != content).count();
        }
        match protocol {
            ProtocolVersion::Two => assert_eq!(accepted, 0),
            ProtocolVersion::One => assert!((1..1_000).contains(&accepted), "{accepted}"),
        }
    }
}

#[test]
fn packets_that_are_too_long_are_refused() {
    for (protocol, most) in [(ProtocolVersion::One, 253), (ProtocolVersion::Two, 1_014)] {
        let fits = (1, 3, vec![0; most]);
        assert_eq!(encoded(protocol, &fits).len(), protocol.packet_max());
        let parameters = &vec![0; most + 1];
        let packet = Packet {
            id: 1,
            code: 3,
            parameters,
        };
        let mut bytes = vec![7];
        assert!(protocol.encode(&packet, &mut bytes).is_err());
        assert_eq!(bytes, [7]);
    }
}

#[test]
fn kinds_have_the_names_of_decoders() {
    for protocol in [ProtocolVersion::One, ProtocolVersion::Two] {
        for (name, code) in protocol.frames().kinds {
            assert_eq!(*name, Instruction(*code).to_string());
        }
    }
}
