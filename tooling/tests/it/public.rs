//! Files that other programs shipped, in the folder beside the corpus. They are never copied here.

use std::path::PathBuf;

use claymill_tests::{Need, leave_out};
use claymill_tooling::{MachineShape, ReadOptions, read_library, tool_svg};

fn folder() -> Option<PathBuf> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/corpus");
    let corpus = std::env::var_os("CLAYMILL_CORPUS").map_or_else(|| beside.into(), PathBuf::from);
    let folder = corpus.parent()?.join("tool-samples");
    if !folder.is_dir() {
        leave_out(Need::Corpus, format_args!("{} is not there", folder.display()));
        return None;
    }
    Some(folder)
}

#[test]
fn shipped_tools_of_others_are_read() {
    let Some(folder) = folder() else { return };
    let cases = [
        ("5mm_Endmill.fctb", "flat:2.5,length:30,shank:3"),
        ("6mm_Ball_End.fctb", "ball:3,length:40,shank:3"),
        ("6mm_Bullnose.fctb", "bull:3:1.5,length:40,shank:3"),
        ("fusion_library.json", "flat:5"),
    ];
    for (file, tool) in cases {
        let reading = read_library(&folder.join(file), &ReadOptions::default()).unwrap();
        assert_eq!(reading.library.tools.len(), 1, "{file}: {reading:?}");
        let read = &reading.library.tools[0];
        assert_eq!((read.tool.to_string().as_str(), reading.skipped.len()), (tool, 0), "{file}");
        assert_eq!(
            tool_svg(read).matches("<polygon").count(),
            2 + read.holder.as_ref().map_or(0, |h| h.sections.len())
        );
    }
    let reading = read_library(&folder.join("fusion_library.json"), &ReadOptions::default()).unwrap();
    let tool = &reading.library.tools[0];
    assert_eq!((tool.id.as_str(), tool.flutes, tool.stick_out_mm), ("T2", Some(3), Some(50.0)));
    // The sum of the heights of the file's fourteen segments, 62.8396 mm, over the stick-out.
    let holder = tool.holder.as_ref().unwrap();
    assert_eq!(holder.sections.len(), 14);
    approx::assert_relative_eq!(tool.length_in_spindle_mm().unwrap(), 112.8396, max_relative = 1e-12);
    assert_eq!(tool.cutting.keys().collect::<Vec<_>>(), ["preset-1", "secondpreset"]);
}

#[test]
fn a_shipped_machine_of_others_is_read() {
    let Some(folder) = folder() else { return };
    let (machine, notes) = MachineShape::read(&folder.join("Dah_Lih_MCV_510.fcm")).unwrap();
    assert_eq!((machine.travel_mm("x"), machine.travel_mm("z")), (Some(510.0), Some(410.0)));
    assert_eq!((machine.spindle.max_rpm, machine.rotary.len(), notes.len()), (Some(6000.0), 1, 1));
}

#[test]
fn a_tool_table_of_others_is_read() {
    let Some(folder) = folder() else { return };
    let table = folder.with_file_name("linuxcnc-sim").join("tool.tbl");
    if !table.is_file() {
        return leave_out(Need::Corpus, format_args!("{} is not there", table.display()));
    }
    let reading = read_library(&table, &ReadOptions::default()).unwrap();
    assert_eq!(reading.library.get("T1").unwrap().tool.to_string(), "ball:5");
}
