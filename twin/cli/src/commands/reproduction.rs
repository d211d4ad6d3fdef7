//! Command line that repeats the results of a call.

use std::ffi::OsString;

use twinrig_experiment::shell::quoted;

/// Options of the output, which a repetition chooses itself; whether each has a value.
const OF_OUTPUT: [(&str, bool); 3] = [("--json", false), ("--out", true), ("--color", true)];

/// Returns the command of a call with these arguments, for a POSIX shell.
pub(super) fn command(arguments: &[OsString]) -> String {
    let mut words = vec!["twin".to_owned()];
    let mut arguments = arguments.iter().map(|word| word.to_string_lossy());
    while let Some(word) = arguments.next() {
        let name = word.split('=').next();
        match OF_OUTPUT.iter().find(|(option, _)| Some(*option) == name) {
            // Its value is the next word, unless it is part of this one.
            Some((option, true)) if *option == word => drop(arguments.next()),
            Some(_) => (),
            None => words.push(quoted(&word)),
        }
    }
    words.join(" ")
}
