//! Which numbers does an accessor name?
//!
//! glTF 2.0 §3.6.2: typed views into buffers, with normalised integers, strides and sparse replacements. An accessor is
//! checked once, when it is opened; elements are then read where they are, so that a primitive which uses a few
//! vertices of a large shared buffer costs only those. Nothing is allocated on the word of `count` alone.

use super::document::Item;
use super::error::{Read, flaw};
use super::reader::{Bytes, Reader};

/// Component types.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn from_code(code: usize) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn size_bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// What a stored 1.0 is, for normalised integers.
    pub(super) fn one(self) -> Option<f32> {
        Some(match self {
            Self::I8 => 127.0,
            Self::U8 => 255.0,
            Self::I16 => 32767.0,
            Self::U16 => 65535.0,
            Self::U32 | Self::F32 => return None,
        })
    }

    fn float(self, bytes: &[u8]) -> f32 {
        match (self, bytes) {
            (Self::I8, &[a, ..]) => f32::from(a as i8),
            (Self::U8, &[a, ..]) => f32::from(a),
            (Self::I16, &[a, b, ..]) => f32::from(i16::from_le_bytes([a, b])),
            (Self::U16, &[a, b, ..]) => f32::from(u16::from_le_bytes([a, b])),
            (Self::U32, &[a, b, c, d, ..]) => u32::from_le_bytes([a, b, c, d]) as f32,
            (Self::F32, &[a, b, c, d, ..]) => f32::from_le_bytes([a, b, c, d]),
            _ => 0.0,
        }
    }

    fn integer(self, bytes: &[u8]) -> Option<u32> {
        match (self, bytes) {
            (Self::U8, &[a, ..]) => Some(u32::from(a)),
            (Self::U16, &[a, b, ..]) => Some(u32::from(u16::from_le_bytes([a, b]))),
            (Self::U32, &[a, b, c, d, ..]) => Some(u32::from_le_bytes([a, b, c, d])),
            _ => None,
        }
    }
}

/// How elements are laid out.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout {
    pub(super) component: Component,
    pub(super) components: usize,
    pub(super) normalized: bool,
}

/// Where an accessor, or a part of a sparse one, finds its elements.
struct Source<'i> {
    /// For defects.
    place: &'i str,
    view: usize,
    offset: usize,
    /// How many elements there should be.
    claimed: usize,
}

/// Elements in a row.
#[derive(Debug, Clone)]
enum Elements {
    /// An accessor without a view is all zeros until sparse values replace some.
    Zeros,
    /// In a buffer.
    View { bytes: Bytes, stride: usize },
    /// Decoded already, tightly packed.
    Decoded(Vec<f32>),
}

/// A checked accessor: every index below `count` can be read.
#[derive(Debug, Clone)]
pub(super) struct Accessor {
    pub(super) layout: Layout,
    pub(super) count: usize,
    elements: Elements,
    /// Element indices in rising order, and their values.
    sparse: Option<(Vec<u32>, Elements)>,
}

impl Accessor {
    /// An accessor over numbers that a decoder made, `components` for each element.
    pub(super) fn decoded(numbers: Vec<f32>, layout: Layout) -> Self {
        Self {
            layout,
            count: numbers.len() / layout.components.max(1),
            elements: Elements::Decoded(numbers),
            sparse: None,
        }
    }

    /// Element `index` as floats; components that it does not have are zero.
    pub(super) fn floats<const N: usize>(&self, index: usize) -> [f32; N] {
        let mut numbers = [0.0; N];
        let (elements, at) = self.locate(index);
        let used = self.layout.components.min(N);
        let Layout {
            component, normalized, ..
        } = self.layout;
        match elements {
            Elements::Zeros => {}
            Elements::Decoded(values) => {
                let start = at * self.layout.components;
                if let Some(element) = values.get(start..start + used) {
                    numbers[..used].copy_from_slice(element);
                }
            }
            Elements::View { bytes, stride } => {
                let element = bytes.as_slice().get(at * stride..).unwrap_or_default();
                for (number, stored) in numbers
                    .iter_mut()
                    .zip(element.chunks(component.size_bytes()))
                    .take(used)
                {
                    *number = component.float(stored);
                }
            }
        }
        if let (true, Some(one)) = (normalized, component.one()) {
            numbers = numbers.map(|n| (n / one).max(-1.0));
        }
        numbers
    }

    /// Element `index` as an unsigned integer; `None` when it is none.
    pub(super) fn integer(&self, index: usize) -> Option<u32> {
        let (elements, at) = self.locate(index);
        match elements {
            Elements::Zeros => Some(0),
            Elements::Decoded(values) => values.get(at).map(|&v| v as u32),
            Elements::View { bytes, stride } => self.layout.component.integer(bytes.as_slice().get(at * stride..)?),
        }
    }

    fn locate(&self, index: usize) -> (&Elements, usize) {
        if let Some((indices, values)) = &self.sparse
            && let Ok(at) = indices.binary_search(&(index as u32))
        {
            return (values, at);
        }
        (&self.elements, index)
    }
}

impl Reader<'_> {
    /// Opens and checks an accessor. Where its data ends early it is cut off there, and that is counted.
    pub(super) fn accessor(&mut self, index: usize) -> Read<Accessor> {
        let item = self.root.listed("accessors", index)?;
        let layout = layout(&item)?;
        let claimed = item.needed("count")?.as_index()?;
        let offset = item.index("byteOffset")?.unwrap_or(0);
        let sparse = item.member("sparse");
        let (elements, count) = match item.index("bufferView")? {
            Some(view) => {
                let place = &item.place;
                let source = Source {
                    place,
                    view,
                    offset,
                    claimed,
                };
                self.elements(&source, layout)?
            }
            None => {
                let size = layout.components * layout.component.size_bytes();
                self.budget.claim(claimed, size, || item.place.clone())?;
                (Elements::Zeros, claimed)
            }
        };
        let sparse = match sparse {
            Some(sparse) => {
                let replaced = self.sparse(&sparse, layout, count);
                self.settle(replaced)?
            }
            None => None,
        };
        Ok(Accessor {
            layout,
            count,
            elements,
            sparse,
        })
    }

    /// The elements in a view, and how many of the claimed ones are there.
    fn elements(&mut self, source: &Source, layout: Layout) -> Read<(Elements, usize)> {
        let Source {
            place,
            view,
            offset,
            claimed,
        } = *source;
        let (bytes, stride) = self.view(view)?;
        let size = layout.components * layout.component.size_bytes();
        let stride = stride.filter(|s| *s > 0).unwrap_or(size);
        if stride < size {
            return flaw(
                "stride smaller than an element: accessor left out",
                format!("{place}: {stride} bytes for elements of {size}"),
            );
        }
        let bytes = bytes.slice(offset..usize::MAX);
        let there = bytes.as_slice().len();
        let fitting = if there < size { 0 } else { (there - size) / stride + 1 };
        if fitting < claimed {
            self.defects
                .note("accessor past the end of its data: cut off there", 1, || {
                    format!("{place}: {claimed} elements claimed, {fitting} there")
                });
        }
        Ok((Elements::View { bytes, stride }, claimed.min(fitting)))
    }

    fn sparse(&mut self, item: &Item, layout: Layout, count: usize) -> Read<(Vec<u32>, Elements)> {
        const BAD: &str = "sparse accessor with bad indices: its replacements left out";
        let claimed = item.needed("count")?.as_index()?;
        let mut part = |key: &str, layout: &dyn Fn(&Item) -> Read<Layout>| -> Read<(Layout, Elements, usize)> {
            let part = item.needed(key)?;
            let layout = layout(&part)?;
            let source = Source {
                place: &part.place,
                view: part.needed("bufferView")?.as_index()?,
                offset: part.index("byteOffset")?.unwrap_or(0),
                claimed,
            };
            let (elements, there) = self.elements(&source, layout)?;
            Ok((layout, elements, there))
        };
        let scalar = |item: &Item| -> Read<Layout> {
            Ok(Layout {
                component: component(item)?,
                components: 1,
                normalized: false,
            })
        };
        let (index_layout, elements, indices_there) = part("indices", &scalar)?;
        let (_, values, values_there) = part("values", &|_| Ok(layout))?;
        let there = indices_there.min(values_there);
        self.budget.claim(there, size_of::<u32>(), || item.place.clone())?;
        let indices = Accessor {
            layout: index_layout,
            count: there,
            elements,
            sparse: None,
        };
        let indices: Option<Vec<u32>> = (0..there).map(|i| indices.integer(i)).collect();
        match indices {
            Some(indices)
                if indices.is_sorted_by(|a, b| a < b) && indices.last().is_none_or(|i| (*i as usize) < count) =>
            {
                Ok((indices, values))
            }
            _ => flaw(BAD, item.place.clone()),
        }
    }
}

fn component(item: &Item) -> Read<Component> {
    let code = item.needed("componentType")?;
    match Component::from_code(code.as_index()?) {
        Some(component) => Ok(component),
        None => flaw("unknown component type: accessor left out", code.place),
    }
}

/// The layout that an accessor states.
pub(super) fn layout(item: &Item) -> Read<Layout> {
    let components = match item.text("type")? {
        Some("SCALAR") => 1,
        Some("VEC2") => 2,
        Some("VEC3") => 3,
        Some("VEC4" | "MAT2") => 4,
        Some("MAT3") => 9,
        Some("MAT4") => 16,
        _ => {
            return flaw(
                "unknown accessor type: accessor left out",
                format!("{}/type", item.place),
            );
        }
    };
    Ok(Layout {
        component: component(item)?,
        components,
        normalized: item.truth("normalized")?,
    })
}
