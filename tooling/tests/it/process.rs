//! Profiles: inheritance, origins, circles, contradictions, conditions.

use std::collections::BTreeMap;
use std::path::Path;

use claymill_tooling::{
    CutPattern, Fact, Facts, Origin, Process, Profiles, Spacing, StageKind, StageValues, ToolChoice,
    ToolingError, Way,
};

fn with(name: &str, rest: &str) -> Profiles {
    let mut profiles = Profiles::shipped();
    add(&mut profiles, name, rest);
    profiles
}

fn add(profiles: &mut Profiles, name: &str, rest: &str) {
    let text = format!("format = \"claymill-process\"\nversion = 1\nname = \"{name}\"\n{rest}");
    profiles.add(&text, Path::new(&format!("{name}.toml"))).unwrap();
}

fn resolve(profiles: &Profiles, process: &str, material: &str) -> Result<Process, ToolingError> {
    profiles.resolve(process, material, &BTreeMap::new())
}

fn message(profiles: &Profiles, process: &str, material: &str) -> String {
    let error = resolve(profiles, process, material).unwrap_err();
    assert!(!error.advice().is_empty());
    error.to_string()
}

#[test]
fn clay_is_roughed_in_one_pass_and_finished() {
    let process = resolve(&Profiles::shipped(), "clay", "clay").unwrap();
    assert_eq!(process.chain, ["clay", "general"]);
    let kinds: Vec<StageKind> = process.stages.iter().map(|s| s.kind).collect();
    assert_eq!(kinds, [StageKind::Rough, StageKind::Finish, StageKind::Rest, StageKind::Pencil]);
    assert_eq!(process.skipped[0].0, StageKind::Semi);
    let rough = process.stage(StageKind::Rough).unwrap();
    assert_eq!((rough.allowance_mm.value, rough.spacing.value), (3.0, Spacing::StepRadii(1.0)));
    assert_eq!(rough.tool.value, ToolChoice::Auto { radius_mm: Some([15.0, 25.0]) });
    assert_eq!((rough.cut.as_ref().unwrap().value, rough.way.value), (CutPattern::Layers, Way::Lace));
    let finish = process.stage(StageKind::Finish).unwrap();
    assert_eq!(finish.tool.value, ToolChoice::Auto { radius_mm: Some([6.0, 12.5]) });
    let feeds = process.stages.iter().filter_map(|s| s.feed_mm_per_min.as_ref());
    assert!(feeds.clone().count() == 4 && feeds.clone().all(|f| (6000.0..=15_000.0).contains(&f.value)));
    let text = process.explain();
    assert!(text.contains("finish  spacing          scallop height 0.1 mm        process general, (shipped)/process-general.toml"), "{text}");
    assert!(text.contains("rough   allowance        3 mm                         material clay, (shipped)/material-clay.toml"), "{text}");
}

#[test]
fn foam_and_aluminium_have_their_allowances() {
    let profiles = Profiles::shipped();
    let foam = resolve(&profiles, "foam", "foam").unwrap();
    assert_eq!(foam.stages[0].allowance_mm.value, 2.0);
    let aluminium = resolve(&profiles, "aluminium", "al").unwrap();
    let rough = &aluminium.stages[0];
    assert!((0.3..=0.5).contains(&rough.allowance_mm.value) && rough.way.value == Way::Climb);
    assert_eq!(rough.engagement_deg.as_ref().unwrap().value, 45.0);
    assert_eq!(aluminium.material, "aluminium");
}

#[test]
fn each_value_is_the_nearest_ones_and_says_where_it_is_from() {
    let mut profiles = with("shop", "inherits = \"clay\"\n[stages.rough]\nallowance_mm = 4\n");
    add(
        &mut profiles,
        "mine",
        "inherits = \"shop\"\n[stages.rough]\nstep_mm = 12\ntool = \"T10\"\n[stages.semi]\nskip = false\n",
    );
    let asked = BTreeMap::from([(
        StageKind::Finish,
        StageValues { scallop_mm: Some(0.05), ..StageValues::default() },
    )]);
    let process = profiles.resolve("mine", "clay", &asked).unwrap();
    assert_eq!(process.chain, ["mine", "shop", "clay", "general"]);
    let rough = process.stage(StageKind::Rough).unwrap();
    let from = |name: &str| Origin::Process { name: name.into(), file: format!("{name}.toml").into() };
    assert_eq!((rough.allowance_mm.value, &rough.allowance_mm.from), (4.0, &from("shop")));
    // A step-over replaces the material's step in radii, and an id its radii.
    assert_eq!((rough.spacing.value, &rough.spacing.from), (Spacing::StepMm(12.0), &from("mine")));
    assert_eq!((&rough.tool.value, &rough.tool.from), (&ToolChoice::Id("T10".into()), &from("mine")));
    let finish = process.stage(StageKind::Finish).unwrap();
    assert_eq!((finish.spacing.value, &finish.spacing.from), (Spacing::ScallopMm(0.05), &Origin::Asked));
    assert_eq!(process.stage(StageKind::Semi).unwrap().allowance_mm.value, 0.5);
}

#[test]
fn circles_and_missing_parents_are_refused() {
    let mut profiles = with("a", "inherits = \"b\"");
    add(&mut profiles, "b", "inherits = \"c\"");
    assert!(message(&profiles, "a", "clay").contains("process a: b inherits from `c`, which is not there"));
    add(&mut profiles, "c", "inherits = \"b\"");
    assert!(message(&profiles, "a", "clay").contains("processes inherit in a circle: b <- c <- b"));
    add(&mut profiles, "c", "inherits = \"c\"");
    assert!(message(&profiles, "a", "clay").contains("in a circle: c <- c"));
    assert!(message(&profiles, "none", "clay").contains("process none: it is not there"));
    assert!(message(&profiles, "clay", "cheese").contains("no material `cheese`"));
}

#[test]
fn contradictions_are_refused_with_both_origins() {
    let over = with("p", "inherits = \"clay\"\n[stages.finish]\nallowance_mm = 5");
    let text = message(&over, "p", "clay");
    let expected = "process p: finish leaves 5 mm (process p, p.toml), more than rough, which comes before it and leaves 3 mm \
                    (material clay, (shipped)/material-clay.toml)";
    assert_eq!(text, expected);
    let alone = with("p", "inherits = \"clay\"\n[stages.finish]\nskip = true");
    assert!(message(&alone, "p", "clay").contains("a stage rest without a finish"));
    let slow = with("p", "inherits = \"clay\"\n[stages.finish]\nfeed_mm_per_min = 100");
    assert!(
        message(&slow, "p", "clay")
            .contains("finish: a feed of 100 mm/min (process p, p.toml) is not between 6000")
    );
    let empty = with("p", "");
    // What a material says makes stages, but no scallop height.
    assert!(message(&empty, "p", "clay").contains("neither a scallop height nor a step-over"));
}

#[test]
fn values_that_no_other_file_mends_are_refused_at_once() {
    let cases = [
        ("[stages.finish]\nscallop_mm = 0", "stage finish: `scallop_mm` is 0"),
        ("[stages.finish]\nscallop_mm = -0.1", "`scallop_mm` is -0.1"),
        ("[stages.finish]\nscallop_mm = nan", "`scallop_mm` is NaN"),
        ("[stages.finish]\nallowance_mm = -1", "an allowance of -1 mm"),
        ("[stages.finish]\nscallop_mm = 0.1\nstep_mm = 1", "`scallop_mm` and `step_mm` exclude each other"),
        ("[stages.finish]\ntool = \"T1\"\nradius_mm = [1, 2]", "`tool` and `radius_mm` exclude each other"),
        ("[stages.finish]\nradius_mm = [3, 2]", "begins at 3 and ends at 2"),
        ("[stages.finish]\ncut = \"levels\"", "for roughing only"),
        ("[stages.rough]\nwhen = \"moon = full\"", "`moon` is not known"),
        ("[stages.rough]\nengagement_deg = 200", "`engagement_deg` is 200"),
        ("when = \"material =\"", "a value is missing"),
        ("[stages.polish]\nskip = true", "unknown variant `polish`"),
        ("[stages.finish]\nscalop_mm = 1", "unknown field `scalop_mm`"),
        ("inherit = \"clay\"", "unknown field `inherit`"),
    ];
    for (rest, what) in cases {
        let text = format!("format = \"claymill-process\"\nversion = 1\nname = \"p\"\n{rest}");
        let error = Profiles::shipped().add(&text, Path::new("p.toml")).unwrap_err();
        assert!(error.to_string().starts_with("p.toml: ") && error.to_string().contains(what), "{error}");
    }
    let material = "format = \"claymill-material\"\nversion = 1\nname = \"m\"\nlayer_mm = [30, 40]\narmature_mm = [25, 30]";
    let error = Profiles::shipped().add(material, Path::new("m.toml")).unwrap_err();
    assert!(error.to_string().contains("m: a layer of at least 30 mm does not fit"), "{error}");
    let asked =
        BTreeMap::from([(StageKind::Rough, StageValues { step_mm: Some(0.0), ..StageValues::default() })]);
    assert!(Profiles::shipped().resolve("clay", "clay", &asked).is_err());
}

#[test]
fn the_process_whose_condition_holds_is_chosen() {
    let mut profiles = Profiles::shipped();
    let mut facts =
        Facts::from([("material", Fact::Text("clay".into())), ("machine.axes", Fact::Number(3.0))]);
    assert_eq!(profiles.choose(&facts), Ok("clay"));
    // One that inherits from another that holds too goes before it.
    add(&mut profiles, "clay-5", "inherits = \"clay\"\nwhen = \"material = clay & machine.axes >= 5\"");
    assert_eq!(profiles.choose(&facts), Ok("clay"));
    facts.insert("machine.axes", Fact::Number(5.0));
    assert_eq!(profiles.choose(&facts), Ok("clay-5"));
    add(&mut profiles, "other", "inherits = \"general\"\nwhen = \"machine.axes > 3\"");
    assert!(profiles.choose(&facts).unwrap_err().what.contains("several processes hold: clay-5, other"));
    facts.insert("material", Fact::Text("soap".into()));
    facts.insert("machine.axes", Fact::Number(3.0));
    assert_eq!(profiles.choose(&facts), Ok("general"));
}

#[test]
fn stages_wait_for_what_is_not_known_yet() {
    let process = resolve(&Profiles::shipped(), "foam", "foam").unwrap();
    let semi = process.stage(StageKind::Semi).unwrap();
    let varies = |mm: f64| Facts::from([("stock.varies_mm", Fact::Number(mm))]);
    assert_eq!(
        [semi.runs(&Facts::new()), semi.runs(&varies(2.0)), semi.runs(&varies(4.0))],
        [None, Some(false), Some(true)]
    );
    let rest = process.stage(StageKind::Rest).unwrap();
    assert_eq!(rest.runs(&Facts::from([("rest.area_mm2", Fact::Number(0.0))])), Some(false));
    assert_eq!(rest.runs(&Facts::new()), None);
}
