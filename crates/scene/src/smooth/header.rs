//! What does a smooth LOD say of itself before its stream begins? `docs/SLOD.md` has the table of bytes.

use super::SmoothError;
use super::attributes::{Channel, ChannelKind};
use super::geometry::{FEATURES, USUAL_WEIGHTS, Weights};

/// What everything before the stream says.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// Bytes of the file, header included.
    pub total_bytes: u32,
    /// Bits of a coordinate, 1 to 16.
    pub bits: u32,
    /// Vertices of the whole mesh.
    pub vertices: u32,
    /// Triangles of the whole mesh.
    pub triangles: u32,
    /// Sets of attribute values that the stream tells; 0 without attributes.
    pub wedges: u32,
    /// Materials, 1 or more; triangles name them from 0.
    pub materials: u16,
    /// Where the lattice begins, in model space.
    pub origin: [f32; 3],
    /// Step of the finest lattice, in model-space units.
    pub step: f32,
    /// Attributes of corners.
    pub channels: Vec<Channel>,
    /// How positions are predicted.
    pub weights: Weights,
    /// Good places to stop, each with about half the error of the one before; the last is the end.
    pub cuts: Vec<Cut>,
}

/// A place to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// Bytes from the beginning of the file.
    pub bytes: u32,
    /// Triangles of the mesh that those bytes give.
    pub triangles: u32,
    /// Measured root mean square distance to the whole mesh, both ways, in model-space units.
    pub rms_error: f32,
}

const MAGIC: [u8; 4] = *b"SLOD";
const VERSION: u8 = 2;
const FIXED_BYTES: usize = 44;
const CUT_BYTES: usize = 12;
/// No origin, step or low end is larger: whatever a damaged stream does with them stays finite in single precision.
const MOST_NUMBER: f32 = 1e24;
/// Most channels of a corner.
pub(super) const MOST_CHANNELS: usize = 8;

impl Header {
    /// The header's bytes.
    ///
    /// # Panics
    /// When there are more than 8 channels or 255 cuts.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        assert!(
            self.channels.len() <= MOST_CHANNELS && self.cuts.len() <= 255,
            "a header has no room for so many"
        );
        let mut bytes = MAGIC.to_vec();
        bytes.extend([
            VERSION,
            self.bits as u8,
            self.channels.len() as u8,
            self.cuts.len() as u8,
        ]);
        for number in [self.total_bytes, self.vertices, self.triangles, self.wedges] {
            bytes.extend(number.to_le_bytes());
        }
        let is_own = |i: usize| self.weights[i] != USUAL_WEIGHTS[i];
        let own: u16 = (0..self.weights.len()).map(|i| u16::from(is_own(i)) << i).sum();
        bytes.extend(self.materials.to_le_bytes());
        bytes.extend(own.to_le_bytes());
        for number in self.origin.iter().chain([&self.step]) {
            bytes.extend(number.to_le_bytes());
        }
        for channel in &self.channels {
            bytes.push(match channel.kind {
                ChannelKind::Normal => 0,
                ChannelKind::Uv => 1,
                ChannelKind::Colour => 2,
            });
            if channel.kind != ChannelKind::Normal {
                bytes.extend(channel.low.iter().chain(&channel.step).flat_map(|x| x.to_le_bytes()));
            }
        }
        for (i, weights) in self.weights.iter().enumerate() {
            if is_own(i) {
                bytes.extend(weights.iter().map(|&weight| weight as u8));
            }
        }
        for cut in &self.cuts {
            bytes.extend(cut.bytes.to_le_bytes());
            bytes.extend(cut.triangles.to_le_bytes());
            bytes.extend(cut.rms_error.to_le_bytes());
        }
        bytes
    }

    /// Reads a header and says how many bytes it has; `None` while they have not all come.
    ///
    /// # Errors
    /// When the bytes cannot be the beginning of a smooth LOD.
    pub fn read(bytes: &[u8]) -> Result<Option<(Self, usize)>, SmoothError> {
        let mut left = Bytes(bytes);
        let magic = &bytes[..bytes.len().min(4)];
        if *magic != MAGIC[..magic.len()] {
            return Err(SmoothError::NotSmooth);
        }
        if let Some(&version) = bytes.get(4)
            && version != VERSION
        {
            return Err(SmoothError::Version(version));
        }
        if bytes.len() < FIXED_BYTES {
            return Ok(None);
        }
        match Self::parse(&mut left) {
            None => Ok(None),
            Some(header) => {
                let length = bytes.len() - left.0.len();
                header?.checked(length).map(|header| Some((header, length)))
            }
        }
    }

    fn parse(left: &mut Bytes<'_>) -> Option<Result<Self, SmoothError>> {
        left.take::<5>()?;
        let [bits, channel_count, cut_count] = left.take()?;
        let [total_bytes, vertices, triangles, wedges] = left.numbers()?;
        let materials = u16::from_le_bytes(left.take()?);
        let own = u16::from_le_bytes(left.take()?);
        let [x, y, z, step] = left.numbers()?.map(f32::from_bits);
        let mut channels = Vec::new();
        for _ in 0..channel_count {
            let [kind] = left.take()?;
            let kind = match kind {
                0 => ChannelKind::Normal,
                1 => ChannelKind::Uv,
                2 => ChannelKind::Colour,
                _ => return Some(Err(SmoothError::Damaged("its header has an unknown attribute"))),
            };
            let [a, b, c, d] = if kind == ChannelKind::Normal {
                [0.0; 4]
            } else {
                left.numbers()?.map(f32::from_bits)
            };
            channels.push(Channel {
                kind,
                low: [a, b],
                step: [c, d],
            });
        }
        let mut weights = USUAL_WEIGHTS;
        for (i, weights) in weights.iter_mut().enumerate() {
            if own >> i & 1 == 1 {
                *weights = left.take::<FEATURES>()?.map(|byte| byte as i8);
            }
        }
        let mut cuts = Vec::new();
        if left.0.len() < usize::from(cut_count) * CUT_BYTES {
            return None;
        }
        for _ in 0..cut_count {
            let [bytes, triangles, error] = left.numbers()?;
            cuts.push(Cut {
                bytes,
                triangles,
                rms_error: f32::from_bits(error),
            });
        }
        Some(Ok(Self {
            total_bytes,
            bits: u32::from(bits),
            vertices,
            triangles,
            wedges,
            materials,
            origin: [x, y, z],
            step,
            channels,
            weights,
            cuts,
        }))
    }

    fn checked(self, length: usize) -> Result<Self, SmoothError> {
        let numbers = self.origin.iter().chain([&self.step]);
        let channels = self
            .channels
            .iter()
            .flat_map(|channel| channel.low.iter().chain(&channel.step));
        let is_told_twice = |kind: &ChannelKind| self.channels.iter().filter(|c| c.kind == *kind).count() > 1;
        let fault = if !(1..=16).contains(&self.bits) {
            "its coordinates have no bits or more than 16"
        } else if self.channels.len() > MOST_CHANNELS {
            "it has more attributes than there can be"
        } else if [ChannelKind::Normal, ChannelKind::Colour].iter().any(is_told_twice) {
            "it has more than one normal or colour of a corner"
        } else if self.materials == 0 {
            "it has no material"
        } else if (self.total_bytes as usize) < length {
            "it is shorter than its header"
        } else if self.vertices == u32::MAX || self.triangles > super::stars::MOST_LENGTH {
            "it has more vertices or triangles than there can be"
        } else if numbers.chain(channels).any(|x| !x.is_finite() || x.abs() > MOST_NUMBER) {
            "its header has a number that is not finite, or too large"
        } else if self.step < 0.0 {
            "its lattice has a negative step"
        } else if self.channels.is_empty() && self.wedges > 0 {
            "it has wedges without attributes"
        } else if !self.cuts_rise() {
            "its cuts do not rise to its end"
        } else {
            return Ok(self);
        };
        Err(SmoothError::Damaged(fault))
    }

    /// Whether bytes rise and errors fall from cut to cut, and the last one is all there is.
    fn cuts_rise(&self) -> bool {
        let rise = |pair: &[Cut]| {
            let [a, b] = [&pair[0], &pair[1]];
            a.bytes < b.bytes && a.triangles <= b.triangles && a.rms_error >= b.rms_error
        };
        let ends =
            |last: &Cut| last.bytes == self.total_bytes && last.triangles == self.triangles && last.rms_error >= 0.0;
        self.cuts.windows(2).all(rise) && self.cuts.last().is_none_or(ends)
    }

    /// Numbers of a wedge.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.channels.iter().map(|channel| channel.kind.numbers()).sum()
    }

    /// A decoder takes no more memory than this, the stream's own bytes included.
    #[must_use]
    pub fn memory_bytes(&self) -> u64 {
        let vertices = u64::from(self.vertices).max(1) * 64;
        // Beside corners and material, all triangles may meet at one vertex, whose star is then looked at and dressed.
        let corners = if self.channels.is_empty() { 0 } else { 12 + 64 };
        let triangles = u64::from(self.triangles) * (12 + 2 + 40 + corners);
        let wedges = u64::from(self.wedges) * 4 * (1 + self.stride() as u64);
        let stars = 4 * super::stars::most_places(self.vertices, self.triangles) as u64;
        // Arrays double their room when they grow.
        2 * (vertices + triangles + wedges + stars + u64::from(self.total_bytes)) + (1 << 20)
    }
}

/// Bytes that have not been read.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*first)
    }

    fn numbers<const N: usize>(&mut self) -> Option<[u32; N]> {
        let mut numbers = [0; N];
        for number in &mut numbers {
            *number = u32::from_le_bytes(self.take()?);
        }
        Some(numbers)
    }
}
