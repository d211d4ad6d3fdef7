//! Parts of a robot that have contact with the ground, and those that cannot reach it.

use twinrig_contact::{HeightField, Levels, Terrain};
use twinrig_legged::{Base, Contacts, LeggedError, Setup};

use crate::start::{robot, setup};

const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];

fn reaching(base: Base, contacts: Contacts, ground: Option<Terrain>) -> Contacts {
    let setup = Setup {
        contacts,
        ..setup(base, &LEGS, ground)
    };
    setup.reaching_contacts(&robot()).unwrap()
}

#[test]
fn parts_that_cannot_reach_the_ground_are_left_out() {
    use Contacts::{All, Feet, Trunk};
    let flat = || Some(Terrain::Flat);
    // Ankles of stretched legs end 15 mm above the ground on which the feet start.
    let bar = |height: f64| Some(Terrain::Levels(Levels::strip(1.0, 0.1, height)));
    let field = |height: f64| {
        let heights = vec![0.0, 0.0, 0.0, height];
        let field = HeightField::new([1.0, 1.0], 0.1, 2, heights);
        Some(Terrain::Heights(field.unwrap()))
    };
    for (base, contacts, ground, expected) in [
        (Base::Free, All, flat(), All),
        (Base::Planar, Trunk, flat(), Trunk),
        (Base::Free, All, None, Feet),
        (Base::Fixed, Trunk, bar(0.5), Feet),
        (Base::Fixed, All, flat(), Feet),
        (Base::Fixed, All, bar(0.005), Feet),
        (Base::Fixed, All, bar(0.05), All),
        (Base::Fixed, All, field(0.05), All),
        (Base::Fixed, Feet, bar(0.05), Feet),
    ] {
        let found = reaching(base, contacts, ground.clone());
        assert_eq!(found, expected, "{base:?} {contacts:?} {ground:?}");
    }
}

#[test]
fn a_robot_without_contact_is_refused() {
    let mut robot = robot();
    let setup = setup(Base::Free, &LEGS, Some(Terrain::Flat));
    assert!(setup.contact(&robot).is_ok());
    robot.contact = None;
    let refused = setup.contact(&robot).unwrap_err();
    let name = robot.name.clone();
    assert_eq!(refused, LeggedError::NoContact { robot: name });
}
