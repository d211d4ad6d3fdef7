//! Tests of the sources themselves: dependencies between modules, documents, vocabulary.

mod arrows;
mod documents;
mod vocabulary;
