//! Shards on a real Slurm with two nodes on this machine, of which one is killed in the middle.

use std::fs;
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use claymill_tests::{Need, is_installed};

use crate::reuse::assert_same;
use crate::run::{Run, run};
use crate::scratch;
use crate::shards::ribbon_in_shards;

const PATH: &str = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin";
/// Longer than Slurm takes to see that a node is gone.
const LONGEST: Duration = Duration::from_secs(180);

/// Daemons that end with the test.
struct Daemons(Vec<Child>);

impl Drop for Daemons {
    fn drop(&mut self) {
        for daemon in &mut self.0 {
            let _ = daemon.kill();
            let _ = daemon.wait();
        }
    }
}

struct Cluster<'a> {
    folder: &'a Path,
    daemons: Daemons,
}

impl<'a> Cluster<'a> {
    /// A controller and two nodes, as root in a folder of their own.
    fn start(folder: &'a Path) -> Self {
        let host = Run::from(Command::new("hostname").output().unwrap()).stdout.trim().to_owned();
        let free = || TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let (at, [control, a1, a2]) = (folder.display(), [free(), free(), free()]);
        for name in ["state", "spool-a1", "spool-a2"] {
            fs::create_dir_all(folder.join(name)).unwrap();
        }
        let text = format!(
            "ClusterName=clay\nSlurmctldHost={host}(127.0.0.1)\nSlurmctldPort={control}\nAuthType=auth/munge\n\
             AuthInfo=socket={at}/munge.sock\nCryptoType=crypto/munge\nSlurmUser=root\nSlurmdUser=root\n\
             StateSaveLocation={at}/state\nSlurmdSpoolDir={at}/spool-%n\nSlurmctldPidFile={at}/ctld.pid\n\
             SlurmdPidFile={at}/slurmd-%n.pid\nSlurmctldLogFile={at}/ctld.log\nSlurmdLogFile={at}/slurmd-%n.log\n\
             ProctrackType=proctrack/pgid\nTaskPlugin=task/none\nSwitchType=switch/none\nMpiDefault=none\n\
             SelectType=select/cons_tres\nSelectTypeParameters=CR_Core\nJobAcctGatherType=jobacct_gather/none\n\
             AccountingStorageType=accounting_storage/none\nReturnToService=2\nSlurmdTimeout=5\nInactiveLimit=0\n\
             KillWait=2\nMinJobAge=300\nJobRequeue=1\n\
             SchedulerParameters=sched_interval=1,bf_interval=1,batch_sched_delay=0\n\
             NodeName=a1 NodeHostname={host} NodeAddr=127.0.0.1 Port={a1} CPUs=1 RealMemory=4000 State=UNKNOWN\n\
             NodeName=a2 NodeHostname={host} NodeAddr=127.0.0.1 Port={a2} CPUs=1 RealMemory=4000 State=UNKNOWN\n\
             PartitionName=night Nodes=ALL Default=YES MaxTime=INFINITE State=UP\n"
        );
        fs::write(folder.join("slurm.conf"), text).unwrap();
        fs::write(folder.join("munge.key"), [7; 1024]).unwrap();
        let mode = Command::new("chmod").arg("400").arg(folder.join("munge.key")).status().unwrap();
        assert!(mode.success());
        let mut cluster = Cluster { folder, daemons: Daemons(Vec::new()) };
        let file = |option: &str, name: &str| format!("--{option}={at}/{name}");
        let munge = [
            "-F".to_owned(),
            "--force".to_owned(),
            file("socket", "munge.sock"),
            file("key-file", "munge.key"),
            file("pid-file", "munge.pid"),
            file("log-file", "munge.log"),
            file("seed-file", "munge.seed"),
        ];
        cluster.spawn("munged", &munge.each_ref().map(String::as_str));
        cluster.wait("munge", || folder.join("munge.sock").exists());
        let conf = format!("{at}/slurm.conf");
        cluster.spawn("slurmctld", &["-f", &conf, "-D"]);
        for node in ["a1", "a2"] {
            cluster.spawn("slurmd", &["-N", node, "-f", &conf, "-D"]);
        }
        cluster.wait("both nodes to be idle", || {
            cluster.run("sinfo", &["-h", "-N", "-o", "%T"]).stdout.lines().filter(|l| *l == "idle").count()
                == 2
        });
        cluster
    }

    fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command
            .env("PATH", PATH)
            .env("SLURM_CONF", self.folder.join("slurm.conf"))
            .env("WGPU_ADAPTER_NAME", "none");
        command
    }

    fn spawn(&mut self, program: &str, args: &[&str]) {
        let mut command = self.command(program);
        command.args(args).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        self.daemons.0.push(command.spawn().unwrap());
    }

    fn run(&self, program: &str, args: &[&str]) -> Run {
        self.command(program).args(args).output().unwrap().into()
    }

    fn wait(&self, what: &str, is_so: impl Fn() -> bool) {
        let begun = Instant::now();
        while !is_so() {
            let said = fs::read_to_string(self.folder.join("ctld.log")).unwrap_or_default();
            assert!(begun.elapsed() < LONGEST, "{what}: {:?}\n{said}", self.run("squeue", &[]));
            std::thread::sleep(Duration::from_millis(200));
        }
    }

    /// Takes a node and what runs on it away.
    fn kill_node(&mut self, name: &str) {
        // Munge and the controller come first.
        let node = &mut self.daemons.0[if name == "a1" { 2 } else { 3 }];
        node.kill().unwrap();
        node.wait().unwrap();
        let spool = format!("{}/spool-{name}", self.folder.display());
        let numbers = |run: Run| run.stdout.lines().map(|l| l.trim().to_owned()).collect::<Vec<String>>();
        let scripts = numbers(self.run("pgrep", &["-f", &spool]));
        // What holds a job would say that it has ended.
        for script in &scripts {
            let holders = numbers(self.run("ps", &["-o", "ppid=", "-p", script]));
            holders.iter().filter(|holder| *holder != "1").for_each(|holder| kill(holder));
        }
        for script in &scripts {
            // The whole group: the script and the shard.
            kill(&format!("-{script}"));
            kill(script);
        }
    }
}

fn kill(process: &str) {
    let _ = Command::new("kill").args(["-9", "--", process]).stderr(Stdio::null()).status();
}

#[test]
fn two_nodes_lay_the_plan_also_when_one_of_them_is_killed() {
    let programs =
        [("slurmctld", "slurmctld"), ("slurmd", "slurmd"), ("sbatch", "slurm-client"), ("munged", "munge")];
    if !programs.iter().all(|(program, package)| is_installed(Need::Slurm, program, package)) {
        return;
    }
    let folder = scratch();
    let folder = folder.path();
    ribbon_in_shards(folder);
    // Slurm's own names of sockets have to be short.
    let short = tempfile::tempdir().unwrap();
    let mut cluster = Cluster::start(short.path());
    let written = run(folder, ["shard", "script", "work", "--for", "slurm", "-o", "joined", "--cores", "1"]);
    assert_eq!(written.code, Some(0), "{written:?}");
    let script = folder.join("work/slurm.sh");
    let submitted = cluster.run("bash", &[script.to_str().unwrap()]);
    assert_eq!(submitted.code, Some(0), "{submitted:?}");
    cluster.wait("shards on a node", || {
        !cluster.run("squeue", &["-h", "-t", "running", "-w", "a2"]).stdout.is_empty()
            || folder.join("joined").exists()
    });
    cluster.kill_node("a2");
    // Slurm holds what it queues again for two minutes; nobody has to wait for that here.
    cluster.wait("the join", || {
        for job in cluster.run("squeue", &["-h", "-t", "pending", "-o", "%i %r"]).stdout.lines() {
            if let Some((id, "BeginTime")) = job.split_once(' ') {
                cluster.run("scontrol", &["update", &format!("jobid={id}"), "StartTime=now"]);
            }
        }
        folder.join("joined/verify.json").exists() && cluster.run("squeue", &["-h"]).stdout.is_empty()
    });
    assert_same(folder, "plan", "joined");
}
