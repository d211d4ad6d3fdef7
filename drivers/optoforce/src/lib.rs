//! optoforce.
