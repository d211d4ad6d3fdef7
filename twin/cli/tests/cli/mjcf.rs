//! Models of one's own from outside, and robots that are written for others.

use std::path::{Path, PathBuf};

use crate::common::twin;

fn model(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../scenarios/models")
        .join(name)
}

#[cfg(not(feature = "mujoco"))]
#[test]
fn a_build_without_the_engine_says_which_feature_it_lacks() {
    let pup = model("pup.toml").display().to_string();
    let done = twin(&["run", "--no-record", &pup]);
    assert_eq!(done.code, 2);
    let missing = "error: this build has no plant `mjcf`";
    assert!(done.err.starts_with(missing), "{}", done.err);
    assert!(
        done.err
            .trim_end()
            .ends_with("build with `--features mujoco`"),
        "{}",
        done.err
    );
    let done = twin(&["export", "mjcf", "cheetah-cub"]);
    let wanted = "error: this build cannot write MJCF\n  = help: build with `--features mujoco`\n";
    assert_eq!((done.code, done.err.as_str()), (2, wanted));
}

#[cfg(feature = "mujoco")]
mod with_mujoco {
    use super::{model, twin};
    use crate::common::{Folder, json};

    fn text(name: &str) -> String {
        std::fs::read_to_string(model(name)).unwrap()
    }

    /// The scenario of the pup beside its model, with `from` replaced.
    fn changed(folder: &Folder, from: &str, to: &str) -> String {
        let scenario = text("pup.toml");
        assert!(scenario.contains(from), "{from}");
        folder.file("pup.xml", &text("pup.xml"));
        folder.file("pup.toml", &scenario.replacen(from, to, 1))
    }

    fn refused(test: &str, from: &str, to: &str) -> String {
        let folder = Folder::new(test);
        let path = changed(&folder, from, to);
        let done = twin(&["check", &path]);
        assert_eq!(done.code, 2, "{}", done.out);
        (done.out + &done.err).replace(&path, "pup.toml")
    }

    #[test]
    fn the_pup_does_what_its_scenario_expects_and_does_it_again_without_its_file() {
        let folder = Folder::new("pup");
        let path = changed(&folder, "duration = \"4 s\"", "duration = \"2 s\"");
        let out = folder.join("out");
        let done = twin(&["run", "--json", "--out", &out, &path]);
        assert_eq!(done.code, 0, "{}{}", done.out, done.err);
        let recording = json(&done.out)[0]["recording"].as_str().unwrap().to_owned();
        // The recording keeps the model: what has become of the file does not matter.
        folder.file("pup.xml", "<mujoco/>");
        let again = twin(&["replay", "--json", &recording]);
        assert_eq!(
            json(&again.out)[0]["identical"],
            true,
            "{}{}",
            again.out,
            again.err
        );
    }

    #[test]
    fn what_the_model_does_not_have_is_shown_where_it_is_named() {
        let joint = refused("joint", "{ joint = \"lf_hip\" }", "{ joint = \"lf_hipp\" }");
        let wanted = "error: the model has no joint `lf_hipp`\n  --> pup.toml:20:35\n   |\n\
                      20 | \"leg/LF/hip/position\" = { joint = \"lf_hipp\" }\n   |                                   ^^^^^^^^^\n   \
                      = help: did you mean `lf_hip`?";
        assert!(joint.contains(wanted), "{joint}");

        let key = refused("key", "keyframe = \"crouched\"", "keyframe = \"crouching\"");
        assert!(
            key.contains("no keyframe `crouching`") && key.contains("`crouched`"),
            "{key}"
        );

        let word = refused("word", "{ sensor = \"gyro\" }", "{ body = \"trunk\" }");
        assert!(word.contains("error: a body has no `gyro`"), "{word}");
        assert!(word.contains("pup.toml:18:1"), "{word}");

        let unit = "{ actuator = \"lf_hip\", unit = \"N·m\" }";
        let unit = refused("unit", "{ actuator = \"lf_hip\" }", unit);
        assert!(unit.contains("it is in rad, not in N·m"), "{unit}");

        let nothing = refused("nothing", "{ sensor = \"gyro\" }", "{}");
        assert!(
            nothing.contains("`body/gyro` is nothing of the model"),
            "{nothing}"
        );

        let two = refused(
            "two",
            "{ sensor = \"gyro\" }",
            "{ sensor = \"gyro\", site = \"imu\" }",
        );
        assert!(
            two.contains("`body/gyro` is two things of the model"),
            "{two}"
        );

        let file = refused("file", "file = \"pup.xml\"", "file = \"cat.xml\"");
        assert!(
            file.contains("cannot read") && file.contains("pup.toml:11:8"),
            "{file}"
        );

        let none = refused("no-file", "file = \"pup.xml\"\n", "");
        assert!(none.contains("`file` is missing in `plant`"), "{none}");
    }

    #[test]
    fn what_mujoco_refuses_is_shown_at_the_name_of_the_file() {
        let folder = Folder::new("refused-model");
        let path = changed(&folder, "duration", "duration");
        folder.file(
            "pup.xml",
            &text("pup.xml").replace("<freejoint/>", "<freejoynt/>"),
        );
        let done = twin(&["check", &path]);
        let said = done.out + &done.err;
        assert!(
            said.contains("freejoynt") && said.contains("line 23"),
            "{said}"
        );
        assert!(said.contains("pup.toml:11:8"), "{said}");
    }

    #[test]
    fn a_controller_that_needs_a_robot_says_so_and_takes_one() {
        let without = refused("cpg", "kind = \"script\"", "kind = \"cpg\"");
        // What is the script's alone is wrong, too.
        assert!(without.contains("unknown key `shape`"), "{without}");
        let folder = Folder::new("stand");
        let scenario = text("pup.toml");
        let head = scenario.split("[controller]").next().unwrap();
        folder.file("pup.xml", &text("pup.xml"));
        let stand = "[controller]\nkind = \"stand\"\nperiod = \"5 ms\"\n";
        let path = folder.file("stand.toml", &format!("{head}{stand}"));
        let done = twin(&["check", &path]);
        let said = done.out + &done.err;
        assert!(
            said.contains("the controller `stand` cannot be built: it needs a robot"),
            "{said}"
        );
        let path = folder.file(
            "robot.toml",
            &format!("robot = \"cheetah-cub\"\n{head}{stand}"),
        );
        let done = twin(&["check", &path]);
        assert_eq!(done.code, 0, "{}{}", done.out, done.err);
    }

    #[test]
    fn a_robot_is_written_as_a_model_that_runs_as_a_plant() {
        for coordinates in ["minimal", "maximal"] {
            let folder = Folder::new(&format!("export-{coordinates}"));
            let out = folder.join("cub.xml");
            let words = [
                "export",
                "mjcf",
                "cheetah-cub",
                "--coordinates",
                coordinates,
            ];
            let done = twin(&[&words[..], &["--out", &out]].concat());
            assert_eq!((done.code, done.err.as_str()), (0, ""));
            let printed = twin(&words).out;
            assert_eq!(
                printed.trim_end(),
                std::fs::read_to_string(&out).unwrap().trim_end()
            );
            // It falls a centimetre or so onto its springs, and stands.
            let scenario = "duration = \"1 s\"\n[plant]\nmodel = \"mjcf\"\nfile = \"cub.xml\"\n\
                            [plant.outputs]\n\"body/position\" = { body = \"trunk\" }\n\"body/rpy\" = { body = \"trunk\" }\n\
                            [[expect]]\nbody = { fall = { height = 0.7, tilt = \"5 deg\" } }\n";
            let path = folder.file("cub.toml", scenario);
            let done = twin(&["run", "--no-record", &path]);
            assert_eq!(done.code, 0, "{}{}", done.out, done.err);
        }
        let done = twin(&["export", "mjcf", "no-such-robot"]);
        assert_eq!(done.code, 2);
        assert!(
            done.err.contains("there is no robot `no-such-robot`"),
            "{}",
            done.err
        );
    }

    #[test]
    fn a_study_of_it_is_refused() {
        let pup = model("pup.toml").display().to_string();
        let done = twin(&["study", "precision", &pup]);
        assert_eq!(done.code, 2);
        assert!(
            done.err.contains("this plant brings its own model"),
            "{}",
            done.err
        );
    }
}
