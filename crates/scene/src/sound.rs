//! What must hold of a model beyond the grammar of its document, so that nobody who computes with it has to doubt it? Sizes that add up,
//! levels that lie in their packs, rungs that are their stream. The same holds for the viewer (`viewer/core/documents/modeldocument.ts`).
//! Fields are read with [`read`], so that no reader can forget it.

use std::{collections::BTreeMap, fmt};

use serde::{
    Deserialize, Deserializer,
    de::{Error, MapAccess, Visitor},
};

use crate::{
    ModelId,
    impostor::Impostor,
    object::{Level, Model, Procedural, TextureRef},
    rung::{RungName, SLOD, SmoothLod},
};

/// Every reader of JSON knows whole numbers up to this.
const MOST: u64 = (1 << 53) - 1;

/// Something of which more must hold than its types say.
pub(crate) trait Sound {
    /// Where it does not: which field should be what.
    fn check(&self) -> Result<(), String>;
}

/// Reads what is sound.
pub(crate) fn read<'de, D: Deserializer<'de>, T: Deserialize<'de> + Sound>(deserializer: D) -> Result<T, D::Error> {
    let read = T::deserialize(deserializer)?;
    read.check().map_err(D::Error::custom)?;
    Ok(read)
}

/// Reads the levels of a model, which are never none.
pub(crate) fn read_levels<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Level>, D::Error> {
    let levels: Vec<Level> = read(deserializer)?;
    match levels.is_empty() {
        true => Err(D::Error::custom("levels should be a list with at least one level")),
        false => Ok(levels),
    }
}

/// Reads models; what is wrong with one is told with its id.
pub(crate) fn read_models<'de, D: Deserializer<'de>>(deserializer: D) -> Result<BTreeMap<ModelId, Model>, D::Error> {
    struct Models;

    impl<'de> Visitor<'de> for Models {
        type Value = BTreeMap<ModelId, Model>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("models by id")
        }

        fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
            let mut models = BTreeMap::new();
            while let Some(id) = map.next_key::<ModelId>()? {
                let model = map
                    .next_value()
                    .map_err(|cause| A::Error::custom(format_args!("{id}: {cause}")))?;
                models.insert(id, model);
            }
            Ok(models)
        }
    }

    deserializer.deserialize_map(Models)
}

impl<T: Sound> Sound for Option<T> {
    fn check(&self) -> Result<(), String> {
        self.as_ref().map_or(Ok(()), T::check)
    }
}

fn count(field: fmt::Arguments<'_>, number: u64) -> Result<(), String> {
    match number <= MOST {
        true => Ok(()),
        false => Err(format!("{field} should be a count up to {MOST}")),
    }
}

fn textures(of: fmt::Arguments<'_>, textures: &[TextureRef]) -> Result<(), String> {
    let mut textures = textures.iter().enumerate();
    textures.try_for_each(|(i, texture)| count(format_args!("{of}.textures[{i}].bytes"), texture.bytes))
}

impl Sound for Vec<Level> {
    fn check(&self) -> Result<(), String> {
        for (i, level) in self.iter().enumerate() {
            if level.level as usize != i {
                return Err("levels should be numbered from 0, finest first".to_owned());
            }
            count(format_args!("levels[{i}].bytes"), level.bytes)?;
            count(format_args!("levels[{i}].triangles"), level.triangles)?;
            textures(format_args!("levels[{i}]"), &level.textures)?;
            if let Some(pack) = &level.pack {
                count(format_args!("levels[{i}].pack.bytes"), pack.bytes)?;
                let end = pack.from.checked_add(level.bytes);
                if end.is_none_or(|end| end > pack.bytes) {
                    return Err(format!("levels[{i}].pack should be a place in the pack"));
                }
            }
        }
        Ok(())
    }
}

impl Sound for SmoothLod {
    fn check(&self) -> Result<(), String> {
        count(format_args!("smooth.bytes"), self.bytes)?;
        count(format_args!("smooth.materials_bytes"), self.materials_bytes)?;
        textures(format_args!("smooth"), &self.textures)?;
        let mut end = 0;
        for (i, rung) in self.rungs.iter().enumerate() {
            let expected = RungName {
                hash: self.url.hash(),
                number: u8::try_from(i).map_err(|_| "smooth.rungs should be at most 256")?,
            };
            if rung.url != expected || self.url.ext() != SLOD {
                return Err(format!(
                    "smooth.rungs[{i}].url should be that of rung {i} of {}",
                    self.url
                ));
            }
            count(format_args!("smooth.rungs[{i}].triangles"), rung.triangles)?;
            if rung.from != end || rung.to <= end {
                return Err("smooth.rungs should be disjoint slices that are the whole stream".to_owned());
            }
            end = rung.to;
        }
        if end != self.bytes || self.rungs.is_empty() {
            return Err("smooth.rungs should be disjoint slices that are the whole stream".to_owned());
        }
        Ok(())
    }
}

impl Sound for Procedural {
    fn check(&self) -> Result<(), String> {
        count(format_args!("procedural.rules_bytes"), self.rules_bytes)?;
        let mut imports = self.imports.iter();
        imports.try_for_each(|(name, import)| count(format_args!("procedural.imports.{name}.bytes"), import.bytes))
    }
}

impl Sound for Impostor {
    fn check(&self) -> Result<(), String> {
        count(format_args!("impostor.colour.bytes"), self.colour.bytes)?;
        count(format_args!("impostor.shape.bytes"), self.shape.bytes)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use crate::{BlobName, object::ModelChunk};

    fn name(ext: &str) -> String {
        BlobName::of(ext.as_bytes(), ext).expect("a name").url()
    }

    fn rung(number: u32, from: u64, to: u64) -> Value {
        let url = name("slod").replace(".slod", &format!(".r{number}.slod"));
        json!({"url": url, "from": from, "to": to, "triangles": 2, "geometric_error_m": 0.0, "rms_error_m": 0.0})
    }

    fn chunk() -> Value {
        let level = |number: u32| {
            json!({"level": number, "url": name("glb"), "bytes": 100, "triangles": 1, "geometric_error_m": 0.0,
                "switch_distance_m": 0.0, "textures": [{"url": name("png"), "bytes": 5}],
                "pack": {"url": name("pack"), "bytes": 300, "from": 200}})
        };
        json!({"models": {"m3": {
            "levels": [level(0), level(1)],
            "smooth": {"url": name("slod"), "bytes": 30, "materials": name("gltf"), "materials_bytes": 3,
                "rungs": [rung(0, 0, 10), rung(1, 10, 30)]},
            "procedural": {"rules": name("dcg"), "rules_bytes": 9, "parameters": {},
                "imports": {"post": {"url": name("dcg"), "bytes": 4}}},
        }}})
    }

    /// With another value at a place.
    fn refused(place: &str, value: &Value) -> String {
        let mut chunk = chunk();
        *chunk["models"]["m3"].pointer_mut(place).expect("a place") = value.clone();
        let read = serde_json::from_value::<ModelChunk>(chunk);
        read.expect_err(place).to_string()
    }

    #[test]
    fn a_model_that_is_sound_is_read_and_each_flaw_is_named() {
        serde_json::from_value::<ModelChunk>(chunk()).expect("it is sound");
        let most = u64::MAX;
        for (place, value, field) in [
            ("/levels", json!([]), "levels should"),
            ("/levels/1/level", json!(0), "levels should be numbered"),
            ("/levels/1/bytes", json!(most), "levels[1].bytes"),
            ("/levels/0/triangles", json!(most), "levels[0].triangles"),
            ("/levels/0/textures/0/bytes", json!(most), "levels[0].textures[0].bytes"),
            // Behind its last byte is the first again.
            ("/levels/0/pack/from", json!(most - 49), "levels[0].pack"),
            ("/levels/0/pack/from", json!(201), "levels[0].pack"),
            ("/levels/0/pack/bytes", json!(most), "levels[0].pack.bytes"),
            ("/smooth/rungs", json!([]), "smooth.rungs"),
            (
                "/smooth/rungs",
                json!([rung(0, 0, 30), rung(1, 30, 30)]),
                "smooth.rungs",
            ),
            (
                "/smooth/rungs",
                json!([rung(0, 0, 40), rung(1, 40, 30)]),
                "smooth.rungs",
            ),
            (
                "/smooth/rungs",
                json!([rung(0, 0, 10), rung(1, 11, 30)]),
                "smooth.rungs",
            ),
            (
                "/smooth/rungs",
                json!([rung(0, 0, 10), rung(2, 10, 30)]),
                "smooth.rungs[1].url",
            ),
            ("/smooth/rungs/1/triangles", json!(most), "smooth.rungs[1].triangles"),
            ("/smooth/url", json!(name("glb")), "smooth.rungs[0].url"),
            ("/smooth/bytes", json!(31), "smooth.rungs"),
            ("/smooth/materials_bytes", json!(most), "smooth.materials_bytes"),
            ("/procedural/rules_bytes", json!(most), "procedural.rules_bytes"),
            (
                "/procedural/imports/post/bytes",
                json!(most),
                "procedural.imports.post.bytes",
            ),
        ] {
            let told = refused(place, &value);
            assert!(told.starts_with(&format!("m3: {field}")), "{place}: {told}");
        }
    }

    #[test]
    fn a_flaw_in_a_text_is_told_with_the_model_and_one_place() {
        let text = serde_json::to_string_pretty(&chunk()).expect("a text");
        let broken = text.replacen("\"triangles\": 1", "\"triangles\": -1", 1);
        let told = serde_json::from_str::<ModelChunk>(&broken)
            .expect_err("it is broken")
            .to_string();
        assert!(told.starts_with("m3: ") && told.contains("-1"), "{told}");
        assert_eq!(told.matches(" at line ").count(), 1, "{told}");
    }
}
