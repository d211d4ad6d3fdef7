//! Running recordings again and comparing them.

use serde_json::json;

use crate::common::{Folder, SOUND, json, twin};

#[test]
fn a_recording_replays_to_the_same_fingerprint() {
    let folder = Folder::new("replay");
    let scenario = folder.file("bob.toml", SOUND);
    let out = folder.join("out");
    let words = ["run", &scenario, "--out", &out, "--json", "--set", "seed=9"];
    let report = json(&twin(&words).out).remove(0);
    let recording = report["recording"].as_str().unwrap();
    std::fs::remove_file(&scenario).unwrap(); // the recording holds all it takes
    let done = twin(&["replay", recording, "--json"]);
    assert_eq!(done.code, 0, "{done:?}");
    let replayed = &json(&done.out)[0];
    assert_eq!(replayed["fingerprint"], report["fingerprint"]);
    assert_eq!(replayed["identical"], true);
    assert!(twin(&["replay", recording]).out.contains("identical"));
    assert_eq!(
        std::fs::read_dir(&out).unwrap().count(),
        1,
        "nothing is left lying"
    );
}

#[test]
fn a_recording_that_was_cut_off_is_compared_as_far_as_it_goes() {
    let folder = Folder::new("cut");
    let scenario = folder.file("bob.toml", &SOUND.replace("1 s", "4 s"));
    let done = twin(&["run", &scenario, "--json", "--out", &folder.join("out")]);
    let recording = json(&done.out)[0]["recording"].as_str().unwrap().to_owned();
    let bytes = std::fs::read(&recording).unwrap();
    std::fs::write(&recording, &bytes[..bytes.len() / 2]).unwrap();
    let told = "same as far as it goes: ";
    let done = twin(&["replay", &recording]);
    assert_eq!(done.code, 0, "{done:?}");
    assert!(
        done.out
            .contains(&format!("{told}the recording was cut off at ")),
        "{}",
        done.out
    );
    let whole = folder.join("whole.mcap");
    std::fs::write(&whole, &bytes).unwrap();
    for (pair, name) in [([&recording, &whole], 'a'), ([&whole, &recording], 'b')] {
        let done = twin(&["diff", pair[0], pair[1]]);
        assert_eq!(done.code, 0, "{done:?}");
        let told = format!("{told}{name} was cut off at ");
        assert!(done.out.contains(&told), "{}", done.out);
    }
    // Another run is another run, however little is left of it.
    let other = ["run", &scenario, "--json", "--plant", "snapping", "--out"];
    let done = twin(&[&other[..], &[&folder.join("other")]].concat());
    let other = json(&done.out)[0]["recording"].as_str().unwrap().to_owned();
    assert_eq!(twin(&["diff", &recording, &other]).code, 1);
    std::fs::write(&recording, b"no recording").unwrap();
    assert_eq!(twin(&["replay", &recording]).code, 2);
    assert_eq!(twin(&["diff", &recording, &recording]).code, 2);
}

#[test]
fn diff_finds_the_first_difference() {
    let folder = Folder::new("diff");
    let scenario = folder.file("bob.toml", SOUND);
    let out = folder.join("out");
    let run = |words: &[&str]| {
        let all = [&["run", &scenario, "--json", "--out", &out], words].concat();
        json(&twin(&all).out)[0]["recording"]
            .as_str()
            .unwrap()
            .to_owned()
    };
    let (a, b) = (
        run(&[]),
        run(&["--set", "record.signals=[\"body/position\"]"]),
    );
    let same = twin(&["diff", &a, &a]);
    assert!(same.code == 0 && same.out.contains("equal"), "{same:?}");
    let done = twin(&["diff", &a, &b, "--json"]);
    let difference = &json(&done.out)[0];
    assert_eq!(done.code, 1);
    assert_eq!(difference["first"], json!(null));
    assert_eq!(difference["only_in_a"], json!(["plant: body/rpy"]));
}

#[test]
fn a_comparison_of_nothing_is_an_error() {
    let folder = Folder::new("nothing-to-diff");
    let scenario = folder.file("bob.toml", SOUND);
    let run = |out: &str, signals: &str| {
        let set = format!("record.signals=[{signals}]");
        let out = folder.join(out);
        let done = twin(&["run", &scenario, "--json", "--out", &out, "--set", &set]);
        json(&done.out)[0]["recording"].as_str().unwrap().to_owned()
    };
    let position = run("position", "\"body/position\"");
    let attitude = run("attitude", "\"body/rpy\"");
    for pair in [[&position, &attitude], [&attitude, &position]] {
        for events in [&[][..], &["--events"]] {
            let words = [&["diff", pair[0], pair[1]], events].concat();
            let done = twin(&words);
            assert_eq!(done.code, 2, "{words:?}: {done:?}");
            assert!(done.out.contains("nothing to compare"), "{done:?}");
            let done = twin(&[&words[..], &["--json"]].concat());
            assert_eq!(done.code, 2, "{done:?}");
            let difference = &json(&done.out)[0];
            assert_eq!(difference["nothing"], true, "{difference}");
            assert!(difference["error"].is_string(), "{difference}");
        }
    }
    assert_eq!(twin(&["diff", &position, &position]).code, 0);
    // Cut off before the first sample.
    let bytes = std::fs::read(&position).unwrap();
    std::fs::write(&position, &bytes[..bytes.len().min(2_000)]).unwrap();
    assert_eq!(twin(&["diff", &position, &position]).code, 2);
}

#[test]
fn what_does_not_end_is_refused() {
    let endless = "/dev/zero";
    for words in [
        &["check", endless][..],
        &["run", endless],
        &["diff", endless, endless],
        &["replay", endless],
    ] {
        let done = twin(words);
        assert_eq!(done.code, 2, "{words:?}");
        assert!(done.err.contains("after 16 MB"), "{words:?}: {done:?}");
    }
    let folder = Folder::new("endless-robot");
    let robot = SOUND.replace("\"cheetah-cub\"", "\"./zero.toml\"");
    let scenario = folder.file("zero-robot.toml", &robot);
    std::os::unix::fs::symlink(endless, folder.join("zero.toml")).unwrap();
    let done = twin(&["check", &scenario]);
    assert_eq!(done.code, 2);
    assert!(done.err.contains("after 16 MB"), "{done:?}");
}

/// A scenario that comes through a pipe, as from `<(…)` of a shell, is one like any other.
#[test]
fn what_is_no_regular_file_is_read_if_it_ends() {
    let folder = Folder::new("pipe");
    let pipe = folder.join("pipe.toml");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.unwrap().success());
    let writer = {
        let pipe = pipe.clone();
        std::thread::Builder::new().spawn(move || std::fs::write(pipe, SOUND).unwrap())
    };
    let done = twin(&["check", &pipe]);
    assert_eq!(done.code, 0, "{done:?}");
    writer.unwrap().join().unwrap();
}
