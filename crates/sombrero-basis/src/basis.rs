//! The basis functions of a mesh, and the matrix that inserts a watermark with them (the paper, 3 and 4).
//!
//! **Theorem (completeness and independence).** Take the functions of *all* vertex splits, and for each
//! base vertex the function that is 1 there and 0 elsewhere. Order vertices and functions by age. The
//! function of split i is 1 at the vertex v_i that the split introduces (r = 0), and 0 at every older
//! vertex (those are on the loop, outside it, or inside and counted as boundary: see
//! `support.rs`). So the n × n matrix of values is triangular with a unit diagonal: the
//! functions are independent, and being n they are a basis of all functions on the n vertices. A proptest
//! beside this code checks it.

use crate::columns::{Column, columns, compressed, offsets};
use crate::magnitude::{heights, most_significant};
use crate::support::outlines;
use crate::{Amplitudes, BasisError, BasisFunction, PartsError};
use nalgebra::{Point3, Vector3};
use nalgebra_sparse::CscMatrix;
use rayon::prelude::*;
use sha2::{Digest, Sha256};
use sombrero_mesh::{BoundingBox, VertexId};
use sombrero_progress::Progress;
use sombrero_progressive::ProgressiveMesh;
use sombrero_spectral::{Columns, Fields, FieldsOptions};

/// Which functions to build.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BasisOptions {
    /// m, the number of functions; of fields the most, since a mesh has as many as it has room for. Default 50, as in
    /// the paper.
    pub coefficients: usize,
    /// Their kind. Default sombrero.
    pub function: BasisFunction,
    /// How the functions share the mark's energy. Default the paper's.
    pub amplitudes: Amplitudes,
}

impl Default for BasisOptions {
    fn default() -> Self {
        Self { coefficients: 50, function: BasisFunction::default(), amplitudes: Amplitudes::default() }
    }
}

/// m functions over the n vertices of a mesh: scalar ones, each with a direction and a height, or vector-valued ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Basis {
    /// Φ, n × m: column i holds φ_i at each vertex.
    values: CscMatrix<f64>,
    functions: Vec<Function>,
    /// Where functions are vectors, those instead of φ_i a_i d_i.
    vectors: Option<CscMatrix<Vector3<f64>>>,
}

/// What belongs to one basis function beside its values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Function {
    /// The vertex where the function is 1: a vertex of the mesh that the basis was built on.
    pub centre: VertexId,
    /// The vertex split that it belongs to, in order of refinement.
    pub split: usize,
    /// h_i, in model units, with its sign.
    pub height: f64,
    /// d_i, of unit length: the direction in which the coefficient moves vertices.
    pub direction: Vector3<f64>,
    /// a_i, in model units: how far coefficient 1 moves the centre at epsilon = 1. The paper's is h_i.
    pub amplitude: f64,
}

/// The least height that carries a mark, in largest sides: numbers with six digits have errors like this.
const LEAST_HEIGHT: f64 = 1e-6;

/// Vertices that one task moves.
const CHUNK: usize = 4096;

/// The values of so many functions, or more, take about as long as one way through all levels.
const COLUMNS: usize = 50;

fn least_height(points: &[Point3<f64>]) -> f64 {
    BoundingBox::of(points).map_or(0.0, |bounds| LEAST_HEIGHT * bounds.largest_side())
}

impl Basis {
    /// The functions of the `options.coefficients` most significant vertex splits, most significant first; or as many
    /// fields at most.
    ///
    /// `points` are those of the full mesh.
    ///
    /// # Errors
    /// [`BasisError::TooFewSplits`] when fewer splits change the shape, [`BasisError::TooFewFields`] when no field can carry
    /// anything.
    pub fn new(
        progressive: ProgressiveMesh,
        points: &[Point3<f64>],
        options: &BasisOptions,
    ) -> Result<Self, BasisError> {
        let BasisOptions { function, amplitudes, .. } = *options;
        if !amplitudes.suit(function) {
            return Err(BasisError::Amplitudes { function, amplitudes });
        }
        match function {
            BasisFunction::Field => Self::filled(progressive, points, options.coefficients),
            _ => Self::of_splits(progressive, points, options),
        }
    }

    /// At most so many fields.
    fn filled(progressive: ProgressiveMesh, points: &[Point3<f64>], most: usize) -> Result<Self, BasisError> {
        let options = FieldsOptions { most, ..FieldsOptions::default() };
        let fields = Fields::new(progressive, points, &options)
            .map_err(|_| BasisError::TooFewFields { available: 0 })?;
        Ok(Self::of_columns(points.len(), fields.columns))
    }

    fn of_splits(
        mut progressive: ProgressiveMesh,
        points: &[Point3<f64>],
        options: &BasisOptions,
    ) -> Result<Self, BasisError> {
        let wanted = options.coefficients;
        // Up all levels, and then the values, each of which counts for so many levels.
        let levels = progressive.split_count();
        let column = levels.div_ceil(COLUMNS.max(wanted));
        let progress = Progress::new("basis", levels + column * wanted.min(levels));
        let all = heights(&progressive);
        let splits = most_significant(&all, progressive.shape_level(), wanted, least_height(points));
        if splits.len() < wanted {
            return Err(BasisError::TooFewSplits { wanted, available: splits.len() });
        }
        let outlines = outlines(&mut progressive, points, &splits, &progress);
        let columns = columns(&progressive, points, &outlines, options.function, || progress.advance(column));
        let energy = |column: &Column| column.iter().map(|(_, phi)| phi * phi).sum::<f64>();
        let heights: Vec<f64> = outlines.iter().map(|o| o.magnitude.height).collect();
        let amplitudes = options.amplitudes.of(&heights, &columns.iter().map(energy).collect::<Vec<_>>());
        let functions = outlines.iter().zip(amplitudes).map(|(o, amplitude)| Function {
            centre: o.centre,
            split: o.split,
            height: o.magnitude.height,
            direction: o.magnitude.direction,
            amplitude,
        });
        Ok(Self { values: compressed(points.len(), &columns), functions: functions.collect(), vectors: None })
    }

    /// The basis that was taken apart into [`Basis::functions`] and the columns of [`Basis::values`]: how many
    /// entries each has, and all their rows and values one column after the other.
    ///
    /// Only the form is checked. Whether it is the basis of a certain mesh, [`Basis::digest`] tells.
    ///
    /// # Errors
    /// [`PartsError`] when the parts do not fit together.
    pub fn from_parts(
        vertices: usize,
        functions: Vec<Function>,
        lengths: &[usize],
        rows: Vec<usize>,
        values: Vec<f64>,
    ) -> Result<Self, PartsError> {
        let numbers = |f: &Function| {
            let [x, y, z] = f.direction.into();
            [f.height, f.amplitude, x, y, z]
        };
        if !functions.iter().flat_map(numbers).chain(values.iter().copied()).all(f64::is_finite) {
            return Err(PartsError::NotFinite);
        }
        let offsets = offsets(lengths).ok_or(PartsError::Lengths)?;
        let fits = lengths.len() == functions.len() && offsets.last() == Some(&rows.len());
        if !fits || rows.len() != values.len() {
            return Err(PartsError::Lengths);
        }
        let values = CscMatrix::try_from_csc_data(vertices, functions.len(), offsets, rows, values)
            .map_err(|_| PartsError::Rows)?;
        Ok(Self { values, functions, vectors: None })
    }

    /// The basis of functions that are vectors: for each what a unit of its coefficient does to vertices at ε = 1, in
    /// vertex order. [`Basis::functions`] then tells where each moves furthest, how far and where to.
    ///
    /// # Panics
    /// When a field is not sorted by vertex, or names one that is not below `vertices`.
    pub fn of_fields(vertices: usize, fields: Vec<Vec<(u32, Vector3<f64>)>>) -> Self {
        let lengths: Vec<usize> = fields.iter().map(Vec::len).collect();
        let count = lengths.iter().sum();
        let (mut rows, mut vectors) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for (row, d) in fields.into_iter().flatten() {
            rows.push(row as usize);
            vectors.push(d);
        }
        Self::from_vectors(vertices, &lengths, rows, vectors)
            .expect("each field has its vertices once, in order")
    }

    /// The same of columns.
    ///
    /// # Panics
    /// When a column names a vertex that is not below `vertices`, or a number is not finite.
    pub fn of_columns(vertices: usize, columns: Columns) -> Self {
        let (lengths, rows, vectors) = columns.into_parts();
        let rows = rows.into_par_iter().map(|row| row as usize).collect();
        Self::from_vectors(vertices, &lengths, rows, vectors)
            .expect("columns have their vertices once, in order, and numbers are finite")
    }

    /// The same from columns: how many entries each has, and all their rows and vectors one column after the other.
    ///
    /// # Errors
    /// [`PartsError`] when the parts do not fit together.
    pub fn from_vectors(
        vertices: usize,
        lengths: &[usize],
        rows: Vec<usize>,
        vectors: Vec<Vector3<f64>>,
    ) -> Result<Self, PartsError> {
        if !vectors.par_iter().all(|d| d.iter().all(|x| x.is_finite())) {
            return Err(PartsError::NotFinite);
        }
        let offsets = offsets(lengths).ok_or(PartsError::Lengths)?;
        if offsets.last() != Some(&rows.len()) || rows.len() != vectors.len() {
            return Err(PartsError::Lengths);
        }
        let vectors = CscMatrix::try_from_csc_data(vertices, lengths.len(), offsets, rows, vectors)
            .map_err(|_| PartsError::Rows)?;
        Ok(Self::of_matrix(vectors))
    }

    fn of_matrix(vectors: CscMatrix<Vector3<f64>>) -> Self {
        let function = |i: usize| {
            let column = vectors.col(i);
            let entries = column.row_indices().iter().zip(column.values());
            let largest = entries.max_by(|a, b| a.1.norm_squared().total_cmp(&b.1.norm_squared()));
            let (&centre, &d) = largest.unwrap_or((&0, &Vector3::zeros()));
            let (amplitude, direction) = (d.norm(), d.try_normalize(0.0).unwrap_or_default());
            Function { centre: VertexId::new(centre), split: 0, height: amplitude, direction, amplitude }
        };
        let functions = (0..vectors.ncols()).into_par_iter().map(function).collect();
        Self { values: CscMatrix::zeros(vectors.nrows(), vectors.ncols()), functions, vectors: Some(vectors) }
    }

    /// B at ε = 1 where functions are vectors.
    pub fn vectors(&self) -> Option<&CscMatrix<Vector3<f64>>> {
        self.vectors.as_ref()
    }

    /// How many coefficients a mesh can carry at most.
    pub fn capacity(progressive: &ProgressiveMesh, points: &[Point3<f64>]) -> usize {
        most_significant(&heights(progressive), progressive.shape_level(), usize::MAX, least_height(points))
            .len()
    }

    /// n, the number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.values.nrows()
    }

    /// Φ, n × m; without entries where functions are vectors.
    pub fn values(&self) -> &CscMatrix<f64> {
        &self.values
    }

    /// Centre, height and direction of each function; m entries.
    pub fn functions(&self) -> &[Function] {
        &self.functions
    }

    /// a_i d_i: where coefficient i = 1 moves its centre at epsilon = 1, in model units.
    pub fn step(&self, i: usize) -> Vector3<f64> {
        self.functions[i].direction * self.functions[i].amplitude
    }

    /// σ of each vertex: it moves by ε Σ_i b_i w_i with three numbers b_i a coefficient, and σ² = Σ_i |b_i|². In model units.
    pub fn deviations(&self) -> Vec<f64> {
        let mut squares = vec![0.0; self.vertex_count()];
        if let Some(vectors) = &self.vectors {
            for (row, d) in vectors.row_indices().iter().zip(vectors.values()) {
                squares[*row] += d.norm_squared();
            }
        }
        for (i, column) in self.values.col_iter().enumerate() {
            let step = self.step(i).norm_squared();
            for (&row, phi) in column.row_indices().iter().zip(column.values()) {
                squares[row] += step * phi * phi;
            }
        }
        squares.into_iter().map(f64::sqrt).collect()
    }

    /// B w with B = ε [φ_i a_i d_i]: one displacement for each vertex, in model units.
    ///
    /// # Panics
    /// When `w` does not have one entry for each function.
    pub fn displacements(&self, w: &[f64], epsilon: f64) -> Vec<Vector3<f64>> {
        assert_eq!(w.len(), self.functions.len(), "a coefficient for each function");
        let mut moved = vec![Vector3::zeros(); self.vertex_count()];
        if self.vectors.is_some() {
            moved.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, moved)| {
                let vertices = chunk * CHUNK..chunk * CHUNK + moved.len();
                for (i, w) in w.iter().enumerate() {
                    self.part(i, &vertices, |row, d| moved[row] += d * (epsilon * w));
                }
            });
            return moved;
        }
        for (i, column) in self.values.col_iter().enumerate() {
            let step = self.step(i) * (epsilon * w[i]);
            for (&row, &phi) in column.row_indices().iter().zip(column.values()) {
                moved[row] += step * phi;
            }
        }
        moved
    }

    /// These functions on points of which several vertices are copies: φ at a point is the mean of its
    /// copies, so that the copies move together. `point_of[v]` is the point of vertex v and must not
    /// decrease; `points` is how many there are, including those without a copy, which never move.
    ///
    /// # Panics
    /// When `point_of` is not sorted, does not name a point for each vertex, or names one that is not there.
    pub fn on_points(self, point_of: &[u32], points: usize) -> Self {
        if self.vectors.is_some() {
            return self.vectors_on_points(point_of, points);
        }
        let mut copies = vec![0.0; points];
        point_of.iter().for_each(|&p| copies[p as usize] += 1.0);
        let columns: Vec<Column> = self
            .values
            .col_iter()
            .map(|column| {
                let mut merged: Column = Vec::with_capacity(column.nnz());
                for (&row, &phi) in column.row_indices().iter().zip(column.values()) {
                    let point = point_of[row] as usize;
                    match merged.last_mut() {
                        Some((last, sum)) if *last == point => *sum += phi,
                        _ => merged.push((point, phi)),
                    }
                }
                merged.iter_mut().for_each(|(point, phi)| *phi /= copies[*point]);
                merged
            })
            .collect();
        Self { values: compressed(points, &columns), functions: self.functions, vectors: None }
    }

    /// [`on_points`](Self::on_points) of functions that are vectors.
    fn vectors_on_points(self, point_of: &[u32], points: usize) -> Self {
        let vectors = self.vectors.expect("functions that are vectors");
        if point_of.is_sorted_by(|a, b| a < b) {
            // Other names, and nothing to join: no copy is made.
            if point_of.len() == points && point_of.iter().all(|p| (*p as usize) < points) {
                return Self { vectors: Some(vectors), ..self };
            }
            let lengths: Vec<usize> = vectors.col_iter().map(|column| column.nnz()).collect();
            let (_, mut rows, values) = vectors.disassemble();
            rows.iter_mut().for_each(|row| *row = point_of[*row] as usize);
            return Self::from_vectors(points, &lengths, rows, values).expect("each point is one vertex");
        }
        let mut copies = vec![0.0; points];
        point_of.iter().for_each(|&p| copies[p as usize] += 1.0);
        let mean = |column: nalgebra_sparse::csc::CscCol<Vector3<f64>>| {
            let mut merged: Vec<(u32, Vector3<f64>)> = Vec::with_capacity(column.nnz());
            for (&row, d) in column.row_indices().iter().zip(column.values()) {
                let (point, part) = (point_of[row], d / copies[point_of[row] as usize]);
                match merged.last_mut() {
                    Some((last, sum)) if *last == point => *sum += part,
                    _ => merged.push((point, part)),
                }
            }
            merged
        };
        Self::of_fields(points, vectors.col_iter().map(mean).collect())
    }

    /// SHA-256 over everything that insertion and extraction depend on: sizes, centres, amplitudes, directions
    /// and every value of Φ, to the bit.
    pub fn digest(&self) -> [u8; 32] {
        let mut hash = Sha256::new();
        let mut number = |bits: u64| hash.update(bits.to_le_bytes());
        number(self.values.nrows() as u64);
        number(self.values.ncols() as u64);
        for (function, column) in self.functions.iter().zip(self.values.col_iter()) {
            number(function.centre.index() as u64);
            number(function.amplitude.to_bits());
            function.direction.iter().for_each(|x| number(x.to_bits()));
            number(column.nnz() as u64);
            for (&row, &phi) in column.row_indices().iter().zip(column.values()) {
                number(row as u64);
                number(phi.to_bits());
            }
        }
        if let Some(vectors) = &self.vectors {
            let mut number = |bits: u64| hash.update(bits.to_le_bytes());
            for column in vectors.col_iter() {
                number(column.nnz() as u64);
                for (&row, d) in column.row_indices().iter().zip(column.values()) {
                    number(row as u64);
                    d.iter().for_each(|x| number(x.to_bits()));
                }
            }
        }
        hash.finalize().into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radius::radii;
    use crate::support::{Places, Support};
    use proptest::prelude::*;
    use sombrero_mesh::{Soup, repair};
    use sombrero_shapes as shapes;

    fn surfaces() -> impl Strategy<Value = Soup> {
        prop_oneof![
            Just(shapes::sphere(2)),
            Just(shapes::torus(12, 8, 1.0, 0.4)),
            Just(shapes::genus(2, 2)),
            Just(shapes::genus(3, 1)),
            Just(shapes::open_sheet(9, 7)),
            Just(shapes::sheet_with_hole(8, 8)),
        ]
    }

    /// A surface whose vertices are shaken, so that collapses come in ever new orders.
    fn shaken() -> impl Strategy<Value = Soup> {
        (surfaces(), prop::collection::vec(-1.0..1.0f64, 1..200)).prop_map(|(mut soup, shifts)| {
            let size = soup.bounding_box().map_or(1.0, |b| b.largest_side());
            let coordinates = soup.points.iter_mut().flat_map(|p| p.coords.iter_mut());
            for (x, shift) in coordinates.zip(shifts.iter().cycle()) {
                *x += 0.03 * size * shift;
            }
            soup
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn all_functions_with_the_base_vertices_are_independent_and_complete(soup in shaken(), which in 0usize..3) {
            let made = repair(&soup);
            let mut progressive = ProgressiveMesh::new(made.mesh, &made.points).expect("repaired points are finite");
            let splits: Vec<usize> = (0..progressive.split_count()).collect();
            let outlines = outlines(&mut progressive, &made.points, &splits, &Progress::silent());
            prop_assert_eq!(outlines.len(), splits.len());
            let columns = columns(&progressive, &made.points, &outlines, BasisFunction::PROFILES[which], || ());

            // Order by age: base vertices, then vertices by their split.
            let mut order: Vec<usize> = progressive.base_vertices().iter().map(|v| v.index()).collect();
            let base = order.len();
            order.extend(outlines.iter().map(|o| o.centre.index()));
            let n = made.points.len();
            prop_assert_eq!(order.len(), n, "as many functions as vertices");
            let mut age = vec![usize::MAX; n];
            order.iter().enumerate().for_each(|(i, &v)| age[v] = i);
            prop_assert!(!age.contains(&usize::MAX), "every vertex once");

            let mut matrix = nalgebra::DMatrix::<f64>::identity(n, n);
            for (i, column) in columns.iter().enumerate() {
                for &(v, phi) in column {
                    matrix[(age[v], base + i)] = phi;
                    prop_assert!(age[v] >= base + i || phi == 0.0, "zero on every older vertex");
                }
                prop_assert_eq!(matrix[(base + i, base + i)], 1.0, "one at the centre");
            }
            // Full rank, by solving for a known combination.
            let weights = nalgebra::DVector::from_fn(n, |i, _| 1.0 + (i % 7) as f64);
            let solved = matrix.solve_lower_triangular(&(&matrix * &weights));
            prop_assert!(solved.is_some_and(|x| (x - &weights).amax() < 1e-6 * weights.amax()));
        }

        #[test]
        fn radii_are_zero_at_the_centre_and_one_on_the_boundary(soup in shaken()) {
            let made = repair(&soup);
            let mut progressive = ProgressiveMesh::new(made.mesh, &made.points).expect("repaired points are finite");
            let splits: Vec<usize> = (0..progressive.split_count()).collect();
            let mut places = Places::new(made.points.len());
            let outlines = outlines(&mut progressive, &made.points, &splits, &Progress::silent());
            let mesh = progressive.mesh();
            let age = vec![0; made.points.len()];
            for outline in &outlines {
                let support = Support::fill(mesh, &made.points, &age, outline, &mut places);
                let r = radii(&support);
                prop_assert_eq!(r[0], 0.0);
                prop_assert!(r[1..].iter().all(|r| *r > 0.0 && *r < 1.0));
                prop_assert!(!support.boundary.is_empty());
                prop_assert!(support.boundary.iter().all(|b| outline.vertices.contains(b)), "the loop closes the inside off");
                for pair in outline.vertices.windows(2) {
                    prop_assert!(mesh.halfedge_between(pair[0], pair[1]).is_some(), "the loop runs along edges");
                }
                if !outline.closed {
                    prop_assert!([outline.vertices[0], outline.vertices[outline.vertices.len() - 1]].iter().all(|v| mesh.is_boundary_vertex(*v)));
                }
            }
        }
    }

    fn sphere_basis(coefficients: usize) -> Result<Basis, BasisError> {
        let soup = shapes::bumpy_sphere(600);
        let made = repair(&soup);
        let progressive = ProgressiveMesh::new(made.mesh, &made.points).expect("repaired points are finite");
        Basis::new(progressive, &made.points, &BasisOptions { coefficients, ..Default::default() })
    }

    #[test]
    fn too_small_a_mesh_says_how_much_it_could_carry() {
        let Err(BasisError::TooFewSplits { wanted: 5000, available }) = sphere_basis(5000) else {
            panic!("600 vertices cannot carry 5000 coefficients")
        };
        assert!(sphere_basis(available).is_ok());
    }

    #[test]
    fn displacements_are_the_product_with_the_matrix() {
        let basis = sphere_basis(7).unwrap();
        let w: Vec<f64> = (0..7).map(|i| f64::from(i) - 2.5).collect();
        let moved = basis.displacements(&w, 0.01);
        for (v, moved) in moved.iter().enumerate() {
            let mut expected = Vector3::zeros();
            for (i, w) in w.iter().enumerate() {
                let phi = basis.values().get_entry(v, i).map_or(0.0, |e| e.into_value());
                expected += basis.step(i) * (phi * w * 0.01);
            }
            assert!((moved - expected).norm() < 1e-15);
        }
    }

    #[test]
    fn vectors_move_what_they_say_and_copies_by_their_mean() {
        let fields =
            [vec![(0, Vector3::x()), (3, Vector3::new(1.0, 2.0, 3.0))], vec![(2, Vector3::y() * 2.0)]];
        let basis = Basis::of_fields(4, fields.to_vec());
        let moved = basis.displacements(&[2.0, -1.0], 0.5);
        assert_eq!(moved, [Vector3::x(), Vector3::zeros(), -Vector3::y(), Vector3::new(1.0, 2.0, 3.0)]);
        let joined = basis.clone().on_points(&[0, 0, 1, 1], 3);
        let moved = joined.displacements(&[2.0, -1.0], 0.5);
        let half = Vector3::new(0.5, 0.5, 1.5);
        assert_eq!(moved, [Vector3::x() / 2.0, half, Vector3::zeros()]);
        assert_ne!(joined.digest(), basis.digest());
        let mut other = fields.clone();
        other[1][0].1.y = 2.0 + f64::EPSILON * 2.0;
        assert_ne!(Basis::of_fields(4, other.to_vec()).digest(), basis.digest());
        let columns = || (vec![0, 3, 2], vec![Vector3::x(), Vector3::y(), Vector3::z()]);
        let refused = |lengths: &[usize], n| {
            let (rows, vectors) = columns();
            Basis::from_vectors(n, lengths, rows, vectors).map(|_| ()).unwrap_err()
        };
        assert_eq!(refused(&[2, 2], 4), PartsError::Lengths);
        assert_eq!(refused(&[2, usize::MAX], 4), PartsError::Lengths);
        assert_eq!(refused(&[2, 1], 3), PartsError::Rows);
        assert_eq!(refused(&[3], 4), PartsError::Rows);
    }

    type Parts = (Vec<Function>, Vec<usize>, Vec<usize>, Vec<f64>);

    fn parts(basis: &Basis) -> Parts {
        let columns = || basis.values().col_iter();
        (
            basis.functions().to_vec(),
            columns().map(|c| c.nnz()).collect(),
            columns().flat_map(|c| c.row_indices().to_vec()).collect(),
            columns().flat_map(|c| c.values().to_vec()).collect(),
        )
    }

    #[test]
    fn a_basis_taken_apart_is_put_together_again() {
        let basis = sphere_basis(20).unwrap();
        let (functions, lengths, rows, values) = parts(&basis);
        let again = Basis::from_parts(basis.vertex_count(), functions, &lengths, rows, values).unwrap();
        assert_eq!(again, basis);
        assert_eq!(again.digest(), basis.digest());
    }

    #[test]
    fn parts_that_do_not_fit_are_refused() {
        let basis = sphere_basis(5).unwrap();
        let n = basis.vertex_count();
        let refused = |n: usize, spoil: fn(&mut Parts)| {
            let mut spoilt = parts(&basis);
            spoil(&mut spoilt);
            let (functions, lengths, rows, values) = spoilt;
            Basis::from_parts(n, functions, &lengths, rows, values).unwrap_err()
        };
        assert_eq!(refused(n, |p| p.0.truncate(4)), PartsError::Lengths);
        assert_eq!(refused(n, |p| p.1.push(0)), PartsError::Lengths);
        assert_eq!(refused(n, |p| p.1[2] += 1), PartsError::Lengths);
        assert_eq!(refused(n, |p| p.1[2] = usize::MAX), PartsError::Lengths);
        assert_eq!(refused(n, |p| p.2.truncate(1)), PartsError::Lengths);
        assert_eq!(refused(n, |p| p.3.push(0.5)), PartsError::Lengths);
        assert_eq!(refused(3, |_| ()), PartsError::Rows);
        assert_eq!(refused(n, |p| p.2.swap(0, 1)), PartsError::Rows);
        assert_eq!(refused(n, |p| p.2[1] = p.2[0]), PartsError::Rows);
        assert_eq!(refused(n, |p| p.3[7] = f64::NAN), PartsError::NotFinite);
        assert_eq!(refused(n, |p| p.0[3].amplitude = f64::INFINITY), PartsError::NotFinite);
        assert_eq!(refused(n, |p| p.0[3].direction.z = f64::NAN), PartsError::NotFinite);
    }

    #[test]
    fn copies_of_a_point_share_the_mean_of_their_values() {
        let basis = sphere_basis(3).unwrap();
        let n = basis.vertex_count() as u32;
        let point_of: Vec<u32> = (0..n).map(|v| v / 2).collect();
        let merged = basis.clone().on_points(&point_of, n.div_ceil(2) as usize + 1);
        let value =
            |b: &Basis, v: usize, i: usize| b.values().get_entry(v, i).map_or(0.0, |e| e.into_value());
        for (point, i) in (0..n as usize / 2).flat_map(|p| (0..3).map(move |i| (p, i))) {
            let mean = (value(&basis, 2 * point, i) + value(&basis, 2 * point + 1, i)) / 2.0;
            assert!((value(&merged, point, i) - mean).abs() < 1e-15);
        }
    }

    #[test]
    fn rounding_errors_of_a_tilted_plane_are_no_relief() {
        let turn = nalgebra::Rotation3::from_scaled_axis(nalgebra::Vector3::new(0.3, 0.5, 0.2));
        for decimals in [1e6, 1e16] {
            let rounded = |c: f64| (c * decimals).round() / decimals;
            let mut soup = shapes::open_sheet(20, 20);
            soup.points.iter_mut().for_each(|p| *p = (turn * Point3::new(p.x, p.y, 0.0)).map(rounded));
            let made = repair(&soup);
            let progressive =
                ProgressiveMesh::new(made.mesh, &made.points).expect("repaired points are finite");
            assert_eq!(Basis::capacity(&progressive, &made.points), 0, "{decimals}");
        }
    }
}
