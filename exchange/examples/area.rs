fn main() {
    for path in std::env::args().skip(1) {
        let Ok(import) = claymill_exchange::read(path.as_ref()) else {
            continue;
        };
        // crude area: grid midpoint with even-odd of dense polygons
        let mut total = 0.0;
        for face in &import.model.faces {
            let s = &face.surface;
            let rings: Vec<Vec<(f64, f64)>> = face
                .loops
                .iter()
                .map(|l| {
                    l.edges
                        .iter()
                        .flat_map(|e| {
                            let (a, b) = e.pcurve.domain();
                            let n = 64 * e.pcurve.knots().breaks().len();
                            (0..n)
                                .map(|i| {
                                    let p = e.pcurve.point(a + (b - a) * i as f64 / n as f64);
                                    (p.x, p.y)
                                })
                                .collect::<Vec<_>>()
                        })
                        .collect()
                })
                .collect();
            let bu = s.knots_u().breaks();
            let bv = s.knots_v().breaks();
            let k = if rings.is_empty() {
                4
            } else {
                (200 / bu.len().max(bv.len())).max(8)
            };
            let cells = |b: &[f64]| -> Vec<(f64, f64)> {
                b.windows(2)
                    .flat_map(|w| {
                        (0..k).map(move |i| {
                            let h = (w[1] - w[0]) / k as f64;
                            (w[0] + h * (i as f64 + 0.5), h)
                        })
                    })
                    .collect()
            };
            let mut area = 0.0;
            for (u, hu) in cells(&bu) {
                for (v, hv) in cells(&bv) {
                    if !rings.is_empty() {
                        let mut inside = false;
                        for r in &rings {
                            for i in 0..r.len() {
                                let (a, b) = (r[i], r[(i + 1) % r.len()]);
                                if (a.1 > v) != (b.1 > v) && u < a.0 + (v - a.1) / (b.1 - a.1) * (b.0 - a.0) {
                                    inside = !inside;
                                }
                            }
                        }
                        if !inside {
                            continue;
                        }
                    }
                    let j = s.jet(u, v);
                    area += j.su.cross(&j.sv).norm() * hu * hv;
                }
            }
            total += area;
        }
        println!("{path} {total:.3}");
    }
}
