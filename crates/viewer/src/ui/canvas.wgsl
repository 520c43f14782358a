// The picture on its part of the window: a triangle that covers it, and one look at the texture for a pixel.

/// The part of the picture that is seen, in [0, 1] from its upper left corner.
struct Part {
    low: vec2f,
    size: vec2f,
}

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var between: sampler;
@group(0) @binding(2) var<uniform> part: Part;

/// Whether the window's pixels take linear values and encode them as sRGB themselves.
override ENCODES: bool = false;

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) place: vec2f,
}

@vertex
fn corner(@builtin(vertex_index) index: u32) -> Corner {
    let place = vec2f(f32((index << 1u) & 2u), f32(index & 2u));
    return Corner(vec4f(2.0 * place.x - 1.0, 1.0 - 2.0 * place.y, 0.0, 1.0), part.low + place * part.size);
}

@fragment
fn colour(in: Corner) -> @location(0) vec4f {
    let shown = textureSample(picture, between, in.place).rgb;
    if !ENCODES {
        return vec4f(shown, 1.0);
    }
    let above = pow((shown + 0.055) / 1.055, vec3f(2.4));
    return vec4f(select(above, shown / 12.92, shown <= vec3f(0.04045)), 1.0);
}
