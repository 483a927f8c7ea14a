//! JACK: the plugin plays to a server, and waits for the next one when a server dies.
//!
//! Two threads take part.
//! - The *JACK* thread, which the library starts, plays the plugin ([`JackPlayer`]).
//! - The *link* thread ([`JackLink`]) opens the client, makes its connections, and watches it.

mod client;
mod link;
mod player;

pub use client::JackClient;
pub use link::{JackLink, JackPorts};
