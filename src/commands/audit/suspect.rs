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
        event::SessionId,
        journal::Input,
        world::{Look, NewMover, ROOM},
    };
    use belvedere_scene::ObjectId;
    use serde_json::json;

    use super::super::hall::{FIRST, Hall, sent};

    const A: SessionId = SessionId(0);

    /// Somebody looks at a mover.
    fn watched() -> Hall {
        let mut hall = Hall::empty();
        hall.enter(A, 1.0, 20.0, true);
        hall.create(1);
        hall
    }

    impl Hall {
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

        fn make_room(&mut self) {
            self.hear(&Input::Room { session: A });
        }
    }

    #[test]
    fn who_is_not_told_of_is_missed_in_time_and_who_waits_for_its_stream_is_counted_apart() {
        let mut hall = watched();
        hall.ticks(30);
        assert!(!hall.judge.misses.is_empty());
        assert_eq!(hall.judge.waiting, 0);
        let mut full = watched();
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
        let mut hall = watched();
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
