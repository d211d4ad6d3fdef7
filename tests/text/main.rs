//! Tests of the sources themselves: dependencies between modules, documents and their commands,
//! kept files of tests, vocabulary.

mod arrows;
mod documents;
mod imports;
mod links;
mod orphans;
mod tutorials;
mod vocabulary;
