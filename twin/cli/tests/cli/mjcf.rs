//! Custom MJCF models, and export of robots to MJCF.

use std::path::{Path, PathBuf};

use crate::common::twin;

fn model(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../scenarios/models")
        .join(name)
}

#[test]
fn standard_registry_names_the_missing_feature() {
    let pup = model("pup.toml").display().to_string();
    let done = twin(&["run", "--no-record", &pup]);
    assert_eq!(done.code, 2);
    let missing = "error: this build has no plant `mjcf`";
    assert!(done.err.starts_with(missing), "{}", done.err);
    assert!(
        done.err
            .trim_end()
            .ends_with("build with `--features mujoco`, after `ci/setup mujoco`"),
        "{}",
        done.err
    );
}

#[cfg(not(feature = "mujoco"))]
#[test]
fn build_without_engine_writes_no_model() {
    let done = twin(&["export", "mjcf", "cheetah-cub"]);
    let expected = "error: this build cannot write MJCF\n  = help: build with `--features mujoco`, after `ci/setup mujoco`\n";
    assert_eq!((done.code, done.err.as_str()), (2, expected));
}

#[cfg(feature = "mujoco")]
mod with_mujoco {
    use super::model;
    use crate::common::{Done, Folder, json, twin_of};

    fn twin(words: &[&str]) -> Done {
        twin_of(&twinrig::registry(), words)
    }

    fn text(name: &str) -> String {
        std::fs::read_to_string(model(name)).unwrap()
    }

    /// Writes the scenario `pup.toml`, with `from` replaced by `to`, and its model.
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
    fn pup_meets_its_expectations_and_is_replayed_without_model_file() {
        let folder = Folder::new("pup");
        let path = changed(&folder, "duration = \"4 s\"", "duration = \"3 s\"");
        let out = folder.join("out");
        let done = twin(&["run", "--json", "--out", &out, &path]);
        assert_eq!(done.code, 0, "{}{}", done.out, done.err);
        let recording = json(&done.out)[0]["recording"].as_str().unwrap().to_owned();
        // The recording contains the model, so the file is not read.
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
    fn signal_errors_are_shown_at_their_place() {
        let joint = refused("joint", "{ joint = \"lf_hip\" }", "{ joint = \"lf_hipp\" }");
        let expected = "error: the model has no joint `lf_hipp`\n  --> pup.toml:21:35\n   |\n\
                      21 | \"leg/LF/hip/position\" = { joint = \"lf_hipp\" }\n   |                                   ^^^^^^^^^\n   |\n   \
                      = help: did you mean `lf_hip`?";
        assert!(joint.contains(expected), "{joint}");

        let key = refused("key", "keyframe = \"crouched\"", "keyframe = \"crouching\"");
        assert!(
            key.contains("no keyframe `crouching`") && key.contains("`crouched`"),
            "{key}"
        );

        let word = refused("word", "{ sensor = \"gyro\" }", "{ body = \"trunk\" }");
        assert!(word.contains("error: a body has no `gyro`"), "{word}");
        assert!(word.contains("pup.toml:19:1"), "{word}");

        let unit = "{ actuator = \"lf_hip\", unit = \"N·m\" }";
        let unit = refused("unit", "{ actuator = \"lf_hip\" }", unit);
        assert!(unit.contains("it is in rad, not in N·m"), "{unit}");

        let nothing = refused("nothing", "{ sensor = \"gyro\" }", "{}");
        assert!(
            nothing.contains("`body/gyro` names no element of the model"),
            "{nothing}"
        );

        let two = refused(
            "two",
            "{ sensor = \"gyro\" }",
            "{ sensor = \"gyro\", site = \"imu\" }",
        );
        assert!(
            two.contains("`body/gyro` names several elements of the model"),
            "{two}"
        );

        let file = refused("file", "file = \"pup.xml\"", "file = \"cat.xml\"");
        assert!(
            file.contains("cannot read") && file.contains("pup.toml:12:8"),
            "{file}"
        );

        let none = refused("no-file", "file = \"pup.xml\"\n", "");
        assert!(none.contains("`file` is missing in `plant`"), "{none}");
    }

    #[test]
    fn mujoco_errors_are_shown_at_line_of_model() {
        let folder = Folder::new("refused-model");
        let path = changed(&folder, "duration", "duration");
        folder.file(
            "pup.xml",
            &text("pup.xml").replace("<freejoint/>", "<freejoynt/>"),
        );
        let done = twin(&["check", &path]);
        let output = done.out + &done.err;
        assert!(
            output.contains("freejoynt") && output.contains("line 23"),
            "{output}"
        );
        assert!(
            output.contains("pup.xml:23:7") && !output.contains("load failed"),
            "{output}"
        );
        // A message longer than usual.
        let pup = text("pup.xml");
        let unknown = pup.replacen(
            "joint=\"rh_knee\"",
            "joint=\"rh_knee_that_nobody_has_and_whose_name_is_much_too_long\"",
            1,
        );
        assert_ne!(unknown, pup);
        let line = 1 + unknown
            .split("rh_knee_that")
            .next()
            .unwrap()
            .matches('\n')
            .count();
        folder.file("pup.xml", &unknown);
        let done = twin(&["check", &path]);
        let output = done.out + &done.err;
        assert!(output.contains(&format!(", line {line}\n")), "{output}");
        assert!(output.contains(&format!("pup.xml:{line}:")), "{output}");
        // Lines of included files are not shown.
        folder.file("legs.xml", &unknown);
        folder.file("pup.xml", "<mujoco><include file=\"legs.xml\"/></mujoco>");
        let done = twin(&["check", &path]);
        let output = done.out + &done.err;
        assert!(output.contains("pup.toml:12:8"), "{output}");
    }

    #[test]
    fn element_of_other_kind_with_same_name_is_reported() {
        let site = refused("sort", "{ joint = \"lf_hip\" }", "{ site = \"lf_hip\" }");
        assert!(site.contains("no site `lf_hip`"), "{site}");
        assert!(site.contains("= help: it is a joint; "), "{site}");
        let folder = Folder::new("no-actuators");
        let path = changed(&folder, "duration", "duration");
        let pup = text("pup.xml");
        let (before, rest) = pup.split_once("<actuator>").unwrap();
        let bare = format!("{before}{}", rest.split_once("</actuator>").unwrap().1);
        // The keyframe has controls of the removed actuators.
        let (before, rest) = bare.split_once("<keyframe>").unwrap();
        let bare = format!("{before}{}", rest.split_once("</keyframe>").unwrap().1);
        folder.file("pup.xml", &bare);
        folder.file(
            "pup.toml",
            &text("pup.toml").replace("keyframe = \"crouched\"\n", ""),
        );
        let done = twin(&["check", &path]);
        let output = done.out + &done.err;
        assert!(
            output.contains("it is a joint; the model has no actuators; see From a URDF"),
            "{output}"
        );
    }

    #[test]
    fn controller_that_requires_robot_reports_it_and_accepts_one() {
        let without = refused("cpg", "kind = \"script\"", "kind = \"cpg\"");
        // Keys of the script are reported as unknown.
        assert!(without.contains("unknown key `shape`"), "{without}");
        let folder = Folder::new("stand");
        let scenario = text("pup.toml");
        let head = scenario.split("[controller]").next().unwrap();
        folder.file("pup.xml", &text("pup.xml"));
        let stand = "[controller]\nkind = \"stand\"\nperiod = \"5 ms\"\n";
        let path = folder.file("stand.toml", &format!("{head}{stand}"));
        let done = twin(&["check", &path]);
        let output = done.out + &done.err;
        assert!(
            output.contains("the controller `stand` cannot be built: it needs a robot"),
            "{output}"
        );
        let path = folder.file(
            "robot.toml",
            &format!("robot = \"cheetah-cub\"\n{head}{stand}"),
        );
        let done = twin(&["check", &path]);
        assert_eq!(done.code, 0, "{}{}", done.out, done.err);
    }

    #[test]
    fn exported_robot_runs_as_plant() {
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
            assert_eq!(done.out.trim_end(), format!("written {out}"));
            let printed = twin(&words).out;
            assert_eq!(
                printed.trim_end(),
                std::fs::read_to_string(&out).unwrap().trim_end()
            );
            for number in printed.split(['"', ' ']) {
                assert_ne!(number, "-0", "{printed}");
            }
            let indent = |line: &str| line.len() - line.trim_start().len();
            let lines = printed.lines().filter(|line| line.contains("\"LF_foot\""));
            let indents: Vec<_> = lines.map(indent).collect();
            assert!(
                indents.iter().all(|&one| one == indents[0] && one >= 6),
                "{indents:?}"
            );
            // The robot drops about 1 cm onto its springs and stands.
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
    fn exported_mjcf_and_urdf_make_the_same_robot_file() {
        let folder = Folder::new("both-formats");
        let robots = ["mjcf", "urdf"].map(|language| {
            let model = folder.join(language);
            let export = ["export", language, "cheetah-cub", "--out", &model];
            let minimal: &[&str] = match language {
                "mjcf" => &["--coordinates", "minimal"],
                _ => &[],
            };
            assert_eq!(twin(&[&export[..], minimal].concat()).code, 0);
            let done = twin(&["import", language, &model, "--out", "-"]);
            assert_eq!((done.code, done.err.as_str()), (0, ""));
            // Drives are servos in URDF, and clutches in MJCF, which are not read.
            let text = done.out.split("[actuator.hip]").next().unwrap().to_owned();
            text.split_once("name = ").unwrap().1.to_owned()
        });
        assert_eq!(robots[0], robots[1]);
        let maximal = folder.join("maximal.xml");
        twin(&["export", "mjcf", "cheetah-cub", "--out", &maximal]);
        let done = twin(&["import", "mjcf", &maximal, "--out", "-"]);
        assert_eq!(done.code, 2);
        assert!(done.err.contains("--coordinates minimal"), "{}", done.err);
    }

    #[test]
    fn plan_shows_undriven_inputs_and_step_of_model() {
        let folder = Folder::new("plan");
        let scenario = text("pup.toml");
        let head = scenario.split("[controller]").next().unwrap();
        let head: String = head
            .split_inclusive('\n')
            .filter(|line| !line.starts_with("step"))
            .collect();
        let pup = text("pup.xml");
        let step = pup
            .split_once("timestep=\"")
            .map(|(_, rest)| rest.split('"').next().unwrap());
        let step: f64 = step.map_or(0.002, |step| step.parse().unwrap());
        folder.file("pup.xml", &pup);
        let path = folder.file("bare.toml", &head);
        let done = twin(&["plan", "--json", &path]);
        assert_eq!(done.code, 0, "{}{}", done.out, done.err);
        let plan = &json(&done.out)[0];
        assert_eq!(plan["schedule"]["plant_step_s"], step);
        let free = plan["free"].as_array().unwrap();
        assert_eq!(free.len(), 8, "{}", done.out);
        assert_eq!(
            (&free[0]["name"], &free[0]["unit"]),
            (&"leg/LF/hip/command".into(), &"rad".into())
        );
        let output = twin(&["plan", &path]).out;
        assert!(
            output.contains("undriven inputs of the plant\n    leg/*/hip/command"),
            "{output}"
        );
        let path = folder.file("pup.toml", &scenario);
        let plan = &json(&twin(&["plan", "--json", &path]).out)[0];
        assert!(plan["free"].as_array().unwrap().is_empty(), "{plan}");
    }

    #[test]
    fn script_drives_only_hips_of_model_without_knees() {
        let folder = Folder::new("hips");
        let scenario = text("pup.toml");
        let keep = |without: &'static str| {
            let lines = scenario.split_inclusive('\n');
            lines
                .filter(|line| !(line.contains(without) && line.contains("actuator")))
                .collect::<String>()
        };
        folder.file("pup.xml", &text("pup.xml"));
        let path = folder.file("hips.toml", &keep("knee/command"));
        let done = twin(&["plan", &path]);
        assert_eq!(done.code, 0, "{}{}", done.out, done.err);
        assert!(
            done.out.contains("hip/command") && !done.out.contains("knee/command"),
            "{}",
            done.out
        );
        // A single missing knee is an error with a remedy.
        let path = folder.file("odd.toml", &keep("LF/knee/command"));
        let done = twin(&["plan", &path]);
        let output = done.out + &done.err;
        assert_eq!(done.code, 2, "{output}");
        assert!(
            output.contains("nothing takes `leg/LF/knee/command") && output.contains("= help: "),
            "{output}"
        );
    }

    #[test]
    fn study_of_standalone_model_is_refused() {
        let pup = model("pup.toml").display().to_string();
        let done = twin(&["study", "precision", &pup]);
        assert_eq!(done.code, 2);
        assert!(
            done.err.contains("this plant has a standalone model"),
            "{}",
            done.err
        );
    }
}
