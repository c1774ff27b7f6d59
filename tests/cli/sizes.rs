//! Sizes and places, from the smallest to what no number holds.

use super::shared::{PROGRAM, arguments, assert_clean, number, refused};
use sombrero::io::{Format, encode};
use sombrero::shapes;
use sombrero_tests::{Workshop, mapped, ply, samples};

/// Marks `name` and finds the mark again, in numbers that are all finite.
fn assert_whole_story(workshop: &Workshop, name: &str) {
    workshop.write("secret", "cd".repeat(32));
    let embedded = workshop
        .line(&format!("embed {name} -o copy --key copy.key --secret-file secret --force --json"))
        .json();
    assert!(embedded["distortion"].as_object().is_some_and(|d| d.values().all(number)), "{name}: {embedded}");
    let relative = embedded["distortion"]["relative_max"].as_f64().unwrap();
    assert!(relative > 1e-4 && relative < 0.02, "{name}: {relative}");
    workshop.line("attack copy -o noisy noise:amplitude=0.001 --force").text();
    for suspect in ["copy", "noisy"] {
        let ran = workshop
            .line(&format!("detect {suspect} --original {name} --key copy.key --method paper --registration never --resampling never --json"));
        assert_eq!(ran.status, Some(0), "{name}, {suspect}: {}", ran.stdout);
    }
    let apart = workshop.line(&format!("compare {name} copy --json")).json();
    let lengths = apart.as_object().unwrap().iter().filter(|(field, _)| *field != "fidelity");
    assert!(lengths.into_iter().all(|(_, value)| number(value)), "{name}: {apart}");
    assert!(apart["relative_hausdorff"].as_f64().is_some_and(|d| d > 0.0 && d < 0.02), "{name}: {apart}");
    let info = workshop.line(&format!("info {name} --json")).json();
    assert!(
        ["area", "volume"]
            .iter()
            .all(|field| info[*field].as_f64().is_some_and(|x| x.is_finite() && x > 0.0)),
        "{info}"
    );
    assert_clean(workshop.line(&format!("info {name}")).text());
}

#[test]
fn any_unit_of_length_will_do() {
    let workshop = Workshop::new(PROGRAM);
    let ball = shapes::bumpy_sphere(650);
    for (scale, name, format) in [
        (1e-12, "ball.obj", Format::Obj),
        (1e-12, "ball.stl", Format::StlBinary),
        (1e12, "ball.ply", Format::PlyBinaryBigEndian),
        (1e12, "ball.stl", Format::StlBinary),
    ] {
        workshop.write(name, encode(format, &mapped(&ball, |p| p * scale)).unwrap());
        assert_whole_story(&workshop, name);
    }
}

#[test]
fn the_unit_of_length_changes_nothing() {
    let workshop = Workshop::new(PROGRAM);
    let ball = shapes::bumpy_sphere(650);
    let capacity_and_mark = |scale: f64| {
        workshop.write("ball.obj", encode(Format::Obj, &mapped(&ball, |p| p * scale)).unwrap());
        let capacity = workshop.line("info ball.obj --json").json()["capacity"].as_u64().unwrap();
        workshop.write("secret", "cd".repeat(32));
        workshop.line("embed ball.obj -o copy.obj --key copy.key --secret-file secret --force").text();
        let answer = workshop.line("compare ball.obj copy.obj --json").json();
        (capacity, answer["relative_rms"].as_f64().unwrap())
    };
    let (capacity, _) = capacity_and_mark(1.0);
    // Powers of two change no digit, so that even ties are broken alike.
    for exponent in [-40, -10, 10, 40] {
        let (scaled, relative_rms) = capacity_and_mark(f64::powi(2.0, exponent));
        assert_eq!(scaled, capacity, "2^{exponent}");
        assert!(relative_rms > 1e-5 && relative_rms < 0.004, "2^{exponent}: {relative_rms}");
    }
}

#[test]
fn far_from_the_origin_a_mark_is_stored_or_refused() {
    let workshop = Workshop::new(PROGRAM);
    let ball = shapes::bumpy_sphere(650);
    let far = mapped(&ball, |p| p + nalgebra::Vector3::new(1e6, -1e6, 1e6));
    workshop.write("far.obj", encode(Format::Obj, &far).unwrap());
    assert_whole_story(&workshop, "far.obj");
    for sample in samples(&far).iter().filter(|sample| !sample.exact) {
        let name = format!("far.{}", sample.extension);
        workshop.write(&name, &sample.bytes);
        let line = format!("embed {name} -o far-copy --key far.key --secret-file secret --preset robust");
        let ran = workshop.line(&line);
        if ran.status == Some(0) {
            let line = format!(
                "detect far-copy --original {name} --key far.key --method paper --registration never --resampling never"
            );
            assert_eq!(workshop.line(&line).status, Some(0), "{}", sample.name);
            for made in ["far-copy", "far.key"] {
                std::fs::remove_file(workshop.path(made)).unwrap();
            }
        } else {
            refused(&workshop, &arguments(&line), &[&name]);
        }
    }
    // Two metres away from a model of a metre, 32-bit floats are fine.
    let near = mapped(&ball, |p| p + nalgebra::Vector3::new(2.0, -2.0, 2.0));
    workshop.write("near.stl", encode(Format::StlBinary, &near).unwrap());
    assert_whole_story(&workshop, "near.stl");
}

#[test]
fn what_the_floats_of_a_file_cannot_hold_is_refused() {
    let workshop = Workshop::new(PROGRAM);
    // A unit ball a million units away: floats come in steps of 1/16, far coarser than the mark.
    let far = mapped(&shapes::bumpy_sphere(2000), |p| p + nalgebra::Vector3::new(1e6, 1e6, 1e6));
    workshop.write("far.ply", ply(&far, "binary_little_endian", false));
    workshop.write("secret", "cd".repeat(32));
    let line = "embed far.ply -o copy.ply --key copy.key --secret-file secret";
    refused(&workshop, &arguments(line), &["far.ply", "does not survive being stored", "double precision"]);
}

#[test]
fn a_size_beyond_all_numbers_is_not_shown_as_one() {
    let workshop = Workshop::new(PROGRAM);
    let ball = shapes::bumpy_sphere(650);
    for scale in [1e-300, 1e-110, 1e110, 1e160, 1e300] {
        workshop.write("ball.obj", encode(Format::Obj, &mapped(&ball, |p| p * scale)).unwrap());
        let said = workshop.line("info ball.obj");
        assert_clean(said.text());
        assert!(!said.text().contains("inf"), "{}", said.stdout);
        assert_eq!(workshop.line("info ball.obj --json").json()["vertices"], 642);
        // Whatever comes of it, it is an answer or a sentence.
        let embedded = workshop.line("embed ball.obj -o copy.obj --key copy.key");
        assert!(matches!(embedded.status, Some(0 | 2)), "{scale:e}: {}", embedded.stderr);
        assert_clean(&embedded.stderr);
        assert_clean(&embedded.stdout);
    }
}
