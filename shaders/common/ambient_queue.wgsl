// Samples of a lane that wait for their walks: what they look at and their first numbers, which all lanes make
// together, so that each can start its next one at once. In the scratch buffer beyond the stack.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::camera::eye;
import package::common::film::lane;
import package::common::layout::{HAS_OPENING, HAS_PORT, dispatch, scratch};
import package::common::rng::{leading, leading_bits};
import package::common::spectrum::{choose_wavelengths, wavelength_number};

/// Rows of a sample where all look from one point, and where not; host: crates/render/src/kernels/layout.rs.
const QUEUED_ROWS: u32 = 3u;
const QUEUED_ROWS_WITH_ORIGIN: u32 = 4u;

/// The numbers of a walk's first choices: its strategy, its flight, the direction in which it goes on, its wavelengths.
struct First {
    chooser: f32,
    flight: f32,
    bits: u32,
    v: f32,
    wavelengths: f32,
}

/// Those of the sample at work.
var<private> numbers: First;

/// The leading numbers of the stream that was started.
fn first_numbers() -> First {
    return First(leading(6u), leading(2u), leading_bits(3u), leading(4u), wavelength_number());
}

fn queue_row(slot: u32, row: u32) -> u32 {
    let rows = select(QUEUED_ROWS, QUEUED_ROWS_WITH_ORIGIN, HAS_PORT || HAS_OPENING);
    return (3u * dispatch.slots + rows * slot + row) * dispatch.lanes + lane;
}

/// Keeps a sample at a slot below `dispatch.queued`: where it looks from, and its direction with the factor of its light.
fn enqueue(slot: u32, origin: vec3f, direction: vec4f, first: First) {
    scratch[queue_row(slot, 0u)] = direction;
    // Halves of the bits as floats: bit patterns that are no number might not survive.
    scratch[queue_row(slot, 1u)] = vec4f(first.chooser, first.flight, f32(first.bits & 0xffffu), f32(first.bits >> 16u));
    scratch[queue_row(slot, 2u)] = vec4f(first.v, first.wavelengths, 0.0, 0.0);
    if HAS_PORT || HAS_OPENING {
        scratch[queue_row(slot, 3u)] = vec4f(origin, 0.0);
    }
}

/// Where a sample looks from.
fn origin_of(slot: u32) -> vec3f {
    if HAS_PORT || HAS_OPENING {
        return scratch[queue_row(slot, 3u)].xyz;
    }
    return eye();
}

/// Direction and factor of a sample, whose numbers become those of the sample at work.
fn dequeue(slot: u32) -> vec4f {
    let a = scratch[queue_row(slot, 1u)];
    let b = scratch[queue_row(slot, 2u)];
    numbers = First(a.x, a.y, u32(a.z) | (u32(a.w) << 16u), b.x, b.y);
    choose_wavelengths(b.y);
    return scratch[queue_row(slot, 0u)];
}
