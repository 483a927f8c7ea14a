//! The editor without a window: every control by hand, keys and screen reader; how it looks; what a frame costs.

#[path = "../crates/core/tests/support/some.rs"]
#[allow(dead_code, reason = "other tests use the rest")]
mod some;
#[path = "support/editor.rs"]
mod support;

#[path = "editor/alterations.rs"]
mod alterations;
#[path = "editor/cost.rs"]
mod cost;
#[path = "editor/files.rs"]
mod files;
#[path = "editor/fingerings.rs"]
mod fingerings;
#[path = "editor/hands.rs"]
mod hands;
#[path = "editor/linked.rs"]
mod linked;
#[path = "editor/looks.rs"]
mod looks;
#[path = "editor/presets.rs"]
mod presets;
#[path = "editor/sides.rs"]
mod sides;
#[path = "editor/window.rs"]
mod window;

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::OnceLock;

use chalumeau::editor::snapshot::Snapshot;
use chalumeau::editor::{Action, EditorState, Tab, WindowState, draw};
use egui_kittest::Harness;
use support::Fake;

/// A written C4 really played, once for all tests.
fn c4() -> Snapshot {
    static PLAYED: OnceLock<Snapshot> = OnceLock::new();
    PLAYED.get_or_init(support::c4).clone()
}

/// A window in a test.
struct Window {
    harness: Harness<'static, EditorState>,
    host: Rc<Fake>,
    snapshot: Rc<RefCell<Snapshot>>,
    actions: Rc<RefCell<Vec<Action>>>,
}

impl Window {
    /// High enough that no column scrolls.
    fn tall(tab: Tab) -> Self {
        // The breath view has the longest column.
        Self::new(tab, (1100.0, if tab == Tab::Breath { 2650.0 } else { 1500.0 }))
    }

    fn new(tab: Tab, size: (f32, f32)) -> Self {
        Self::with_host(tab, size, Fake::default())
    }

    fn with_host(tab: Tab, size: (f32, f32), host: Fake) -> Self {
        let (host, snapshot) = (Rc::new(host), Rc::new(RefCell::new(c4())));
        let actions = Rc::new(RefCell::new(Vec::new()));
        let (h, s, a) = (host.clone(), snapshot.clone(), actions.clone());
        let kept = WindowState { tab, size, ..WindowState::default() };
        let mut harness =
            Harness::builder().with_step_dt(1.0 / 60.0).with_size(egui::vec2(size.0, size.1)).build_ui_state(
                move |ui, state: &mut EditorState| {
                    // As a plugin does: settings of this very frame.
                    s.borrow_mut().settings = h.settings();
                    let done = draw(ui, state, &*h, &s.borrow());
                    for action in &done {
                        if let Action::Alter(alterations) = action {
                            s.borrow_mut().alterations = alterations.clone().into();
                        }
                    }
                    a.borrow_mut().extend(done);
                },
                EditorState::new(kept),
            );
        harness.run();
        Self { harness, host, snapshot, actions }
    }

    /// What was done since this was last asked.
    fn actions(&self) -> Vec<Action> {
        std::mem::take(&mut self.actions.borrow_mut())
    }

    /// Two clicks in a row.
    fn double_click(&mut self, at: egui::Pos2) {
        self.harness.hover_at(at);
        // Clicks from before would make these the second and third.
        self.harness.run_steps(40);
        for pressed in [true, false, true, false] {
            let (button, modifiers) = (egui::PointerButton::Primary, egui::Modifiers::NONE);
            self.harness.event(egui::Event::PointerButton { pos: at, button, pressed, modifiers });
            self.harness.step();
        }
        self.harness.remove_cursor();
        self.harness.run();
    }

    /// Turns the wheel by so many notches, up if they are positive, with the pointer there.
    fn wheel(&mut self, at: egui::Pos2, notches: f32) {
        self.harness.hover_at(at);
        self.harness.step();
        self.harness.event(egui::Event::MouseWheel {
            unit: egui::MouseWheelUnit::Line,
            delta: egui::vec2(0.0, notches),
            phase: egui::TouchPhase::Move,
            source: egui::MouseWheelSource::Unknown,
            modifiers: egui::Modifiers::NONE,
        });
        self.harness.step();
        self.harness.remove_cursor();
        self.harness.run_steps(15);
    }

    /// Presses at a point, moves by `by` in two steps, lets go.
    fn drag(&mut self, from: egui::Pos2, by: egui::Vec2) {
        self.harness.hover_at(from);
        self.harness.step();
        self.harness.drag_at(from);
        self.harness.step();
        for part in [0.5, 1.0] {
            self.harness.hover_at(from + part * by);
            self.harness.step();
        }
        self.harness.drop_at(from + by);
        self.harness.run();
    }
}
