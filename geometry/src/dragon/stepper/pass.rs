//! One pass over the chain, from the head to the tail.

use glam::DVec3;

use super::Curve;
use super::lanes::{HANDLES, LANES, ROWS};
use super::scratch::{Ahead, Links, Scratch};
use super::section::{Section, Step};
use crate::dragon::chain::{Chain, Handle};
use crate::dragon::dimensions::Dimensions;
use crate::dragon::meter::UNLIMITED;

/// How a pass reaches its pose from the last one.
#[derive(Clone, Copy, Debug)]
pub(super) enum Way {
    /// The pose is the last one.
    Stand,
    /// The head has made a short step.
    Walk(Step),
    /// The last pose is unknown or of no use.
    Afresh,
}

/// The input and output of one pass.
#[derive(Debug)]
pub(super) struct Pass<'a, H, R> {
    pub(super) curve: Curve<'a>,
    /// The dragon's dimensions, with as many benches as fill whole sections.
    pub(super) dimensions: &'a Dimensions,
    /// The links of the first section, and those of every other section.
    pub(super) links: &'a [Links; 2],
    pub(super) sections: &'a mut [Section],
    pub(super) scratch: &'a mut Scratch,
    pub(super) way: Way,
    pub(super) head: Ahead,
    pub(super) speed_mps: f64,
    pub(super) records: &'a mut [H],
    /// Creates a record from a position in metres and a velocity in metres per second.
    pub(super) record: R,
}

impl<H, R: Fn(DVec3, DVec3) -> H> Pass<'_, H, R> {
    /// Moves every section and writes every record. It is compiled once for each set of instructions. So it is always inlined,
    /// with all that it calls except rare cases.
    #[inline(always)]
    pub(super) fn run<const FUSED: bool, const ON_GROUND: bool>(self) {
        let Self { curve, dimensions, links, sections, scratch, way, head, speed_mps, records, record } = self;
        let (head_record, records) = records.split_first_mut().expect("a dragon has a head");
        *head_record = record(head.position_m.into(), DVec3::from(head.tangent_m) * (head.rate * speed_mps));
        let mut ahead = head;
        for (number, (section, records)) in sections.iter_mut().zip(records.chunks_mut(HANDLES)).enumerate() {
            let has_advanced = match way {
                Way::Walk(step) if section.is_placed() => {
                    section.advance::<FUSED, ON_GROUND>(scratch, curve, &links[number.min(1)], &ahead, step)
                }
                _ => false,
            };
            if !has_advanced {
                let is_placed = matches!(way, Way::Stand) && section.is_placed();
                if !(is_placed && section.stand::<FUSED, ON_GROUND>(scratch, curve)) {
                    place(section, scratch, curve, dimensions, number * HANDLES, &ahead);
                    // The first pose uses the same arithmetic as all others, so that a standing dragon does not move by rounding.
                    // On a segment without pieces, the pose of the reference solver stays.
                    if section.is_placed() {
                        section.stand::<FUSED, ON_GROUND>(scratch, curve);
                    }
                }
            }
            write::<H, ON_GROUND>(section, scratch, speed_mps, records, &record);
            ahead = section.last::<ON_GROUND>(scratch);
        }
    }
}

/// Solves each handle of a section behind the handle of this index by the reference solver.
#[cold]
#[inline(never)]
fn place(
    section: &mut Section,
    scratch: &mut Scratch,
    curve: Curve<'_>,
    dimensions: &Dimensions,
    index: usize,
    ahead: &Ahead,
) {
    let point = curve.route.point(ahead.parameter);
    let handle = Handle::new(ahead.parameter, point, ahead.rate * point.speed_m_per_unit);
    let chain = Chain::behind(curve.route, dimensions, &UNLIMITED, index, &handle);
    section.place(scratch, chain.map(|handle| (handle, curve.route.point(handle.parameter).speed_m_per_unit)));
}

/// Writes the records of a section's handles. The last section may have fewer records than handles.
#[inline(always)]
fn write<H, const ON_GROUND: bool>(
    section: &Section,
    scratch: &mut Scratch,
    speed_mps: f64,
    records: &mut [H],
    make: &impl Fn(DVec3, DVec3) -> H,
) {
    section.set_velocities::<ON_GROUND>(scratch, speed_mps);
    for (lane, records) in (0..LANES).zip(records.chunks_mut(ROWS)) {
        for (row, record) in (0..ROWS).zip(records) {
            let (position_m, velocity_mps) = scratch.moving::<ON_GROUND>(row * LANES + lane);
            *record = make(position_m.into(), velocity_mps.into());
        }
    }
}
