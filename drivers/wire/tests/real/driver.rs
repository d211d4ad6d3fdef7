use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use twinrig_kernel::{HostTime, Port, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{Driver, DriverError, Transfer};

use super::{ASK, CLOSE, NUMBER, OPEN, ports};

/// Asks for half of what the process gives it, once a transfer.
pub struct Asker {
    name: String,
    requests: Vec<u8>,
    heard: Vec<u8>,
    wanted: usize,
    half: [f64; 1],
    transfers: f64,
    pub closed: Arc<AtomicBool>,
    /// Says, after so many transfers, that it cannot go on.
    pub tires_after: Option<f64>,
    /// Panics after so many transfers.
    pub panics_after: Option<f64>,
    /// Never comes back after so many transfers, once its far end has answered or is to be left.
    pub hangs_after: Option<f64>,
}

impl Asker {
    pub fn new(name: &str) -> Self {
        Self {
            name: name.into(),
            requests: Vec::new(),
            heard: Vec::new(),
            wanted: 0,
            half: [0.0],
            transfers: 0.0,
            closed: Arc::default(),
            tires_after: None,
            panics_after: None,
            hangs_after: None,
        }
    }

    fn request(&mut self, bytes: &[u8], wanted: usize) {
        self.heard.clear();
        self.requests = bytes.to_vec();
        self.wanted = wanted;
    }
}

impl Driver for Asker {
    fn name(&self) -> &str {
        &self.name
    }
    fn ports(&self) -> Vec<Port> {
        ports(&self.name).into()
    }
    fn open(&mut self, _: HostTime) {
        self.request(&[OPEN], 1);
    }
    fn begin(&mut self, _: HostTime, from_process: &[f64]) {
        let mut request = vec![ASK];
        request.extend(from_process[0].to_le_bytes());
        self.request(&request, NUMBER);
    }
    fn close(&mut self, _: HostTime) {
        self.closed.store(true, Ordering::SeqCst);
        self.request(&[CLOSE], 0);
    }
    fn handle_bytes(&mut self, _: HostTime, bytes: &[u8]) {
        self.heard.extend(bytes);
    }
    fn handle_timeout(&mut self, _: HostTime) {}
    fn poll_timeout(&self) -> Option<HostTime> {
        None
    }
    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> bool {
        let any = !self.requests.is_empty();
        bytes.append(&mut self.requests);
        any
    }
    fn poll_transfer(&mut self) -> Result<Transfer, DriverError> {
        if self.heard.len() < self.wanted {
            return Ok(Transfer::Busy);
        }
        if self.wanted == NUMBER {
            self.half = [f64::from_le_bytes(self.heard[..NUMBER].try_into().unwrap())];
            self.transfers += 1.0;
            self.wanted = 0;
        }
        assert_ne!(self.panics_after, Some(self.transfers), "as it was told to");
        while self.hangs_after == Some(self.transfers) {
            std::thread::sleep(std::time::Duration::from_millis(100));
        }
        if self.tires_after == Some(self.transfers) {
            let why = "too many errors; look after the cable".into();
            return Err(DriverError { why });
        }
        Ok(Transfer::Done)
    }
    fn to_process(&self) -> &[f64] {
        &self.half
    }
    fn diagnostics(&self) -> Vec<Port> {
        vec![Port::output(
            format!("{}/transfers", self.name),
            Unit::One,
            1,
        )]
    }
    fn read_diagnostics(&self, values: &mut [f64]) {
        values[0] = self.transfers;
    }
    fn save(&self) -> Snapshot {
        Snapshot::default()
    }
    fn restore(&mut self, _: &Snapshot) -> Result<(), SnapshotError> {
        Ok(())
    }
}
