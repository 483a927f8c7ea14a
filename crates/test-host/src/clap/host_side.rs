//! What the plugin asks of its host, and what this host keeps of it.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};

use clack_extensions::context_menu::{
    ContextMenuBuilder, ContextMenuTarget, HostContextMenu, HostContextMenuImpl,
};
use clack_extensions::gui::{GuiSize, HostGui, HostGuiImpl};
use clack_extensions::latency::{HostLatency, HostLatencyImpl};
use clack_extensions::note_name::{HostNoteName, HostNoteNameImpl};
use clack_extensions::params::{
    HostParams, HostParamsImplMainThread, HostParamsImplShared, ParamClearFlags, ParamRescanFlags,
};
use clack_extensions::state::{HostState, HostStateImpl};
use clack_extensions::tail::{HostTail, HostTailImpl};
use clack_host::prelude::*;

/// What the plugin asks for, from whichever thread.
#[derive(Default)]
pub struct Shared {
    /// The host opens no windows.
    is_blind: bool,
    pub(super) callback: AtomicBool,
    /// Size the window wants to have, packed; 0 when nothing is asked for.
    pub(super) size: AtomicU64,
    heard: Counts,
    menus: Mutex<Vec<(Option<ClapId>, i32, i32)>>,
}

#[derive(Default)]
struct Counts {
    restarts: AtomicU32,
    latencies: AtomicU32,
    processes: AtomicU32,
    tails: AtomicU32,
    names: AtomicU32,
    rescans: AtomicU32,
}

/// How often the plugin has said something since this was last asked.
#[derive(Clone, Debug, PartialEq)]
pub struct Heard {
    /// It must be activated anew.
    pub restarts: u32,
    /// Its latency has changed.
    pub latencies: u32,
    /// It must be processed again.
    pub processes: u32,
    /// Its tail has changed.
    pub tails: u32,
    /// Its notes have other names.
    pub names: u32,
    /// What of its parameters must be read again, by any of the requests.
    pub rescans: ParamRescanFlags,
    /// It wants the host's menu of a parameter, at a place of its window.
    pub menus: Vec<(Option<ClapId>, i32, i32)>,
}

impl Shared {
    pub(super) fn blind() -> Self {
        Self { is_blind: true, ..Self::default() }
    }

    pub(super) fn heard(&self) -> Heard {
        let take = |count: &AtomicU32| count.swap(0, Ordering::AcqRel);
        Heard {
            restarts: take(&self.heard.restarts),
            latencies: take(&self.heard.latencies),
            processes: take(&self.heard.processes),
            tails: take(&self.heard.tails),
            names: take(&self.heard.names),
            rescans: ParamRescanFlags::from_bits_truncate(take(&self.heard.rescans)),
            menus: std::mem::take(&mut *self.menus.lock().expect("no panic while it was held")),
        }
    }
}

pub struct Main<'a>(pub(super) &'a Shared);
pub struct Audio<'a>(pub(super) &'a Shared);
pub struct Host;

impl SharedHandler<'_> for Shared {
    fn request_restart(&self) {
        self.heard.restarts.fetch_add(1, Ordering::AcqRel);
    }
    fn request_process(&self) {
        self.heard.processes.fetch_add(1, Ordering::AcqRel);
    }
    fn request_callback(&self) {
        self.callback.store(true, Ordering::Release);
    }
}

impl HostGuiImpl for Shared {
    fn resize_hints_changed(&self) {}
    fn request_resize(&self, size: GuiSize) -> Result<(), HostError> {
        self.size.store(size.pack_to_u64(), Ordering::Release);
        Ok(())
    }
    fn request_show(&self) -> Result<(), HostError> {
        Ok(())
    }
    fn request_hide(&self) -> Result<(), HostError> {
        Ok(())
    }
    fn closed(&self, _: bool) {}
}

impl HostParamsImplShared for Shared {
    fn request_flush(&self) {}
}

impl<'a> MainThreadHandler<'a> for Main<'a> {}

impl HostParamsImplMainThread for Main<'_> {
    fn rescan(&self, flags: ParamRescanFlags) {
        self.0.heard.rescans.fetch_or(flags.bits(), Ordering::AcqRel);
    }
    fn clear(&self, _: ClapId, _: ParamClearFlags) {}
}

impl HostStateImpl for Main<'_> {
    fn mark_dirty(&self) {}
}

impl HostLatencyImpl for Main<'_> {
    fn changed(&self) {
        self.0.heard.latencies.fetch_add(1, Ordering::AcqRel);
    }
}

impl HostNoteNameImpl for Main<'_> {
    fn changed(&self) {
        self.0.heard.names.fetch_add(1, Ordering::AcqRel);
    }
}

impl HostContextMenuImpl for Main<'_> {
    fn populate(&self, _: ContextMenuTarget, _: &mut ContextMenuBuilder) -> Result<(), HostError> {
        Ok(())
    }
    fn perform(&self, _: ContextMenuTarget, _: ClapId) -> Result<(), HostError> {
        Ok(())
    }
    fn can_popup(&self) -> bool {
        true
    }
    fn popup(&self, target: ContextMenuTarget, _: i32, x: i32, y: i32) -> Result<(), HostError> {
        let param = match target {
            ContextMenuTarget::Param(id) => Some(id),
            _ => None,
        };
        self.0.menus.lock().expect("no panic while it was held").push((param, x, y));
        Ok(())
    }
}

impl<'a> AudioProcessorHandler<'a> for Audio<'a> {}

impl HostTailImpl for Audio<'_> {
    fn changed(&mut self) {
        self.0.heard.tails.fetch_add(1, Ordering::AcqRel);
    }
}

impl HostHandlers for Host {
    type Shared<'a> = Shared;
    type MainThread<'a> = Main<'a>;
    type AudioProcessor<'a> = Audio<'a>;

    fn declare_extensions(builder: &mut HostExtensions<Self>, shared: &Shared) {
        builder
            .register::<HostState>()
            .register::<HostParams>()
            .register::<HostLatency>()
            .register::<HostTail>()
            .register::<HostNoteName>()
            .register::<HostContextMenu>();
        if !shared.is_blind {
            builder.register::<HostGui>();
        }
    }
}
