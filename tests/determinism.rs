//! The same input, secret and parameters give the same bytes, whatever the number of threads.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sombrero::attacks::parse_list;
use sombrero::basis::{BasisFunction, BasisOptions};
use sombrero::io::{Document, Format, Soup};
use sombrero::shapes;
use sombrero::watermark::{Parameters, Preset};
use sombrero::{DetectOptions, Model, attack, detect};
use sombrero_tests::{Workshop, as_it_is, document, groups, marked, ring, samples};

fn with_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

#[test]
fn a_copy_and_its_key_do_not_depend_on_threads() {
    for (name, soup) in groups() {
        let original = document(Format::Obj, &soup);
        let run = |threads| {
            with_threads(threads, || {
                let mark = marked(&original, 1);
                let copy = Document::parse(mark.bytes.clone(), None).unwrap();
                let found = detect(&copy, &original, &mark.key, &as_it_is()).unwrap();
                let digest = Model::new(original.soup()).basis(&BasisOptions::default()).unwrap().digest();
                (mark.bytes, mark.key.to_json(), digest, found.log10_p.to_bits(), found.extracted)
            })
        };
        assert!(run(1) == run(3), "{name}");
    }
}

/// Registration, surface and free-form fit included.
#[test]
fn what_is_found_without_a_hint_does_not_depend_on_threads() {
    let original = document(Format::Obj, &shapes::bust(12));
    let mark = marked(&original, 1);
    let copy = Document::parse(mark.bytes, None).unwrap();
    let attacks = parse_list("simplify:ratio=0.4 noise:amplitude=0.008 transform").unwrap();
    let suspect = attack(&copy, &attacks, &mut ChaCha8Rng::seed_from_u64(3)).unwrap();
    let suspect = Document::parse(suspect.bytes, None).unwrap();
    let run = |threads| {
        with_threads(threads, || {
            let found = detect(&suspect, &original, &mark.key, &DetectOptions::default()).unwrap();
            (found.log10_p.to_bits(), found.extracted, found.variants, found.found)
        })
    };
    assert!(run(1) == run(2));
}

#[test]
fn the_basis_of_a_generated_mesh_is_pinned() {
    // Whoever changes collapses, magnitudes, supports or functions breaks every key that exists. Then keys
    // need a new version, and these digests new values.
    let digest = |function| {
        let model = Model::new(&shapes::bumpy_sphere(1000));
        hex::encode(model.basis(&BasisOptions { function, ..BasisOptions::default() }).unwrap().digest())
    };
    assert_eq!(
        digest(BasisFunction::Sombrero),
        "6019cd3c2400bbad55587eee9f006d0e0ab5af1c53e5fa2c7aa11739c0e401a9"
    );
    assert_eq!(
        digest(BasisFunction::Derby),
        "2f724ac7ce7ea318c846cb97f3fa4bc63284cd84f106525979b8daedf45207cd"
    );
    assert_eq!(
        digest(BasisFunction::Hat),
        "75b15590c2ddce14ccdb9b6a5f4c50e56b3d0dfed1ff00b149e18f77e8032bf2"
    );
}

#[test]
fn the_robust_presets_basis_is_pinned() {
    let model = Model::new(&shapes::bumpy_sphere(1000));
    let options = BasisOptions { coefficients: 80, ..Preset::Robust.parameters().basis };
    assert_eq!(
        hex::encode(model.basis(&options).unwrap().digest()),
        "6a2ef4d1ec4b3d4fcfba10ee0f17b52485db0437fb7bea2f47c04e81a591c5f0"
    );
}

/// Of a ball and of a part with planes, on the level that fields are sought on and above it.
#[test]
fn the_default_presets_basis_is_pinned() {
    let digest = |soup: &Soup| {
        let model = Model::new(soup);
        let Parameters { basis, epsilon, .. } = Preset::Faithful.parameters();
        let basis = |threads| {
            with_threads(threads, || model.basis_for(model.progressive(), &basis, epsilon).unwrap())
        };
        let digest = basis(1).digest();
        assert_eq!(digest, basis(3).digest());
        hex::encode(digest)
    };
    assert_eq!(
        [shapes::bumpy_sphere(1000), shapes::part(10)].map(|soup| digest(&soup)),
        [
            "810bf4d063d5c8557c2ea638dd6084ca243ead64ab5dcec1fb553742a0c0b911",
            "ab803b308bd38d47b9ad0807ba2c2f7a8f2c9bd652affc02dfb91589fb9883ea",
        ]
    );
}

#[test]
fn one_seed_makes_one_attack() {
    let specs =
        "reorder noise:amplitude=0.01 smooth transform simplify:ratio=0.5 watermark crop:fraction=0.2";
    for sample in samples(&ring()) {
        let document = Document::parse(sample.bytes, Some(sample.extension)).unwrap();
        for spec in specs.split(' ').chain(["none"]) {
            let attacks = parse_list(spec).unwrap();
            let run = |seed, threads| {
                with_threads(threads, || attack(&document, &attacks, &mut ChaCha8Rng::seed_from_u64(seed)))
                    .unwrap()
                    .bytes
            };
            let bytes = run(1, 1);
            assert!(run(1, 2) == bytes, "{}, {spec}", sample.name);
            let random =
                ["reorder", "noise", "transform", "watermark"].iter().any(|name| spec.starts_with(name));
            assert_eq!(run(2, 1) != bytes, random, "{}, {spec}: another seed", sample.name);
        }
    }
}

#[test]
fn the_command_writes_the_same_bytes_with_any_number_of_threads() {
    let workshop = Workshop::new(env!("CARGO_BIN_EXE_sombrero-under-test"));
    workshop.write("secret", "5a".repeat(32));
    for sample in samples(&ring()).iter().filter(|s| ["OBJ", "STL, binary"].contains(&s.name)) {
        workshop.write("mesh", &sample.bytes);
        let run = |threads: &str| {
            let line = format!(
                "embed mesh -o marked --key key --owner A --secret-file secret --force --threads {threads}"
            );
            workshop.line(&line).text();
            let line = format!(
                "attack marked -o noisy noise:amplitude=0.002 watermark --seed 9 --force --threads {threads}"
            );
            workshop.line(&line).text();
            let line = format!(
                "detect noisy --original mesh --key key --registration never --resampling never --json --threads {threads}"
            );
            let mut found = workshop.line(&line).json();
            assert!(found.as_object_mut().unwrap().remove("seconds").is_some());
            let line = format!("render mesh --compare noisy -o apart.png --force --threads {threads}");
            workshop.line(&line).text();
            (["marked", "key", "noisy", "apart.png"].map(|name| workshop.read(name)), found)
        };
        assert!(run("1") == run("3"), "{}", sample.name);
    }
}

#[test]
fn a_new_secret_makes_another_copy() {
    let workshop = Workshop::new(env!("CARGO_BIN_EXE_sombrero-under-test"));
    let [sample, ..] = &samples(&ring())[..] else { panic!("no sample") };
    workshop.write("mesh.obj", &sample.bytes);
    let copy = |name: &str| {
        workshop.line(&format!("embed mesh.obj -o {name}.obj --key {name}.key")).text();
        (workshop.read(format!("{name}.obj")), workshop.read(format!("{name}.key")))
    };
    let (one, two) = (copy("one"), copy("two"));
    assert!(one.0 != two.0 && one.1 != two.1, "the operating system gave the same secret twice");
}
