//! What does somebody look like? Like an object of the scene, or of another one of the same server: then whoever wears it
//! must be able to read that one, and what is uploaded as a scene can be worn in all of them.

use std::{fmt, sync::Arc};

use belvedere_live::world::Look;
use belvedere_scene::{ObjectId, SceneName};
use serde::{
    Deserialize, Deserializer,
    de::{self, MapAccess, value::MapAccessDeserializer},
};

use crate::{
    http::{error::ApiError, visitor::Visitor},
    published::Published,
};

/// The object whose model is worn: `"o12"`, or `{"scene": "people", "object": "o12"}`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Avatar {
    /// Where it is; none where it is worn.
    scene: Option<SceneName>,
    object: ObjectId,
}

impl<'de> Deserialize<'de> for Avatar {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Forms;

        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Members {
            scene: Option<SceneName>,
            object: ObjectId,
        }

        impl<'de> de::Visitor<'de> for Forms {
            type Value = Avatar;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(r#"an object like "o12", or {"scene": "people", "object": "o12"}"#)
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Avatar, E> {
                let object = text.parse().map_err(E::custom)?;
                Ok(Avatar { scene: None, object })
            }

            fn visit_map<A: MapAccess<'de>>(self, members: A) -> Result<Avatar, A::Error> {
                let Members { scene, object } = Members::deserialize(MapAccessDeserializer::new(members))?;
                Ok(Avatar { scene, object })
            }
        }

        deserializer.deserialize_any(Forms)
    }
}

/// What a participant or a mover of a scene looks like.
pub(super) async fn look(
    visitor: &Visitor,
    published: &Published,
    avatar: Option<Avatar>,
    name: Option<String>,
) -> Result<Look, ApiError> {
    let name = name.unwrap_or_default();
    if name.len() > 200 {
        return Err(ApiError::bad_body("/name", "a name has at most 200 bytes"));
    }
    let Some(Avatar { scene, object }) = avatar else {
        return Ok(Look { name, model: None });
    };
    let (info, pointer, place) = match scene {
        None => (
            published.reader.object_info(object).await?,
            "/avatar",
            "the scene".to_owned(),
        ),
        Some(scene) => {
            let wardrobe = visitor.scene(&scene).await.map_err(|error| match error {
                ApiError::NotFound(missing) => ApiError::bad_body("/avatar/scene", format!("there is no {missing}")),
                other => other,
            })?;
            (
                wardrobe.reader.object_info(object).await?,
                "/avatar/object",
                format!("scene `{scene}`"),
            )
        }
    };
    let detail = || format!("{object} is no object of {place}: an avatar wears the model of one");
    let info = info.ok_or_else(|| ApiError::bad_body(pointer, detail()))?;
    Ok(Look {
        name,
        model: Some(Arc::new(info)),
    })
}
