//! How near to the source are levels, at equal numbers of triangles, and how fast are they made? Prints a table.
//! `cargo bench -p belvedere-bake --bench lod -- [mesh,mesh …]`
//!
//! Each level's root mean square distance, in % of the diagonal of the source's box, beside meshoptimizer's simplifiers in
//! the same run. Those are given positions only, each once, without seams: their best case. Ours keep attributes,
//! materials and lines. The octree is asked for as many triangles as `simplifySloppy` left, the quadric generator for as
//! many as `simplifyWithUpdate` left. Times are CPU time of one thread.

#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]

mod meshes;
mod timing;

use std::collections::BTreeMap;

use belvedere_bake::lod::error::rms;
use belvedere_bake::lod::generate::Generator;
use belvedere_bake::lod::{LodSettings, Measures, Method, OctreeSettings, Order};
use belvedere_bake::source::{Primitive, SourceModel};
use meshopt::{SimplifyOptions, VertexDataAdapter};
use timing::timed;

/// The levels, as shares of the source's triangles.
const SHARES: [f64; 5] = [0.5, 0.25, 0.1, 0.05, 0.01];
/// Points on each surface.
const SAMPLES: usize = 8000;

fn main() {
    let wanted = std::env::args().nth(1).filter(|name| !name.starts_with('-'));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| run(wanted.as_deref()));
}

/// A simplifier: how it is called in the table, and its mesh with at most about so many triangles.
type Contender<'a> = (&'static str, Box<dyn Fn(usize) -> Option<Vec<Primitive>> + 'a>);

fn run(wanted: Option<&str>) {
    println!("RMS in % of the diagonal (× triangles that were asked for)");
    println!(
        "{:10} {:>9} {:>6} | octree, thesis, quadric | sloppy, simplify, update",
        "mesh", "triangles", "level"
    );
    let mut ratios: BTreeMap<(&str, usize), Vec<f64>> = BTreeMap::new();
    let mut speeds: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for (name, make) in meshes::ALL {
        if wanted.is_none_or(|wanted| wanted.split(',').any(|w| w == name)) {
            mesh(name, &make(), &mut ratios, &mut speeds);
        }
    }
    println!("\ngeometric means of RMS ratios at {SHARES:?}, and how often the target was met");
    for pair in [
        "octree / sloppy",
        "thesis / sloppy",
        "quadric / update",
        "quadric / simplify",
    ] {
        let row = (0..SHARES.len()).filter_map(|share| Some((share, ratios.get(&(pair, share))?)));
        let row = row.map(|(_, ratios)| format!("{:6.3} ({:2})", mean(ratios), ratios.len()));
        println!("{pair:20} {}", row.collect::<Vec<_>>().join(" "));
    }
    println!("\nmillion triangles of the source per second, to 10 %: least, geometric mean, most");
    for (name, speeds) in &speeds {
        let (least, most) = speeds
            .iter()
            .fold((f64::MAX, 0.0f64), |(l, m), &s| (l.min(s), m.max(s)));
        println!("{name:10} {least:6.2} {:6.2} {most:6.2}", mean(speeds));
    }
}

fn mean(ratios: &[f64]) -> f64 {
    (ratios.iter().map(|ratio| ratio.ln()).sum::<f64>() / ratios.len() as f64).exp()
}

fn mesh(
    name: &'static str,
    model: &SourceModel,
    ratios: &mut BTreeMap<(&str, usize), Vec<f64>>,
    speeds: &mut BTreeMap<&str, Vec<f64>>,
) {
    let settings = |method, octree| LodSettings {
        method,
        octree,
        ..LodSettings::default()
    };
    let octree = settings(Method::Octree, OctreeSettings::default());
    let thesis = OctreeSettings {
        order: Order::MostVertices,
        measures: Measures::THESIS,
    };
    let thesis = settings(Method::Octree, thesis);
    let quadric = settings(Method::Quadric, OctreeSettings::default());
    let ours: [Contender<'_>; 3] = [
        (
            "octree",
            Box::new(|target| Generator::new(model, &octree).octree_mesh(target)),
        ),
        (
            "thesis",
            Box::new(|target| Generator::new(model, &thesis).octree_mesh(target)),
        ),
        (
            "quadric",
            Box::new(|target| Generator::new(model, &quadric).quadric_mesh(target)),
        ),
    ];
    let welded = welded(model);
    let theirs: [Contender<'_>; 3] = [
        ("sloppy", Box::new(|target| sloppy(&welded, target))),
        ("simplify", Box::new(|target| simplify(&welded, target))),
        ("update", Box::new(|target| update(&welded, target))),
    ];
    let triangles = model.triangle_count();
    let million = triangles as f64 / 1e6;
    for (name, make) in ours.iter().chain(&theirs) {
        let (seconds, mesh) = timed(|| make(triangles / 10));
        if mesh.is_some() {
            speeds.entry(name).or_default().push(million / seconds);
        }
    }
    let diagonal = diagonal(&welded);
    for (level, share) in SHARES.into_iter().enumerate() {
        let target = (share * triangles as f64) as usize;
        let mut measured = BTreeMap::new();
        let mut row = Vec::new();
        let meshes: Vec<_> = theirs
            .iter()
            .map(|(name, make)| (*name, target, make(target)))
            .collect();
        let left = |i: usize| meshes[i].2.as_ref().map_or(target, |mesh| count(mesh)).max(4);
        let asked = [left(0), left(0), left(2)];
        let own = ours
            .iter()
            .zip(asked)
            .map(|((name, make), asked)| (*name, asked, make(asked)));
        for (name, asked, mesh) in own.chain(meshes.iter().cloned()) {
            let Some(mesh) = mesh else {
                row.push("    none       ".to_owned());
                continue;
            };
            let error = 100.0 * rms(&model.primitives, &mesh, SAMPLES) / diagonal;
            let share = count(&mesh) as f64 / asked as f64;
            row.push(format!("{error:7.4} (×{share:4.2})"));
            if share <= 1.15 && error.is_finite() && error > 0.0 {
                measured.insert(name, error);
            }
        }
        println!("{name:10} {triangles:9} {:4} % | {}", 100.0 * share, row.join(" "));
        for (pair, ours, theirs) in [
            ("octree / sloppy", "octree", "sloppy"),
            ("thesis / sloppy", "thesis", "sloppy"),
            ("quadric / update", "quadric", "update"),
            ("quadric / simplify", "quadric", "simplify"),
        ] {
            if let (Some(ours), Some(theirs)) = (measured.get(ours), measured.get(theirs)) {
                ratios.entry((pair, level)).or_default().push(ours / theirs);
            }
        }
    }
}

fn count(primitives: &[Primitive]) -> usize {
    primitives.iter().map(|p| p.triangles().count()).sum()
}

/// All triangles as one primitive with each position once.
fn welded(model: &SourceModel) -> Primitive {
    let mut welded = Primitive::default();
    let mut numbers = BTreeMap::new();
    for corner in model.primitives.iter().flat_map(Primitive::triangles).flatten() {
        let next = welded.positions.len() as u32;
        let number = *numbers.entry(corner.map(|x| (x + 0.0).to_bits())).or_insert(next);
        if number == next {
            welded.positions.push(corner);
        }
        welded.indices.push(number);
    }
    welded
}

fn diagonal(primitive: &Primitive) -> f64 {
    let extent = |axis: usize| {
        let along = primitive.positions.iter().map(|p| f64::from(p[axis]));
        let (low, high) = along.fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
        high - low
    };
    [0, 1, 2]
        .map(|axis| extent(axis).powi(2))
        .into_iter()
        .sum::<f64>()
        .sqrt()
}

fn with(positions: Vec<[f32; 3]>, indices: Vec<u32>) -> Option<Vec<Primitive>> {
    (!indices.is_empty()).then(|| {
        vec![Primitive {
            positions,
            indices,
            ..Primitive::default()
        }]
    })
}

fn vertices(mesh: &Primitive) -> VertexDataAdapter<'_> {
    VertexDataAdapter::new(meshopt::typed_to_bytes(&mesh.positions), 12, 0).unwrap()
}

fn sloppy(mesh: &Primitive, target: usize) -> Option<Vec<Primitive>> {
    let indices = meshopt::simplify_sloppy(&mesh.indices, &vertices(mesh), 3 * target, f32::MAX, None);
    with(mesh.positions.clone(), indices)
}

fn simplify(mesh: &Primitive, target: usize) -> Option<Vec<Primitive>> {
    let none = SimplifyOptions::None;
    let indices = meshopt::simplify(&mesh.indices, &vertices(mesh), 3 * target, f32::MAX, none, None);
    with(mesh.positions.clone(), indices)
}

fn update(mesh: &Primitive, target: usize) -> Option<Vec<Primitive>> {
    let (mut positions, mut indices) = (mesh.positions.clone(), mesh.indices.clone());
    let (none, target) = (SimplifyOptions::None, 3 * target);
    let left = meshopt::simplify_with_update(
        &mut indices,
        &mut positions,
        &mut [],
        &[],
        0,
        None,
        target,
        f32::MAX,
        none,
        None,
    );
    indices.truncate(left);
    with(positions, indices)
}
