//! Bytes of the wires, around the instants at which something happens.

use serde::Serialize;
use twinrig_kernel::SimTime;
use twinrig_record::Recording;

use crate::run::Run;

/// Bytes of the wires.
#[derive(Debug, Serialize)]
pub(crate) struct Wires {
    /// Names of the traces.
    traces: Vec<String>,
    /// Intervals in which the bytes are kept \[s\]; empty for the whole run.
    windows: Vec<[f64; 2]>,
    pieces: Vec<Piece>,
}

/// Bytes that pass at an instant: instant \[s\], index of the trace, hexadecimal digits, and the
/// frames in them.
#[derive(Debug, PartialEq, Serialize)]
struct Piece(f64, usize, String, Vec<String>);

/// Greatest number of pieces, and time before and after an instant around which they are kept
/// \[s\].
const PIECES: usize = 80_000;
const AROUND: f64 = 0.03;

/// Returns the bytes of one of `runs` runs around the `instants` \[s\], or all if they are few;
/// none without traces.
pub(crate) fn wires(
    run: &Run<'_>,
    instants: impl Iterator<Item = f64>,
    runs: usize,
) -> Option<Wires> {
    let recording = run.shown();
    let traces: Vec<String> = recording.traces().map(str::to_owned).collect();
    let count: usize = traces.iter().map(|it| recording.bytes(it).count()).sum();
    if count == 0 {
        return None;
    }
    let most = PIECES / runs.max(1);
    let windows = if count <= most {
        Vec::new()
    } else {
        merged(std::iter::once(0.0).chain(instants))
    };
    let mut pieces = Vec::new();
    for (index, trace) in traces.iter().enumerate() {
        let mut decoder = run.assembly().and_then(|it| it.decoder(trace));
        let kept = pieces_within(recording, trace, &windows);
        pieces.extend(kept.map(|(at, bytes)| {
            let frames = decoder
                .as_mut()
                .map_or_else(Vec::new, |decode| decode(bytes));
            Piece(at.as_secs_f64(), index, hexadecimal(bytes), frames)
        }));
    }
    pieces.sort_by(|a, b| a.0.total_cmp(&b.0));
    pieces.truncate(most);
    Some(Wires {
        traces,
        windows,
        pieces,
    })
}

fn pieces_within<'a>(
    recording: &'a Recording,
    trace: &'a str,
    windows: &'a [[f64; 2]],
) -> impl Iterator<Item = (SimTime, &'a [u8])> {
    recording.bytes(trace).filter(move |(at, _)| {
        let at = at.as_secs_f64();
        let holds = |window: &[f64; 2]| (window[0]..=window[1]).contains(&at);
        windows.is_empty() || windows.iter().any(holds)
    })
}

/// Returns intervals around instants, merged where they overlap.
fn merged(instants: impl Iterator<Item = f64>) -> Vec<[f64; 2]> {
    let mut instants: Vec<f64> = instants.collect();
    instants.sort_by(f64::total_cmp);
    let mut windows: Vec<[f64; 2]> = Vec::new();
    for at in instants {
        let window = [at - AROUND, at + AROUND];
        match windows.last_mut() {
            Some(last) if window[0] <= last[1] => last[1] = window[1],
            _ => windows.push(window),
        }
    }
    windows
}

fn hexadecimal(bytes: &[u8]) -> String {
    let digits = bytes.iter().map(|byte| format!("{byte:02x}"));
    digits.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_around_close_instants_are_one() {
        let windows = merged([0.5, 0.0, 0.04].into_iter());
        assert_eq!(windows, [[-0.03, 0.07], [0.47, 0.53]]);
    }

    #[test]
    fn bytes_are_pairs_of_digits() {
        assert_eq!(hexadecimal(&[0x0a, 0xff]), "0a ff");
    }
}
