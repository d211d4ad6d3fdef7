use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use twinrig_kernel::{HostTime, Port, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{Driver, DriverError};

use super::{CLOSE, HALVE, NUMBER, OPEN, ports};

/// Driver that requests half of the number from the process, once a transfer.
pub struct HalvingDriver {
    name: String,
    requests: Vec<u8>,
    received: Vec<u8>,
    expected: usize,
    half: [f64; 1],
    transfers: f64,
    /// Whether the driver was closed.
    pub closed: Arc<AtomicBool>,
    /// Fails with an error after this number of transfers.
    pub fails_after: Option<f64>,
    /// Panics after this number of transfers.
    pub panics_after: Option<f64>,
    /// Blocks forever after this number of transfers, as soon as an answer is complete or on
    /// closing.
    pub hangs_after: Option<f64>,
}

impl HalvingDriver {
    /// Creates a driver that does not fail.
    pub fn new(name: &str) -> Self {
        Self {
            name: name.into(),
            requests: Vec::new(),
            received: Vec::new(),
            expected: 0,
            half: [0.0],
            transfers: 0.0,
            closed: Arc::default(),
            fails_after: None,
            panics_after: None,
            hangs_after: None,
        }
    }

    fn request(&mut self, bytes: &[u8], expected: usize) {
        self.received.clear();
        self.requests = bytes.to_vec();
        self.expected = expected;
    }
}

impl Driver for HalvingDriver {
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
        let mut request = vec![HALVE];
        request.extend(from_process[0].to_le_bytes());
        self.request(&request, NUMBER);
    }
    fn close(&mut self, _: HostTime) {
        self.closed.store(true, Ordering::SeqCst);
        self.request(&[CLOSE], 0);
    }
    fn handle_bytes(&mut self, _: HostTime, bytes: &[u8]) {
        self.received.extend(bytes);
        if self.expected == NUMBER && self.received.len() >= NUMBER {
            self.half = [f64::from_le_bytes(
                self.received[..NUMBER].try_into().unwrap(),
            )];
            self.transfers += 1.0;
            self.expected = 0;
        }
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
    fn is_busy(&self) -> Result<bool, DriverError> {
        if self.received.len() < self.expected {
            return Ok(true);
        }
        assert_ne!(
            self.panics_after,
            Some(self.transfers),
            "requested by the test"
        );
        while self.hangs_after == Some(self.transfers) {
            std::thread::sleep(std::time::Duration::from_millis(100));
        }
        if self.fails_after == Some(self.transfers) {
            let why = "too many errors; look after the cable".into();
            return Err(DriverError { why });
        }
        Ok(false)
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
