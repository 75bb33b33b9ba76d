//! How does a model become a smooth LOD?

mod collapse;
mod quadric;
pub mod quantise;
mod script;
mod weights;

use belvedere_scene::smooth::geometry::USUAL_WEIGHTS;
use belvedere_scene::smooth::rans::Writer;
use belvedere_scene::smooth::replay::Replay;

use quantise::QuantisedMesh;

/// Writes a mesh.
pub fn encode(mesh: &QuantisedMesh) -> Vec<u8> {
    let t = std::time::Instant::now();
    let tree = collapse::cluster(mesh);
    let t1 = t.elapsed();
    let precision: f64 = std::env::var("PREC").ok().and_then(|v| v.parse().ok()).unwrap_or(0.25);
    let mut coarse: Vec<u32> = Vec::new();
    for i in 0..tree.passes.len() {
        let step = if i == 0 { 0.0 } else { tree.passes[i - 1].deviation * precision };
        let lacking = (step.max(1.0).log2() as u32).min(mesh.bits - 1);
        coarse.push(coarse.last().map_or(lacking, |&finer| lacking.max(finer)));
    }
    let mut undo = script::Undo::new(mesh, &tree, coarse.clone());
    let mut weights = USUAL_WEIGHTS;
    if std::env::var("FIT").is_ok() {
        undo.fit = Some(weights::Fit::new());
        let mut w = Writer::default();
        Replay::new(mesh.bits, USUAL_WEIGHTS, (usize::MAX, usize::MAX)).write(&mut w, &mut undo, |_, _, _| {});
        weights = undo.fit.take().map_or(USUAL_WEIGHTS, |fit| fit.weights());
        undo = script::Undo::new(mesh, &tree, coarse);
        if std::env::var("FITV").is_ok() { for (k, w) in weights.iter().enumerate() { println!("  kind {k} {w:?}"); } }
    }
    let mut writer = Writer::default();
    let mut replay = Replay::new(mesh.bits, weights, (usize::MAX, usize::MAX));
    replay.write(&mut writer, &mut undo, |_, _, _| {});
    let mut out: Vec<u8> = weights.iter().flatten().map(|w| *w as u8).collect();
    out.extend(writer.finish(&[]).0);
    out
}
