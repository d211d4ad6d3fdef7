//! Joints of abduction in the state that plants share.

use twinrig_kernel::signal;
use twinrig_runtime::PlantState;

/// Name of a leg's joint in a plant's state.
const ENTRY: &str = "abduction";

/// Returns the entry of a leg's joint in a plant's state: its angle \[rad\] and rate \[rad/s\].
pub fn abduction_entry(leg: &str, motion: [f64; 2]) -> (String, Vec<f64>) {
    (signal::of_leg(leg, ENTRY), motion.to_vec())
}

/// Returns angle and rate of a leg's joint from its entry, or else zero, with a line that says so.
pub fn adopt_abduction(state: &PlantState, leg: &str, lines: &mut Vec<String>) -> [f64; 2] {
    let name = signal::of_leg(leg, ENTRY);
    match state.get(&name) {
        Some([angle, rate]) if angle.is_finite() && rate.is_finite() => [*angle, *rate],
        _ => {
            lines.push(format!("{name} is missing; the leg is upright"));
            [0.0; 2]
        }
    }
}
