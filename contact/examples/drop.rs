//! A ball dropped along rows over a whole model, on one core: `drop MODEL [RADIUS [ROWS [STEP]]] [-o FILE]` (mm).
//! Prints a line of key and value each: locations, CPU seconds for covering and for dropping, what carries the ball; and
//! rates where contacts are certified and everywhere else, places with nothing below counted as time alone.
//! With `--gouge FILE` instead of rows: how deep the ball cuts at each centre in the file, by closest points, mm.
//! The file gets `x y z` of every location's centre, three little-endian f64 each, `z` NaN where nothing is below.

use std::io::Write;
use std::time::{Duration, Instant};

use claymill_contact::{BallDrop, Covering, Frame, March, Support};
use claymill_nurbs::{ClosestPoints, Face, Model, Point3};
use claymill_tests::thread_cpu_s;

/// Radius less distance of each centre; negative where the ball does not touch.
fn print_gouges(model: &Model, radius_mm: f64, centres: &[u8]) -> Result<(), Box<dyn std::error::Error>> {
    let closest = ClosestPoints::new(model);
    for centre in centres.chunks_exact(24) {
        let number = |k: usize| f64::from_le_bytes(std::array::from_fn(|i| centre[8 * k + i]));
        let foot = closest.closest(&Point3::new(number(0), number(1), number(2)), 4.0 * radius_mm);
        println!("{}", foot.map_or(-3.0 * radius_mm, |f| radius_mm - f.distance_mm));
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut option = |name: &str| {
        arguments.iter().position(|a| a == name).map(|at| arguments.split_off(at).swap_remove(1))
    };
    let (file, centres) = (option("-o"), option("--gouge"));
    let number = |k: usize, usual: f64| arguments.get(k).map_or(Ok(usual), |a| a.parse());
    let (radius_mm, rows_mm, step_mm) = (number(1, 10.0)?, number(2, 2.0)?, number(3, 1.0)?);
    let model = claymill_exchange::read(arguments.first().ok_or("which model?")?.as_ref())?.model;
    if let Some(centres) = centres {
        return print_gouges(&model, radius_mm, &std::fs::read(centres)?);
    }
    let start = Instant::now();
    let area_mm2 = model.faces.iter().map(Face::area_mm2).sum();
    let covering = Covering::new(&model, &vec![false; model.faces.len()], area_mm2, radius_mm)
        .map_err(|(face, error)| format!("face {face}: {error}"))?;
    // Front +x: setup coordinates are model coordinates.
    let [top, ..] = Frame::five("+z".parse()?, "+x".parse()?)?;
    let ball = BallDrop::new(&model, &covering, &top, radius_mm);
    println!("covered_s {:.3}", start.elapsed().as_secs_f64());
    let points = model.faces.iter().flat_map(|f| f.surface.net()).map(|h| h.xyz() / h.w);
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for p in points {
        for k in 0..2 {
            (low[k], high[k]) = (low[k].min(p[k]), high[k].max(p[k]));
        }
    }
    let count = |k: usize, step: f64| ((high[k] - low[k]) / step) as usize + 1;
    let (lines, columns) = (count(1, rows_mm), count(0, step_mm));
    let place = |i: usize, j: usize| (low[0] + step_mm * i as f64, low[1] + rows_mm * j as f64);
    let (mut heights, mut counts) = (vec![f64::NAN; lines * columns], [0usize; 3]);
    let (mut certified, mut simple) = (0usize, vec![false; heights.len()]);
    let before = thread_cpu_s(start);
    for j in 0..lines {
        let mut march = March::new(&ball);
        for i in 0..columns {
            let (x, y) = place(i, j);
            if let Some(location) = march.drop(x, y) {
                certified += usize::from(location.certified);
                simple[j * columns + i] = location.certified;
                heights[j * columns + i] = location.centre.z;
                counts[match location.support {
                    Support::Face { .. } => 0,
                    Support::Edge => 1,
                    Support::Bound | Support::Side => 2,
                }] += 1;
            }
        }
    }
    let seconds = thread_cpu_s(start) - before;

    println!("places {}", heights.len());
    println!("dropped_cpu_s {seconds:.3}");
    println!("locations {}", counts.iter().sum::<usize>());
    println!("per_s {:.0}", counts.iter().sum::<usize>() as f64 / seconds);
    for (name, count) in ["face", "edge", "bound"].iter().zip(counts) {
        println!("{name} {count}");
    }
    println!("certified {certified}");
    // Once more, with what is certified known: certified places and all others apart, run by run of a row.
    let (mut on_simple, mut on_complex) = (Duration::ZERO, Duration::ZERO);
    for j in 0..lines {
        let mut march = March::new(&ball);
        let mut i = 0;
        while i < columns {
            let is_simple = simple[j * columns + i];
            let begun = Instant::now();
            while i < columns && simple[j * columns + i] == is_simple {
                let (x, y) = place(i, j);
                march.drop(x, y);
                i += 1;
            }
            *(if is_simple { &mut on_simple } else { &mut on_complex }) += begun.elapsed();
        }
    }
    let complex = counts.iter().sum::<usize>() - certified;
    println!("simple_per_s {:.0}", certified as f64 / on_simple.as_secs_f64());
    println!("complex_per_s {:.0}", complex as f64 / on_complex.as_secs_f64());
    if let Some(file) = file {
        let mut out = std::io::BufWriter::new(std::fs::File::create(file)?);
        for (k, &z) in heights.iter().enumerate() {
            let (x, y) = place(k % columns, k / columns);
            for v in [x, y, z] {
                out.write_all(&v.to_le_bytes())?;
            }
        }
        out.flush()?;
    }
    Ok(())
}
