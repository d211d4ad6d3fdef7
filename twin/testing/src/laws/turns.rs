/// Numbers that are taken in turn, endlessly; none is 0.
#[derive(Clone, Debug)]
pub(super) struct Turns {
    numbers: Vec<u64>,
    next: usize,
}

impl Turns {
    /// Creates the turns of some numbers; of none, those of 1.
    pub(super) fn new(numbers: impl IntoIterator<Item = u64>) -> Self {
        let mut numbers: Vec<u64> = numbers.into_iter().map(|number| number.max(1)).collect();
        if numbers.is_empty() {
            numbers.push(1);
        }
        Self { numbers, next: 0 }
    }

    pub(super) fn next(&mut self) -> u64 {
        let number = self.numbers[self.next];
        self.next = (self.next + 1) % self.numbers.len();
        number
    }

    pub(super) fn next_usize(&mut self) -> usize {
        usize::try_from(self.next()).unwrap_or(usize::MAX)
    }
}
