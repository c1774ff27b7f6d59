//! Specs are read and written; every attack leaves a mesh or says why not.

use super::*;
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sombrero_mesh::repair;
use sombrero_shapes as shapes;

fn battery() -> Vec<Attack> {
    let specs = "none reorder noise:amplitude=0.01 smooth transform simplify:ratio=0.5 watermark crop:fraction=0.333 \
        laplacian quantize:bits=8 affine:strength=0.5 projective:strength=0.5 ffd:strength=0.1 \
        subdivide:scheme=midpoint subdivide:scheme=loop remesh:length=1.5 isosurface:resolution=16 \
        coordinate-noise:amplitude=0.01 crop:vertices=0.3";
    parse_list(specs).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn every_sequence_leaves_a_mesh_with_known_sources(order in prop::collection::vec(0usize..19, 1..5), seed in any::<u64>()) {
        let soup = shapes::bumpy_sphere(700);
        let attacks: Vec<Attack> = order.iter().map(|&i| battery()[i]).collect();
        let run = || apply_all(&attacks, &soup, &mut ChaCha8Rng::seed_from_u64(seed));
        let attacked = match run() {
            // Repeated cropping and simplifying may leave too little for a second mark.
            Err(AttackError::SecondMark(_)) => return Ok(()),
            other => other.unwrap(),
        };
        prop_assert_eq!(&attacked, &run().unwrap(), "same seed, same mesh");
        prop_assert_eq!(attacked.source.len(), attacked.soup.points.len());
        prop_assert!(!attacked.soup.triangles.is_empty());
        prop_assert!(repair(&attacked.soup).report.is_clean());
        let mut sources: Vec<u32> = attacked.source.iter().flatten().copied().collect();
        let count = sources.len();
        sources.sort_unstable();
        sources.dedup();
        prop_assert_eq!(sources.len(), count, "no two vertices from one");
    }
}

#[test]
fn in_place_attacks_move_and_nothing_else() {
    let soup = shapes::bumpy_sphere(300);
    for spec in [
        "laplacian",
        "quantize:bits=6",
        "affine:strength=0.2",
        "projective:strength=0.2",
        "ffd:strength=0.05",
    ] {
        let draw = |seed| apply(&spec.parse().unwrap(), &soup, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
        let attacked = draw(1);
        assert_eq!(attacked.soup.triangles, soup.triangles);
        assert!(attacked.source.iter().enumerate().all(|(v, s)| *s == Some(v as u32)));
        assert_ne!(attacked.soup.points, soup.points);
        let chance = spec.contains("strength");
        assert_eq!(attacked.soup.points != draw(2).soup.points, chance, "{spec}");
    }
}

#[test]
fn cropping_and_reordering_are_undone_by_the_correspondence() {
    let soup = shapes::bumpy_sphere(700);
    let attacks = ["reorder", "crop:fraction=0.5"].map(|s| s.parse().unwrap());
    let attacked = apply_all(&attacks, &soup, &mut ChaCha8Rng::seed_from_u64(3)).unwrap();
    let found = attacked.correspondence(soup.points.len());
    assert!(found.iter().zip(&soup.points).all(|(f, p)| f.is_none_or(|f| f == *p)));
    assert_eq!(found.iter().flatten().count(), attacked.soup.points.len());
}

#[test]
fn meshes_of_any_size_are_attacked_or_refused() {
    for scale in [1e-320, 1e-200, 1e-100, 1.0, 1e60, 1e150, 1e300] {
        let mut soup = shapes::bumpy_sphere(200);
        soup.points.iter_mut().for_each(|p| *p *= scale);
        for attack in battery().iter().filter(|attack| !matches!(attack, Attack::SecondMark(_))) {
            let attacked = apply(attack, &soup, &mut ChaCha8Rng::seed_from_u64(4));
            if scale <= 1e60 && scale > 1e-300 {
                let bounds = attacked.unwrap().soup.bounding_box().unwrap();
                let sides = bounds.largest_side() / scale;
                assert!((0.1..20.0).contains(&sides), "{attack} at {scale}: {sides}");
            }
        }
    }
}

#[test]
fn senseless_parameters_are_refused() {
    let soup = shapes::sphere(1);
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    for attack in [
        Attack::from(Noise { amplitude: -1.0 }),
        Noise { amplitude: f64::NAN }.into(),
        Simplification { ratio: 1.5 }.into(),
        Smoothing { mu: 0.5, ..Smoothing::default() }.into(),
        Transform { scale: Some(0.0), ..Transform::default() }.into(),
        Laplacian { iterations: 1, lambda: -0.1 }.into(),
        Quantization { bits: 0 }.into(),
        Quantization { bits: 25 }.into(),
        Affine { strength: -0.1 }.into(),
        Projective { strength: 1.0 }.into(),
        FreeForm { strength: 2.0, lattice: 4 }.into(),
        FreeForm { strength: 0.1, lattice: 1 }.into(),
        Isosurface { resolution: 1025 }.into(),
        "watermark:epsilon=2".parse().unwrap(),
        "subdivide:scheme=loop,iterations=11".parse().unwrap(),
        "remesh:length=0".parse().unwrap(),
        "remesh:length=1,iterations=1000".parse().unwrap(),
    ] {
        assert!(matches!(apply(&attack, &soup, &mut rng), Err(AttackError::Parameter { .. })), "{attack:?}");
    }
    assert_eq!(apply(&Crop::Fraction(1.0).into(), &soup, &mut rng), Err(AttackError::NothingLeft));
    assert_eq!(apply(&Nothing.into(), &Soup::default(), &mut rng), Err(AttackError::NothingLeft));
    let degenerate = Soup::new(soup.points.clone(), vec![[1, 1, 2]; 3]);
    assert_eq!(
        apply(&Simplification { ratio: 0.5 }.into(), &degenerate, &mut rng),
        Err(AttackError::NothingLeft)
    );
}

#[test]
fn specs_are_read_and_written() {
    for spec in [
        "none",
        "reorder",
        "noise:amplitude=0.0045",
        "smooth:iterations=3,lambda=0.5,mu=-0.53",
        "transform",
        "transform:rotation=30,scale=2",
        "laplacian:iterations=5,lambda=0.2",
        "quantize:bits=9",
        "affine:strength=0.5",
        "projective:strength=0.25",
        "ffd:strength=0.02,lattice=5",
        "simplify:ratio=0.125",
        "subdivide:scheme=midpoint,iterations=2",
        "remesh:length=1.5,iterations=3",
        "isosurface:resolution=128",
        "watermark:preset=paper,epsilon=0.02,coefficients=20,basis=hat",
        "crop:fraction=0.333",
        "crop:vertices=0.3",
        "coordinate-noise:amplitude=0.005",
        "watermark:preset=robust,epsilon=0.02,coefficients=30,basis=derby",
    ] {
        assert_eq!(spec.parse::<Attack>().map(|a| a.to_string()).as_deref(), Ok(spec));
    }
    assert_eq!("smooth".parse(), Ok(Attack::from(Smoothing::default())));
    assert_eq!("watermark".parse(), Ok(Attack::from(SecondMark::default())));
    assert_eq!("laplacian".parse(), Ok(Attack::from(Laplacian { iterations: 10, lambda: 0.1 })));
    let full = |spec: &str| spec.parse::<Attack>().map(|attack| attack.to_string());
    assert_eq!(full("ffd:strength=0.1").as_deref(), Ok("ffd:strength=0.1,lattice=4"));
    assert_eq!(full("subdivide:scheme=loop").as_deref(), Ok("subdivide:scheme=loop,iterations=1"));
    assert_eq!(full("remesh:length=1").as_deref(), Ok("remesh:length=1,iterations=5"));
}

#[test]
fn errors_name_the_thing() {
    let error = |spec: &str| spec.parse::<Attack>().unwrap_err().to_string();
    assert!(error("nose:amplitude=1").contains("no attack `nose`"));
    assert!(error("noise").contains("noise:amplitude=0.002"));
    assert!(error("noise:amplitude=much").contains("`much`"));
    assert!(error("noise:amplitude=inf").contains("`inf`"));
    assert!(error("noise:amplitude=1,amplitude=2").contains("twice"));
    assert!(error("crop:part=1").contains("fraction"));
    assert!(error("reorder:seed=1").contains("takes none"));
    assert!(error("smooth:iterations=-1").contains("a whole number"));
    assert!(error("quantize").contains("quantize:bits=10"));
    assert!(error("quantize:bits=8.5").contains("a whole number"));
    assert!(error("subdivide").contains("subdivide:scheme=loop"));
    assert!(error("subdivide:scheme=butterfly").contains("midpoint or loop"));
    assert!(error("isosurface:resolution=64,margin=2").contains("takes resolution"));
}

proptest! {
    #[test]
    fn numbers_come_back_as_they_were(x in prop::num::f64::NORMAL, n in any::<u32>(), which in 0usize..8) {
        let spec = [
            format!("laplacian:iterations={n},lambda={x}"),
            format!("quantize:bits={n}"),
            format!("affine:strength={x}"),
            format!("projective:strength={x}"),
            format!("ffd:strength={x},lattice={n}"),
            format!("subdivide:scheme=loop,iterations={n}"),
            format!("remesh:length={x},iterations={n}"),
            format!("isosurface:resolution={n}"),
        ][which].clone();
        prop_assert_eq!(spec.parse::<Attack>().map(|a| a.to_string()), Ok(spec));
    }

    #[test]
    fn any_text_is_an_attack_or_an_error(text in ".{0,40}") {
        if let Ok(attack) = text.parse::<Attack>() {
            prop_assert_eq!(attack.to_string().parse(), Ok(attack));
        }
    }
}

#[test]
fn every_row_of_the_table_stands_by_its_example() {
    for &example in Attack::EXAMPLES {
        let attack: Attack = example.parse().unwrap();
        assert_eq!(attack.to_string(), example, "the example gives all parameters");
        let draw = || apply(&attack, &shapes::bumpy_sphere(700), &mut ChaCha8Rng::seed_from_u64(2)).unwrap();
        let attacked = draw();
        assert_eq!(attacked, draw(), "{example}: same seed, same mesh");
        assert_eq!(attacked.source.len(), attacked.soup.points.len(), "{example}");
        let cloud = matches!(attack, Attack::PointCloud(_));
        assert_eq!(attacked.soup.triangles.is_empty(), cloud, "{example}");
    }
}

#[test]
fn a_list_is_read_in_order_up_to_its_first_fault() {
    let list = parse_list("reorder  noise:amplitude=0.002 crop:fraction=0.5").unwrap();
    let again: Vec<String> = list.iter().map(Attack::to_string).collect();
    assert_eq!(again, ["reorder", "noise:amplitude=0.002", "crop:fraction=0.5"]);
    assert!(matches!(parse_list("reorder nose noise"), Err(SpecError::Name { name, .. }) if name == "nose"));
    assert_eq!(parse_list(""), Ok(vec![]));
}
