//! `twin live` of a build without its server; the tests of the Python package have one with it.

use crate::common::twin;

#[cfg(not(feature = "live"))]
#[test]
fn build_without_the_server_names_the_feature() {
    let done = twin(&["live", "scenarios/trot.toml"]);
    let expected = "error: this build cannot serve visitors of a run\n  = help: build with \
                    `--features live`\n";
    assert_eq!((done.code, done.err.as_str()), (2, expected));
    assert_eq!(done.out, "");
    let done = twin(&["live", "scenarios/trot.toml", "--json"]);
    assert_eq!(done.code, 2);
    assert!(done.out.contains("--features live"), "{}", done.out);
}

#[test]
fn speed_is_limited() {
    let done = twin(&["live", "scenarios/trot.toml", "--speed", "1e9"]);
    assert_eq!(done.code, 2);
    assert!(done.err.contains("not from 0 to 1000"), "{}", done.err);
}
