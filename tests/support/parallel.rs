//! Work shared between the processor's cores.

use std::ops::ControlFlow;

use chalumeau_core::parallel;

/// `work` on every item, on all cores; results in the order of the items.
pub fn each<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    parallel::each(items.len(), |at| work(&items[at]), &mut |_| ControlFlow::Continue(())).unwrap()
}
