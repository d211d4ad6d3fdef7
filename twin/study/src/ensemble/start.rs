//! Perturbed start of a plant.

use twinrig_kernel::{Stream, signal};
use twinrig_runtime::{Plant, PlantState};

/// Greatest perturbation of each coordinate of the trunk's position \[m\], and of its attitude
/// \[rad\].
const PERTURBATION: f64 = 1e-6;
/// Moves and turns the trunk of a plant at its start.
pub(crate) fn perturb(plant: &mut dyn Plant, perturbations: &mut Stream) -> Result<(), String> {
    let mut next = || PERTURBATION * (2.0 * perturbations.unit() - 1.0);
    let (shift, turn) = ([next(), next(), next()], [next(), next(), next()]);
    let state = plant.state().ok_or("its state has no names")?;
    let resumed = plant.resume_from(&perturbed(state, shift, turn)?);
    resumed.map(drop).map_err(|fault| fault.to_string())
}

/// Returns the state with the trunk shifted, and turned by small angles about the axes.
fn perturbed(state: PlantState, shift: [f64; 3], turn: [f64; 3]) -> Result<PlantState, String> {
    let Some(&[x, y, z]) = state.get(signal::BODY_POSITION) else {
        return Err("its state has no body/position".to_owned());
    };
    let moved = [x + shift[0], y + shift[1], z + shift[2]];
    let turned = match state.get(signal::BODY_ORIENTATION) {
        Some(&[w, x, y, z]) => {
            let [a, b, c] = turn.map(|angle| 0.5 * angle);
            let all = [
                w - a * x - b * y - c * z,
                x + a * w + b * z - c * y,
                y + b * w + c * x - a * z,
                z + c * w + a * y - b * x,
            ];
            let norm = all.iter().map(|value| value * value).sum::<f64>().sqrt();
            Some(all.map(|value| value / norm))
        }
        _ => None,
    };
    let state = state.with(signal::BODY_POSITION, &moved);
    Ok(match turned {
        Some(turned) => state.with(signal::BODY_ORIENTATION, &turned),
        None => state,
    })
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::SimTime;

    use super::*;

    #[test]
    fn trunk_is_shifted_and_turned_and_the_rest_of_the_state_kept() {
        let state = PlantState::at(SimTime::ZERO)
            .with(signal::BODY_POSITION, &[1.0, 2.0, 3.0])
            .with(signal::BODY_ORIENTATION, &[0.0, 1.0, 0.0, 0.0])
            .with("leg/LF/angles", &[0.5]);
        let found = perturbed(state, [1e-6, 0.0, -1e-6], [0.0, 2e-6, 0.0]).unwrap();
        let position = found.get(signal::BODY_POSITION).unwrap();
        assert_eq!(position, [1.0 + 1e-6, 2.0, 3.0 - 1e-6]);
        // (1, 0, 1e-6, 0) ⊗ (0, 1, 0, 0) = (0, 1, 0, -1e-6)
        let attitude = found.get(signal::BODY_ORIENTATION).unwrap();
        for (found, expected) in attitude.iter().zip([0.0, 1.0, 0.0, -1e-6]) {
            assert!((found - expected).abs() < 1e-12, "{attitude:?}");
        }
        assert_eq!(found.get("leg/LF/angles"), Some(&[0.5][..]));
        assert!(perturbed(PlantState::default(), [0.0; 3], [0.0; 3]).is_err());
    }
}
