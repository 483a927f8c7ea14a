//! How large a window may be on this system's screen. Windows and macOS are not asked.

/// Shares of the screen's width and height that a window may take: the rest is for its frame and the desktop's panel.
#[cfg(target_os = "linux")]
const SHARES: (f32, f32) = (0.99, 0.92);

/// The largest window that the screen has room for, points at 100 %; `None` where that is not known. `fallback_scale`: pixels a
/// point where the system does not say. Asks the display, which takes a millisecond.
#[cfg(target_os = "linux")]
pub fn room(fallback_scale: Option<f64>) -> Option<(f32, f32)> {
    use x11rb::connection::Connection;
    use x11rb::protocol::randr::ConnectionExt;

    let (display, screen) = x11rb::connect(None).ok()?;
    let screen = display.setup().roots.get(screen)?;
    let monitors = display.randr_get_monitors(screen.root, true).ok().and_then(|asked| asked.reply().ok());
    let monitors = monitors.into_iter().flat_map(|reply| reply.monitors);
    // It is not known on which of them the window opens.
    let largest = monitors
        .map(|monitor| (monitor.width, monitor.height))
        .max_by_key(|&(width, height)| u32::from(width) * u32::from(height))
        .filter(|&(width, height)| width > 0 && height > 0);
    let (width, height) = largest.unwrap_or((screen.width_in_pixels, screen.height_in_pixels));
    // As the window library takes it.
    let resources = x11rb::resource_manager::new_from_default(&display).ok();
    let dots = resources.and_then(|resources| resources.get_value::<u32>("Xft.dpi", "").ok().flatten());
    let scale = dots.map(|dots| f64::from(dots) / 96.0).or(fallback_scale).filter(|scale| *scale > 0.0);
    let scale = scale.unwrap_or(1.0) as f32;
    Some((SHARES.0 * f32::from(width) / scale, SHARES.1 * f32::from(height) / scale))
}

/// As above.
#[cfg(not(target_os = "linux"))]
pub fn room(_fallback_scale: Option<f64>) -> Option<(f32, f32)> {
    None
}
