//! Tests of the sources themselves: dependencies between modules, documents and their commands,
//! vocabulary.

mod arrows;
mod documents;
mod imports;
mod links;
mod tutorials;
mod vocabulary;
