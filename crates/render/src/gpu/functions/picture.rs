//! The held film and the picture of it, against the host's film and sensor.

use super::{SEED, adapter, scene_with};
use crate::{
    film::{Film, FilmLayer},
    gpu::{AdapterChoice, AdapterStepper, Gpu, Look, held::Held},
    image::{Counts, Picture},
    integrator::{Plan, Progress},
    layers,
    prepare::Prepared,
    scene::{Encoding, Exposure, Noise, Sensor},
};

/// Bytes of a row of a copied texture are a multiple of this.
const ROW_BYTES: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT;
/// Channels as they are, and mixed.
const PLAIN: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const MIXED: [[f64; 3]; 3] = [[1.6, -0.5, -0.1], [0.0, 0.9, 0.0], [0.1, -0.2, 1.1]];
/// Samples of the batches.
const BATCHES: [u32; 4] = [1, 1, 2, 4];

/// A render by steps, which goes on as long as it is asked to.
pub(super) fn plan() -> Plan {
    Plan {
        dark_lamps: true,
        ..Plan::new(SEED)
    }
}

/// The red, green and blue bytes of a texture, row by row.
fn bytes_of(gpu: &Gpu, texture: &wgpu::Texture) -> Vec<[u8; 3]> {
    let (width, height) = (texture.width(), texture.height());
    let row = (4 * width).next_multiple_of(ROW_BYTES);
    let staging = gpu.readable(u64::from(row) * u64::from(height));
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &staging,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(row),
                rows_per_image: None,
            },
        },
        texture.size(),
    );
    gpu.queue.submit([encoder.finish()]);
    let bytes: Vec<u8> = gpu.read(&staging).expect("comes back");
    let rows = bytes.chunks_exact(row as usize);
    rows.flat_map(|row| row[..4 * width as usize].chunks_exact(4))
        .map(|pixel| {
            assert_eq!(pixel[3], 255, "a picture is opaque");
            [pixel[0], pixel[1], pixel[2]]
        })
        .collect()
}

/// What the host shows of a picture.
fn expected(picture: &Picture, look: &Look) -> Vec<[u8; 3]> {
    let sensor = Sensor {
        exposure: Exposure::Fixed(look.exposure),
        encoding: look.encoding,
        bits: look.bits,
        noise: look.noise,
        color_matrix: look.colours,
        ..Sensor::default()
    };
    let bytes: Vec<u8> = match sensor.expose(picture, look.noise_seed).counts {
        Counts::Bits8(counts) => counts,
        Counts::Bits16(counts) => counts.iter().map(|count| (count / 257) as u8).collect(),
    };
    let pixels = bytes.chunks_exact(3);
    pixels.map(|p| [p[0], p[1], p[2]]).collect()
}

/// Radiances from 0 over both branches of the encoding and all counts to far beyond white.
fn radiances(pixels: usize) -> Vec<[f32; 3]> {
    let at = |i: usize| match i % 4 {
        0 => i as f32 / pixels as f32,
        1 => 10f32.powf(-8.0 + 12.0 * i as f32 / pixels as f32),
        2 => 0.0031308 * (0.9 + 0.2 * i as f32 / pixels as f32),
        _ => 1.1 * (1.0 - i as f32 / pixels as f32),
    };
    (0..pixels)
        .map(|i| [at(i), at(i + 1), if i == 0 { 0.0 } else { at(i + 2) }])
        .collect()
}

#[test]
fn the_texture_holds_what_the_host_would_show() {
    let Some(gpu) = adapter() else { return };
    let [width, height] = [67, 61];
    // Never read: the film is written by hand.
    let unused = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: 16,
        usage: wgpu::BufferUsages::STORAGE,
        mapped_at_creation: false,
    });
    let held = Held::new(gpu, [width, height], &unused, &[]).expect("fits");
    let data = radiances((width * height) as usize);
    gpu.queue
        .write_buffer(&held.film, 0, bytemuck::cast_slice(&data));
    let picture = Picture {
        data,
        ..Picture::black(width, height)
    };
    let texture = gpu.texture([width, height]).expect("fits");
    for encoding in [Encoding::Linear, Encoding::Srgb] {
        for (bits, exposure, noise) in [
            (8, 1.0, None),
            (16, 1.0, None),
            (8, 0.37, None),
            (16, 41.0, None),
            (8, 1.0, Some(Noise { a: 1e-3, b: 1e-5 })),
            (16, 0.7, Some(Noise { a: 0.01, b: 0.04 })),
        ] {
            let look = Look {
                exposure,
                colours: if bits == 8 { PLAIN } else { MIXED },
                encoding,
                bits,
                noise,
                noise_seed: SEED,
            };
            held.show(&look, &texture).expect("shown");
            let shown = bytes_of(gpu, &texture);
            let twins = expected(&picture, &look);
            for ((got, twin), radiance) in shown.iter().zip(&twins).zip(&picture.data) {
                let off = (0..3).map(|k| got[k].abs_diff(twin[k])).max();
                assert!(
                    off <= Some(1),
                    "{look:?} at {radiance:?}: {got:?} instead of {twin:?}"
                );
            }
            // Rounding differs at the edges between counts and nowhere else.
            let different = shown.iter().zip(&twins).filter(|(a, b)| a != b).count();
            assert!(different * 50 < shown.len(), "{look:?}: {different} pixels");
        }
    }
}

/// The film of the same batches, added up by the host.
fn added_by_host(gpu: &Gpu, scene: &Prepared, plan: &Plan) -> Film {
    let go_on = std::sync::atomic::AtomicBool::new(false);
    let unobserved = |_: &Progress| {};
    let mut job = crate::gpu::render::Batches::new(gpu, scene, plan, &go_on, &unobserved, &|t| t)
        .expect("fits");
    let mut film = Film::new(scene.camera.width, scene.camera.height, scene.lamps.len());
    for (batch, samples) in (0..).zip(BATCHES) {
        assert!(job.make_batch(batch, samples, &|| false).expect("runs"));
        let rows = film.rows.len();
        job.add_to(&mut film, rows, samples).expect("comes back");
    }
    film
}

#[test]
fn the_held_film_is_the_hosts() {
    let Some(gpu) = adapter() else { return };
    let scene = scene_with("[sky]\nradiance = [0.1, 0.2, 0.3]\n");
    let plan = plan();
    let mut stepper = AdapterStepper::new(gpu, &scene, &plan).expect("fits");
    assert!(!stepper.step(1, &|| true).expect("runs"), "it was stopped");
    for samples in BATCHES {
        assert!(stepper.step(samples, &|| false).expect("runs"));
    }
    let (held, host) = (
        stepper.film().expect("comes back"),
        added_by_host(gpu, &scene, &plan),
    );
    assert_eq!((held.samples(), stepper.samples()), (8, 8));
    let lamps = (0..scene.lamps.len()).map(FilmLayer::Lamp);
    let layers: Vec<_> = [
        FilmLayer::Total,
        FilmLayer::Ambient,
        FilmLayer::Direct,
        FilmLayer::Backscatter,
        FilmLayer::Variance,
    ]
    .into_iter()
    .chain(lamps)
    .collect();
    for layer in layers {
        let (held, host) = (held.layer(layer), host.layer(layer));
        let scale = host.iter().flatten().fold(0.0_f64, |most, x| most.max(*x));
        assert!(scale > 0.0 || layer == FilmLayer::Backscatter, "{layer:?}");
        for (a, b) in held.iter().flatten().zip(host.iter().flatten()) {
            // Means and squares in f32: some 1e-7 of each, and dispatches of other sizes add in another order.
            let within = 2e-5 * b.abs() + 1e-7 * scale;
            assert!((a - b).abs() <= within, "{layer:?}: {a} {b}");
        }
    }
    let radiance = stepper.radiance().expect("comes back");
    for (a, b) in radiance.iter().zip(held.layer(FilmLayer::Total)) {
        assert_eq!(*a, b.map(|x| x as f32));
    }
    let statistics = stepper.statistics().expect("comes back");
    for (a, b) in statistics.mean.iter().zip(host.mean()) {
        assert!((a / b - 1.0).abs() < 1e-5, "{a} {b}");
    }
    let (a, b) = (statistics.relative_error, host.relative_error());
    let (a, b) = (a.expect("known"), b.expect("known"));
    assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");

    let texture = gpu.texture([64, 64]).expect("fits");
    let look = Look {
        exposure: 3.0,
        colours: PLAIN,
        encoding: Encoding::Srgb,
        bits: 8,
        noise: None,
        noise_seed: 0,
    };
    stepper.show(&look, &texture).expect("shown");
    let shown = bytes_of(gpu, &texture);
    for (got, twin) in shown.iter().zip(expected(&layers::picture(&host), &look)) {
        assert!(
            (0..3).all(|k| got[k].abs_diff(twin[k]) <= 1),
            "{got:?} {twin:?}"
        );
    }
}

#[test]
fn a_device_of_a_window_serves_where_its_limits_allow_and_its_loss_is_told() {
    if adapter().is_none() {
        return;
    }
    let adapters = crate::gpu::device::found();
    let (_, window) = adapters.first().expect("there is one");
    let open = |limits: wgpu::Limits| {
        let request = window.request_device(&wgpu::DeviceDescriptor {
            required_limits: limits,
            ..Default::default()
        });
        let (device, queue) = pollster::block_on(request).expect("a device");
        (device.clone(), Gpu::from_parts(window, device, queue))
    };
    let (_, refused) = open(wgpu::Limits {
        max_storage_buffers_per_shader_stage: 7,
        ..Default::default()
    });
    let message = refused.map(|_| ()).expect_err("too low").to_string();
    assert!(
        message.contains("max_storage_buffers_per_shader_stage = 8"),
        "{message}"
    );
    let (device, gpu) = open(Gpu::required_limits(window).expect("it can"));
    let gpu = gpu.expect("serves");
    let own = Gpu::open(AdapterChoice::Best).expect("opens");
    assert!(gpu.is_shared() && !own.is_shared());
    assert!(gpu.fault().is_none());
    let (scene, plan) = (scene_with(""), plan());
    let mut stepper = AdapterStepper::new(&gpu, &scene, &plan).expect("fits");
    assert!(stepper.step(1, &|| false).expect("runs"));
    device.destroy();
    assert!(stepper.step(1, &|| false).is_err());
    assert!(stepper.statistics().is_err());
    assert!(stepper.film().is_err());
    assert!(gpu.fault().is_some());
    assert!(gpu.texture([8, 8]).is_err());
}
