//! Facts of a kind of leg: lengths, stiffness, ranges of its joints.

use core::f64::consts::TAU;

use twinrig_kernel::Unit;
use twinrig_legged::Segment;
use twinrig_robot::leg::{LegError, LoadedLength, Pantograph, Stop};
use twinrig_robot::{Leg, Robot};

use super::fact::{Fact, shown};

/// Legs of the same parameters that carry the same share of the weight.
#[derive(Debug)]
pub(crate) struct LegKind {
    /// Name of the table below `leg`.
    pub name: String,
    /// Names of the legs.
    pub legs: Vec<String>,
    /// Parameters of each.
    pub leg: Leg,
    /// Its mechanism.
    pub pantograph: Pantograph,
    /// Load of each under the weight, all legs on the ground \[N\].
    pub load: f64,
    /// Length of each under that load.
    pub standing: LoadedLength,
}

/// Returns the kinds of legs of a robot, in the order of the mounts.
///
/// # Errors
/// [`LegError`] for a leg whose parameters form no pantograph.
pub(crate) fn leg_kinds(robot: &Robot) -> Result<Vec<LegKind>, LegError> {
    let mut kinds: Vec<LegKind> = Vec::new();
    for mount in &robot.legs {
        let load = robot.standing_load(mount);
        let same = |kind: &&mut LegKind| {
            kind.leg == mount.leg && (kind.load - load).abs() <= 1e-9 * load.abs()
        };
        if let Some(kind) = kinds.iter_mut().find(same) {
            kind.legs.push(mount.name.clone());
            continue;
        }
        let pantograph = Pantograph::new(&mount.leg)?;
        kinds.push(LegKind {
            name: mount.kind.clone(),
            legs: vec![mount.name.clone()],
            leg: mount.leg.clone(),
            standing: pantograph.length_under(load)?,
            pantograph,
            load,
        });
    }
    Ok(kinds)
}

impl LegKind {
    /// Returns the keys of the file that determine lengths, the springs among them or not.
    pub fn keys(&self, springs: bool) -> String {
        let mut keys = vec!["l1", "l2", "l3", "l_delta", "q2_ref"];
        if springs {
            keys.extend(["diagonal", "parallel"]);
        }
        let keys = keys.iter().map(|key| format!("leg.{}.{key}", self.name));
        keys.collect::<Vec<_>>().join(" ")
    }

    /// Returns the keys of one entry of the leg.
    pub fn key(&self, key: &str) -> String {
        format!("leg.{}.{key}", self.name)
    }

    /// Returns the keys of the masses of a leg.
    pub fn mass_keys(&self) -> String {
        let keys = ["l1", "l2", "l3", "foot"].map(|part| self.key(&format!("mass.{part}")));
        keys.join(" ")
    }

    /// Returns the facts of the leg itself.
    ///
    /// # Errors
    /// [`LegError`] for a leg without the poses that the facts are about.
    pub fn facts(&self, robot: &Robot) -> Result<Vec<Fact>, LegError> {
        let mut facts = self.lengths();
        facts.extend(self.spring_facts(robot)?);
        facts.extend(self.ranges()?);
        facts.extend(self.masses());
        Ok(facts)
    }

    fn lengths(&self) -> Vec<Fact> {
        let (keys, bottomed) = (self.keys(false), self.key("diagonal_min"));
        let leg = &self.pantograph;
        let standing = self.standing.length;
        let carried = match self.standing.stop {
            Some(Stop::Extended) => ": the preload carries it",
            Some(_) => ": the springs do not carry it, the leg bottoms out",
            None => "",
        };
        let load = shown(&[self.load], Unit::Newton);
        let on = format!("under {load}{carried}");
        let springs = format!("{} trunk.mass {}", self.keys(true), self.mass_keys());
        vec![
            Fact::new(
                "length_max",
                "hip to foot, extended",
                [leg.length_max()],
                Unit::Meter,
                &keys,
            ),
            Fact::new(
                "length_standing",
                "hip to foot, standing",
                [standing],
                Unit::Meter,
                &springs,
            )
            .with_note(on),
            Fact::new(
                "length_min",
                "hip to foot, shortest",
                [leg.length_min()],
                Unit::Meter,
                &format!("{keys} {bottomed}"),
            )
            .with_note("diagonal at its stop, pantograph closed"),
            Fact::new(
                "travel_weight",
                "travel under the weight",
                [leg.length_max() - standing],
                Unit::Meter,
                &springs,
            ),
            Fact::new(
                "travel_left",
                "travel left to the stop",
                [standing - leg.length_min()],
                Unit::Meter,
                &format!("{springs} {bottomed}"),
            ),
        ]
    }

    fn spring_facts(&self, robot: &Robot) -> Result<Vec<Fact>, LegError> {
        let leg = &self.pantograph;
        let keys = self.keys(true);
        let greatest = leg.greatest_axial_stiffness()?;
        let count = robot.legs.len() as f64;
        let bounce = |legs: f64, stiffness: f64| libm::sqrt(legs * stiffness / robot.mass()) / TAU;
        let heavy = format!("{keys} trunk.mass {}", self.mass_keys());
        let fact =
            |key, name, value: f64, unit, from: &str| Fact::new(key, name, [value], unit, from);
        let mut facts = vec![
            fact(
                "load_give",
                "load at which the leg gives",
                leg.preload_force()?,
                Unit::Newton,
                &keys,
            )
            .with_note("below it the preload holds the leg extended"),
            fact(
                "stiffness_max",
                "axial stiffness, greatest",
                greatest,
                Unit::NewtonPerMeter,
                &keys,
            )
            .with_note("least spring energy (thesis, eq. 2.21)"),
            fact(
                "bounce_max",
                "bounce on all legs, greatest stiffness",
                bounce(count, greatest),
                Unit::Hertz,
                &heavy,
            )
            .with_note("√(k/m)/2π"),
        ];
        let half = leg.length_under(2.0 * self.load)?;
        for (stiffness_name, bounce_name, legs, standing) in [
            (
                ["stiffness_all", "axial stiffness on all legs"],
                ["bounce_all", "bounce on all legs"],
                count,
                self.standing,
            ),
            (
                ["stiffness_half", "axial stiffness on half of the legs"],
                ["bounce_half", "bounce on half of the legs"],
                0.5 * count,
                half,
            ),
        ] {
            // At a stop the leg does not give: its stiffness is that of the structure.
            let stiffness = match standing.stop {
                None => Some(leg.axial_stiffness(standing.length)?),
                Some(_) => None,
            };
            let note = match stiffness {
                Some(_) => format!("at {}", shown(&[standing.length], Unit::Meter)),
                None => "none: the leg rests on a stop".to_owned(),
            };
            let [key, name] = stiffness_name;
            facts.push(
                Fact::new(key, name, stiffness, Unit::NewtonPerMeter, &heavy).with_note(&note),
            );
            let [key, name] = bounce_name;
            let frequency = stiffness.map(|stiffness| bounce(legs, stiffness));
            facts.push(Fact::new(key, name, frequency, Unit::Hertz, &heavy).with_note(note));
        }
        Ok(facts)
    }

    /// Returns the range of the joint of abduction, if the leg has one.
    fn abduction(&self) -> Option<Fact> {
        let joint = self.leg.abduction?;
        let ends = [-joint.adduction_max, joint.abduction_max];
        let keys = ["adduction_max", "abduction_max"];
        let keys = keys.map(|end| self.key(&format!("abduction.{end}")));
        let fact = Fact::new(
            "abduction_range",
            "abduction",
            ends,
            Unit::Radian,
            &keys.join(" "),
        );
        Some(fact.with_note("inwards … outwards"))
    }

    fn ranges(&self) -> Result<Vec<Fact>, LegError> {
        let leg = &self.pantograph;
        let bottomed = leg.knee_bottomed()?;
        let wound = (leg.cable_length(0.0) - leg.cable_of_knee(bottomed)) / leg.pulley_radius();
        let keys = format!("{} {}", self.keys(false), self.key("diagonal_min"));
        let mut facts = Vec::from_iter(self.abduction());
        facts.extend([
            Fact::new("hip_range", "hip q1", [], Unit::Radian, "").with_note("not limited"),
            Fact::new(
                "knee_range",
                "knee q2",
                [bottomed, 0.0],
                Unit::Radian,
                &keys,
            )
            .with_note("bottomed out … extended"),
            Fact::new(
                "opening_max",
                "opening q2 + q3, greatest",
                [leg.opening_stop(0.0)?.value],
                Unit::Radian,
                &format!("{} {}", self.keys(false), self.key("parallel_travel")),
            )
            .with_note("extended; the least is 0"),
            Fact::new(
                "pulley_range",
                "pulley of the cable",
                [0.0, wound],
                Unit::Radian,
                &format!("{keys} {}", self.key("pulley_radius")),
            )
            .with_note("extended … bottomed out"),
        ]);
        Ok(facts)
    }

    fn masses(&self) -> Vec<Fact> {
        let segments = Segment::of(&self.leg);
        let key = self.mass_keys();
        let inertia = format!("{key} {}", self.keys(false));
        vec![
            Fact::new(
                "leg_mass",
                "mass of a leg",
                [self.leg.mass.total()],
                Unit::Kilogram,
                &key,
            ),
            Fact::new(
                "segment_masses",
                "segments 1 … 2 … 3 with foot",
                segments.map(|segment| segment.mass),
                Unit::Kilogram,
                &key,
            ),
            Fact::new(
                "segment_inertia",
                "inertia of the segments",
                segments.map(|segment| segment.moment),
                Unit::KilogramSquareMeter,
                &inertia,
            )
            .with_note("about the centre of mass of each"),
        ]
    }
}
