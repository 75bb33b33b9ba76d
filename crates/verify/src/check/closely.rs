//! Is anything of what seems to be missing surely seen?
//!
//! Of most of what an eye claims a few pixels are tried. What is mostly doubtful, since it lies on something else, may be sure in few
//! places; so what no eye has confirmed is looked at once more.

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BTreeSet},
};

use rayon::prelude::*;

use super::{Claim, Situation, View, claims, drawn};
use crate::{cube::Cube, scene::Scene};

/// At most so many views are looked at once more, those that claim most.
const VIEWS: usize = 256;
/// At most so many pixels of one object are tried, evenly chosen.
const MOST_PIXELS: usize = 16_384;

/// Tries the pixels of what no eye has confirmed in a cell, from the eye that sees most of it.
pub(super) fn look_closely(scene: &Scene, situations: &[Situation<'_>], views: &mut [View], size_px: usize) {
    let mut doubtful: BTreeMap<(usize, u32), Option<(u64, usize)>> = BTreeMap::new();
    for (number, view) in views.iter().enumerate() {
        for claim in &view.claims {
            let best = doubtful
                .entry((view.situation, claim.object))
                .or_insert(Some((0, number)));
            *best = match *best {
                _ if claim.confirmed > 0 => None,
                Some((pixels, _)) if claim.pixels > pixels => Some((claim.pixels, number)),
                known => known,
            };
        }
    }
    let mut by_view: BTreeMap<usize, (u64, BTreeSet<u32>)> = BTreeMap::new();
    for ((_, object), best) in doubtful {
        if let Some((pixels, number)) = best {
            let (most, objects) = by_view.entry(number).or_default();
            *most = pixels.max(*most);
            objects.insert(object);
        }
    }
    let mut chosen: Vec<_> = by_view.into_iter().collect();
    chosen.sort_by_key(|(number, (pixels, _))| (Reverse(*pixels), *number));
    chosen.truncate(VIEWS);
    let again = |cube: &mut Cube, number: usize, objects: &BTreeSet<u32>| {
        let view = &views[number];
        let situation = &situations[view.situation];
        let scene = &scene.with_closed(&situation.closed);
        drawn(scene, situation, view.eye, cube);
        let asked = |object| objects.contains(&object);
        claims(scene, view.eye.position, cube, asked, |_| MOST_PIXELS)
    };
    let found: Vec<(usize, Vec<Claim>)> = chosen
        .par_iter()
        .map_init(
            || Cube::new(size_px),
            |cube, (number, (_, objects))| (*number, again(cube, *number, objects)),
        )
        .collect();
    for (number, claims) in found {
        for claim in claims {
            let mut known = views[number].claims.iter_mut();
            if let Some(known) = known.find(|known| known.object == claim.object) {
                *known = claim;
            }
        }
    }
}
