//! Numbers out of glTF accessors, with every offset checked against its buffer.

use super::gltf_json::Accessor;
use super::gltf_resource::{GltfError, GltfSource};

/// Most elements of one accessor.
const MAX_COUNT: usize = 1 << 28;

/// What the components of an accessor are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    /// The kind that the file's code stands for.
    fn of(code: u64) -> Option<Self> {
        match code {
            5120 => Some(Self::I8),
            5121 => Some(Self::U8),
            5122 => Some(Self::I16),
            5123 => Some(Self::U16),
            5125 => Some(Self::U32),
            5126 => Some(Self::F32),
            _ => None,
        }
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

/// What vertices may consist of: with KHR_mesh_quantization all short numbers.
pub(super) const OF_VERTICES: &[Component] = &[
    Component::F32,
    Component::I8,
    Component::U8,
    Component::I16,
    Component::U16,
];
/// What indices may consist of.
pub(super) const OF_INDICES: &[Component] = &[Component::U8, Component::U16, Component::U32];

/// Reads all elements of an accessor, by its index, of `N` components each; normalised integers become fractions.
/// `place` names the accessor's role in errors, `allowed` what its components may be.
pub(super) fn read<const N: usize>(
    source: &GltfSource,
    index: usize,
    allowed: &[Component],
    place: &str,
) -> Result<Vec<[f64; N]>, GltfError> {
    let item = format!("{place} (accessor {index})");
    let accessor = &source.document.accessors[index];
    let refuse = |reason: String| source.resource(&item, reason);
    if components(&accessor.shape) != Some(N) {
        return Err(refuse(format!(
            "must have {N} components per element, got type {:?}",
            accessor.shape
        )));
    }
    let kind = Component::of(accessor.component_type).filter(|kind| allowed.contains(kind));
    let Some(kind) = kind else {
        return Err(refuse(format!(
            "must have a componentType of {allowed:?}, got {}",
            accessor.component_type
        )));
    };
    if accessor.count > MAX_COUNT {
        return Err(refuse(format!(
            "must have at most {MAX_COUNT} elements, got {}",
            accessor.count
        )));
    }
    let reader = Reader {
        source,
        accessor,
        kind,
        item: &item,
    };
    let mut elements = match accessor.buffer_view {
        Some(view) => {
            let size = kind.size() * N;
            let stride = source.document.buffer_views[view].byte_stride;
            let stride = stride.unwrap_or(size);
            reader.elements(view, accessor.byte_offset, accessor.count, stride)?
        }
        None => vec![[0.0; N]; accessor.count],
    };
    reader.apply_sparse(&mut elements)?;
    Ok(elements)
}

/// Components of an element; `None` for matrices, which no vertex has.
fn components(shape: &str) -> Option<usize> {
    match shape {
        "SCALAR" => Some(1),
        "VEC2" => Some(2),
        "VEC3" => Some(3),
        "VEC4" => Some(4),
        _ => None,
    }
}

struct Reader<'a> {
    source: &'a GltfSource,
    accessor: &'a Accessor,
    kind: Component,
    item: &'a str,
}

impl Reader<'_> {
    /// `count` elements of a buffer view from `offset` on, one every `stride` bytes.
    fn elements<const N: usize>(
        &self,
        view: usize,
        offset: usize,
        count: usize,
        stride: usize,
    ) -> Result<Vec<[f64; N]>, GltfError> {
        let (kind, normalised) = (self.kind, self.accessor.normalized);
        let bytes = self.strided(view, offset, count, stride, kind.size() * N)?;
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
        view: usize,
        offset: usize,
        count: usize,
        stride: usize,
        size: usize,
    ) -> Result<&[u8], GltfError> {
        let bytes = self.source.view_bytes(view);
        let bytes = bytes.map_err(|reason| self.source.resource(self.item, reason))?;
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
                &format!("buffer view {view} of {} bytes", bytes.len()),
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

    /// Replaces the elements that the sparse part, if there is one, lists.
    fn apply_sparse<const N: usize>(&self, elements: &mut [[f64; N]]) -> Result<(), GltfError> {
        let Some(sparse) = &self.accessor.sparse else {
            return Ok(());
        };
        let (indices, values, count) = (&sparse.indices, &sparse.values, sparse.count);
        let kind = Component::of(indices.component_type).filter(|kind| OF_INDICES.contains(kind));
        let kind = kind.ok_or_else(|| {
            let reason = format!(
                "sparse indices must have a componentType of {OF_INDICES:?}, got {}",
                indices.component_type
            );
            self.source.resource(self.item, reason)
        })?;
        let size = kind.size();
        let index_bytes =
            self.strided(indices.buffer_view, indices.byte_offset, count, size, size)?;
        let packed = self.kind.size() * N;
        let values: Vec<[f64; N]> =
            self.elements(values.buffer_view, values.byte_offset, count, packed)?;
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
fn component(bytes: &[u8], kind: Component, normalised: bool) -> f64 {
    let (value, largest) = match kind {
        Component::I8 => (f64::from(bytes[0] as i8), f64::from(i8::MAX)),
        Component::U8 => (f64::from(bytes[0]), f64::from(u8::MAX)),
        Component::I16 => (
            f64::from(i16::from_le_bytes([bytes[0], bytes[1]])),
            f64::from(i16::MAX),
        ),
        Component::U16 => (
            f64::from(u16::from_le_bytes([bytes[0], bytes[1]])),
            f64::from(u16::MAX),
        ),
        Component::U32 => (
            f64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
            f64::from(u32::MAX),
        ),
        Component::F32 => {
            return f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
        }
    };
    if normalised {
        (value / largest).max(-1.0)
    } else {
        value
    }
}
