//! A window of Windows around a plugin's, as a host makes one.

use std::ffi::c_void;
use std::ptr::{null, null_mut};

use anyhow::{Result, ensure};
use windows_sys::Win32::Foundation::{HWND, LPARAM, LRESULT, RECT, WPARAM};
use windows_sys::Win32::System::LibraryLoader::GetModuleHandleW;
use windows_sys::Win32::UI::WindowsAndMessaging::{
    AdjustWindowRectEx, CreateWindowExW, DefWindowProcW, DestroyWindow, DispatchMessageW, GWLP_USERDATA,
    GetWindowLongPtrW, MSG, PM_REMOVE, PeekMessageW, RegisterClassW, SW_SHOW, SetWindowLongPtrW, ShowWindow,
    TranslateMessage, WM_CLOSE, WNDCLASSW, WS_CLIPCHILDREN, WS_OVERLAPPEDWINDOW,
};

const STYLE: u32 = WS_OVERLAPPEDWINDOW | WS_CLIPCHILDREN;

/// A shown window; closed when dropped. It belongs to the thread that made it.
pub struct Frame(HWND);

impl Frame {
    /// A window with this title, whose inside has this size in pixels.
    pub fn new(title: &str, (width, height): (u32, u32)) -> Result<Self> {
        let (class, title) = (wide("ChalumeauTestFrame"), wide(title));
        let mut edges =
            RECT { left: 0, top: 0, right: i32::try_from(width)?, bottom: i32::try_from(height)? };
        // SAFETY: the strings end in zero and outlive the calls; all other pointers may be null, or point to `edges` and to a
        // class whose procedure is a function of this program.
        let window = unsafe {
            let instance = GetModuleHandleW(null());
            let look = WNDCLASSW {
                lpfnWndProc: Some(heed),
                hInstance: instance,
                lpszClassName: class.as_ptr(),
                ..WNDCLASSW::default()
            };
            // A second time it fails, and the first class serves.
            RegisterClassW(&look);
            AdjustWindowRectEx(&mut edges, STYLE, 0, 0);
            let (width, height) = (edges.right - edges.left, edges.bottom - edges.top);
            let (above, menu) = (null_mut(), null_mut());
            let title = title.as_ptr();
            let class = class.as_ptr();
            CreateWindowExW(0, class, title, STYLE, 0, 0, width, height, above, menu, instance, null())
        };
        ensure!(!window.is_null(), "Windows makes no window: {}", std::io::Error::last_os_error());
        // SAFETY: the window was made above.
        unsafe { ShowWindow(window, SW_SHOW) };
        Ok(Self(window))
    }

    /// Windows' handle of it, which a plugin is given.
    pub fn handle(&self) -> *mut c_void {
        self.0
    }

    /// Hands out the messages that wait for the windows of this thread, the plugin's among them.
    pub fn attend(&self) {
        let mut message = MSG::default();
        // SAFETY: the message is ours and is written before it is read.
        unsafe {
            while PeekMessageW(&mut message, null_mut(), 0, 0, PM_REMOVE) != 0 {
                TranslateMessage(&message);
                DispatchMessageW(&message);
            }
        }
    }

    /// Whether somebody has asked the window to close. It stays open: the plugin's window closes first.
    pub fn is_asked_to_close(&self) -> bool {
        // SAFETY: the window lives as long as this.
        unsafe { GetWindowLongPtrW(self.0, GWLP_USERDATA) != 0 }
    }
}

impl Drop for Frame {
    fn drop(&mut self) {
        // SAFETY: the window lives, and belongs to this thread: `Frame` cannot be sent to another.
        unsafe { DestroyWindow(self.0) };
    }
}

/// What the window does with a message: it notes in its own memory that it was asked to close.
unsafe extern "system" fn heed(window: HWND, message: u32, word: WPARAM, long: LPARAM) -> LRESULT {
    if message == WM_CLOSE {
        // SAFETY: Windows passes a window that lives.
        unsafe { SetWindowLongPtrW(window, GWLP_USERDATA, 1) };
        return 0;
    }
    // SAFETY: all as Windows passed it.
    unsafe { DefWindowProcW(window, message, word, long) }
}

/// As Windows has its strings.
fn wide(text: &str) -> Vec<u16> {
    text.encode_utf16().chain([0]).collect()
}
