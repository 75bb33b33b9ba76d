//! How does a program meet who else is in a scene? It opens a [`Session`] where the server offers them, says where it stands as
//! often as it likes, and is told of movers and doors that it may see (`docs/LIVE.md`). What need not be said is not sent;
//! a stream that was cut is resumed, and a session that has ended is opened anew.
//!
//! ```no_run
//! # async fn meet() -> Result<(), belvedere_client::Error> {
//! use std::time::Duration;
//!
//! use belvedere_client::{HttpSource, live::{Participant, Session, Stand}};
//! use tokio::time::{Instant, sleep_until, timeout_at};
//!
//! let source = HttpSource::new("http://127.0.0.1:8080")?;
//! let scene = "museum".parse().expect("a scene name");
//! let Some(mut session) = Session::offered(source, &scene, Participant::default()).await? else {
//!     return Ok(()); // a static tree: nobody is met there
//! };
//! for frame in 0..600 {
//!     let x = 8.0 + f64::from(frame) / 60.0;
//!     session.stand(Stand::upright([x, 1.5, 4.0]), [1.0, 0.0, 0.0]);
//!     let next = Instant::now() + Duration::from_millis(16);
//!     while let Ok(Some(event)) = timeout_at(next, session.advance()).await {
//!         println!("{event:?}");
//!     }
//!     for mover in session.company().movers(session.now_ms()) {
//!         // draw mover.info at mover.stand
//!     }
//!     sleep_until(next).await;
//! }
//! session.close().await
//! # }
//! ```

mod ear;
mod session;
mod state;
mod wire;

pub use session::{Session, SessionEvent};
pub use state::{
    company::{Company, Mover},
    event::{Appearance, Attention, Ball, Gone, Hello, Hush, LiveEvent},
    motion::{Pose, Stand},
    speaker::Speech,
};
pub use wire::{Aoi, Avatar, Participant};
