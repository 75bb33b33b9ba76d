//! What can be published of visible sets before anybody has looked? What the cheapest proofs leave: larger sets, found many
//! times faster.

use belvedere_scene::record::Guarantee;
use rayon::prelude::*;

use super::{
    CellVisibility, Method, SeenObject, UNSEEN_FRACTION, Views, Visibility, conservative::Observer, join_both_ends,
};
use crate::progress::{Cancelled, Progress, Stage};

/// What a first revision is published as, whichever method is wanted.
const METHOD: Method = Method::Conservative;

/// Objects and cells that the cheapest proofs cannot hide from each cell, both rising.
pub type Rough = Vec<(Vec<u32>, Vec<u32>)>;

/// Finds them for all cells.
///
/// # Errors
/// When cancelled.
pub fn rough(views: &Views<'_>, progress: &dyn Progress) -> Result<Rough, Cancelled> {
    let count = views.graph.cells.len();
    progress.start(Stage::Preview, count as u64);
    let scenery = views.atlas.with_cells();
    let glimpse = |observer: &mut Observer<'_>, cell: usize| {
        if progress.cancelled() {
            return Err(Cancelled);
        }
        let found = views.atlas.not_hidden(cell, observer);
        progress.advance(1);
        Ok(found)
    };
    let observer = || Observer::new(&scenery, METHOD.proofs().rough());
    (0..count).into_par_iter().map_init(observer, glimpse).collect()
}

/// Such sets as they are published first, in order of the solid angles of boxes. They say nothing of doors: who closes one is shown
/// what it hides.
#[must_use]
pub fn preview(views: &Views<'_>, rough: &Rough) -> Visibility {
    let of_cell = |(cell, (objects, cells)): (usize, &(Vec<u32>, Vec<u32>))| {
        let seen = |object: &u32| SeenObject {
            object: *object,
            fraction: UNSEEN_FRACTION,
            solid_angle: views.atlas.box_sr(cell, *object),
            doors: Vec::new(),
        };
        let mut objects: Vec<_> = objects.iter().map(seen).collect();
        objects.sort_by(SeenObject::order);
        let others = cells.iter().copied().filter(|other| *other as usize != cell);
        CellVisibility {
            objects,
            cells: others.collect(),
            ..CellVisibility::default()
        }
    };
    let mut cells: Vec<_> = rough.par_iter().enumerate().map(of_cell).collect();
    join_both_ends(views.graph, &mut cells);
    let total: usize = cells.iter().map(|cell| cell.objects.len()).sum();
    Visibility {
        mean_not_hidden: total as f64 / cells.len().max(1) as f64,
        cells,
        method: METHOD,
        guarantee: Guarantee::Conservative,
        mean_seen: 0.0,
        reason: "a first look; smaller sets follow".to_owned(),
        remembered: 0,
    }
}
