//! The nodes of the scene: which meshes are shown, and where.
//!
//! A mesh with a skin is where its bones take it. In the pose in which they were put in, all of them agree: a bone's place in
//! the world times its inverse bind matrix. The first one is asked, so that a pose which differs changes where the mesh is
//! and how large, and not its shape.

use std::collections::HashMap;

use nalgebra::{Matrix4, Quaternion, UnitQuaternion, Vector3};

use super::accessor::Accessors;
use super::elements::{Component, Elements};
use super::error::malformed;
use super::json::{InstanceAttributes, Node, Root, Shape};
use crate::error::ParseError;
use crate::placement::{MOST_SHOWN, Placement};

/// A mesh as a node shows it.
#[derive(Debug)]
pub(super) struct Shown {
    pub(super) mesh: usize,
    /// `None` when the node flattens it, or puts it at infinity.
    pub(super) placement: Option<Placement>,
    /// The accessor of the matrices of which the first comes before the placement.
    pub(super) bind: Option<u32>,
    /// The accessors of the transforms of copies, each of which comes before the placement.
    pub(super) instances: Option<InstanceAttributes>,
}

impl Shown {
    fn new(mesh: usize, placement: Option<Placement>) -> Self {
        Self { mesh, placement, bind: None, instances: None }
    }
}

/// All meshes that are shown, in the order in which the scene is walked: depth first, children in order.
pub(super) fn shown(root: &Root<'_>) -> Result<Vec<Shown>, ParseError> {
    if root.nodes.is_empty() {
        let at_rest = |mesh| Shown::new(mesh, Some(Placement::identity()));
        return Ok((0..root.meshes.len()).map(at_rest).collect());
    }
    let bones = root.skins.iter().filter_map(|skin| skin.joints.first());
    let mut walk = Walk {
        root,
        reached: vec![false; root.nodes.len()],
        path: Vec::new(),
        shown: Vec::new(),
        skinned: Vec::new(),
        bones: bones.map(|bone| (*bone, None)).collect(),
    };
    for node in roots(root)? {
        walk.enter(node, &Matrix4::identity())?;
        walk.descend()?;
    }
    walk.hang_on_bones();
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
    /// Which of those that are shown have which skin.
    skinned: Vec<(usize, u32)>,
    /// The first bone of each skin, and where it is in the world once it was reached.
    bones: HashMap<u32, Option<Matrix4<f64>>>,
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
        if node.extensions.visibility.as_ref().is_some_and(|visibility| !visibility.visible) {
            return Ok(());
        }
        let world = if node.stays() { *above } else { above * local(node) };
        if let Some(bone) = self.bones.get_mut(&index) {
            *bone = Some(world);
        }
        if let Some(mesh) = node.mesh.map(|mesh| mesh as usize) {
            if mesh >= self.root.meshes.len() {
                return Err(wrong("it shows a mesh that does not exist"));
            }
            // The bones alone place what they carry.
            let placement = match node.skin {
                Some(skin) => {
                    self.skinned.push((self.shown.len(), skin));
                    Some(Placement::identity())
                }
                None => Placement::new(&world),
            };
            let instances = node.extensions.instances.as_ref().map(|instances| instances.attributes);
            self.shown.push(Shown { instances, ..Shown::new(mesh, placement) });
        }
        self.path.push(Step { children: node.children.iter(), world });
        Ok(())
    }
}

impl Walk<'_> {
    /// Places the meshes that have a skin. Bones may come behind what they carry; without one, a mesh is where it is stored.
    fn hang_on_bones(&mut self) {
        for (shown, skin) in std::mem::take(&mut self.skinned) {
            let Some(skin) = self.root.skins.get(skin as usize) else { continue };
            let bone = skin.joints.first().and_then(|bone| self.bones.get(bone).copied().flatten());
            if let (Some(bone), Some(shown)) = (bone, self.shown.get_mut(shown)) {
                shown.placement = Placement::new(&bone);
                shown.bind = skin.inverse_bind_matrices;
            }
        }
    }
}

impl Node {
    fn stays(&self) -> bool {
        self.matrix.is_none() && self.translation.is_none() && self.rotation.is_none() && self.scale.is_none()
    }
}

impl Placement {
    fn matrix(&self) -> Matrix4<f64> {
        self.linear().to_homogeneous().append_translation(&self.shift())
    }
}

/// What is shown, with skins and copies placed by what their accessors hold.
pub(super) fn placed(shown: Vec<Shown>, accessors: &Accessors<'_>) -> Result<Vec<Shown>, ParseError> {
    let mut all = Vec::with_capacity(shown.len());
    let mut copies_left = MOST_COPIES;
    for one in shown {
        let placement = match (one.bind, one.placement) {
            (Some(bind), Some(placement)) => first_matrix(bind, accessors)?
                .map_or(Some(placement), |matrix| Placement::new(&(placement.matrix() * matrix))),
            (_, placement) => placement,
        };
        let Some((instances, placement)) = one.instances.zip(placement) else {
            all.push(Shown::new(one.mesh, placement));
            continue;
        };
        let copies = copies(instances, accessors, copies_left)?;
        copies_left -= copies.len();
        let at = |copy: Matrix4<f64>| Shown::new(one.mesh, Placement::new(&(placement.matrix() * copy)));
        all.extend(copies.into_iter().map(at));
    }
    Ok(all)
}

/// So many copies of a mesh are placed by one file.
const MOST_COPIES: usize = MOST_SHOWN / 64;

/// The first of some matrices; `None` when there is none of 32-bit floats.
fn first_matrix(accessor: u32, accessors: &Accessors<'_>) -> Result<Option<Matrix4<f64>>, ParseError> {
    let elements = accessors.elements(accessor)?;
    let whole = elements.shape == Shape::Mat4 && elements.component == Component::F32 && elements.count > 0;
    let numbers: Option<[f64; 16]> = whole.then(|| numbers(&elements, 0, accessors));
    Ok(numbers.map(|numbers| affine(&numbers)))
}

/// The numbers of an element.
fn numbers<const N: usize>(elements: &Elements, element: usize, accessors: &Accessors<'_>) -> [f64; N] {
    let Some((store, offset)) = elements.slot(element) else { return [0.0; N] };
    let size = elements.component.size();
    let bytes = |i: usize| accessors.bytes(store).get(offset + i * size..).unwrap_or_default();
    std::array::from_fn(|i| elements.meaning(elements.component.get(bytes(i))))
}

/// The transforms of the copies that a node shows of its mesh, at most as many as are `left`.
fn copies(
    attributes: InstanceAttributes,
    accessors: &Accessors<'_>,
    left: usize,
) -> Result<Vec<Matrix4<f64>>, ParseError> {
    let InstanceAttributes { translation, rotation, scale } = attributes;
    let elements = |accessor: Option<u32>, shape| {
        let elements = accessor.map(|accessor| accessors.elements(accessor)).transpose()?;
        Ok(elements.filter(|elements| elements.shape == shape))
    };
    let [translation, scale] = [elements(translation, Shape::Vec3)?, elements(scale, Shape::Vec3)?];
    let rotation = elements(rotation, Shape::Vec4)?;
    let counts = [&translation, &rotation, &scale].into_iter().flatten().map(|elements| elements.count);
    // Without any there is nothing that could be a copy but the mesh itself.
    let count = counts.min().unwrap_or(1).min(left);
    let of = |copy| {
        let three = |elements: &Option<Elements>| elements.as_ref().map(|e| numbers::<3>(e, copy, accessors));
        let four = rotation.as_ref().map(|e| numbers::<4>(e, copy, accessors));
        composed(four.as_ref(), three(&scale).as_ref(), three(&translation).as_ref())
    };
    Ok((0..count).map(of).collect())
}

/// A node's own transform.
fn local(node: &Node) -> Matrix4<f64> {
    match &node.matrix {
        Some(matrix) => affine(matrix),
        None => composed(node.rotation.as_deref(), node.scale.as_deref(), node.translation.as_deref()),
    }
}

/// The matrix of 16 numbers, column by column.
fn affine(numbers: &[f64; 16]) -> Matrix4<f64> {
    let mut matrix = Matrix4::from_column_slice(numbers);
    // The last row can be nothing else; some exporters round it.
    matrix.set_row(3, &nalgebra::RowVector4::new(0.0, 0.0, 0.0, 1.0));
    matrix
}

/// Scaled, then turned, then shifted.
fn composed(turn: Option<&[f64; 4]>, scale: Option<&[f64; 3]>, shift: Option<&[f64; 3]>) -> Matrix4<f64> {
    let mut matrix = turn.map_or_else(Matrix4::identity, rotation);
    if let Some(scale) = scale {
        matrix.prepend_nonuniform_scaling_mut(&Vector3::from(*scale));
    }
    if let Some(shift) = shift {
        matrix.append_translation_mut(&Vector3::from(*shift));
    }
    matrix
}

/// The matrix of a quaternion; all zero when that has no direction.
fn rotation([x, y, z, w]: &[f64; 4]) -> Matrix4<f64> {
    let quaternion = UnitQuaternion::try_new(Quaternion::new(*w, *x, *y, *z), 0.0);
    quaternion.map_or_else(Matrix4::zeros, |q| q.to_homogeneous())
}
