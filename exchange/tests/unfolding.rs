//! Small files that stand for endless geometry: they are refused by name or read once, soon and in little memory.

#[allow(dead_code, reason = "shared with other tests")]
#[path = "it/iges_text/mod.rs"]
mod iges_text;
#[allow(dead_code, reason = "shared with other tests")]
#[path = "it/step/text.rs"]
mod step_text;

use std::fmt::Write;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use claymill_exchange::{Import, ReadError, read_bytes};
use iges_text::{Entity, entity, flat, line};
use peak_alloc::PeakAlloc;
use step_text::{polygon, ring};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Memory is counted for the whole process: one test at a time, with the text that it makes.
static ALONE: Mutex<()> = Mutex::new(());

fn alone() -> MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A file may take so many bytes of memory for each of its own, and these besides, as in `fuzz/`.
const TIMES_INPUT: usize = 50;
const BESIDES: usize = 1 << 20;
const LONGEST: Duration = Duration::from_secs(10);

/// Reads a file that must end soon and in little memory.
#[track_caller]
fn read(text: &str) -> Result<Import, ReadError> {
    // The thread pool is made on first use.
    rayon_is_up();
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let start = Instant::now();
    let import = read_bytes(text.as_bytes(), Path::new("hostile"));
    let (elapsed, peak) = (start.elapsed(), MEMORY.peak_usage().saturating_sub(before));
    eprintln!("{} bytes: {elapsed:.2?}, {peak} bytes of memory", text.len());
    assert!(elapsed < LONGEST, "{elapsed:?}");
    assert!(peak <= TIMES_INPUT * text.len() + BESIDES, "{peak} bytes of memory for {}", text.len());
    if let Ok(import) = &import {
        let report = &import.report;
        assert_eq!(report.faces_in_file, report.faces_read + report.skipped.len());
    }
    import
}

fn rayon_is_up() {
    let _ = read_bytes(iges_text::file(&[flat(1.0, 1.0)]).as_bytes(), Path::new("sound"));
}

#[track_caller]
fn refusal(text: &str) -> String {
    match read(text) {
        Err(error @ ReadError::TooMuch { .. }) => {
            assert!(error.advice().contains("export the parts"));
            error.to_string()
        }
        Err(other) => panic!("{other}"),
        Ok(import) => panic!("{} faces were read", import.model.faces.len()),
    }
}

/// The only face, which is skipped.
#[track_caller]
fn skipped(text: &str) -> String {
    match read(text) {
        Err(ReadError::NoFaces { report, .. }) => {
            assert_eq!(report.skipped.len(), 1);
            report.skipped[0].reason.clone()
        }
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("the face was read"),
    }
}

/// A square face `#100` on the plane `#50` in the shell `#9`, and the placement `#10` at the origin.
fn square(list: &str) -> String {
    format!(
        "#8=SHELL_BASED_SURFACE_MODEL('',(#9));\n#9=OPEN_SHELL('',({list}));\n\
         #10=AXIS2_PLACEMENT_3D('',#11,#12,#13);\n#11=CARTESIAN_POINT('',(0.,0.,0.));\n\
         #12=DIRECTION('',(0.,0.,1.));\n#13=DIRECTION('',(1.,0.,0.));\n#50=PLANE('',#10);\n\
         #100=ADVANCED_FACE('skin',(#200),#50,.T.);\n{}",
        polygon(200, &[[0.0, 0.0, 0.0], [90.0, 0.0, 0.0], [90.0, 90.0, 0.0], [0.0, 90.0, 0.0]])
    )
}

/// The placement `#id` that stands `shift` mm along x, doubled for every level.
fn shifted(id: u64, shift: f64, level: u64) -> String {
    let (x, point) = (shift * 2_f64.powi(level as i32), id + 1);
    format!("#{id}=AXIS2_PLACEMENT_3D('',#{point},#12,#13);\n#{point}=CARTESIAN_POINT('',({x:?},0.,0.));\n")
}

/// Representations that each hold the next one twice, `shift` mm apart, by mapped items; the last holds the face.
fn mapped(levels: u64, shift: f64) -> String {
    let mut data = square("#100");
    for k in 0..levels {
        let [id, first, second, map, at, inside] = [0, 1, 2, 3, 4, 10].map(|i| 1000 + 10 * k + i);
        let _ = write!(
            data,
            "#{id}=SHAPE_REPRESENTATION('level {k}',(#{first},#{second}),#1);\n\
             #{first}=MAPPED_ITEM('',#{map},#10);\n#{second}=MAPPED_ITEM('',#{map},#{at});\n\
             #{map}=REPRESENTATION_MAP(#10,#{inside});\n{}",
            shifted(at, shift, k)
        );
    }
    let _ = writeln!(data, "#{}=SHAPE_REPRESENTATION('part',(#8,#10),#1);", 1000 + 10 * levels);
    step_text::file(&data)
}

/// The same by relationships with transformations, as assemblies have them.
fn assembly(levels: u64) -> String {
    let mut data = square("#100");
    for k in 0..levels {
        let [id, at, inside] = [0, 5, 10].map(|i| 1000 + 10 * k + i);
        let _ =
            write!(data, "#{id}=SHAPE_REPRESENTATION('level {k}',(#10,#{at}),#1);\n{}", shifted(at, 7.0, k));
        for (relationship, to) in [(id + 1, 10), (id + 3, at)] {
            let transformation = relationship + 1;
            let _ = write!(
                data,
                "#{relationship}=(REPRESENTATION_RELATIONSHIP('','',#{inside},#{id})\
                 REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{transformation})\
                 SHAPE_REPRESENTATION_RELATIONSHIP());\n\
                 #{transformation}=ITEM_DEFINED_TRANSFORMATION('','',#10,#{to});\n"
            );
        }
    }
    let _ = writeln!(data, "#{}=SHAPE_REPRESENTATION('part',(#8,#10),#1);", 1000 + 10 * levels);
    step_text::file(&data)
}

/// A file with the square face of [`square`] and what else.
fn plate(list: &str, more: &str) -> String {
    step_text::file(&format!("#7=SHAPE_REPRESENTATION('',(#8,#10),#1);\n{}{more}", square(list)))
}

#[test]
fn doubled_placements_are_counted_before_anything_is_built() {
    let _alone = alone();
    let told = refusal(&mapped(12, 100.0));
    assert!(
        told.contains("#1000: the representation `level 0` unfolds to 8191 placed parts with 4096 faces"),
        "{told}"
    );
    let told = refusal(&assembly(20));
    assert!(told.contains("2097151 placed parts with 1048576 faces"), "{told}");
    let told = refusal(&mapped(300, 0.125));
    assert!(told.contains("placed parts"), "{told}");
}

#[test]
fn nesting_as_assemblies_have_it_is_read() {
    let _alone = alone();
    let import = read(&mapped(6, 100.0)).unwrap();
    assert_eq!(import.model.faces.len(), 64);
    let import = read(&assembly(6)).unwrap();
    assert_eq!(import.model.faces.len(), 64);
    let mut identities: Vec<_> = import
        .model
        .faces
        .iter()
        .flat_map(|f| &f.loops)
        .flat_map(|l| &l.edges)
        .filter_map(|e| e.shared)
        .collect();
    identities.sort_unstable();
    identities.dedup();
    // The sides of polygons have no identity.
    assert!(identities.is_empty());
}

#[test]
fn what_stands_twice_at_one_place_is_read_once() {
    let _alone = alone();
    let import = read(&mapped(12, 0.0)).unwrap();
    assert_eq!(import.model.faces.len(), 1);
    let told = |w: &&String| w.contains("where it stands already");
    assert_eq!(import.report.warnings.iter().filter(told).count(), 12, "{:?}", import.report.warnings);
}

#[test]
fn a_face_listed_again_is_read_once() {
    let _alone = alone();
    let import = read(&plate(&vec!["#100"; 300_000].join(","), "")).unwrap();
    assert_eq!((import.model.faces.len(), import.report.warnings.len()), (1, 1));
    let told = &import.report.warnings[0];
    assert!(told.contains("listed again 299999 times") && told.contains("#100"), "{told}");
    // Shells that list shells: eight levels of three hundred.
    let shells: String = (300..307)
        .map(|id| {
            format!("#{id}=CONNECTED_FACE_SET('',({}));\n", vec![format!("#{}", id + 1); 300].join(","))
        })
        .collect();
    let import = read(&plate("#300", &format!("{shells}#307=OPEN_SHELL('',(#100));\n"))).unwrap();
    assert_eq!(import.model.faces.len(), 1);
}

/// A plate with the holes that `bounds` lists.
fn perforated(bounds: &str, more: &str) -> String {
    let text = plate("#100", more);
    text.replace("ADVANCED_FACE('skin',(#200)", &format!("ADVANCED_FACE('skin',(#200,{bounds})"))
}

#[test]
fn a_hole_listed_again_is_read_once() {
    let _alone = alone();
    let hole = ring(300, 4.0, -3.0, false);
    let own = ["#301", "#302", "#303", "#304"];
    let plain = read(&perforated("#300", &hole)).unwrap();
    let listed = perforated(&vec!["#300"; 3000].join(","), &hole);
    // Bounds of their own for one loop, and loops of their own of one edge.
    let bounds: Vec<u64> = (1000..4000).collect();
    let list = bounds.iter().map(|id| format!("#{id}")).collect::<Vec<_>>().join(",");
    let of_one_loop: String = bounds.iter().map(|id| format!("#{id}=FACE_BOUND('',#301,.T.);\n")).collect();
    let of_one_edge: String = (bounds.iter().map(|id| (id, id + 10_000)))
        .map(|(id, of)| format!("#{id}=FACE_BOUND('',#{of},.T.);\n#{of}=EDGE_LOOP('',(#302));\n"))
        .collect();
    assert!(own.iter().all(|id| hole.contains(id)));
    for text in [
        listed,
        perforated(&list, &format!("{hole}{of_one_loop}")),
        perforated(&list, &format!("{hole}{of_one_edge}")),
    ] {
        let import = read(&text).unwrap();
        assert_eq!(format!("{:?}", import.model.faces[0].loops), format!("{:?}", plain.model.faces[0].loops));
        let [repair] = &import.report.repairs[..] else { panic!("{:?}", import.report.repairs) };
        assert_eq!(repair.what, "2999 repeated trim loops left out");
    }
}

#[test]
fn curves_within_curves_are_counted_before_they_are_built() {
    let _alone = alone();
    // A thousand times a thousand lines.
    let segments = |first: u64, curve: u64| {
        let segment = first + 1;
        let list = vec![format!("#{segment}"); 1000].join(",");
        format!(
            "#{first}=COMPOSITE_CURVE('',({list}),.U.);\n\
             #{segment}=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#{curve});\n"
        )
    };
    let curves = format!(
        "{}{}#420=POLYLINE('',(#202,#203));\n#300=FACE_BOUND('',#301,.T.);\n#301=EDGE_LOOP('',(#302));\n\
         #302=ORIENTED_EDGE('',*,*,#303,.T.);\n#303=EDGE_CURVE('',#304,#305,#400,.T.);\n\
         #304=VERTEX_POINT('',#202);\n#305=VERTEX_POINT('',#203);\n",
        segments(400, 410),
        segments(410, 420)
    );
    let told = skipped(&perforated("#300", &curves));
    assert!(told.contains("#100 unfolds to") && told.contains("again and again"), "{told}");
}

#[test]
fn long_names_and_styles_of_styles_take_little() {
    let _alone = alone();
    let face = |id: u64| format!("#{id}=ADVANCED_FACE('',(#200),#50,.T.);\n");
    let ids: Vec<String> = (1000..1900).map(|id| format!("#{id}")).collect();
    let layer =
        format!("#20=PRESENTATION_LAYER_ASSIGNMENT('{}','',({}));\n", "x".repeat(100_000), ids.join(","));
    let import =
        read(&plate(&ids.join(","), &((1000..1900).map(face).collect::<String>() + &layer))).unwrap();
    let layer = import.model.faces[0].source.layer.as_deref().unwrap();
    assert_eq!(layer, "x".repeat(255));

    let style = |id: u64| format!("#{id}=STYLE(({}));\n", vec![format!("#{}", id + 1); 8].join(","));
    let styled = |id: u64| format!("#{id}=STYLED_ITEM('',(#30),#100);\n");
    let styles: String = (30..40).map(style).chain((2000..2100).map(styled)).collect();
    assert_eq!(read(&plate("#100", &styles)).unwrap().model.faces.len(), 1);
}

#[test]
fn a_shell_that_refers_to_no_face_says_so() {
    let _alone = alone();
    let import = read(&plate("#100,#77,#50", "")).unwrap();
    let told: Vec<_> = import.report.skipped.iter().map(|s| format!("{} {}", s.entity, s.reason)).collect();
    assert_eq!(
        told,
        [
            "#77 #77 is referred to but not in the file; the shell #9 refers to it",
            "#50 #50 is PLANE where a face is needed; the shell #9 refers to it"
        ]
    );
}

/// A face `DE 1` on `DE 3` whose outer loop is the curve `DE 7`; `curves` are the entities from there on.
fn trimmed(curves: Vec<Entity>) -> Vec<Entity> {
    let mut entities = vec![entity(144, "3,1,0,5"), flat(10.0, 8.0), entity(142, "0,3,0,7,2")];
    entities.extend(curves);
    entities
}

#[test]
fn composites_of_composites_are_counted_before_they_are_built() {
    let _alone = alone();
    let many = |de: u32| entity(102, format!("1000,{}", vec![de.to_string(); 1000].join(",")));
    let text = iges_text::file(&trimmed(vec![many(9), many(11), line([1.0, 1.0, 0.0], [9.0, 1.0, 0.0])]));
    let told = skipped(&text);
    assert!(told.contains("DE 1 unfolds to") && told.contains("again and again"), "{told}");
}

#[test]
fn subfigures_of_subfigures_are_counted_before_they_are_placed() {
    let _alone = alone();
    // Each places the next one twice; the last holds the face. Depth 15 is within what subfigures may nest.
    let mut entities = Vec::new();
    for k in 0..15 {
        let own = 6 * k + 1;
        entities.push(entity(308, format!("0,1Hx,2,{},{}", own + 2, own + 4)));
        entities.push(entity(408, format!("{},0.,0.,0.,1.", own + 6)));
        entities.push(entity(408, format!("{},50.,0.,0.,1.", own + 6)));
    }
    entities.push(entity(308, "0,1Hx,1,93"));
    entities.push(flat(10.0, 8.0));
    entities.push(entity(408, "1,0.,0.,0.,1."));
    let told = refusal(&iges_text::file(&entities));
    assert!(told.contains("65535 placed parts with 32768 faces"), "{told}");
}

#[test]
fn a_loop_listed_again_is_read_once_in_iges() {
    let _alone = alone();
    let corners = [[1.0, 1.0, 0.0], [9.0, 1.0, 0.0], [9.0, 7.0, 0.0], [1.0, 1.0, 0.0]];
    let mut entities = vec![
        entity(144, format!("3,0,3000,0,{}", vec!["5"; 3000].join(","))),
        flat(10.0, 8.0),
        entity(142, "0,3,0,7,2"),
        entity(102, "3,9,11,13"),
    ];
    entities.extend(corners.windows(2).map(|w| line(w[0], w[1])));
    let import = read(&iges_text::file(&entities)).unwrap();
    assert_eq!(import.model.faces[0].loops.len(), 2);
    assert_eq!(import.report.repairs[0].what, "2999 repeated trim loops left out");
}

#[test]
fn numbers_of_lost_cards_take_no_room() {
    let _alone = alone();
    // Every card says that a hundred thousand before it are lost.
    let text = iges_text::file(&[flat(10.0, 8.0)]);
    let mut far = String::new();
    for k in 1..400_usize {
        let _ = writeln!(far, "{:<72}P{:>7}", "116,1.,2.,3.;", (k * 99_999).min(9_999_999));
    }
    let (head, tail) = text.split_at(text.find("S      1G").unwrap());
    let import = read(&format!("{head}{far}{tail}")).unwrap();
    assert_eq!(import.model.faces.len(), 1);
    let mut far = String::new();
    for k in 1..400_usize {
        let _ = writeln!(far, "{:<72}D{:>7}", "     116       1", k * 1999);
    }
    let at = text.find("128,1,1").unwrap();
    let (head, tail) = text.split_at(at);
    assert_eq!(read(&format!("{head}{far}{tail}")).unwrap().model.faces.len(), 1);
}

#[test]
fn a_net_larger_than_its_record_is_refused_before_it_is_made() {
    let _alone = alone();
    let breaks = (0..=1000).map(|i| format!("{i}.")).collect::<Vec<_>>().join(",");
    let told = skipped(&iges_text::file(&[entity(114, format!("3,1,1000,1000,{breaks},{breaks},1.,2.,3."))]));
    assert!(told.contains("missing or break off"), "{told}");
    // Knots of a multiplicity that no net has.
    let surface = "#50=B_SPLINE_SURFACE_WITH_KNOTS('',1,1,((#11,#11),(#11,#11)),.UNSPECIFIED.,.F.,.F.,.F.,\
        (1000000,2),(1000000,2),(0.,1.),(0.,1.),.UNSPECIFIED.)";
    let told = skipped(&plate("#100", "").replace("#50=PLANE('',#10)", surface));
    assert!(told.contains("multiplicity makes no sense"), "{told}");
}

#[test]
fn what_reaches_implausibly_far_is_left_out_by_name() {
    let _alone = alone();
    // A plate of small squares, and three of them with a corner a thousand kilometres away.
    let squares = |far: &[usize]| -> Vec<Entity> {
        let square = |i: usize| {
            let (x, y) = ((i % 10) as f64 * 20.0, (i / 10) as f64 * 20.0);
            let z = if far.contains(&i) { 1e9 } else { 0.0 };
            let corners = [[x, y, 0.0], [x + 20.0, y, 0.0], [x, y + 20.0, 0.0], [x + 20.0, y + 20.0, z]];
            let points: Vec<String> = corners.iter().flatten().map(|c| format!("{c:?}")).collect();
            let knots = "0.,0.,1.,1.,0.,0.,1.,1.,1.,1.,1.,1.";
            entity(128, format!("1,1,1,1,0,0,1,0,0,{knots},{},0.,1.,0.,1.", points.join(",")))
        };
        (0..100).map(square).collect()
    };
    assert_eq!(read(&iges_text::file(&squares(&[]))).unwrap().model.faces.len(), 100);
    let import = read(&iges_text::file(&squares(&[7, 40, 41]))).unwrap();
    let named: Vec<_> = import.report.skipped.iter().map(|s| s.entity.as_str()).collect();
    assert_eq!(named, ["DE 15", "DE 81", "DE 83"]);
    let reason = &import.report.skipped[0].reason;
    assert!(
        reason.contains("1.000e9 mm from the middle") && reason.contains("1.000e6 mm are plausible"),
        "{reason}"
    );
}

#[test]
fn an_absurd_tolerance_is_not_believed() {
    let _alone = alone();
    let text = plate("#100", "").replace("LENGTH_MEASURE(0.001)", "LENGTH_MEASURE(1.E300)");
    let import = read(&text).unwrap();
    assert_eq!(import.model.tolerance_mm, 10.0);
    assert!(import.report.warnings[0].contains("10 mm were taken"), "{:?}", import.report.warnings);
}

#[test]
fn exponents_beyond_all_numbers_are_survived() {
    let _alone = alone();
    let text = plate("#100", "#20=CARTESIAN_POINT('',(1.E-2147483648,2.5E-2147483648,1.E2147483647));\n");
    assert_eq!(read(&text).unwrap().model.faces.len(), 1);
}

#[test]
fn an_entity_whose_types_differ_is_named() {
    let _alone = alone();
    let text = iges_text::file(&[flat(10.0, 8.0), flat(10.0, 8.0)]);
    // In the directory the second one is no surface.
    let at = text.rmatch_indices("     128").nth(1).unwrap().0;
    for kind in ["    -429", "     999", "     110"] {
        let mut text = text.clone();
        text.replace_range(at..at + 8, kind);
        let report = read(&text).unwrap().report;
        let [skipped] = &report.skipped[..] else { panic!("{kind}: {report:?}") };
        assert_eq!((skipped.entity.as_str(), report.faces_in_file), ("DE 3", 2));
        assert!(skipped.reason.contains("those of another entity"), "{}", skipped.reason);
    }
}

#[test]
fn a_subfigure_that_cannot_be_placed_is_named() {
    let _alone = alone();
    let sound =
        [entity(308, "0,5Hwheel,1,3"), flat(10.0, 8.0), entity(408, "1,100.,0.,0.,1."), flat(10.0, 8.0)];
    for (number, damaged) in [(2, entity(408, "99,100.,0.,0.,1.")), (0, entity(308, "0,5Hwheel,900,3"))] {
        let mut entities = sound.iter().map(|e| entity(e.kind, e.parameters.clone())).collect::<Vec<_>>();
        entities[number] = damaged;
        let report = read(&iges_text::file(&entities)).unwrap().report;
        assert!(report.skipped.iter().any(|s| s.entity == "DE 5"), "{report:?}");
    }
}
