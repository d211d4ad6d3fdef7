use twinrig_wire::{Faulty, FaultyNode, Line, Node, Recipient, Rs485, UsbSerial};

use crate::config::{ServoBusConfig, ServoConfig};
use crate::error::ServoBusError;
use crate::node::ServoNode;
use crate::protocol::ProtocolVersion;

/// Transport between the host's driver and the plant: USB converter, half-duplex bus, servos.
pub type ServoBusWire = UsbSerial<Box<dyn Line>>;

impl ServoBusConfig {
    /// Returns the emulated bus to which the driver is connected in virtual time.
    ///
    /// # Errors
    /// [`ServoBusError`] if the configuration is invalid.
    pub fn wire(&self) -> Result<ServoBusWire, ServoBusError> {
        self.check()?;
        let (name, byte_time, faults) = (&self.name, self.byte_time, &self.faults);
        let first = self.servos.first();
        let frames = first.map(|servo| servo.kind.model.protocol.frames());
        let mut nodes: Vec<Box<dyn Node>> = Vec::new();
        for servo in &self.servos {
            let place = format!("wire/{name}/{}", servo.name);
            let clock = faults.clock(&place, servo.clock)?;
            let servo = ServoConfig {
                clock,
                ..servo.clone()
            };
            let node = ServoNode::new(name, &servo, byte_time);
            nodes.push(if faults.harms_board(&place) {
                Box::new(FaultyNode::framed(&place, byte_time, faults, frames, node)?)
            } else {
                Box::new(node)
            });
        }
        let recipient: Recipient = match self.protocol() {
            ProtocolVersion::One => |bytes| ProtocolVersion::One.packet_address(bytes),
            ProtocolVersion::Two => |bytes| ProtocolVersion::Two.packet_address(bytes),
        };
        let mut line: Box<dyn Line> =
            Box::new(Rs485::new(name, byte_time, self.turnaround, nodes)?.with_packets(recipient));
        let place = format!("wire/{name}");
        if faults.harms(&place) {
            line = Box::new(Faulty::framed(&place, byte_time, faults, frames, line)?);
        }
        let usb = self.usb.clone();
        Ok(UsbSerial::new(name, usb, byte_time, self.seed, line)?)
    }
}
