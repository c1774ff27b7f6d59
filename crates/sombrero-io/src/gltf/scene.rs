//! The nodes of the scene: which meshes are shown, and where.

use nalgebra::{Matrix4, Quaternion, UnitQuaternion, Vector3};

use super::error::malformed;
use super::json::{Node, Root};
use crate::error::ParseError;
use crate::placement::Placement;

/// A mesh as a node shows it.
#[derive(Debug)]
pub(super) struct Shown {
    pub(super) mesh: usize,
    /// `None` when the node flattens it, or puts it at infinity.
    pub(super) placement: Option<Placement>,
}

/// All meshes that are shown, in the order in which the scene is walked: depth first, children in order.
pub(super) fn shown(root: &Root<'_>) -> Result<Vec<Shown>, ParseError> {
    if root.nodes.is_empty() {
        let at_rest = |mesh| Shown { mesh, placement: Some(Placement::identity()) };
        return Ok((0..root.meshes.len()).map(at_rest).collect());
    }
    let mut walk = Walk { root, reached: vec![false; root.nodes.len()], path: Vec::new(), shown: Vec::new() };
    for node in roots(root)? {
        walk.enter(node, &Matrix4::identity())?;
        walk.descend()?;
    }
    Ok(walk.shown)
}

/// The nodes to begin with.
fn roots(root: &Root<'_>) -> Result<Vec<u32>, ParseError> {
    if root.scenes.is_empty() {
        let mut is_child = vec![false; root.nodes.len()];
        for &child in root.nodes.iter().flat_map(|node| &node.children) {
            if let Some(child) = is_child.get_mut(child as usize) {
                *child = true;
            }
        }
        return Ok((0..).zip(is_child).filter(|(_, child)| !child).map(|(node, _)| node).collect());
    }
    let scene = root.scene.unwrap_or(0) as usize;
    let missing = || malformed("scene", scene, "there is no such scene");
    Ok(root.scenes.get(scene).ok_or_else(missing)?.nodes.clone())
}

struct Walk<'a> {
    root: &'a Root<'a>,
    reached: Vec<bool>,
    /// The node where the walk is, after all those above it.
    path: Vec<Step<'a>>,
    shown: Vec<Shown>,
}

struct Step<'a> {
    children: std::slice::Iter<'a, u32>,
    world: Matrix4<f64>,
}

impl Walk<'_> {
    /// Visits all that is below the path. Without recursion: a file may nest as deep as it is long.
    fn descend(&mut self) -> Result<(), ParseError> {
        while let Some(step) = self.path.last_mut() {
            if let Some(&child) = step.children.next() {
                let world = step.world;
                self.enter(child, &world)?;
            } else {
                self.path.pop();
            }
        }
        Ok(())
    }

    fn enter(&mut self, index: u32, above: &Matrix4<f64>) -> Result<(), ParseError> {
        let wrong = |problem: &str| malformed("node", index as usize, problem);
        let node = self.root.nodes.get(index as usize).ok_or_else(|| wrong("there is no such node"))?;
        if let Some(reached) = self.reached.get_mut(index as usize)
            && std::mem::replace(reached, true)
        {
            return Err(wrong("it is reached twice; a node must have one place in the tree"));
        }
        let world = if node.stays() { *above } else { above * local(node) };
        if let Some(mesh) = node.mesh.map(|mesh| mesh as usize) {
            if mesh >= self.root.meshes.len() {
                return Err(wrong("it shows a mesh that does not exist"));
            }
            // The bones alone place what they carry.
            let placement =
                if node.skin.is_some() { Some(Placement::identity()) } else { Placement::new(&world) };
            self.shown.push(Shown { mesh, placement });
        }
        self.path.push(Step { children: node.children.iter(), world });
        Ok(())
    }
}

impl Node {
    fn stays(&self) -> bool {
        self.matrix.is_none() && self.translation.is_none() && self.rotation.is_none() && self.scale.is_none()
    }
}

/// A node's own transform.
fn local(node: &Node) -> Matrix4<f64> {
    if let Some(matrix) = &node.matrix {
        let mut matrix = Matrix4::from_column_slice(matrix.as_slice());
        // The last row can be nothing else; some exporters round it.
        matrix.set_row(3, &nalgebra::RowVector4::new(0.0, 0.0, 0.0, 1.0));
        return matrix;
    }
    let mut matrix = node.rotation.as_deref().map_or_else(Matrix4::identity, rotation);
    if let Some(scale) = node.scale.as_deref() {
        matrix.prepend_nonuniform_scaling_mut(&Vector3::from(*scale));
    }
    if let Some(translation) = node.translation.as_deref() {
        matrix.append_translation_mut(&Vector3::from(*translation));
    }
    matrix
}

/// The matrix of a quaternion; all zero when that has no direction.
fn rotation([x, y, z, w]: &[f64; 4]) -> Matrix4<f64> {
    let quaternion = UnitQuaternion::try_new(Quaternion::new(*w, *x, *y, *z), 0.0);
    quaternion.map_or_else(Matrix4::zeros, |q| q.to_homogeneous())
}
