//! What each field does at each vertex, one behind the other.

use crate::Field;
use crate::together::Here;
use nalgebra::Vector3;

/// Lists of (field, displacement) in order of fields, one for each vertex.
#[derive(Debug, Clone)]
pub(crate) struct Lists {
    all: Vec<(u32, Vector3<f64>)>,
    /// Where the list of each vertex starts and ends.
    places: Vec<[usize; 2]>,
}

/// Lists of some vertices.
#[derive(Debug)]
pub(crate) struct Piece {
    pub(crate) all: Vec<(u32, Vector3<f64>)>,
    /// Vertices, and how long the list of each is.
    pub(crate) lengths: Vec<(u32, usize)>,
}

impl Lists {
    /// Empty ones, with room for so many entries.
    pub(crate) fn new(vertices: usize, entries: usize) -> Self {
        Self { all: Vec::with_capacity(entries), places: vec![[0; 2]; vertices] }
    }

    /// Those of fields that are known for themselves.
    pub(crate) fn of_fields<'a>(vertices: usize, fields: impl IntoIterator<Item = &'a Field>) -> Self {
        let mut at = vec![Vec::new(); vertices];
        for (i, field) in (0_u32..).zip(fields) {
            field.iter().for_each(|(v, d)| at[*v as usize].push((i, *d)));
        }
        let mut lists = Self::new(vertices, 0);
        lists.add(&Piece { all: at.concat(), lengths: (0..).zip(at.iter().map(Vec::len)).collect() });
        lists
    }

    /// The list of a vertex.
    pub(crate) fn at(&self, vertex: u32) -> &Here {
        let [start, end] = self.places[vertex as usize];
        &self.all[start..end]
    }

    /// Those of all vertices.
    pub(crate) fn all(&self) -> Vec<&Here> {
        (0..self.places.len() as u32).map(|v| self.at(v)).collect()
    }

    /// How many entries there are.
    pub(crate) fn len(&self) -> usize {
        self.all.len()
    }

    /// Gives the vertices of a piece their lists.
    pub(crate) fn add(&mut self, piece: &Piece) {
        let mut start = self.all.len();
        for &(vertex, length) in &piece.lengths {
            self.places[vertex as usize] = [start, start + length];
            start += length;
        }
        self.all.extend_from_slice(&piece.all);
    }
}
