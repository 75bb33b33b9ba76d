//! Which sessions may outlive the server that holds them, and where is each at home? A home is a run of a server; whoever takes a
//! session up puts its own name in place of the last one, and of several who try at once only one does.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::SceneName;
use sqlx::{
    Row,
    any::{AnyArguments, AnyRow},
    query::Query,
};

use super::{Catalogue, change::returned};
use crate::secret::Secret;

/// A session as it is kept. What it wants and where it stands, the catalogue need not understand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeptSession {
    /// Its number.
    pub session: u64,
    /// Its scene.
    pub scene: SceneName,
    /// JSON: what it was opened with.
    pub visitor: String,
    /// Whether it hears of objects that do not move.
    pub statics: bool,
}

/// A session with what has become of it since it was opened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HousedSession {
    /// As it was opened.
    pub kept: KeptSession,
    /// Who said last that it holds it.
    pub home: String,
    /// JSON: where it stood last, if that was kept.
    pub stand: Option<String>,
    /// The beats of that home when it was asked.
    pub beats: i64,
}

/// A session that is to have another home.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Taking {
    /// Its number.
    pub session: u64,
    /// Its home that is gone …
    pub from: String,
    /// … of which nothing was heard since so many beats.
    pub beats: i64,
}

impl Taking {
    fn home(&self) -> (&str, i64) {
        (&self.from, self.beats)
    }
}

/// A run of a server.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SessionHome {
    /// Its name.
    pub home: String,
    /// Rises while it runs.
    pub beats: i64,
    /// It has said that it ends.
    pub ended: bool,
}

/// How it stands with a home that was just heard of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Beat {
    /// How often it was heard of by now. No more often than before: it was forgotten meanwhile, with the lines of its sessions.
    pub beats: i64,
    /// How many sessions others have taken from it.
    pub robbed: i64,
}

/// What is to be kept of the sessions of one home.
#[derive(Debug, Clone, Default)]
pub struct SessionChanges {
    /// New ones.
    pub opened: Vec<KeptSession>,
    /// JSON: where some stand.
    pub stands: Vec<(u64, String)>,
    /// Those that have ended.
    pub ended: Vec<u64>,
}

impl Catalogue {
    /// What tokens of sessions are signed with: the secret that was kept first, this one if there is none.
    pub async fn session_secret(&self, fresh: &Secret) -> anyhow::Result<Secret> {
        const KEPT: &str = "SELECT secret FROM session_key";
        let row = match sqlx::query(KEPT).fetch_optional(&self.pool).await? {
            Some(row) => row,
            None => {
                sqlx::query("INSERT INTO session_key (one, secret) VALUES (1, $1) ON CONFLICT (one) DO NOTHING")
                    .bind(fresh.reveal())
                    .execute(&self.pool)
                    .await?;
                // Another server may have been faster.
                sqlx::query(KEPT).fetch_one(&self.pool).await?
            }
        };
        Ok(row.try_get::<&str, _>("secret")?.into())
    }

    /// Keeps what has changed, all of it or nothing. The same may be kept again. A home that gets sessions is heard of: whoever finds
    /// their lines finds no number that has stood still for long.
    pub async fn keep_sessions(&self, home: &str, changes: &SessionChanges) -> anyhow::Result<()> {
        let mut tx = self.transaction().await?;
        if !changes.opened.is_empty() {
            hear_of(home).execute(&mut *tx).await?;
        }
        for new in &changes.opened {
            sqlx::query(
                "INSERT INTO sessions (session, scene, home, visitor, statics) VALUES ($1, $2, $3, $4, $5) \
                 ON CONFLICT (session) DO NOTHING",
            )
            .bind(i64::try_from(new.session)?)
            .bind(new.scene.as_str())
            .bind(home)
            .bind(&new.visitor)
            .bind(i64::from(new.statics))
            .execute(&mut *tx)
            .await?;
        }
        for (session, stand) in &changes.stands {
            sqlx::query("UPDATE sessions SET stand = $1 WHERE session = $2 AND home = $3")
                .bind(stand)
                .bind(i64::try_from(*session)?)
                .bind(home)
                .execute(&mut *tx)
                .await?;
        }
        for session in &changes.ended {
            sqlx::query("DELETE FROM sessions WHERE session = $1 AND home = $2")
                .bind(i64::try_from(*session)?)
                .bind(home)
                .execute(&mut *tx)
                .await?;
        }
        tx.commit().await?;
        Ok(())
    }

    /// Sessions, each in its place; none where there is none.
    pub async fn kept_sessions(&self, sessions: &[u64]) -> anyhow::Result<Vec<Option<HousedSession>>> {
        let mut connection = self.pool.acquire().await?;
        let mut found = Vec::with_capacity(sessions.len());
        for session in sessions {
            let row = sqlx::query(
                "SELECT session, scene, sessions.home AS home, visitor, statics, stand, beats \
                 FROM sessions JOIN session_homes ON session_homes.home = sessions.home WHERE session = $1",
            )
            .bind(i64::try_from(*session)?)
            .fetch_optional(&mut *connection)
            .await?;
            found.push(row.as_ref().map(housed).transpose()?);
        }
        Ok(found)
    }

    /// Gives each of these another home if it is still at home where it was, and nothing was heard from there since that many
    /// beats; that home hears of it with its next beat, and the new one is heard of. Says in its place how often each has moved by now; none where it was not for
    /// this home to take.
    pub async fn take_sessions(&self, takings: &[Taking], to: &str) -> anyhow::Result<Vec<Option<u64>>> {
        let mut tx = self.vital_transaction().await?;
        // How many were taken from each home that may be taken from.
        let mut gone = BTreeMap::new();
        // In one order everywhere, so that no two who take wait for each other.
        let mut homes: BTreeSet<_> = takings.iter().map(Taking::home).collect();
        homes.insert((to, 0));
        for (home, beats) in homes {
            if home == to {
                hear_of(to).execute(&mut *tx).await?;
                gone.insert((home, beats), 0);
                continue;
            }
            // Its next beat waits for this, or has been before.
            let silent = sqlx::query("UPDATE session_homes SET robbed = robbed WHERE home = $1 AND beats = $2")
                .bind(home)
                .bind(beats)
                .execute(&mut *tx)
                .await?;
            if silent.rows_affected() > 0 {
                gone.insert((home, beats), 0);
            }
        }
        let mut all = Vec::with_capacity(takings.len());
        for taking in takings {
            let Some(robbed) = gone.get_mut(&taking.home()) else {
                all.push(None);
                continue;
            };
            let row = sqlx::query(
                "UPDATE sessions SET home = $1, taken = taken + 1 WHERE session = $2 AND home = $3 RETURNING taken",
            )
            .bind(to)
            .bind(i64::try_from(taking.session)?)
            .bind(&taking.from)
            .fetch_optional(&mut *tx)
            .await?;
            *robbed += i64::from(row.is_some());
            let taken = row.map(|row| anyhow::Ok(u64::try_from(row.try_get::<i64, _>("taken")?)?));
            all.push(taken.transpose()?);
        }
        for ((home, _), robbed) in gone
            .into_iter()
            .filter(|((home, _), robbed)| *home != to && *robbed > 0)
        {
            sqlx::query("UPDATE session_homes SET robbed = robbed + $1 WHERE home = $2")
                .bind(robbed)
                .bind(home)
                .execute(&mut *tx)
                .await?;
        }
        tx.commit().await?;
        Ok(all)
    }

    /// A home is heard of.
    pub async fn beat_home(&self, home: &str) -> anyhow::Result<Beat> {
        let row = returned(&self.vital, hear_of(home)).await?;
        Ok(Beat {
            beats: row.try_get("beats")?,
            robbed: row.try_get("robbed")?,
        })
    }

    /// All homes.
    pub async fn session_homes(&self) -> anyhow::Result<Vec<SessionHome>> {
        let rows = sqlx::query("SELECT home, beats, ended FROM session_homes")
            .fetch_all(&self.vital)
            .await?;
        rows.iter()
            .map(|row| {
                Ok(SessionHome {
                    home: row.try_get("home")?,
                    beats: row.try_get("beats")?,
                    ended: row.try_get::<i64, _>("ended")? != 0,
                })
            })
            .collect()
    }

    /// A home ends: whoever is asked for its sessions may take them up.
    pub async fn end_home(&self, home: &str) -> anyhow::Result<()> {
        sqlx::query("UPDATE session_homes SET ended = 1 WHERE home = $1")
            .bind(home)
            .execute(&self.vital)
            .await?;
        Ok(())
    }

    /// Forgets a home of which nothing was heard since that many beats, and all sessions that nobody has taken up since.
    pub async fn forget_home(&self, home: &str, beats: i64) -> anyhow::Result<()> {
        sqlx::query("DELETE FROM session_homes WHERE home = $1 AND beats = $2")
            .bind(home)
            .bind(beats)
            .execute(&self.vital)
            .await?;
        Ok(())
    }

    /// The sessions that are at home here.
    pub async fn sessions_at(&self, home: &str) -> anyhow::Result<BTreeSet<u64>> {
        let rows = sqlx::query("SELECT session FROM sessions WHERE home = $1")
            .bind(home)
            .fetch_all(&self.vital)
            .await?;
        rows.iter()
            .map(|row| Ok(u64::try_from(row.try_get::<i64, _>("session")?)?))
            .collect()
    }
}

fn housed(row: &AnyRow) -> anyhow::Result<HousedSession> {
    let kept = KeptSession {
        session: u64::try_from(row.try_get::<i64, _>("session")?)?,
        scene: row.try_get::<&str, _>("scene")?.parse()?,
        visitor: row.try_get("visitor")?,
        statics: row.try_get::<i64, _>("statics")? != 0,
    };
    Ok(HousedSession {
        kept,
        home: row.try_get("home")?,
        stand: row.try_get("stand")?,
        beats: row.try_get("beats")?,
    })
}

/// Raises the beats of a home, which is known from then on.
fn hear_of(home: &str) -> Query<'_, sqlx::Any, AnyArguments> {
    sqlx::query(
        "INSERT INTO session_homes (home, beats) VALUES ($1, 1) \
         ON CONFLICT (home) DO UPDATE SET beats = session_homes.beats + 1 RETURNING beats, robbed",
    )
    .bind(home)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn opened(session: u64) -> SessionChanges {
        let kept = KeptSession {
            session,
            scene: "rooms".parse().unwrap(),
            visitor: "{}".into(),
            statics: true,
        };
        SessionChanges {
            opened: vec![kept],
            ..SessionChanges::default()
        }
    }

    #[tokio::test]
    async fn a_home_is_heard_of_however_many_ask_for_something_else() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        let mut others = Vec::new();
        while let Ok(one) = tokio::time::timeout(std::time::Duration::from_millis(200), catalogue.pool.acquire()).await
        {
            others.push(one.unwrap());
        }
        assert!(others.len() > 1, "all connections are taken");
        assert_eq!(catalogue.beat_home("here").await.unwrap().beats, 1);
        assert_eq!(catalogue.session_homes().await.unwrap().len(), 1);
        assert_eq!(catalogue.take_sessions(&[], "there").await.unwrap(), []);
        assert_eq!(catalogue.renew_jobs("worker", 30).await.unwrap(), []);
        catalogue.requeue_forsaken_jobs().await.unwrap();
        assert!(!catalogue.end_job(("job", "worker"), "done", None, None).await.unwrap());
    }

    async fn kept(catalogue: &Catalogue) -> Option<HousedSession> {
        catalogue.kept_sessions(&[7]).await.unwrap().remove(0)
    }

    fn taking(session: u64, (from, beats): (&str, i64)) -> Taking {
        Taking {
            session,
            from: from.into(),
            beats,
        }
    }

    async fn beats(catalogue: &Catalogue, home: &str) -> i64 {
        let homes = catalogue.session_homes().await.unwrap();
        homes.into_iter().find(|known| known.home == home).unwrap().beats
    }

    #[tokio::test]
    async fn a_session_has_one_home_and_only_one_of_many_takes_it() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        for _ in 0..2 {
            catalogue.keep_sessions("a", &opened(7)).await.unwrap();
        }
        let stands = SessionChanges {
            stands: vec![(7, "here".into())],
            ..SessionChanges::default()
        };
        catalogue.keep_sessions("a", &stands).await.unwrap();
        let (before, heard) = (kept(&catalogue).await.unwrap(), beats(&catalogue, "a").await);
        assert_eq!((before.home.as_str(), before.stand.as_deref()), ("a", Some("here")));
        assert_eq!(before.kept, opened(7).opened[0]);

        assert_eq!(before.beats, heard);
        let beat = catalogue.beat_home("a").await.unwrap();
        assert_eq!((beat.beats, beat.robbed), (heard + 1, 0));
        let take = async |from, to| {
            let takings = [taking(7, from), taking(8, from)];
            let taken = catalogue.take_sessions(&takings, to).await.unwrap();
            assert_eq!(taken[1], None, "there is no such session");
            taken[0]
        };
        assert_eq!(take(("a", heard), "b").await, None, "it was heard of since");
        let takes = ["b", "c", "d"].map(|to| take(("a", heard + 1), to));
        let taken = futures_util::future::join_all(takes).await;
        assert_eq!(taken.iter().flatten().collect::<Vec<_>>(), [&1], "{taken:?}");
        let after = kept(&catalogue).await.unwrap();
        let home = after.home.clone();
        assert_eq!(
            after,
            HousedSession {
                home: ["b", "c", "d"][taken.iter().position(Option::is_some).unwrap()].into(),
                beats: after.beats,
                ..before
            }
        );
        assert_eq!(take((&home, 0), &home).await, Some(2), "its own again");
        let after = kept(&catalogue).await;

        // Who has lost it changes nothing of it, and hears that.
        let ends = SessionChanges {
            stands: vec![(7, "there".into())],
            ended: vec![7],
            ..SessionChanges::default()
        };
        catalogue.keep_sessions("a", &ends).await.unwrap();
        assert_eq!(kept(&catalogue).await, after);
        let beat = catalogue.beat_home("a").await.unwrap();
        assert_eq!(beat.robbed, 1, "one was taken, once");
        assert!(catalogue.sessions_at("a").await.unwrap().is_empty());
        assert_eq!(catalogue.sessions_at(&home).await.unwrap(), [7].into());
        catalogue.keep_sessions(&home, &ends).await.unwrap();
        assert_eq!(kept(&catalogue).await, None);
    }

    #[tokio::test]
    async fn a_home_that_is_forgotten_takes_its_sessions_along_unless_it_is_heard_of() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        catalogue.keep_sessions("a", &opened(7)).await.unwrap();
        let heard = beats(&catalogue, "a").await;
        catalogue.end_home("a").await.unwrap();
        assert!(catalogue.session_homes().await.unwrap()[0].ended);
        catalogue.forget_home("a", heard - 1).await.unwrap();
        assert!(kept(&catalogue).await.is_some());
        catalogue.forget_home("a", heard).await.unwrap();
        assert_eq!(kept(&catalogue).await, None);
        let beat = catalogue.beat_home("a").await.unwrap();
        assert!(beat.beats <= heard, "it hears that it was forgotten");
    }

    #[tokio::test]
    async fn a_home_that_was_silent_keeps_the_sessions_that_it_gets() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        for home in ["a", "c"] {
            catalogue.beat_home(home).await.unwrap();
        }
        // Nobody is there for a long time, and nothing says that the homes are.
        let silent = ("a", beats(&catalogue, "a").await);
        catalogue.keep_sessions("a", &opened(7)).await.unwrap();
        let takes = [taking(7, silent)];
        assert_eq!(catalogue.take_sessions(&takes, "b").await.unwrap(), [None]);
        let silent = ("c", beats(&catalogue, "c").await);
        let takes = [taking(7, ("a", beats(&catalogue, "a").await))];
        assert_eq!(catalogue.take_sessions(&takes, "c").await.unwrap(), [Some(1)]);
        let takes = [taking(7, silent)];
        assert_eq!(catalogue.take_sessions(&takes, "b").await.unwrap(), [None]);
    }

    #[tokio::test]
    async fn all_sign_with_the_secret_that_was_kept_first() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        for fresh in ["a", "b"] {
            let secret = catalogue.session_secret(&fresh.into()).await.unwrap();
            assert_eq!(secret.reveal(), "a");
        }
    }
}
