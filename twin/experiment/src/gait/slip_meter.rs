//! Slip of feet: the horizontal path of each foot while it is on the ground.

use twinrig_kernel::{Layout, signal};

/// Sum of the horizontal paths of all feet on the ground.
pub(crate) struct SlipMeter {
    feet: Vec<Foot>,
    /// Load from which on a foot is on the ground \[N\].
    least_load: f64,
    path_m: f64,
}

struct Foot {
    /// Indices of load and position in the outputs of the plant.
    load: usize,
    position: usize,
    /// Position at the previous observation, if the foot was on the ground.
    before: Option<[f64; 2]>,
}

impl SlipMeter {
    /// Creates the meter for the feet with a position and a load in `layout`.
    pub(crate) fn new(layout: &Layout, least_load: f64) -> Self {
        let feet = layout.fields().filter_map(|field| {
            let (leg, name) = signal::parse_leg(&field.port.name)?;
            let position = layout.find(&signal::of_leg(leg, signal::FOOT_POSITION))?;
            (name == signal::FOOT_LOAD).then_some(Foot {
                load: field.offset,
                position: position.start,
                before: None,
            })
        });
        Self {
            feet: feet.collect(),
            least_load,
            path_m: 0.0,
        }
    }

    /// Adds an observation. A foot slips between two observations if it is on the ground at both:
    /// touch-down and lift-off are no slip.
    pub(crate) fn sample(&mut self, outputs: &[f64]) {
        for foot in &mut self.feet {
            let [x, y] = [0, 1].map(|axis| outputs[foot.position + axis]);
            let is_on_ground = outputs[foot.load] >= self.least_load;
            let before = core::mem::replace(&mut foot.before, is_on_ground.then_some([x, y]));
            if let (true, Some([x0, y0])) = (is_on_ground, before) {
                self.path_m += libm::hypot(x - x0, y - y0);
            }
        }
    }

    /// Returns the sum of the paths since the start \[m\].
    pub(crate) fn path_m(&self) -> f64 {
        self.path_m
    }
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::{Direction, Port, Unit};

    use super::*;

    #[test]
    fn path_of_a_foot_counts_while_it_is_on_the_ground() {
        let ports = [
            Port::output("leg/LF/foot/load", Unit::Newton, 1),
            Port::output("leg/LF/foot/position", Unit::Meter, 3),
        ];
        let mut slip = SlipMeter::new(&Layout::of(&ports, Direction::Output), 1.0);
        // Back and forth by 0.5 m on the ground, 4 m in the air, and 0.2 m on the ground, sinking.
        for [load, x, y, z] in [
            [0.9, 9.0, 9.0, 1.0],
            [1.0, 0.0, 0.0, 0.0],
            [2.0, 0.3, 0.4, 0.0],
            [2.0, 0.0, 0.0, 0.0],
            [0.5, 1.0, 0.0, 1.0],
            [0.0, 3.0, 0.0, 1.0],
            [1.0, 4.0, 0.0, 0.0],
            [1.0, 4.0, 0.2, -0.1],
        ] {
            slip.sample(&[load, x, y, z]);
        }
        assert!((slip.path_m() - 1.2).abs() < 1e-12, "{}", slip.path_m());
    }
}
