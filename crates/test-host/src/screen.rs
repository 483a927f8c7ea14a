//! What can be seen and done on a display: windows, pictures of them, the pointer, how often a window is drawn, and what
//! the server holds for its clients.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use x11rb::connection::{Connection, RequestConnection};
use x11rb::protocol::Event;
use x11rb::protocol::damage::{self, ConnectionExt as _, ReportLevel};
use x11rb::protocol::res::ConnectionExt as _;
use x11rb::protocol::xproto::{
    BUTTON_PRESS_EVENT, BUTTON_RELEASE_EVENT, ClientMessageEvent, ConfigureWindowAux, ConnectionExt as _,
    CreateWindowAux, EventMask, ImageFormat, InputFocus, KEY_PRESS_EVENT, KEY_RELEASE_EVENT,
    MOTION_NOTIFY_EVENT, MapState, Window, WindowClass,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

/// Longest wait for something a window does by itself, on a busy machine.
pub const PATIENCE: Duration = Duration::from_secs(30);

/// Where a picture may fail to show that a window has drawn: fewer colours than text has shades.
const DRAWN_COLOURS: usize = 32;

/// Levels of 255 by which the same thing may be drawn differently from one time to the next.
const SAME: u8 = 8;

/// Bits of red, green and blue in a pixel.
const RGB: u32 = 0x00ff_ffff;

/// A connection to the display that `DISPLAY` names, or the program was told.
pub struct Screen {
    connection: RustConnection,
    root: Window,
}

/// Pixels, 0xRRGGBB, row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<u32>,
}

/// What the server holds for all its clients.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Holdings {
    pub clients: usize,
    /// Windows, pixmaps, colour maps, cursors and the like.
    pub resources: u64,
}

impl Screen {
    /// Connects to a display, to the one of the environment when none is named.
    pub fn open(display: Option<&str>) -> Result<Self> {
        let (connection, number) = x11rb::connect(display).context("cannot reach the display")?;
        let root = connection.setup().roots[number].root;
        for name in [damage::X11_EXTENSION_NAME, "XTEST", "X-Resource"] {
            if connection.extension_information(name)?.is_none() {
                bail!("the display has no {name}");
            }
        }
        connection.damage_query_version(1, 1)?.reply()?;
        connection.res_query_version(1, 2)?.reply()?;
        Ok(Self { connection, root })
    }

    /// A window as a host puts around a plugin's, at this place of the display; shown when this returns.
    pub fn frame(&self, at: (i16, i16), (width, height): (u32, u32)) -> Result<Window> {
        let window = self.connection.generate_id()?;
        // No window manager that might move it.
        let look = CreateWindowAux::new().override_redirect(1).background_pixel(0x0080_8080);
        let (width, height) = (u16::try_from(width)?, u16::try_from(height)?);
        let class = WindowClass::INPUT_OUTPUT;
        self.connection
            .create_window(0, window, self.root, at.0, at.1, width, height, 0, class, 0, &look)?
            .check()?;
        self.connection.map_window(window)?.check()?;
        Ok(window)
    }

    /// Asks a window's program to close it, as a window manager does.
    pub fn ask_to_close(&self, window: Window) -> Result<()> {
        let atom =
            |name: &[u8]| -> Result<u32> { Ok(self.connection.intern_atom(false, name)?.reply()?.atom) };
        let data = [atom(b"WM_DELETE_WINDOW")?, 0, 0, 0, 0];
        let asked = ClientMessageEvent::new(32, window, atom(b"WM_PROTOCOLS")?, data);
        Ok(self.connection.send_event(false, window, EventMask::NO_EVENT, asked)?.check()?)
    }

    /// Gives a window another size.
    pub fn resize(&self, window: Window, (width, height): (u32, u32)) -> Result<()> {
        let size = ConfigureWindowAux::new().width(width).height(height);
        Ok(self.connection.configure_window(window, &size)?.check()?)
    }

    /// Closes a window of this connection.
    pub fn close(&self, window: Window) -> Result<()> {
        Ok(self.connection.destroy_window(window)?.check()?)
    }

    /// The window inside another, once it is shown.
    pub fn inside(&self, window: Window) -> Result<Window> {
        self.wait("a window inside", || {
            let children = self.connection.query_tree(window)?.reply()?.children;
            Ok(children.into_iter().find(|&child| self.is_shown(child)))
        })
    }

    /// A window of that title, once it is shown.
    pub fn titled(&self, title: &str) -> Result<Window> {
        self.wait(&format!("a window called {title}"), || Ok(self.find(self.root, title)))
    }

    fn find(&self, within: Window, title: &str) -> Option<Window> {
        let children = self.connection.query_tree(within).ok()?.reply().ok()?.children;
        let named = |&child: &Window| self.is_shown(child) && self.title(child).as_deref() == Some(title);
        children
            .iter()
            .copied()
            .find(named)
            .or_else(|| children.iter().find_map(|&child| self.find(child, title)))
    }

    fn title(&self, window: Window) -> Option<String> {
        let title = |name: &[u8]| {
            let name = self.connection.intern_atom(true, name).ok()?.reply().ok()?.atom;
            let text = self.connection.get_property(false, window, name, 0u32, 0, 256).ok()?.reply().ok()?;
            (!text.value.is_empty()).then(|| String::from_utf8_lossy(&text.value).into_owned())
        };
        title(b"_NET_WM_NAME").or_else(|| title(b"WM_NAME"))
    }

    /// A window that has gone meanwhile is not shown.
    fn is_shown(&self, window: Window) -> bool {
        let look = self.connection.get_window_attributes(window).ok().and_then(|cookie| cookie.reply().ok());
        look.is_some_and(|look| look.map_state == MapState::VIEWABLE)
    }

    /// The size of the screen, pixels.
    pub fn whole(&self) -> Result<(u32, u32)> {
        self.size(self.root)
    }

    /// Width and height of a window.
    pub fn size(&self, window: Window) -> Result<(u32, u32)> {
        let found = self.connection.get_geometry(window)?.reply()?;
        Ok((found.width.into(), found.height.into()))
    }

    /// Where on the display a point of a window is.
    fn place(&self, window: Window, (x, y): (i16, i16)) -> Result<(i16, i16)> {
        let found = self.connection.translate_coordinates(window, self.root, x, y)?.reply()?;
        Ok((found.dst_x, found.dst_y))
    }

    /// What is seen where a window is.
    pub fn picture(&self, window: Window) -> Result<Picture> {
        let found = self.connection.get_geometry(window)?.reply()?;
        let (x, y) = self.place(window, (0, 0))?;
        let screen = self.connection.get_geometry(self.root)?.reply()?;
        // Only what lies on the screen can be seen.
        let (left, top) = (x.max(0), y.max(0));
        let end = |at: i16, length: u16, most: u16| (i32::from(at) + i32::from(length)).min(most.into());
        let right = end(x, found.width, screen.width);
        let bottom = end(y, found.height, screen.height);
        let (Ok(width), Ok(height)) =
            (u16::try_from(right - i32::from(left)), u16::try_from(bottom - i32::from(top)))
        else {
            bail!("the window is beside the screen");
        };
        let seen = self
            .connection
            .get_image(ImageFormat::Z_PIXMAP, self.root, left, top, width, height, u32::MAX)?
            .reply()?;
        let pixels: Vec<u32> =
            seen.data.as_chunks::<4>().0.iter().map(|&bytes| u32::from_le_bytes(bytes) & RGB).collect();
        if pixels.len() != usize::from(width) * usize::from(height) {
            bail!("the display's pixels are not of 32 bits");
        }
        Ok(Picture { width: width.into(), height: height.into(), pixels })
    }

    /// The first picture of a window that shows something.
    pub fn drawn(&self, window: Window) -> Result<Picture> {
        self.wait("something drawn", || {
            let picture = self.picture(window)?;
            Ok((picture.colours() >= DRAWN_COLOURS).then_some(picture))
        })
    }

    /// A picture that stays as it is for as long as `calm`.
    pub fn settled(&self, window: Window, calm: Duration) -> Result<Picture> {
        let mut last = (Instant::now(), self.drawn(window)?);
        self.wait("a picture that stays", || {
            let now = self.picture(window)?;
            if now.differing(&last.1) > 0 {
                last = (Instant::now(), now);
            }
            Ok((last.0.elapsed() >= calm).then(|| last.1.clone()))
        })
    }

    /// Puts the pointer on a point of a window.
    pub fn point(&self, window: Window, at: (i16, i16)) -> Result<()> {
        let (x, y) = self.place(window, at)?;
        self.act(MOTION_NOTIFY_EVENT, 0, (x, y))
    }

    /// Puts the pointer into the corner where it is over nothing.
    pub fn point_away(&self) -> Result<()> {
        let screen = self.connection.get_geometry(self.root)?.reply()?;
        self.act(
            MOTION_NOTIFY_EVENT,
            0,
            (i16::try_from(screen.width)? - 1, i16::try_from(screen.height)? - 1),
        )
    }

    /// Presses the first button, or lets go.
    pub fn press(&self, on: bool) -> Result<()> {
        self.act(if on { BUTTON_PRESS_EVENT } else { BUTTON_RELEASE_EVENT }, 1, (0, 0))
    }

    /// Presses and releases a key of this code.
    pub fn strike(&self, window: Window, code: u8) -> Result<()> {
        self.connection.set_input_focus(InputFocus::PARENT, window, 0u32)?.check()?;
        self.act(KEY_PRESS_EVENT, code, (0, 0))?;
        self.act(KEY_RELEASE_EVENT, code, (0, 0))
    }

    fn act(&self, kind: u8, detail: u8, (x, y): (i16, i16)) -> Result<()> {
        self.connection.xtest_fake_input(kind, detail, 0, self.root, x, y, 0)?.check()?;
        Ok(())
    }

    /// How often a window is drawn in this time.
    pub fn repaints(&self, window: Window, time: Duration) -> Result<usize> {
        let watch = self.connection.generate_id()?;
        self.connection.damage_create(watch, window, ReportLevel::NON_EMPTY)?.check()?;
        // What it shows already counts as damage at first.
        self.connection.damage_subtract(watch, 0u32, 0u32)?.check()?;
        while self.connection.poll_for_event()?.is_some() {}
        let began = Instant::now();
        let mut repaints = 0;
        while began.elapsed() < time {
            while let Some(event) = self.connection.poll_for_event()? {
                if let Event::DamageNotify(event) = event
                    && event.damage == watch
                {
                    repaints += 1;
                    // A frame may arrive in pieces; the next is at least 33 ms away.
                    std::thread::sleep(Duration::from_millis(15));
                    self.connection.damage_subtract(watch, 0u32, 0u32)?.check()?;
                }
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        self.connection.damage_destroy(watch)?.check()?;
        Ok(repaints)
    }

    /// What the server holds.
    pub fn holdings(&self) -> Result<Holdings> {
        let clients = self.connection.res_query_clients()?.reply()?.clients;
        let mut resources = 0;
        for client in &clients {
            // One that has just gone holds nothing.
            if let Ok(held) = self.connection.res_query_client_resources(client.resource_base)?.reply() {
                resources += held.types.iter().map(|kind| u64::from(kind.count)).sum::<u64>();
            }
        }
        Ok(Holdings { clients: clients.len(), resources })
    }

    /// Looks again and again until there is something to see.
    pub fn wait<T>(&self, what: &str, mut look: impl FnMut() -> Result<Option<T>>) -> Result<T> {
        let began = Instant::now();
        loop {
            if let Some(seen) = look()? {
                return Ok(seen);
            }
            if began.elapsed() > PATIENCE {
                bail!("{what} did not come about in {} s", PATIENCE.as_secs());
            }
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

impl Picture {
    /// Number of different colours.
    pub fn colours(&self) -> usize {
        let mut colours = self.pixels.clone();
        colours.sort_unstable();
        colours.dedup();
        colours.len()
    }

    /// Pixels that are visibly not as in another picture of the same size; all of them if it has another.
    pub fn differing(&self, other: &Self) -> usize {
        if (self.width, self.height) != (other.width, other.height) {
            return self.pixels.len();
        }
        let differ = |(a, b): &(&u32, &u32)| {
            let mut levels = a.to_be_bytes().into_iter().zip(b.to_be_bytes());
            levels.any(|(a, b)| a.abs_diff(b) > SAME)
        };
        self.pixels.iter().zip(&other.pixels).filter(differ).count()
    }

    /// Writes it as a PNG; makes the folder.
    pub fn write(&self, path: &Path) -> Result<()> {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        let file = File::create(path).with_context(|| format!("cannot write {}", path.display()))?;
        let (width, height) = (u32::try_from(self.width)?, u32::try_from(self.height)?);
        let mut encoder = png::Encoder::new(BufWriter::new(file), width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let bytes: Vec<u8> = self
            .pixels
            .iter()
            .flat_map(|pixel| {
                let [_, red, green, blue] = pixel.to_be_bytes();
                [red, green, blue]
            })
            .collect();
        encoder.write_header()?.write_image_data(&bytes)?;
        Ok(())
    }
}
