use proptest::prelude::*;

use super::looks::TOO_MANY_LOOKS;
use super::model::{Bit, Nibble, number};
use super::rans::{Coder, Place, Reader, STATE_BYTES, Writer};
use super::{Decoder, SmoothError};

/// A decision, by what it is of.
#[derive(Debug, Clone)]
enum Decision {
    Bit(bool),
    Symbol(usize),
    Raw(u32, u32),
    Number(u32),
}

fn decision() -> impl Strategy<Value = Decision> {
    prop_oneof![
        any::<bool>().prop_map(Decision::Bit),
        (0usize..16).prop_map(Decision::Symbol),
        (0u32..=15).prop_flat_map(|bits| (0..1u32 << bits).prop_map(move |value| Decision::Raw(bits, value))),
        (any::<u32>(), 0u32..32).prop_map(|(number, shift)| Decision::Number(number >> shift)),
    ]
}

/// Codes all of them; gives what stands in the stream.
fn code(coder: &mut impl Coder, decisions: &[Decision]) -> Vec<u32> {
    let (mut bit, mut symbol, mut size) = (Bit::default(), Nibble::default(), Nibble::default());
    let code_one = |decision: &Decision| match *decision {
        Decision::Bit(value) => u32::from(coder.bit(&mut bit, value)),
        Decision::Symbol(value) => coder.symbol(&mut symbol, value) as u32,
        Decision::Raw(bits, value) => coder.raw(bits, value),
        Decision::Number(value) => number(coder, &mut size, value),
    };
    decisions.iter().map(code_one).collect()
}

/// The same kinds of decisions, without what they are.
fn blind(decisions: &[Decision]) -> Vec<Decision> {
    let forget = |decision: &Decision| match *decision {
        Decision::Bit(_) => Decision::Bit(false),
        Decision::Symbol(_) => Decision::Symbol(0),
        Decision::Raw(bits, _) => Decision::Raw(bits, 0),
        Decision::Number(_) => Decision::Number(0),
    };
    decisions.iter().map(forget).collect()
}

proptest! {
    #[test]
    fn decisions_are_read_as_they_were_written(decisions in prop::collection::vec(decision(), 0..300)) {
        let mut writer = Writer::default();
        let written = code(&mut writer, &decisions);
        let (bytes, _) = writer.finish(&[]);
        let place = Place::start(bytes.first_chunk::<STATE_BYTES>().unwrap());
        let mut reader = Reader::new(&bytes, true, place);
        prop_assert_eq!(code(&mut reader, &blind(&decisions)), written);
        prop_assert!(reader.place().is_end() && reader.left() == 0 && !reader.starved());
    }

    #[test]
    fn a_mark_is_where_the_decisions_before_it_end(decisions in prop::collection::vec(decision(), 1..300), at in any::<prop::sample::Index>()) {
        let at = at.index(decisions.len());
        let mut writer = Writer::default();
        // Numbers are several decisions: mark between two of ours.
        let (mut bit, mut symbol, mut size) = (Bit::default(), Nibble::default(), Nibble::default());
        let mut mark = 0;
        for (i, decision) in decisions.iter().enumerate() {
            if i == at {
                mark = writer.decisions();
            }
            match *decision {
                Decision::Bit(value) => _ = writer.bit(&mut bit, value),
                Decision::Symbol(value) => _ = writer.symbol(&mut symbol, value),
                Decision::Raw(bits, value) => _ = writer.raw(bits, value),
                Decision::Number(value) => _ = number(&mut writer, &mut size, value),
            }
        }
        let (bytes, ends) = writer.finish(&[mark]);
        let part = &bytes[..ends[0]];
        let mut reader = Reader::new(part, false, Place::start(part.first_chunk::<STATE_BYTES>().unwrap()));
        code(&mut reader, &blind(&decisions[..at]));
        prop_assert!(!reader.starved() && reader.left() == 0);
    }
}

#[test]
fn what_nearly_always_happens_costs_nearly_nothing() {
    let mut writer = Writer::default();
    let mut bit = Bit::default();
    for i in 0..8000 {
        writer.bit(&mut bit, i % 100 == 0);
    }
    // The entropy of one in a hundred is 0.081 bits; 8,000 of them are 81 bytes.
    let bytes = writer.finish(&[]).0.len();
    assert!((81..115).contains(&bytes), "{bytes} bytes");
}

/// A thousand triangles around two vertices; a split of a few bits moves them all on to the next vertex, again and again.
#[test]
fn a_reader_does_not_look_at_more_than_a_mesh_of_its_size_needs_and_keeps_what_it_has() {
    let mut decoder = Decoder::new(u64::MAX);
    let refused = decoder.push(include_bytes!("../../../../tests/golden/smooth/hub.slod"));
    assert_eq!(refused, Err(SmoothError::Damaged(TOO_MANY_LOOKS)));
    // As in TypeScript.
    assert_eq!(decoder.counts(), (111, 1000));
    let drawn = decoder.snapshot();
    let corners = drawn.indices.concat();
    assert_eq!(corners.len(), 3000);
    assert!(corners.iter().all(|&i| (i as usize) < drawn.positions.len()));
}
