//! Signal processing without physics: sample-rate conversion, and the limiter at the output.

pub mod low_pass;
pub mod limiter;
pub mod resampler;
pub mod warp;
