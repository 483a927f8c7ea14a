//! Links to knobs.
