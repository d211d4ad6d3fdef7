//! Effects of factors, and which of them the design cannot distinguish.

use std::fmt;

use super::cells::{CELLS, CellFactor};

/// Effect of factors: the constant, a main effect, or the interaction of several. Its value for a
/// cell is the product of the coded factors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Effect {
    /// Bit n is the factor n of [`CellFactor::ALL`].
    factors: u8,
}

impl Effect {
    /// The constant, of value 1.
    pub const CONSTANT: Self = Self { factors: 0 };

    /// Effect of one factor.
    pub const fn main(factor: CellFactor) -> Self {
        let factors = 1 << factor as u8;
        Self { factors }
    }

    /// Interaction of two factors; the constant if they are equal.
    pub const fn interaction(one: CellFactor, other: CellFactor) -> Self {
        let factors = Self::main(one).factors ^ Self::main(other).factors;
        Self { factors }
    }

    /// Number of factors: 1 for a main effect.
    pub fn order(self) -> u32 {
        self.factors.count_ones()
    }

    /// Factors, in the order of [`CellFactor::ALL`].
    pub fn factors(self) -> impl Iterator<Item = CellFactor> {
        let all = CellFactor::ALL.into_iter();
        all.filter(move |factor| self.factors & (1 << *factor as u8) != 0)
    }

    /// Value at coded factors: their product.
    pub fn value(self, coded: &[f64; 5]) -> f64 {
        let factors = self.factors();
        factors.fold(1.0, |product, factor| product * coded[factor as usize])
    }

    /// Effects that have, in all cells, the value of this one or its negative, with the sign; in
    /// ascending order. The aliases of the constant are the defining relation of the design.
    pub fn aliases(self) -> Vec<(Self, f64)> {
        let own = column(self);
        let others = (0..32).map(|factors| Self { factors });
        let alias = |other: Self| {
            let theirs = column(other);
            let same = |sign: f64| own.iter().zip(&theirs).all(|(a, b)| *a == sign * b);
            let sign = [1.0, -1.0].into_iter().find(|sign| same(*sign))?;
            Some((other, sign))
        };
        let others = others.filter(|other| *other != self);
        let mut aliases: Vec<_> = others.filter_map(alias).collect();
        aliases.sort_by_key(|(effect, _)| effect.order());
        aliases
    }

    /// Whether the design cannot distinguish the two.
    pub fn is_aliased_with(self, other: Self) -> bool {
        self == other || self.aliases().iter().any(|(alias, _)| *alias == other)
    }

    /// The main effects, and of each set of aliased two-factor interactions one. Length·Width, on
    /// whose account the thesis ordered the factors, goes before its alias.
    pub fn estimable() -> Vec<Self> {
        let mut effects = vec![Self::interaction(CellFactor::Length, CellFactor::Width)];
        for (n, one) in CellFactor::ALL.into_iter().enumerate() {
            for &other in &CellFactor::ALL[n + 1..] {
                let interaction = Self::interaction(one, other);
                let known = |effect: &Self| effect.is_aliased_with(interaction);
                if !effects.iter().any(known) {
                    effects.push(interaction);
                }
            }
        }
        effects.extend(CellFactor::ALL.map(Self::main));
        effects.sort_by_key(|effect| effect.order());
        effects
    }
}

impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = self.factors().map(CellFactor::name).collect();
        if names.is_empty() {
            f.write_str("Constant")
        } else {
            f.write_str(&names.join("·"))
        }
    }
}

/// Returns the values of an effect for the sixteen cells.
pub(super) fn column(effect: Effect) -> [f64; 16] {
    CELLS.map(|cell| effect.value(&cell.coded))
}
