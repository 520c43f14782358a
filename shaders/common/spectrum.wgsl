// What depends on wavelength. In a spectral scene a sample has one wavelength for each channel, drawn by the channel's
// response and the light that is expected: a row of a table that holds the water, the lights and the surfaces at these. All
// lights carry the weights of the wavelengths. Elsewhere the channels are as the scene says.
// Host: crates/render/src/prepare/spectrum.rs (makes the rows). Checked by: tests/system/spectral.rs.
import package::common::layout::{HAS_SPECTRUM, NONE, Spectrum, far_rows, scene};
import package::common::rng::leading;

/// Rows of a set of wavelengths: attenuation, scattering, what flights of either kind are drawn with, sun and sky relative
/// to their channels, light that is alike at all wavelengths, reflectances of the red, the green and the blue that a surface
/// is mixed of; then the lamps, relative to their channels, and the surfaces whose spectra are given.
const ATTENUATION: u32 = 0u;
const SCATTERING: u32 = 1u;
const LAMP_SIGMA: u32 = 2u;
const AMBIENT_SIGMA: u32 = 3u;
const SUN: u32 = 4u;
const SKY: u32 = 5u;
const EVEN: u32 = 6u;
const PRIMARIES: u32 = 7u;
const LAMPS: u32 = 10u;

/// Water at the wavelengths of the sample, 1/m.
struct Water {
    b: Spectrum,
    ln_b: Spectrum,
    c: Spectrum,
    lamp_sigma: Spectrum,
    lamp_ln_sigma: Spectrum,
    ambient_sigma: Spectrum,
}

var<private> water: Water;
/// The first row of the sample's wavelengths.
var<private> wavelengths: u32;

/// The number that the wavelengths of the sample whose numbers were started are chosen by; 0 where there is no choice.
fn wavelength_number() -> f32 {
    if HAS_SPECTRUM {
        return leading(7u);
    }
    return 0.0;
}

/// Chooses the wavelengths of a sample by a number in [0, 1).
fn choose_wavelengths(u: f32) {
    if HAS_SPECTRUM {
        let number = min(u32(u * f32(scene.wavelength_sets)), scene.wavelength_sets - 1u);
        wavelengths = scene.spectrum_table + number * scene.spectrum_rows;
        let b = spectral(SCATTERING);
        let sigma = spectral(LAMP_SIGMA);
        water = Water(b, ln_or_less(b), spectral(ATTENUATION), sigma, ln_or_less(sigma), spectral(AMBIENT_SIGMA));
    }
}

/// A row of the sample's wavelengths.
fn spectral(row: u32) -> Spectrum {
    return bitcast<vec4f>(far_rows[wavelengths + row]).xyz;
}

fn ln_or_less(v: Spectrum) -> Spectrum {
    return select(Spectrum(-1e30), log(max(v, Spectrum(1e-37))), v > Spectrum(0.0));
}

/// Scattering coefficient, 1/m.
fn water_b() -> Spectrum {
    if HAS_SPECTRUM {
        return water.b;
    }
    return scene.b;
}

fn water_ln_b() -> Spectrum {
    if HAS_SPECTRUM {
        return water.ln_b;
    }
    return scene.ln_b;
}

/// Attenuation coefficient, 1/m.
fn water_c() -> Spectrum {
    if HAS_SPECTRUM {
        return water.c;
    }
    return scene.c;
}

/// Coefficients of the free flights of walks that look for lamps, 1/m.
fn lamp_sigma() -> Spectrum {
    if HAS_SPECTRUM {
        return water.lamp_sigma;
    }
    return scene.lamp_sigma;
}

fn lamp_ln_sigma() -> Spectrum {
    if HAS_SPECTRUM {
        return water.lamp_ln_sigma;
    }
    return scene.lamp_ln_sigma;
}

/// The same of walks that look for daylight.
fn ambient_sigma() -> Spectrum {
    if HAS_SPECTRUM {
        return water.ambient_sigma;
    }
    return scene.ambient_sigma;
}

/// Irradiance of the sun just below the surface, W/m².
fn sun_irradiance() -> Spectrum {
    if HAS_SPECTRUM {
        return scene.sun_irradiance * spectral(SUN);
    }
    return scene.sun_irradiance;
}

fn sun_irradiance_in_air() -> Spectrum {
    if HAS_SPECTRUM {
        return scene.sun_irradiance_in_air * spectral(SUN);
    }
    return scene.sun_irradiance_in_air;
}

/// Radiance of the sky, W/(m² sr).
fn sky_radiance() -> Spectrum {
    if HAS_SPECTRUM {
        return scene.sky * spectral(SKY);
    }
    return scene.sky;
}

/// Intensity on the axis of lamp `i` whose channels are `intensity`, W/sr.
fn lamp_spectrum(i: u32, intensity: Spectrum) -> Spectrum {
    if HAS_SPECTRUM {
        return intensity * spectral(LAMPS + i);
    }
    return intensity;
}

/// Radiance of a surface that glows, W/(m² sr).
fn emission_at(radiance: Spectrum) -> Spectrum {
    if HAS_SPECTRUM {
        return radiance * spectral(EVEN);
    }
    return radiance;
}

/// Reflectance of a surface that is mixed of red, green and blue, or whose own spectrum is number `given`.
fn reflectance_at(rgb: Spectrum, given: u32) -> Spectrum {
    if !HAS_SPECTRUM {
        return rgb;
    }
    if given != NONE {
        return spectral(given);
    }
    return rgb.x * spectral(PRIMARIES) + rgb.y * spectral(PRIMARIES + 1u) + rgb.z * spectral(PRIMARIES + 2u);
}
