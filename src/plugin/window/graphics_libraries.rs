//! Keeps the graphics libraries in memory once a window has used them.
//!
//! The window library loads EGL or GLX with each window and unloads it with the last one, on the window's own thread. The
//! drivers leave destructors behind that the C library calls when that thread ends. If the driver has been unloaded by
//! then, the call goes to where nothing is, and the host crashes: seen with Mesa 22.3.6 on a busy machine. A library marked `RTLD_NODELETE` stays loaded until the host ends.
#![allow(unsafe_code)] // functions of the C library; each use says why it is sound

use std::ffi::{CStr, c_int, c_void};

/// How the files of OpenGL and of its drivers are called: GLVND, Mesa, NVIDIA.
const STARTS: [&str; 7] = ["libEGL", "libGL", "libOpenGL", "libglapi", "libgallium", "libgbm", "libnvidia"];
/// How the files of Mesa's drivers end.
const END: &str = "_dri.so";

/// Marks those that are loaded now. Call it while a window is open.
pub fn keep_loaded() {
    let mut paths: Vec<Vec<u8>> = Vec::new();
    // SAFETY: the callback gets the pointer to `paths`, which outlives the call.
    unsafe { libc::dl_iterate_phdr(Some(collect), (&raw mut paths).cast()) };
    for path in paths {
        // SAFETY: the path ends in a zero byte. The library is loaded already, so that no code of it runs here. The handle
        // is never closed, which is the purpose.
        unsafe {
            libc::dlopen(path.as_ptr().cast(), libc::RTLD_LAZY | libc::RTLD_NOLOAD | libc::RTLD_NODELETE)
        };
    }
}

/// Adds the path of a graphics library, with its zero byte.
unsafe extern "C" fn collect(info: *mut libc::dl_phdr_info, _size: usize, paths: *mut c_void) -> c_int {
    // SAFETY: the C library passes a valid description, whose name is a string or null, and the pointer that
    // `keep_loaded` gave it.
    let (name, paths) = unsafe { ((*info).dlpi_name, &mut *paths.cast::<Vec<Vec<u8>>>()) };
    if !name.is_null() {
        // SAFETY: see above.
        let path = unsafe { CStr::from_ptr(name) };
        if is_graphics_library(&path.to_string_lossy()) {
            paths.push(path.to_bytes_with_nul().to_vec());
        }
    }
    0
}

fn is_graphics_library(path: &str) -> bool {
    let file = path.rsplit('/').next().unwrap_or(path);
    file.ends_with(END) || STARTS.iter().any(|start| file.starts_with(start))
}

#[cfg(test)]
mod tests {
    use std::ffi::CString;
    use std::fs;
    use std::path::Path;

    use super::*;

    #[test]
    fn drivers_are_known_by_their_file() {
        for path in [
            "/lib/x86_64-linux-gnu/libEGL_mesa.so.0",
            "/usr/lib/x86_64-linux-gnu/dri/swrast_dri.so",
            "/usr/lib/libGLX_nvidia.so.550",
            "libGLdispatch.so.0",
        ] {
            assert!(is_graphics_library(path), "{path}");
        }
        for path in ["", "/lib/x86_64-linux-gnu/libc.so.6", "/home/libGL/Other.vst3", "Chalumeau.clap"] {
            assert!(!is_graphics_library(path), "{path}");
        }
    }

    /// Whether the library of this path is in memory.
    fn is_loaded(path: &CString) -> bool {
        // SAFETY: the path ends in a zero byte, and nothing is loaded.
        let handle = unsafe { libc::dlopen(path.as_ptr(), libc::RTLD_LAZY | libc::RTLD_NOLOAD) };
        if !handle.is_null() {
            // SAFETY: the handle is the one from above.
            unsafe { libc::dlclose(handle) };
        }
        !handle.is_null()
    }

    /// A library that every program of Rust has, by a name of its own.
    fn copy(folder: &Path, name: &str) -> CString {
        unsafe extern "C" fn find(info: *mut libc::dl_phdr_info, _size: usize, found: *mut c_void) -> c_int {
            // SAFETY: the name is a string, and the pointer is the one given below.
            let (name, found) = unsafe { (CStr::from_ptr((*info).dlpi_name), &mut *found.cast::<String>()) };
            let name = name.to_string_lossy();
            if name.contains("libgcc_s") {
                *found = name.into_owned();
            }
            0
        }
        let mut source = String::new();
        // SAFETY: the callback gets the pointer to `source`, which outlives the call.
        unsafe { libc::dl_iterate_phdr(Some(find), (&raw mut source).cast()) };
        let path = folder.join(name);
        fs::copy(&source, &path).unwrap_or_else(|error| panic!("cannot copy {source:?}: {error}"));
        CString::new(path.to_str().unwrap()).unwrap()
    }

    #[test]
    fn graphics_libraries_stay_and_others_go() {
        let folder = tempfile::tempdir().unwrap();
        for (name, stays) in [("libEGL_test.so", true), ("libother_test.so", false)] {
            let path = copy(folder.path(), name);
            // SAFETY: the library is loaded already under its own name; its code that runs on loading is harmless.
            let handle = unsafe { libc::dlopen(path.as_ptr(), libc::RTLD_LAZY) };
            assert!(!handle.is_null() && is_loaded(&path), "{name} cannot be loaded");
            keep_loaded();
            // SAFETY: the handle is the one from above.
            unsafe { libc::dlclose(handle) };
            assert_eq!(is_loaded(&path), stays, "{name}");
        }
    }
}
