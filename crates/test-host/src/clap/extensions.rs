//! The plugin's smaller extensions, as a host reads them.

use std::collections::VecDeque;
use std::ffi::{CStr, CString};
use std::io::{Read, Write};

use anyhow::{Context, Result};
use clack_extensions::note_name::{NoteNameBuffer, PluginNoteName};
use clack_extensions::note_ports::{NoteDialects, NotePortInfoBuffer, PluginNotePorts};
use clack_extensions::param_indication::{ParamIndicationAutomation, PluginParamIndication};
use clack_extensions::params::{ParamInfoBuffer, PluginParams};
use clack_extensions::remote_controls::{PluginRemoteControls, RemoteControlsPageBuffer};
use clack_extensions::state::PluginState;
use clack_extensions::state_context::{PluginStateContext, StateContextType};
use clack_host::plugin::PluginDescriptor;
use clack_host::prelude::*;
use clack_host::utils::Color;

use super::{Heard, Plugin};

/// A page of parameters for the knobs of a control surface.
#[derive(Clone, Debug, PartialEq)]
pub struct RemotePage {
    pub section: String,
    pub name: String,
    /// Empty places are left out.
    pub params: Vec<ClapId>,
}

/// What the library says of itself: id, name, vendor, version, description, addresses, features.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Description {
    pub texts: Vec<Option<String>>,
    pub features: Vec<String>,
}

/// A stream that moves at most `most` bytes at a time.
struct Slow {
    bytes: VecDeque<u8>,
    most: usize,
}

impl Write for Slow {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let taken = bytes.len().min(self.most);
        self.bytes.extend(&bytes[..taken]);
        Ok(taken)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Read for Slow {
    fn read(&mut self, room: &mut [u8]) -> std::io::Result<usize> {
        let most = room.len().min(self.most);
        self.bytes.read(&mut room[..most])
    }
}

fn said(text: &[u8]) -> String {
    String::from_utf8_lossy(text).into_owned()
}

fn describe(of: &PluginDescriptor) -> Description {
    let text = |words: Option<&CStr>| words.map(|words| words.to_string_lossy().into_owned());
    let texts = [
        of.id(),
        of.name(),
        of.vendor(),
        of.version(),
        of.description(),
        of.url(),
        of.manual_url(),
        of.support_url(),
    ];
    Description {
        texts: texts.map(text).into(),
        features: of.features().map(|feature| feature.to_string_lossy().into_owned()).collect(),
    }
}

impl Plugin {
    /// What the factory says, and what the instance says.
    pub fn descriptions(&self) -> Result<[Description; 2]> {
        let factory = self.entry.get_plugin_factory().context("the library has no plugin factory")?;
        let first = factory.plugin_descriptors().next().context("the library holds no plugin")?;
        // SAFETY: the plugin's own descriptor lives as long as the plugin.
        let own = unsafe { PluginDescriptor::from_raw(&*self.instance.raw_instance().desc) };
        Ok([describe(first), describe(own)])
    }

    /// Whether the library has a factory of this id.
    pub fn has_factory(&self, id: &CStr) -> bool {
        let entry = self.entry.raw_entry();
        // SAFETY: the library is loaded, and the id ends in a null.
        entry.get_factory.is_some_and(|get| unsafe { !get(id.as_ptr()).is_null() })
    }

    /// Whether the library makes a plugin of this id.
    pub fn creates(&self, id: &str) -> bool {
        let (Ok(id), Ok(info)) = (CString::new(id), HostInfo::new("test", "test", "", "1")) else {
            return false;
        };
        let new = PluginInstance::<()>::new(|()| (), |()| (), &self.entry, &id, &info);
        new.is_ok()
    }

    /// Whether there is a parameter of this index.
    pub fn has_param_info(&mut self, index: u32) -> bool {
        let handle = self.instance.plugin_handle();
        let mut buffer = ParamInfoBuffer::new();
        let params: Option<PluginParams> = handle.get_extension();
        params.is_some_and(|params| params.get_info(&handle, index, &mut buffer).is_some())
    }

    /// The state through a stream that takes at most `most` bytes at a time.
    pub fn save_slowly(&mut self, most: usize) -> Result<Vec<u8>> {
        let handle = self.instance.plugin_handle();
        let state: PluginState = handle.get_extension().context("no state")?;
        let mut stream = Slow { bytes: VecDeque::new(), most };
        state.save(&handle, &mut stream)?;
        Ok(stream.bytes.into())
    }

    /// Loads a state through a stream that gives at most `most` bytes at a time.
    pub fn restore_slowly(&mut self, bytes: &[u8], most: usize) -> Result<()> {
        let handle = self.instance.plugin_handle();
        let state: PluginState = handle.get_extension().context("no state")?;
        let mut stream = Slow { bytes: bytes.iter().copied().collect(), most };
        Ok(state.load(&handle, &mut stream)?)
    }

    /// What the plugin has said to its host since this was last asked.
    pub fn heard(&self) -> Heard {
        self.instance.access_shared_handler(super::Shared::heard)
    }

    /// Names of keys.
    pub fn note_names(&mut self) -> Result<Vec<(u16, String)>> {
        let handle = self.instance.plugin_handle();
        let names: PluginNoteName = handle.get_extension().context("no note names")?;
        let mut all = Vec::new();
        for index in 0..names.count(&handle) {
            let mut buffer = NoteNameBuffer::new();
            let name = names.get(&handle, u32::try_from(index)?, &mut buffer).context("no such name")?;
            let key = name.key.into_specific().context("a name of every key")?;
            all.push((key, said(name.name)));
        }
        Ok(all)
    }

    /// The pages for control surfaces.
    pub fn remote_pages(&mut self) -> Result<Vec<RemotePage>> {
        let handle = self.instance.plugin_handle();
        let pages: PluginRemoteControls = handle.get_extension().context("no remote controls")?;
        let mut all = Vec::new();
        for index in 0..pages.count(&handle) {
            let mut buffer = RemoteControlsPageBuffer::new();
            let page = pages.get(&handle, index, &mut buffer).context("no such page")?;
            let params = page.param_ids.iter().copied().flatten().collect();
            all.push(RemotePage { section: said(page.section_name), name: said(page.page_name), params });
        }
        Ok(all)
    }

    /// Dialects of the input and the output of notes: supported, preferred.
    pub fn note_dialects(&mut self) -> Result<[(NoteDialects, NoteDialects); 2]> {
        let handle = self.instance.plugin_handle();
        let ports: PluginNotePorts = handle.get_extension().context("no note ports")?;
        let mut dialects = Vec::new();
        for is_input in [true, false] {
            anyhow::ensure!(ports.count(&handle, is_input) == 1, "one port each way");
            let mut buffer = NotePortInfoBuffer::new();
            let port = ports.get(&handle, 0, is_input, &mut buffer).context("no such port")?;
            let preferred = port.preferred_dialect.map_or(NoteDialects::empty(), Into::into);
            dialects.push((port.supported_dialects, preferred));
        }
        dialects.try_into().map_err(|_| anyhow::anyhow!("two ports"))
    }

    /// The state for a context.
    pub fn save_for(&mut self, context: StateContextType) -> Result<Vec<u8>> {
        let handle = self.instance.plugin_handle();
        let state: PluginStateContext = handle.get_extension().context("no state context")?;
        let mut bytes = Vec::new();
        state.save(&handle, &mut bytes, context)?;
        Ok(bytes)
    }

    /// Loads a state for a context.
    pub fn restore_for(&mut self, mut bytes: &[u8], context: StateContextType) -> Result<()> {
        let handle = self.instance.plugin_handle();
        let state: PluginStateContext = handle.get_extension().context("no state context")?;
        Ok(state.load(&handle, &mut bytes, context)?)
    }

    /// Says that a controller is mapped to a parameter, or no longer.
    pub fn indicate_mapping(&mut self, id: ClapId, label: Option<&str>) -> Result<()> {
        let handle = self.instance.plugin_handle();
        let indication: PluginParamIndication = handle.get_extension().context("no indication")?;
        let words = label.map(CString::new).transpose()?;
        let colour = Color { alpha: 255, red: 255, green: 0, blue: 255 };
        indication.set_mapping(&handle, id, label.is_some(), Some(colour), words.as_deref(), None);
        Ok(())
    }

    /// Says that a parameter is automated.
    pub fn indicate_automation(&mut self, id: ClapId, automation: ParamIndicationAutomation) -> Result<()> {
        let handle = self.instance.plugin_handle();
        let indication: PluginParamIndication = handle.get_extension().context("no indication")?;
        indication.set_automation(&handle, id, automation, None);
        Ok(())
    }
}
