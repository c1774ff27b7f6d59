//! The view in which the shapes can be turned, and the script that draws it.
//!
//! The script is bundled from `viewer/` of this crate, which tells how. The page works without it: the view stays
//! hidden until the script has drawn something, and one sentence says what is missing.

use super::distances::Distances;
use super::scene::Scene;
use super::words::count;
use base64::{Engine, engine::general_purpose::STANDARD};
use maud::{Markup, PreEscaped, html};
use sha2::{Digest, Sha256};

/// Our script and the parts of three.js that it needs.
const SCRIPT: &str = include_str!("viewer.min.js");

/// The three.js in it.
pub(super) const THREE_VERSION: &str = "0.187.0";

/// What the page may do: show what it holds, and run this script; load nothing, send nothing.
pub(super) fn content_policy(scene: Option<&Scene>) -> String {
    let script = match scene {
        Some(_) => format!("'sha256-{}'", STANDARD.encode(Sha256::digest(SCRIPT))),
        None => "'none'".into(),
    };
    format!(
        "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src {script}; base-uri 'none'; \
         form-action 'none'"
    )
}

/// The view and its buttons. Buttons for what the scene does not hold are left out.
/// `moved` says whether the suspect was moved first.
pub(super) fn view(scene: &Scene, distances: Option<&Distances>, moved: bool) -> Markup {
    let modes = [
        ("original", "Original", true),
        ("suspect", if moved { "Suspect, aligned" } else { "Suspect" }, scene.suspect),
        ("both", "Both", scene.together),
        ("distance", "Distance", scene.distances),
    ];
    html! {
        div.view #view hidden {
            div.buttons role="group" aria-label="What is shown" {
                @for (mode, name, _) in modes.iter().filter(|mode| mode.2) {
                    button type="button" data-mode=(mode) aria-pressed="false" { (name) }
                }
            }
            div.stage {
                canvas tabindex="0" role="application" aria-label="The shapes, to be turned" aria-describedby="view-help" {}
                button type="button" data-reset { "Reset" }
            }
            @if scene.together {
                ul.legend data-for="both" hidden {
                    li { span.key.clay {} "original" }
                    li { span.key.tint {} "suspect, half see-through; covered where the original lies outside it" }
                }
            }
            @if let Some(distances) = distances { div data-for="distance" hidden { (distances.bar()) } }
            p.help #view-help {
                "Drag to turn; once it is clicked, the wheel zooms. On a touch screen, swipe sideways to turn and pinch to "
                "zoom. Keys: arrows turn, + and − zoom, 0 resets. "
                (simplified(scene))
            }
        }
        p.help #view-missing {
            "With JavaScript and WebGL there is a view here in which the shapes can be turned. The pictures below show "
            "the same without it."
        }
    }
}

/// The view of a shape by itself, named for those who do not see it.
pub(super) fn lone_view(name: &str) -> Markup {
    html! {
        div.view #view hidden {
            div.stage {
                canvas tabindex="0" role="application" aria-label={ (name) ", to be turned: arrows turn, plus and minus zoom" } {}
                button type="button" data-reset { "Reset" }
            }
        }
        p.help #view-missing { "With WebGL the shape could be turned here." }
    }
}

fn simplified(scene: &Scene) -> String {
    let [original, suspect] = scene.triangles.map(count);
    let shapes = if scene.suspect {
        format!("{original} triangles of the original and {suspect} of the suspect")
    } else {
        format!("{original} triangles of the original")
    };
    format!(
        "The view is for looking only: it shows {shapes}. Figures and pictures come from the whole files."
    )
}

/// The scene and the script, which reads it: the last of the page's body.
pub(super) fn scripts(scene: &Scene) -> Markup {
    html! {
        script type="application/json" id="sombrero-scene" { (PreEscaped(&scene.json)) }
        script { (PreEscaped(SCRIPT)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Changes with every rebuild of the script: see `viewer/README.md`.
    const SHA256: &str = "c5638cc67816231705cbb6177e27fc8b9167b066f45e5b99e774206bf664871c";

    #[test]
    fn the_script_is_the_one_that_was_looked_at() {
        let digest: String = Sha256::digest(SCRIPT).iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(digest, SHA256);
    }

    #[test]
    fn the_script_is_made_of_the_named_three() {
        let package = include_str!("../../viewer/package.json");
        assert!(package.contains(&format!("\"three\": \"{THREE_VERSION}\"")));
        // Its own name for its version is the middle number.
        let revision = THREE_VERSION.split('.').nth(1).unwrap();
        assert!(SCRIPT.contains(&format!("three.js {THREE_VERSION}")));
        assert!(SCRIPT.contains(&format!("\"{revision}\"")));
    }

    #[test]
    fn the_licence_comes_with_the_script() {
        let licence = include_str!("LICENSE-three");
        assert!(licence.contains("The MIT License") && licence.contains("three.js authors"));
        assert!(SCRIPT.contains(licence.trim()));
    }

    /// A browser must see in it exactly the bytes that were hashed, and nothing else.
    #[test]
    fn the_script_can_stand_in_a_page() {
        for sign in ["</script", "<script", "<!--", "\r", "\0", "sourceMappingURL", "eval(", "new Function"] {
            assert!(!SCRIPT.contains(sign), "{sign:?}");
        }
    }
}
