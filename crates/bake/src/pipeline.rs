//! In which order do the stages run? The whole bake as one function of an imported scene.

use std::collections::BTreeSet;

use belvedere_scene::Bounds;
use glam::DVec3;
use rayon::prelude::*;

use crate::{
    cells::{
        self, AuthorError, CellGraph, CellSettings,
        author::{Drawn, SoundCells},
    },
    cutting::Cutting,
    defect::Defects,
    foliage,
    frame::Frame,
    import::split::{self, SplitSettings},
    impostors::surface::note_unseen,
    lod::LodSettings,
    memory::{Forgetful, Memory, Recent},
    morton,
    occluders::Hiders,
    progress::{Cancelled, Progress, Silent, Stage},
    records::{self, BlobSink, Models, SinkError, Written},
    share::share,
    source::{SourceModel, SourceObject, SourceScene, SourceViewpoint},
    visibility::{self, Views, Visibility, VisibilitySettings, conservative::Scenery, vouched::Vouched},
    world::{self, World, WorldError, bounds_of},
};

/// Everything that decides the result besides the source.
#[derive(Debug, Clone, Default)]
pub struct BakeSettings {
    /// How meshes are split into objects.
    pub split: SplitSettings,
    /// How free space is cut.
    pub cells: CellSettings,
    /// How visible sets are found.
    pub visibility: VisibilitySettings,
    /// How levels are made.
    pub lod: LodSettings,
}

/// Why a bake stopped. No revision came of it but a first one, if somebody took that.
#[derive(Debug, thiserror::Error)]
pub enum BakeError {
    /// The caller wanted to.
    #[error("cancelled; what was published before is served on, and the next bake goes on from here")]
    Cancelled,
    /// The scene cannot be flattened.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The author's cells cannot be used.
    #[error(transparent)]
    Author(#[from] AuthorError),
    /// The store refused an object.
    #[error(transparent)]
    Sink(#[from] SinkError),
}

impl From<Cancelled> for BakeError {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

/// Who called a bake, and what it does for it.
#[derive(Clone, Copy)]
pub struct Host<'a> {
    /// Takes what is finished.
    pub sink: &'a dyn BlobSink,
    /// Remembers what was found.
    pub memory: &'a dyn Memory,
    /// Hears how far it is.
    pub progress: &'a dyn Progress,
    /// Takes a first revision, of the same world with larger visible sets and no smooth LODs, long before the last one is
    /// done.
    pub first: Option<&'a FirstRevision<'a>>,
}

/// Does something with a first revision.
pub type FirstRevision<'a> = dyn Fn(&Written) -> Result<(), SinkError> + 'a;

impl<'a> Host<'a> {
    /// One that only takes what is finished.
    #[must_use]
    pub fn taking(sink: &'a dyn BlobSink) -> Self {
        Self {
            sink,
            memory: &Forgetful,
            progress: &Silent,
            first: None,
        }
    }
}

/// Bakes an imported scene: share → split → cells → levels → smooth LODs → impostors → visibility → records. Everything goes to the sink; the caller
/// moves the pointer. What was found for each cell is remembered, and recalled where nothing has changed.
///
/// # Errors
/// When the scene is too large, the sink refuses an object, or the caller cancels.
pub fn bake(
    source: Source,
    settings: &BakeSettings,
    defects: &mut Defects,
    host: &Host<'_>,
) -> Result<Written, BakeError> {
    let progress = host.progress;
    /// Steps of sharing and splitting meshes, of making the world, and of making what hides ready for questions.
    const SPLITTING: u64 = 1000;
    const MAKING: u64 = 1000;
    const READYING: u64 = 500;
    // Nothing later makes fewer of them, and all of it takes longer the more there are.
    world::check_placed(&source.scene)?;
    world::check_place(&source.scene)?;
    let sound = SoundCells::of(&source.scene.authored)?;
    progress.start(Stage::Occluders, SPLITTING + MAKING + Hiders::STEPS + READYING);
    let mut scene = in_spatial_order(as_published(source.scene, &settings.split, defects));
    note_unseen(&scene, defects);
    // Who draws cells has looked which way they should stand.
    let frame = if scene.authored.cells.is_empty() {
        Frame::of(&scene)
    } else {
        Frame::SOURCE
    };
    let unturned = frame.turn(&mut scene);
    progress.advance(SPLITTING);
    let world = World::new(&scene)?;
    progress.advance(MAKING);
    let viewpoints: Vec<[f64; 3]> = scene
        .viewpoints
        .iter()
        .map(|v| v.world_from_camera.w_axis.truncate().to_array())
        .collect();
    let drawn = cells::author::occluders(&world, &scene.authored, defects);
    let bodies = drawn.iter().map(|drawn| drawn.body.clone()).collect();
    let hiders = Hiders::told(&world, bodies, progress)?;
    let scenery = Scenery::with(&world, hiders.occluders());
    note_leaky_doors(&scenery, &scene, defects);
    progress.advance(READYING);
    let (partition, graph) = if scene.authored.cells.is_empty() {
        let estimate = |graph: &CellGraph| visibility::glance(&world, &scenery, graph, progress);
        cells::author::note_portals(&scene.authored, defects);
        let partition = cells::build_refined(&world, &viewpoints, &settings.cells, &estimate, progress)?;
        let graph = partition.graph(&world);
        (Some(partition), graph)
    } else {
        (
            None,
            cells::author::joined(&sound, (&world, &scene.authored), defects, progress)?,
        )
    };
    let vouched = Vouched {
        world: &world,
        scenery: &scenery,
        graph: &graph,
    };
    note_passed(&vouched, &drawn, frame, defects);
    let is_drawn = !scene.authored.cells.is_empty();
    if is_drawn {
        note_doors_of_no_portal((&world, &graph), &scene, defects);
    }
    progress.expect(Stage::Visibility, graph.cells.len() as u64);
    unturned.put_back(&mut scene);
    let views = Views::told(&world, &graph, &hiders, (Stage::Cells, progress))?;
    let bounds = if frame.is_source() {
        world.object_bounds().to_vec()
    } else {
        scene.objects.iter().map(|object| bounds_of(&scene, object)).collect()
    };
    let lod = settings.lod.clone().for_materials(&scene.materials);
    let foliage = foliage::of(&scene);
    let mut models = Models::write(&scene, &lod, host.sink, progress)?;
    let write = |models: &Models<'_>, placed: &CellGraph, mut visibility: Visibility| {
        visibility.reason = format!(
            "{}; {}",
            visibility.reason,
            how_cut(&world, (placed, is_drawn), &visibility)
        );
        let input = records::Input {
            scene: &scene,
            title: &source.title,
            source_bytes: source.bytes,
            world: &world,
            frame,
            bounds: &bounds,
            graph: placed,
            scenery: &scenery,
            foliage: &foliage,
            visibility: &visibility,
        };
        records::write(input, models, host.sink, progress)
    };
    let cutting = Cutting {
        world: &world,
        hiders: &hiders,
        partition,
        bytes: models.bytes_of_objects(&scene),
    };
    let rough = match host.first.is_some() || cutting.is_fine() {
        true => visibility::rough(&views, progress)?,
        false => Vec::new(),
    };
    if let Some(first) = host.first {
        let (graph, visibility) = cutting.preview(&views, &rough, progress)?;
        first(&write(&models, &frame.leave_with(graph), visibility)?)?;
    }
    let mut memory = Recent::over(host.memory);
    let tried = cutting.tried(&views, &rough, &settings.visibility, &memory, progress)?;
    memory.close();
    let views = match &tried {
        Some(graph) => Views::told(&world, graph, &hiders, (Stage::Trial, progress))?,
        None => views,
    };
    let graph = views.graph();
    progress.expect(Stage::Visibility, graph.cells.len() as u64);
    let placed = frame.leave_with(graph.clone());
    note_strays(&placed, &scene, defects);
    models.add_smooth(&lod, host.sink, progress)?;
    models.add_impostors(host.sink, progress)?;
    let visibility = visibility::compute(&views, &settings.visibility, &memory, progress)?;
    if !is_drawn {
        note_doors_without_use((&world, graph, frame), (&scene, &visibility), defects);
    }
    write(&models, &placed, visibility)
}

/// Cells whose rays see less than this share of all do not see everything.
const CLEARLY: f64 = 0.9;

/// How the cells came about, drawn by their author or not, and whether they were of any use.
fn how_cut(world: &World, (graph, is_drawn): (&CellGraph, bool), visibility: &Visibility) -> String {
    let drawn = world.object_bounds().iter().filter(|bounds| !bounds.is_empty()).count();
    // What nobody has looked for is not seen less either.
    let seen_less = visibility.mean_seen > 0.0 && visibility.mean_seen < CLEARLY * drawn as f64;
    let is_everything = visibility.cells.iter().all(|cell| cell.objects.len() == drawn);
    if is_everything && world.is_too_wide() {
        format!(
            "{}, and everything is visible: a scene {} across is too wide to know exactly what hides in it; bring nearer \
             what lies farthest out",
            graph.reason,
            distance(world.scale_m())
        )
    } else if is_everything && graph.cells.len() == 1 && !is_drawn {
        "one cell, because no wall hides anything: everything is visible; winding tunnels hide more where their cells are drawn".to_owned()
    } else if is_everything {
        let found = if seen_less {
            "though rays see less, nothing can be proved hidden from any"
        } else {
            "but everything is visible from each"
        };
        format!("{}, {found}", graph.reason)
    } else {
        graph.reason.clone()
    }
}

fn distance(metres: f32) -> String {
    match metres {
        far if far >= 1e4 => format!("{:.0} km", far / 1e3),
        far if far >= 100.0 => format!("{far:.0} m"),
        near => format!("{near} m"),
    }
}

/// Notes doors that do not fill their frames.
fn note_leaky_doors(scenery: &Scenery, scene: &SourceScene, defects: &mut Defects) {
    let leaky = scenery.blocker.occluders.leaky_doors();
    let kind = "door seen through when closed, for glass, holes, culled backs or a slanted outline: hides only where it is surely opaque";
    let node = |door: u32| scene.objects[door as usize].source_node.clone();
    defects.name(kind, leaky.map(node));
}

/// Notes doors that no portal names where the author has drawn what there is to close.
fn note_doors_of_no_portal((world, graph): (&World, &CellGraph), scene: &SourceScene, defects: &mut Defects) {
    let idle = graph.idle_doors(world);
    let in_openings = graph.doors_in_openings(world, &idle);
    let (partial, elsewhere): (Vec<u32>, Vec<u32>) = idle
        .into_iter()
        .partition(|door| in_openings.binary_search(door).is_ok());
    for (kind, doors) in [
        (
            "door that no portal names, for its leaf covers only a part of an opening between the author's cells: make it cover all of that, \
             or draw a `portal:` that it covers",
            partial,
        ),
        (
            "door that no portal names, for its leaf covers no opening between the author's cells as it stands: hides only what it covers \
             there; to close an opening, draw it as it stands when it is closed",
            elsewhere,
        ),
    ] {
        defects.note(kind, doors.len() as u64, || {
            placed_door(scene, (world, Frame::SOURCE), doors[0])
        });
    }
}

/// Notes doors that are of no use where the bake has found what there is to close: none of its openings names them, and nothing is hidden
/// by them when they are closed.
fn note_doors_without_use(
    (world, graph, frame): (&World, &CellGraph, Frame),
    (scene, visibility): (&SourceScene, &Visibility),
    defects: &mut Defects,
) {
    let seen = visibility.cells.iter().flat_map(|cell| &cell.objects);
    let hiding: BTreeSet<u32> = seen.flat_map(|seen| seen.doors.iter().copied()).collect();
    let idle = graph.idle_doors(world).into_iter();
    let useless: Vec<u32> = idle.filter(|door| !hiding.contains(door)).collect();
    let kind = "door that hides nothing when it is closed, and covers no opening that was found between cells as it stands: to close an \
                opening, draw it as it stands when it is closed, over all of that";
    defects.note(kind, useless.len() as u64, || {
        placed_door(scene, (world, frame), useless[0])
    });
}

/// A door by its name, with the middle of its leaf.
fn placed_door(scene: &SourceScene, (world, frame): (&World, Frame), door: u32) -> String {
    let middle = world.object_bounds()[door as usize].center();
    let [x, y, z] = frame.leave(DVec3::from(middle)).to_array();
    format!("{} at {x:.3}, {y:.3}, {z:.3}", scene.objects[door as usize].source_node)
}

/// Notes the author's occluders that hide what can be seen.
fn note_passed(vouched: &Vouched<'_>, drawn: &[Drawn], frame: Frame, defects: &mut Defects) {
    let bodies: Vec<_> = drawn.iter().map(|drawn| &drawn.body).collect();
    let passed = drawn.iter().zip(vouched.passed(&bodies));
    let places = passed.filter_map(|(drawn, place)| {
        let [x, y, z] = frame.leave(place?).to_array();
        Some(format!("{} at {x:.3}, {y:.3}, {z:.3}", drawn.node))
    });
    let kind = "author's occluder through which something is seen, as across a slit or outside of what it stands for: believed all the \
                same, so sets may lack what is behind it; draw it smaller";
    defects.name(kind, places);
}

/// Notes viewpoints from which nobody may look around.
fn note_strays(graph: &CellGraph, scene: &SourceScene, defects: &mut Defects) {
    let cells = graph.by_place();
    let stray = |viewpoint: &&SourceViewpoint| {
        let eye = viewpoint.world_from_camera.w_axis.truncate().to_array();
        cells.cell_at(eye).is_none()
    };
    let strays: Vec<_> = scene.viewpoints.iter().filter(stray).collect();
    let kind = "viewpoint outside every cell, as inside a wall: linked to the nearest";
    defects.note(kind, strays.len() as u64, || strays[0].name.clone());
}

/// An imported scene with what its file system knows of it.
#[derive(Debug)]
pub struct Source {
    /// The scene.
    pub scene: SourceScene,
    /// Its name for people.
    pub title: String,
    /// Size of the files that it was read from.
    pub bytes: u64,
}

/// A scene with the models that are published of it: equal ones once, and what is too large for one object cut.
#[must_use]
pub fn as_published(scene: SourceScene, settings: &SplitSettings, defects: &mut Defects) -> SourceScene {
    split::split(share(scene), settings, defects)
}

/// Orders objects along a Z-order curve through their middles, so that ids of neighbours are near each other and the
/// index trees above them are tight. Models follow in order of first use.
pub(crate) fn in_spatial_order(mut scene: SourceScene) -> SourceScene {
    let middle_of = |model: &SourceModel| {
        let points = model.primitives.iter().flat_map(|p| &p.positions);
        DVec3::from(Bounds::around(points.map(|p| p.map(f64::from))).center())
    };
    let of_models: Vec<DVec3> = scene.models.par_iter().map(middle_of).collect();
    let placed = |object: &SourceObject| object.world_from_object.transform_point3(of_models[object.model]);
    let middles: Vec<DVec3> = scene.objects.iter().map(placed).collect();
    let around = Bounds::around(middles.iter().map(DVec3::to_array));
    let mut order: Vec<usize> = (0..scene.objects.len()).collect();
    order.sort_by_cached_key(|i| (z_order(middles[*i], &around), *i));
    scene.objects = order.iter().map(|i| scene.objects[*i].clone()).collect();

    let mut new_of = vec![None; scene.models.len()];
    let mut models = Vec::with_capacity(scene.models.len());
    for object in &mut scene.objects {
        let new = *new_of[object.model].get_or_insert_with(|| {
            models.push(std::mem::take(&mut scene.models[object.model]));
            models.len() - 1
        });
        object.model = new;
    }
    scene.models = models;
    scene
}

/// Interleaves 21 bits of each coordinate, relative to a box.
pub(crate) fn z_order(point: DVec3, around: &Bounds) -> u64 {
    let size = around.size_m().into_iter().fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let steps = f64::from((1u32 << 21) - 1);
    let step = |axis: usize| ((point[axis] - around.min[axis]) / size * steps).clamp(0.0, steps) as u64;
    morton::code([0, 1, 2].map(step))
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use belvedere_scene::BlobName;
    use glam::DMat4;

    use super::*;
    use crate::source::{Authored, AuthoredShape, Primitive, Role};

    /// Hears whether anything was begun.
    #[derive(Default)]
    struct Begun(AtomicBool);

    impl Progress for Begun {
        fn start(&self, _: Stage, _: u64) {
            self.0.store(true, Ordering::Relaxed);
        }

        fn advance(&self, _: u64) {}
    }

    struct Nowhere;

    impl BlobSink for Nowhere {
        fn put(&self, _: &BlobName, _: Vec<u8>) -> Result<(), SinkError> {
            Ok(())
        }
    }

    /// Why a bake refuses a scene before it has begun anything.
    fn refused_at_once(scene: SourceScene) -> String {
        let source = Source {
            scene,
            title: "refused".to_owned(),
            bytes: 0,
        };
        let begun = Begun::default();
        let host = Host {
            progress: &begun,
            ..Host::taking(&Nowhere)
        };
        let refused = bake(source, &BakeSettings::default(), &mut Defects::default(), &host).unwrap_err();
        assert!(!begun.0.load(Ordering::Relaxed), "a stage was begun");
        refused.to_string()
    }

    /// A cube of a metre.
    fn cell(node: &str, least: DVec3) -> AuthoredShape {
        let faces = (0..3).flat_map(|axis| [0.0, 1.0].map(|side| (axis, side)));
        let triangles = faces.flat_map(|(axis, side)| {
            let corner = |u: f64, v: f64| {
                let mut corner = [side; 3];
                (corner[(axis + 1) % 3], corner[(axis + 2) % 3]) = (u, v);
                least + DVec3::from(corner)
            };
            let [a, b, c, d] = [corner(0., 0.), corner(1., 0.), corner(1., 1.), corner(0., 1.)];
            [[a, b, c], [a, c, d]]
        });
        AuthoredShape {
            node: node.to_owned(),
            triangles: triangles.collect(),
            said: None,
        }
    }

    #[test]
    fn cells_that_overlap_are_refused_before_anything_is_begun() {
        let scene = SourceScene {
            authored: Authored {
                cells: vec![cell("cell:a", DVec3::ZERO), cell("cell:b", DVec3::new(0.75, 0.0, 0.0))],
                ..Authored::default()
            },
            ..SourceScene::default()
        };
        let told = refused_at_once(scene);
        assert!(
            told.starts_with("author's cells `cell:a` and `cell:b` overlap by 0.250 m"),
            "{told}"
        );
    }

    #[test]
    fn a_scene_out_where_single_precision_holds_none_is_refused_with_the_way_back() {
        let corner = Primitive {
            positions: vec![[0.0; 3], [1000.0, 0.0, 0.0], [0.0, 1000.0, 0.0]],
            indices: vec![0, 1, 2],
            ..Primitive::default()
        };
        let scene = SourceScene {
            models: vec![SourceModel {
                primitives: vec![corner],
                ..SourceModel::default()
            }],
            objects: vec![SourceObject {
                source_node: "block".to_owned(),
                part: 0,
                model: 0,
                world_from_object: DMat4::from_translation(DVec3::new(1e9, 0.0, 1e9)),
                role: Role::Ordinary,
            }],
            ..SourceScene::default()
        };
        assert_eq!(
            refused_at_once(scene),
            "object 0 (`block`) reaches 1.000001e9 m from the origin, where numbers of single precision are 64 m apart; at most 1e9 m \
             are possible: move the scene to its origin"
        );
    }

    #[test]
    fn more_placed_triangles_than_can_be_numbered_are_refused_before_anything_is_begun() {
        let dense = Primitive {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            indices: [0, 1, 2].repeat(70_000),
            ..Primitive::default()
        };
        let object = SourceObject {
            source_node: "dense".to_owned(),
            part: 0,
            model: 0,
            world_from_object: DMat4::IDENTITY,
            role: Role::Ordinary,
        };
        let scene = SourceScene {
            models: vec![SourceModel {
                primitives: vec![dense],
                ..SourceModel::default()
            }],
            objects: vec![object; 70_000],
            ..SourceScene::default()
        };
        let wanted = WorldError::TooManyCopies { count: 4_900_000_000 };
        assert_eq!(refused_at_once(scene), wanted.to_string());
        let page = include_str!("../../../docs/PROCEDURAL.md");
        let told = WorldError::TooManyCopies { count: 4_320_000_000 };
        assert!(page.contains(&format!(
            "| triangles with all copies, in a bake | 4,294,967,295 | {told} |"
        )));
    }
}
