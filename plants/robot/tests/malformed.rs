//! Robot files that are wrong, one mistake each, and what a person is told about it.
//!
//! A case is a change of `robots/cheetah-cub.toml`: the text that is replaced, and what by.

use twinrig_robot::RobotFile;

const CHEETAH_CUB: &str = include_str!("../../../robots/cheetah-cub.toml");

/// What is said about Cheetah-cub with `old` replaced by `new`.
fn told(old: &str, new: &str) -> String {
    assert!(
        CHEETAH_CUB.contains(old),
        "the file no longer holds {old:?}"
    );
    let text = CHEETAH_CUB.replacen(old, new, 1);
    let file = RobotFile::parse("robots/mine.toml", &text);
    file.and_then(|file| file.robot()).unwrap_err().to_string()
}

macro_rules! cases {
    ($($name:ident: $old:literal => $new:literal;)*) => {
        $(
            #[test]
            fn $name() {
                insta::assert_snapshot!(told($old, $new));
            }
        )*
    };
}

cases! {
    a_length_in_hertz: "l1 = \"44.2 mm\"" => "l1 = \"44.2 Hz\"";
    a_length_without_unit: "l1 = \"44.2 mm\"" => "l1 = 44.2";
    a_length_of_zero: "l1 = \"44.2 mm\"" => "l1 = \"0 mm\"";
    a_missing_length: "l1 = \"44.2 mm\" " => "# ";
    a_misspelled_key: "parallel_travel" => "paralel_travel";
    an_unknown_key: "pulley_radius = \"25 mm\"" => "pulley_radius = \"25 mm\"\ncolour = \"red\"";
    a_pantograph_that_does_not_fit: "l_delta = \"15 mm\"" => "l_delta = \"60 mm\"";
    a_diagonal_that_is_too_long: "diagonal_min = \"62.82 mm\"" => "diagonal_min = \"90 mm\"";
    a_rod_that_opens_too_far: "parallel_travel = \"10 mm\"" => "parallel_travel = \"31 mm\"";
    a_diagonal_that_bottoms_out_by_itself: "\"4400 N/m\", preload = \"3 mm\"" => "\"4400 N/m\", preload = \"-22 mm\"";
    a_rod_that_opens_too_far_by_itself: "\"1800 N/m\", preload = \"3 mm\"" => "\"1800 N/m\", preload = \"-11 mm\"";
    a_foot_without_mass: "lumped_foot = \"30 g\"" => "lumped_foot = \"0 g\"";
    a_foot_heavier_than_its_leg: "lumped_foot = \"30 g\"" => "lumped_foot = \"30 kg\"";
    a_segment_of_negative_mass: "l2 = \"10 g\"" => "l2 = \"-10 g\"";
    an_impossible_inertia: "inertia = [\"9.375e-4 kg·m²\"" => "inertia = [\"9.375 kg·m²\"";
    two_moments_of_inertia: "\"3.2176e-3 kg·m²\", " => "";
    a_leg_that_is_not_there: "leg = \"aslp\"" => "leg = \"alsp\"";
    a_leg_mounted_twice: "name = \"RF\"" => "name = \"LF\"";
    a_leg_with_a_slash: "name = \"RF\"" => "name = \"R/F\"";
    friction_below_zero: "friction = 0.6" => "friction = -0.6";
    friction_that_is_no_number: "friction = 0.6" => "friction = nan";
    a_missing_servo: "[actuator.knee]" => "[actuator.ankle]";
    a_table_that_never_closes: "[trunk]" => "[trunk";
}
