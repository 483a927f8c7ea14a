//! Strings for a host's fixed arrays.

use std::ffi::{CStr, c_char};

/// Writes `text` with a null at its end, and as much of it as there is room for, in whole characters.
pub fn write(text: &str, room: &mut [c_char]) {
    let Some(most) = room.len().checked_sub(1) else { return };
    let end = text.floor_char_boundary(most);
    for (place, byte) in room.iter_mut().zip(text.as_bytes()[..end].iter().chain(&[0])) {
        *place = *byte as c_char;
    }
}

/// What a host's string says; empty for a null pointer or other encodings.
///
/// # Safety
/// `text` is null or ends in a null.
pub unsafe fn read<'a>(text: *const c_char) -> &'a str {
    if text.is_null() {
        return "";
    }
    // SAFETY: as above.
    unsafe { CStr::from_ptr(text) }.to_str().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_room_ends_at_a_character() {
        for (room, shown) in [(16, "20 \u{b0}C"), (6, "20 \u{b0}"), (5, "20 "), (4, "20 "), (1, "")] {
            let mut array = vec![b'?' as c_char; room];
            write("20 \u{b0}C", &mut array);
            // SAFETY: `write` has put a null there.
            assert_eq!(unsafe { read(array.as_ptr()) }, shown, "{room}");
        }
        write("x", &mut []);
    }
}
