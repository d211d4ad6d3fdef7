//! What every solver owes: the same answers as an oracle and as each other, and the truth where there is no answer.

mod agreement;
mod allocation;
mod degenerate;
mod friction;
mod impact;
mod oracle;
mod reuse;
