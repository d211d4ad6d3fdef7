use proptest::collection::vec;
use proptest::prelude::*;

use super::*;

const BAUD: u32 = 3_333_333;

#[derive(Clone, Debug, PartialEq, Eq)]
enum Element {
    Data(Vec<u8>),
    Negotiation(TelnetVerb, u8),
    Subnegotiation(u8, Vec<u8>),
}

impl Element {
    fn push(&self, bytes: &mut Vec<u8>) {
        match self {
            Self::Data(data) => push_data(data, bytes),
            Self::Negotiation(verb, option) => push_negotiation(*verb, *option, bytes),
            Self::Subnegotiation(option, parameters) => {
                push_subnegotiation(*option, parameters, bytes);
            }
        }
    }
}

/// Bytes, every other one with a meaning in Telnet or RFC 2217.
fn byte() -> impl Strategy<Value = u8> {
    let special = vec![0, 3, 44, 240, 250, 251, 252, 253, 254, 255, 255, 255];
    prop_oneof![any::<u8>(), prop::sample::select(special)]
}

fn element() -> impl Strategy<Value = Element> {
    let verbs = [
        TelnetVerb::Will,
        TelnetVerb::Wont,
        TelnetVerb::Do,
        TelnetVerb::Dont,
    ];
    let parameters = vec(byte(), 0..SUBNEGOTIATION_MAX);
    prop_oneof![
        vec(byte(), 1..100).prop_map(Element::Data),
        (prop::sample::select(verbs.to_vec()), byte())
            .prop_map(|(verb, option)| Element::Negotiation(verb, option)),
        (byte(), parameters).prop_map(|(option, it)| Element::Subnegotiation(option, it)),
    ]
}

/// Cuts `bytes` into pieces of these lengths, in turn.
fn pieces<'a>(bytes: &'a [u8], lengths: &'a [usize]) -> impl Iterator<Item = &'a [u8]> {
    let mut rest = bytes;
    let mut lengths = lengths.iter().cycle();
    std::iter::from_fn(move || {
        let length = rest.len().min(*lengths.next()?);
        let (piece, after) = rest.split_at(length);
        rest = after;
        (!piece.is_empty()).then_some(piece)
    })
}

/// Decodes a stream in pieces; adjacent data are merged.
fn decoded(bytes: &[u8], lengths: &[usize]) -> Vec<Element> {
    let mut decoder = TelnetDecoder::default();
    let mut elements: Vec<Element> = Vec::new();
    for mut piece in pieces(bytes, lengths) {
        while let Some(event) = decoder.next(&mut piece) {
            let element = match event {
                TelnetEvent::Data(data) => match elements.last_mut() {
                    Some(Element::Data(before)) => {
                        before.extend_from_slice(data);
                        continue;
                    }
                    _ => Element::Data(data.to_vec()),
                },
                TelnetEvent::Negotiation(verb, option) => Element::Negotiation(verb, option),
                TelnetEvent::Subnegotiation(option, it) => {
                    Element::Subnegotiation(option, it.to_vec())
                }
            };
            elements.push(element);
        }
    }
    elements
}

/// A client and a server with the bytes under way to each.
struct Pair {
    client: Rfc2217Client,
    server: Rfc2217Server,
    to_client: Vec<u8>,
    to_server: Vec<u8>,
}

impl Pair {
    fn new(requested: u32, present: u32) -> Self {
        let (mut to_client, mut to_server) = (Vec::new(), Vec::new());
        Self {
            client: Rfc2217Client::new(requested, &mut to_server),
            server: Rfc2217Server::new(present, &mut to_client),
            to_client,
            to_server,
        }
    }

    /// Exchanges bytes in pieces until none are left; returns the data at client and server.
    fn exchange(&mut self, lengths: &[usize]) -> [Vec<u8>; 2] {
        let mut data = [Vec::new(), Vec::new()];
        let mut rounds = 0;
        while !self.to_client.is_empty() || !self.to_server.is_empty() {
            let bytes = std::mem::take(&mut self.to_server);
            for piece in pieces(&bytes, lengths) {
                let reply = &mut self.to_client;
                self.server.handle_bytes(piece, &mut data[1], reply);
            }
            let bytes = std::mem::take(&mut self.to_client);
            for piece in pieces(&bytes, lengths) {
                let reply = &mut self.to_server;
                self.client.handle_bytes(piece, &mut data[0], reply);
            }
            rounds += 1;
            assert!(rounds < 10, "the ends answer each other without end");
        }
        data
    }
}

proptest! {
    #[test]
    fn elements_are_decoded_from_any_pieces(
        elements in vec(element(), 0..20),
        lengths in vec(1..50_usize, 1..10),
    ) {
        let (mut bytes, mut merged) = (Vec::new(), Vec::<Element>::new());
        for element in elements {
            element.push(&mut bytes);
            match (merged.last_mut(), element) {
                (Some(Element::Data(before)), Element::Data(data)) => before.extend(data),
                (_, element) => merged.push(element),
            }
        }
        prop_assert_eq!(decoded(&bytes, &lengths), merged);
    }

    #[test]
    fn arbitrary_bytes_are_bounded_and_independent_of_their_pieces(
        bytes in vec(byte(), 0..600),
        lengths in vec(1..50_usize, 1..10),
    ) {
        let whole = decoded(&bytes, &[usize::MAX]);
        for element in &whole {
            if let Element::Subnegotiation(_, parameters) = element {
                prop_assert!(parameters.len() < SUBNEGOTIATION_MAX);
            }
        }
        prop_assert_eq!(decoded(&bytes, &lengths), whole);
        let mut ends = [(Vec::new(), Vec::new()), (Vec::new(), Vec::new())];
        let [(reply, data), (server_reply, server_data)] = &mut ends;
        let mut client = Rfc2217Client::new(BAUD, reply);
        let mut server = Rfc2217Server::new(BAUD, server_reply);
        let opening = [reply.len(), server_reply.len()];
        for piece in pieces(&bytes, &lengths) {
            client.handle_bytes(piece, data, reply);
            server.handle_bytes(piece, server_data, server_reply);
        }
        // The shortest request for a long answer is that for the signature, of six bytes; the
        // settings, or the modem state, are sent once.
        for ((reply, data), opening) in ends.iter().zip(opening) {
            prop_assert!(data.len() <= bytes.len());
            prop_assert!(reply.len() <= opening + 60 + bytes.len() * 13 / 6, "{}", reply.len());
        }
    }

    #[test]
    fn client_and_server_exchange_any_data(
        there in vec(byte(), 0..200),
        back in vec(byte(), 0..200),
        lengths in vec(1..50_usize, 1..10),
        baud in any::<u32>(),
    ) {
        let mut pair = Pair::new(baud, baud);
        prop_assert_eq!(pair.client.unanswered(), Some("the COM port control option (RFC 2217)"));
        // Bytes that the port had received before.
        push_data(b"stale", &mut pair.to_client);
        prop_assert_eq!(pair.exchange(&lengths), [Vec::new(), Vec::<u8>::new()]);
        prop_assert!(pair.client.is_ready(), "{:?}", pair.client);
        prop_assert_eq!(pair.client.unanswered(), None);
        push_data(&there, &mut pair.to_server);
        push_data(&back, &mut pair.to_client);
        prop_assert_eq!(pair.exchange(&lengths), [back, there]);
    }
}

#[test]
fn other_baud_rate_is_refused() {
    let mut pair = Pair::new(115_200, BAUD);
    pair.exchange(&[1000]);
    let refusal = Rfc2217Refusal::BaudRate {
        requested: 115_200,
        found: BAUD,
    };
    assert_eq!(pair.client.refusal(), Some(refusal));
    assert!(!pair.client.is_ready());
}

#[test]
fn missing_option_and_other_parameters_are_refused() {
    for (verb, option) in [
        (TelnetVerb::Dont, 44),
        (TelnetVerb::Dont, 0),
        (TelnetVerb::Wont, 0),
    ] {
        let mut pair = Pair::new(BAUD, BAUD);
        pair.exchange(&[1000]);
        assert!(pair.client.is_ready());
        push_negotiation(verb, option, &mut pair.to_client);
        pair.exchange(&[1000]);
        let refusal = pair.client.refusal();
        assert!(
            matches!(refusal, Some(Rfc2217Refusal::Option(_))),
            "{refusal:?}"
        );
    }
    let mut pair = Pair::new(BAUD, BAUD);
    let seven_bits = ComPortMessage::Parameter(ComPortParameter::DataSize, 7);
    seven_bits.push(ComPortSender::Server, &mut pair.to_client);
    pair.exchange(&[1000]);
    let text = pair.client.refusal().unwrap().to_string();
    assert_eq!(text, "the port has data size 7, not 8");
}

/// Otherwise two ends could confirm to each other without end.
#[test]
fn repeated_agreement_is_not_answered() {
    let mut pair = Pair::new(BAUD, BAUD);
    pair.exchange(&[1000]);
    for (verb, option) in [(TelnetVerb::Will, 44), (TelnetVerb::Do, 0)] {
        push_negotiation(verb, option, &mut pair.to_server);
    }
    let requests = std::mem::take(&mut pair.to_server);
    let (server, reply) = (&mut pair.server, &mut pair.to_client);
    server.handle_bytes(&requests, &mut Vec::new(), reply);
    assert!(reply.is_empty(), "{reply:?}");
}

#[test]
fn long_subnegotiation_is_discarded_and_what_follows_is_not() {
    let mut bytes = Vec::new();
    push_subnegotiation(44, &[7; SUBNEGOTIATION_MAX], &mut bytes);
    push_subnegotiation(44, &[1; SUBNEGOTIATION_MAX - 1], &mut bytes);
    push_data(b"data", &mut bytes);
    let found = [
        Element::Subnegotiation(44, vec![1; SUBNEGOTIATION_MAX - 1]),
        Element::Data(b"data".to_vec()),
    ];
    assert_eq!(decoded(&bytes, &[3]), found);
}

#[test]
fn endless_subnegotiation_takes_bounded_memory() {
    let mut decoder = TelnetDecoder::default();
    let mut rest = &[&[255, 250][..], &vec![7; 1 << 16]].concat()[..];
    let allocated = allocation_counter::measure(|| assert_eq!(decoder.next(&mut rest), None));
    assert!(
        allocated.bytes_total < 10 * SUBNEGOTIATION_MAX as u64,
        "{allocated:?}"
    );
}

/// Request and answer on the wire, by the examples of RFC 2217 and pySerial.
#[test]
fn messages_have_the_bytes_of_the_standard() {
    let mut reply = Vec::new();
    let mut server = Rfc2217Server::new(115_200, &mut reply);
    reply.clear();
    let request = [255, 250, 44, 1, 0, 0, 0x25, 0x80, 255, 240];
    server.handle_bytes(&request, &mut Vec::new(), &mut reply);
    assert_eq!(reply, [255, 250, 44, 101, 0, 1, 0xc2, 0, 255, 240]);
    reply.clear();
    // Data terminal ready off, its state, and an option that the server does not have.
    for request in [
        &[255, 250, 44, 5, 9, 255, 240][..],
        &[255, 250, 44, 5, 7, 255, 240],
        &[255, 253, 1],
    ] {
        server.handle_bytes(request, &mut Vec::new(), &mut reply);
    }
    let answer = [255, 250, 44, 105, 9, 255, 240];
    assert_eq!(reply, [&answer[..], &answer, &[255, 252, 1]].concat());
}
