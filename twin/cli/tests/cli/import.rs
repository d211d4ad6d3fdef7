//! Robots of other programs, and robots for them.

use std::fs;

use crate::common::{Folder, json, twin};

#[test]
fn exported_robot_is_imported_and_nothing_is_overwritten() {
    let folder = Folder::new("import");
    let model = folder.join("cub.urdf");
    let done = twin(&["export", "urdf", "cheetah-cub", "--out", &model]);
    assert_eq!(
        (done.code, done.out.trim_end()),
        (0, format!("written {model}").as_str())
    );
    assert_eq!(
        twin(&["export", "urdf", "cheetah-cub"]).out,
        fs::read_to_string(&model).unwrap()
    );

    let out = folder.join("robots/cub.toml");
    let words = ["import", "urdf", &model, "--name", "Cub", "--out", &out];
    let done = twin(&words);
    assert_eq!((done.code, done.err.as_str()), (0, ""));
    let said = format!("written {out}: 24 entries from {model}, 17 ASSUMED\n");
    assert!(done.out.starts_with(&said), "{}", done.out);
    let text = fs::read_to_string(&out).unwrap();
    assert!(text.contains("\nname = \"Cub\"\n"), "{text}");
    assert_eq!(
        twin(&["import", "urdf", &model, "--name", "Cub", "--out", "-"]).out,
        text
    );
    // The marks are those that `twin list` shows.
    let listed = twin(&["list", &out]);
    assert!(
        listed.out.contains("1.1 kg") && listed.out.contains(" * follows from"),
        "{}",
        listed.out
    );

    let done = twin(&words);
    assert_eq!(done.code, 2);
    assert!(done.err.contains("cub.toml exists"), "{}", done.err);
    assert_eq!(fs::read_to_string(&out).unwrap(), text);
}

#[test]
fn imported_robot_trots_bit_for_bit_like_the_exported_one() {
    let folder = Folder::new("import-trot");
    let (model, out) = (folder.join("cub.urdf"), folder.join("cub.toml"));
    twin(&["export", "urdf", "cheetah-cub", "--out", &model]);
    twin(&["import", "urdf", &model, "--out", &out]);
    let trot = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/trot.toml");
    let fingerprint = |robot: &str| {
        let words = [
            "run",
            "--json",
            "--no-record",
            "--until",
            "2 s",
            trot,
            "--set",
        ];
        let done = twin(&[&words[..], &[&format!("robot={robot}")]].concat());
        json(&done.out)[0]["fingerprint"].clone()
    };
    let ours = fingerprint("cheetah-cub");
    assert!(ours.is_string());
    assert_eq!(fingerprint(&out), ours);
    let text = fs::read_to_string(&out).unwrap();
    fs::write(&out, text.replace("l1 = \"44.2 mm\"", "l1 = \"44.3 mm\"")).unwrap();
    assert_ne!(fingerprint(&out), ours);
}

#[test]
fn refused_files_are_named_with_place_and_remedy() {
    let folder = Folder::new("import-refused");
    let refused = |language: &str, file: &str, words: &[&str]| {
        let done = twin(&["import", language, file, "--out", "-"]);
        assert_eq!((done.code, done.out.as_str()), (2, ""));
        for word in words {
            assert!(done.err.contains(word), "`{word}` is not in\n{}", done.err);
        }
    };
    let robot = folder.file("cub.urdf", "<robot name=\"cub\">\n  <link/>\n</robot>\n");
    refused(
        "urdf",
        &robot,
        &["<link> has no `name`", "cub.urdf:2:3", "^^^^^^^"],
    );
    refused("mjcf", &robot, &["cub.urdf:1:1", "twin import urdf FILE"]);
    let absent = folder.join("absent.urdf");
    refused("urdf", &absent, &["cannot read the file", "absent.urdf"]);
    let latin = folder.join("latin.urdf");
    fs::write(&latin, b"<robot name=\"\xfcber\"/>").unwrap();
    refused(
        "urdf",
        &latin,
        &["not UTF-8 from byte 13 on", "save it as UTF-8"],
    );
}
