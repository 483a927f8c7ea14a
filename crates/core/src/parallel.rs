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

/// Calls `work` for each of `0..count` and returns the results in that order.
///
/// `on` gets the share that is done, 0..=1, after each item. If it breaks, no new item is begun and the answer is `None`.
#[cfg(all(feature = "threads", not(target_family = "wasm")))]
pub fn each<T: Send>(
    count: usize,
    work: impl Fn(usize) -> T + Sync,
    on: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Option<Vec<T>> {
    use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
    use std::sync::mpsc;

    let (next, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
    let (sender, results) = mpsc::channel();
    let mut found: Vec<Option<T>> = (0..count).map(|_| None).collect();
    std::thread::scope(|scope| {
        for _ in 0..cores().min(count) {
            let (sender, next, stop, work) = (sender.clone(), &next, &stop, &work);
            scope.spawn(move || {
                while !stop.load(Ordering::Relaxed) {
                    let at = next.fetch_add(1, Ordering::Relaxed);
                    if at >= count || sender.send((at, work(at))).is_err() {
                        break;
                    }
                }
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

/// Calls `work` for each of `0..count` and returns the results in that order.
///
/// `on` gets the share that is done, 0..=1, after each item. If it breaks, no new item is begun and the answer is `None`.
#[cfg(not(all(feature = "threads", not(target_family = "wasm"))))]
pub fn each<T: Send>(
    count: usize,
    work: impl Fn(usize) -> T + Sync,
    on: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Option<Vec<T>> {
    (0..count)
        .map(|at| {
            let result = work(at);
            on((at + 1) as f64 / count as f64).is_continue().then_some(result)
        })
        .collect()
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
