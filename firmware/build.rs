//! Compiles the C++ core behind `ffi/ffi.cpp` with this machine's C++17 compiler.

fn main() {
    println!("cargo::rerun-if-changed=ffi");
    println!("cargo::rerun-if-changed=include");
    cc::Build::new()
        .cpp(true)
        // The core needs no library, not even the C++ one.
        .cpp_link_stdlib(None)
        .std("c++17")
        .include("include")
        .file("ffi/ffi.cpp")
        .opt_level(2)
        .extra_warnings(true)
        .flag_if_supported("-fno-exceptions")
        .flag_if_supported("-fno-rtti")
        .flag_if_supported("-Wdouble-promotion")
        .compile("chalumeau_firmware_core");
}
