//! `belvedere mesh lod FILE`: the levels of detail of each mesh, as a table and as GLBs.
//!
//! D. Schmalstieg, *The Remote Rendering Pipeline* (1997), chapter 6: fragments are joined, superfluous vertices and
//! triangles removed, levels made, and for each the distance from which its error is small enough on the screen.

use std::{
    fs,
    path::{Path, PathBuf},
    time::Instant,
};

use anyhow::Context;
use belvedere_bake::{
    defect::Defect,
    glb::{self, GlbInput, lattice::Lattice},
    lod::{self, LodLevel, LodSettings, Measures, Method, OctreeSettings, Order, join},
    source::{Primitive, SourceModel, SourceScene, Topology},
};
use belvedere_scene::{
    Bounds,
    object::{SCREEN_ERROR_PX, SCREEN_HEIGHT_PX, VIEW_ANGLE_DEG},
};
use serde::Serialize;

use super::super::output::{bytes, print, print_json, table};

/// The coarsest level has about so many triangles, as in the thesis.
const COARSEST_SHAPES: usize = 16;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A glTF 2.0 scene (.glb, .gltf or a .zip of one) or a floor plan (.plan)
    file: PathBuf,
    /// Most levels of a mesh, the source included; 1 only removes what is superfluous
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u16).range(1..=100))]
    levels: u16,
    /// Who makes the levels: octree, quadric, or for each level the one whose error is smaller
    #[arg(long, default_value_t)]
    method: Method,
    /// The largest error on the screen, as a share of the picture's height: `1%`; by default a pixel of 1080
    #[arg(long, value_parser = share, default_value_t = SCREEN_ERROR_PX / SCREEN_HEIGHT_PX, hide_default_value = true)]
    error: f64,
    /// The vertical view angle in degrees
    #[arg(long, value_parser = degrees, default_value_t = VIEW_ANGLE_DEG)]
    view_angle: f64,
    #[command(flatten)]
    octree: OctreeArgs,
    /// Keep levels whose error is hardly smaller than that of a coarser one, and those that take no fewer bytes than a finer one
    /// once compressed, which a bake leaves out
    #[arg(long)]
    all: bool,
    /// Leave fragments that follow each other apart
    #[arg(long)]
    no_join: bool,
    /// Print as JSON
    #[arg(long)]
    json: bool,
    /// The folder in which each level is written as a plain GLB, for any reader; `size` is of the compressed form that a bake
    /// publishes, `file` of this one
    #[arg(short, long)]
    output: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
#[command(next_help_heading = "How the octree works")]
struct OctreeArgs {
    /// Which clusters are formed first
    #[arg(long, value_enum, default_value_t = OrderArg::LeastError)]
    order: OrderArg,
    /// What the error area counts when a cluster's representative is chosen
    #[arg(long, value_parser = weight, default_value_t = Measures::default().error_area)]
    error_area: f64,
    /// What the error volume counts
    #[arg(long, value_parser = weight, default_value_t = Measures::default().error_volume)]
    error_volume: f64,
    /// What the distance from the weighted mean counts
    #[arg(long, value_parser = weight, default_value_t = Measures::default().weighted_mean)]
    weighted_mean: f64,
    /// What the quadric error counts
    #[arg(long, value_parser = weight, default_value_t = Measures::default().quadric)]
    quadric_error: f64,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum OrderArg {
    /// The one that costs the least error
    LeastError,
    /// The deepest, and of several the one with the most vertices
    MostVertices,
    /// The deepest, and of several the one with the fewest vertices
    FewestVertices,
}

impl From<OctreeArgs> for OctreeSettings {
    fn from(args: OctreeArgs) -> Self {
        Self {
            order: match args.order {
                OrderArg::LeastError => Order::LeastError,
                OrderArg::MostVertices => Order::MostVertices,
                OrderArg::FewestVertices => Order::FewestVertices,
            },
            measures: Measures {
                error_area: args.error_area,
                error_volume: args.error_volume,
                weighted_mean: args.weighted_mean,
                quadric: args.quadric_error,
            },
        }
    }
}

/// What is printed: lengths in units of the mesh's own space.
#[derive(Debug, Serialize)]
struct Report {
    /// How many fragments were joined to another.
    joined: usize,
    meshes: Vec<MeshReport>,
    /// What was wrong with the source.
    defects: Vec<Defect>,
}

#[derive(Debug, Serialize)]
struct MeshReport {
    name: String,
    /// What lengths are counted in.
    metres_per_unit: f64,
    levels: Vec<LevelReport>,
    seconds: f64,
}

#[derive(Debug, Serialize)]
struct LevelReport {
    level: usize,
    triangles: u64,
    lines: u64,
    points: u64,
    /// From this distance of the eye from the mesh's box on, the level is good enough.
    switch_distance_m: f64,
    /// The same from the middle of the mesh, as VRML's ranges are.
    range_m: f64,
    geometric_error_m: f64,
    /// As it would be published, compressed.
    bytes: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    /// Of the file, which is plain, for any reader.
    #[serde(skip_serializing_if = "Option::is_none")]
    file_bytes: Option<usize>,
}

pub(super) fn run(args: Args) -> anyhow::Result<()> {
    let (mut scene, defects) = super::read_scene(&args.file)?;
    let joined = if args.no_join { 0 } else { join::join(&mut scene) };
    scene.models.iter().try_for_each(super::ensure_in_reach)?;
    let settings = LodSettings {
        method: args.method,
        octree: args.octree.into(),
        max_levels: usize::from(args.levels),
        min_shapes: 1,
        usual_share: 0.95,
        worthwhile_share: 1.0,
        dominated: if args.all {
            0.0
        } else {
            LodSettings::default().dominated
        },
        coarsest_shapes: COARSEST_SHAPES,
        ..LodSettings::default()
    }
    .for_materials(&scene.materials);
    let tangent = 2.0 * (args.view_angle.to_radians() / 2.0).tan();
    let pictures = Pictures(&scene);
    if let Some(folder) = &args.output {
        fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
        pictures.write_into(folder)?;
    }
    let mut meshes = Vec::new();
    for (number, model) in scene.models.iter().enumerate() {
        let started = Instant::now();
        let chain = lod::chain(&lod::clean(model, &settings), &settings);
        let seconds = started.elapsed().as_secs_f64();
        let radius_m = radius_m(model);
        let lattice = Lattice::alone(&model.primitives);
        let mut worst_m = 0.0f64;
        let mut levels: Vec<LevelReport> = Vec::with_capacity(chain.levels.len());
        for mesh in &chain.levels {
            let lattice = lattice.of_error(mesh.geometric_error);
            let mesh = lod::rounded(mesh, lattice);
            let glb = pictures.glb(&mesh, lattice);
            let saves = levels.last().is_none_or(|finer| glb.len() < finer.bytes);
            if !saves && !args.all {
                continue;
            }
            let level = levels.len();
            let written = args.output.as_ref().map(|folder| {
                let name = format!("mesh{number}.lod{level}.glb");
                let plain = glb::plain(&glb, "")?;
                write(&folder.join(&name), &plain).map(|()| (name, plain.len()))
            });
            let (file, file_bytes) = written.transpose()?.unzip();
            let geometric_error_m = worst_m.max(mesh.geometric_error);
            worst_m = geometric_error_m;
            let switch_distance_m = geometric_error_m / (args.error * tangent);
            levels.push(LevelReport {
                level,
                triangles: mesh.triangles,
                lines: mesh.lines,
                points: points_of(&mesh),
                switch_distance_m,
                range_m: switch_distance_m + radius_m,
                geometric_error_m,
                bytes: glb.len(),
                file,
                file_bytes,
            });
        }
        meshes.push(MeshReport {
            name: model.name.clone(),
            metres_per_unit: super::metres_per_unit(&scene, number),
            levels,
            seconds,
        });
    }
    let report = Report {
        joined,
        meshes,
        defects,
    };
    if args.json {
        print_json(&report)
    } else {
        print(&report.to_text())
    }
}

impl Report {
    fn to_text(&self) -> String {
        let mut lines = Vec::new();
        if self.joined > 0 {
            lines.push(format!("{} fragments joined to another", self.joined));
        }
        for mesh in &self.meshes {
            let units = super::note_of_units(mesh.metres_per_unit).map_or_else(String::new, |note| format!("; {note}"));
            lines.push(format!("{}: {:.2} s{units}", mesh.name, mesh.seconds));
            let rows: Vec<_> = mesh.levels.iter().map(LevelReport::row).collect();
            let is_written = mesh.levels.iter().any(|level| level.file.is_some());
            let head = [
                "level",
                "triangles",
                "lines",
                "points",
                "range",
                "error",
                "size",
                "file",
            ];
            lines.push(table(&head[..head.len() - usize::from(!is_written)], &rows));
        }
        lines.join("\n")
    }
}

impl LevelReport {
    fn row(&self) -> Vec<String> {
        let mut row = vec![
            self.level.to_string(),
            self.triangles.to_string(),
            self.lines.to_string(),
            self.points.to_string(),
            format!("{:.4}", self.range_m),
            format!("{:.6}", self.geometric_error_m),
            bytes(self.bytes as u64),
        ];
        row.extend(self.file_bytes.map(|file| bytes(file as u64)));
        row
    }
}

fn points_of(level: &LodLevel) -> u64 {
    let of_points = level.primitives.iter().filter(|p| p.topology == Topology::Points);
    of_points.map(Primitive::count).sum::<usize>() as u64
}

/// The pictures of a scene, beside its levels.
struct Pictures<'a>(&'a SourceScene);

impl Pictures<'_> {
    fn name(&self, image: usize) -> String {
        let ext = self.0.images.get(image).map_or("bin", |picture| picture.ext);
        format!("image{image}.{ext}")
    }

    fn write_into(&self, folder: &Path) -> anyhow::Result<()> {
        for (image, picture) in self.0.images.iter().enumerate() {
            write(&folder.join(self.name(image)), &picture.bytes)?;
        }
        Ok(())
    }

    fn glb(&self, level: &LodLevel, lattice: Lattice) -> Vec<u8> {
        let input = GlbInput {
            primitives: &level.primitives,
            materials: &self.0.materials,
            textures: &self.0.textures,
            image_uri: &|image| self.name(image),
        };
        glb::write(&input, lattice).bytes
    }
}

fn write(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}

/// Radius of the sphere around a mesh's box.
fn radius_m(model: &SourceModel) -> f64 {
    let points = model.primitives.iter().flat_map(|p| &p.positions);
    let bounds = Bounds::around(points.map(|p| p.map(f64::from)));
    if bounds.is_empty() {
        return 0.0;
    }
    0.5 * bounds.size_m().iter().map(|side| side * side).sum::<f64>().sqrt()
}

/// `1%` or `0.01`.
fn share(text: &str) -> Result<f64, String> {
    let (number, unit) = text.strip_suffix('%').map_or((text, 1.0), |number| (number, 0.01));
    let share = number.trim().parse::<f64>().map(|number| number * unit);
    share
        .ok()
        .filter(|share| *share > 0.0 && *share <= 1.0)
        .ok_or_else(|| format!("`{text}` is no share of the picture's height, as `1%` or `0.01` is"))
}

fn degrees(text: &str) -> Result<f64, String> {
    let angle = text.parse::<f64>().ok();
    angle
        .filter(|angle| *angle > 0.0 && *angle < 180.0)
        .ok_or_else(|| format!("`{text}` is no angle between 0 and 180 degrees"))
}

fn weight(text: &str) -> Result<f64, String> {
    let weight = text.parse::<f64>().ok();
    weight
        .filter(|weight| weight.is_finite() && *weight >= 0.0)
        .ok_or_else(|| format!("`{text}` is no weight: a number from 0 on"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_read_in_percent_and_plainly() {
        assert_eq!(share("1%"), Ok(0.01));
        assert_eq!(share("0.5 %"), Ok(0.005));
        assert_eq!(share("0.25"), Ok(0.25));
        for wrong in ["", "%", "0", "-1%", "101%", "nan", "inf", "one"] {
            assert!(share(wrong).is_err(), "{wrong}");
        }
    }
}
