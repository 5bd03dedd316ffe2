//! Dropped balls against exact closest points, which share with the drop nothing but the evaluation of surfaces: on the
//! corpus, for four radii and from five directions, scattered and along rows.
//!
//! `cargo test --release -p claymill-paths --test locations -- --ignored --nocapture` looks at a million places a model
//! and prints a row each.

use std::path::Path;

use claymill_contact::{BallDrop, Covering, Frame, March, Support};
use claymill_nurbs::{ClosestPoints, Face, Hint, Point3};
use rayon::prelude::*;

const RADII_MM: [f64; 4] = [3.0, 6.0, 10.0, 12.7];
/// Models larger than a car (root of their area, mm) are looked at with balls larger in proportion.
const CAR_MM: f64 = 8000.0;
const GOUGE_MM: f64 = 1e-3;
/// What a ball may stand off: by as much a location on a bound is too high, at most.
const STAND_OFF_MM: f64 = 1e-3;
const ROW_STEP_MM: f64 = 1.0;
const ROW_PLACES: usize = 100;

/// What was found on a model.
#[derive(Debug, Default, Clone, Copy)]
struct Found {
    locations: usize,
    certified: usize,
    bounds: usize,
    deepest_mm: f64,
    highest_mm: f64,
}

impl Found {
    fn with(self, other: Found) -> Found {
        Found {
            locations: self.locations + other.locations,
            certified: self.certified + other.certified,
            bounds: self.bounds + other.bounds,
            deepest_mm: self.deepest_mm.max(other.deepest_mm),
            highest_mm: self.highest_mm.max(other.highest_mm),
        }
    }
}

/// Places in the unit square that fill it evenly.
fn scattered(k: usize) -> [f64; 2] {
    [0.754_877_666_246_693, 0.569_840_290_998_053_2].map(|ratio| (0.5 + ratio * k as f64).fract())
}

/// About `count` locations on one model with balls of these radii.
fn look(path: &Path, radii_mm: &[f64], count: usize) -> Found {
    let model = claymill_exchange::read(path).unwrap().model;
    let closest = ClosestPoints::new(&model);
    let area_mm2: f64 = model.faces.iter().map(Face::area_mm2).sum();
    let larger = (area_mm2.sqrt() / CAR_MM).max(1.0);
    let frames = Frame::five("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap();
    let rows = count / (radii_mm.len() * frames.len() * 2 * ROW_PLACES);
    let mut found = Found::default();
    for radius_mm in radii_mm.iter().map(|r| r * larger) {
        let covering = Covering::new(&model, &vec![false; model.faces.len()], area_mm2, radius_mm).unwrap();
        for frame in frames {
            let ball = BallDrop::new(&model, &covering, &frame, radius_mm);
            let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
            for p in model
                .faces
                .iter()
                .flat_map(|f| f.surface.net())
                .map(|h| frame.to_setup(&(h.xyz() / h.w).into()))
            {
                low = [low[0].min(p.x), low[1].min(p.y)];
                high = [high[0].max(p.x), high[1].max(p.y)];
            }
            let place = |k: usize| {
                let [s, t] = scattered(k);
                (low[0] + s * (high[0] - low[0]), low[1] + t * (high[1] - low[1]))
            };
            let of_row = |row: usize| {
                let mut found = Found::default();
                let mut hint = Hint::default();
                let mut march = March::new(&ball);
                let (x, y) = place(row);
                for k in 0..ROW_PLACES {
                    let (sx, sy) = place(rows + row * ROW_PLACES + k);
                    for location in
                        [march.drop(x + ROW_STEP_MM * k as f64, y), ball.drop(sx, sy)].into_iter().flatten()
                    {
                        let centre: Point3 = frame.to_model(&location.centre);
                        let near = closest.closest_from(&centre, 2.0 * radius_mm, &mut hint);
                        let apart = near.map_or(2.0 * radius_mm, |f| f.distance_mm) - radius_mm;
                        found = found.with(Found {
                            locations: 1,
                            certified: usize::from(location.certified),
                            bounds: usize::from(location.support == Support::Bound),
                            deepest_mm: -apart,
                            highest_mm: apart,
                        });
                    }
                }
                found
            };
            found = (0..rows)
                .into_par_iter()
                .map(of_row)
                .collect::<Vec<_>>()
                .into_iter()
                .fold(found, Found::with);
        }
    }
    found
}

#[test]
fn no_location_gouges() {
    let Some(folder) = claymill_tests::corpus() else { return };
    for name in ["helmet_928.igs", "prismatic_ctc05_inch.stp", "race_car_nose_141.stp"] {
        let found = look(&folder.join(name), &[3.0, 12.7], 12_000);
        assert!(found.locations > 3000, "{name}: {found:?}");
        assert!(found.deepest_mm < GOUGE_MM, "{name}: {found:?}");
        assert!(found.highest_mm < STAND_OFF_MM, "{name}: {found:?}");
    }
}

#[test]
#[ignore = "a million locations for each model of the corpus take minutes"]
fn no_location_of_a_million_gouges() {
    let Some(folder) = claymill_tests::corpus() else { return };
    let mut files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|f| matches!(f.extension().and_then(|e| e.to_str()), Some("igs" | "iges" | "stp" | "3dm")));
    files.sort();
    println!(
        "{:32}{:>11}{:>13}{:>9}{:>12}{:>12}",
        "model", "locations", "certified, %", "bounds", "gouge, µm", "off, µm"
    );
    let mut failed = Vec::new();
    for file in files {
        let found = look(&file, &RADII_MM, 1_000_000);
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let [gouge, off] = [found.deepest_mm, found.highest_mm].map(|mm| mm * 1e3);
        let certified = 100.0 * found.certified as f64 / found.locations.max(1) as f64;
        println!("{name:32}{:11}{certified:13.1}{:9}{gouge:12.4}{off:12.4}", found.locations, found.bounds);
        if found.deepest_mm >= GOUGE_MM {
            failed.push(name);
        }
    }
    assert!(failed.is_empty(), "gouges on {failed:?}");
}
