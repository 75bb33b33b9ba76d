//! How do movers move, one or many? Each where it has its home. One that stays, and has its home on another node, gets it on the
//! node where its token is shown.

use std::collections::BTreeSet;

use belvedere_live::world::{Moved, NewMover, Refusal, Sent};
use belvedere_scene::{ObjectId, SceneName};

use super::{
    Live, LiveError, Token, ask, keeping,
    message::{Message, StageHandle},
};

/// So many movers of a batch are looked for on other nodes: whoever knows no mover makes little work.
const MOST_LOOKED_FOR: usize = 2_000;

impl Live {
    /// Moves a mover, for whoever has its token.
    ///
    /// # Errors
    /// When there is none, the token is not its own, or the rules refuse it.
    pub async fn move_to(&self, object: ObjectId, token: Option<Token>, sent: Sent) -> Result<Moved, LiveError> {
        let moved = self.try_move(object, token, sent).await;
        // It may have gone to another node between two steps, and comes back from there.
        let gone = self.0.sources.nodes.is_some() && matches!(moved, Err(LiveError::Refused(Refusal::NoMover)));
        if gone {
            self.try_move(object, token, sent).await
        } else {
            moved
        }
    }

    async fn try_move(&self, object: ObjectId, token: Option<Token>, sent: Sent) -> Result<Moved, LiveError> {
        let stage = self.mover(object, token).await?;
        let moves = vec![(object, sent)];
        let mut moved = ask(&stage, |reply| Message::Move { moves, reply }).await?;
        moved.pop().unwrap_or(Err(LiveError::Stopped))
    }

    /// Moves many movers of one scene. The answers are in the order of the moves.
    ///
    /// # Errors
    /// When the scene's task does not answer; else each move has its own.
    pub async fn move_all(
        &self,
        scene: &SceneName,
        moves: Vec<(ObjectId, Option<Token>, Sent)>,
    ) -> Result<Vec<Result<Moved, LiveError>>, LiveError> {
        let stage = self.stage(scene);
        let who = moves.iter().map(|(object, token, _)| (*object, *token));
        let homes = self.movers(&who.collect::<Vec<_>>()).await;
        let mut answers = Vec::with_capacity(moves.len());
        let mut admitted = Vec::with_capacity(moves.len());
        for ((object, _, sent), home) in moves.into_iter().zip(homes) {
            let here = home.and_then(|theirs| {
                let ours = theirs.is(&stage);
                ours.then_some(())
                    .ok_or_else(|| LiveError::NotFound(format!("mover {object} in scene `{scene}`")))
            });
            if here.is_ok() {
                admitted.push((object, sent));
            }
            answers.push(here);
        }
        let mut moved = ask(&stage, |reply| Message::Move { moves: admitted, reply })
            .await?
            .into_iter();
        let answer =
            |admitted: Result<(), LiveError>| admitted.and_then(|()| moved.next().unwrap_or(Err(LiveError::Stopped)));
        Ok(answers.into_iter().map(answer).collect())
    }

    /// The scene of a mover, for whoever has its token.
    pub(super) async fn mover(&self, object: ObjectId, token: Option<Token>) -> Result<StageHandle, LiveError> {
        let mut homes = self.movers(&[(object, token)]).await;
        homes.pop().unwrap_or(Err(LiveError::Stopped))
    }

    /// The scenes of movers, each for whoever has its token.
    async fn movers(&self, who: &[(ObjectId, Option<Token>)]) -> Vec<Result<StageHandle, LiveError>> {
        let registry = &self.0.registry;
        let mut homes: Vec<_> = who
            .iter()
            .map(|(object, token)| registry.mover(*object, *token))
            .collect();
        if self.0.sources.nodes.is_none() {
            return homes;
        }
        // Whoever shows no token has no mover elsewhere either.
        let may_be_elsewhere =
            |token: Option<Token>, home: &_| token.is_some() && matches!(home, Err(LiveError::NotFound(_)));
        let absent = who.iter().zip(&homes);
        let absent = absent.filter_map(|((object, token), home)| may_be_elsewhere(*token, home).then_some(*object));
        let mut absent: Vec<_> = absent.collect::<BTreeSet<_>>().into_iter().collect();
        let too_many = absent.split_off(absent.len().min(MOST_LOOKED_FOR));
        if absent.is_empty() {
            return homes;
        }
        let kept = keeping::movers_anywhere(&self.0.sources.catalogue, &absent).await;
        for ((object, token), home) in who.iter().zip(&mut homes) {
            if !may_be_elsewhere(*token, home) {
                continue;
            }
            match &kept {
                Err(error) => *home = Err(LiveError::Unkept(anyhow::anyhow!("{error:#}"))),
                Ok(_) if too_many.binary_search(object).is_ok() => {
                    let said =
                        anyhow::anyhow!("{MOST_LOOKED_FOR} movers of a batch are looked for on other nodes at most");
                    *home = Err(LiveError::Unkept(said));
                }
                Ok(kept) => {
                    if let Some((scene, own, new)) = kept.get(object) {
                        *home = match own.admit(*token, || format!("mover {object}")) {
                            Ok(()) => self.bring(*object, (scene, *own), new).await,
                            Err(refused) => Err(refused),
                        };
                    }
                }
            }
        }
        homes
    }

    /// Gives a mover its home here.
    async fn bring(
        &self,
        object: ObjectId,
        (scene, own): (&SceneName, Token),
        new: &NewMover,
    ) -> Result<StageHandle, LiveError> {
        // An earlier line of the same batch may have brought it.
        if let Ok(stage) = self.0.registry.mover(object, Some(own)) {
            return Ok(stage);
        }
        let (stage, new) = (self.stage(scene), new.clone());
        ask(&stage, |reply| Message::TakeOver { object, new, reply }).await??;
        self.0.registry.restore_mover(&stage, object, own);
        self.0.registry.mover(object, Some(own))
    }
}
