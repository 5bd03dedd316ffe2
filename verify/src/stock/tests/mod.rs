//! The stock against closed forms, brute force and planted faults.

mod cases;
mod cells;
mod columns;
mod engaged;
mod faults;
mod left;
mod membership;
mod rapids;
mod refused;
mod stocks;

use claymill_nurbs::{Curve3, KnotVector, Point3, Vector3};
use claymill_toolpath::{Holder, Move, MoveKind, Tool, ToolRecord};

use super::body::Shape;
use super::tool_bodies::{ToolBody, ToolPart};
use super::{InitialStock, StockCheck, StockOptions};

/// A tool `T1`, `T2` … from its text, with a holder if one is named.
pub(super) fn tool(id: &str, text: &str, holder: Option<&str>) -> ToolRecord {
    let tool: Tool = text.parse().unwrap();
    let holder = holder.map(|h| Holder::parse(h, &tool).unwrap());
    ToolRecord { id: id.into(), tool, holder, setup_stick_out_mm: Default::default() }
}

/// A straight move of tool `T1` along z.
pub(super) fn straight(kind: MoveKind, from: [f64; 3], to: [f64; 3]) -> Move {
    let m = Move::straight(kind, from.into(), to.into(), Vector3::z(), 1000.0);
    Move { tool: "T1".into(), setup: "top".into(), ..m }
}

/// Straight moves of one kind through points.
pub(super) fn polyline(kind: MoveKind, points: &[[f64; 3]]) -> Vec<Move> {
    points.windows(2).map(|w| straight(kind, w[0], w[1])).collect()
}

/// Numbers the moves in their order.
pub(super) fn numbered(moves: Vec<Move>) -> Vec<Move> {
    moves.into_iter().enumerate().map(|(k, m)| Move { seq: k as u64, ..m }).collect()
}

/// A circle about the z axis, as an exact rational quadratic.
pub(super) fn circle(radius: f64, height: f64) -> Move {
    let w = 0.5f64.sqrt();
    let net = [
        [1.0, 0.0],
        [1.0, 1.0],
        [0.0, 1.0],
        [-1.0, 1.0],
        [-1.0, 0.0],
        [-1.0, -1.0],
        [0.0, -1.0],
        [1.0, -1.0],
    ];
    let points = net.iter().chain([&net[0]]).map(|[x, y]| Point3::new(radius * x, radius * y, height));
    let knots = [0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0, 4.0].map(|k| k * radius);
    let weights = (0..9).map(|k| if k % 2 == 0 { 1.0 } else { w }).collect();
    let knots = KnotVector::new(2, knots.to_vec()).unwrap();
    let curve = Curve3::new(knots, points.collect(), Some(weights)).unwrap();
    let m = Move::along(MoveKind::Cut, &curve, Vector3::z(), 1000.0);
    Move { tool: "T1".into(), setup: "top".into(), ..m }
}

pub(super) fn block(low: [f64; 3], high: [f64; 3]) -> InitialStock<'static> {
    InitialStock::block(low.into(), high.into()).unwrap()
}

pub(super) fn check<'a>(stock: InitialStock<'a>, moves: &'a [Move], tools: &[ToolRecord]) -> StockCheck<'a> {
    StockCheck::new(stock, moves, tools, &StockOptions::default(), &|| true).unwrap()
}

/// A ball without flutes or shank, for all moves.
pub(super) fn bare_ball<'a>(stock: InitialStock<'a>, moves: &'a [Move], radius: f64) -> StockCheck<'a> {
    let shape = Shape::End { disc: 0.0, corner: radius, centre: radius, cap: f64::INFINITY };
    let body = ToolBody { part: ToolPart::Flutes, shape };
    let of_move = vec![0; moves.len()];
    let options = StockOptions::default();
    StockCheck::with_bodies(stock, moves, vec![vec![body]], of_move, &options, &|| true).unwrap()
}

/// Numbers in [0, 1) that look random, from a seed.
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let z = (self.0 ^ (self.0 >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        ((z ^ (z >> 32)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub(super) fn vector(&mut self, size: f64) -> Vector3 {
        Vector3::new(self.between(-size, size), self.between(-size, size), self.between(-size, size))
    }

    pub(super) fn direction(&mut self) -> Vector3 {
        loop {
            let v = self.vector(1.0);
            if (0.01..1.0).contains(&v.norm()) {
                return v.normalize();
            }
        }
    }
}
