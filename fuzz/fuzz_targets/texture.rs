//! Picture files as textures: what is read is inside [0, 1].
#![no_main]

use libfuzzer_sys::fuzz_target;
use uw_render::scene::{Encoding, Texture, TextureFilter};

fuzz_target!(|bytes: &[u8]| {
    let path = uw_fuzz::as_file("fuzz.png", bytes);
    if let Ok(texture) = Texture::read(&path, Encoding::Srgb, TextureFilter::Bilinear) {
        let value = texture.sample(0.3, 0.7);
        assert!(value.iter().all(|value| (0.0..=1.0).contains(value)), "{value:?}");
    }
});
