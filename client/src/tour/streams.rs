//! Are rungs what the name of their stream promises, for who keeps none of them? Each stream is hashed as its rungs come, in order. What
//! comes before its turn is not waited for: a stream of which a rung failed meanwhile stays unjudged until those behind it come again.

use std::collections::HashMap;

use belvedere_scene::{BlobHash, BlobHasher, object::Model, rung::RungName};

/// Streams of which some rungs have come, from the first on.
#[derive(Debug, Default)]
pub(super) struct Streams {
    begun: HashMap<BlobHash, Begun>,
}

#[derive(Debug, Default)]
struct Begun {
    hasher: BlobHasher,
    rungs: usize,
}

impl Streams {
    /// Takes in a rung of a model; answers whether the stream is whole now, and right or wrong.
    pub(super) fn take(&mut self, rung: &RungName, bytes: &[u8], model: &Model) -> Option<bool> {
        let smooth = model.smooth.as_ref()?;
        let begun = self.begun.entry(rung.hash).or_default();
        if begun.rungs != usize::from(rung.number) {
            return None;
        }
        begun.hasher.update(bytes);
        begun.rungs += 1;
        if begun.rungs < smooth.rungs.len() {
            return None;
        }
        let whole = self.begun.remove(&rung.hash)?;
        Some(whole.hasher.finish() == rung.hash)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::streamed;

    #[test]
    fn a_stream_is_judged_when_its_rungs_have_come_in_order_and_no_other_time() {
        let (smooth, whole) = streamed(7, &[(10, 0.5), (30, 0.2), (40, 0.0)], b"materials");
        let rungs = smooth.rungs.clone();
        let model = Model {
            levels: Vec::new(),
            smooth: Some(smooth),
            impostor: None,
            procedural: None,
        };
        let wrong = [8; 40];
        for (order, damaged, judged) in [
            (vec![0, 1, 2], None, Some(true)),
            (vec![0, 1, 2], Some(1), Some(false)),
            // One that comes again is known.
            (vec![0, 0, 1, 0, 2], None, Some(true)),
            (vec![0, 2, 1], None, None),
            (vec![0, 2, 1, 2], None, Some(true)),
            // Once judged, from the beginning.
            (vec![0, 1, 2, 0, 1, 2], None, Some(true)),
        ] {
            let mut streams = Streams::default();
            let mut take = |number: &usize| {
                let rung = &rungs[*number];
                let bytes: &[u8] = if damaged == Some(*number) { &wrong } else { &whole };
                streams.take(&rung.url, &bytes[rung.from as usize..rung.to as usize], &model)
            };
            let (last, before) = order.split_last().expect("rungs come");
            assert!(before.iter().filter_map(&mut take).all(|right| right), "{order:?}");
            assert_eq!(take(last), judged, "{order:?}");
        }
    }
}
