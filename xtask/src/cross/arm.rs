//! The command line for Linux on ARM (64 bits), run by qemu.

use anyhow::Result;

use crate::cross::build::Cargo;
use crate::cross::comparison::{Parts, Runner};
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

const PROGRAMS: &[&str] = &["--bin", "chalumeau", "--test", "scores", "--test", "render_hashes"];

/// Each part has twelve renderings; the first 22 parts have every rendering once.
const RENDERINGS: Parts = Parts {
    file: "render_hashes",
    name: "every_render_is_the_same_to_the_bit",
    hashes: "tests/golden/renders.tsv",
    parts: 66,
};

pub fn run() -> Result<()> {
    let built = CARGO.build(&[OPTIONS, PROGRAMS].concat())?;
    let folder = folder(CARGO.system);
    built.keep(&folder, &[("chalumeau", "chalumeau")])?;
    let cache = crate::debian::inside(&folder)?;
    let variables = vec![("CHALUMEAU_CACHE_DIR".to_owned(), format!("{cache}/cache"))];
    let runner = Runner { built: &built, words: &["qemu-aarch64"], variables };
    runner.scores(&folder)?;
    runner.parts(&RENDERINGS, &folder)?;
    runner.files("chalumeau", &folder)
}
