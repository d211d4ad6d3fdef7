//! Drives, as a `sensor_msgs/JointState`: shafts of servos and motors.

use twinrig_kernel::{Unit, signal};

use super::signals::Signals;
use crate::cdr::{CdrWriter, Template};

/// Suffixes of the signals of a drive.
const POSITION: &str = "/position";
const RATE: &str = "/rate";
const TORQUE: &str = "/torque";

#[derive(Debug, Clone)]
pub(super) struct Drives {
    /// Offset of each number in a sample and in the message.
    numbers: Vec<(usize, usize)>,
    message: Template,
    stamp: usize,
}

impl Drives {
    /// Creates the message from all signals `PATH/position` that are angles. Rates and torques are
    /// included only if all of the drives have them. `None` if there are no drives.
    pub(super) fn new(signals: &Signals<'_>) -> Option<Self> {
        let positions = signals.of_unit(Unit::Radian);
        let drives: Vec<(&str, usize)> = positions
            .filter_map(|(name, start)| Some((name.strip_suffix(POSITION)?, start)))
            .collect();
        if drives.is_empty() {
            return None;
        }
        let of_all = |suffix: &str| -> Vec<usize> {
            let starts = drives.iter().map(|(path, _)| {
                let name = format!("{path}{suffix}");
                signals.recorded(&name, 1)
            });
            starts.collect::<Option<_>>().unwrap_or_default()
        };
        let positions = drives.iter().map(|(_, start)| *start).collect();
        let columns = [positions, of_all(RATE), of_all(TORQUE)];
        let mut message = Template::default();
        let mut to = CdrWriter::new(&mut message.bytes);
        let stamp = to.stamp([0; 8]);
        to.text(""); // drives have no frame
        to.count(drives.len());
        for (path, _) in &drives {
            to.text(path.strip_prefix(signal::LEG_PREFIX).unwrap_or(path));
        }
        let mut numbers = Vec::new();
        for column in columns {
            to.count(column.len());
            for start in column {
                numbers.push((start, to.align(8)));
                to.f64(0.0);
            }
        }
        Some(Self {
            numbers,
            message,
            stamp,
        })
    }

    pub(super) fn at(&mut self, stamp: [u8; 8], values: &[f64]) -> &[u8] {
        self.message.put_stamp(self.stamp, stamp);
        for (start, offset) in &self.numbers {
            self.message.put(*offset, values[*start]);
        }
        &self.message.bytes
    }
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::{Direction, Layout, Port};

    use super::*;
    use crate::cdr::CdrReader;

    #[test]
    fn columns_contain_all_joints_or_none() {
        let ports = [
            Port::output("leg/LF/hip/position", Unit::Radian, 1),
            Port::output("leg/LF/foot/position", Unit::Meter, 3),
            Port::output("leg/LF/hip/torque", Unit::NewtonMeter, 1),
            Port::output("leg/LF/hip/rate", Unit::RadianPerSecond, 1),
            Port::output("tail/position", Unit::Radian, 1),
            Port::output("tail/torque", Unit::NewtonMeter, 1),
        ];
        let layout = Layout::of(&ports, Direction::Output);
        let keep = |_: &str| true;
        let signals = Signals {
            layout: &layout,
            keep: &keep,
        };
        let mut drives = Drives::new(&signals).unwrap();
        let mut values = vec![0.0; 8];
        let all = [
            ("leg/LF/hip/position", 0.5),
            ("leg/LF/hip/torque", -0.25),
            ("tail/position", 1.5),
            ("tail/torque", 3.0),
        ];
        for (name, value) in all {
            values[layout.find(name).unwrap().start] = value;
        }
        let mut from = CdrReader::new(drives.at([1, 0, 0, 0, 2, 0, 0, 0], &values)).unwrap();
        assert_eq!(
            (from.time(), from.text().as_deref()),
            (Some([1, 2]), Some(""))
        );
        let names = from.each(CdrReader::text).unwrap();
        assert_eq!(names, ["LF/hip", "tail"]);
        let mut column = || from.each(CdrReader::f64).unwrap();
        assert_eq!(
            (column(), column(), column()),
            (vec![0.5, 1.5], vec![], vec![-0.25, 3.0])
        );
        assert!(from.is_at_end());
    }
}
