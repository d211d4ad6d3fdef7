//! Harsh drops: springs of a tenth to a hundred times the stiffness, restitution, slopes, steps and
//! rough ground, subsets of legs, payloads, and steps of 0.5 to 2 ms.

use std::fmt::Write as _;

use twinrig::robot::Robot;
use twinrig_kernel::{SimDuration, stream};

use super::{Case, Method, chance, uniform};

/// Stiffness of the springs of the robot file, diagonal and parallel \[N/m\].
const STIFFNESS: [f64; 2] = [4400.0, 1800.0];

/// A harsh drop: a case and its scenario, which has more than the case describes.
pub struct Harsh {
    pub case: Case,
    pub text: String,
}

impl Harsh {
    /// Draws the drop of a seed.
    pub fn drop(seed: u64, method: Method, robot: &Robot) -> Self {
        let mut stream = stream(seed, "battery/harsh");
        let drop = Case::drop(seed, method, &mut stream, robot);
        let restitution = if chance(&mut stream, 0.4) {
            0.0
        } else {
            stream.unit()
        };
        let step_us = [500, 1000, 2000][usize::try_from(stream.between(0, 2)).unwrap_or(0)];
        let friction = uniform(&mut stream, 0.0, 2.0);
        let case = Case {
            friction,
            restitution,
            toe: chance(&mut stream, 0.4),
            heights: ground(&mut stream),
            joint_friction: None,
            servo: None,
            step: Some(SimDuration::from_micros(step_us)),
            ..drop
        };
        let springs =
            STIFFNESS.map(|stiffness| stiffness * libm::pow(10.0, uniform(&mut stream, -1.0, 2.0)));
        let payload = chance(&mut stream, 0.3).then(|| uniform(&mut stream, 0.02, 0.5));
        let text = text(&case, springs, payload);
        Self { case, text }
    }
}

/// Heights of the ground \[m\]: level, a slope, a step or rough.
fn ground(stream: &mut twinrig_kernel::Stream) -> Option<[[f64; 9]; 9]> {
    let kind = stream.between(0, 3);
    let slopes = [(); 2].map(|()| uniform(stream, -0.4, 0.4));
    let height = uniform(stream, 0.0, 0.03);
    let at = usize::try_from(stream.between(3, 5)).unwrap_or(4);
    let mut field = [[0.0; 9]; 9];
    for (x, row) in (0_u8..).zip(&mut field) {
        for (y, value) in (0_u8..).zip(row) {
            let [along, across] = [x, y].map(|index| 0.05 * (f64::from(index) - 4.0));
            *value = match kind {
                1 => slopes[0] * along + slopes[1] * across,
                2 if usize::from(x) < at => height,
                3 => uniform(stream, -0.01, 0.01),
                _ => 0.0,
            };
        }
    }
    (kind > 0).then_some(field)
}

fn text(case: &Case, springs: [f64; 2], payload: Option<f64>) -> String {
    let [diagonal, parallel] = springs;
    let springs = format!(
        "[override.leg.aslp]\ndiagonal = {{ stiffness = \"{diagonal} N/m\", preload = \"3 mm\" }}\n\
         parallel = {{ stiffness = \"{parallel} N/m\", preload = \"3 mm\" }}\n\n[plant]\n"
    );
    let mut text = case.scenario().replacen("[plant]\n", &springs, 1);
    if let Some(mass) = payload {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "\n[[payload]]\nname = \"load\"\nmass = \"{mass} kg\"\nat = [\"0 cm\", \"0 cm\", \"3 cm\"]"
        );
    }
    text
}
