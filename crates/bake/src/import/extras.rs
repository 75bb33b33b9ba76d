//! What may `extras.belvedere` say? What nobody reads there is counted: a wish with a slip of the pen in its name would be
//! lost without a word. All places are named, for each has to be mended.

use belvedere_scene::procedural::{cut, nearest};

use super::document::Item;
use crate::defect::Defects;

/// Lists of the document, what one item of each is called, and the members that are read of it.
const READ: [(&str, &str, &[&str]); 3] = [
    (
        "nodes",
        "node",
        &["impostor", "kind", "name", "parameters", "procedural", "seed"],
    ),
    ("meshes", "mesh", &["impostor"]),
    ("materials", "material", &["recolour"]),
];

/// Counts members that are not known, by the known one that each may have been meant for, so that each of these is shown
/// with a place.
pub(super) fn note_unknown(root: &Item, defects: &mut Defects) {
    for (list, what, known) in READ {
        for index in 0..root.length(list) {
            let Ok(item) = root.listed(list, index) else { continue };
            let Some(belvedere) = item.value.pointer("/extras/belvedere") else {
                continue;
            };
            let owner = || {
                item.name()
                    .map_or_else(|| format!("{what}[{index}]"), |name| format!("{what} {:?}", cut(name)))
            };
            let Some(members) = belvedere.as_object() else {
                defects.name("`extras.belvedere` that is no object: ignored", [owner()]);
                continue;
            };
            if what == "node" && !members.contains_key("procedural") {
                let kind = "`parameters` or `seed` without `procedural`, which names the rules: ignored";
                let lost = ["parameters", "seed"]
                    .into_iter()
                    .filter(|name| members.contains_key(*name));
                defects.name(kind, lost.map(|name| format!("{}: \"{name}\"", owner())));
            }
            for name in members.keys().filter(|name| !known.contains(&name.as_str())) {
                let meant = nearest(name, known.iter().copied());
                let place = match &meant {
                    Some(meant) => format!("{}: {:?}; did you mean \"{meant}\"?", owner(), cut(name)),
                    None => format!("{}: {:?}; known are {}", owner(), cut(name), known.join(", ")),
                };
                defects.name(unknown(meant.as_deref()), [place]);
            }
        }
    }
}

fn unknown(meant: Option<&str>) -> &'static str {
    /// Each member with the defect of one that is nearly called so.
    macro_rules! perhaps {
        ($($name:literal)*) => {
            [$(($name, concat!("member of `extras.belvedere` that is not known, perhaps `", $name, "`: ignored"))),*]
        };
    }
    let perhaps = perhaps!["impostor" "kind" "name" "parameters" "procedural" "recolour" "seed"];
    let found = perhaps.into_iter().find(|(name, _)| Some(*name) == meant);
    found.map_or(
        "member of `extras.belvedere` that is not known: ignored",
        |(_, kind)| kind,
    )
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::import::testing::Gltf;

    #[test]
    fn each_member_that_is_read_can_be_meant() {
        for name in READ.iter().flat_map(|(_, _, known)| *known) {
            assert!(unknown(Some(name)).contains(&format!("perhaps `{name}`")), "{name}");
        }
    }

    #[test]
    fn members_that_are_not_known_are_told_with_what_they_may_mean() {
        let mut gltf = Gltf::triangle();
        gltf.json["materials"] = json!([{"extras": {"belvedere": {"recolor": true, "recolour": true}}}]);
        gltf.json["meshes"][0]["name"] = json!("m");
        gltf.json["meshes"][0]["extras"] = json!({"belvedere": {"imposter": true}, "other": {"sead": 1}});
        gltf.json["nodes"][0]["extras"] =
            json!({"belvedere": {"sead": 5, "seeds": 1, "parametrs": {}, "zzz": 0, "kind": "x"}});
        gltf.push("nodes", json!({"name": "b", "extras": {"belvedere": [1]}}));
        let imported = gltf.import().unwrap();
        let told: Vec<_> = imported.defects.iter().map(|defect| defect.to_string()).collect();
        let perhaps = |name: &str| format!("member of `extras.belvedere` that is not known, perhaps `{name}`: ignored");
        let wanted = [
            "1 × `extras.belvedere` that is no object: ignored (first: node \"b\")".to_owned(),
            format!("1 × {} (first: mesh \"m\": \"imposter\"; did you mean \"impostor\"?)", perhaps("impostor")),
            format!("1 × {} (first: node \"n\": \"parametrs\"; did you mean \"parameters\"?)", perhaps("parameters")),
            format!("1 × {} (first: material[0]: \"recolor\"; did you mean \"recolour\"?)", perhaps("recolour")),
            format!(
                "2 × {} (node \"n\": \"sead\"; did you mean \"seed\"?, node \"n\": \"seeds\"; did you mean \"seed\"?)",
                perhaps("seed")
            ),
            "1 × member of `extras.belvedere` that is not known: ignored (first: node \"n\": \"zzz\"; known are impostor, \
             kind, name, parameters, procedural, seed)"
                .to_owned(),
        ];
        assert_eq!(told, wanted);
    }
}
