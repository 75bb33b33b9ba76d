//! How are questions that many ask at once put to the catalogue? Together: whoever comes while an answer is awaited waits too, and the
//! first of those who waited asks for all of them. So the fewer connections and transactions there are, the more of them are in each.

use std::{mem, sync::Mutex};

use anyhow::anyhow;
use tokio::sync::oneshot::{self, error::TryRecvError};

use super::LiveError;

/// So many are asked together.
const TOGETHER: usize = 500;

/// Questions of a kind, and who waits for which answer.
#[derive(Debug)]
pub(super) struct Together<Q, A> {
    waiting: Mutex<Vec<Waiting<Q, A>>>,
    turn: tokio::sync::Mutex<()>,
}

type Waiting<Q, A> = (Q, oneshot::Sender<Result<A, String>>);

impl<Q, A> Default for Together<Q, A> {
    fn default() -> Self {
        Self {
            waiting: Mutex::default(),
            turn: tokio::sync::Mutex::default(),
        }
    }
}

impl<Q, A> Together<Q, A> {
    /// The answer to a question. `all` answers many, each in the place of its question; when it fails, it has failed for all of them.
    /// Whoever is dropped while it asks leaves the others it asked for without an answer.
    pub(super) async fn ask<F>(&self, question: Q, all: impl Fn(Vec<Q>) -> F) -> Result<A, LiveError>
    where
        F: Future<Output = Result<Vec<A>, LiveError>>,
    {
        let (reply, mut answer) = oneshot::channel();
        self.waiting().push((question, reply));
        let _turn = self.turn.lock().await;
        loop {
            match answer.try_recv() {
                Ok(told) => return told.map_err(|cause| LiveError::Unkept(anyhow!(cause))),
                Err(TryRecvError::Closed) => return Err(LiveError::Stopped),
                Err(TryRecvError::Empty) => {}
            }
            let (questions, replies): (Vec<_>, Vec<_>) = self.next().into_iter().unzip();
            let answers: Vec<Result<A, String>> = match all(questions).await {
                Ok(answers) => answers.into_iter().map(Ok).collect(),
                Err(LiveError::Unkept(cause)) => replies.iter().map(|_| Err(format!("{cause:#}"))).collect(),
                Err(cause) => replies.iter().map(|_| Err(cause.to_string())).collect(),
            };
            for (reply, answer) in replies.into_iter().zip(answers) {
                // Whoever has gone needs none.
                _ = reply.send(answer);
            }
        }
    }

    fn waiting(&self) -> std::sync::MutexGuard<'_, Vec<Waiting<Q, A>>> {
        self.waiting.lock().expect("nobody panics while holding this lock")
    }

    /// Who has waited longest.
    fn next(&self) -> Vec<Waiting<Q, A>> {
        let mut waiting = self.waiting();
        let many = waiting.len().min(TOGETHER);
        let later = waiting.split_off(many);
        mem::replace(&mut waiting, later)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[tokio::test]
    async fn who_comes_while_others_are_answered_is_answered_with_all_who_came() {
        let (together, rounds) = (Together::default(), AtomicUsize::new(0));
        let ask = |question: usize| {
            together.ask(question, |questions: Vec<usize>| async {
                rounds.fetch_add(1, Ordering::Relaxed);
                tokio::task::yield_now().await;
                Ok(questions.into_iter().map(|question| 2 * question).collect())
            })
        };
        let answers = futures_util::future::join_all((0..1200).map(ask)).await;
        let told: Vec<_> = answers.into_iter().map(Result::unwrap).collect();
        assert_eq!(told, (0..1200).map(|question| 2 * question).collect::<Vec<_>>());
        // The first alone, and those who came meanwhile by 500.
        assert_eq!(rounds.load(Ordering::Relaxed), 4);
    }

    #[tokio::test]
    async fn a_failure_is_told_to_all_and_the_next_ask_again() {
        let (together, rounds) = (Together::<usize, usize>::default(), AtomicUsize::new(0));
        let ask = |question| {
            together.ask(question, |questions| {
                let round = rounds.fetch_add(1, Ordering::Relaxed);
                async move {
                    tokio::task::yield_now().await;
                    // Of the first, who asks alone, and of those who came meanwhile.
                    match round {
                        0 | 1 => Err(LiveError::Unkept(anyhow!("it is away"))),
                        _ => Ok(questions),
                    }
                }
            })
        };
        let answers = futures_util::future::join_all((0..20).map(ask)).await;
        assert!(
            answers
                .iter()
                .all(|answer| matches!(answer, Err(error) if error.to_string().contains("it is away")))
        );
        assert_eq!(rounds.load(Ordering::Relaxed), 2);
        assert_eq!(ask(7).await.unwrap(), 7);
    }
}
