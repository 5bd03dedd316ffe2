//! Tools against holders, machines and materials.

use std::path::Path;

use claymill_tooling::{
    CheckAgainst, Finding, FindingCode, Library, LibraryTool, MachineShape, Profiles, Severity,
    check_library, check_tool,
};

fn tool(rest: &str) -> LibraryTool {
    let text = format!("format = \"claymill-tools\"\nversion = 1\n[[tools]]\nid = \"T1\"\n{rest}");
    Library::parse(&text, Path::new("t.toml")).unwrap().tools.remove(0)
}

fn codes(findings: &[Finding]) -> Vec<FindingCode> {
    assert!(findings.iter().all(|f| !f.what.is_empty() && !f.remedy.is_empty() && f.tool == "T1"));
    findings.iter().map(|f| f.code).collect()
}

#[test]
fn a_tool_that_fits_has_no_finding() {
    let machine = MachineShape::shipped();
    let profiles = Profiles::shipped();
    let against =
        CheckAgainst { machine: Some(&machine), material: profiles.material("clay"), depth_mm: Some(50.0) };
    let tool = tool(
        "tool = \"ball:10\"\nnumber = 3\nflutes = 2\nflute_length_mm = 40\noverall_length_mm = 160\nholder = \"90\"\n\
         cutting.clay = { rpm = 6000, feed_mm_per_min = 9000 }",
    );
    assert_eq!(check_tool(&tool, &against), []);
}

#[test]
fn clamping_is_checked() {
    let none = CheckAgainst::default();
    let thick = tool("tool = \"ball:10\"\nholder = \"60:20x30,40x20\"");
    let findings = check_tool(&thick, &none);
    assert_eq!(codes(&findings), [FindingCode::ShankTooThick]);
    assert_eq!(findings[0].what, "its shank of 20 mm fits no holder whose lower end has a diameter of 20 mm");
    let inside = tool("tool = \"ball:5\"\nflute_length_mm = 50\nstick_out_mm = 40");
    assert_eq!(codes(&check_tool(&inside, &none)), [FindingCode::FlutesInHolder]);
    let neck = tool("tool = \"ball:5,length:50,shank:12\"\nstick_out_mm = 40");
    assert_eq!(codes(&check_tool(&neck, &none)), [FindingCode::FlutesInHolder]);
    let short = tool("tool = \"ball:5\"\noverall_length_mm = 50\nstick_out_mm = 50");
    let findings = check_tool(&short, &none);
    assert_eq!((codes(&findings)[0], findings[0].severity), (FindingCode::TooShort, Severity::Error));
    let loose = tool("tool = \"ball:5\"\noverall_length_mm = 60\nstick_out_mm = 45");
    let findings = check_tool(&loose, &none);
    assert_eq!((codes(&findings)[0], findings[0].severity), (FindingCode::TooShort, Severity::Warning));
    let stuck = tool("tool = \"flat:5\"\ncentre_cutting = false");
    assert_eq!(codes(&check_tool(&stuck, &none)), [FindingCode::NoEntry]);
}

#[test]
fn machine_and_material_are_checked() {
    let mut machine = MachineShape::shipped();
    machine.axes.insert("z".into(), [-300.0, 0.0]);
    let against = CheckAgainst { machine: Some(&machine), ..CheckAgainst::default() };
    let long = tool("tool = \"ball:5\"\ngauge_length_mm = 310");
    assert_eq!(codes(&check_tool(&long, &against)), [FindingCode::LongerThanTravel]);
    let deep = CheckAgainst { depth_mm: Some(100.0), ..against };
    let tool_200 = tool("tool = \"ball:5\"\nholder = \"120\"");
    let findings = check_tool(&tool_200, &deep);
    assert_eq!(codes(&findings), [] as [FindingCode; 0], "{findings:?}");
    let deeper = CheckAgainst { depth_mm: Some(130.0), ..against };
    assert_eq!(codes(&check_tool(&tool_200, &deeper)), [FindingCode::TooDeep, FindingCode::TooDeep]);
    let odd = tool(
        "tool = \"ball:60\"\nnumber = 99\ncutting.clay = { rpm = 30000, feed_mm_per_min = 90000 }\n\
         cutting.foam = { vc_m_per_min = 10, fz_mm = 1 }",
    );
    use FindingCode as C;
    assert_eq!(
        codes(&check_tool(&odd, &against)),
        [C::Changer, C::Changer, C::SpindleSpeed, C::Feed, C::SpindleSpeed]
    );
    let profiles = Profiles::shipped();
    let metal = CheckAgainst { material: profiles.material("aluminium"), ..CheckAgainst::default() };
    let slim = tool("tool = \"ball:2\"\nstick_out_mm = 60");
    assert_eq!(codes(&check_tool(&slim, &metal)), [C::NoCuttingData, C::Slender]);
}

#[test]
fn numbers_that_occur_twice_are_found() {
    let mut library = Library { name: String::new(), tools: vec![tool("tool = \"ball:5\"\nnumber = 3")] };
    let mut second = library.tools[0].clone();
    second.id = "T2".into();
    library.tools.push(second);
    let findings = check_library(&library, &CheckAgainst::default());
    assert_eq!(
        (findings[0].code, findings[0].what.as_str()),
        (FindingCode::SameNumber, "it has the number 3, as T1 has")
    );
}
