//! Pose and twist of the trunk, as a `nav_msgs/Odometry`.

use super::frames::{TRUNK, WORLD};
use super::signals::Signals;
use crate::cdr::{CdrWriter, Template};
use twinrig_kernel::signal;

/// Covariance matrix: zero, because the simulated state is exact.
const COVARIANCE: [f64; 36] = [0.0; 36];

#[derive(Debug, Clone)]
pub(super) struct Odometry {
    position: usize,
    orientation: usize,
    velocity: usize,
    angular_velocity: usize,
    message: Template,
    stamp: usize,
    pose: usize,
    twist: usize,
}

impl Odometry {
    /// Creates the message; `None` if one of its signals is not recorded.
    pub(super) fn new(signals: &Signals<'_>) -> Option<Self> {
        let mut message = Template::default();
        let mut to = CdrWriter::new(&mut message.bytes);
        let stamp = to.stamp([0; 8]);
        to.text(WORLD);
        to.text(TRUNK);
        let pose = to.align(8);
        to.f64s(&[0.0; 7]);
        to.f64s(&COVARIANCE);
        let twist = to.align(8);
        to.f64s(&[0.0; 6]);
        to.f64s(&COVARIANCE);
        Some(Self {
            position: signals.recorded(signal::BODY_POSITION, 3)?,
            orientation: signals.recorded(signal::BODY_ORIENTATION, 4)?,
            velocity: signals.recorded(signal::BODY_VELOCITY, 3)?,
            angular_velocity: signals.recorded(signal::BODY_ANGULAR_VELOCITY, 3)?,
            message,
            stamp,
            pose,
            twist,
        })
    }

    pub(super) fn at(&mut self, stamp: [u8; 8], values: &[f64]) -> &[u8] {
        let three = |start: usize| [0, 1, 2].map(|n| values[start + n]);
        let [w, x, y, z] = [0, 1, 2, 3].map(|n| values[self.orientation + n]);
        let message = &mut self.message;
        message.put_stamp(self.stamp, stamp);
        message.put_all(self.pose, &three(self.position));
        message.put_all(self.pose + 24, &[x, y, z, w]);
        // The twist is in the frame of the trunk, as is the signal of the angular velocity.
        let velocity = rotate([w, -x, -y, -z], three(self.velocity));
        message.put_all(self.twist, &velocity);
        message.put_all(self.twist + 24, &three(self.angular_velocity));
        &message.bytes
    }
}

/// Rotates the vector `v` by the quaternion `[w, x, y, z]`.
fn rotate([w, x, y, z]: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    let cross = |[a, b, c]: [f64; 3]| [y * c - z * b, z * a - x * c, x * b - y * a];
    let once = cross(v);
    let twice = cross(once);
    [0, 1, 2].map(|n| v[n] + 2.0 * (w * once[n] + twice[n]))
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::{Direction, Layout, Port, Unit};

    use super::*;
    use crate::cdr::CdrReader;

    fn layout() -> Layout {
        let ports = [
            Port::output("body/velocity", Unit::MeterPerSecond, 3),
            Port::output("body/position", Unit::Meter, 3),
            Port::output("body/orientation", Unit::One, 4),
            Port::output("body/angular_velocity", Unit::RadianPerSecond, 3),
        ];
        Layout::of(&ports, Direction::Output)
    }

    #[test]
    fn twist_is_in_the_trunk_frame() {
        let layout = layout();
        let keep = |_: &str| true;
        let signals = Signals {
            layout: &layout,
            keep: &keep,
        };
        let mut odometry = Odometry::new(&signals).unwrap();
        // Yaw of 90° to the left and a velocity in that direction, along the y axis of the world.
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let mut values = vec![0.0; 13];
        let mut set = |name: &str, components: &[f64]| {
            values[layout.find(name).unwrap()].copy_from_slice(components);
        };
        set("body/velocity", &[0.0, 2.0, 0.0]);
        set("body/position", &[1.0, 2.0, 3.0]);
        set("body/orientation", &[half, 0.0, 0.0, half]);
        set("body/angular_velocity", &[0.1, 0.2, 0.3]);
        let mut from = CdrReader::new(odometry.at([1, 0, 0, 0, 2, 0, 0, 0], &values)).unwrap();
        assert_eq!(from.time(), Some([1, 2]));
        let frames = (from.text().unwrap(), from.text().unwrap());
        assert_eq!((frames.0.as_str(), frames.1.as_str()), ("world", "trunk"));
        let pose: [f64; 7] = from.f64s().unwrap();
        assert_eq!(pose, [1.0, 2.0, 3.0, 0.0, 0.0, half, half]);
        assert_eq!(from.f64s::<36>(), Some([0.0; 36]));
        let twist: [f64; 6] = from.f64s().unwrap();
        for (actual, expected) in twist.into_iter().zip([2.0, 0.0, 0.0, 0.1, 0.2, 0.3]) {
            assert!((actual - expected).abs() < 1e-15, "{twist:?}");
        }
        assert_eq!(from.f64s::<36>(), Some([0.0; 36]));
        assert!(from.is_at_end());
    }

    #[test]
    fn odometry_requires_all_its_signals_to_be_recorded() {
        let layout = layout();
        let keep = |name: &str| name != "body/velocity";
        let signals = Signals {
            layout: &layout,
            keep: &keep,
        };
        assert!(Odometry::new(&signals).is_none());
    }
}
