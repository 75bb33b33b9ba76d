//! What numbers has each new wedge? Copied from a corner beside it, or a residual to what is expected.

use super::super::header::MOST_CHANNELS;
use super::super::mesh::Mesh;
use super::super::model::Nibble;
use super::super::rans::Coder;
use super::super::residual::residual;
use super::super::script::Script;
use super::expected::Beside;
use super::wedges::Corner;
use super::{ChannelKind, Done};

/// Numbers of wedges while a mesh grows.
#[derive(Debug, Clone)]
pub(super) struct Values {
    kinds: Vec<ChannelKind>,
    /// Numbers of a wedge.
    pub(super) stride: usize,
    pub(super) numbers: Vec<i32>,
    copy: Vec<[Nibble; 5]>,
    size: Vec<[[Nibble; 8]; 16]>,
    last_copy: Vec<usize>,
}

impl Values {
    pub(super) fn new(kinds: Vec<ChannelKind>) -> Self {
        let stride = kinds.iter().map(|kind| kind.numbers()).sum();
        let nibbles = || std::array::from_fn(|_| Nibble::default());
        Self {
            stride,
            numbers: Vec::new(),
            copy: kinds
                .iter()
                .map(|_| std::array::from_fn(|_| Nibble::default()))
                .collect(),
            size: (0..stride).map(|_| std::array::from_fn(|_| nibbles())).collect(),
            last_copy: vec![0; kinds.len()],
            kinds,
        }
    }

    /// How many wedges have been told.
    pub(super) fn wedges(&self) -> u32 {
        self.numbers.len().checked_div(self.stride).unwrap_or(0) as u32
    }

    /// Makes room for so many wedges in all.
    pub(super) fn reserve(&mut self, wedges: usize) {
        let numbers = wedges * self.stride;
        self.numbers.reserve(numbers.saturating_sub(self.numbers.len()));
    }

    /// Tells those of the next wedge, which these corners have.
    pub(super) fn code<C: Coder, S: Script>(
        &mut self,
        coder: &mut C,
        mesh: &Mesh,
        script: Option<&mut S>,
        wedges: &[[u32; 3]],
        (corners, split): (&[Corner], Done),
    ) {
        let mut given = [0; 4 * MOST_CHANNELS];
        let given = &mut given[..self.stride];
        if let Some(script) = script {
            script.values(self.wedges(), given);
        }
        let (triangle, side, was) = corners[0];
        let around = wedges[triangle as usize];
        let sources = [around[(side + 1) % 3], around[(side + 2) % 3], was];
        let mut at = 0;
        for channel in 0..self.kinds.len() {
            let kind = self.kinds[channel];
            let numbers = at..at + kind.numbers();
            let beside = Beside {
                mesh,
                corners: wedges,
                values: &self.numbers,
                stride: self.stride,
                pending: corners,
                split: (split.old, split.new),
            };
            let copy_of = |i: usize| Some(&beside.value(sources[i])?[numbers.clone()]);
            let mut given_copy = 0;
            if C::WRITES {
                let same = |&i: &usize| copy_of(i).is_some_and(|copy| copy == &given[numbers.clone()]);
                given_copy = (0..sources.len()).find(same).map_or(0, |i| i + 1);
            }
            let model = &mut self.copy[channel][self.last_copy[channel]];
            let copy = coder.symbol(model, given_copy).min(3);
            self.last_copy[channel] = copy;
            let mut found = [0; 4];
            let copied = copy.checked_sub(1).and_then(copy_of);
            if let Some(copied) = copied {
                found[..copied.len()].copy_from_slice(copied);
            } else {
                let expected = beside.expected(kind, &numbers);
                let mut context = 0;
                for (k, number) in numbers.clone().enumerate() {
                    let like = match kind {
                        ChannelKind::Normal => corners.len().min(15),
                        _ => usize::from(split.size / 2),
                    };
                    let model = &mut self.size[number][like][context];
                    let (value, class) = residual(coder, model, given[number].wrapping_sub(expected[k]));
                    found[k] = value.wrapping_add(expected[k]);
                    context = class / 2;
                }
            }
            self.numbers.extend_from_slice(&found[..kind.numbers()]);
            at = numbers.end;
        }
    }
}
