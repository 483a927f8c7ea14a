//! Compiles Steinberg's tests and their host from the SDK that the crate `clap-wrapper` carries, and `runner.cpp`.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Folders of the SDK of which every source is needed.
const FOLDERS: [&str; 10] = [
    "base/source",
    "base/thread/source",
    "pluginterfaces/base",
    "public.sdk/source/vst/hosting",
    "public.sdk/source/vst/testsuite",
    "public.sdk/source/vst/testsuite/bus",
    "public.sdk/source/vst/testsuite/noteexpression",
    "public.sdk/source/vst/testsuite/processing",
    "public.sdk/source/vst/testsuite/state",
    "public.sdk/source/vst/testsuite/unit",
];

/// Single sources of the SDK, besides those of [`FOLDERS`].
const FILES: [&str; 15] = [
    "public.sdk/source/common/commoniids.cpp",
    "public.sdk/source/common/commonstringconvert.cpp",
    "public.sdk/source/common/memorystream.cpp",
    "public.sdk/source/common/threadchecker_linux.cpp",
    "public.sdk/source/vst/testsuite/general/editorclasses.cpp",
    "public.sdk/source/vst/testsuite/general/midilearn.cpp",
    "public.sdk/source/vst/testsuite/general/midimapping.cpp",
    "public.sdk/source/vst/testsuite/general/parameterfunctionname.cpp",
    "public.sdk/source/vst/testsuite/general/scanparameters.cpp",
    "public.sdk/source/vst/testsuite/general/suspendresume.cpp",
    "public.sdk/source/vst/testsuite/general/terminit.cpp",
    "public.sdk/source/vst/utility/stringconvert.cpp",
    "public.sdk/source/vst/utility/testing.cpp",
    "public.sdk/source/vst/vstinitiids.cpp",
    "public.sdk/source/vst/vstpresetfile.cpp",
];

/// Sources of the folders that are for other systems.
const FOREIGN: [&str; 2] = ["_win32.cpp", "_mac.mm"];

fn main() {
    println!("cargo:rerun-if-changed=src/runner.cpp");
    let sdk = sdk();
    let mut build = cc::Build::new();
    build.cpp(true).std("c++17").warnings(false).include(&sdk).define("RELEASE", "1");
    for folder in FOLDERS {
        let mut sources: Vec<PathBuf> = std::fs::read_dir(sdk.join(folder))
            .unwrap_or_else(|reason| panic!("no {folder} in {}: {reason}", sdk.display()))
            .map(|entry| entry.expect("the folder can be read").path())
            .filter(|path| path.extension().is_some_and(|extension| extension == "cpp"))
            .filter(|path| !FOREIGN.iter().any(|end| path.to_string_lossy().ends_with(end)))
            .collect();
        sources.sort();
        build.files(sources);
    }
    build.files(FILES.map(|file| sdk.join(file))).file("src/runner.cpp").compile("steinberg_tests");
}

/// Where cargo keeps the SDK's sources.
fn sdk() -> PathBuf {
    let cargo = std::env::var_os("CARGO").expect("cargo runs this");
    let answer = Command::new(cargo)
        .args(["metadata", "--format-version=1", "--locked"])
        .output()
        .expect("cargo can be started");
    assert!(answer.status.success(), "cargo metadata: {}", String::from_utf8_lossy(&answer.stderr));
    let metadata: serde_json::Value = serde_json::from_slice(&answer.stdout).expect("cargo writes JSON");
    let packages = metadata["packages"].as_array().expect("a list of packages");
    let carrier = packages.iter().find(|package| package["name"] == "clap-wrapper");
    let manifest = carrier.and_then(|package| package["manifest_path"].as_str()).expect("the crate's place");
    Path::new(manifest).with_file_name("external").join("vst3sdk")
}
