//! Does every reader hear what it is to hear, in order, however slow it is?

use std::{io::Read, sync::atomic::AtomicUsize, task::Wake};

use belvedere_live::{
    Ms,
    event::{self, Attention, Gone, Manifest, Moving, ObjectPose},
    motion::Pose,
};
use belvedere_scene::{BlobName, Bounds, ObjectId, Revision, object::ObjectInfo};
use socket2::{Domain, SockRef, Socket, Type};

use super::*;
use crate::live::{
    line::{Held, Taken, Turn},
    sending::MOST,
};

/// A connection, of which it takes what it is told to take.
#[derive(Debug)]
struct Pipe {
    near: Socket,
    far: Socket,
    takes: Taken,
    turn: Mutex<Turn>,
    wrote: AtomicBool,
}

impl Pipe {
    fn new(takes: Taken) -> Arc<Self> {
        let (near, far) = Socket::pair(Domain::UNIX, Type::STREAM, None).unwrap();
        for end in [&near, &far] {
            end.set_nonblocking(true).unwrap();
        }
        let turn = Mutex::new(if takes == Taken::Nothing {
            Turn::Task
        } else {
            Turn::Free
        });
        let wrote = AtomicBool::new(false);
        Arc::new(Self {
            near,
            far,
            takes,
            turn,
            wrote,
        })
    }

    /// What was written, as text, without what a chunk was filled up with.
    fn heard(&self) -> String {
        let mut heard = Vec::new();
        let end = (&self.far).read_to_end(&mut heard).unwrap_err();
        assert_eq!(end.kind(), std::io::ErrorKind::WouldBlock);
        str::from_utf8(&heard).unwrap().trim_end_matches(' ').to_owned()
    }
}

impl Line for Pipe {
    fn hold(&self) -> Option<Held<'_>> {
        Held::if_free(self.turn.lock().unwrap(), SockRef::from(&self.near), &self.wrote)
    }

    fn frame(&self, piece: &[&[u8]], wire: &mut Vec<u8>) {
        wire.extend_from_slice(&piece.concat());
        if self.takes == Taken::Begun {
            // More than any connection holds.
            wire.resize(64 << 20, b' ');
        }
    }
}

/// How often it was woken.
#[derive(Debug, Default)]
struct Woken(AtomicUsize);

impl Wake for Woken {
    fn wake(self: Arc<Self>) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }
}

const O: ObjectId = ObjectId(5);

fn pos(t_ms: Ms) -> Event {
    Event::ObjectPos {
        t_ms,
        objects: Arc::new([ObjectPose {
            object: O,
            pose: Pose::resting(t_ms, [t_ms as f64, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]),
        }]),
    }
}

fn gone() -> Event {
    Event::ObjectGone {
        objects: vec![O],
        reason: Gone::Hidden,
    }
}

/// What a reader hears at once.
fn read(outbox: &Outbox, reader: u64) -> String {
    let mut text = String::new();
    while let Poll::Ready(Some(piece)) = outbox.poll(reader, &Context::from_waker(Waker::noop())) {
        text.push_str(std::str::from_utf8(&piece).unwrap());
    }
    text
}

fn wake() -> Event {
    Event::Wake { object: ObjectId(1) }
}

fn names(text: &str) -> Vec<&str> {
    text.lines().filter_map(|line| line.strip_prefix("event: ")).collect()
}

#[test]
fn of_poses_only_the_newest_is_told_and_none_of_what_is_gone() {
    let outbox = Outbox::default();
    let reader = outbox.attach(None);
    (0..100).for_each(|t_ms| outbox.push(&pos(t_ms)));
    let text = read(&outbox, reader);
    assert_eq!(names(&text), ["object-pos"]);
    assert!(text.contains(r#""position":[99.0"#), "{text}");
    outbox.push(&pos(100));
    outbox.push(&gone());
    assert_eq!(names(&read(&outbox, reader)), ["object-gone"]);
}

#[test]
fn a_session_is_told_nothing_before_it_is_greeted_and_then_the_greeting_first() {
    let outbox = Outbox::new(Arc::default(), 0);
    outbox.push(&Event::Cell {
        cell: belvedere_scene::CellId(7),
    });
    outbox.push(&gone());
    assert!(!outbox.wants_greeting(), "nobody would hear it");
    let reader = outbox.attach(None);
    assert_eq!(read(&outbox, reader), "");
    assert!(outbox.wants_greeting());
    // Any event will do for the greeting.
    outbox.greet(&wake());
    assert!(!outbox.wants_greeting());
    assert_eq!(
        names(&read(&outbox, reader)),
        ["wake", "object-gone"],
        "the greeting names the cell"
    );
}

#[test]
fn whoever_comes_to_a_session_that_was_taken_up_is_told_all_anew_under_higher_numbers() {
    for last_seen in [None, Some(0), Some(7), Some(u64::MAX)] {
        let missed = Arc::new(AtomicBool::new(false));
        let outbox = Outbox::new(missed.clone(), 2);
        outbox.push(&gone());
        let reader = outbox.attach(last_seen);
        assert_eq!(read(&outbox, reader), "", "what was told before is void");
        let reason = outbox.wants_resync().unwrap();
        assert!(missed.load(Ordering::Relaxed));
        outbox.push(&Event::Resync { reason });
        outbox.push(&gone());
        let text = read(&outbox, reader);
        assert_eq!(names(&text), ["resync", "object-gone"]);
        assert!(text.starts_with("id: 8589934593\n"), "{text}");
        // From there on it is resumed as ever.
        let again = outbox.attach(Some(8_589_934_593));
        assert_eq!(names(&read(&outbox, again)), ["object-gone"]);
    }
}

#[test]
fn what_many_are_told_alike_is_held_once_and_each_hears_it_in_its_own_order() {
    let outboxes: [Arc<Outbox>; 3] = Default::default();
    let readers = outboxes.each_ref().map(|outbox| outbox.attach(None));
    outboxes[2].push(&gone());
    let mut delivery = Delivery::begin();
    let mut push_to_all = |t_ms| {
        let events = outboxes.each_ref().map(|outbox| (outbox.clone(), pos(t_ms)));
        assert_eq!(push_all(&events, &mut delivery), 0, "they have no lines");
    };
    push_to_all(7);
    let heard = [0, 1, 2].map(|i| read(&outboxes[i], readers[i]));
    assert_eq!(heard[0], heard[1]);
    assert!(
        heard[0].starts_with("id: 1\nevent: object-pos\ndata: {"),
        "{}",
        heard[0]
    );
    assert!(heard[2].contains("id: 2\nevent: object-pos\ndata: {"), "{}", heard[2]);
    let kept = outboxes
        .each_ref()
        .map(|outbox| outbox.state().told.last().unwrap().data.clone());
    assert!(kept.iter().all(|data| data.as_ptr() == kept[0].as_ptr()));
    // What came later to one of them is nobody else's.
    push_to_all(8);
    outboxes[0].push(&gone());
    outboxes[1].push(&pos(9));
    assert_eq!(names(&read(&outboxes[0], readers[0])), ["object-gone"]);
    let [newest, shared] = [1, 2].map(|i| read(&outboxes[i], readers[i]));
    assert!(newest.contains("\"position\":[9.0") && shared.contains("\"position\":[8.0"));
}

#[test]
fn a_reader_that_was_cut_off_goes_on_after_what_it_has_heard() {
    let outbox = Outbox::default();
    let first = outbox.attach(None);
    for _ in 0..3 {
        outbox.push(&gone());
    }
    assert!(read(&outbox, first).starts_with("id: 1\nevent: object-gone\ndata: {"));
    outbox.push(&gone());
    let second = outbox.attach(Some(2));
    let text = read(&outbox, second);
    assert!(text.starts_with("id: 3\n") && text.contains("id: 4\n"), "{text}");
    assert_eq!(names(&text).len(), 2);
    assert_eq!(
        outbox.poll(first, &Context::from_waker(Waker::noop())),
        Poll::Ready(None)
    );
}

#[test]
fn who_has_missed_too_much_is_told_anew() {
    let outbox = Outbox::default();
    let first = outbox.attach(None);
    outbox.push(&gone());
    read(&outbox, first);
    for (last_seen, why) in [
        (None, Void::Unknown),
        (Some(77), Void::Missed),
        (Some(u64::MAX), Void::Missed),
    ] {
        let reader = outbox.attach(last_seen);
        assert_eq!(outbox.wants_resync(), Some(why));
        outbox.push(&gone());
        assert_eq!(read(&outbox, reader), "", "void until everything is told anew");
        outbox.push(&Event::Resync { reason: why });
        assert_eq!(names(&read(&outbox, reader)), ["resync"]);
    }
}

#[test]
fn a_stuck_reader_costs_bounded_memory() {
    let outbox = Outbox::default();
    let reader = outbox.attach(None);
    for _ in 0..100_000 {
        outbox.push(&gone());
        assert!(outbox.state().queue_bytes <= QUEUE_BYTES);
    }
    assert_eq!(outbox.wants_resync(), None, "it has not taken what it got before");
    outbox.readers_changed.store(false, Ordering::Relaxed);
    assert_eq!(read(&outbox, reader), "");
    assert_eq!(outbox.wants_resync(), Some(Void::Missed));
    assert!(
        outbox.readers_changed.load(Ordering::Relaxed),
        "somebody looks after it"
    );
    outbox.detach(reader);
    assert_eq!(outbox.wants_resync(), None, "nobody would hear it");
}

#[test]
fn a_reader_is_drained_when_it_has_taken_all_that_must_be_told() {
    let outbox = Outbox::default();
    assert!(!outbox.is_drained(), "nobody is there");
    let reader = outbox.attach(None);
    assert!(outbox.is_drained());
    outbox.push(&gone());
    assert!(!outbox.is_drained());
    read(&outbox, reader);
    outbox.push(&pos(1));
    assert!(outbox.is_drained(), "poses wait for no room");
    let again = outbox.attach(Some(0));
    assert!(!outbox.is_drained(), "some of it is to be read again");
    read(&outbox, again);
    assert!(outbox.is_drained());
}

/// Who somebody is; of what does not move without a pose.
fn info(object: u32, moves: bool) -> Event {
    let info = ObjectInfo {
        object: ObjectId(object),
        source_node: String::new(),
        part: 0,
        bounds: Bounds::around([[0.0; 3]; 2]),
        transform: [0.0; 16],
        model: None,
        procedural: None,
        mover: moves,
        door: false,
        levels: Vec::new(),
        smooth: None,
        impostor: None,
    };
    let attention = Attention {
        period_ms: 100,
        visibility: None,
        level: None,
    };
    let moving = moves.then(|| Moving {
        pose: Pose::resting(0, [0.0; 3], [0.0, 0.0, 0.0, 1.0]),
        radius_m: 0.5,
        attention,
    });
    let info = Arc::new(info);
    Event::ObjectInfo(Box::new(event::Told { info, moving }))
}

/// The objects of infos that a reader hears, in their order.
fn introduced(text: &str) -> Vec<u32> {
    let objects = text.split("data: {\"object\":\"o").skip(1);
    let numbers = objects.map(|rest| rest.split('"').next().unwrap().parse().unwrap());
    numbers.collect()
}

#[test]
fn who_moves_is_told_before_what_does_not_and_waits_for_none_of_it() {
    let outbox = Outbox::default();
    let reader = outbox.attach(None);
    (0..10).for_each(|i| outbox.push(&info(i, false)));
    assert!(outbox.is_drained(), "those who move need not wait");
    assert_eq!(read(&outbox, reader), "", "nobody has said yet that there are none");
    outbox.push(&info(10, true));
    outbox.let_aside_go(true);
    outbox.push(&info(11, true));
    assert_eq!(introduced(&read(&outbox, reader))[..3], [10, 11, 0]);
    outbox.push(&info(12, false));
    assert_eq!(introduced(&read(&outbox, reader)), [12]);
    let again = outbox.attach(None);
    outbox.push(&Event::Resync { reason: Void::Unknown });
    outbox.push(&info(13, false));
    let woken = Arc::new(Woken::default());
    read(&outbox, again);
    let waker = woken.clone().into();
    assert!(outbox.poll(again, &Context::from_waker(&waker)).is_pending());
    outbox.let_aside_go(true);
    assert_eq!(woken.0.load(Ordering::Relaxed), 1);
    assert_eq!(introduced(&read(&outbox, again)), [13], "and no more of what is void");
}

#[test]
fn of_what_does_not_move_nothing_of_an_earlier_revision_is_told() {
    let revision = || Event::Revision {
        revision: Revision([7; 8]),
        manifest: Manifest(BlobName::of(b"of a scene", "json").unwrap()),
    };
    for free in [false, true] {
        let outbox = Outbox::default();
        let reader = outbox.attach(None);
        outbox.let_aside_go(free);
        outbox.push(&info(1, false));
        outbox.push(&info(2, true));
        outbox.push(&revision());
        outbox.push(&info(3, false));
        let mut text = read(&outbox, reader);
        assert_eq!(introduced(&text).contains(&3), free, "it is let go as before");
        outbox.let_aside_go(true);
        text += &read(&outbox, reader);
        assert_eq!(names(&text), ["object-info", "revision", "object-info"]);
        assert_eq!(introduced(&text), [2, 3]);
    }
    let outbox = Outbox::default();
    outbox.attach(None);
    while outbox.has_room() {
        outbox.push(&info(1, false));
    }
    outbox.push(&revision());
    assert!(outbox.has_room(), "its room is given back");
}

#[test]
fn what_does_not_move_is_told_in_the_end_where_somebody_always_waits() {
    let outbox = Outbox::default();
    let reader = outbox.attach(None);
    let stands: Vec<_> = (0..5).collect();
    stands.iter().for_each(|i| outbox.push(&info(*i, false)));
    let (mut told, mut pieces) = (Vec::new(), 0);
    for i in 100.. {
        outbox.push(&info(i, true));
        let heard = introduced(&read(&outbox, reader));
        assert_eq!(heard[0], i, "whoever moves comes first");
        told.extend(heard.into_iter().skip(1));
        pieces += 1;
        if told.len() == stands.len() {
            break;
        }
    }
    assert_eq!(told, stands);
    assert!(pieces >= 5 * 8, "and not more than a little at a time: {pieces}");
}

#[test]
fn what_does_not_move_pushes_nothing_else_out() {
    let outbox = Outbox::default();
    let reader = outbox.attach(None);
    let mut stands = 0;
    while outbox.has_room() {
        outbox.push(&info(stands, false));
        stands += 1;
    }
    let mut moves = 0;
    while outbox.state().queue_bytes < QUEUE_BYTES - 2_000 {
        outbox.push(&info(1 << 30 | moves, true));
        moves += 1;
    }
    assert_eq!(outbox.state().missed, None);
    outbox.let_aside_go(true);
    assert_eq!(introduced(&read(&outbox, reader)).len() as u32, stands + moves);
    assert!(outbox.has_room(), "it is given back");
}

#[test]
fn who_is_never_listened_to_costs_less() {
    let outbox = Outbox::default();
    for _ in 0..100_000 {
        outbox.push(&gone());
        assert!(outbox.state().queue_bytes <= FIRST_BYTES);
    }
    assert_eq!(outbox.wants_resync(), None, "nobody would hear it");
    outbox.attach(None);
    assert_eq!(
        outbox.wants_resync(),
        Some(Void::Missed),
        "what was dropped is told anew"
    );
}

#[test]
fn the_end_comes_after_what_waits() {
    let outbox = Outbox::default();
    let reader = outbox.attach(None);
    outbox.push(&gone());
    outbox.close();
    let cx = Context::from_waker(Waker::noop());
    assert!(matches!(outbox.poll(reader, &cx), Poll::Ready(Some(_))));
    assert_eq!(outbox.poll(reader, &cx), Poll::Ready(None));
}

#[test]
fn poses_go_into_the_line_of_a_reader_that_has_heard_all_else() {
    let (outbox, pipe) = (Outbox::default(), Pipe::new(Taken::All));
    let reader = outbox.attach(None);
    outbox.lay(reader, pipe.clone());
    outbox.push(&pos(1));
    assert_eq!(pipe.heard(), "", "nobody knows whether the reader waits");
    assert!(read(&outbox, reader).starts_with("id: 1\n"));
    outbox.push(&pos(2));
    assert!(pipe.heard().starts_with("id: 2\nevent: object-pos\ndata: {\"t_ms\":2,"));
    assert_eq!(read(&outbox, reader), "");
    outbox.push(&gone());
    outbox.push(&pos(3));
    assert_eq!(pipe.heard(), "", "what must not be lost comes before");
    assert_eq!(names(&read(&outbox, reader)), ["object-gone", "object-pos"]);
    outbox.push(&pos(4));
    assert!(pipe.heard().starts_with("id: 5\n"));
    // Whoever comes back hears it again, and the line has gone with its reader.
    let again = outbox.attach(Some(4));
    assert!(read(&outbox, again).starts_with("id: 5\n"));
    outbox.push(&pos(5));
    outbox.lay(reader, pipe.clone());
    outbox.push(&pos(6));
    assert_eq!(pipe.heard(), "");
    assert!(read(&outbox, again).contains("\"position\":[6.0"));
}

#[test]
fn what_a_line_does_not_take_is_the_task_s() {
    for (takes, told) in [(Taken::Nothing, false), (Taken::Begun, true)] {
        let (outbox, pipe, woken) = (Outbox::default(), Pipe::new(takes), Arc::new(Woken::default()));
        let reader = outbox.attach(None);
        outbox.lay(reader, pipe.clone());
        let waker = Waker::from(woken.clone());
        assert_eq!(outbox.poll(reader, &Context::from_waker(&waker)), Poll::Pending);
        outbox.push(&pos(1));
        assert_eq!(woken.0.load(Ordering::Relaxed), 1, "{takes:?}");
        assert_eq!(!pipe.heard().is_empty(), told);
        outbox.push(&pos(2));
        assert_eq!(pipe.heard(), "", "until the task has looked");
        let text = read(&outbox, reader);
        assert_eq!(names(&text), ["object-pos"], "the newest alone");
        let first = if told { 2 } else { 1 };
        assert!(
            text.starts_with(&format!("id: {first}\n")) && text.contains("\"position\":[2.0"),
            "{text}"
        );
    }
}

#[test]
fn many_hear_at_once_each_in_its_own_order() {
    let pipes: Vec<_> = (0..MOST + 9).map(|_| Pipe::new(Taken::All)).collect();
    let outboxes: Vec<_> = pipes.iter().map(|_| Arc::new(Outbox::default())).collect();
    for (outbox, pipe) in outboxes.iter().zip(&pipes) {
        let reader = outbox.attach(None);
        outbox.lay(reader, pipe.clone());
        read(outbox, reader);
    }
    // Two poses to each; and something that must not be lost comes between two of one.
    let mut events: Vec<_> = outboxes
        .iter()
        .flat_map(|o| [1, 2].map(|t_ms| (o.clone(), pos(t_ms))))
        .collect();
    events.insert(11, (outboxes[5].clone(), gone()));
    assert_eq!(push_all(&events, &mut Delivery::begin()), 2 * pipes.len() as u64 - 1);
    for (i, pipe) in pipes.iter().enumerate() {
        let heard = pipe.heard();
        let ids: Vec<_> = heard.lines().filter_map(|line| line.strip_prefix("id: ")).collect();
        if i == 5 {
            assert_eq!(ids, ["1"]);
            let text = read(&outboxes[i], 1);
            assert_eq!(
                names(&text),
                ["object-gone", "object-pos"],
                "what must not be lost comes before"
            );
        } else {
            assert_eq!(ids, ["1", "2"]);
        }
    }
}

#[test]
fn what_is_said_is_heard_by_who_is_there_or_has_missed_nothing_yet() {
    let outbox = Outbox::default();
    assert!(!outbox.listens(), "nobody has come yet");
    let reader = outbox.attach(None);
    assert!(outbox.listens());
    assert!(outbox.is_read() && outbox.readers_changed.swap(false, Ordering::Relaxed));
    outbox.detach(reader);
    assert!(!outbox.is_read(), "nobody hears it at once");
    assert!(
        outbox.readers_changed.load(Ordering::Relaxed),
        "whoever looks after it hears of that"
    );
    outbox.push(&gone());
    assert!(outbox.listens(), "it waits for whoever was cut off");
    let infos = QUEUE_BYTES / 16;
    (0..infos).for_each(|_| outbox.push(&gone()));
    assert!(!outbox.listens());
    outbox.attach(Some(0));
    assert!(outbox.listens() && outbox.wants_resync().is_some());
}

#[test]
fn whoever_is_cut_off_has_the_whole_lease_to_come_back() {
    const LONG: Duration = Duration::from_secs(25);
    let outbox = Outbox::default();
    let first = outbox.attach(None);
    let passes = || outbox.state().last_sign -= LONG;
    passes();
    outbox.detach(first);
    assert!(
        outbox.silent_for() < LONG,
        "the lease counts from the end of the stream"
    );
    // The end of a stream that another one has followed is no sign of life.
    let (second, third) = (outbox.attach(None), outbox.attach(None));
    passes();
    outbox.detach(second);
    assert!(outbox.silent_for() >= LONG);
    outbox.detach(third);
    assert!(outbox.silent_for() < LONG);
}
