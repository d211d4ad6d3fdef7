//! Contacts of the feet in a run.

use twinrig_kernel::{Direction, Layout, signal};
use twinrig_runtime::Plant;

use super::residuals::{GaitContact, RestContact};
use crate::plants::plant_run::SampleVerdict;

/// Greatest speed of a foot at rest \[m/s\].
const REST_M_S: f64 = 1e-3;

/// Offsets of the signals of a foot, and its state at the last sample.
struct Foot {
    position: usize,
    clearance: usize,
    load: usize,
    force: usize,
    last: Option<FootSample>,
    /// Work of the ground since the last touch-down \[J\].
    work: f64,
}

#[derive(Clone, Copy)]
struct FootSample {
    position: [f64; 3],
    gap: f64,
    load: f64,
    speed: f64,
}

/// Contacts, sampled step by step. Forces are means over a step.
pub(super) struct ContactRecorder {
    outputs: Vec<f64>,
    feet: Vec<Foot>,
    step_s: f64,
    friction: Option<f64>,
    found: GaitContact,
}

impl ContactRecorder {
    pub(super) fn of(plant: &dyn Plant, step_s: f64, friction: Option<f64>) -> Option<Self> {
        let ports = plant.ports();
        let layout = Layout::of(&ports, Direction::Output);
        let legs = layout.fields().filter_map(|field| {
            let (leg, name) = signal::parse_leg(&field.port.name)?;
            (name == signal::FOOT_LOAD).then_some((leg, field.offset))
        });
        let feet = legs.map(|(leg, load)| {
            let at = |name| Some(layout.find(&signal::of_leg(leg, name))?.start);
            Some(Foot {
                position: at(signal::FOOT_POSITION)?,
                clearance: at(signal::FOOT_CLEARANCE)?,
                load,
                force: at(signal::FOOT_FORCE)?,
                last: None,
                work: 0.0,
            })
        });
        let feet: Vec<Foot> = feet.collect::<Option<_>>()?;
        (!feet.is_empty()).then(|| Self {
            outputs: vec![0.0; layout.len()],
            feet,
            step_s,
            friction,
            found: GaitContact {
                coulomb_n: friction.map(|_| 0.0),
                ..GaitContact::default()
            },
        })
    }

    pub(super) fn sample(&mut self, plant: &mut dyn Plant) -> SampleVerdict {
        plant.observe(&mut self.outputs);
        plant.begin_window();
        if self.outputs.iter().any(|output| output.is_nan()) {
            return SampleVerdict::NotFinite;
        }
        for foot in &mut self.feet {
            let of = |offset: usize| core::array::from_fn(|n| self.outputs[offset + n]);
            let sample = FootSample {
                position: of(foot.position),
                gap: self.outputs[foot.clearance],
                load: self.outputs[foot.load],
                speed: 0.0,
            };
            foot.step(
                sample,
                of(foot.force),
                self.friction,
                self.step_s,
                &mut self.found,
            );
        }
        SampleVerdict::Continue
    }

    /// Returns the residuals of all contacts, including those that have not ended.
    pub(super) fn finished(self) -> GaitContact {
        let mut found = self.found;
        for foot in &self.feet {
            found.end_contact(foot.work);
        }
        found
    }

    /// Returns the contact of the foot with the greatest load at the last sample.
    pub(super) fn rest(&self) -> Result<RestContact, String> {
        let last = self.feet.iter().filter_map(|foot| foot.last);
        let most = last.max_by(|a, b| a.load.total_cmp(&b.load));
        let most = most
            .filter(|most| most.load > 0.0)
            .ok_or("no foot carries load")?;
        if most.speed > REST_M_S {
            return Err(format!("a foot still moves at {:.2e} m/s", most.speed));
        }
        Ok(RestContact {
            load_n: most.load,
            penetration_m: (-most.gap).max(0.0),
            expected_m: None,
            stiffness_realised: None,
            speed_m_s: most.speed,
        })
    }
}

impl Foot {
    /// Adds a step that ends in `sample` and in which the ground exerted the mean `force`.
    fn step(
        &mut self,
        mut sample: FootSample,
        force: [f64; 3],
        friction: Option<f64>,
        step_s: f64,
        found: &mut GaitContact,
    ) {
        let Some(before) = self.last else {
            self.last = Some(sample);
            return;
        };
        let moved: [f64; 3] = core::array::from_fn(|n| sample.position[n] - before.position[n]);
        sample.speed = norm(moved) / step_s;
        self.last = Some(sample);
        let load = sample.load;
        if load <= 0.0 {
            found.end_contact(core::mem::take(&mut self.work));
            return;
        }
        // A contact that begins or ends within the step has no gap at the other end of it.
        let gap = before.gap.abs().min(sample.gap.abs());
        found.signorini_j = found.signorini_j.max(gap * load);
        found.penetration_m = found.penetration_m.max(-sample.gap);
        let work: f64 = force
            .iter()
            .zip(moved)
            .map(|(force, moved)| force * moved)
            .sum();
        self.work += work;
        // The force along the normal is the load; the foot rises by the change of the gap.
        let tangential = (dot(force, force) - load * load).max(0.0).sqrt();
        found.along_slip_j += (work - load * (sample.gap - before.gap)).max(0.0);
        if let (Some(excess), Some(friction)) = (&mut found.coulomb_n, friction) {
            *excess = excess.max(tangential - friction * load);
        }
    }
}

impl GaitContact {
    fn end_contact(&mut self, work: f64) {
        self.created_j += work.max(0.0);
        self.dissipated_j += (-work).max(0.0);
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_S: f64 = 1e-3;

    /// Returns the residuals of samples (x, height, force along x, load) with friction ½.
    fn residuals(samples: &[(f64, f64, f64, f64)]) -> GaitContact {
        let mut foot = Foot {
            position: 0,
            clearance: 0,
            load: 0,
            force: 0,
            last: None,
            work: 0.0,
        };
        let mut found = GaitContact {
            coulomb_n: Some(0.0),
            ..GaitContact::default()
        };
        for &(x, gap, along, load) in samples {
            let sample = FootSample {
                position: [x, 0.0, gap],
                gap,
                load,
                speed: 0.0,
            };
            foot.step(sample, [along, 0.0, load], Some(0.5), STEP_S, &mut found);
        }
        found.end_contact(foot.work);
        found
    }

    fn assert_near(found: f64, expected: f64) {
        assert!(
            (found - expected).abs() < 1e-12,
            "{found} instead of {expected}"
        );
    }

    #[test]
    fn rigid_contact_has_no_residual() {
        // It lands, slides against friction at its limit, sticks below it and lifts off.
        let found = residuals(&[
            (0.0, 0.01, 0.0, 0.0),
            (0.1, 0.0, 0.0, 5.0),
            (0.2, 0.0, -1.0, 2.0),
            (0.2, 0.0, 0.5, 2.0),
            (0.2, 0.01, 0.0, 1.0),
            (0.2, 0.02, 0.0, 0.0),
        ]);
        // Of its work only the lift within the last loaded step is positive.
        assert_eq!((found.signorini_j, found.penetration_m), (0.0, 0.0));
        assert_eq!((found.coulomb_n, found.along_slip_j), (Some(0.0), 0.0));
        assert_eq!(found.created_j, 0.0, "{found:?}");
        assert_near(found.dissipated_j, 0.05 + 0.1 - 0.01);
    }

    #[test]
    fn each_violation_shows_in_its_residual() {
        let soft = residuals(&[(0.0, -1e-3, 0.0, 3.0), (0.0, -2e-3, 0.0, 3.0)]);
        assert_near(soft.signorini_j, 3e-3);
        assert_near(soft.penetration_m, 2e-3);
        let strong = residuals(&[(0.0, 0.0, 0.0, 2.0), (0.0, 0.0, 1.5, 2.0)]);
        assert_near(strong.coulomb_n.unwrap(), 0.5);
        let pushing = residuals(&[(0.0, 0.0, 0.0, 2.0), (0.1, 0.0, 1.0, 2.0)]);
        assert_near(pushing.along_slip_j, 0.1);
        assert_near(pushing.created_j, 0.1);
    }

    #[test]
    fn energy_is_created_by_contacts_and_not_by_their_parts() {
        // The ground stores 20 mJ and returns 15 mJ, then stores 20 mJ and returns 30 mJ.
        let found = residuals(&[
            (0.0, 0.0, 0.0, 0.0),
            (0.0, -2e-3, 0.0, 10.0),
            (0.0, -0.5e-3, 0.0, 10.0),
            (0.0, 0.0, 0.0, 0.0),
            (0.0, -2e-3, 0.0, 10.0),
            (0.0, 1e-3, 0.0, 10.0),
            (0.0, 1e-3, 0.0, 0.0),
        ]);
        assert_near(found.dissipated_j, 5e-3);
        assert_near(found.created_j, 10e-3);
    }
}
