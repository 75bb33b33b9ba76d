//! Who else is there? `cargo run -p belvedere-client --example meet -- http://127.0.0.1:8080 museum`.
//!
//! Walks round in a small circle about the first viewpoint for a minute, and says whom it meets, who goes and why, and which doors
//! move. Two of them meet each other.

#![allow(clippy::print_stdout, reason = "that is what it is for")]

use std::{env, error::Error, time::Duration};

use belvedere_client::{
    Client, HttpSource,
    live::{LiveEvent, Participant, Session, SessionEvent, Stand},
};
use tokio::time::{Instant, sleep_until, timeout_at};

const FRAME: Duration = Duration::from_millis(20);
const FRAMES: u32 = 3000;
const RADIUS_M: f64 = 0.4;
const SPEED_MPS: f64 = 0.8;

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = env::args().skip(1);
    let (Some(address), Some(name)) = (arguments.next(), arguments.next()) else {
        return Err("usage: meet ADDRESS SCENE".into());
    };
    let (source, name) = (HttpSource::new(&address)?, name.parse()?);
    let scene = Client::new(source.clone()).open(&name).await?;
    let middle = scene
        .pointer()
        .viewpoints
        .first()
        .ok_or("the scene has no viewpoint")?
        .position;
    let who = Participant {
        name: Some("meet".to_owned()),
        ..Participant::default()
    };
    let Some(mut session) = Session::offered(source, &name, who).await? else {
        println!("nobody is met in a static tree");
        return Ok(());
    };
    let begin = Instant::now();
    for frame in 1..=FRAMES {
        let angle = begin.elapsed().as_secs_f64() * SPEED_MPS / RADIUS_M;
        let (sin, cos) = angle.sin_cos();
        let position = [middle[0] + RADIUS_M * cos, middle[1], middle[2] + RADIUS_M * sin];
        session.stand(Stand::upright(position), [-SPEED_MPS * sin, 0.0, SPEED_MPS * cos]);
        let next = begin + FRAME * frame;
        while let Ok(Some(event)) = timeout_at(next, session.advance()).await {
            tell(&event);
        }
        if frame % 250 == 0 {
            show(&session);
        }
        sleep_until(next).await;
    }
    session.close().await?;
    Ok(())
}

fn tell(event: &SessionEvent) {
    match event {
        SessionEvent::Opened(object) => println!("here, as {object}"),
        SessionEvent::Told(LiveEvent::Appear(somebody)) => {
            println!("{} appears: {}", somebody.info.object, somebody.info.source_node);
        }
        SessionEvent::Told(LiveEvent::Vanish { objects, reason }) => {
            for object in objects {
                println!("{object} is gone: {reason:?}");
            }
        }
        SessionEvent::Told(LiveEvent::Door { object, open }) => println!("the door {object} opens: {open}"),
        SessionEvent::Told(_) => {}
        SessionEvent::Cut(cause) => println!("comes back after: {cause}"),
        SessionEvent::Lost(cause) => println!("begins anew after: {cause}"),
        SessionEvent::Problem(cause) => println!("goes on after: {cause}"),
    }
}

/// Those who are there now.
fn show(session: &Session) {
    let company = session.company();
    println!(
        "{} in sight, {} doors closed",
        company.movers(session.now_ms()).count(),
        company.closed_doors().len()
    );
    for mover in company.movers(session.now_ms()) {
        let [x, y, z] = mover.stand.position;
        println!("  {} at {x:.2} {y:.2} {z:.2}", mover.info.object);
    }
}
