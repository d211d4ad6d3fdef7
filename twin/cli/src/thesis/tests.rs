//! Properties of the registry and of the documentation.
