//! How does a model become a smooth LOD?

mod collapse;
mod quadric;
pub mod quantise;
mod script;

use belvedere_scene::smooth::geometry::{FEATURES, HOODS, USUAL_WEIGHTS, Weights};
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
        let fit = std::rc::Rc::new(std::cell::RefCell::new(vec![([[0f64; FEATURES]; FEATURES], [0f64; FEATURES], 0usize); HOODS]));
        let f2 = fit.clone();
        undo.on_hood = Some(Box::new(move |hood, d| {
            let mut f = f2.borrow_mut();
            let (a, b, n) = &mut f[hood.kind];
            let s = hood.features.iter().flatten().map(|x| f64::from(*x).powi(2)).sum::<f64>() + 256.0;
            *n += 1;
            for axis in 0..3 {
                for i in 0..FEATURES {
                    b[i] += f64::from(hood.features[i][axis]) * 16.0 * f64::from(d[axis]) / s;
                    for j in 0..FEATURES {
                        a[i][j] += f64::from(hood.features[i][axis]) * f64::from(hood.features[j][axis]) / s;
                    }
                }
            }
        }));
        let mut w = Writer::default();
        Replay::new(mesh.bits, USUAL_WEIGHTS, (usize::MAX, usize::MAX)).write(&mut w, &mut undo, |_, _, _| {});
        undo = script::Undo::new(mesh, &tree, coarse);
        for (kind, (a, b, n)) in fit.borrow_mut().iter_mut().enumerate() {
            for i in 0..FEATURES { a[i][i] += 1e-3 * (*n as f64 + 1.0) * 0.01; b[i] += 0.0; }
            // gauss
            for i in 0..FEATURES {
                for r in i + 1..FEATURES {
                    let k = a[r][i] / a[i][i];
                    for c in i..FEATURES { a[r][c] -= k * a[i][c]; }
                    b[r] -= k * b[i];
                }
            }
            let mut x = [0f64; FEATURES];
            for i in (0..FEATURES).rev() {
                x[i] = (b[i] - (i + 1..FEATURES).map(|c| a[i][c] * x[c]).sum::<f64>()) / a[i][i];
            }
            for i in 0..FEATURES { weights[kind][i] = (x[i] * 64.0).round().clamp(-127.0, 127.0) as i8; }
            if *n > 0 && std::env::var("FITV").is_ok() { println!("   kind {kind} n {n} {:?}", weights[kind]); }
        }
    }
    let mut writer = Writer::default();
    let mut replay = Replay::new(mesh.bits, weights, (usize::MAX, usize::MAX));
    replay.write(&mut writer, &mut undo, |_, _, _| {});
    println!("   cluster {:.0} ms  replay {:.0} ms  {} passes, {} decisions/vertex {}", t1.as_secs_f64() * 1e3, (t.elapsed() - t1).as_secs_f64() * 1e3, tree.passes.len(), writer.decisions() as f64 / mesh.positions.len() as f64,
       replay.tally.iter().map(|(n, c)| format!("{n} {:.2} ", c / mesh.positions.len() as f64)).collect::<String>());
    let mut out: Vec<u8> = weights.iter().flatten().map(|w| *w as u8).collect();
    out.extend(writer.finish(&[]).0);
    out
}
