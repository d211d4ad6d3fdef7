//! Solvers against an oracle and against each other, including problems without a solution.

mod agreement;
mod allocation;
mod degenerate;
mod friction;
mod impact;
mod oracle;
mod reuse;
