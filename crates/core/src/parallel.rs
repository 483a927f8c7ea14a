//! Work on independent items: on all cores with the feature `threads`, one after another without it. The results are the
//! same in both cases. WebAssembly has no threads: there the feature changes nothing.

use std::ops::ControlFlow;

/// Most threads for the short work of [`each_part`]: it limits the cost of starting them.
#[cfg(all(feature = "threads", not(target_family = "wasm")))]
const PARTS_MOST: usize = 8;

#[cfg(all(feature = "threads", not(target_family = "wasm")))]
fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Work that several threads share, item by item: see [`workers`].
pub struct Queue<'a, T> {
    /// Most items that a thread should have begun at once, so that all threads have some.
    pub share: usize,
    take: &'a dyn Fn() -> Option<usize>,
    give: &'a dyn Fn(usize, T),
    stopped: &'a dyn Fn() -> bool,
}

impl<T> Queue<'_, T> {
    /// The next item, which nobody else gets; `None` if there is none or if the work has been stopped.
    pub fn take(&self) -> Option<usize> {
        (self.take)()
    }

    /// The result of an item that was taken.
    pub fn give(&self, item: usize, result: T) {
        (self.give)(item, result);
    }

    /// Whether the work has been stopped: then no result is wanted any more.
    pub fn is_stopped(&self) -> bool {
        (self.stopped)()
    }
}

/// Lets `work` go through a queue of `0..count`, on each core, and returns the results in the order of the items: for those who
/// work on several items at once. Others take [`each`].
///
/// `on` gets the share that is done, 0..=1, after each item. If it breaks, the queue is stopped and the answer is `None`.
#[cfg(all(feature = "threads", not(target_family = "wasm")))]
pub fn workers<T: Send>(
    count: usize,
    work: impl Fn(&Queue<'_, T>) + Sync,
    on: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Option<Vec<T>> {
    use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
    use std::sync::mpsc;

    let (next, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
    let (sender, results) = mpsc::channel();
    let mut found: Vec<Option<T>> = (0..count).map(|_| None).collect();
    let threads = cores().min(count);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            let (sender, next, stop, work) = (sender.clone(), &next, &stop, &work);
            scope.spawn(move || {
                let stopped = || stop.load(Ordering::Relaxed);
                let take = || {
                    let at = if stopped() { count } else { next.fetch_add(1, Ordering::Relaxed) };
                    (at < count).then_some(at)
                };
                // Nobody listens after a stop.
                let give = |at: usize, result: T| drop(sender.send((at, result)));
                let share = count.div_ceil(threads);
                work(&Queue { share, take: &take, give: &give, stopped: &stopped });
            });
        }
        drop(sender);
        for (done, (at, result)) in (1..).zip(results) {
            found[at] = Some(result);
            if on(done as f64 / count as f64).is_break() {
                stop.store(true, Ordering::Relaxed);
                return None;
            }
        }
        Some(())
    })?;
    found.into_iter().collect()
}

/// Lets `work` go through a queue of `0..count` and returns the results in the order of the items: for those who
/// work on several items at once. Others take [`each`].
///
/// `on` gets the share that is done, 0..=1, after each item. If it breaks, the queue is stopped and the answer is `None`.
#[cfg(not(all(feature = "threads", not(target_family = "wasm"))))]
pub fn workers<T: Send>(
    count: usize,
    work: impl Fn(&Queue<'_, T>) + Sync,
    on: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Option<Vec<T>> {
    use std::cell::{Cell, RefCell};

    let (next, done, stop) = (Cell::new(0), Cell::new(0), Cell::new(false));
    let found: RefCell<Vec<Option<T>>> = RefCell::new((0..count).map(|_| None).collect());
    let on = RefCell::new(on);
    let take = || {
        let at = next.replace(next.get() + 1);
        (at < count && !stop.get()).then_some(at)
    };
    let give = |at: usize, result: T| {
        found.borrow_mut()[at] = Some(result);
        done.set(done.get() + 1);
        if !stop.get() && (*on.borrow_mut())(done.get() as f64 / count as f64).is_break() {
            stop.set(true);
        }
    };
    work(&Queue { share: count, take: &take, give: &give, stopped: &|| stop.get() });
    if stop.get() { None } else { found.into_inner().into_iter().collect() }
}

/// Calls `work` for each of `0..count` and returns the results in that order.
///
/// `on` gets the share that is done, 0..=1, after each item. If it breaks, no new item is begun and the answer is `None`.
pub fn each<T: Send>(
    count: usize,
    work: impl Fn(usize) -> T + Sync,
    on: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Option<Vec<T>> {
    let go_through = |queue: &Queue<'_, T>| {
        while let Some(at) = queue.take() {
            queue.give(at, work(at));
        }
    };
    workers(count, go_through, on)
}

/// Calls `work` on each item with its own part of `out`.
///
/// `width` is the length of an item's part. The parts lie in the order of the items.
///
/// # Panics
///
/// If `out` is shorter than all parts together.
pub fn each_part<T: Sync>(
    items: &[T],
    width: impl Fn(&T) -> usize,
    out: &mut [f64],
    work: impl Fn(&T, &mut [f64]) + Sync,
) {
    let mut rest = out;
    let mut parts = Vec::with_capacity(items.len());
    for item in items {
        let (own, others) = std::mem::take(&mut rest).split_at_mut(width(item));
        rest = others;
        parts.push((item, own));
    }
    #[cfg(all(feature = "threads", not(target_family = "wasm")))]
    {
        let share = parts.len().div_ceil(cores().min(PARTS_MOST)).max(1);
        std::thread::scope(|scope| {
            for parts in parts.chunks_mut(share) {
                scope.spawn(|| parts.iter_mut().for_each(|(item, own)| work(item, own)));
            }
        });
    }
    #[cfg(not(all(feature = "threads", not(target_family = "wasm"))))]
    parts.into_iter().for_each(|(item, own)| work(item, own));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_keep_their_order() {
        let mut shares = Vec::new();
        let squares = each(100, |n| n * n, &mut |share| {
            shares.push(share);
            ControlFlow::Continue(())
        });
        assert_eq!(squares.unwrap(), (0..100).map(|n| n * n).collect::<Vec<_>>());
        assert!(shares.is_sorted() && shares.last() == Some(&1.0));
        assert_eq!(each(0, |n| n, &mut |_| ControlFlow::Break(())), Some(Vec::new()));
    }

    #[test]
    fn a_break_ends_the_work() {
        assert_eq!(each(100, |n| n, &mut |_| ControlFlow::Break(())), None);
    }

    #[test]
    fn each_item_fills_its_own_part() {
        let mut out = [0.0; 6];
        each_part(&[1_usize, 2, 3], |&width| width, &mut out, |&width, own| own.fill(width as f64));
        assert_eq!(out, [1.0, 2.0, 2.0, 3.0, 3.0, 3.0]);
    }
}
