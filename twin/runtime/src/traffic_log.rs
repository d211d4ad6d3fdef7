/// Bytes of traces since the last drain, in reused buffers.
#[derive(Debug, Default)]
pub struct TrafficLog {
    pieces: Vec<(usize, Vec<u8>)>,
    /// Number of pieces that are not drained yet; the others are reused.
    recorded: usize,
}

impl TrafficLog {
    /// Appends a piece of a trace; none if it is empty.
    pub fn record(&mut self, trace: usize, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        if self.recorded == self.pieces.len() {
            self.pieces.push((trace, Vec::new()));
        }
        let (index, buffer) = &mut self.pieces[self.recorded];
        *index = trace;
        buffer.clear();
        buffer.extend_from_slice(bytes);
        self.recorded += 1;
    }

    /// Passes the pieces since the last call, in order, with their traces.
    pub fn drain(&mut self, passed: &mut dyn FnMut(usize, &[u8])) {
        for (trace, bytes) in &self.pieces[..self.recorded] {
            passed(*trace, bytes);
        }
        self.recorded = 0;
    }
}
