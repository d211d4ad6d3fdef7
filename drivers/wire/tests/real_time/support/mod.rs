//! A served twin whose boards echo, at ports over a network.

use std::collections::VecDeque;
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::real_time::{EndReason, Hold, Serve, ServeOptions, ServeReport, ServedWire};
use twinrig_runtime::{Device, DeviceError, Part, PlantAccess, RigError, TaskError};
use twinrig_runtime::{TransmitBuffer, Wire};
use twinrig_testing::real_time::Lag;
use twinrig_wire::{NetworkAddress, PortServer, RemotePort};

pub const BAUD: u32 = 1_000_000;
pub const SCHEMES: [&str; 2] = ["tcp", "rfc2217"];

const BYTE_TIME: SimDuration = SimDuration::from_nanos(200);

/// Returns all bytes when they are transmitted, those of a long write sixteen times, which fill the
/// buffers of a client that does not read. Fails if it is given more than it has room for.
#[derive(Default)]
struct Echo {
    queue: VecDeque<(SimTime, Vec<u8>)>,
    idle_from: SimTime,
    readable: Vec<u8>,
}

impl Part for Echo {}

impl Wire for Echo {
    fn send(&mut self, now: SimTime, bytes: &[u8]) {
        let room = self.transmit_buffer().unwrap().room(now);
        assert!(
            bytes.len() <= room,
            "{} bytes, room for {room}",
            bytes.len()
        );
        let duration = BYTE_TIME * u64::try_from(bytes.len()).unwrap();
        self.idle_from = self.idle_from.max(now) + duration;
        let times = if bytes.len() > 1000 { 16 } else { 1 };
        self.queue.push_back((self.idle_from, bytes.repeat(times)));
    }

    fn transmit_buffer(&self) -> Option<TransmitBuffer> {
        Some(TransmitBuffer {
            idle_from: self.idle_from,
            byte_time: BYTE_TIME,
            capacity: 4096,
        })
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.queue.front().map(|(at, _)| *at)
    }

    fn advance(&mut self, now: SimTime, _: &mut dyn PlantAccess) -> Result<(), TaskError> {
        while self.next_wake().is_some_and(|at| at <= now) {
            self.readable.extend(self.queue.pop_front().unwrap().1);
        }
        Ok(())
    }

    fn receive(&mut self, bytes: &mut Vec<u8>) {
        bytes.append(&mut self.readable);
    }
}

/// A server that counts the writes that its client does not take.
struct Counted {
    server: PortServer,
    unread: Arc<AtomicU64>,
}

impl Device for Counted {
    fn place(&self) -> &str {
        self.server.place()
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), DeviceError> {
        let written = self.server.write(bytes);
        let lost = u64::from(written.is_err());
        self.unread.fetch_add(lost, Ordering::SeqCst);
        written
    }

    fn read_up_to(
        &mut self,
        limit: usize,
        timeout: Duration,
        bytes: &mut Vec<u8>,
    ) -> Result<(), DeviceError> {
        self.server.read_up_to(limit, timeout, bytes)
    }

    fn descriptor(&self) -> Option<std::os::fd::BorrowedFd<'_>> {
        self.server.descriptor()
    }
}

/// A twin served on a thread, with one bus per scheme.
pub struct Twin {
    pub addresses: Vec<NetworkAddress>,
    unread: Arc<AtomicU64>,
    stop: Arc<AtomicBool>,
    thread: JoinHandle<(Result<EndReason, RigError>, ServeReport)>,
}

/// A server at any free port.
pub fn listen(scheme: &str) -> PortServer {
    let address = NetworkAddress::parse_served(&format!("{scheme}://0"));
    PortServer::listen(&address.unwrap(), BAUD).unwrap()
}

impl Twin {
    pub fn serve(schemes: &[&str]) -> Self {
        let (mut addresses, mut wires) = (Vec::new(), Vec::new());
        let unread = Arc::new(AtomicU64::new(0));
        for (n, scheme) in schemes.iter().enumerate() {
            let server = listen(scheme);
            addresses.push(server.address().clone());
            wires.push(ServedWire {
                name: format!("bus{n}"),
                wire: Box::new(Echo::default()),
                device: Box::new(Counted {
                    server,
                    unread: unread.clone(),
                }),
            });
        }
        let options = ServeOptions {
            hold: Hold::Never,
            ..ServeOptions::default()
        };
        let serve = Serve::new(options, Box::new(Lag::default()), wires).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let flag = stop.clone();
        let thread = thread::Builder::new().spawn(move || {
            let (ended, report) = serve.run(&mut (), &flag);
            if let Err(error) = &ended {
                eprintln!("the twin has ended: {error}");
            }
            (ended, report)
        });
        Self {
            addresses,
            unread,
            stop,
            thread: thread.unwrap(),
        }
    }

    pub fn open(&self, bus: usize) -> RemotePort {
        RemotePort::open(&self.addresses[bus], BAUD).unwrap()
    }

    /// Connects to a bus without its protocol.
    pub fn connect(&self, bus: usize) -> TcpStream {
        let address = &self.addresses[bus];
        TcpStream::connect((&*address.host, address.port)).unwrap()
    }

    /// Returns the number of writes that a client did not take.
    pub fn unread(&self) -> u64 {
        self.unread.load(Ordering::SeqCst)
    }

    pub fn stop(self) -> ServeReport {
        self.stop.store(true, Ordering::SeqCst);
        let (ended, report) = self.thread.join().unwrap();
        assert_eq!(ended, Ok(EndReason::Stopped));
        report
    }
}

/// Reads until `count` bytes are there.
pub fn read(port: &mut dyn Device, count: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    while bytes.len() < count {
        port.read(Duration::from_secs(5), &mut bytes).unwrap();
    }
    bytes
}
