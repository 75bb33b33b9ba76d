//! How do uploaded bytes become a job? They are written as they come; only when the last one is on the disk does the
//! catalogue hear of them; where several nodes share it, they are sent to where all of these find them before. An upload that
//! ends early leaves nothing.

use std::{path::PathBuf, str::FromStr};

use anyhow::Context;
use belvedere_scene::SceneName;
use tokio::{fs::File, io::AsyncWriteExt};

use super::{GoingOn, Job, JobError, JobId, Jobs};
use crate::{
    db::{Keeping, NewJob},
    folder,
    secret::Secret,
};

/// What a source is, where whoever sends it says so. Else its content says it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// glTF 2.0, binary.
    Glb,
    /// glTF 2.0 as text.
    Gltf,
    /// An archive of either.
    Zip,
    /// A floor plan.
    Plan,
    /// Rules.
    Dcg,
}

impl Format {
    fn extension(self) -> &'static str {
        match self {
            Self::Glb => "glb",
            Self::Gltf => "gltf",
            Self::Zip => "zip",
            Self::Plan => "plan",
            Self::Dcg => "dcg",
        }
    }
}

impl FromStr for Format {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let all = [Self::Glb, Self::Gltf, Self::Zip, Self::Plan, Self::Dcg];
        all.into_iter().find(|format| format.extension() == text).ok_or(())
    }
}

/// What is said of a source beside its bytes.
#[derive(Debug, Clone, Default)]
pub struct Source {
    /// The scene's name for people.
    pub title: Option<String>,
    /// What it is.
    pub format: Option<Format>,
    /// What links of its scene are to be signed with, where that is to be private from before it is baked on.
    pub link_key: Option<Secret>,
}

/// An upload that is going on.
#[derive(Debug)]
pub struct Upload {
    jobs: Jobs,
    id: JobId,
    scene: SceneName,
    title: Option<String>,
    link_key: Option<Secret>,
    going_on: GoingOn,
    file: File,
    path: PathBuf,
    bytes: u64,
    /// Removed when the upload is dropped before it is a job.
    folder: Folder,
}

#[derive(Debug)]
struct Folder {
    path: PathBuf,
    kept: bool,
}

impl Drop for Folder {
    fn drop(&mut self) {
        if !self.kept
            && let Err(error) = std::fs::remove_dir_all(&self.path)
        {
            tracing::warn!(folder = %self.path.display(), %error, "cannot remove an upload that ended early");
        }
    }
}

impl Upload {
    pub(super) async fn begin(
        jobs: Jobs,
        scene: SceneName,
        source: Source,
        going_on: GoingOn,
        announced_bytes: u64,
    ) -> Result<Self, JobError> {
        jobs.fits(announced_bytes)?;
        let id = JobId::random()?;
        let path = jobs.folder(id);
        let folder = Folder { path, kept: false };
        let cannot = || format!("cannot keep an upload in {}", folder.path.display());
        folder::make_private(&jobs.inner.data).with_context(cannot)?;
        // Also where the data folder is for others to read.
        folder::make_private(&jobs.uploads()).with_context(cannot)?;
        folder::make_private(&folder.path).with_context(cannot)?;
        // A folder of its own: nothing stands beside what was uploaded.
        let name = match source.format {
            Some(format) => format!("{scene}.{}", format.extension()),
            None => scene.to_string(),
        };
        let path = folder.path.join(name);
        let file = File::create_new(&path).await.with_context(cannot)?;
        Ok(Self {
            jobs,
            id,
            scene,
            title: source.title,
            link_key: source.link_key,
            going_on,
            file,
            path,
            bytes: 0,
            folder,
        })
    }

    /// The next bytes.
    ///
    /// # Errors
    /// When they are too many, or the disk does not take them.
    pub async fn write(&mut self, bytes: &[u8]) -> Result<(), JobError> {
        self.jobs.fits(self.bytes + bytes.len() as u64)?;
        self.file.write_all(bytes).await.context("cannot keep an upload")?;
        self.bytes += bytes.len() as u64;
        Ok(())
    }

    /// That was all: it is a job now.
    ///
    /// # Errors
    /// When it is nothing, too many jobs wait, or the disk or the catalogue do not take it.
    pub async fn finish(self) -> Result<Job, JobError> {
        if self.bytes == 0 {
            return Err(JobError::Empty);
        }
        // Whoever sent it may go away; once the catalogue has the job, its bytes stay.
        let finishing = tokio::spawn(self.become_job());
        finishing.await.context("cannot keep an upload")?
    }

    async fn become_job(mut self) -> Result<Job, JobError> {
        self.file.sync_all().await.context("cannot keep an upload")?;
        let errands = &self.jobs.inner.errands;
        errands
            .send(&self.id.to_string(), &self.path)
            .await
            .context("cannot keep an upload")?;
        let (name, settings) = (self.id.to_string(), &self.jobs.inner.settings);
        let new = NewJob {
            job: &name,
            scene: &self.scene,
            title: self.title.as_deref(),
            source_bytes: self.bytes,
            key_id: &self.going_on.key_id,
            link_key: self.link_key.as_ref(),
        };
        let catalogue = &self.jobs.inner.catalogue;
        let keep = || catalogue.keep_job(&new, settings.open_of_a_key, settings.open_of_all);
        let mut keeping = keep().await?;
        let mut room = Ok(());
        if keeping == Keeping::NoRoom {
            let open = catalogue.open_jobs(&self.going_on.key_id).await;
            room = open
                .map_err(JobError::from)
                .and_then(|(theirs, all)| settings.room(theirs, all));
            // Where there is room now, some have ended meanwhile.
            if room.is_ok() {
                keeping = keep().await?;
            }
        }
        let refused = match keeping {
            Keeping::Kept => None,
            Keeping::NoRoom => Some(room.err().unwrap_or(JobError::Full {
                most: settings.open_of_all,
            })),
            Keeping::Public => Some(JobError::Public(self.scene.clone())),
        };
        if let Some(refused) = refused {
            self.jobs.recall(self.id).await;
            return Err(refused);
        }
        // Whoever bakes it takes what was sent; where nothing travels, it is baked from here.
        self.folder.kept = !errands.travel();
        let stored = catalogue.job(&name).await?.ok_or(JobError::NoJob(self.id))?;
        let job = Job::read(&stored)?;
        tracing::info!(%job.job, %job.scene, job.source_bytes, key = self.going_on.key_id, "a scene was uploaded");
        self.jobs.inner.changed.notify_one();
        Ok(job)
    }
}

impl Jobs {
    fn fits(&self, bytes: u64) -> Result<(), JobError> {
        let most_bytes = self.inner.settings.upload_bytes;
        if bytes > most_bytes {
            return Err(JobError::TooLarge { most_bytes });
        }
        Ok(())
    }
}
