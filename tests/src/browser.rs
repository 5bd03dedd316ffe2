//! A real browser, driven: Chromium over its DevTools pipe, one JSON message up to each zero byte.

use std::cell::RefCell;
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use crate::need::{Need, leave_out};

/// Longer than any answer takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// A page in a headless Chromium of its own, with a fresh profile. Gone when dropped.
#[derive(Debug)]
pub struct Browser {
    process: Child,
    orders: RefCell<File>,
    answers: Receiver<Value>,
    session: RefCell<String>,
    sent: RefCell<u64>,
    events: RefCell<Vec<Value>>,
    _folder: tempfile::TempDir,
}

/// A picture of the page.
#[derive(Debug, Clone)]
pub struct Screenshot {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Red, green and blue of each pixel, rows from the top.
    pub rgb: Vec<[u8; 3]>,
}

impl Browser {
    /// Starts Chromium with further `options`; `None` where there is none: the calling
    /// test is left out.
    ///
    /// # Panics
    /// It is there and does not work.
    #[must_use]
    #[track_caller]
    pub fn launch(options: &[&str]) -> Option<Self> {
        let exists = |name: &&&str| {
            Command::new(name).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok()
        };
        let Some(program) = NAMES.iter().find(exists) else {
            leave_out(Need::Chromium, "no Chromium (apt-get install chromium)");
            return None;
        };
        let folder = tempfile::tempdir().expect("a folder");
        let pipe = |name: &str| {
            let path = folder.path().join(name);
            let made = Command::new("mkfifo").arg(&path).status().expect("mkfifo");
            assert!(made.success(), "mkfifo failed");
            path
        };
        let (orders, answers) = (pipe("orders"), pipe("answers"));
        // The pipe's ends are the descriptors 3 and 4, which only a shell can set without unsafe code.
        let process = Command::new("sh")
            .args(["-c", r#"exec "$@" 3<"$ORDERS" 4>"$ANSWERS""#, "sh", program])
            .args(["--headless=new", "--no-sandbox", "--remote-debugging-pipe", "--no-first-run"])
            .args(["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars"])
            .args([
                "--disable-background-networking",
                "--disable-component-update",
                "--force-device-scale-factor=1",
            ])
            .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
            .args(options)
            .arg("about:blank")
            .env("ORDERS", &orders)
            .env("ANSWERS", &answers)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("a shell");
        let orders = File::options().write(true).open(orders).expect("the pipe");
        let answers = File::open(answers).expect("the pipe");
        let (sender, receiver) = channel();
        std::thread::spawn(move || {
            for message in BufReader::new(answers).split(0).map_while(Result::ok) {
                let Ok(message) = serde_json::from_slice(&message) else { break };
                if sender.send(message).is_err() {
                    break;
                }
            }
        });
        let browser = Browser {
            process,
            orders: RefCell::new(orders),
            answers: receiver,
            session: RefCell::new(String::new()),
            sent: RefCell::new(0),
            events: RefCell::new(Vec::new()),
            _folder: folder,
        };
        let pages = browser.call("Target.getTargets", json!({}));
        let page = pages["targetInfos"].as_array().and_then(|all| all.iter().find(|t| t["type"] == "page"));
        let target = page.expect("a page")["targetId"].clone();
        let attached = browser.call("Target.attachToTarget", json!({ "targetId": target, "flatten": true }));
        *browser.session.borrow_mut() = attached["sessionId"].as_str().expect("a session").to_owned();
        for domain in ["Page", "Runtime", "Network", "Log"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        Some(browser)
    }

    /// Any command of the DevTools protocol, and its result.
    ///
    /// # Panics
    /// The browser refuses, or does not answer.
    pub fn call(&self, method: &str, parameters: Value) -> Value {
        let id = *self.sent.borrow() + 1;
        *self.sent.borrow_mut() = id;
        let mut message = json!({ "id": id, "method": method, "params": parameters });
        let session = self.session.borrow();
        if !session.is_empty() {
            message["sessionId"] = json!(*session);
        }
        let mut bytes = message.to_string().into_bytes();
        bytes.push(0);
        self.orders.borrow_mut().write_all(&bytes).expect("the browser listens");
        loop {
            let answer = self.answers.recv_timeout(PATIENCE).unwrap_or_else(|e| panic!("{method}: {e}"));
            if answer["id"] == json!(id) {
                assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
                return answer["result"].clone();
            }
            if answer["id"].is_null() {
                self.events.borrow_mut().push(answer);
            }
        }
    }

    /// Opens a file of this machine.
    ///
    /// # Panics
    /// It cannot be opened.
    pub fn open(&self, path: &Path) {
        let path = path.canonicalize().expect("the file");
        let opened = self.call("Page.navigate", json!({ "url": format!("file://{}", path.display()) }));
        assert!(opened["errorText"].is_null(), "{opened}");
    }

    /// The value of a JavaScript expression.
    ///
    /// # Panics
    /// It throws.
    #[must_use]
    pub fn evaluate(&self, expression: &str) -> Value {
        let done = self.call(
            "Runtime.evaluate",
            json!({ "expression": expression, "returnByValue": true, "awaitPromise": true }),
        );
        assert!(done["exceptionDetails"].is_null(), "{expression}: {}", done["exceptionDetails"]);
        done["result"]["value"].clone()
    }

    /// Waits until an expression is true.
    ///
    /// # Panics
    /// It does not come true.
    pub fn wait_for(&self, expression: &str) {
        let start = Instant::now();
        while self.evaluate(&format!("!!({expression})")) != json!(true) {
            assert!(start.elapsed() < PATIENCE, "{expression} does not come true");
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Waits until the page has been drawn twice: what was asked for before is then to be seen.
    pub fn settle(&self) {
        let twice = "new Promise(r => requestAnimationFrame(() => requestAnimationFrame(() => r(1))))";
        let _ = self.evaluate(twice);
    }

    /// Width and height of the window, CSS pixels.
    pub fn resize(&self, width: u32, height: u32) {
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", size);
    }

    /// Left, top, width and height of an element in the window.
    ///
    /// # Panics
    /// There is no such element.
    #[must_use]
    pub fn place(&self, selector: &str) -> [f64; 4] {
        let found = self.evaluate(&format!(
            "(() => {{ const b = document.querySelector({selector:?}).getBoundingClientRect(); \
             return [b.left, b.top, b.width, b.height]; }})()"
        ));
        [0, 1, 2, 3].map(|i| found[i].as_f64().expect("a number"))
    }

    /// Presses and releases the left button there.
    pub fn click(&self, x: f64, y: f64) {
        for event in ["mousePressed", "mouseReleased"] {
            let order = json!({ "type": event, "x": x, "y": y, "button": "left", "clickCount": 1 });
            self.call("Input.dispatchMouseEvent", order);
        }
    }

    /// The page in this part of the window: left, top, width, height.
    ///
    /// # Panics
    /// The browser sends no picture.
    #[must_use]
    pub fn screenshot(&self, [x, y, width, height]: [f64; 4]) -> Screenshot {
        self.settle();
        // Pictures are taken of the page, wherever it has been scrolled to.
        let scrolled = self.evaluate("[window.scrollX, window.scrollY]");
        let [x, y] = [(x, &scrolled[0]), (y, &scrolled[1])].map(|(v, by)| v + by.as_f64().unwrap_or(0.0));
        let clip = json!({ "x": x, "y": y, "width": width, "height": height, "scale": 1 });
        let taken = self.call("Page.captureScreenshot", json!({ "format": "png", "clip": clip }));
        let bytes = STANDARD.decode(taken["data"].as_str().expect("a picture")).expect("base 64");
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().expect("a PNG");
        let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
        let frame = reader.next_frame(&mut pixels).expect("a frame");
        let samples = frame.color_type.samples();
        let rgb = pixels[..frame.buffer_size()].chunks_exact(samples).map(|p| [p[0], p[1], p[2]]).collect();
        Screenshot { width: frame.width, height: frame.height, rgb }
    }

    /// Everything on the console, and every exception that nobody caught.
    #[must_use]
    pub fn complaints(&self) -> Vec<String> {
        const COMPLAINTS: [&str; 3] =
            ["Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded"];
        self.told(&COMPLAINTS).map(|event| event["params"].to_string()).collect()
    }

    /// Everything that was asked of the network; what stands in the page itself (`data:`, `blob:`) and files of
    /// this machine are not.
    #[must_use]
    pub fn requests(&self) -> Vec<String> {
        let urls = self.told(&["Network.requestWillBeSent"]);
        let urls = urls.filter_map(|event| Some(event["params"]["request"]["url"].as_str()?.to_owned()));
        urls.filter(|url| !["data:", "blob:", "file:"].iter().any(|own| url.starts_with(own))).collect()
    }

    fn told(&self, methods: &[&str]) -> impl Iterator<Item = Value> {
        // Whatever has been sent by now.
        let _ = self.evaluate("1");
        let events = self.events.borrow();
        let of = |event: &&Value| methods.iter().any(|m| event["method"] == *m);
        events.iter().filter(of).cloned().collect::<Vec<_>>().into_iter()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // Its helpers end with it.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Screenshot {
    /// Share of the pixels that are farther from the first one than 8 of 255 in a channel.
    #[must_use]
    pub fn drawn_share(&self) -> f64 {
        let far = |p: &&[u8; 3]| (0..3).any(|i| p[i].abs_diff(self.rgb[0][i]) > 8);
        self.rgb.iter().filter(far).count() as f64 / self.rgb.len() as f64
    }

    /// Share of the pixels that differ from the other picture's by more than 8 of 255 in a channel.
    #[must_use]
    pub fn changed_share(&self, other: &Screenshot) -> f64 {
        let changed = |(p, q): &(&[u8; 3], &[u8; 3])| (0..3).any(|i| p[i].abs_diff(q[i]) > 8);
        self.rgb.iter().zip(&other.rgb).filter(changed).count() as f64 / self.rgb.len() as f64
    }
}
