//! Command lines that make no sense.

use super::shared::{arguments, assert_clean, assert_holds, for_programs, misused, refused, workshop};

#[test]
fn attacks_that_make_no_sense_are_refused() {
    let workshop = workshop();
    for (spec, words) in [
        ("explode", &["explode", "noise"][..]),
        ("", &["no attack"]),
        ("Noise:amplitude=1", &["Noise"]),
        ("noise", &["amplitude"]),
        ("noise:", &["amplitude"]),
        ("noise:amplitude", &["amplitude"]),
        ("noise:amplitude=", &["amplitude"]),
        ("noise:amplitude=much", &["much"]),
        ("noise:amplitude=inf", &["amplitude", "inf"]),
        ("noise:amplitude=0.1,amplitude=0.2", &["amplitude"]),
        ("noise:amplitude=0.1,colour=2", &["colour"]),
        ("none:strength=1", &["strength"]),
        ("smooth:iterations=-1", &["iterations"]),
        ("smooth:iterations=1.5", &["iterations"]),
        ("smooth:iterations=99999999999999999999", &["iterations"]),
        ("watermark:basis=cap", &["basis"]),
        ("watermark:coefficients=-3", &["coefficients"]),
        ("simplify", &["ratio"]),
        ("crop", &["fraction"]),
    ] {
        let mut arguments = arguments("attack original.obj -o out.obj");
        arguments.push(spec.into());
        misused(&workshop, &arguments, words);
    }
    for (spec, words) in [
        ("noise:amplitude=-0.1", &["amplitude"][..]),
        ("noise:amplitude=1e300", &["amplitude"]),
        ("smooth:lambda=2", &["lambda"]),
        ("smooth:mu=1", &["mu"]),
        ("simplify:ratio=-1", &["ratio"]),
        ("simplify:ratio=2", &["ratio"]),
        ("crop:fraction=-1", &["fraction"]),
        ("crop:fraction=1.5", &["fraction"]),
        ("transform:scale=0", &["scale"]),
        ("transform:scale=-1", &["scale"]),
        ("transform:rotation=1e9", &["rotation"]),
        ("transform:translation=-1", &["translation"]),
        ("watermark:coefficients=100000", &["coefficients"]),
        ("watermark:coefficients=1000000000000", &["coefficients"]),
        ("crop:fraction=1", &["no face"]),
        ("crop:fraction=0.9999", &["no face"]),
    ] {
        let line = format!("attack original.obj -o out.obj none {spec} none");
        assert_eq!(
            refused(&workshop, &arguments(&line), &[&["original.obj"], words].concat()),
            "attack",
            "{spec}"
        );
    }
}

#[test]
fn second_marks_obey_the_rules_of_first_ones() {
    let workshop = workshop();
    for (spec, word) in [
        ("watermark:epsilon=0", "epsilon"),
        ("watermark:epsilon=-0.01", "epsilon"),
        ("watermark:epsilon=1e300", "epsilon"),
        ("watermark:coefficients=0", "coefficients"),
    ] {
        let line = format!("attack original.obj -o out.obj {spec}");
        refused(&workshop, &arguments(&line), &["original.obj", word]);
    }
}

#[test]
fn an_attack_parameter_that_is_no_number_is_quoted_as_it_was_given() {
    let workshop = workshop();
    misused(
        &workshop,
        &arguments("attack original.obj -o out.obj noise:amplitude=nan"),
        &["amplitude", "nan"],
    );
}

#[test]
fn wrong_usage_is_explained() {
    let workshop = workshop();
    for (line, words) in [
        ("embed original.obj -o out.obj --key out.key --threads 0", &["threads", "0"][..]),
        ("embed original.obj -o out.obj --key out.key --threads -1", &["-1"]),
        ("embed original.obj -o out.obj --key out.key --threads many", &["threads", "many"]),
        ("embed original.obj -o out.obj --key out.key --threads 1000000", &["threads", "1000000"]),
        ("embed original.obj -o out.obj --key out.key --coefficients many", &["coefficients", "many"]),
        ("embed original.obj -o out.obj --key out.key --coefficients 1.5", &["coefficients", "1.5"]),
        (
            "embed original.obj -o out.obj --key out.key --coefficients 99999999999999999999",
            &["coefficients"],
        ),
        ("embed original.obj -o out.obj --key out.key --epsilon small", &["epsilon", "small"]),
        ("embed original.obj -o out.obj --key out.key --basis cap", &["basis", "cap"]),
        ("embed original.obj -o out.obj --key out.key --secret 00", &["--secret"]),
        ("embed original.obj -o out.obj --key out.key --owner", &["--owner"]),
        ("embed original.obj -o out.obj --key out.key --key b.key", &["--key"]),
        ("embed original.obj extra.obj -o out.obj --key out.key", &["extra.obj"]),
        ("detect marked.obj --original original.obj --key mark.key --method magic", &["method", "magic"]),
        (
            "detect marked.obj --original original.obj --key mark.key --registration maybe",
            &["registration", "maybe"],
        ),
        ("detect marked.obj --original original.obj --key mark.key --threshold low", &["threshold", "low"]),
        ("attack original.obj -o out.obj none --seed -1", &["-1"]),
        ("attack original.obj -o out.obj none --seed 18446744073709551616", &["seed"]),
        ("frobnicate original.obj", &["frobnicate"]),
        ("info original.obj marked.obj", &["marked.obj"]),
        ("info --colour original.obj", &["--colour"]),
    ] {
        misused(&workshop, &arguments(line), words);
    }
}

#[test]
fn what_is_missing_is_named() {
    let workshop = workshop();
    for (line, words) in [
        ("embed", &["INPUT"][..]),
        ("embed original.obj --recipients list.csv", &["--out-dir"]),
        ("detect marked.obj", &["--original", "--key"]),
        ("attack original.obj -o out.obj", &["SPEC"]),
        ("attack original.obj none", &["--output"]),
        ("compare original.obj", &["<B>"]),
        ("info", &["MESH"]),
        ("verify mark.key", &["--original"]),
    ] {
        misused(&workshop, &arguments(line), words);
    }
}

#[test]
fn no_command_at_all_is_wrong_usage() {
    let workshop = workshop();
    let ran = workshop.line("");
    assert_eq!((ran.status, ran.stdout.as_str()), (Some(2), ""));
    assert_holds(&ran.stderr, &["Usage: ", "embed", "detect"]);
    let told = for_programs(&workshop, &[]);
    assert_eq!(told.kind, "usage");
    assert_holds(&told.message, &["command"]);
}

#[test]
fn numbers_out_of_range_are_refused() {
    let workshop = workshop();
    for epsilon in ["0", "-0.0", "1e9", "1.0001", "inf", "1e-400"] {
        let line = format!("embed original.obj -o out.obj --key out.key --epsilon={epsilon}");
        refused(&workshop, &arguments(&line), &["epsilon"]);
    }
    refused(
        &workshop,
        &arguments("embed original.obj -o out.obj --key out.key --epsilon=-1"),
        &["epsilon", "-1"],
    );
    for (coefficients, words) in [
        ("0", &["0"][..]),
        ("1", &["16"]),
        ("15", &["16"]),
        ("60000", &["can carry"]),
        ("65537", &["65536"]),
        ("18446744073709551615", &["65536"]),
    ] {
        let line = format!(
            "embed original.obj -o out.obj --key out.key --preset robust --coefficients {coefficients}"
        );
        refused(&workshop, &arguments(&line), &[&["coefficients"], words].concat());
    }
    for threshold in ["0", "2", "inf", "1e-400", "-0.5"] {
        let line = format!(
            "detect marked.obj --original original.obj --key mark.key --method paper --registration never --resampling never --threshold={threshold}"
        );
        assert_eq!(refused(&workshop, &arguments(&line), &["threshold"]), "usage");
    }
}

#[test]
fn an_option_that_is_no_number_is_quoted_as_it_was_given() {
    let workshop = workshop();
    for line in [
        "embed original.obj -o out.obj --key out.key --epsilon nan",
        "detect marked.obj --original original.obj --key mark.key --method paper --registration never --resampling never --threshold nan",
    ] {
        let before = workshop.listing();
        let (ran, told) = (workshop.line(line), for_programs(&workshop, &arguments(line)));
        assert_eq!((ran.status, ran.stdout.as_str()), (Some(2), ""), "{line}");
        for message in [&ran.stderr, &told.message] {
            assert_clean(message);
            assert_holds(message, &["nan"]);
        }
        assert!(workshop.listing() == before, "{line}: something was written");
    }
}

#[test]
fn a_negative_option_is_refused_by_its_name() {
    let workshop = workshop();
    refused(
        &workshop,
        &arguments("embed original.obj -o out.obj --key out.key --epsilon -1"),
        &["epsilon", "-1"],
    );
    let line = "detect marked.obj --original original.obj --key mark.key --method paper --registration never --resampling never --threshold -1";
    refused(&workshop, &arguments(line), &["threshold", "-1"]);
}
