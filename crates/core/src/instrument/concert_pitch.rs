//! Concert pitch: the frequency of A4, and how an instrument reaches it.

/// Default pitch of A4, Hz.
pub const A4_HZ: f64 = 440.0;
/// Range of the pitch of A4, Hz: from baroque pitch to the high pitch of the 19th century.
pub const A4_RANGE_HZ: (f64, f64) = (415.0, 466.0);
/// Range of A4, Hz, in which the instrument is the one for 440 Hz and the player's tuning delay does the rest.
pub const A4_BY_DELAY_HZ: (f64, f64) = (430.0, 450.0);
