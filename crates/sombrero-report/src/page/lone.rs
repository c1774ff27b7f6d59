//! One shape to be turned, before there is anything to report.

use super::scene::Scene;
use super::shapes::{Placement, Shapes};
use super::viewer;
use maud::{DOCTYPE, PreEscaped, html};
use sombrero::mesh::Soup;

/// A small page in which a shape can be turned, made for the frame of another page; `None` when there is nothing to draw.
///
/// As a report it holds all it needs, and loads nothing.
pub fn view(name: &str, shape: &Soup) -> Option<String> {
    let shapes =
        Shapes { original: shape, suspect: Soup::default(), placement: Placement::Empty, distances: None };
    let scene = Scene::new(&shapes)?;
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(viewer::content_policy(Some(&scene)));
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (name) }
                style { (PreEscaped(include_str!("style.css"))) (PreEscaped(LONE)) }
            }
            body { (viewer::lone_view(name)) (viewer::scripts(&scene)) }
        }
    };
    Some(page.into_string())
}

/// The shape takes all of the frame.
const LONE: &str = ".view { margin: 0; } .stage canvas { aspect-ratio: auto; height: 100vh; max-height: none; } \
                    #view-missing { margin: 1rem; }";

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero::shapes;

    #[test]
    fn a_shape_is_shown_by_itself_and_its_name_is_escaped() {
        let page = view("<b>vase</b>", &shapes::sphere(2)).unwrap();
        let (before, _) = page.rsplit_once("<script>").unwrap();
        assert!(before.contains("sombrero-scene") && before.contains("&lt;b&gt;vase"));
        assert!(!before.contains("<b>") && !before.contains("data-mode"));
    }

    #[test]
    fn nothing_is_not_shown() {
        assert_eq!(view("nothing", &Soup::default()), None);
    }
}
