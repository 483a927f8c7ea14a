//! Signal processing that knows no physics: sample-rate conversion and the last guard of the output.

pub mod kernel;
pub mod limiter;
pub mod resampler;
pub mod warp;
