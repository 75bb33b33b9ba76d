//! Do all readers stand a fixed number of damaged inputs? The same ones in every run, so a fault comes again.
//!
//! Without coverage, but not blind: an input with an outcome that was not seen before becomes another example. More rounds:
//! `BELVEDERE_FUZZ_ROUNDS=1000000 cargo test -p belvedere-fuzz --test bounded smooth`.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may fail at any step")]

use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Mutex;

use belvedere_fuzz::{
    TARGETS, Target,
    memory::{Counting, most_bytes, within},
    mutate::{Random, mutated},
};

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Memory is counted for the whole program, so one target runs at a time.
static TURN: Mutex<()> = Mutex::new(());
/// No more examples than this.
const MOST_EXAMPLES: usize = 200;

fn run(name: &str) {
    let _turn = TURN.lock().unwrap_or_else(|stopped| stopped.into_inner());
    let target = TARGETS.iter().find(|target| target.name == name).expect("a target");
    let rounds = std::env::var("BELVEDERE_FUZZ_ROUNDS").map_or(target.rounds, |text| text.parse().expect("a number"));
    let mut examples = (target.seeds)();
    assert!(!examples.is_empty(), "nothing to begin with");
    let mut seen: BTreeSet<u64> = examples.iter().map(|example| stand(target, example)).collect();
    // Every example is cut at all lengths once.
    for example in examples.clone() {
        let step = example.len().div_ceil(1000).max(1);
        for end in (0..example.len()).step_by(step) {
            stand(target, &example[..end]);
        }
    }
    let mut random = Random(7);
    for _ in 0..rounds {
        let input = mutated(&examples, &mut random);
        if seen.insert(stand(target, &input)) && examples.len() < MOST_EXAMPLES {
            examples.push(input);
        }
    }
    assert!(seen.len() > 3, "{name}: damage makes no difference");
}

/// One input; when its reader is at fault it is kept for a look.
fn stand(target: &Target, input: &[u8]) -> u64 {
    catch_unwind(AssertUnwindSafe(|| (target.check)(input))).unwrap_or_else(|_| {
        let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}.fault", target.name));
        std::fs::write(&file, input).unwrap();
        panic!(
            "{}: a fault; its input of {} bytes is in {}",
            target.name,
            input.len(),
            file.display()
        );
    })
}

macro_rules! targets {
    ($($name:ident)*) => {
        $(#[test]
        fn $name() {
            run(stringify!($name));
        })*

        #[test]
        fn all_targets_are_run() {
            assert_eq!(TARGETS.iter().map(|target| target.name).collect::<Vec<_>>(), [$(stringify!($name)),*]);
        }
    };
}

targets! {
    cell_record cell_steps documents names smooth thesis rules
    import_glb import_gltf import_zip import_plan level occluders
}

#[test]
fn memory_is_counted() {
    let _turn = TURN.lock().unwrap_or_else(|stopped| stopped.into_inner());
    let ((), taken_bytes) = most_bytes(|| drop(std::hint::black_box(vec![1u8; 1 << 20])));
    // The harness runs beside it, and may give a little back meanwhile.
    assert!(taken_bytes >= 1 << 19, "{taken_bytes} bytes");
    assert!(catch_unwind(|| within(1 << 10, || std::hint::black_box(vec![1u8; 1 << 20]).len())).is_err());
}
