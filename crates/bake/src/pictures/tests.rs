use serde_json::json;

use super::{texels::*, *};
use crate::source::{Material, Primitive, Texture};

fn png(width: u32, height: u32, color: impl Fn(u32, u32) -> [u8; 4]) -> Image {
    let pixels = image::RgbaImage::from_fn(width, height, |x, y| image::Rgba(color(x, y)));
    let mut bytes = Vec::new();
    pixels.write_with_encoder(PngEncoder::new(&mut bytes)).unwrap();
    Image {
        ext: "png",
        media_type: "image/png",
        bytes,
    }
}

fn noise(x: u32, y: u32) -> [u8; 4] {
    let n = (x.wrapping_mul(0x9E37_79B9) ^ y.wrapping_mul(0x85EB_CA6B)).wrapping_mul(0xC2B2_AE35);
    let [r, g, b, _] = n.to_le_bytes();
    [r, g, b, 255]
}

fn decoded(bytes: &[u8]) -> image::RgbaImage {
    image::load_from_memory(bytes).unwrap().into_rgba8()
}

#[test]
fn each_size_is_half_the_one_before_down_to_the_smallest() {
    let picture = png(300, 129, noise);
    let ladder = ladder(&picture, Content::Color);
    assert_eq!(ladder.rungs[0], picture.bytes);
    let sizes: Vec<_> = ladder.rungs.iter().map(|rung| decoded(rung).dimensions()).collect();
    assert_eq!(sizes, [(300, 129), (150, 64), (75, 32), (37, 16)]);
    assert!(ladder.rungs.windows(2).all(|pair| pair[1].len() < pair[0].len()));
    assert_eq!(super::ladder(&picture, Content::Color), ladder);
}

#[test]
fn a_size_that_saves_nothing_is_left_out_and_ends_nothing() {
    // Noise that begins again as soon as its writer can tell; of three channels half as wide it does too late, a quarter as wide not.
    let pixels = image::GrayImage::from_fn(512, 512, |x, y| Luma([noise(x, y % 63)[0]]));
    let picture = Image {
        ext: "png",
        media_type: "image/png",
        bytes: super::png([512, 512], pixels.as_raw(), ExtendedColorType::L8),
    };
    let ladder = ladder(&picture, Content::Data);
    let sizes: Vec<_> = ladder.rungs.iter().map(|rung| decoded(rung).width()).collect();
    assert_eq!(sizes, [512, 512, 128, 64, 32]);
    assert_eq!(ladder.rungs[0], ladder.rungs[1]);
    assert!(ladder.rungs[1..].windows(2).all(|pair| pair[1].len() < pair[0].len()));
}

#[test]
fn colours_are_averaged_in_linear_light_and_data_as_they_stand() {
    let checks = png(128, 128, |x, y| {
        [if (x + y) % 2 == 0 { 255 } else { 0 }, noise(x, y)[1], 0, 255]
    });
    for (content, red) in [(Content::Color, 188), (Content::Data, 128)] {
        let half = decoded(&ladder(&checks, content).rungs[1]);
        assert!(
            half.pixels().all(|pixel| pixel.0[0] == red),
            "{content:?}: {:?}",
            half.get_pixel(3, 3)
        );
    }
}

#[test]
fn what_cannot_be_seen_has_the_colour_of_what_lies_beside_it() {
    let fence = png(128, 128, |x, y| {
        if x % 2 == 0 && x < 96 {
            [255, 0, noise(x, y)[2], 255]
        } else {
            [0, 255, 0, 0]
        }
    });
    for rung in &ladder(&fence, Content::Cutout).rungs[1..] {
        let rung = decoded(rung);
        let seen = rung.width() * 3 / 4;
        assert!(rung.enumerate_pixels().all(|(x, _, pixel)| {
            let [red, green, _, alpha] = pixel.0;
            red == 255 && green == 0 && alpha == if x < seen { 128 } else { 0 }
        }));
    }
    let nothing = png(64, 64, |x, y| [noise(x, y)[0], 255, 0, 0]);
    assert!(
        decoded(&ladder(&nothing, Content::Cutout).rungs[1])
            .pixels()
            .all(|p| p.0 == [0; 4])
    );
}

#[test]
fn what_alpha_does_not_hide_keeps_its_colours() {
    let paint = png(128, 128, |x, y| [200, 100, noise(x, y)[2], if x < 64 { 0 } else { 9 }]);
    for rung in &ladder(&paint, Content::Color).rungs[1..] {
        let rung = decoded(rung);
        let half = rung.width() / 2;
        assert!(rung.enumerate_pixels().all(|(x, _, pixel)| {
            let [red, green, blue, alpha] = pixel.0;
            (red, green) == (200, 100) && blue > 0 && alpha == if x < half { 0 } else { 9 }
        }));
    }
    let seen = small(&paint, Content::Color, 32).unwrap();
    assert!(
        seen.pixels()
            .all(|pixel| (srgb(pixel.0[0]) * 255.0 - 200.0).abs() < 0.5)
    );
}

#[test]
fn only_base_colours_that_are_masked_or_blended_are_weighted_by_alpha() {
    let textures = [0, 1, 2, 3].map(|image| Texture { image, sampler: None });
    let of = |mode: &str, base: usize| {
        let glossy = json!({"diffuseTexture": {"index": base}, "specularGlossinessTexture": {"index": 3}});
        material(
            json!({"alphaMode": mode, "pbrMetallicRoughness": {"baseColorTexture": {"index": base}},
            "emissiveTexture": {"index": 2}, "extensions": {"KHR_materials_pbrSpecularGlossiness": glossy}}),
        )
    };
    let [cutout, colour] = [Content::Cutout, Content::Color];
    for (materials, found) in [
        (vec![of("MASK", 0), of("BLEND", 1)], [cutout, cutout, colour, colour]),
        (vec![of("OPAQUE", 0), of("BLEND", 1)], [colour, cutout, colour, colour]),
        (
            vec![of("MASK", 0), of("OPAQUE", 0)],
            [colour, Content::Data, colour, colour],
        ),
    ] {
        assert_eq!(contents(&materials, &textures, 4), found);
    }
}

#[test]
fn what_is_not_decoded_has_one_size_and_what_cannot_be_is_not_published() {
    let mut broken = png(256, 256, noise);
    broken.bytes.truncate(1000);
    let other = Image {
        ext: "ktx2",
        ..broken.clone()
    };
    let as_it_came = ladder(&other, Content::Color);
    assert_eq!((as_it_came.size_px, as_it_came.rungs), (None, vec![other.bytes]));
    for (ext, format) in [("png", ImageFormat::Png), ("jpg", ImageFormat::Jpeg)] {
        let ladder = ladder(&Image { ext, ..broken.clone() }, Content::Color);
        let [rung] = ladder.rungs.as_slice() else {
            panic!("{} sizes", ladder.rungs.len())
        };
        assert_eq!(image::guess_format(rung).unwrap(), format);
        assert_eq!((ladder.size_px, decoded(rung).dimensions()), (None, (1, 1)));
    }
}

#[test]
fn a_picture_with_a_side_that_is_too_long_is_published_half_as_large() {
    let long = png(2 * LARGEST_PX - 1, 1, |x, _| {
        [if x < LARGEST_PX { 255 } else { 0 }, 9, 9, 255]
    });
    let high = png(1, LARGEST_PX + 300, |_, y| [(y / 2 % 200) as u8, 9, 9, 255]);
    for (picture, size) in [(&long, [LARGEST_PX - 1, 1]), (&high, [1, LARGEST_PX / 2 + 150])] {
        let ladder = ladder(picture, Content::Data);
        assert_eq!(ladder.size_px, Some(size));
        assert_eq!(<[u32; 2]>::from(decoded(&ladder.rungs[0]).dimensions()), size);
    }
    let rows = decoded(&ladder(&high, Content::Data).rungs[0]);
    assert!(
        rows.enumerate_pixels()
            .all(|(_, y, pixel)| u32::from(pixel.0[0]) == y % 200)
    );
}

fn material(gltf: serde_json::Value) -> Material {
    Material {
        gltf,
        see_through: false,
        double_sided: false,
    }
}

#[test]
fn the_length_that_a_picture_covers_is_that_of_its_most_stretched_use() {
    let square = |side: f32, uv: f32| Primitive {
        material: Some(0),
        positions: vec![[0.0, 0.0, 0.0], [side, 0.0, 0.0], [side, side, 0.0], [0.0, side, 0.0]],
        uvs: vec![vec![[0.0, 0.0], [uv, 0.0], [uv, uv], [0.0, uv]]],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Primitive::default()
    };
    let textures = [0, 1].map(|image| Texture { image, sampler: None });
    let scaled = json!({"index": 1, "extensions": {"KHR_texture_transform": {"scale": [4, 4]}}});
    let materials = [material(
        json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "normalTexture": scaled}),
    )];
    let found = covered(&[square(8.0, 2.0), square(6.0, 1.0)], &materials, &textures);
    let found: Vec<_> = found
        .into_iter()
        .map(|(image, lengths)| (image, lengths.to_array()))
        .collect();
    assert_eq!(found, [(0, [6.0; 2]), (1, [1.5; 2])]);
    assert_eq!(
        contents(&materials, &textures, 3),
        [Content::Color, Content::Data, Content::Data]
    );
    let flat = Primitive {
        uvs: vec![vec![[0.5, 0.5]; 4]],
        ..square(8.0, 1.0)
    };
    assert!(covered(&[flat], &materials, &textures).is_empty());
}

#[test]
fn each_side_of_a_picture_covers_a_length_of_its_own() {
    let sheet = |uvs: [[f32; 2]; 4]| Primitive {
        material: Some(0),
        positions: vec![[0.0, 0.0, 0.0], [6.0, 0.0, 0.0], [6.0, 2.0, 0.0], [0.0, 2.0, 0.0]],
        uvs: vec![uvs.to_vec()],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Primitive::default()
    };
    let textures = [Texture {
        image: 0,
        sampler: None,
    }];
    let lengths = |transform: serde_json::Value, uvs| {
        let texture = json!({"index": 0, "extensions": {"KHR_texture_transform": transform}});
        let materials = [material(json!({"pbrMetallicRoughness": {"baseColorTexture": texture}}))];
        covered(&[sheet(uvs)], &materials, &textures)[&0]
            .to_array()
            .map(|x| (1e6 * x).round() / 1e6)
    };
    let whole = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    assert_eq!(lengths(json!({}), whole), [6.0, 2.0]);
    assert_eq!(lengths(json!({"scale": [2, 0.5]}), whole), [3.0, 4.0]);
    let quarter = std::f64::consts::FRAC_PI_2;
    assert_eq!(
        lengths(json!({"scale": [2, 1], "rotation": quarter}), whole),
        [2.0, 3.0]
    );
    // Along a side that changes nothing, no pixels are needed.
    let [along, up] = lengths(json!({}), whole.map(|[u, _]| [u, 0.5]));
    assert!((6.0..6.4).contains(&along) && up == 0.0, "{along} {up}");
    // Nearly all of the picture lies outside of what shows its diagonal.
    let diagonal = [[0.0, 0.0], [1.0, 0.99], [1.0, 1.0], [0.0, 0.01]];
    let [along, up] = lengths(json!({}), diagonal);
    assert!((6.0..6.4).contains(&along) && (6.0..6.4).contains(&up), "{along} {up}");
}
