//! Numbers out of glTF accessors, with every offset checked against its buffer.

use gltf::Accessor;
use gltf::accessor::DataType;
use gltf::accessor::sparse::IndexType;

use super::gltf_resource::{GltfError, GltfSource};

/// Most elements of one accessor.
const MAX_COUNT: usize = 1 << 28;

/// Reads all elements of an accessor of `N` components each; normalised integers become fractions.
/// `place` names the accessor's role in errors.
pub(super) fn read<const N: usize>(
    source: &GltfSource,
    accessor: &Accessor<'_>,
    place: &str,
) -> Result<Vec<[f64; N]>, GltfError> {
    let item = format!("{place} (accessor {})", accessor.index());
    if accessor.dimensions().multiplicity() != N {
        let got = accessor.dimensions();
        return Err(source.resource(
            &item,
            format!("must have {N} components per element, got {got:?}"),
        ));
    }
    if accessor.count() > MAX_COUNT {
        return Err(source.resource(
            &item,
            format!(
                "must have at most {MAX_COUNT} elements, got {}",
                accessor.count()
            ),
        ));
    }
    let reader = Reader {
        source,
        accessor,
        item: &item,
    };
    let mut elements = match accessor.view() {
        Some(view) => reader.elements(&view, accessor.offset(), accessor.count())?,
        None => vec![[0.0; N]; accessor.count()],
    };
    if let Some(sparse) = accessor.sparse() {
        reader.apply_sparse(&sparse, &mut elements)?;
    }
    Ok(elements)
}

struct Reader<'a> {
    source: &'a GltfSource,
    accessor: &'a Accessor<'a>,
    item: &'a str,
}

impl Reader<'_> {
    /// `count` elements of a buffer view from `offset` on.
    fn elements<const N: usize>(
        &self,
        view: &gltf::buffer::View<'_>,
        offset: usize,
        count: usize,
    ) -> Result<Vec<[f64; N]>, GltfError> {
        let kind = self.accessor.data_type();
        let (size, normalised) = (kind.size() * N, self.accessor.normalized());
        let stride = view.stride().unwrap_or(size);
        let bytes = self.strided(view, offset, count, stride, size)?;
        let element = |i: usize| {
            std::array::from_fn(|k| {
                component(&bytes[i * stride + k * kind.size()..], kind, normalised)
            })
        };
        Ok((0..count).map(element).collect())
    }

    /// The bytes from `offset` on, long enough for `count` elements of `size` bytes every `stride` bytes.
    fn strided(
        &self,
        view: &gltf::buffer::View<'_>,
        offset: usize,
        count: usize,
        stride: usize,
        size: usize,
    ) -> Result<&[u8], GltfError> {
        let view_bytes = self.source.view_bytes(view);
        let bytes = view_bytes
            .ok_or_else(|| self.beyond(format!("buffer view {}", view.index()), "its buffer"))?;
        let needed = match count {
            0 => Some(offset),
            _ => stride
                .checked_mul(count - 1)
                .and_then(|span| span.checked_add(size)?.checked_add(offset)),
        };
        let fits = needed.is_some_and(|needed| needed <= bytes.len());
        let what = || {
            self.beyond(
                format!("{count} elements"),
                &format!("buffer view {} of {} bytes", view.index(), bytes.len()),
            )
        };
        if fits {
            Ok(&bytes[offset..])
        } else {
            Err(what())
        }
    }

    fn beyond(&self, what: String, limit: &str) -> GltfError {
        self.source
            .resource(self.item, format!("{what} must not reach beyond {limit}"))
    }

    /// Replaces the elements that the sparse part lists.
    fn apply_sparse<const N: usize>(
        &self,
        sparse: &gltf::accessor::sparse::Sparse<'_>,
        elements: &mut [[f64; N]],
    ) -> Result<(), GltfError> {
        let (indices, count) = (sparse.indices(), sparse.count());
        let kind = match indices.index_type() {
            IndexType::U8 => DataType::U8,
            IndexType::U16 => DataType::U16,
            IndexType::U32 => DataType::U32,
        };
        let size = kind.size();
        let index_bytes = self.strided(&indices.view(), indices.offset(), count, size, size)?;
        let values: Vec<[f64; N]> =
            self.elements(&sparse.values().view(), sparse.values().offset(), count)?;
        for (i, value) in values.into_iter().enumerate() {
            let index = component(&index_bytes[i * size..], kind, false) as usize;
            let length = elements.len();
            let element = elements.get_mut(index);
            *element.ok_or_else(|| {
                self.beyond(
                    format!("sparse index {index}"),
                    &format!("{length} elements"),
                )
            })? = value;
        }
        Ok(())
    }
}

/// One little-endian component at the start of `bytes`, which are at least as long as it.
fn component(bytes: &[u8], kind: DataType, normalised: bool) -> f64 {
    let (value, largest) = match kind {
        DataType::I8 => (f64::from(bytes[0] as i8), f64::from(i8::MAX)),
        DataType::U8 => (f64::from(bytes[0]), f64::from(u8::MAX)),
        DataType::I16 => (
            f64::from(i16::from_le_bytes([bytes[0], bytes[1]])),
            f64::from(i16::MAX),
        ),
        DataType::U16 => (
            f64::from(u16::from_le_bytes([bytes[0], bytes[1]])),
            f64::from(u16::MAX),
        ),
        DataType::U32 => (
            f64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
            f64::from(u32::MAX),
        ),
        DataType::F32 => {
            return f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
        }
    };
    if normalised {
        (value / largest).max(-1.0)
    } else {
        value
    }
}
