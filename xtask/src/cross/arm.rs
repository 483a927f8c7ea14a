//! The command line for Linux on ARM (64 bits), run by qemu.

use anyhow::Result;

use crate::cross::build::Cargo;
use crate::cross::comparison::Runner;
use crate::cross::folder;
use crate::debian::Packages;

const CARGO: Cargo = Cargo {
    system: "arm",
    target: "aarch64-unknown-linux-gnu",
    packages: Packages {
        purpose: "the compiler's library for ARM",
        processor: Some("arm64"),
        names: &[
            "rustc",
            "cargo",
            "gcc",
            "libc6-dev",
            "libstd-rust-dev:arm64",
            "gcc-aarch64-linux-gnu",
            "g++-aarch64-linux-gnu",
            // The tests of the page's module build a knob's links too.
            "pkgconf",
            "libasound2-dev:arm64",
            "qemu-user",
        ],
    },
    builds_library: false,
    variables: &[
        ("CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER", "aarch64-linux-gnu-gcc"),
        ("PKG_CONFIG_ALLOW_CROSS", "1"),
        ("PKG_CONFIG_LIBDIR", "/usr/lib/aarch64-linux-gnu/pkgconfig"),
    ],
};
const OPTIONS: &[&str] =
    &["-p", "chalumeau", "-p", "chalumeau-web", "--no-default-features", "--features", "chalumeau/cli"];

/// What tells most for its time, and what takes longest.
const FIRST: &[&str] = &["--bin", "chalumeau", "--test", "scores"];
const LAST: &[&str] = &["--test", "render_hashes"];

pub fn run() -> Result<()> {
    let built = CARGO.build(&[OPTIONS, FIRST].concat())?;
    let folder = folder(CARGO.system);
    built.keep(&folder, &[("chalumeau", "chalumeau")])?;
    let cache = crate::debian::inside(&folder)?;
    let variables = vec![("CHALUMEAU_CACHE_DIR".to_owned(), format!("{cache}/cache"))];
    let words = &["qemu-aarch64"];
    let runner = Runner { built: &built, words, variables: variables.clone() };
    runner.scores()?;
    runner.files("chalumeau", &folder)?;
    let built = CARGO.build(&[OPTIONS, LAST].concat())?;
    Runner { built: &built, words, variables }.test("render_hashes", &[])
}
