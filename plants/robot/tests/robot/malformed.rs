//! Error messages for malformed robot files with one mistake each.
//!
//! A case replaces a text of `plain.toml`, Cheetah-cub without the intervals of its values.

use twinrig_robot::RobotFile;

const CHEETAH_CUB: &str = include_str!("../plain.toml");

/// Error message for Cheetah-cub with `old` replaced by `new`.
fn message(old: &str, new: &str) -> String {
    assert!(
        CHEETAH_CUB.contains(old),
        "the file does not contain {old:?}"
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
                insta::assert_snapshot!(message($old, $new));
            }
        )*
    };
}

cases! {
    length_in_hertz: "l1 = \"44.2 mm\"" => "l1 = \"44.2 Hz\"";
    length_without_unit: "l1 = \"44.2 mm\"" => "l1 = 44.2";
    length_of_zero: "l1 = \"44.2 mm\"" => "l1 = \"0 mm\"";
    missing_length: "l1 = \"44.2 mm\" " => "# ";
    misspelled_key: "parallel_travel" => "paralel_travel";
    unknown_key: "pulley_radius = \"25 mm\"" => "pulley_radius = \"25 mm\"\ncolour = \"red\"";
    pantograph_offset_too_long: "l_delta = \"15 mm\"" => "l_delta = \"60 mm\"";
    diagonal_min_out_of_range: "diagonal_min = \"62.82 mm\"" => "diagonal_min = \"90 mm\"";
    parallel_travel_out_of_range: "parallel_travel = \"10 mm\"" => "parallel_travel = \"31 mm\"";
    diagonal_preload_beyond_stop: "\"4400 N/m\", preload = \"3 mm\"" => "\"4400 N/m\", preload = \"-22 mm\"";
    parallel_preload_beyond_stop: "\"1800 N/m\", preload = \"3 mm\"" => "\"1800 N/m\", preload = \"-11 mm\"";
    foot_without_mass: "lumped_foot = \"30 g\"" => "lumped_foot = \"0 g\"";
    foot_heavier_than_its_leg: "lumped_foot = \"30 g\"" => "lumped_foot = \"50.1 g\"";
    segment_of_negative_mass: "l2 = \"10 g\"" => "l2 = \"-10 g\"";
    impossible_inertia: "inertia = [\"9.375e-4 kg·m²\"" => "inertia = [\"9.375 kg·m²\"";
    two_moments_of_inertia: "\"3.2176e-3 kg·m²\", " => "";
    unknown_leg: "leg = \"aslp\"" => "leg = \"alsp\"";
    duplicate_mount: "name = \"RF\"" => "name = \"LF\"";
    leg_name_with_slash: "name = \"RF\"" => "name = \"R/F\"";
    negative_friction: "friction = 0.6" => "friction = -0.6";
    friction_is_nan: "friction = 0.6" => "friction = nan";
    missing_servo: "[actuator.knee]" => "[actuator.ankle]";
    unclosed_table: "[trunk]" => "[trunk";
}
