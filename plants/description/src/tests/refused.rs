//! Descriptions that are refused, each with its place and reason.

use std::path::Path;

use proptest::prelude::*;
use twinrig_description::{Language, import, urdf};
use twinrig_robot::RobotFile;

/// Returns Cheetah-cub as URDF.
fn cub() -> String {
    let robot = RobotFile::find("cheetah-cub", Path::new("")).unwrap();
    urdf(&robot.robot().unwrap()).unwrap()
}

fn refusal(text: &str) -> String {
    import(Language::Urdf, "pup.urdf", text, None)
        .unwrap_err()
        .to_string()
}

/// Replaced text, replacement, and words of the message, of which the last are the place.
const MISTAKES: &[(&str, &str, &[&str])] = &[
    ("</robot>", "", &["this is not XML", "pup.urdf:"]),
    ("<robot name", "<robt name", &["not XML", "pup.urdf:"]),
    (
        "<mass value=\"0.9\"/>",
        "<mass value=\"0,9\"/>",
        &["`0,9` is not a number", "pup.urdf:15:20"],
    ),
    (
        "<mass value=\"0.9\"/>",
        "<mass value=\"${m}\"/>",
        &["xacro FILE", "pup.urdf:15:20"],
    ),
    (
        "<mass value=\"0.9\"/>",
        "<mass value=\"nan\"/>",
        &["not within", "pup.urdf:15:20"],
    ),
    (
        "<mass value=\"0.9\"/>",
        "<mass value=\"-0.9\"/>",
        &["the mass is negative", "pup.urdf:15:7"],
    ),
    (
        "<mass value=\"0.9\"/>",
        "<mass/>",
        &["<mass> has no `value`", "pup.urdf:15:7"],
    ),
    (
        "<mass value=\"0.9\"/>",
        "",
        &["<inertial> has no <mass>", "pup.urdf:14:5"],
    ),
    (
        "<mass value=\"0.9\"/>",
        "<mass value=\"0\"/>",
        &["the trunk has no mass", "pup.urdf:13:3"],
    ),
    (
        "<mass value=\"0.9\"/>",
        "<mass value=\"1e8\"/>",
        &["would be invalid", "mass", "pup.urdf:2:1"],
    ),
    (
        "xyz=\"0.1 0.05 0\"",
        "xyz=\"0.1 0.05\"",
        &["`xyz` has 2 numbers, 3 are required", ":23:"],
    ),
    (
        "xyz=\"0.1 0.05 0\"",
        "xyz=\"-0.1 0.05 0\"",
        &["corner LF", "pup.urdf:2:1"],
    ),
    (
        "xyz=\"0 -1 0\"",
        "xyz=\"0 0 1\"",
        &["neither along nor across", "`LF_hip`", "pup.urdf:22:3"],
    ),
    (
        "xyz=\"0 -1 0\"",
        "xyz=\"0 0 0\"",
        &["neither along nor across", "pup.urdf:22:3"],
    ),
    (
        "\"LF_hip\" type=\"continuous\"",
        "\"LF_hip\" type=\"revolut\"",
        &[
            "there is no joint type `revolut`",
            "did you mean `revolute`?",
            ":22:",
        ],
    ),
    (
        "\"LF_hip\" type=\"continuous\"",
        "\"LF_hip\" type=\"prismatic\"",
        &["`LF_hip` is no hinge", ":22:"],
    ),
    (
        "\"LF_hip\" type=\"continuous\"",
        "\"LF_hip\" type=\"floating\"",
        &["`LF_hip` is no hinge", ":22:"],
    ),
    (
        "<parent link=\"trunk\"/>",
        "<parent link=\"trunc\"/>",
        &["there is no link `trunc`", "did you mean `trunk`?", ":24:"],
    ),
    (
        "<parent link=\"trunk\"/>",
        "",
        &["the joint has no <parent>", ":22:"],
    ),
    (
        "<parent link=\"trunk\"/>",
        "<parent link=\"LF_foot\"/>",
        &["a loop", "pup.urdf:2:1"],
    ),
    (
        "<child link=\"LF_upper\"/>",
        "<child link=\"LF_middle\"/>",
        &["the link `LF_middle` has two parents", "pup.urdf:"],
    ),
    (
        "<link name=\"LF_inner\"/>",
        "<link name=\"LF_foot\"/>",
        &["two links are named `LF_foot`", "pup.urdf:"],
    ),
    (
        "<link name=\"LF_inner\"/>",
        "<link name=\"LF_inner\"/><link name=\"lamp\"/>",
        &["two robots", "pup.urdf:"],
    ),
    (
        "upper=\"0\"",
        "upper=\"-1.65\"",
        &["bends the leg from 2.2", "`LF_knee`", "pup.urdf:"],
    ),
    (
        "<mass value=\"0.01\"/>",
        "<mass value=\"0\"/>",
        &["`LF_upper` has no mass", "pup.urdf:30:3"],
    ),
    (
        "<origin xyz=\"0 0 -0.0442\" rpy",
        "<origin rpy",
        &["`LF_upper` has no length", "pup.urdf:30:3"],
    ),
];

#[test]
fn mistakes_are_named_at_their_place() {
    let whole = cub();
    let mut missing: Vec<String> = Vec::new();
    for (from, to, words) in MISTAKES {
        assert!(whole.contains(from), "{from}");
        let message = refusal(&whole.replacen(from, to, 1));
        let absent = words.iter().filter(|word| !message.contains(**word));
        missing.extend(absent.map(|word| format!("{from} → {to}: `{word}` is not in\n{message}")));
    }
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

#[test]
fn other_files_are_recognised() {
    for (text, word) in [
        ("", "not XML"),
        ("name = \"Hound\"", "not XML"),
        ("<!DOCTYPE r [<!ENTITY a \"b\">]><robot>&a;</robot>", "DTD"),
        ("<mujoco/>", "twin import mjcf FILE"),
        ("<sdf version=\"1.9\"/>", "this is SDF"),
        ("<scene/>", "the root element of URDF is <robot>"),
        ("<robot/>", "the robot has no links"),
        (
            "<robot><link name=\"trunk\"/></robot>",
            "the trunk has no mass",
        ),
        (
            "<robot xmlns:xacro=\"http://ros.org/wiki/xacro\"><xacro:leg/></robot>",
            "expand it first",
        ),
    ] {
        let message = refusal(text);
        assert!(message.contains(word), "{text}: {message}");
        assert!(message.contains("--> pup.urdf:1:"), "{message}");
    }
}

#[test]
fn depth_and_size_of_a_description_are_no_problem() {
    let deep = format!(
        "<robot>{}{}</robot>",
        "<a>".repeat(100_000),
        "</a>".repeat(100_000)
    );
    assert!(!refusal(&deep).is_empty());
    let joint = |n: usize| {
        format!(
            "<link name=\"{n}\"/><joint type=\"revolute\"><parent link=\"{n}\"/><child link=\"{}\"/></joint>",
            n + 1
        )
    };
    let joints: String = (0..20_000).map(joint).collect();
    let long = format!("<robot>{joints}<link name=\"20000\"/></robot>");
    assert!(
        refusal(&long).contains("hinges about y"),
        "{}",
        refusal(&long)
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    /// A part of the text is lost, doubled, or replaced: never a panic, and what is accepted is a
    /// valid robot file.
    #[test]
    fn damaged_description_is_refused_or_makes_a_valid_file(
        from in 0_usize..12_000,
        length in 0_usize..60,
        insert in "[ -~]{0,8}|[0-9.e+-]{1,6}",
    ) {
        let mut text = cub();
        let end = (from + length).min(text.len());
        text.replace_range(from.min(end)..end, &insert);
        if let Ok(imported) = import(Language::Urdf, "pup.urdf", &text, None) {
            RobotFile::parse("pup.toml", &imported.text).unwrap().robot().unwrap();
        }
    }
}
