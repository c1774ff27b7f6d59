//! What hangs together by links (disjoint sets, Galler and Fischer 1964).

/// For each of `count` things the smallest number of those that it is connected with.
///
/// ```
/// assert_eq!(sombrero_mesh::connected(5, [[3, 1], [4, 3]]), [0, 1, 2, 1, 1]);
/// ```
///
/// # Panics
/// When a link names a thing that is not there.
pub fn connected(count: usize, links: impl IntoIterator<Item = [u32; 2]>) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..count as u32).collect();
    for link in links {
        let [a, b] = link.map(|v| root(&mut parent, v));
        parent[a.max(b) as usize] = a.min(b);
    }
    (0..count as u32).map(|v| root(&mut parent, v)).collect()
}

fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        parent[v as usize] = parent[parent[v as usize] as usize];
        v = parent[v as usize];
    }
    v
}
