//! The page of a session over HTTP, and ports that are taken. Visitors by WebSocket are tested with
//! a client of others, by the Python package.
#![cfg(feature = "server")]

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::time::Duration;

use twinrig_live::SNAPSHOT_BYTES;
use twinrig_live::server::{Options, Server};
use twinrig_rig::{Assembly, Registry};

fn options(ports: [u16; 2]) -> Options {
    Options {
        host: "127.0.0.1".to_owned(),
        ports,
        folder: "live".into(),
        memory: SNAPSHOT_BYTES,
        speed: 1.0,
        paused: true,
    }
}

fn answer(to: SocketAddr, request: &[u8]) -> String {
    let mut stream = TcpStream::connect(to).unwrap();
    stream
        .set_read_timeout(Some(Duration::from_secs(10)))
        .unwrap();
    stream.write_all(request).unwrap();
    let mut answer = Vec::new();
    // A server may close what it does not read.
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8(answer).unwrap()
}

#[test]
fn page_is_one_document_and_a_taken_port_an_error() {
    let registry = Registry::standard();
    let builder = Assembly::builder(&registry);
    let assembly = builder
        .file(Path::new("../../scenarios/trot.toml"))
        .unwrap();
    let server = Server::new(&assembly, &options([0, 0])).unwrap();
    let places = server.places();
    assert!(places.page.ip().is_loopback() && places.socket.ip().is_loopback());

    let page = answer(places.page, b"GET / HTTP/1.1\r\nHost: x\r\n\r\n");
    assert!(page.starts_with("HTTP/1.1 200 OK\r\n"), "{}", &page[..200]);
    assert!(page.contains(&format!("\"socket\":{}", places.socket.port())));
    assert!(page.contains("\"name\":\"LF\"") && page.ends_with("</html>\n"));
    let icon = answer(places.page, b"GET /favicon.ico HTTP/1.1\r\nHost: x\r\n\r\n");
    assert!(icon.starts_with("HTTP/1.1 204"), "{icon}");
    let requests: [&[u8]; 3] = [
        b"GET /other HTTP/1.1\r\nHost: x\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 0\r\n\r\n",
        b"\x00\xff\r\n\r\n",
    ];
    let answers = requests.map(|request| answer(places.page, request));
    assert!(answers[0].starts_with("HTTP/1.1 404"), "{}", answers[0]);
    assert!(answers[1].starts_with("HTTP/1.1 404"), "{}", answers[1]);
    assert!(answers[2].starts_with("HTTP/1.1 400"), "{}", answers[2]);

    for taken in [[places.socket.port(), 0], [0, places.page.port()]] {
        let Err(error) = Server::new(&assembly, &options(taken)).map(|_| ()) else {
            panic!("two servers listen at one port");
        };
        let port = taken[0].max(taken[1]);
        let expected = format!("cannot listen at 127.0.0.1:{port}: ");
        assert!(error.to_string().starts_with(&expected), "{error}");
    }
}
