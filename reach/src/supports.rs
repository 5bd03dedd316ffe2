//! Sacrificial supports: how thick the two cylinders are that hold a part between the chucks.
//!
//! ```text
//!    chuck ║──support 1──┌────────── part ──────────┐──support 2──║ chuck       fixed at both ends
//!          ║     r₁      │            R             │     r₂      ║             torque T, force F at the tool
//!          ║──── Dt ─────└──────────  L  ───────────┘──── Dt ─────║
//! ```
//!
//! Twist: a torque at the end of the part runs off to both chucks, over one support, and over the part and the other
//! support. Those are springs beside each other and in a row, which gives the formula of CNC-RP (Frank, Wysk and
//! Joshi). It holds at the end beside support 2; beside support 1 the same formula with the supports exchanged holds, and
//! the larger one counts. Bending: the same three pieces as a beam that is clamped at both ends, with the force wherever
//! it bends most.

use std::f64::consts::PI;

use nalgebra::{SMatrix, SVector};
use thiserror::Error;

/// What a part and its supports are made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stiffness {
    /// Young's modulus, N/mm².
    pub young_mpa: f64,
    /// Shear modulus, N/mm².
    pub shear_mpa: f64,
    /// Stress at which it yields or breaks, N/mm².
    pub strength_mpa: f64,
}

impl Stiffness {
    /// Usual values of a material by its name, as handbooks have them; `None` of one that is not known.
    #[must_use]
    pub fn of_material(name: &str) -> Option<Self> {
        let [young_mpa, shear_mpa, strength_mpa] = match name.to_ascii_lowercase().as_str() {
            "aluminium" | "aluminum" => [70_000.0, 26_000.0, 240.0],
            "steel" => [210_000.0, 80_000.0, 350.0],
            "ductile-iron" => [169_000.0, 65_000.0, 310.0],
            "brass" => [100_000.0, 37_000.0, 200.0],
            "delrin" | "pom" => [2_900.0, 1_000.0, 65.0],
            "tooling-board" => [1_500.0, 550.0, 20.0],
            _ => return None,
        };
        Some(Stiffness { young_mpa, shear_mpa, strength_mpa })
    }
}

/// A part between two supports.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shaft {
    /// Length of each support, mm.
    pub support_mm: f64,
    /// Radius of the first support, mm.
    pub first_mm: f64,
    /// Radius of the second support, mm.
    pub second_mm: f64,
    /// Length of the part, mm.
    pub part_mm: f64,
    /// Radius of a cylinder no stiffer than the part, mm.
    pub part_radius_mm: f64,
    /// What all of it is made of.
    pub stiffness: Stiffness,
}

impl Shaft {
    /// How far the part twists, degrees, where a torque in N·mm acts on that end of it where it does most.
    #[must_use]
    pub fn twist_deg(&self, torque_nmm: f64) -> f64 {
        let at_second = self.twist_at_second_deg(torque_nmm);
        let turned = Shaft { first_mm: self.second_mm, second_mm: self.first_mm, ..*self };
        at_second.max(turned.twist_at_second_deg(torque_nmm))
    }

    /// The same where the torque acts on the end beside the second support.
    #[must_use]
    pub fn twist_at_second_deg(&self, torque_nmm: f64) -> f64 {
        let (d, l) = (self.support_mm, self.part_mm);
        let [r1, r2, part] = [self.first_mm, self.second_mm, self.part_radius_mm].map(|r| r.powi(4));
        let above = (d * d * part + d * l * r1) * 2.0 * torque_nmm;
        let below = (d * r2 * part + l * r1 * r2 + d * r1 * part) * PI * self.stiffness.shear_mpa;
        (above / below).to_degrees()
    }

    /// How far the beam gives way, mm, where a force in N acts on the part where it gives way most.
    #[must_use]
    pub fn deflection_mm(&self, force_n: f64) -> f64 {
        // The place is between the ends of the part; what gives way most changes slowly with it.
        (0..=PLACES).map(|k| self.deflection_at_mm(force_n, k as f64 / PLACES as f64)).fold(0.0, f64::max)
    }

    /// The same where it acts at a share of the part's length, from the first support.
    #[must_use]
    pub fn deflection_at_mm(&self, force_n: f64, share: f64) -> f64 {
        self.bent(force_n, share).0
    }

    /// How far the beam gives way where a force acts, mm, and the largest bending moment in the supports, N·mm, beside the
    /// chucks and beside the part.
    fn bent(&self, force_n: f64, share: f64) -> (f64, [f64; 2]) {
        let share = share.clamp(LEAST_SHARE, 1.0 - LEAST_SHARE);
        let inertia = |r: f64| PI * r.powi(4) / 4.0;
        let part = inertia(self.part_radius_mm);
        let pieces = [
            (self.support_mm, inertia(self.first_mm)),
            (self.part_mm * share, part),
            (self.part_mm * (1.0 - share), part),
            (self.support_mm, inertia(self.second_mm)),
        ];
        // Unknown is how far the end of each of the first three pieces gives way and tilts against its beginning: the stiff
        // part, which mostly goes along with thin supports, then costs no digits. The last piece ends in a chuck.
        let tips = pieces.map(|(l, inertia)| {
            let e = self.stiffness.young_mpa * inertia / l.powi(3);
            SMatrix::<f64, 2, 2>::new(12.0, -6.0 * l, -6.0 * l, 4.0 * l * l) * e
        });
        let [(l0, _), (l1, _), (l2, _), (l3, _)] = pieces;
        // Of the last piece against its beginning, from these six.
        let last = -SMatrix::<f64, 2, 6>::from_rows(&[
            [1.0, l1 + l2 + l3, 1.0, l2 + l3, 1.0, l3].into(),
            [0.0, 1.0, 0.0, 1.0, 0.0, 1.0].into(),
        ]);
        let mut stiffness = last.transpose() * tips[3] * last;
        for (k, tip) in tips.iter().take(3).enumerate() {
            let mut place = stiffness.fixed_view_mut::<2, 2>(2 * k, 2 * k);
            place += tip;
        }
        let at_force = SVector::<f64, 6>::from([1.0, l1, 1.0, 0.0, 0.0, 0.0]);
        let Some(solver) = stiffness.cholesky() else { return (f64::INFINITY, [f64::INFINITY; 2]) };
        let moved = solver.solve(&(at_force * force_n));
        let first_tip = tips[0] * moved.fixed_rows::<2>(0);
        let second_tip = tips[3] * (last * moved);
        // What the chucks hold against.
        let reactions = [[-first_tip[0], -first_tip[1] - first_tip[0] * l0], [second_tip[0], second_tip[1]]];
        // Force and moment of each chuck; along a support the moment changes by force times length.
        let moments = |force: f64, moment: f64, sign: f64| {
            moment.abs().max((sign * force * self.support_mm - moment).abs())
        };
        let first = moments(reactions[0][0], reactions[0][1], 1.0);
        let second = moments(reactions[1][0], reactions[1][1], -1.0);
        (at_force.dot(&moved).abs(), [first, second])
    }

    /// The largest stress in the supports, N/mm², under a force and a torque in N·mm: twist and bending together (von Mises),
    /// with all of the torque in either of them.
    #[must_use]
    pub fn stress_mpa(&self, force_n: f64, torque: f64) -> f64 {
        let radii = [self.first_mm, self.second_mm];
        let at = |share: f64| {
            let (_, moments) = self.bent(force_n, share);
            let of_support = |k: usize| {
                let cubed = PI * radii[k].powi(3);
                (4.0 * moments[k] / cubed).hypot(3.0_f64.sqrt() * 2.0 * torque / cubed)
            };
            of_support(0).max(of_support(1))
        };
        (0..=PLACES).map(|k| at(k as f64 / PLACES as f64)).fold(0.0, f64::max)
    }
}

/// Places along the part at which a force is tried.
const PLACES: usize = 32;
/// Pieces of a beam have a length.
const LEAST_SHARE: f64 = 1e-3;

/// What the supports have to withstand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// Cutting force across the axis, N.
    pub force_n: f64,
    /// How far from the axis it acts, mm.
    pub lever_mm: f64,
    /// The part's tolerance, mm: twist at the lever, and bending, use half of it at most.
    pub tolerance_mm: f64,
}

/// Supports are this share of the strength, at most.
const STRESS_SHARE: f64 = 0.5;
/// Radii are multiples of this, mm.
const STEP_MM: f64 = 0.1;

/// Why no support holds a part.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SupportError {
    /// A length that is not positive.
    #[error("{what} of {value} must be more than 0")]
    Size {
        /// What it is.
        what: &'static str,
        /// As given.
        value: f64,
    },
    /// The thickest that there is room for gives way.
    #[error(
        "supports of radius {radius_mm:.1} mm, for which there is room, let the part give way by {off_mm:.3} mm under \
         {force_n} N, more than half the tolerance of {tolerance_mm} mm"
    )]
    Weak {
        /// Their radius.
        radius_mm: f64,
        /// How far the part gives way.
        off_mm: f64,
        /// Under this.
        force_n: f64,
        /// The tolerance.
        tolerance_mm: f64,
    },
    /// The thickest that there is room for breaks.
    #[error(
        "supports of radius {radius_mm:.1} mm, for which there is room, would be stressed by {stress_mpa:.0} N/mm² under \
         {force_n} N; half the strength is {allowed_mpa:.0}"
    )]
    Breaks {
        /// Their radius.
        radius_mm: f64,
        /// Their stress.
        stress_mpa: f64,
        /// Under this.
        force_n: f64,
        /// What they may have.
        allowed_mpa: f64,
    },
}

/// The thinnest equal supports that hold a part, no thicker than `most_mm` (radius).
///
/// # Errors
/// A size is not positive, or the thickest that there is room for is too weak.
pub fn supports(shaft: &Shaft, load: &Load, most_mm: f64) -> Result<Shaft, SupportError> {
    for (what, value) in [
        ("the length of a support", shaft.support_mm),
        ("the part's length", shaft.part_mm),
        ("the part's radius", shaft.part_radius_mm),
        ("the force", load.force_n),
        ("the lever", load.lever_mm),
        ("the tolerance", load.tolerance_mm),
        ("the room for a support", most_mm),
    ] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(SupportError::Size { what, value });
        }
    }
    let of_radius = |r: f64| Shaft { first_mm: r, second_mm: r, ..*shaft };
    let allowed_mpa = STRESS_SHARE * shaft.stiffness.strength_mpa;
    let off_mm = |shaft: &Shaft| {
        let twist = shaft.twist_deg(load.force_n * load.lever_mm).to_radians();
        (load.lever_mm * twist.min(0.5 * PI).sin()).max(shaft.deflection_mm(load.force_n))
    };
    let holds = |shaft: &Shaft| {
        off_mm(shaft) <= 0.5 * load.tolerance_mm
            && shaft.stress_mpa(load.force_n, load.force_n * load.lever_mm) <= allowed_mpa
    };
    let steps = (most_mm / STEP_MM).floor().max(1.0) as u64;
    let radius = |k: u64| (k as f64 * STEP_MM).min(most_mm);
    let thickest = of_radius(radius(steps));
    if !holds(&thickest) {
        let (radius_mm, force_n) = (thickest.first_mm, load.force_n);
        let stress_mpa = thickest.stress_mpa(force_n, force_n * load.lever_mm);
        if stress_mpa > allowed_mpa {
            return Err(SupportError::Breaks { radius_mm, stress_mpa, force_n, allowed_mpa });
        }
        let (off_mm, tolerance_mm) = (off_mm(&thickest), load.tolerance_mm);
        return Err(SupportError::Weak { radius_mm, off_mm, force_n, tolerance_mm });
    }
    // Thicker is stiffer.
    let (mut weak, mut strong) = (0, steps);
    while strong - weak > 1 {
        let middle = weak + (strong - weak) / 2;
        if holds(&of_radius(radius(middle))) { strong = middle } else { weak = middle }
    }
    Ok(of_radius(radius(strong)))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn iron(first_mm: f64, second_mm: f64) -> Shaft {
        let stiffness = Stiffness::of_material("ductile-iron").unwrap();
        Shaft { support_mm: 12.7, first_mm, second_mm, part_mm: 150.0, part_radius_mm: 63.5, stiffness }
    }

    #[test]
    fn the_published_case_is_met() {
        // Half of 0.1524 mm at the radius of 63.5 mm is 0.06875°, which supports of 6.37 mm allow under 500 N.
        let most = (0.5 * 0.1524 / 63.5_f64).asin().to_degrees();
        approx::assert_abs_diff_eq!(most, 0.06875, epsilon = 5e-6);
        let of = |r: f64| iron(r, r).twist_deg(500.0 * 63.5);
        assert!(of(6.37) <= most * 1.002 && of(6.36) > most, "{} {} {most}", of(6.37), of(6.36));
    }

    /// Many pieces in a row, each a spring, solved from the left chuck: the twist where the torque acts.
    fn torsion_by_pieces(shaft: &Shaft, torque: f64, at_second: bool) -> f64 {
        const PIECES: usize = 40;
        let spring = |r: f64, l: f64| PI * shaft.stiffness.shear_mpa * r.powi(4) / (2.0 * l);
        let piece = |r: f64, l: f64| vec![spring(r, l / PIECES as f64); PIECES];
        let first = piece(shaft.first_mm, shaft.support_mm);
        let part = piece(shaft.part_radius_mm, shaft.part_mm);
        let second = piece(shaft.second_mm, shaft.support_mm);
        let at = if at_second { first.len() + part.len() } else { first.len() };
        let all: Vec<f64> = [first, part, second].concat();
        // Compliance on either side of the place.
        let soft = |springs: &[f64]| springs.iter().map(|k| 1.0 / k).sum::<f64>();
        let (left, right) = (soft(&all[..at]), soft(&all[at..]));
        torque / (1.0 / left + 1.0 / right)
    }

    /// Bending by the moments: reactions from two conditions, integrals by Simpson's rule.
    fn bending_by_moments(shaft: &Shaft, force: f64, share: f64) -> f64 {
        // Held at the stiffer end: cut there, the thin one would swallow all digits.
        if shaft.first_mm < shaft.second_mm {
            let turned = Shaft { first_mm: shaft.second_mm, second_mm: shaft.first_mm, ..*shaft };
            return bending_by_moments(&turned, force, 1.0 - share);
        }
        let ends =
            [0.0, shaft.support_mm, shaft.support_mm + shaft.part_mm, 2.0 * shaft.support_mm + shaft.part_mm];
        let whole = ends[3];
        let at = shaft.support_mm + share * shaft.part_mm;
        let radii = [shaft.first_mm, shaft.part_radius_mm, shaft.second_mm];
        // Integral over the beam of a product of two moments by the stiffness.
        let integral = |f: &dyn Fn(f64) -> f64, g: &dyn Fn(f64) -> f64| {
            let mut cuts = ends.to_vec();
            cuts.push(at);
            cuts.sort_by(f64::total_cmp);
            cuts.windows(2)
                .map(|w| {
                    let (a, b) = (w[0], w[1]);
                    let middle = 0.5 * (a + b);
                    let piece = (0..3).find(|&k| middle < ends[k + 1]).unwrap();
                    let ei = shaft.stiffness.young_mpa * PI * radii[piece].powi(4) / 4.0;
                    // Products of straight lines: Simpson's rule is exact.
                    let h = |x: f64| f(x) * g(x);
                    (b - a) / 6.0 * (h(a) + 4.0 * h(middle) + h(b)) / ei
                })
                .sum::<f64>()
        };
        // Held at the left, free at the right: the force, and unit force and moment at the right end.
        let load = move |x: f64| if x < at { force * (at - x) } else { 0.0 };
        let (unit_force, unit_moment) = (move |x: f64| whole - x, |_: f64| 1.0);
        let (ff, fm, mm) = (
            integral(&unit_force, &unit_force),
            integral(&unit_force, &unit_moment),
            integral(&unit_moment, &unit_moment),
        );
        let (lf, lm) = (integral(&load, &unit_force), integral(&load, &unit_moment));
        let det = ff * mm - fm * fm;
        let (v, m) = ((-lf * mm + lm * fm) / det, (-lm * ff + lf * fm) / det);
        let total = move |x: f64| load(x) + v * (whole - x) + m;
        let here = move |x: f64| if x < at { at - x } else { 0.0 };
        integral(&total, &here).abs()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(10_000))]

        #[test]
        fn twist_and_bending_are_those_of_independent_models(
            support_mm in 3.0..60.0_f64,
            thin in [0.05..1.0_f64, 0.05..1.0_f64],
            part_mm in 10.0..800.0_f64,
            part_radius_mm in 5.0..200.0_f64,
            share in 0.01..0.99_f64,
            force in 1.0..5000.0_f64,
        ) {
            let stiffness = Stiffness::of_material("steel").unwrap();
            let [first_mm, second_mm] = thin.map(|share| share * part_radius_mm);
            let shaft = Shaft { support_mm, first_mm, second_mm, part_mm, part_radius_mm, stiffness };
            let torque = force * part_radius_mm;
            let by_pieces = [true, false].map(|at_second| torsion_by_pieces(&shaft, torque, at_second).to_degrees());
            let twist = shaft.twist_at_second_deg(torque);
            prop_assert!((twist / by_pieces[0] - 1.0).abs() < 1e-12, "{twist} {by_pieces:?}");
            let most = by_pieces[0].max(by_pieces[1]);
            prop_assert!((shaft.twist_deg(torque) / most - 1.0).abs() < 1e-12);
            let (bent, by_moments) = (shaft.deflection_at_mm(force, share), bending_by_moments(&shaft, force, share));
            prop_assert!((bent / by_moments - 1.0).abs() < 1e-6, "{bent} {by_moments}");
        }
    }

    #[test]
    fn moments_of_an_even_beam_are_those_of_handbooks() {
        // Clamped at both ends, the force at a: F·a·b²/l² and F·a²·b/l² at the chucks.
        let even = Shaft { support_mm: 20.0, part_mm: 110.0, part_radius_mm: 5.0, ..iron(5.0, 5.0) };
        let (a, b, l) = (20.0 + 33.0, 150.0 - 53.0, 150.0_f64);
        let (_, moments) = even.bent(100.0, 0.3);
        let at_chuck = [100.0 * a * b * b / (l * l), 100.0 * a * a * b / (l * l)];
        approx::assert_relative_eq!(moments[0], at_chuck[0], max_relative = 1e-9);
        approx::assert_relative_eq!(moments[1], at_chuck[1], max_relative = 1e-9);
    }

    #[test]
    fn supports_are_the_thinnest_that_hold() {
        let load = Load { force_n: 500.0, lever_mm: 63.5, tolerance_mm: 0.1524 };
        let found = supports(&iron(1.0, 1.0), &load, 40.0).unwrap();
        let off = |shaft: &Shaft| {
            let twist = shaft.twist_deg(500.0 * 63.5).to_radians();
            (63.5 * twist.sin()).max(shaft.deflection_mm(500.0))
        };
        assert!(off(&found) <= 0.0762 && found.stress_mpa(500.0, 500.0 * 63.5) <= 155.0);
        let thinner = iron(found.first_mm - STEP_MM, found.second_mm - STEP_MM);
        assert!(off(&thinner) > 0.0762 || thinner.stress_mpa(500.0, 500.0 * 63.5) > 155.0, "{found:?}");
    }

    #[test]
    fn what_would_break_or_give_way_is_refused_by_name() {
        let load = Load { force_n: 500.0, lever_mm: 63.5, tolerance_mm: 0.1524 };
        assert!(matches!(supports(&iron(1.0, 1.0), &load, 3.0), Err(SupportError::Breaks { .. })));
        let soft = Load { tolerance_mm: 1e-6, ..load };
        assert!(matches!(supports(&iron(1.0, 1.0), &soft, 40.0), Err(SupportError::Weak { .. })));
        let none = Load { force_n: f64::NAN, ..load };
        assert!(matches!(supports(&iron(1.0, 1.0), &none, 40.0), Err(SupportError::Size { .. })));
    }
}
