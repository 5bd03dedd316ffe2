//! The cheapest chain of tools against all subsets.

use claymill_tooling::{
    ChainError, ChainTool, Engagement, Library, MachineShape, Profiles, ReachModel, ReachPatch, Spacing,
    tool_chain,
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const TOOLS: usize = 8;

fn tool(index: usize, mm2_per_s: f64, change_s: f64, wear: f64) -> ChainTool {
    ChainTool { id: format!("T{index}"), mm2_per_s, change_s, wear }
}

/// Sets, times and wear at random; the sets nested or not.
fn model(rng: &mut ChaCha8Rng, nested: bool) -> (Vec<ChainTool>, Vec<ReachPatch>) {
    let mut rate = rng.random_range(50.0..500.0);
    let tools = (0..TOOLS).map(|i| {
        rate *= rng.random_range(0.3..1.1);
        tool(i, rate, rng.random_range(0.0..120.0), rng.random_range(0.0..0.3))
    });
    let tools = tools.collect();
    let patches = (0..40).map(|_| {
        let first = rng.random_range(0..=TOOLS);
        let reached_by = if nested { 0xff << first & 0xff } else { rng.random_range(0..256) };
        ReachPatch { area_mm2: rng.random_range(0.0..5000.0), reached_by }
    });
    (tools, patches.collect())
}

/// Time of a subset in order, and the area that it leaves of what all tools reach.
fn time_of(subset: u64, tools: &[ChainTool], patches: &[ReachPatch]) -> (f64, f64) {
    let mut is_cut = vec![false; patches.len()];
    let mut total = 0.0;
    for (j, tool) in tools.iter().enumerate().filter(|(j, _)| subset >> j & 1 == 1) {
        let mut area = 0.0;
        for (patch, is_cut) in patches.iter().zip(&mut is_cut) {
            if patch.reached_by >> j & 1 == 1 && !*is_cut {
                (area, *is_cut) = (area + patch.area_mm2, true);
            }
        }
        total += area / tool.mm2_per_s * (1.0 + tool.wear) + tool.change_s;
    }
    let left = patches.iter().zip(is_cut).filter(|(p, cut)| p.reached_by != 0 && !cut);
    (total, left.map(|(p, _)| p.area_mm2).sum())
}

fn brute_force(tools: &[ChainTool], patches: &[ReachPatch], negligible: f64, must: u64) -> f64 {
    let subsets = (0..1_u64 << tools.len()).filter(|s| s & must == must);
    let timed = subsets.map(|s| time_of(s, tools, patches));
    timed.filter(|(_, left)| *left <= negligible).map(|(total, _)| total).fold(f64::INFINITY, f64::min)
}

/// The shortest path over edges that know their two ends only.
fn over_pairs(tools: &[ChainTool], patches: &[ReachPatch]) -> f64 {
    let reached = |j: usize, p: &ReachPatch| p.reached_by >> j & 1 == 1;
    let mut best = vec![f64::INFINITY; tools.len()];
    for j in 0..tools.len() {
        let edge = |from: Option<usize>| {
            let new = patches.iter().filter(|p| reached(j, p) && !from.is_some_and(|i| reached(i, p)));
            let area: f64 = new.map(|p| p.area_mm2).sum();
            area / tools[j].mm2_per_s * (1.0 + tools[j].wear) + tools[j].change_s
        };
        best[j] = (0..j).map(|i| best[i] + edge(Some(i))).fold(edge(None), f64::min);
    }
    // The last tool alone reaches all in a nested model.
    let all = |j: &usize| patches.iter().all(|p| p.reached_by == 0 || reached(*j, p));
    (0..tools.len()).filter(all).map(|j| best[j]).fold(f64::INFINITY, f64::min)
}

#[test]
fn two_hundred_random_models_are_solved_as_all_subsets_are() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut lengths = [0; TOOLS + 1];
    for index in 0..200 {
        let nested = index % 2 == 0;
        let (tools, patches) = model(&mut rng, nested);
        let negligible = if index % 4 < 2 { 0.0 } else { rng.random_range(0.0..8000.0) };
        let reach = ReachModel::new(tools.clone(), &patches).unwrap();
        let chain = tool_chain(&reach, negligible);
        let least = brute_force(&tools, &patches, negligible, 0);
        approx::assert_relative_eq!(chain.total_s, least, max_relative = 1e-12);
        assert!(chain.is_proven && chain.is_nested == nested && chain.left_mm2 <= negligible);
        for other in &chain.others {
            let with = brute_force(&tools, &patches, negligible, 1 << other.tool);
            approx::assert_relative_eq!(other.total_s, with, max_relative = 1e-12);
            assert!(other.total_s >= chain.total_s - 1e-9);
        }
        let used = chain.steps.iter().fold(0, |used, s| used | 1 << s.tool);
        let (total, left) = time_of(used, &tools, &patches);
        approx::assert_relative_eq!(total, chain.total_s, max_relative = 1e-12);
        approx::assert_relative_eq!(left, chain.left_mm2, max_relative = 1e-12, epsilon = 1e-9);
        if nested && negligible == 0.0 {
            approx::assert_relative_eq!(over_pairs(&tools, &patches), least, max_relative = 1e-12);
        }
        lengths[chain.steps.len()] += 1;
    }
    // The models are no trivial ones.
    assert!(lengths.iter().filter(|n| **n > 5).count() >= 4, "{lengths:?}");
}

/// Edges between pairs alone count the left patch twice: A cuts it, C after B seems to cut it again.
#[test]
fn sets_that_are_not_nested_need_more_than_edges_between_pairs() {
    let tools = vec![tool(0, 10.0, 1.0, 0.0), tool(1, 10.0, 1.0, 0.0), tool(2, 1.0, 1.0, 0.0)];
    let patch = |area_mm2, reached_by| ReachPatch { area_mm2, reached_by };
    let patches = [patch(100.0, 0b101), patch(100.0, 0b110), patch(10.0, 0b100)];
    let reach = ReachModel::new(tools.clone(), &patches).unwrap();
    assert_eq!(reach.not_nested(), Some((0, 1, 100.0)));
    let chain = tool_chain(&reach, 0.0);
    let used: Vec<usize> = chain.steps.iter().map(|s| s.tool).collect();
    assert_eq!((used, chain.is_nested, chain.total_s), (vec![0, 1, 2], false, 33.0));
    assert!(over_pairs(&tools, &patches) > 100.0);
}

#[test]
fn a_pocket_is_cut_large_then_small_where_changes_are_quick() {
    // Areas of a floor 100 × 100 that round tools of radius 10, 5 and 2 reach.
    let floor = |radius: f64| 10_000.0 - (4.0 - std::f64::consts::PI) * radius * radius;
    let areas = [floor(10.0), floor(5.0), floor(2.0)];
    let with_change = |change_s| {
        let tools =
            vec![tool(0, 400.0, change_s, 0.0), tool(1, 200.0, change_s, 0.0), tool(2, 40.0, change_s, 0.0)];
        let chain = tool_chain(&ReachModel::nested(tools, &areas).unwrap(), 0.0);
        assert!(chain.is_nested && chain.unreached_mm2 == 0.0);
        chain.steps.iter().map(|s| s.tool).collect::<Vec<_>>()
    };
    assert_eq!(with_change(0.1), [0, 1, 2]);
    assert_eq!(with_change(30.0), [0, 2]);
    assert_eq!(with_change(300.0), [2]);
    let tools = || vec![tool(0, 1.0, 1.0, 0.0), tool(1, 1.0, 1.0, 0.0), tool(2, 1.0, 1.0, 0.0)];
    let model = ReachModel::nested(tools(), &areas).unwrap();
    assert_eq!((model.largest_leaving(0.03), model.largest_leaving(0.005)), (Some(0), Some(1)));
    approx::assert_abs_diff_eq!(model.reached_mm2(1), areas[1], epsilon = 1e-9);
    // What is negligible needs no small tool.
    let few = tool_chain(&model, 100.0);
    assert_eq!((few.steps.len(), few.steps[0].tool), (1, 0));
}

#[test]
fn rates_follow_from_the_spacing_and_the_feed() {
    let (library, profiles, machine) = (Library::shipped(), Profiles::shipped(), MachineShape::shipped());
    let ball = library.get("T7").unwrap();
    // Cusps of 0.1 mm between passes of a ball of radius 10 on a plane, computed with 30 digits.
    let step = Spacing::ScallopMm(0.1).step_mm(&ball.tool);
    approx::assert_abs_diff_eq!(step, 2.821_347_196, epsilon = 1e-9);
    assert_eq!(Spacing::StepRadii(0.5).step_mm(&ball.tool), 5.0);
    assert_eq!(Spacing::ScallopMm(0.1).step_mm(&"flat:6".parse().unwrap()), 12.0);
    let material = profiles.material("clay").unwrap();
    let mode = Engagement::default();
    let conditions = ball.cutting_for(material).unwrap().conditions(ball, &mode, Some(&machine)).unwrap();
    let tool = ChainTool::of(ball, step, &conditions, 20.0, material.wear);
    approx::assert_relative_eq!(tool.mm2_per_s, step * 8000.0 / 60.0);
}

#[test]
fn equal_chains_are_decided_alike_and_nonsense_is_refused() {
    let same = || vec![tool(0, 1.0, 1.0, 0.0), tool(1, 1.0, 1.0, 0.0)];
    let chain =
        tool_chain(&ReachModel::new(same(), &[ReachPatch { area_mm2: 5.0, reached_by: 3 }]).unwrap(), 0.0);
    assert_eq!((chain.steps.len(), chain.steps[0].tool), (1, 0));
    assert_eq!(tool_chain(&ReachModel::new(same(), &[]).unwrap(), 0.0).steps, []);
    assert_eq!(ReachModel::new(vec![], &[]).unwrap_err(), ChainError::NoTools);
    let many = (0..65).map(|i| tool(i, 1.0, 1.0, 0.0)).collect();
    assert!(matches!(ReachModel::new(many, &[]), Err(ChainError::TooMany { .. })));
    let still = ReachModel::new(vec![tool(0, 0.0, 1.0, 0.0)], &[]).unwrap_err();
    assert_eq!(still.to_string(), "T0: mm2_per_s is 0, which is negative, zero or not finite");
    let patch = [ReachPatch { area_mm2: f64::NAN, reached_by: 1 }];
    assert!(ReachModel::new(same(), &patch).is_err());
    assert!(ReachModel::nested(same(), &[1.0]).is_err());
}

/// Large models end, with sixty-four tools and sets at random.
#[test]
fn large_models_end() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let tools: Vec<ChainTool> =
        (0..64).map(|i| tool(i, rng.random_range(1.0..100.0), rng.random_range(1.0..60.0), 0.0)).collect();
    let areas: Vec<f64> = (0..64).map(|i| 1000.0 + 10.0 * f64::from(i)).collect();
    let chain = tool_chain(&ReachModel::nested(tools.clone(), &areas).unwrap(), 0.0);
    assert!(chain.is_proven && !chain.steps.is_empty());
    let patches: Vec<ReachPatch> =
        (0..100).map(|_| ReachPatch { area_mm2: 1.0, reached_by: rng.random() }).collect();
    let few = ReachModel::new(tools[..14].to_vec(), &patches).unwrap();
    let chain = tool_chain(&few, 0.0);
    assert!(chain.left_mm2 == 0.0);
}
