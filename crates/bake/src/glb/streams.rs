//! What does each vertex of a primitive cost? Attributes as rows of few bytes (`KHR_mesh_quantization`), filtered as
//! `EXT_meshopt_compression` wants them.
//!
//! | attribute | row |
//! |---|---|
//! | positions | three u16 and two bytes of nothing, or three filtered floats, see [`Frame`] |
//! | normals, tangents | octahedral, 8 bits a coordinate: off by at most about a degree |
//! | texture coordinates | two u16 when all lie between 0 and 1 and no picture is repeated more than 16 times, else two floats that are multiples of 2⁻¹⁶ or of less |
//! | colours | four u8 when that is exact, else four u16 between 0 and 1, else four floats that are multiples of 2⁻¹⁶ |

use crate::glb::lattice::{Frame, excess_bits};
use crate::meshopt_view;
use crate::pictures::texels::pictures_a_unit;
use crate::source::{Material, Primitive, Topology};

pub(super) const BYTE: u32 = 5120;
pub(super) const UNSIGNED_BYTE: u32 = 5121;
pub(super) const UNSIGNED_SHORT: u32 = 5123;
pub(super) const FLOAT: u32 = 5126;

/// Floats of texture coordinates and colours are multiples of two to the power of this, unless they are large or a picture is repeated often.
const FLOAT_EXPONENT: i32 = -16;
/// Up to so many pictures along a unit of texture coordinates, 16 bits tell a place within 1/8192 of one.
const PICTURES_A_UNIT: f64 = 16.0;

/// One attribute of all vertices of a primitive.
pub(super) struct Stream {
    pub(super) name: String,
    /// glTF's name for so many components.
    pub(super) shape: &'static str,
    pub(super) component: u32,
    pub(super) normalized: bool,
    pub(super) filter: &'static str,
    /// Bytes of a row, a multiple of four.
    pub(super) stride: usize,
    /// One row after the other, filtered.
    pub(super) rows: Vec<u8>,
}

impl Stream {
    pub(super) fn row(&self, vertex: u32) -> &[u8] {
        &self.rows[vertex as usize * self.stride..][..self.stride]
    }

    /// The rows as a reader has them.
    pub(super) fn unfiltered(&self) -> Vec<u8> {
        let mut rows = self.rows.clone();
        let fits = meshopt_view::undo_filter(self.filter, &mut rows, self.stride);
        debug_assert!(fits, "{} of {} bytes", self.filter, self.stride);
        rows
    }

    fn words<const N: usize>(name: String, shape: &'static str, rows: impl Iterator<Item = [u16; N]>) -> Self {
        let stride = (2 * N).next_multiple_of(4);
        let row = |row: [u16; N]| {
            let bytes = row.into_iter().flat_map(u16::to_le_bytes);
            bytes.chain(std::iter::repeat_n(0, stride - 2 * N))
        };
        Self {
            name,
            shape,
            component: UNSIGNED_SHORT,
            normalized: true,
            filter: "NONE",
            stride,
            rows: rows.flat_map(row).collect(),
        }
    }

    /// Whole numbers of at most 24 bits, times two to the power of an exponent.
    fn floats<const N: usize>(name: String, shape: &'static str, rows: impl Iterator<Item = [(i32, f64); N]>) -> Self {
        let filtered = |(exponent, mantissa): (i32, f64)| (exponent << 24) | (mantissa as i32 & 0xFF_FFFF);
        Self {
            name,
            shape,
            component: FLOAT,
            normalized: false,
            filter: "EXPONENTIAL",
            stride: 4 * N,
            rows: rows.flatten().flat_map(|x| filtered(x).to_le_bytes()).collect(),
        }
    }

    /// Floats rounded to multiples of a power of two, each of which is too long for that to one of its own: a stray one takes nothing
    /// from the others.
    fn rounded_floats<const N: usize>(name: String, shape: &'static str, rows: &[[f32; N]], finest: i32) -> Self {
        let rounded = |x: f32| {
            let counted = |exponent: i32| f64::from(x) / f64::from(exponent).exp2();
            let exponent = finest + excess_bits(counted(finest).abs().ceil()) as i32;
            (exponent, counted(exponent).round_ties_even())
        };
        Self::floats(name, shape, rows.iter().map(|row| row.map(rounded)))
    }

    fn positions(rows: &[[f32; 3]], frame: &Frame) -> Self {
        let name = "POSITION".to_owned();
        let steps = rows.iter().map(|p| frame.steps(*p));
        match frame {
            Frame::Words { .. } => Self {
                normalized: false,
                ..Self::words(name, "VEC3", steps.map(|p| p.map(|x| x as u16)))
            },
            Frame::Floats { lattice } => Self::floats(name, "VEC3", steps.map(|p| p.map(|x| (lattice.exponent(), x)))),
        }
    }

    /// Unit vectors; what stands in the fourth component is kept.
    fn octahedral(name: &str, shape: &'static str, rows: &[[f32; 4]]) -> Self {
        let filtered: Vec<[i8; 4]> = meshopt::encode_filter_oct(rows, 8);
        Self {
            name: name.to_owned(),
            shape,
            component: BYTE,
            normalized: true,
            filter: "OCTAHEDRAL",
            stride: 4,
            rows: filtered.into_flattened().into_iter().map(|x| x as u8).collect(),
        }
    }

    fn texture_coordinates(set: usize, rows: &[[f32; 2]], material: Option<&Material>) -> Self {
        let name = format!("TEXCOORD_{set}");
        let times = pictures_a_unit(material, set) / PICTURES_A_UNIT;
        if within_unit(rows) && times <= 1.0 {
            Self::words(
                name,
                "VEC2",
                rows.iter().map(|uv| uv.map(|x| scaled(x, u16::MAX.into()) as u16)),
            )
        } else {
            // More bits than this no float has left.
            let more = times.log2().ceil().clamp(0.0, 32.0);
            Self::rounded_floats(name, "VEC2", rows, FLOAT_EXPONENT - more as i32)
        }
    }

    fn colors(rows: &[[f32; 4]]) -> Self {
        let name = "COLOR_0".to_owned();
        let as_byte = |x: f32| scaled(x, u8::MAX.into()) as u8;
        // A byte that was read as f32 comes back as itself.
        if rows.as_flattened().iter().all(|x| f32::from(as_byte(*x)) / 255.0 == *x) {
            Self {
                component: UNSIGNED_BYTE,
                stride: 4,
                rows: rows.as_flattened().iter().map(|x| as_byte(*x)).collect(),
                ..Self::words(name, "VEC4", std::iter::empty::<[u16; 4]>())
            }
        } else if within_unit(rows) {
            Self::words(
                name,
                "VEC4",
                rows.iter().map(|c| c.map(|x| scaled(x, u16::MAX.into()) as u16)),
            )
        } else {
            Self::rounded_floats(name, "VEC4", rows, FLOAT_EXPONENT)
        }
    }
}

/// The attributes of a primitive, positions first, as finely as its material shows them.
pub(super) fn streams(primitive: &Primitive, frame: &Frame, material: Option<&Material>) -> Vec<Stream> {
    let mut streams = vec![Stream::positions(&primitive.positions, frame)];
    if !primitive.normals.is_empty() {
        let rows: Vec<_> = primitive.normals.iter().map(|[x, y, z]| [*x, *y, *z, 0.0]).collect();
        streams.push(Stream::octahedral("NORMAL", "VEC3", &rows));
        // glTF has no tangents without normals, and tangents shade surfaces only.
        if !primitive.tangents.is_empty() && primitive.topology == Topology::Triangles {
            streams.push(Stream::octahedral("TANGENT", "VEC4", &primitive.tangents));
        }
    }
    let sets = primitive.uvs.iter().enumerate().filter(|(_, uvs)| !uvs.is_empty());
    streams.extend(sets.map(|(set, uvs)| Stream::texture_coordinates(set, uvs, material)));
    if !primitive.colors.is_empty() {
        streams.push(Stream::colors(&primitive.colors));
    }
    streams
}

fn within_unit<const N: usize>(rows: &[[f32; N]]) -> bool {
    rows.as_flattened().iter().all(|x| (0.0..=1.0).contains(x))
}

fn scaled(x: f32, most: f64) -> f64 {
    (f64::from(x) * most).round().clamp(0.0, most)
}
