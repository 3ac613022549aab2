//! The particle methods on surfaces with closed forms.

mod sample_fields;
use glam::DVec3;
use imp::sample::{Method, Options};
use sample_fields::*;

#[test]
fn survey() {
    for method in [Method::Kinematic, Method::Dynamic] {
        let fields: Vec<(&str, Box<dyn imp::engine::Field>, Option<f64>)> = vec![
            ("sphere", Box::new(sphere(DVec3::ZERO, 1.0)), Some(2.0)),
            ("sphere*", Box::new(sphere(DVec3::ZERO, 1.0)), None),
            ("far", Box::new(sphere(DVec3::new(1000.0, 20.0, 3.0), 1.0)), None),
            ("torus", Box::new(torus()), Some(2.0)),
            ("torus*", Box::new(torus()), None),
            ("heart", Box::new(heart()), Some(2.0)),
            ("blobs", Box::new(blobs()), Some(2.0)),
            ("blobs5", Box::new(blobs()), Some(20.0)),
            ("blobs*", Box::new(blobs()), None),
            ("spurious", Box::new(spurious_circle()), Some(3.0)),
        ];
        for (name, field, half) in fields {
            let options = Options { method, bounds: half.map(|h| cube(field.dimension(), h)), ..Options::default() };
            let o = run(&*field, &options);
            println!("{name} {method:?} {:?}", o.statistics);
        }
    }
}
