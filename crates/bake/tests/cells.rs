//! Does every scene bake to sound cells, or is it refused with the reason? Author's cells, and geometry as bad as it
//! comes.

use std::{collections::BTreeMap, sync::Mutex};

use belvedere_bake::{
    BakeError, BakeSettings, Host, Source, bake,
    defect::Defects,
    records::{BlobSink, SinkError, Written},
    source::{
        Authored, AuthoredShape, Material, Primitive, Role, SourceModel, SourceObject, SourceScene, SourceViewpoint,
    },
    visibility::{Method, SampledSettings, VisibilitySettings},
};
use belvedere_scene::{
    BlobName, CellId,
    index::{CellChunk, CellEntry},
    object::{ObjectChunk, ObjectEntry},
    record::CellRecord,
};
use glam::{DMat4, DVec3};

/// Keeps blobs in memory.
#[derive(Default)]
struct Memory(Mutex<BTreeMap<BlobName, Vec<u8>>>);

impl BlobSink for Memory {
    fn put(&self, name: &BlobName, bytes: Vec<u8>) -> Result<(), SinkError> {
        self.0
            .lock()
            .expect("no other thread has panicked")
            .insert(name.clone(), bytes);
        Ok(())
    }
}

/// A revision as a client reads it.
struct Baked {
    written: Written,
    defects: Defects,
    cells: Vec<(CellEntry, CellRecord)>,
    objects: Vec<ObjectEntry>,
}

fn baked(scene: SourceScene) -> Result<Baked, BakeError> {
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
    let (sink, mut defects) = (Memory::default(), Defects::default());
    let source = Source {
        scene,
        title: "test".to_owned(),
        bytes: 0,
    };
    let written = bake(source, &settings, &mut defects, &Host::taking(&sink))?;
    let blobs = sink.0.into_inner().expect("no thread has panicked");
    let documents = |has: &'static str| {
        let json = blobs
            .iter()
            .filter(|(name, _)| name.ext() == "json")
            .map(|(_, bytes)| bytes);
        json.filter(move |bytes| bytes.starts_with(has.as_bytes()))
    };
    let read = |bytes: &Vec<u8>| serde_json::from_slice::<CellChunk>(bytes).expect("a chunk").cells;
    let entries = documents(r#"{"cells":"#).flat_map(read);
    let mut cells: Vec<_> = entries
        .map(|entry| {
            (
                entry.clone(),
                CellRecord::decode(&blobs[&entry.record]).expect("a record"),
            )
        })
        .collect();
    cells.sort_by_key(|(entry, _)| entry.cell);
    let read = |bytes: &Vec<u8>| serde_json::from_slice::<ObjectChunk>(bytes).expect("a chunk").objects;
    let objects = documents(r#"{"objects":"#).flat_map(read).collect();
    Ok(Baked {
        written,
        defects,
        cells,
        objects,
    })
}

impl Baked {
    /// Names of what is seen from a cell.
    fn seen_from(&self, cell: CellId) -> Vec<&str> {
        let record = &self.cells[cell.index()].1;
        let name = |id| {
            &self
                .objects
                .iter()
                .find(|o| o.object == id)
                .expect("listed")
                .source_node[..]
        };
        let mut names: Vec<_> = record.visible().iter().map(|v| name(v.object)).collect();
        names.sort_unstable();
        names
    }

    fn cell_at(&self, point: [f64; 3]) -> Option<CellId> {
        let holder = self.cells.iter().find(|(entry, _)| entry.distance_m(point) == 0.0);
        holder.map(|(entry, _)| entry.cell)
    }

    fn reason(&self) -> &str {
        &self.written.manifest.visibility.reason
    }

    /// What must hold of all cells.
    fn check(&self) {
        assert_eq!(self.cells.len(), self.written.manifest.counts.cells as usize);
        for (entry, record) in &self.cells {
            assert_eq!(entry.adjacent, record.adjacent);
            for point in &record.hull.points {
                assert!(entry.distance_m(*point) < 1e-6, "a corner outside its own cell");
            }
            for portal in &record.portals {
                let other = &self.cells[portal.to.index()].0;
                let on_both = |p: &[f64; 3]| entry.distance_m(*p) < 1e-3 && other.distance_m(*p) < 1e-3;
                assert!(portal.polygon.len() >= 3 && portal.polygon.iter().all(on_both));
                let back = &self.cells[portal.to.index()].1.portals;
                assert!(back.iter().any(|p| p.to == entry.cell && p.polygon == portal.polygon));
            }
            let middle = entry.bounds.center();
            let holders = self.cells.iter().filter(|(other, _)| other.holds_alone(middle));
            assert!(holders.count() <= 1, "cells overlap at {middle:?}");
        }
    }
}

#[derive(Clone, Default)]
struct Builder(SourceScene);

impl Builder {
    fn mesh(mut self, name: &str, positions: Vec<[f32; 3]>, indices: Vec<u32>) -> Self {
        self.0.models.push(SourceModel {
            name: name.to_owned(),
            primitives: vec![Primitive {
                positions,
                indices,
                ..Primitive::default()
            }],
            ..SourceModel::default()
        });
        self.0.objects.push(SourceObject {
            source_node: name.to_owned(),
            part: 0,
            model: self.0.models.len() - 1,
            world_from_object: DMat4::IDENTITY,
            role: Role::Ordinary,
        });
        self
    }

    /// A box with outward faces.
    fn block(self, name: &str, min: [f32; 3], max: [f32; 3]) -> Self {
        let corner = |i: usize| [0, 1, 2].map(|a| if i >> a & 1 == 1 { max[a] } else { min[a] });
        let quads = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        let indices = quads.iter().flat_map(|[a, b, c, d]| [*a, *b, *c, *a, *c, *d]).collect();
        self.mesh(name, (0..8).map(corner).collect(), indices)
    }

    /// All faces turned round.
    fn inside_out(mut self) -> Self {
        for primitive in self.0.models.iter_mut().flat_map(|model| &mut model.primitives) {
            primitive
                .indices
                .chunks_exact_mut(3)
                .for_each(|triangle| triangle.swap(0, 1));
        }
        self
    }

    fn double_sided(mut self) -> Self {
        self.0.materials = vec![Material {
            gltf: serde_json::json!({}),
            see_through: false,
            double_sided: true,
        }];
        for primitive in self.0.models.iter_mut().flat_map(|model| &mut model.primitives) {
            primitive.material = Some(0);
        }
        self
    }

    fn eye(mut self, at: [f64; 3]) -> Self {
        self.0.viewpoints.push(SourceViewpoint {
            name: "eye".to_owned(),
            world_from_camera: DMat4::from_translation(at.into()),
        });
        self
    }

    fn cells(mut self, cells: Vec<AuthoredShape>) -> Self {
        self.0.authored = Authored {
            cells,
            ..Authored::default()
        };
        self
    }
}

/// Two rooms of 6 m × 6 m × 3 m, a wall between them with a doorway, a lamp in each.
fn two_rooms() -> Builder {
    Builder::default()
        .block("floor", [-0.3, -0.2, -0.3], [12.6, 0.0, 6.3])
        .block("ceiling", [-0.3, 3.0, -0.3], [12.6, 3.2, 6.3])
        .block("north", [-0.3, 0.0, -0.3], [12.6, 3.0, 0.0])
        .block("south", [-0.3, 0.0, 6.0], [12.6, 3.0, 6.3])
        .block("west", [-0.3, 0.0, 0.0], [0.0, 3.0, 6.0])
        .block("east", [12.3, 0.0, 0.0], [12.6, 3.0, 6.0])
        .block("wall a", [6.0, 0.0, 0.0], [6.3, 3.0, 2.0])
        .block("wall b", [6.0, 0.0, 3.2], [6.3, 3.0, 6.0])
        .block("lintel", [6.0, 2.1, 2.0], [6.3, 3.0, 3.2])
        .block("lamp west", [1.0, 0.0, 5.0], [1.3, 1.2, 5.3])
        .block("lamp east", [11.0, 0.0, 5.0], [11.3, 1.2, 5.3])
}

/// A prism over a footprint in x and z.
fn prism(node: &str, footprint: &[[f64; 2]]) -> AuthoredShape {
    let at = |i: usize, y: f64| {
        let [x, z] = footprint[i % footprint.len()];
        DVec3::new(x, y, z)
    };
    let mut triangles = Vec::new();
    for i in 0..footprint.len() {
        triangles.push([at(i, 0.0), at(i + 1, 0.0), at(i + 1, 3.0)]);
        triangles.push([at(i, 0.0), at(i + 1, 3.0), at(i, 3.0)]);
        if (1..footprint.len() - 1).contains(&i) {
            triangles.push([at(0, 0.0), at(i, 0.0), at(i + 1, 0.0)]);
            triangles.push([at(0, 3.0), at(i + 1, 3.0), at(i, 3.0)]);
        }
    }
    AuthoredShape {
        node: node.to_owned(),
        triangles,
        said: None,
    }
}

fn refusal(builder: Builder) -> String {
    match baked(builder.0) {
        Ok(baked) => panic!("{} cells were baked", baked.cells.len()),
        Err(cause) => cause.to_string(),
    }
}

#[test]
fn a_scene_without_walls_is_one_cell_from_which_everything_is_visible_and_says_so() {
    let corners = [[-60., 0., -60.], [-60., 0., 60.], [60., 0., 60.], [60., 0., -60.]];
    let mut builder = Builder::default().mesh("ground", corners.to_vec(), vec![0, 1, 2, 0, 2, 3]);
    for i in 0..12 {
        let (x, z) = ((i % 4) as f32 * 25.0 - 40.0, (i / 4) as f32 * 30.0 - 40.0);
        builder = builder.block("stone", [x, 0.0, z], [x + 0.5, 0.4, z + 0.5]);
    }
    let baked = baked(builder.0).unwrap();
    baked.check();
    assert_eq!(baked.cells.len(), 1);
    assert_eq!(baked.seen_from(CellId(0)).len(), 13);
    assert!(baked.reason().contains("everything is visible"), "{}", baked.reason());
}

#[test]
fn one_triangle_bakes_to_cells_that_all_see_it() {
    let triangle = Builder::default().mesh("it", vec![[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]], vec![0, 1, 2]);
    let baked = baked(triangle.0).unwrap();
    baked.check();
    // The air before it and the air behind it, at most.
    assert!((1..=2).contains(&baked.cells.len()));
    for (entry, _) in &baked.cells {
        assert_eq!(baked.seen_from(entry.cell), ["it"]);
    }
    assert!(baked.reason().contains("everything is visible"), "{}", baked.reason());
}

#[test]
fn a_viewpoint_inside_a_wall_is_linked_to_the_nearest_cell_and_counted() {
    let baked = baked(two_rooms().eye([3.0, 1.6, 3.0]).eye([6.15, 1.6, 1.0]).0).unwrap();
    baked.check();
    assert_eq!(
        baked
            .defects
            .count("viewpoint outside every cell, as inside a wall: linked to the nearest"),
        1
    );
    let lost = &baked.written.manifest.viewpoints[1];
    let distance_m = baked.cells[lost.cell.index()].0.distance_m(lost.position);
    assert!(distance_m > 0.0 && distance_m < 0.2, "{distance_m}");
}

#[test]
fn where_no_viewpoint_is_given_one_stands_beside_what_is_in_the_middle_of_a_room_however_small() {
    for metre in [0.01, 1.0, 10.0_f32] {
        let scaled = |corner: [f32; 3]| corner.map(|x| x * metre);
        let block =
            |builder: Builder, name: &str, [from, to]: [[f32; 3]; 2]| builder.block(name, scaled(from), scaled(to));
        let mut room = Builder::default();
        for (name, corners) in [
            ("floor", [[-0.2, -0.2, -0.2], [6.2, 0.0, 6.2]]),
            ("north", [[-0.2, 0.0, -0.2], [6.2, 3.0, 0.0]]),
            ("south", [[-0.2, 0.0, 6.0], [6.2, 3.0, 6.2]]),
            ("west", [[-0.2, 0.0, 0.0], [0.0, 3.0, 6.0]]),
            ("east", [[6.0, 0.0, 0.0], [6.2, 3.0, 6.0]]),
            ("pillar", [[2.6, 0.0, 2.6], [3.4, 3.0, 3.4]]),
        ] {
            room = block(room, name, corners);
        }
        // Walls that show from both sides look the same from within.
        for room in [room.clone(), room.double_sided()] {
            let baked = baked(room.0).unwrap();
            baked.check();
            let [x, y, z] = baked.written.manifest.viewpoints[0]
                .position
                .map(|x| x / f64::from(metre));
            assert!((0.0..4.0).contains(&y), "scale {metre}: {y} over the floor");
            assert!(
                ![x, z].iter().all(|x| (2.5..3.5).contains(x)),
                "scale {metre}: at {x}, {z}, in the pillar or with the nose on it"
            );
            assert!(
                [x, z].iter().all(|x| (0.1..5.9).contains(x)),
                "scale {metre}: at {x}, {z}"
            );
        }
    }
}

#[test]
fn where_no_viewpoint_is_given_one_looks_along_the_room_and_not_into_its_corner() {
    let mut room = Builder::default();
    for (name, from, to) in [
        ("floor", [-0.2, -0.2, -0.2], [12.2, 0.0, 5.2]),
        ("north", [-0.2, 0.0, -0.2], [12.2, 3.0, 0.0]),
        ("south", [-0.2, 0.0, 5.0], [12.2, 3.0, 5.2]),
        ("west", [-0.2, 0.0, 0.0], [0.0, 3.0, 5.0]),
        ("east", [12.0, 0.0, 0.0], [12.2, 3.0, 5.0]),
        ("shelf", [3.0, 0.0, 0.0], [4.0, 2.5, 1.0]),
    ] {
        room = room.block(name, from, to);
    }
    let baked = baked(room.0).unwrap();
    let viewpoint = &baked.written.manifest.viewpoints[0];
    let looks = glam::DQuat::from_array(viewpoint.orientation) * glam::DVec3::NEG_Z;
    assert!(viewpoint.made_up && looks.x.abs() > 0.95, "{looks}");
}

#[test]
fn walls_make_two_rooms_and_a_doorway() {
    let baked = baked(two_rooms().eye([3.0, 1.6, 3.0]).0).unwrap();
    baked.check();
    assert_eq!(baked.cells.len(), 3, "{}", baked.reason());
    let [west, east] = [[1.0, 1.6, 5.6], [11.0, 1.6, 5.6]].map(|eye| baked.cell_at(eye).expect("a room"));
    assert_ne!(west, east);
    assert!(baked.seen_from(west).contains(&"lamp west"));
}

#[test]
fn the_authors_cells_are_the_cells_with_hulls_planes_and_openings() {
    let cells = vec![
        prism("cell:west", &[[0., 0.], [6., 0.], [6., 6.], [3., 6.], [0., 3.]]),
        prism("cell:doorway", &[[6., 2.], [6.3, 2.], [6.3, 3.2], [6., 3.2]]),
        prism("cell:east", &[[6.3, 0.], [12.3, 0.], [12.3, 6.], [6.3, 6.]]),
    ];
    let baked = baked(two_rooms().eye([3.0, 1.6, 3.0]).cells(cells).0).unwrap();
    baked.check();
    assert_eq!(baked.cells.len(), 3);
    assert!(
        baked.reason().contains("as their author drew them"),
        "{}",
        baked.reason()
    );
    let west = baked.cell_at([3.0, 1.6, 3.0]).expect("the room");
    let (entry, record) = &baked.cells[west.index()];
    assert_eq!(
        (entry.planes.len(), record.hull.faces.len(), record.hull.points.len()),
        (7, 7, 10)
    );
    assert_eq!(baked.cell_at([0.5, 1.6, 5.5]), None, "cut off");
    let boxes = baked.cells.iter().filter(|(entry, _)| entry.planes.is_empty());
    assert_eq!(boxes.count(), 2, "boxes need no planes");
    let doorway = baked.cell_at([6.15, 1.0, 2.6]).expect("the doorway");
    assert_eq!(record.adjacent, [doorway]);
    assert_eq!(baked.cells[doorway.index()].1.portals.len(), 2);
    assert_eq!(baked.written.manifest.viewpoints[0].cell, west, "linked");
}

#[test]
fn authors_cells_that_make_no_sense_are_refused_with_name_and_way_out() {
    let dented = prism("cell:dent", &[[0., 0.], [6., 0.], [6., 6.], [3., 2.], [0., 6.]]);
    let cause = refusal(two_rooms().cells(vec![dented]));
    assert!(
        cause.contains("cell:dent") && cause.contains("cut it into convex cells"),
        "{cause}"
    );
    let rooms = vec![
        prism("cell:a", &[[0., 0.], [6., 0.], [6., 6.], [0., 6.]]),
        prism("cell:b", &[[5., 0.], [12., 0.], [12., 6.], [5., 6.]]),
    ];
    let cause = refusal(two_rooms().cells(rooms));
    assert!(
        cause.contains("cell:a") && cause.contains("cell:b") && cause.contains("overlap by 1.000 m"),
        "{cause}"
    );
    let mut open = prism("cell:open", &[[0., 0.], [6., 0.], [6., 6.]]);
    open.triangles.truncate(4);
    let cause = refusal(two_rooms().cells(vec![open]));
    assert!(cause.contains("cell:open") && cause.contains("not closed"), "{cause}");
}

#[test]
fn an_authors_cell_that_touches_nothing_bakes_and_is_counted() {
    let rooms = vec![
        prism("cell:a", &[[0., 0.], [6., 0.], [6., 6.], [0., 6.]]),
        prism("cell:b", &[[6.3, 0.], [12., 0.], [12., 6.], [6.3, 6.]]),
    ];
    let baked = baked(two_rooms().cells(rooms).0).unwrap();
    baked.check();
    assert_eq!(
        baked
            .defects
            .count("isolated cell: an author's cell that touches no other"),
        2
    );
}

#[test]
fn open_leaking_doubled_and_inside_out_rooms_bake_to_sound_cells() {
    let without = |name: &str| {
        let mut builder = two_rooms();
        builder.0.objects.retain(|object| object.source_node != name);
        builder
    };
    // A gap of 5 cm under the north wall.
    let leaking = without("north").block("north", [-0.3, 0.05, -0.3], [12.6, 3.0, 0.0]);
    let doubled = two_rooms().block("north again", [-0.3, 0.0, -0.3], [12.6, 3.0, 0.0]);
    let cases = [
        ("open", without("north")),
        ("without a floor", without("floor")),
        ("leaking", leaking),
        ("doubled", doubled),
        ("inside out", two_rooms().inside_out()),
        ("inside out, both sides drawn", two_rooms().inside_out().double_sided()),
    ];
    for (name, builder) in cases {
        let baked = baked(builder.eye([3.0, 1.6, 3.0]).0).unwrap_or_else(|cause| panic!("{name}: {cause}"));
        baked.check();
        let room = baked
            .cell_at([3.0, 1.6, 3.0])
            .unwrap_or_else(|| panic!("{name}: no cell at the viewpoint"));
        let seen = baked.seen_from(room);
        for thing in ["west", "lamp west", "ceiling"] {
            assert!(seen.contains(&thing), "{name}: {thing} is not in {seen:?}");
        }
    }
}

#[test]
fn a_small_thing_in_no_cell_is_seen_through_the_cell_next_to_it() {
    let west = prism("cell:west", &[[0., 0.], [6., 0.], [6., 6.], [0., 6.]]);
    let pin = |builder: Builder| builder.block("pin", [11.0, 1.0, 2.6], [11.01, 1.01, 2.61]);
    let baked = baked(pin(two_rooms()).cells(vec![west]).0).unwrap();
    assert!(
        baked.seen_from(CellId(0)).contains(&"pin"),
        "a centimetre, five metres behind the doorway"
    );
}

#[test]
fn whole_bakes_with_authors_cells_are_the_same_for_any_number_of_threads() {
    let scene = || {
        let west = prism("cell:west", &[[0., 0.], [6., 0.], [6., 6.], [3., 6.], [0., 3.]]);
        let east = prism("cell:east", &[[6., 0.], [12., 0.], [12., 6.], [6., 6.]]);
        two_rooms().cells(vec![west, east]).0
    };
    let with = |threads, scene| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| baked(scene).unwrap().written.revision())
    };
    assert_eq!(with(1, scene()), with(4, scene()));
    assert_eq!(with(1, two_rooms().0), with(4, two_rooms().0));
}
