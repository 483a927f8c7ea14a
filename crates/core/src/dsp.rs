//! Signal processing without physics: sample-rate conversion, and the limiter at the output.

pub mod glide;
pub mod lanes;
pub mod limiter;
pub mod low_pass;
pub mod resampler;
pub mod smooth;
pub mod warp;
pub mod white;
