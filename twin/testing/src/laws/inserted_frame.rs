use super::DeviceSetup;
use super::probe::Tap;

/// Returns the frame of a number, foreign ones and, if answers are numbered, the last ones, if a
/// transmission begins with the byte `before`.
pub(super) fn inserted_frame<D>(
    setup: &DeviceSetup<D>,
    tap: &Tap,
    number: u8,
    before: u64,
) -> Option<Vec<u8>> {
    let transmissions = tap.transmissions();
    let mut start = 0;
    let begun = transmissions.iter().take_while(|transmission| {
        let is_begun = start <= before;
        start += transmission.bytes.len() as u64;
        is_begun
    });
    let begun: Vec<_> = begun.map(|it| &it.bytes).collect();
    let before_last = begun.iter().rev().skip(1).map(|bytes| bytes.len() as u64);
    if before_last.sum::<u64>() != before {
        return None;
    }
    let last = begun.into_iter().rev();
    let last: Vec<_> = last
        .take(if setup.numbers_answers { 4 } else { 0 })
        .collect();
    let foreign: Vec<_> = setup.foreign.iter().collect();
    // One half of each, if there are both.
    let is_foreign = last.is_empty() || (!foreign.is_empty() && number.is_multiple_of(2));
    let all = if is_foreign { foreign } else { last };
    let chosen = usize::from(number / 2).checked_rem(all.len())?;
    Some(all[chosen].clone())
}
