//! Chores of the project, one file each; `cargo xtask` lists them.

pub mod bundle;
pub mod ci;
pub mod demo;
pub mod host;
pub mod machine;
pub mod midi;
