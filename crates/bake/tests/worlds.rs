//! Are the worlds in `content/` what they claim to be? Each grows with the parts that one comes to see, on cells that
//! hold together, and a street is baked to the end.

use std::{collections::BTreeSet, path::PathBuf};

use belvedere_bake::{
    BakeSettings, Host, Source, bake,
    cells::{CellGraph, author},
    defect::Defects,
    import::{FileError, Imported, Limits, SourceFiles, import},
    progress::Silent,
    records::{BlobSink, SinkError},
    source::{Role, SourceModel, SourceScene},
    visibility::{Method, SampledSettings, VisibilitySettings},
    world::World,
};
use belvedere_scene::BlobName;

/// The files in `content/`.
struct Content;

impl SourceFiles for Content {
    fn read(&self, relative: &str, _: u64) -> Result<Vec<u8>, FileError> {
        let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../content");
        std::fs::read(folder.join(relative)).map_err(|_| FileError::Missing)
    }
}

fn grown(main: &'static str) -> SourceScene {
    let imported = import("world.dcg", main.into(), &Content, &Limits::default(), &Silent);
    let Imported { scene, defects } = imported.expect("sound rules");
    assert_eq!(defects.iter().count(), 0, "{main}");
    scene
}

/// A world and its cells.
struct Walk {
    scene: SourceScene,
    graph: CellGraph,
}

fn walk(main: &'static str) -> Walk {
    let scene = grown(main);
    let world = World::new(&scene).expect("it is small enough");
    let mut defects = Defects::default();
    let graph = author::build(&world, &scene.authored, &mut defects).expect("sound cells");
    let said: Vec<_> = defects.iter().map(|defect| format!("{defect:?}")).collect();
    assert!(said.is_empty(), "{said:?}");
    Walk { scene, graph }
}

impl Walk {
    fn viewpoint(&self, name: &str) -> [f64; 3] {
        let found = self.scene.viewpoints.iter().find(|viewpoint| viewpoint.name == name);
        let found = found.unwrap_or_else(|| panic!("no viewpoint {name}"));
        found.world_from_camera.w_axis.truncate().to_array()
    }

    /// The cells that one can walk to from a point.
    fn reached_from(&self, eye: [f64; 3]) -> BTreeSet<usize> {
        let start = self.graph.cell_at(eye).expect("the eye stands in a cell") as usize;
        let (mut reached, mut open) = (BTreeSet::from([start]), vec![start]);
        while let Some(cell) = open.pop() {
            let next = self.graph.cells[cell].portals.iter().map(|portal| portal.to as usize);
            open.extend(next.filter(|next| reached.insert(*next)));
        }
        reached
    }

    fn doors(&self) -> usize {
        self.scene
            .objects
            .iter()
            .filter(|object| object.role == Role::Door)
            .count()
    }

    /// Doors that close an opening between two cells.
    fn closing_doors(&self) -> BTreeSet<u32> {
        let portals = self.graph.cells.iter().flat_map(|cell| &cell.portals);
        portals.filter_map(|portal| portal.door).collect()
    }

    fn named(&self, start: &str) -> usize {
        let cells = self.scene.authored.cells.iter();
        cells.filter(|cell| cell.node.starts_with(start)).count()
    }

    /// Every cell can be walked to, and every viewpoint but those in the air stands in one.
    fn is_whole(&self, first: &str, in_the_air: &[&str]) {
        let reached = self.reached_from(self.viewpoint(first));
        assert_eq!(reached.len(), self.graph.cells.len(), "cells that one can walk to");
        for viewpoint in &self.scene.viewpoints {
            let eye = viewpoint.world_from_camera.w_axis.truncate().to_array();
            let stands = self.graph.cell_at(eye).is_some();
            assert_eq!(
                stands,
                !in_the_air.contains(&viewpoint.name.as_str()),
                "{}",
                viewpoint.name
            );
        }
    }
}

#[test]
fn in_the_town_streets_lead_into_houses_with_two_rooms_and_doors() {
    let town = walk("import \"town.dcg\" as town town(reach = 2)");
    town.is_whole("Market place", &["Above the roofs"]);
    let houses = town.named("cell:front room");
    assert!(houses >= 2, "{houses} open houses");
    assert_eq!(town.named("cell:back room"), houses);
    assert_eq!(town.doors(), 2 * houses, "one to the street and one inside");
    assert_eq!(town.closing_doors().len(), houses, "inner doors are shut");
    let styles = [
        "townhouse",
        "gabled",
        "timbered",
        "founders",
        "modern",
        "cafe_shell",
        "church",
        "town_hall",
    ];
    for style in styles {
        let is_one = |model: &SourceModel| model.name == style;
        assert!(town.scene.models.iter().any(is_one), "no {style}");
    }
}

#[test]
fn in_the_museum_stairs_lead_from_room_to_room_on_both_floors() {
    let museum = walk("import \"museum.dcg\" as museum museum()");
    museum.is_whole("Great hall", &[]);
    assert!(museum.named("cell:room") >= 20, "{} rooms", museum.named("cell:room"));
    let closing = museum.closing_doors().len();
    assert_eq!(closing, 4, "doors that are shut");
    assert!(museum.doors() > closing, "the others stand open");
    // Upstairs is reached by a flight whose floor rises.
    let [x, _, z] = museum.viewpoint("Stairs");
    let foot = museum.graph.cell_at([x, 1.7, z - 3.5]).expect("a flight");
    let head = museum.graph.cell_at([x, 4.0, z - 7.9]).expect("the same flight");
    assert_eq!(foot, head);
    let below = museum.graph.cell_at([x, 1.7, z - 7.9]);
    assert_eq!(below, None, "nobody stands inside the steps");
}

#[test]
fn in_the_forest_one_walks_on_uneven_ground() {
    let forest = walk("import \"forest.dcg\" as forest forest()");
    forest.is_whole("By the stream", &[]);
    assert_eq!(forest.doors(), 1);
    let trees = forest.scene.objects.iter();
    let trees = trees.filter(|object| {
        ["tree", "conifer", "spruce"]
            .iter()
            .any(|tree| object.source_node.starts_with(tree))
    });
    assert!(trees.count() > 1_000);
    let heights = forest
        .scene
        .viewpoints
        .iter()
        .map(|viewpoint| viewpoint.world_from_camera.w_axis.y);
    let (least, most) = heights.fold((f64::MAX, f64::MIN), |(least, most), y| (y.min(least), y.max(most)));
    assert!(most - least > 3.0, "{least} to {most} m");
}

/// Keeps nothing.
struct Nowhere;

impl BlobSink for Nowhere {
    fn put(&self, _: &BlobName, _: Vec<u8>) -> Result<(), SinkError> {
        Ok(())
    }
}

#[test]
fn a_street_with_a_cafe_is_baked_and_its_back_room_hides_most_of_the_street() {
    let street = "
        import \"houses.dcg\" as houses
        import \"tree.dcg\" as tree
        for i in 4 move(13 * i - 32, 0, 0) houses.house(13, 10, i)
        move(20, 0, 0) houses.cafe(13, 10, 3, 1)
        called \"road\" move(0, -0.2, 5) box(80, 0.2, 10)
        for i in 6 move(10 * i - 30, 0, 8) tree(height = 6, richness = 1)
        called \"cell:street\" move(0, 0, 5) box(80, 9, 10)
        move(0, 1.7, 5) viewpoint \"Street\"
    ";
    let scene = grown(street);
    let settings = BakeSettings {
        visibility: VisibilitySettings {
            method: Method::Sampled,
            sampled: Some(SampledSettings {
                rays_per_cell: 20_000,
                ..SampledSettings::default()
            }),
        },
        ..BakeSettings::default()
    };
    let source = Source {
        scene,
        title: "Street".to_owned(),
        bytes: 0,
    };
    let written = bake(source, &settings, &mut Defects::default(), &Host::taking(&Nowhere)).expect("it bakes");
    let (counts, visibility) = (&written.manifest.counts, &written.manifest.visibility);
    assert_eq!(
        counts.cells, 5,
        "the street, the threshold, two rooms and the door between them"
    );
    let objects = f64::from(counts.objects);
    assert!(
        visibility.mean_visible < 0.8 * objects,
        "{} of {objects}",
        visibility.mean_visible
    );
}
