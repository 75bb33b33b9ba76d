//! How often may doors be moved? Each move is told to everybody who sees the door, and is not dropped for the slow, so who rattles at
//! one is held up; others may still move it, until all of them together have moved it too often: tokens cost nothing.

use std::collections::BTreeMap;

use belvedere_live::{Ms, pace::Bucket};
use belvedere_scene::ObjectId;

use super::token::Token;

/// The same door so often at once, and a second: more than people do.
const ONE_DOOR: (f64, f64) = (6.0, 2.0);
/// The same door by everybody together: a few people at once.
const ONE_DOOR_BY_ALL: (f64, f64) = (24.0, 8.0);
/// All doors together: a program may close those of a house.
const ALL_DOORS: (f64, f64) = (200.0, 20.0);
/// Those who have not moved any for so long may do so as often as anybody.
const FORGOTTEN_MS: Ms = 10_000;

/// Who has moved which doors lately.
#[derive(Debug, Default)]
pub(super) struct DoorPace {
    each: BTreeMap<(Token, ObjectId), (Bucket, Ms)>,
    all: BTreeMap<Token, (Bucket, Ms)>,
    by_all: BTreeMap<ObjectId, (Bucket, Ms)>,
    forgot_ms: Ms,
}

impl DoorPace {
    /// Takes note that a token moves a door.
    ///
    /// # Errors
    /// With the time until it may, when it or all together have done so too often; then nothing is noted of that door.
    pub(super) fn take(&mut self, token: Token, door: ObjectId, now_ms: Ms) -> Result<(), Ms> {
        self.forget(now_ms);
        let new = |(many, per_s)| (Bucket::full(many, per_s, now_ms), now_ms);
        let all = self.all.entry(token).or_insert_with(|| new(ALL_DOORS));
        let mut after = *all;
        if !after.0.take(1.0, now_ms) {
            return Err(after.0.wait_ms(1.0));
        }
        let by_all = self.by_all.entry(door).or_insert_with(|| new(ONE_DOOR_BY_ALL));
        let mut after_all = *by_all;
        if !after_all.0.take(1.0, now_ms) {
            return Err(after_all.0.wait_ms(1.0));
        }
        let one = self.each.entry((token, door)).or_insert_with(|| new(ONE_DOOR));
        one.1 = now_ms;
        if !one.0.take(1.0, now_ms) {
            return Err(one.0.wait_ms(1.0));
        }
        *all = (after.0, now_ms);
        *by_all = (after_all.0, now_ms);
        Ok(())
    }

    /// Now and then, so that little is kept: no more than can be moved meanwhile.
    fn forget(&mut self, now_ms: Ms) {
        if now_ms - self.forgot_ms < FORGOTTEN_MS {
            return;
        }
        self.forgot_ms = now_ms;
        self.each.retain(|_, (_, taken_ms)| now_ms - *taken_ms < FORGOTTEN_MS);
        self.all.retain(|_, (_, taken_ms)| now_ms - *taken_ms < FORGOTTEN_MS);
        self.by_all.retain(|_, (_, taken_ms)| now_ms - *taken_ms < FORGOTTEN_MS);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn door(number: u32) -> ObjectId {
        ObjectId(number)
    }

    #[test]
    fn who_rattles_at_a_door_is_held_up_and_nobody_else() {
        let [a, b] = [Token::random().unwrap(), Token::random().unwrap()];
        let mut pace = DoorPace::default();
        // 86 times a second for ten seconds.
        let moved = (0..860)
            .filter(|i| pace.take(a, door(1), i * 1000 / 86).is_ok())
            .count();
        assert_eq!(moved, 6 + 19, "six at once and two a second");
        let wait_ms = pace.take(a, door(1), 9_990).unwrap_err();
        assert!((1..=500).contains(&wait_ms));
        assert_eq!(pace.take(a, door(1), 9_990 + wait_ms), Ok(()));
        assert_eq!(pace.take(b, door(1), 9_990), Ok(()));
        assert_eq!(pace.take(a, door(2), 9_990), Ok(()));
    }

    #[test]
    fn many_tokens_rattle_no_more_than_a_few_people() {
        let mut pace = DoorPace::default();
        // A new token each time, 100 times a second for ten seconds.
        let mut rattle = |number| {
            let taken = (0..1_000).filter(|i| pace.take(Token::random().unwrap(), door(number), i * 10).is_ok());
            taken.count()
        };
        assert_eq!(rattle(1), 24 + 79, "24 at once and eight a second");
        let mut pace = DoorPace::default();
        (0..24).for_each(|_| pace.take(Token::random().unwrap(), door(1), 0).unwrap());
        let late = Token::random().unwrap();
        assert_eq!(pace.take(late, door(1), 0), Err(125));
        assert_eq!(pace.take(late, door(2), 0), Ok(()), "others are free");
        assert_eq!(pace.take(late, door(1), 125), Ok(()));
    }

    #[test]
    fn a_program_may_close_all_doors_of_a_house_and_not_for_ever() {
        let token = Token::random().unwrap();
        let mut pace = DoorPace::default();
        let closed = (0..1_000).filter(|i| pace.take(token, door(*i), 0).is_ok()).count();
        assert_eq!(closed, 200);
        let closed = (0..1_000).filter(|i| pace.take(token, door(*i), 1_000).is_ok()).count();
        assert_eq!(closed, 20);
    }

    #[test]
    fn a_door_that_waited_for_others_has_moved_no_more_often_for_that() {
        let token = Token::random().unwrap();
        let mut pace = DoorPace::default();
        (0..200).for_each(|i| pace.take(token, door(i), 0).unwrap());
        for _ in 0..100 {
            assert!(pace.take(token, door(200), 0).unwrap_err() <= 50);
        }
        assert_eq!(pace.each.len(), 200);
        let moved = (0..10).filter(|_| pace.take(token, door(200), 5_000).is_ok()).count();
        assert_eq!(moved, 6);
    }

    #[test]
    fn little_is_kept_of_who_moves_no_doors_any_more() {
        let mut pace = DoorPace::default();
        for i in 0..100 {
            let token = Token::random().unwrap();
            assert_eq!(pace.take(token, door(i), Ms::from(i) * FORGOTTEN_MS), Ok(()));
            assert!(pace.each.len() <= 2 && pace.all.len() <= 2 && pace.by_all.len() <= 2);
        }
    }
}
