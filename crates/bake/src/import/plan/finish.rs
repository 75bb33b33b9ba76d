//! What is a surface made of? Finishes, written as glTF 2.0 materials.

use crate::source::Material;
use serde_json::json;

/// A colour as people write it: sRGB, each channel 0..=255.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rgb(pub [u8; 3]);

impl Rgb {
    /// From `0xrrggbb`.
    #[must_use]
    pub const fn hex(value: u32) -> Self {
        Self([(value >> 16) as u8, (value >> 8) as u8, value as u8])
    }

    /// Linear light, each channel in 0..=1 (IEC 61966-2-1).
    #[must_use]
    pub fn linear(self) -> [f32; 3] {
        self.0.map(|c| {
            let c = f32::from(c) / 255.0;
            let linear = if c <= 0.04045 {
                c / 12.92
            } else {
                ((c + 0.055) / 1.055).powf(2.4)
            };
            (linear * 1e4).round() / 1e4
        })
    }
}

/// A material of the metallic-roughness model.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Finish {
    name: &'static str,
    colour: Rgb,
    roughness: f32,
    metallic: f32,
    opacity: f32,
    glow: f32,
    double_sided: bool,
}

impl Finish {
    /// A dull, opaque surface.
    pub(super) const fn matt(name: &'static str, colour: u32) -> Self {
        Self {
            name,
            colour: Rgb::hex(colour),
            roughness: 0.85,
            metallic: 0.0,
            opacity: 1.0,
            glow: 0.0,
            double_sided: false,
        }
    }

    pub(super) const fn gloss(mut self, roughness: f32) -> Self {
        self.roughness = roughness;
        self
    }

    pub(super) const fn metal(mut self, roughness: f32) -> Self {
        self.metallic = 0.6;
        self.roughness = roughness;
        self
    }

    pub(super) const fn glass(mut self, opacity: f32) -> Self {
        self.opacity = opacity;
        self.roughness = 0.05;
        self
    }

    /// Gives off light of its colour, times `strength`.
    pub(super) const fn glow(mut self, strength: f32) -> Self {
        self.glow = strength;
        self
    }

    pub(super) const fn double_sided(mut self) -> Self {
        self.double_sided = true;
        self
    }

    pub(super) const fn dyed(mut self, colour: Option<Rgb>) -> Self {
        if let Some(colour) = colour {
            self.colour = colour;
        }
        self
    }

    fn material(&self) -> Material {
        let [r, g, b] = self.colour.linear();
        let round = |v: f32| (f64::from(v) * 1e4).round() / 1e4;
        let mut gltf = json!({
            "name": self.name,
            "pbrMetallicRoughness": {
                "baseColorFactor": [round(r), round(g), round(b), round(self.opacity)],
                "metallicFactor": round(self.metallic),
                "roughnessFactor": round(self.roughness),
            },
        });
        if self.glow > 0.0 {
            gltf["emissiveFactor"] = json!([r, g, b].map(|c| round((c * self.glow).min(1.0))));
        }
        if self.opacity < 1.0 {
            gltf["alphaMode"] = json!("BLEND");
        }
        if self.double_sided {
            gltf["doubleSided"] = json!(true);
        }
        Material {
            gltf,
            see_through: self.opacity < 1.0,
            double_sided: self.double_sided,
        }
    }
}

pub(super) const MARBLE: Finish = Finish::matt("marble", 0xe9e4da).gloss(0.35);
pub(super) const LIMESTONE: Finish = Finish::matt("limestone", 0xd2c3a3).gloss(0.8);
pub(super) const GRANITE: Finish = Finish::matt("granite", 0x5a5654).gloss(0.5);
pub(super) const CLAY: Finish = Finish::matt("clay", 0xb4623a).gloss(0.7);
pub(super) const BRONZE: Finish = Finish::matt("bronze", 0x9a6b3c).metal(0.38);
pub(super) const GOLD: Finish = Finish::matt("gilding", 0xd9a941).metal(0.32);
pub(super) const STEEL: Finish = Finish::matt("steel", 0xb8bcc2).metal(0.3);
pub(super) const IRON: Finish = Finish::matt("iron", 0x2d2e31).gloss(0.5);
pub(super) const WALNUT: Finish = Finish::matt("walnut", 0x5a3a24).gloss(0.55);
pub(super) const OAK: Finish = Finish::matt("oak", 0xa87945).gloss(0.6);
pub(super) const LINEN: Finish = Finish::matt("linen", 0xe8e2d4);
pub(super) const LEATHER: Finish = Finish::matt("leather", 0x6d2f22).gloss(0.5);
pub(super) const GLASS: Finish = Finish::matt("glass", 0xdcecf0).glass(0.16);
pub(super) const BONE: Finish = Finish::matt("bone", 0xd9c9a3).gloss(0.65);
pub(super) const LAMPLIGHT: Finish = Finish::matt("lamplight", 0xffe3b0).glow(1.0);
pub(super) const WATER: Finish = Finish::matt("water", 0x4f93a0).glass(0.7);
/// White, to be coloured by vertices.
pub(super) const PAINT: Finish = Finish::matt("paint", 0xffffff).gloss(0.75);
pub(super) const CLOTH: Finish = Finish::matt("woven cloth", 0xffffff).gloss(0.95).double_sided();
pub(super) const LEAF: Finish = Finish::matt("leaves", 0xffffff).gloss(0.6).double_sided();

/// Every finish that a scene uses, once.
#[derive(Debug, Default)]
pub(super) struct Palette(Vec<Finish>);

impl Palette {
    pub(super) fn index(&mut self, finish: &Finish) -> usize {
        match self.0.iter().position(|known| known == finish) {
            Some(at) => at,
            None => {
                self.0.push(finish.clone());
                self.0.len() - 1
            }
        }
    }

    pub(super) fn into_materials(self) -> Vec<Material> {
        self.0.iter().map(Finish::material).collect()
    }
}
