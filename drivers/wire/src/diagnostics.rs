use twinrig_kernel::{Port, Unit};

/// Diagnostics of a driver or of an emulated device, reported one by one in a fixed order. Names
/// and units do not depend on the state.
pub struct Diagnostics<'d>(Sink<'d>);

enum Sink<'d> {
    Ports(&'d str, &'d mut Vec<Port>),
    Values(std::slice::IterMut<'d, f64>),
}

impl Diagnostics<'_> {
    /// Reports a counter.
    pub fn count(&mut self, name: &str, count: u64) {
        self.value(name, Unit::One, count as f64);
    }

    /// Reports a quantity.
    pub fn value(&mut self, name: &str, unit: Unit, value: f64) {
        match &mut self.0 {
            Sink::Ports(owner, ports) => {
                ports.push(Port::output(format!("{owner}/{name}"), unit, 1));
            }
            Sink::Values(values) => {
                if let Some(place) = values.next() {
                    *place = value;
                }
            }
        }
    }

    /// Returns the ports of the diagnostics that `report` reports.
    pub fn ports(owner: &str, report: impl FnOnce(&mut Diagnostics<'_>)) -> Vec<Port> {
        let mut ports = Vec::new();
        report(&mut Diagnostics(Sink::Ports(owner, &mut ports)));
        ports
    }

    /// Writes the values of the diagnostics that `report` reports.
    pub fn read(values: &mut [f64], report: impl FnOnce(&mut Diagnostics<'_>)) {
        report(&mut Diagnostics(Sink::Values(values.iter_mut())));
    }
}
