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

    #[test]
    fn keeping_what_is_not_there_does_no_harm() {
        keep_loaded();
    }
}
