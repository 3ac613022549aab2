//! How fast fields are compiled and evaluated.
#[path = "../tests/engine_common/fields.rs"]
mod fields;
use imp::engine::*;
use std::sync::Arc;
use std::time::Instant;
fn main() {
    for example in [fields::torus(), fields::blobs(14), fields::spheres(100)] {
        for backend in [Backend::MachineCode, Backend::Interpreter] {
            let t = Instant::now();
            let program = Arc::new(Program::with_backend(
                &example.graph,
                &[example.root],
                3,
                backend,
            ));
            let field = CompiledField::new(program.clone(), example.q.clone());
            const N: usize = 256;
            let x: Vec<f64> = (0..N).map(|i| (i as f64 * 0.37) % 2.0 - 1.0).collect();
            let y: Vec<f64> = (0..N).map(|i| (i as f64 * 0.73) % 2.0 - 1.0).collect();
            let z: Vec<f64> = (0..N).map(|i| (i as f64 * 0.19) % 2.0 - 1.0).collect();
            let p = [&x[..], &y[..], &z[..]];
            let mut v = vec![0.0; N];
            let mut g = vec![vec![0.0; N]; 3];
            let mut gg: Vec<&mut [f64]> = g.iter_mut().map(|c| &mut c[..]).collect();
            let mut h = vec![vec![0.0; N]; example.q.len()];
            let mut hh: Vec<&mut [f64]> = h.iter_mut().map(|c| &mut c[..]).collect();
            let t0 = t.elapsed();
            let t = Instant::now();
            field.values(&p, &mut v);
            let t1 = t.elapsed();
            let t = Instant::now();
            field.gradients(&p, &mut v, &mut gg);
            let t2 = t.elapsed();
            let t = Instant::now();
            field.parameter_gradients(&p, &mut v, &mut gg, &mut hh);
            let t3 = t.elapsed();
            println!(
                "{} {:?} new {t0:?} compile {t1:?} {t2:?} {t3:?}",
                example.name,
                program.backend()
            );
            let rounds = if backend == Backend::MachineCode {
                2000
            } else {
                200
            };
            let rate = |t: Instant| (rounds * N) as f64 / t.elapsed().as_secs_f64() / 1e6;
            let t = Instant::now();
            for _ in 0..rounds {
                field.values(&p, &mut v);
            }
            let r1 = rate(t);
            let t = Instant::now();
            for _ in 0..rounds {
                field.gradients(&p, &mut v, &mut gg);
            }
            let r2 = rate(t);
            let t = Instant::now();
            for _ in 0..rounds {
                field.parameter_gradients(&p, &mut v, &mut gg, &mut hh);
            }
            let r3 = rate(t);
            let t = Instant::now();
            for _ in 0..100000 {
                std::hint::black_box(field.value(glam::DVec3::new(0.1, 0.2, 0.3)));
            }
            let single = t.elapsed() / 100000;
            println!("   Mpt/s {r1:.2} {r2:.2} {r3:.2} single {single:?}");
        }
    }
}
