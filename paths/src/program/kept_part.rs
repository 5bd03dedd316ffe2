//! The form in which a part is kept: the same numbers, bit for bit.

use std::collections::BTreeSet;

use claymill_nurbs::{Curve3, KnotVector, NurbsError, Point3};
use claymill_toolpath::{Considered, Move};
use serde::{Deserialize, Serialize};

use crate::Strategy;
use crate::follow::proofs::Proofs;
use crate::program::part::{Part, Pass};
use crate::setup::rows_along::RowsAlong;

/// A part, as it is kept; `None` of a part in which nothing is cut.
#[derive(Serialize, Deserialize)]
pub(crate) struct KeptPart(Option<Fields>);

#[derive(Serialize, Deserialize)]
struct Fields {
    moves: Vec<Move>,
    strategy: Strategy,
    considered: Vec<Considered>,
    along: Option<RowsAlong>,
    passes: u32,
    retracts: u32,
    proofs: Proofs,
    laid: Vec<KeptPass>,
    lifted_to: BTreeSet<u32>,
}

#[derive(Serialize, Deserialize)]
struct KeptPass {
    curves: Vec<KeptCurve>,
    beside_walls: bool,
}

#[derive(Serialize, Deserialize)]
struct KeptCurve {
    degree: usize,
    knots: Vec<f64>,
    points: Vec<[f64; 3]>,
    weights: Option<Vec<f64>>,
}

impl From<&Option<Part>> for KeptPart {
    fn from(part: &Option<Part>) -> Self {
        KeptPart(part.as_ref().map(|part| Fields {
            // No pass is put off before the stock is followed.
            moves: part.moves.concat(),
            strategy: part.strategy,
            considered: part.considered.clone(),
            along: part.along,
            passes: part.passes,
            retracts: part.retracts,
            proofs: part.proofs,
            laid: part.laid.iter().map(KeptPass::from).collect(),
            lifted_to: part.lifted_to.clone(),
        }))
    }
}

impl KeptPart {
    /// The part.
    ///
    /// # Errors
    /// A curve is none: these are not the bytes of a part.
    pub(crate) fn part(self) -> Result<Option<Part>, NurbsError> {
        let Some(fields) = self.0 else { return Ok(None) };
        let laid = fields.laid.into_iter().map(KeptPass::pass).collect::<Result<Vec<_>, _>>()?;
        let Fields { moves, strategy, considered, along, passes, retracts, proofs, lifted_to, .. } = fields;
        Ok(Some(Part {
            moves: vec![moves],
            strategy,
            considered,
            along,
            passes,
            retracts,
            proofs,
            laid,
            lifted_to,
        }))
    }
}

impl From<&Pass> for KeptPass {
    fn from(pass: &Pass) -> Self {
        let kept = |curve: &Curve3| KeptCurve {
            degree: curve.knots().degree(),
            knots: curve.knots().as_slice().to_vec(),
            points: curve.points().iter().map(|&p| p.into()).collect(),
            weights: curve.weights().map(<[f64]>::to_vec),
        };
        KeptPass { curves: pass.curves.iter().map(kept).collect(), beside_walls: pass.beside_walls }
    }
}

impl KeptPass {
    fn pass(self) -> Result<Pass, NurbsError> {
        let curve = |kept: KeptCurve| {
            let points = kept.points.into_iter().map(Point3::from).collect();
            Curve3::new(KnotVector::new(kept.degree, kept.knots)?, points, kept.weights)
        };
        let curves = self.curves.into_iter().map(curve).collect::<Result<Vec<_>, _>>()?;
        // A pass without curves has no ends.
        if curves.is_empty() {
            return Err(NurbsError::NetSize { needed: 1, given: 0 });
        }
        Ok(Pass { curves, beside_walls: self.beside_walls, put_off: 0 })
    }
}
