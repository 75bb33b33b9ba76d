//! Where tests of the audit have people look at each other: a hall of 20 m with nothing in it.

use belvedere_live::{
    Ms,
    aoi::Aoi,
    cells::Cell,
    event::SessionId,
    journal::{Ground, Input},
    world::{Look, Rules, Sent, Visitor},
};
use belvedere_scene::{Bounds, ObjectId, Revision, foliage::Foliage};
use belvedere_verify::{between::Between, blockade::Blockade, scene::Scene};

use super::{account::Account, judge::Judge, sights::Sights};

/// The avatar of the first session; those of others follow.
pub(super) const FIRST: u32 = 100_000_000;

pub(super) struct Hall {
    pub(super) account: Account,
    pub(super) judge: Judge,
    pub(super) now_ms: Ms,
    sights: Sights,
}

/// What somebody says who stands there.
pub(super) fn sent(x: f64) -> Sent {
    Sent {
        t_ms: None,
        position: [x, 1.0, 1.0],
        orientation: [0.0, 0.0, 0.0, 1.0],
        velocity: None,
        acceleration: None,
    }
}

impl Hall {
    pub(super) fn empty() -> Self {
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
        Self {
            account: Account::begin(Rules::default(), &ground),
            judge: Judge::default(),
            now_ms: 0,
            sights: Sights::new(Between::new(nothing, vec![], 0.0), 0),
        }
    }

    /// Somebody comes to stand at `x`, and looks so far.
    pub(super) fn enter(&mut self, session: SessionId, x: f64, aoi_m: f64, hears_movers: bool) {
        let visitor = Visitor {
            pose: sent(x),
            aoi: Aoi {
                enter_m: aoi_m,
                leave_m: aoi_m + 2.0,
            },
            max_speed_mps: 1.0,
            max_acceleration_mps2: None,
            radius_m: 0.3,
            look: Look::default(),
            hears_movers,
            listens: true,
        };
        let object = ObjectId(FIRST + session.0 as u32);
        self.hear(&Input::Open {
            session,
            object,
            visitor,
        });
    }

    pub(super) fn hear(&mut self, input: &Input) {
        self.account.hear(input, self.now_ms);
    }

    /// So many ticks pass, and each is judged.
    pub(super) fn ticks(&mut self, count: usize) {
        for _ in 0..count {
            self.now_ms += 100;
            self.judge.look(&mut self.account, &mut self.sights, self.now_ms, 1);
        }
    }
}
