//! What lies ahead, and when it is due.

use super::*;

#[test]
fn what_is_due_comes_before_what_is_finer_and_what_is_far_off_comes_last_or_not_at_all() {
    let (here, next, later, never) = ([seen(1, 1.0)], [seen(2, 9.0)], [seen(3, 9.0)], [seen(4, 9.0)]);
    let ahead = vec![
        (approach(2, 1, 2.0), &next[..]),
        (approach(3, 2, 20.0), &later[..]),
        (approach(4, 3, 60.0), &never[..]),
    ];
    let view = view(&here, ahead);
    let models = |rate: f64| {
        let orders = fetch_all(&mut within(u64::MAX), &view, rate);
        orders.iter().map(|order| order.wish.model.0).collect::<Vec<_>>()
    };
    assert_eq!(models(1e9), [1, 2, 1, 3]);
    // On a slow line, what lies further ahead is due as well.
    assert_eq!(models(200.0), [1, 2, 3, 1]);
    assert_eq!(models(10.0), [1, 2, 3, 4, 1]);
}

struct Corridor;

const UNKNOWN: &str = "record";

impl Corridor {
    fn entries() -> Vec<CellEntry> {
        let entry = |cell: u32| CellEntry {
            cell: CellId(cell),
            bounds: Bounds {
                min: [f64::from(cell) * 4.0, 0.0, 0.0],
                max: [f64::from(cell) * 4.0 + 4.0, 3.0, 4.0],
            },
            planes: Vec::new(),
            adjacent: [cell.checked_sub(1), Some(cell + 1).filter(|next| *next < 5)]
                .into_iter()
                .flatten()
                .map(CellId)
                .collect(),
            record: name(UNKNOWN, "cell"),
            record_bytes: 1,
            steps: None,
            steps_bytes: None,
            record_json: name(UNKNOWN, "json"),
        };
        (0..5).map(entry).collect()
    }
}

struct World(Vec<CellEntry>);

impl Cells for World {
    fn entry(&self, cell: CellId) -> Option<&CellEntry> {
        self.0.get(cell.index())
    }

    fn portals(&self, _: CellId) -> &[Portal] {
        &[]
    }
}

#[test]
fn cells_ahead_come_in_three_steps_with_the_time_that_they_take() {
    let world = World(Corridor::entries());
    let mut motion = Motion::default();
    for tick in 0..30 {
        motion.observe(f64::from(tick) * 0.1, [7.0 + f64::from(tick) * 0.1, 1.5, 2.0]);
    }
    let found = approaches(CellId(2), &world, [10.0, 1.5, 2.0], motion.velocity_mps());
    let told: Vec<_> = found.iter().map(|one| (one.cell.0, one.step)).collect();
    assert_eq!(told, [(3, 1), (1, 2), (4, 3)]);
    let in_s = |at: usize| found[at].in_s;
    assert!(
        (in_s(0) - 2.0).abs() < 0.1 && (in_s(1) - 3.0).abs() < 0.1 && in_s(2) > in_s(0),
        "{found:?}"
    );
    // Who stands may go either way.
    let standing = approaches(CellId(2), &world, [10.0, 1.5, 2.0], [0.0; 3]);
    assert!(
        standing.iter().all(|one| one.step == 2) && standing.len() == 2,
        "{standing:?}"
    );
}
