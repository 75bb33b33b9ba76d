//! For how long has a session not been told of what is in plain view, though it might have been? Not while it waits for its stream to
//! take what it was told before; when that has, the time goes on, so that nobody is put off for ever.

use belvedere_live::Ms;

/// What a session ought to have been told of.
#[derive(Debug, Clone, Copy)]
pub(super) struct Suspect {
    /// When it was looked at last.
    looked_ms: Ms,
    /// For so long there was room, and nothing was said.
    pub(super) untold_ms: Ms,
}

impl Suspect {
    pub(super) fn new(now_ms: Ms) -> Self {
        Self {
            looked_ms: now_ms,
            untold_ms: 0,
        }
    }

    /// It is still there.
    pub(super) fn at(self, now_ms: Ms, room: bool) -> Self {
        let since_ms = if room { now_ms - self.looked_ms } else { 0 };
        Self {
            looked_ms: now_ms,
            untold_ms: self.untold_ms + since_ms,
        }
    }
}

#[cfg(test)]
mod tests {
    use belvedere_live::{
        aoi::Aoi,
        cells::Cell,
        event::SessionId,
        journal::{Ground, Input},
        world::{Look, NewMover, ROOM, Rules, Sent, Visitor},
    };
    use belvedere_scene::{Bounds, ObjectId, Revision, foliage::Foliage};
    use belvedere_verify::{between::Between, blockade::Blockade, scene::Scene};
    use serde_json::json;

    use super::super::{account::Account, judge::Judge, sights::Sights};
    use super::*;

    const A: SessionId = SessionId(0);
    const FIRST: u32 = 100_000_000;

    fn sent(x: f64) -> Sent {
        Sent {
            t_ms: None,
            position: [x, 1.0, 1.0],
            orientation: [0.0, 0.0, 0.0, 1.0],
            velocity: None,
            acceleration: None,
        }
    }

    /// A hall with nothing in it, and somebody who looks at a mover.
    struct Hall {
        account: Account,
        sights: Sights,
        judge: Judge,
        now_ms: Ms,
    }

    impl Hall {
        fn new() -> Self {
            let bounds = Bounds {
                min: [0.0; 3],
                max: [20.0, 3.0, 3.0],
            };
            let ground = Ground {
                revision: Revision([0; 8]),
                bounds,
                cells: vec![Cell { bounds, planes: vec![] }],
                foliage: Foliage::default(),
            };
            let nothing = Blockade::of(&Scene::new(vec![], vec![]));
            let mut hall = Self {
                account: Account::begin(Rules::default(), &ground),
                sights: Sights::new(Between::new(nothing, vec![], 0.0), 0),
                judge: Judge::default(),
                now_ms: 0,
            };
            let visitor = Visitor {
                pose: sent(1.0),
                aoi: Aoi {
                    enter_m: 20.0,
                    leave_m: 22.0,
                },
                max_speed_mps: 1.0,
                max_acceleration_mps2: None,
                radius_m: 0.3,
                look: Look::default(),
                hears_movers: true,
                listens: true,
            };
            let (session, object) = (A, ObjectId(FIRST));
            hall.hear(&Input::Open {
                session,
                object,
                visitor,
            });
            hall.create(1);
            hall
        }

        fn hear(&mut self, input: &Input) {
            self.account.hear(input, self.now_ms);
        }

        fn create(&mut self, number: u32) -> ObjectId {
            let object = ObjectId(FIRST + number);
            let new = NewMover {
                pose: sent(5.0),
                max_speed_mps: 1.0,
                max_acceleration_mps2: None,
                radius_m: 0.3,
                look: Look::default(),
                way: None,
            };
            let owner = None;
            self.hear(&Input::Create { object, owner, new });
            object
        }

        /// The session is told of as many others as there is room for, which are gone then.
        fn fill(&mut self) {
            for number in 10..10 + ROOM as u32 {
                let object = self.create(number);
                self.account
                    .tell(&json!(["s0", "object-info", {"object": object}]), self.now_ms);
                self.hear(&Input::Destroy { object });
            }
        }

        fn ticks(&mut self, count: usize) {
            for _ in 0..count {
                self.now_ms += 100;
                self.judge.look(&mut self.account, &mut self.sights, self.now_ms, 1);
            }
        }

        fn make_room(&mut self) {
            self.hear(&Input::Room { session: A });
        }
    }

    #[test]
    fn who_is_not_told_of_is_missed_in_time_and_who_waits_for_its_stream_is_counted_apart() {
        let mut hall = Hall::new();
        hall.ticks(30);
        assert!(!hall.judge.misses.is_empty());
        assert_eq!(hall.judge.waiting, 0);
        let mut full = Hall::new();
        full.fill();
        full.ticks(30);
        assert_eq!((full.judge.misses.len(), full.judge.waiting), (0, 30));
        full.make_room();
        full.ticks(30);
        assert!(!full.judge.misses.is_empty(), "there is room, and nothing is said");
        assert_eq!(full.judge.waiting, 30);
    }

    #[test]
    fn who_is_always_put_off_is_missed_in_the_end() {
        let mut hall = Hall::new();
        for _ in 0..50 {
            // Others are told of, but in every third tick.
            hall.fill();
            hall.ticks(2);
            hall.make_room();
            hall.ticks(1);
        }
        assert!(!hall.judge.misses.is_empty());
        assert!(hall.judge.waiting >= 90, "{}", hall.judge.waiting);
    }
}
