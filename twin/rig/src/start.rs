//! Perturbed start of a plant.

use twinrig_campaign::spread::Magnitude;
use twinrig_kernel::{Stream, signal, stream};
use twinrig_runtime::{Plant, PlantState};

/// Perturbation of an ensemble of walks: greatest change of each coordinate of the trunk's position
/// \[m\], and of its attitude \[rad\].
const OF_WALKS: f64 = 1e-6;
/// Ends of the names of velocities, which are not perturbed.
const VELOCITIES: [&str; 3] = ["velocity", "rate", "rates"];

/// Perturbation of every coordinate of a plant's start: position and attitude of the trunk, joint
/// angles. Velocities stay. Each entry of the state has random numbers of its own, so that one more
/// leg changes no other coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StartPerturbation {
    /// Seed of the run.
    pub seed: u64,
    /// Number of the perturbed start, counted from 1.
    pub member: usize,
    /// Magnitude.
    pub magnitude: Magnitude,
}

impl StartPerturbation {
    /// Moves a plant at its start.
    ///
    /// # Errors
    /// The reason why the plant cannot be moved; it is unchanged then.
    pub fn apply(&self, plant: &mut dyn Plant) -> Result<(), String> {
        let state = plant.state().ok_or("its state has no names")?;
        let moved: Vec<(String, Vec<f64>)> = state
            .iter()
            .filter(|(name, _)| !VELOCITIES.iter().any(|end| name.ends_with(end)))
            .map(|(name, values)| (name.to_owned(), self.moved(name, values)))
            .collect();
        if moved.is_empty() {
            return Err("its state has no coordinates".to_owned());
        }
        let moved = moved
            .into_iter()
            .fold(state, |state, (name, values)| state.with(name, &values));
        resume(plant, &moved)
    }

    fn moved(&self, name: &str, values: &[f64]) -> Vec<f64> {
        let numbers = &mut stream(self.seed, &format!("ensemble/{}/{name}", self.member));
        let mut change = |value: f64| self.magnitude.change(value, numbers);
        if let (signal::BODY_ORIENTATION, &[w, x, y, z]) = (name, values) {
            let turn = [change(0.0), change(0.0), change(0.0)];
            return turned([w, x, y, z], turn).into();
        }
        values.iter().map(|&value| value + change(value)).collect()
    }
}

/// Moves and turns the trunk of a plant at the start of a walk.
///
/// # Errors
/// The reason why the plant cannot be moved; it is unchanged then.
pub fn perturb_trunk(plant: &mut dyn Plant, perturbations: &mut Stream) -> Result<(), String> {
    let mut next = || Magnitude::UpTo(OF_WALKS).change(0.0, perturbations);
    let (shift, turn) = ([next(), next(), next()], [next(), next(), next()]);
    let state = plant.state().ok_or("its state has no names")?;
    let perturbed = trunk_perturbed(state, shift, turn)?;
    resume(plant, &perturbed)
}

fn resume(plant: &mut dyn Plant, state: &PlantState) -> Result<(), String> {
    let resumed = plant.resume_from(state);
    resumed.map(drop).map_err(|fault| fault.to_string())
}

/// Returns the state with the trunk shifted, and turned by small angles about the axes.
fn trunk_perturbed(
    state: PlantState,
    shift: [f64; 3],
    turn: [f64; 3],
) -> Result<PlantState, String> {
    let Some(&[x, y, z]) = state.get(signal::BODY_POSITION) else {
        return Err("its state has no body/position".to_owned());
    };
    let moved = [x + shift[0], y + shift[1], z + shift[2]];
    let turned = match state.get(signal::BODY_ORIENTATION) {
        Some(&[w, x, y, z]) => Some(turned([w, x, y, z], turn)),
        _ => None,
    };
    let state = state.with(signal::BODY_POSITION, &moved);
    Ok(match turned {
        Some(turned) => state.with(signal::BODY_ORIENTATION, &turned),
        None => state,
    })
}

/// Returns an attitude turned by small angles about the axes.
fn turned([w, x, y, z]: [f64; 4], turn: [f64; 3]) -> [f64; 4] {
    let [a, b, c] = turn.map(|angle| 0.5 * angle);
    let all = [
        w - a * x - b * y - c * z,
        x + a * w + b * z - c * y,
        y + b * w + c * x - a * z,
        z + c * w + a * y - b * x,
    ];
    let norm = all.iter().map(|value| value * value).sum::<f64>().sqrt();
    all.map(|value| value / norm)
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::{Port, SimTime};
    use twinrig_runtime::PlantFault;

    use twinrig_campaign::spread::LEAST;

    use super::*;

    #[test]
    fn trunk_is_shifted_and_turned_and_the_rest_of_the_state_kept() {
        let state = PlantState::at(SimTime::ZERO)
            .with(signal::BODY_POSITION, &[1.0, 2.0, 3.0])
            .with(signal::BODY_ORIENTATION, &[0.0, 1.0, 0.0, 0.0])
            .with("leg/LF/angles", &[0.5]);
        let found = trunk_perturbed(state, [1e-6, 0.0, -1e-6], [0.0, 2e-6, 0.0]).unwrap();
        let position = found.get(signal::BODY_POSITION).unwrap();
        assert_eq!(position, [1.0 + 1e-6, 2.0, 3.0 - 1e-6]);
        // (1, 0, 1e-6, 0) ⊗ (0, 1, 0, 0) = (0, 1, 0, -1e-6)
        let attitude = found.get(signal::BODY_ORIENTATION).unwrap();
        for (found, expected) in attitude.iter().zip([0.0, 1.0, 0.0, -1e-6]) {
            assert!((found - expected).abs() < 1e-12, "{attitude:?}");
        }
        assert_eq!(found.get("leg/LF/angles"), Some(&[0.5][..]));
        assert!(trunk_perturbed(PlantState::default(), [0.0; 3], [0.0; 3]).is_err());
    }

    /// Adopts any state.
    struct Adopting(PlantState);

    impl Plant for Adopting {
        fn name(&self) -> &'static str {
            "adopting"
        }
        fn ports(&self) -> Vec<Port> {
            Vec::new()
        }
        fn advance(&mut self, _: SimTime, _: &[f64]) -> Result<(), PlantFault> {
            Ok(())
        }
        fn observe(&mut self, _: &mut [f64]) {}
        fn state(&self) -> Option<PlantState> {
            Some(self.0.clone())
        }
        fn resume_from(&mut self, from: &PlantState) -> Result<Vec<String>, PlantFault> {
            self.0 = from.clone();
            Ok(Vec::new())
        }
    }

    fn started(legs: &[&str], magnitude: Magnitude, member: usize) -> PlantState {
        let trunk = PlantState::default()
            .with(signal::BODY_POSITION, &[0.0, 0.1, -3.0])
            .with(signal::BODY_ORIENTATION, &[1.0, 0.0, 0.0, 0.0])
            .with(signal::BODY_VELOCITY, &[1.0, 2.0, 3.0]);
        let state = legs.iter().fold(trunk, |state, leg| {
            let [angles, rates] = ["angles", "rates"].map(|it| signal::of_leg(leg, it));
            state.with(angles, &[0.5, -0.25]).with(rates, &[1.0])
        });
        let mut plant = Adopting(state);
        let perturbation = StartPerturbation {
            seed: 1,
            member,
            magnitude,
        };
        perturbation.apply(&mut plant).unwrap();
        plant.0
    }

    #[test]
    fn every_coordinate_moves_by_its_last_place_and_no_velocity() {
        let found = started(&["LF"], Magnitude::LastPlace, 1);
        let is_next = |found: f64, value: f64| {
            assert!(
                [value.next_up(), value.next_down()].contains(&found),
                "{found:e} {value:e}"
            );
        };
        let &[x, y, z] = found.get(signal::BODY_POSITION).unwrap() else {
            panic!("{found:?}");
        };
        assert_eq!(x.abs(), LEAST.next_up() - LEAST);
        is_next(y, 0.1);
        is_next(z, -3.0);
        for (found, value) in found.get("leg/LF/angles").unwrap().iter().zip([0.5, -0.25]) {
            // Below a power of two the last place has half of the unit.
            let change = (found - value).abs();
            assert_eq!(change, value.abs().next_up() - value.abs());
        }
        let attitude = found.get(signal::BODY_ORIENTATION).unwrap();
        assert!(
            attitude[0] == 1.0
                && attitude[1..]
                    .iter()
                    .all(|it| (1e-20..1e-18).contains(&it.abs()))
        );
        assert_eq!(found.get(signal::BODY_VELOCITY), Some(&[1.0, 2.0, 3.0][..]));
        assert_eq!(found.get("leg/LF/rates"), Some(&[1.0][..]));
    }

    #[test]
    fn members_differ_and_one_more_leg_changes_no_other_coordinate() {
        let up_to = Magnitude::UpTo(1e-6);
        let (one, two) = (started(&["LF"], up_to, 1), started(&["LF", "RF"], up_to, 1));
        for (name, values) in one.iter() {
            assert_eq!(two.get(name), Some(values));
        }
        assert_ne!(one, started(&["LF"], up_to, 2));
        let moved = one.get("leg/LF/angles").unwrap();
        assert!((moved[0] - 0.5).abs() <= 1e-6 && moved[0] != 0.5);
    }
}
