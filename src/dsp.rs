//! Signal processing that knows no physics: sample-rate conversion for the output.

pub mod resampler;
