//! How does a picture lie on a surface? What a member of a glTF material that names a texture says of its texture
//! coordinates, `KHR_texture_transform` included.

use glam::{DMat2, DVec2};
use serde_json::Value;

/// Which texture coordinates a picture has, and what becomes of them before it is looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Transform {
    /// Which set.
    pub(crate) set: usize,
    pub(crate) offset: DVec2,
    /// Scale, then rotation.
    pub(crate) linear: DMat2,
}

impl Transform {
    pub(crate) fn of(member: &Value) -> Self {
        let extension = member.pointer("/extensions/KHR_texture_transform");
        let number = |path: &str, otherwise: f64| {
            let found = extension.and_then(|extension| extension.pointer(path)?.as_f64());
            found.filter(|x| x.is_finite()).unwrap_or(otherwise)
        };
        let pair =
            |name: &str, otherwise: f64| DVec2::from([0, 1].map(|axis| number(&format!("/{name}/{axis}"), otherwise)));
        let set = extension.and_then(|extension| extension.get("texCoord"));
        let set = set.or(member.get("texCoord")).and_then(Value::as_u64);
        Self {
            set: set.and_then(|set| usize::try_from(set).ok()).unwrap_or(0),
            offset: pair("offset", 0.0),
            // Counter-clockwise as one sees a picture, whose second coordinate goes down.
            linear: DMat2::from_angle(-number("/rotation", 0.0)) * DMat2::from_diagonal(pair("scale", 1.0)),
        }
    }

    pub(crate) fn apply(&self, uv: DVec2) -> DVec2 {
        self.linear * uv + self.offset
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// The example of the extension: the lower left quadrant of a picture, turned by a quarter.
    #[test]
    fn a_turned_picture_shows_what_its_extension_says() {
        let quarter = std::f64::consts::FRAC_PI_2;
        let extension = json!({"offset": [0, 1], "rotation": quarter, "scale": [0.5, 0.5], "texCoord": 1});
        let transform = Transform::of(&json!({"index": 0, "extensions": {"KHR_texture_transform": extension}}));
        let of = |u, v| {
            transform
                .apply(DVec2::new(u, v))
                .to_array()
                .map(|x| (1e9 * x).round() / 1e9)
        };
        assert_eq!(transform.set, 1);
        assert_eq!(
            [of(0.0, 0.0), of(1.0, 0.0), of(1.0, 1.0), of(0.0, 1.0)],
            [[0.0, 1.0], [0.0, 0.5], [0.5, 0.5], [0.5, 1.0]]
        );
        let plain = Transform::of(&json!({"index": 0, "texCoord": 2}));
        assert_eq!(
            (plain.set, plain.apply(DVec2::new(0.25, 3.0))),
            (2, DVec2::new(0.25, 3.0))
        );
    }
}
