//! How does somebody walk who just looks around? From cell to cell through openings at random, never straight back unless
//! there is no other way; to and fro in a cell without openings.

use belvedere_scene::CellId;

use super::{MOST_PLACES, random, rooms::Rooms};
use crate::{ByteSource, Error, tour::script::distance_m};

/// The places of a way that is at least so long, if it can be: openings, and the middles of cells between them.
pub(super) async fn places<S: ByteSource>(
    rooms: &mut Rooms<'_, S>,
    start: [f64; 3],
    long_m: f64,
    seed: u64,
) -> Result<Vec<[f64; 3]>, Error> {
    let mut here = rooms.at(start).await?;
    let mut places = vec![start];
    let mut before: Option<CellId> = None;
    let (mut walked_m, mut state) = (0.0, seed);
    while walked_m < long_m && places.len() < MOST_PLACES {
        let onwards = here.openings.iter().filter(|way| Some(way.to) != before);
        let mut ways: Vec<_> = onwards.collect();
        if ways.is_empty() {
            ways = here.openings.iter().collect();
        }
        if ways.is_empty() {
            let place = here.somewhere(&mut state);
            let step_m = distance_m(places[places.len() - 1], place);
            if step_m == 0.0 {
                break;
            }
            walked_m += step_m;
            places.push(place);
            continue;
        }
        let way = ways[(random(&mut state) % ways.len() as u64) as usize];
        let next = rooms.room(way.to).await?;
        for place in [way.place, next.middle] {
            walked_m += distance_m(places[places.len() - 1], place);
            places.push(place);
        }
        before = Some(here.entry.cell);
        here = next;
    }
    Ok(places)
}
