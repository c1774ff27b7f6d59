//! Outputs: what is replaced, what never, and what is left behind.

use super::shared::{PROGRAM, arguments, refused, workshop};
use sombrero_tests::Workshop;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::process::Stdio;

#[test]
fn an_existing_output_is_replaced_only_with_force() {
    let workshop = workshop();
    workshop.write("taken", "mine");
    for line in [
        "embed original.obj -o taken --key new.key",
        "embed original.obj -o new.obj --key taken",
        "attack original.obj -o taken none",
    ] {
        assert_eq!(refused(&workshop, &arguments(line), &["taken", "already exists", "--force"]), "write");
        let forced = workshop.line(&format!("{line} --force"));
        assert_eq!(forced.status, Some(0), "{line}: {}", forced.stderr);
        assert_ne!(workshop.read("taken"), b"mine");
        for name in ["new.obj", "new.key"] {
            let _ = std::fs::remove_file(workshop.path(name));
        }
        workshop.write("taken", "mine");
    }
    symlink("nowhere", workshop.path("dangling")).unwrap();
    refused(&workshop, &arguments("attack original.obj -o dangling none"), &["dangling", "already exists"]);
}

#[test]
fn an_input_is_never_an_output() {
    let workshop = workshop();
    std::fs::create_dir(workshop.path("sub")).unwrap();
    symlink("original.obj", workshop.path("link.obj")).unwrap();
    let absolute = workshop.path("original.obj").into_os_string().into_string().unwrap();
    for same in ["original.obj", "./original.obj", "sub/../original.obj", "link.obj", absolute.as_str()] {
        for line in [
            format!("embed original.obj -o {same} --key new.key --force"),
            format!("embed original.obj -o new.obj --key {same} --force"),
            format!("attack original.obj -o {same} none --force"),
            format!("embed {same} -o original.obj --key new.key --force"),
        ] {
            assert_eq!(refused(&workshop, &arguments(&line), &["obj", "input"]), "write", "{line}");
        }
    }
}

#[test]
fn a_secret_file_is_an_input_too() {
    let workshop = workshop();
    for line in [
        "embed original.obj -o new.obj --key secret --secret-file secret --force",
        "embed original.obj -o secret --key new.key --secret-file secret --force",
    ] {
        refused(&workshop, &arguments(line), &["secret"]);
    }
}

#[test]
fn two_outputs_never_have_one_name() {
    let workshop = workshop();
    std::fs::create_dir(workshop.path("sub")).unwrap();
    workshop.write("old", "");
    for (one, other) in [("old", "./old"), ("sub/../old", "old"), ("old", "old")] {
        for force in ["", "--force"] {
            let line = format!("embed original.obj -o {one} --key {other} {force}");
            assert_eq!(refused(&workshop, &arguments(&line), &["old"]), "write", "{line}");
        }
    }
}

#[test]
fn two_new_outputs_never_have_one_name_however_it_is_spelled() {
    let workshop = workshop();
    std::fs::create_dir(workshop.path("sub")).unwrap();
    for (one, other) in [("new", "./new"), ("sub/../new", "new"), ("sub/new", "./sub/new")] {
        for force in ["", "--force"] {
            let line = format!("embed original.obj -o {one} --key {other} {force}");
            assert_eq!(refused(&workshop, &arguments(&line), &["new"]), "write", "{line}");
        }
    }
}

#[test]
fn an_output_that_cannot_be_written_leaves_nothing_behind() {
    let workshop = workshop();
    std::fs::create_dir(workshop.path("folder")).unwrap();
    for place in ["missing/out", "original.obj/out", "folder", "/dev/null", "/dev/null/out"] {
        for line in [
            "embed original.obj --key new.key --force -o",
            "embed original.obj -o new.obj --force --key",
            "attack original.obj none --force -o",
        ] {
            let mut arguments = arguments(line);
            arguments.push(place.into());
            assert_eq!(refused(&workshop, &arguments, &[place]), "write", "{line} {place}");
        }
    }
    let folder = workshop.path("locked");
    std::fs::create_dir(&folder).unwrap();
    std::fs::set_permissions(&folder, std::fs::Permissions::from_mode(0o555)).unwrap();
    // Permissions do not hold everybody back.
    if std::fs::write(folder.join("probe"), "").is_ok() {
        std::fs::remove_file(folder.join("probe")).unwrap();
    } else {
        let line = "embed original.obj -o new.obj --key locked/new.key";
        assert_eq!(refused(&workshop, &arguments(line), &["locked/new.key"]), "write");
    }
}

#[test]
fn a_key_is_readable_by_its_owner_alone() {
    let workshop = workshop();
    let mode = |name: &str| workshop.path(name).metadata().unwrap().permissions().mode() & 0o777;
    for umask in ["000", "022", "077"] {
        // The program inherits the shell's mask.
        let script = format!("umask {umask}; exec \"$0\" \"$@\"");
        let mut shell = std::process::Command::new("sh");
        let (copy, key) = (format!("{umask}.obj"), format!("{umask}.key"));
        shell.args(["-c", &script, PROGRAM, "embed", "original.obj", "-o", &copy, "--key", &key]);
        let output = shell.current_dir(workshop.path("")).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let open = 0o666 & !u32::from_str_radix(umask, 8).unwrap();
        assert_eq!((mode(&key), mode(&copy)), (0o600, open), "umask {umask}");
    }
}

#[test]
fn a_key_that_replaces_an_open_file_is_readable_by_its_owner_alone() {
    let workshop = workshop();
    workshop.write("open.key", "");
    std::fs::set_permissions(workshop.path("open.key"), std::fs::Permissions::from_mode(0o644)).unwrap();
    workshop.line("embed original.obj -o new.obj --key open.key --force").text();
    let mode = workshop.path("open.key").metadata().unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o600, "a new secret in a file for everybody");
}

#[test]
fn an_output_neither_replaces_a_link_nor_what_it_leads_to() {
    let workshop = workshop();
    std::fs::create_dir(workshop.path("elsewhere")).unwrap();
    workshop.write("elsewhere/target.obj", "old");
    symlink("elsewhere/target.obj", workshop.path("link.obj")).unwrap();
    symlink("elsewhere", workshop.path("way")).unwrap();
    refused(&workshop, &arguments("attack original.obj -o link.obj none"), &["link.obj", "already exists"]);
    for line in [
        "attack original.obj -o link.obj none --force",
        "embed original.obj -o link.obj --key new.key --force",
        "embed original.obj -o new.obj --key link.obj --force",
    ] {
        assert_eq!(refused(&workshop, &arguments(line), &["link.obj", "a link"]), "write");
    }
    assert!(workshop.path("link.obj").is_symlink());
    assert_eq!(workshop.read("elsewhere/target.obj"), b"old");
    workshop.line("embed original.obj -o way/new.obj --key way/new.key").text();
    assert!(workshop.path("elsewhere/new.obj").is_file() && workshop.path("elsewhere/new.key").is_file());
}

/// `/dev/stdout` is a link to whatever standard output is, and root may replace it.
#[test]
fn standard_output_by_its_name_as_a_file_stays_what_it_is() {
    let workshop = workshop();
    let link = workshop.path("stdout");
    symlink("/dev/stdout", &link).unwrap();
    for force in ["", "--force"] {
        let mut command = workshop.command(arguments(&format!("attack original.obj -o stdout none {force}")));
        let file = std::fs::File::create(workshop.path("out")).unwrap();
        let ran = command.stdout(file).stderr(Stdio::piped()).spawn().unwrap().wait_with_output().unwrap();
        let told = String::from_utf8_lossy(&ran.stderr);
        assert_eq!(ran.status.code(), Some(2), "{told}");
        assert!(told.starts_with("sombrero: stdout: ") && told.lines().count() == 1, "{told}");
        assert_eq!(std::fs::read_link(&link).unwrap(), std::path::Path::new("/dev/stdout"));
        assert_eq!(workshop.read("out"), b"");
    }
}

/// What a run leaves that is killed between the names of a key and of its copy.
#[test]
fn a_copy_is_made_again_from_its_key() {
    for line in [
        "embed original.obj --out-dir copies --owner A",
        "embed original.obj --recipients buyers.csv --out-dir copies --owner A",
    ] {
        let workshop = workshop();
        workshop.write("buyers.csv", "recipient,file\nAlice,original\nBob,second\n");
        workshop.line(line).text();
        let before = workshop.listing();
        let keys = ["copies/keys/original.obj.key", "copies/keys/original.key"];
        let key = keys.into_iter().find(|key| workshop.path(key).exists()).unwrap();
        std::fs::remove_file(workshop.path("copies/original.obj")).unwrap();
        let other = line.replace("--owner A", "--owner B");
        let told = workshop.line(&other);
        assert_eq!(told.status, Some(2), "{}", told.stdout);
        assert!((told.stdout + &told.stderr).contains(&format!("{key}: was made for another file, owner")));
        assert!(!workshop.path("copies/original.obj").exists());
        workshop.line(line).text();
        assert!(workshop.listing() == before, "{line}: another copy or key");
        // A copy without a key may be anybody's.
        std::fs::remove_file(workshop.path(key)).unwrap();
        let told = workshop.line(line);
        assert_eq!(told.status, Some(2), "{}", told.stdout);
        assert!((told.stdout + &told.stderr).contains("copies/original.obj: already exists"));
    }
}

#[test]
fn a_folder_of_keys_that_others_can_look_into_is_closed_aloud() {
    let mode = |workshop: &Workshop| {
        std::fs::metadata(workshop.path("copies/keys")).unwrap().permissions().mode() & 0o777
    };
    let list = "embed original.obj --recipients buyers.csv --out-dir copies --secret-file secret";
    let each = "embed original.obj --out-dir copies --secret-file secret";
    for line in [list, each] {
        let workshop = workshop();
        workshop.write("buyers.csv", "recipient\nAlice\n");
        std::fs::create_dir_all(workshop.path("copies/keys")).unwrap();
        for open in [0o755, 0o770, 0o701] {
            let given = std::fs::Permissions::from_mode(open);
            std::fs::set_permissions(workshop.path("copies/keys"), given).unwrap();
            let ran = workshop.line(&format!("{line} --force"));
            assert_eq!(ran.status, Some(0), "{}", ran.stderr);
            assert_eq!(
                ran.stderr,
                "sombrero: copies/keys: others could look into this folder of keys; now only you can\n"
            );
            assert_eq!(mode(&workshop), 0o700, "{open:o}");
        }
        workshop.line(&format!("{line} --force")).text();
        let new = self::workshop();
        new.write("buyers.csv", "recipient\nAlice\n");
        new.line(line).text();
        assert_eq!(mode(&new), 0o700);
    }
}

#[test]
fn two_runs_at_once_leave_a_copy_and_its_own_key() {
    let workshop = workshop();
    let secret = |run: usize| format!("secret-{run}");
    let line = |run: usize, name: &str, rest: &str| {
        arguments(&format!(
            "embed original.obj -o {name}.obj --key {name}.key --secret-file {} {rest}",
            secret(run)
        ))
    };
    let pair = |name: &str| [format!("{name}.obj"), format!("{name}.key")].map(|name| workshop.read(name));
    let alone = [0, 1].map(|run| {
        workshop.write(secret(run), ["ab", "cd"][run].repeat(32));
        workshop.run(line(run, &secret(run), "")).text();
        pair(&secret(run))
    });
    for round in 0..12 {
        let force = if round % 2 == 0 { "--force" } else { "" };
        for name in ["both.obj", "both.key"] {
            let _ = std::fs::remove_file(workshop.path(name));
        }
        let start = |run| {
            let mut command = workshop.command(line(run, "both", force));
            command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
        };
        let statuses = [start(0), start(1)].map(|mut child| child.wait().unwrap().code());
        assert!(statuses.contains(&Some(0)), "round {round}: {statuses:?}");
        assert!(alone.contains(&pair("both")), "round {round}: the copy of one run, the key of the other");
    }
}
