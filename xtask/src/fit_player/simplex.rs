//! The simplex search of J. A. Nelder and R. Mead (The Computer Journal 7, 1965), with their coefficients.

/// The place of the smallest value that the search finds in so many steps, from `start` with first steps of these sizes.
pub fn minimise(f: &dyn Fn(&[f64]) -> f64, start: &[f64], first: &[f64], steps: usize) -> Vec<f64> {
    let corner = |at: Vec<f64>| (f(&at), at);
    let mut corners = vec![corner(start.to_vec())];
    for (axis, step) in first.iter().enumerate() {
        let mut at = start.to_vec();
        at[axis] += step;
        corners.push(corner(at));
    }
    let last = corners.len() - 1;
    for _ in 0..steps {
        corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        let centre: Vec<f64> = (0..start.len())
            .map(|axis| corners[..last].iter().map(|(_, at)| at[axis]).sum::<f64>() / last as f64)
            .collect();
        let along = |share: f64| {
            let worst = &corners[last].1;
            corner(
                centre.iter().zip(worst).map(|(centre, worst)| centre + share * (worst - centre)).collect(),
            )
        };
        let reflected = along(-1.0);
        let better = if reflected.0 < corners[0].0 {
            let expanded = along(-2.0);
            Some(if expanded.0 < reflected.0 { expanded } else { reflected })
        } else if reflected.0 < corners[last - 1].0 {
            Some(reflected)
        } else {
            let contracted = along(if reflected.0 < corners[last].0 { -0.5 } else { 0.5 });
            Some(contracted).filter(|contracted| contracted.0 < corners[last].0.min(reflected.0))
        };
        if let Some(better) = better {
            corners[last] = better;
            continue;
        }
        let best = corners[0].1.clone();
        for (value, at) in corners.iter_mut().skip(1) {
            at.iter_mut().zip(&best).for_each(|(at, best)| *at = best + 0.5 * (*at - best));
            *value = f(at);
        }
    }
    corners.sort_by(|a, b| a.0.total_cmp(&b.0));
    corners.swap_remove(0).1
}

#[cfg(test)]
mod tests {
    use super::minimise;

    #[test]
    fn rosenbrocks_valley_is_followed_to_its_end() {
        let valley = |x: &[f64]| 100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2);
        let found = minimise(&valley, &[-1.2, 1.0], &[0.5, 0.5], 200);
        assert!((found[0] - 1.0).abs() < 1e-4 && (found[1] - 1.0).abs() < 1e-4, "{found:?}");
    }
}
