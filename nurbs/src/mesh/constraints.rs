//! Edges that a triangulation has to keep, also where they cross each other.
//!
//! ```text
//!        d                 d          both edges are cut where they cross, and their parts are kept instead;
//!        │                 │          rounding puts the place a little beside the edges, so that the parts
//!   a ───┼─── b       a ───●─── b     may cross others again, and are cut there in their turn
//!        │                 │
//!        c                 c
//! ```
//!
//! Spade cuts crossing edges, too (`add_constraint_and_split`), but takes for granted that nothing is in the way of the parts.
//! Where three edges as good as meet something is, and it panics.

use spade::handles::FixedVertexHandle;
use spade::{Point2, PositionInTriangulation, Triangulation, mitigate_underflow};

use super::trimmed::{Cdt, Vertex};
use crate::NurbsError;

/// Edges of trim loops that cross others, at most: each crossing is a further point.
const MOST_CROSSING: usize = 10_000;
/// Cuts nearer than this to a vertex, in grid steps, are there.
const SAME_PLACE: f64 = 1e-9;
/// And so many cuts in all.
const MOST_CUTS: usize = 100_000;

/// Makes edges of the triangulation. Those that cross are cut where they do; the vertices for this have no index yet.
pub(super) fn keep_edges(
    cdt: &mut Cdt,
    edges: impl Iterator<Item = [FixedVertexHandle; 2]>,
    new_vertex: impl Fn(Point2<f64>) -> Vertex,
) -> Result<(), NurbsError> {
    let crossing: Vec<_> = edges.filter(|&[a, b]| cdt.try_add_constraint(a, b).is_empty()).collect();
    let too_many = |places: usize| {
        let reason = format!("its trim loops cross themselves or each other in {places} places");
        Err(NurbsError::Mesh { reason })
    };
    if crossing.len() > MOST_CROSSING {
        return too_many(crossing.len());
    }
    let mut cuts = 0;
    for edge in crossing {
        let mut open = vec![edge];
        while let Some([a, b]) = open.pop() {
            if a == b || !cdt.try_add_constraint(a, b).is_empty() {
                continue;
            }
            let Some([c, d]) = first_crossed(cdt, a, b) else { continue };
            cuts += 1;
            if cuts > MOST_CUTS {
                return too_many(cuts);
            }
            let at = meet(cdt, [a, b], [c, d]);
            let cut = match vertex_at(cdt, at) {
                Some(there) => there,
                None => {
                    // First, as the new vertex would be put on it where it can be.
                    take_out(cdt, c, d);
                    cdt.insert(new_vertex(at)).map_err(refused)?
                }
            };
            if cut != c && cut != d {
                take_out(cdt, c, d);
                open.extend([[c, cut], [cut, d]]);
            }
            open.extend([[a, cut], [cut, b]]);
        }
    }
    Ok(())
}

/// The vertex at a place, as good as. Cuts that each have a vertex of their own there would cross each other's edges in ever
/// new places.
fn vertex_at(cdt: &Cdt, at: Point2<f64>) -> Option<FixedVertexHandle> {
    let around: Vec<FixedVertexHandle> = match cdt.locate(at) {
        PositionInTriangulation::OnVertex(there) => return Some(there),
        PositionInTriangulation::OnEdge(edge) => {
            let edge = cdt.directed_edge(edge);
            let opposite = [edge, edge.rev()].map(|e| e.opposite_vertex());
            edge.vertices().into_iter().chain(opposite.into_iter().flatten()).map(|v| v.fix()).collect()
        }
        PositionInTriangulation::OnFace(face) => cdt.face(face).vertices().map(|v| v.fix()).into(),
        PositionInTriangulation::OutsideOfConvexHull(edge) => {
            cdt.directed_edge(edge).vertices().map(|v| v.fix()).into()
        }
        PositionInTriangulation::NoTriangulation => return None,
    };
    let off_squared = |v: &FixedVertexHandle| cdt.vertex(*v).position().distance_2(at);
    let nearest = around.into_iter().min_by(|v, w| off_squared(v).total_cmp(&off_squared(w)));
    nearest.filter(|v| off_squared(v) <= SAME_PLACE * SAME_PLACE)
}

/// What is said of a vertex that the triangulation does not take.
pub(super) fn refused(error: spade::InsertionError) -> NurbsError {
    NurbsError::Mesh { reason: error.to_string() }
}

/// The first edge to be kept that lies between two vertices.
fn first_crossed(cdt: &Cdt, a: FixedVertexHandle, b: FixedVertexHandle) -> Option<[FixedVertexHandle; 2]> {
    let mut crossed = cdt.get_conflicting_edges_between_vertices(a, b);
    crossed.next().map(|edge| edge.vertices().map(|v| v.fix()))
}

/// The edge between two vertices need not be kept any longer.
fn take_out(cdt: &mut Cdt, c: FixedVertexHandle, d: FixedVertexHandle) {
    let edge = cdt.get_edge_from_neighbors(c, d).map(|edge| edge.fix().as_undirected());
    if let Some(edge) = edge {
        cdt.remove_constraint_edge(edge);
    }
}

/// Where one edge crosses another. Of two that lie on each other as good as all along, rounding has no such place: they meet
/// in an end.
fn meet(cdt: &Cdt, edge: [FixedVertexHandle; 2], other: [FixedVertexHandle; 2]) -> Point2<f64> {
    let place = |v: FixedVertexHandle| {
        let place = cdt.vertex(v).position();
        nalgebra::Point2::new(place.x, place.y)
    };
    let ([a, b], [c, d]) = (edge.map(place), other.map(place));
    let beside = |p: nalgebra::Point2<f64>| (d - c).perp(&(p - c));
    let (of_a, of_b) = (beside(a), beside(b));
    let share = of_a / (of_a - of_b);
    let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
    let at = a + (b - a) * share;
    mitigate_underflow(Point2::new(at.x, at.y))
}
