//! The order in which curves meet end to end.

use bench_dragon_geometry::number::Place;
use glam::DVec2;

/// The order of curves in a path, and which are reversed, by the ends of each. Ends within `gap_m` of each other meet.
///
/// # Errors
/// The reason why the curves are no path, in words.
pub(super) fn order(ends: &[[DVec2; 2]], gap_m: f64) -> Result<Vec<(usize, bool)>, String> {
    let order = chain(ends, gap_m)
        .map_err(|(at, count)| format!("{count} ends meet at {}, at most 2 are allowed", place(at)))?;
    if order.len() == ends.len() {
        return Ok(order);
    }
    let Some((from, to)) = nearest_gap(ends, &order, gap_m) else {
        return Err(format!("those at {} are a closed path without the others", place(ends[0][0])));
    };
    let apart = format!("{} m apart, at most {} m is allowed", micrometres(from.distance(to)), micrometres(gap_m));
    Err(format!("the nearest ends, at {} and {}, are {apart}", place(from), place(to)))
}

/// Chains curves that meet end to end, in both directions from the first, which keeps its direction.
///
/// # Errors
/// A place where more than two ends meet, and their number.
fn chain(ends: &[[DVec2; 2]], gap_m: f64) -> Result<Vec<(usize, bool)>, (DVec2, usize)> {
    let partner = |number: usize, end: usize| {
        let at = ends[number][end];
        let all = (0..ends.len()).flat_map(|number| [(number, 0), (number, 1)]);
        let near = all.filter(|&other| other != (number, end) && ends[other.0][other.1].distance(at) <= gap_m);
        match near.collect::<Vec<_>>()[..] {
            [] => Ok(None),
            [only] => Ok(Some(only)),
            ref several => Err((at, several.len() + 1)),
        }
    };
    // The path begins at the free end behind the first curve.
    let (mut at, mut begin) = (0, 0);
    for _ in 0..ends.len() {
        let Some((number, end)) = partner(at, begin)? else { break };
        (at, begin) = (number, 1 - end);
        if at == 0 {
            break;
        }
    }
    let mut order = vec![(at, begin == 1)];
    let (first, mut end) = (at, 1 - begin);
    while let Some((number, other)) = partner(at, end)?.filter(|&(number, _)| number != first) {
        order.push((number, other == 1));
        (at, end) = (number, 1 - other);
        if order.len() > ends.len() {
            break;
        }
    }
    Ok(order)
}

/// The ends of a chain and of another curve that are nearest to each other; `None` if the chain is closed.
fn nearest_gap(ends: &[[DVec2; 2]], order: &[(usize, bool)], gap_m: f64) -> Option<(DVec2, DVec2)> {
    let free = |&(number, is_reversed): &(usize, bool), end: usize| ends[number][end ^ usize::from(is_reversed)];
    let loose = [free(order.first()?, 0), free(order.last()?, 1)];
    let mut is_other = vec![true; ends.len()];
    for &(number, _) in order {
        is_other[number] = false;
    }
    let others = ends.iter().zip(is_other).filter(|(_, is_other)| *is_other).flat_map(|(ends, _)| *ends);
    let pairs = others.flat_map(|other| loose.map(|end| (end, other)));
    let nearest = pairs.min_by(|one, other| one.0.distance(one.1).total_cmp(&other.0.distance(other.1)));
    nearest.filter(|_| loose[0].distance(loose[1]) > gap_m)
}

/// A point, for a message.
pub(super) fn place(at: DVec2) -> String {
    Place::<3>(at.to_array()).to_string()
}

/// A length in metres, in whole micrometres.
fn micrometres(length_m: f64) -> f64 {
    (length_m * 1e6).round() / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;

    fn order_of(ends: &[[[f64; 2]; 2]]) -> Result<Vec<(usize, bool)>, String> {
        let ends: Vec<[DVec2; 2]> = ends.iter().map(|ends| ends.map(DVec2::from)).collect();
        order(&ends, 0.0005)
    }

    #[test]
    fn the_first_curve_keeps_its_direction_and_the_path_begins_at_its_free_end() {
        let (first, before) = ([[1.0, 0.0], [2.0, 0.0]], [[1.0, 0.0], [0.0, 0.0]]);
        let after = [[3.0, 0.0], [2.0, 0.0004]];
        assert_eq!(order_of(&[first, after, before]), Ok(vec![(2, true), (0, false), (1, true)]));
        let triangle = [[[0.0, 0.0], [1.0, 0.0]], [[0.0, 1.0], [1.0, 0.0]], [[0.0, 1.0], [0.0, 0.0]]];
        assert_eq!(order_of(&triangle), Ok(vec![(0, false), (1, true), (2, false)]));
    }

    #[test]
    fn curves_that_do_not_join_are_refused_with_the_place() {
        let gap = [[[0.0, 0.0], [10.0, 0.0]], [[20.0, 0.0], [10.001, 0.0]]];
        let reason = "the nearest ends, at (10.000, 0.000) m and (10.001, 0.000) m, are 0.001 m apart, \
                      at most 0.0005 m is allowed";
        assert_eq!(order_of(&gap), Err(reason.to_owned()));
        let branch = [[[0.0, 0.0], [5.0, 0.0]], [[5.0, 0.0], [9.0, 0.0]], [[5.0, 3.0], [5.0, 0.0]]];
        assert_eq!(order_of(&branch), Err("3 ends meet at (5.000, 0.000) m, at most 2 are allowed".to_owned()));
        let lens = [[[0.0, 0.0], [1.0, 0.0]], [[0.0, 0.0], [1.0, 0.0]], [[5.0, 0.0], [6.0, 0.0]]];
        let reason = "those at (0.000, 0.000) m are a closed path without the others";
        assert_eq!(order_of(&lens), Err(reason.to_owned()));
    }
}
