//! Examples under the help of each command.

pub(super) const DEMO: &str = "\
Examples:
  claymill demo
  claymill demo --scale 1 --tool ball:10 -o out/full-size";

pub(super) const INSPECT: &str = "\
Examples:
  claymill inspect body.igs
  claymill inspect body.igs -o defects.png --view left
  claymill inspect clamp.stl --mesh-unit 25.4";

pub(super) const DROP: &str = "\
Examples:
  claymill drop body.igs --tool ball:10 --at 1200,-300,0
  claymill drop body.igs --tool bull:5:1 --at 1200,-300,0 -o drop.png";

pub(super) const MERGE: &str = "\
Examples:
  claymill merge body.igs -o out/regions
  claymill merge body.igs --preset class-a --why 10
  claymill merge body.igs --export regions.stp";

pub(super) const PLAN: &str = "\
Examples:
  claymill plan body.igs --tool ball:10 --scallop 0.1 -o out/body
  claymill plan body.igs --up +z --length=-y --strategy auto -o out/body
  claymill plan body.igs --tool ball:3 --rest-of ball:10 --pencil -o out/rest
  claymill plan body.igs --only region:0,layer:ROOF --check clamps.stl -o out/roof
  claymill plan new-body.igs --job out/body/job.toml -o out/new-body";

pub(super) const COMPARE: &str = "\
Examples:
  claymill compare body.igs -o out/compare
  claymill compare body.igs --strategies planar,scallop --scallop 0.05,0.1 -o out/compare";

pub(super) const VERIFY: &str = "\
Examples:
  claymill verify out/body
  claymill verify out/body --json > found.json
  claymill verify out/body --program body.nc --machine mill.toml";

pub(super) const POST: &str = "\
Examples:
  claymill post out/body --to siemens -o body.mpf
  claymill post out/body --to g1 --machine mill.toml -o body.nc --simulate";

pub(super) const SIMULATE: &str = "\
Example:
  claymill simulate out/body --program body.mpf --machine mill.toml";

pub(super) const STREAM: &str = "\
Examples:
  claymill stream out/body --to shm:/dev/shm/mill
  claymill stream out/body --to linuxcnc:localhost:5007
  claymill stream out/body --to tcp:mill:7000 --secret secret.key --remote --from 1200";

pub(super) const CONTROL: &str = "\
Examples:
  claymill control --queue /dev/shm/mill
  claymill control --queue /dev/shm/mill --listen 127.0.0.1:7000 --secret secret.key --hold";

pub(super) const ORDER: &str = "\
Examples:
  claymill order hold --to 127.0.0.1:7000 --secret secret.key
  claymill order status --to 127.0.0.1:7000 --secret secret.key --json";

pub(super) const RENDER: &str = "\
Examples:
  claymill render body.igs -o body.png
  claymill render out/body --view iso,top --show scallop,joints -o out/body.png
  claymill render out/body --at 40% --show stock,tool -o stock.png";

pub(super) const VIEW: &str = "\
Examples:
  claymill view out/body
  claymill view body.igs --picture window.png";

pub(super) const ANIMATE: &str = "\
Examples:
  claymill animate out/body -o body.png
  claymill animate out/body --stock 3 --follow 300 -o body.mp4
  claymill animate out/body --storyboard -o sheet.png";

pub(super) const REPORT: &str = "\
Example:
  claymill report out/body";

pub(super) const SAMPLE: &str = "\
Examples:
  claymill sample roadster -o roadster.igs
  claymill sample ribbon --flaw gap:0.05 --flaw t-junctions -o ribbon.stp";
