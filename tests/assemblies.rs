//! Parts that meet or fit: nothing comes apart and nothing collides.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use nalgebra::{Matrix3, Point3, Vector3};
use sombrero::io::Document;

#[test]
fn scratch() {
    let Ok(dir) = std::env::var("CASES") else { return };
    for file in std::env::var("FILES").unwrap().split(',') {
        let original = Document::read(format!("{dir}/{file}").as_ref()).unwrap();
        let coefficients: usize = std::env::var("M").map_or(60, |m| m.parse().unwrap());
        let mut options = sombrero::EmbedOptions { fewer_if_small: true, ..Default::default() };
        options.parameters.basis.coefficients = coefficients;
        let start = std::time::Instant::now();
        let marked = match sombrero::embed(&original, sombrero::watermark::Secret([7; 32]), &options) {
            Ok(marked) => marked,
            Err(error) => { println!("{file}: {error}"); continue }
        };
        let took = start.elapsed().as_secs_f64();
        let model = sombrero::Model::of_scene(original.soup(), &original.scene());
        let coupling = model.coupling();
        let scene = original.scene();
        let copy = Document::parse_within(marked.bytes.clone(), Some(original.extension()), Default::default()).unwrap();
        let places = |d: &Document| { let mut all = d.points().to_vec(); for p in &scene.places { let r = p.vertices.start as usize..p.vertices.end as usize; all.extend(d.points()[r].iter().map(|x| p.at(x))); } all };
        let (a, b) = (places(&original), places(&copy));
        let tol = 2e-6 * model.largest_side();
        let (mut before, mut after, mut pairs) = (0.0_f64, 0.0_f64, 0);
        let mut order: Vec<usize> = (0..a.len()).collect();
        order.sort_by(|&i, &j| a[i].x.total_cmp(&a[j].x));
        for (n, &i) in order.iter().enumerate() { for &j in order[n+1..].iter().take_while(|&&j| a[j].x - a[i].x <= tol) {
            let d = (a[i] - a[j]).norm();
            if d <= tol { pairs += 1; before = before.max(d); after = after.max((b[i] - b[j]).norm()); }
        } }
        println!("{file}: side {:.3} rows {} max {:.2e} rms {:.2e} log10p {:.1} noise {:.1} pairs {pairs} crack {before:.2e} -> {after:.2e}, {took:.2} s, {:?}", model.largest_side(), coupling.rows().count(), marked.report.distortion.max, marked.report.distortion.rms, marked.report.log10_p, marked.report.log10_p_after_noise, marked.report.warnings);
        let out = format!("/tmp/marked_{file}");
        std::fs::write(out, marked.bytes).unwrap();
    }
    let _ = (Matrix3::<f64>::identity(), Point3::<f64>::origin(), Vector3::<f64>::zeros());
}
