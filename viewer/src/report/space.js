// The 3-D view of the report. Its data is in the page: the job as glTF (`space-model`, compressed) and what is to be
// said of it (`space-facts`). Whatever goes wrong, the still picture stays.
"use strict";
(() => {
  const place = document.getElementById("space");
  const byId = (id) => document.getElementById(id);
  const facts = JSON.parse(byId("space-facts").textContent);
  const stage = place.querySelector(".stage");
  const canvas = place.querySelector("canvas");
  const say = (text) => { byId("space-status").textContent = text; };

  // Where the eye is and what is up: x is the vehicle's left, y up, z its front. The first is the cover's.
  const VIEWS = {
    iso: [[0.95, 0.62, 0.75], [0, 1, 0]], top: [[0, 1, 0], [-1, 0, 0]], left: [[1, 0, 0], [0, 1, 0]],
    right: [[-1, 0, 0], [0, 1, 0]], front: [[0, 0, 1], [0, 1, 0]], rear: [[0, 0, -1], [0, 1, 0]],
  };
  const OPENING_DEG = 22, CLOSEST_PASSES_PX = 4, MARGIN = 1.06, CLICK_PX = 5;

  async function unpacked(id) {
    const text = byId(id).textContent;
    const packed = Uint8Array.fromBase64 ? Uint8Array.fromBase64(text)
      : Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Response(stream).arrayBuffer();
  }

  async function model() {
    const bytes = await unpacked("space-model");
    return new Promise((done, fail) => new THREE.GLTFLoader().parse(bytes, "", done, fail));
  }

  async function start() {
    const probe = document.createElement("canvas");
    if (!probe.getContext("webgl2")) throw new Error("this browser offers no WebGL 2");
    if (!window.DecompressionStream) throw new Error("this browser is too old to unpack it");
    const gltf = await model();
    const renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
    const scene = new THREE.Scene();
    const root = gltf.scene;
    scene.add(root);
    root.updateMatrixWorld(true);
    const camera = new THREE.PerspectiveCamera(OPENING_DEG, 1, 0.01, 100);
    const lamp = new THREE.DirectionalLight(0xffffff, 2.1);
    scene.add(new THREE.HemisphereLight(0xffffff, 0x6b6660, 1.1), camera);
    camera.add(lamp, lamp.target);
    lamp.position.set(-1, 1.6, 1);

    const regions = [], lines = [];
    collect(root, gltf.asset.extras.lift_mm / 1000, regions, lines);
    const samples = samplesOf(regions.length ? regions : lines);
    const centre = new THREE.Vector3();
    for (const p of samples) centre.addScaledVector(p, 1 / samples.length);
    const radius = samples.reduce((far, p) => Math.max(far, p.distanceTo(centre)), 1e-3);

    const controls = new THREE.OrbitControls(camera, canvas);
    controls.zoomToCursor = true;
    controls.minDistance = radius * 0.01;
    controls.maxDistance = radius * 40;
    // A finger that moves up or down scrolls the page; two fingers and sideways strokes are the view's.
    if (matchMedia("(pointer: coarse)").matches) canvas.style.touchAction = "pan-y";

    const state = { colouring: "region", selected: null, alone: false, direction: "all" };
    let asked = false, framed = "iso";
    const draw = () => { if (!asked) { asked = true; requestAnimationFrame(render); } };

    function render() {
      asked = false;
      const distance = camera.position.distanceTo(controls.target);
      const off = camera.position.distanceTo(centre);
      camera.near = Math.max(off - 1.5 * radius, distance * 0.02);
      camera.far = off + 1.5 * radius;
      camera.updateProjectionMatrix();
      const pixel = 2000 * distance * Math.tan(OPENING_DEG * Math.PI / 360) / canvas.clientHeight;
      showLevels(pixel);
      scaleBar(pixel);
      renderer.render(scene, camera);
    }

    // Where passes would stand too close for single pixels only every third or ninth is drawn.
    function showLevels(pixel) {
      const close = [1, 3.5, 9].map((steps) => steps * facts.step_mm < CLOSEST_PASSES_PX * pixel);
      let thinned = false;
      for (const { object, info } of lines) {
        const hidden = info.level < 2 && close[info.level] && !byId("space-all").checked;
        object.visible = shown(info) && !hidden;
        thinned ||= hidden && shown(info);
      }
      byId("space-thinned").hidden = !thinned;
    }

    function shown(info) {
      const layer = byId(`layer-${info.kind}`);
      if (layer && !layer.checked) return false;
      if (info.setup && state.direction !== "all" && info.setup !== state.direction) return false;
      if (state.alone && state.selected !== null && "region" in info) return info.region === state.selected;
      return true;
    }

    function scaleBar(pixel) {
      let length = 10 ** Math.floor(Math.log10(120 * pixel));
      for (const k of [5, 2]) if (length * k <= 120 * pixel) { length *= k; break; }
      const bar = byId("space-scale");
      bar.style.width = `${length / pixel}px`;
      bar.textContent = length >= 1000 ? `${length / 1000} m` : `${length} mm`;
    }

    function fit(name) {
      framed = name;
      const [from, up] = VIEWS[name].map((v) => new THREE.Vector3(...v));
      from.normalize();
      const sideways = new THREE.Vector3().crossVectors(up, from).normalize();
      const upwards = new THREE.Vector3().crossVectors(from, sideways);
      const tall = Math.tan(OPENING_DEG * Math.PI / 360), wide = tall * camera.aspect;
      // The middle of what is seen, then as near as every corner allows.
      const middle = centre.clone();
      for (const axis of [sideways, upwards]) {
        let low = Infinity, high = -Infinity;
        for (const p of samples) {
          const along = p.clone().sub(centre).dot(axis);
          low = Math.min(low, along);
          high = Math.max(high, along);
        }
        middle.addScaledVector(axis, (low + high) / 2);
      }
      let distance = 0;
      for (const p of samples) {
        const q = p.clone().sub(middle);
        const needed = Math.max(Math.abs(q.dot(sideways)) / wide, Math.abs(q.dot(upwards)) / tall) * MARGIN;
        distance = Math.max(distance, needed + q.dot(from));
      }
      // The controls turn about what is up; straight down has no side, so a hair beside it.
      camera.up.set(0, 1, 0);
      if (name === "top") from.addScaledVector(up, -1e-4).normalize();
      controls.target.copy(middle);
      camera.position.copy(middle).addScaledVector(from, distance);
      controls.update();
      draw();
    }

    function paint() {
      for (const { object, info } of regions) {
        const material = object.material;
        const byHeight = state.colouring === "scallop" && info.cut;
        if (byHeight && !object.geometry.attributes.color) object.geometry.setAttribute("color", heat(object.geometry));
        if (material.vertexColors !== byHeight) { material.vertexColors = byHeight; material.needsUpdate = true; }
        material.color.set(byHeight ? 0xffffff : state.colouring === "region" || !info.cut ? info.colour : facts.clay);
        const chosen = info.region === state.selected;
        material.emissive.set(chosen && !state.alone ? 0x6a4a00 : 0x000000);
        object.visible = shown(info);
      }
      // On the map of heights the passes step back.
      for (const { object: { material }, info } of lines) {
        if (info.kind !== "cut") continue;
        const back = state.colouring === "scallop";
        material.color.set(back ? 0x202024 : info.colour);
        material.opacity = back ? 0.3 : 1;
        if (material.transparent !== back) { material.transparent = back; material.needsUpdate = true; }
      }
      byId("space-heat").hidden = state.colouring !== "scallop";
      draw();
    }

    function choose(region, hit) {
      state.selected = region;
      byId("space-region").value = region === null ? "" : String(region);
      const list = byId("space-rows");
      list.replaceChildren();
      const chosen = facts.regions[region];
      byId("space-name").textContent = chosen ? chosen.name : "Click a region, or choose one above";
      const row = (name, value) => {
        const div = document.createElement("div");
        div.append(Object.assign(document.createElement("dt"), { textContent: name }),
          Object.assign(document.createElement("dd"), { textContent: value }));
        list.append(div);
      };
      if (chosen) for (const [name, value] of chosen.rows) row(name, value);
      if (chosen && hit) for (const [name, value] of hit) row(name, value);
      paint();
    }

    // What is under the pointer: the region, and the facts of that very place.
    function pick(event) {
      const box = canvas.getBoundingClientRect();
      const at = new THREE.Vector2((event.clientX - box.left) / box.width * 2 - 1, 1 - (event.clientY - box.top) / box.height * 2);
      const ray = new THREE.Raycaster();
      ray.setFromCamera(at, camera);
      const candidates = regions.filter((r) => r.object.visible).map((r) => r.object);
      const hit = ray.intersectObjects(candidates, false)[0];
      if (!hit) { choose(null); return; }
      const info = hit.object.userData.info;
      const face = info.faces[lastNotAbove(info.faces, hit.faceIndex)][1];
      const p = modelPoint(hit.point, gltf.asset.extras);
      const rows = [["Place", `x ${p[0]}, y ${p[1]}, z ${p[2]} mm`],
        ["Face", facts.entities[face] ? `${face} (${facts.entities[face]})` : String(face)]];
      const share = hit.object.geometry.attributes._scallop?.getX(hit.face.a) ?? 255;
      if (share < 255) rows.push(["Scallop here, highest within 8 mm", `${(share * facts.scallop_mm * 10).toPrecision(3)} µm`]);
      if (!info.cut) rows.push(["This face", "is not cut"]);
      if (info.one_sided && ray.ray.direction.dot(facing(hit)) > 0) rows.push(["Seen from", "the side of the material"]);
      choose(info.region, rows);
    }

    function resize() {
      const { clientWidth: w, clientHeight: h } = canvas;
      if (!w || !h) return;
      renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
      renderer.setSize(w, h, false);
      camera.aspect = w / h;
      if (framed) fit(framed); else draw();
    }

    function ground() {
      scene.background = new THREE.Color(getComputedStyle(stage).getPropertyValue("--stage").trim());
      draw();
    }

    controls.addEventListener("change", draw);
    // From then on the view is the reader's.
    controls.addEventListener("start", () => { framed = null; });
    let down = null;
    canvas.addEventListener("pointerdown", (e) => { down = e; });
    canvas.addEventListener("pointerup", (e) => {
      if (down && Math.hypot(e.clientX - down.clientX, e.clientY - down.clientY) < CLICK_PX) pick(e);
      down = null;
    });
    canvas.addEventListener("keydown", (e) => {
      const turn = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[e.key];
      const zoom = { "+": 0.8, "-": 1.25 }[e.key];
      if (!turn && !zoom) return;
      e.preventDefault();
      const arm = camera.position.clone().sub(controls.target);
      if (turn) {
        const s = { r: arm.length(), theta: Math.atan2(arm.x, arm.z), phi: Math.acos(arm.y / arm.length()) };
        s.theta += turn[0] * 0.15;
        s.phi = Math.min(Math.PI - 0.01, Math.max(0.01, s.phi + turn[1] * 0.15));
        arm.set(s.r * Math.sin(s.phi) * Math.sin(s.theta), s.r * Math.cos(s.phi), s.r * Math.sin(s.phi) * Math.cos(s.theta));
      }
      framed = null;
      camera.position.copy(controls.target).addScaledVector(arm, zoom || 1);
      controls.update();
      draw();
    });
    place.addEventListener("click", (e) => { if (e.target.dataset.view) fit(e.target.dataset.view); });
    place.addEventListener("change", (e) => {
      if (e.target.name === "space-colour") state.colouring = e.target.value;
      if (e.target.id === "space-direction") state.direction = e.target.value;
      if (e.target.id === "space-alone") state.alone = e.target.checked;
      if (e.target.id === "space-region") choose(e.target.value === "" ? null : Number(e.target.value));
      paint();
    });
    document.addEventListener("click", (e) => {
      const link = e.target.closest?.("[data-region]");
      if (link) { choose(Number(link.dataset.region)); stage.scrollIntoView({ block: "center" }); e.preventDefault(); }
    });
    byId("space-full").addEventListener("click", () => {
      if (document.fullscreenElement) document.exitFullscreen(); else stage.requestFullscreen?.();
    });
    canvas.addEventListener("webglcontextlost", (e) => {
      e.preventDefault();
      place.classList.remove("live");
      say("The graphics driver gave up; the picture is shown instead. Reload the page to try again.");
    });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", ground);
    new ResizeObserver(resize).observe(canvas);

    if (facts.way) inTime(new Float32Array(await unpacked("space-way")), gltf.asset.extras, scene, draw);
    place.classList.add("live");
    resize();
    ground();
    choose(null);
    fit("iso");
    render();
    say("");
    place.dataset.drawnMs = String(Math.round(performance.now()));
  }

  // The tool at any time of the job, and the last of its way.
  function inTime(way, { origin_mm: origin, axes }, scene, draw) {
    const TRAIL = 400, MOVED = 1000;
    const count = way.length / 4, { duration_s: duration, setups } = facts.way;
    const turned = (v) => new THREE.Vector3(...axes.map((a) => a[0] * v[0] + a[1] * v[1] + a[2] * v[2]));
    const inScene = (p) => turned(p.map((c, i) => c - origin[i])).multiplyScalar(1 / 1000);
    const tool = new THREE.Group();
    // It may stick out farther in one setup than in another.
    const inSetup = new Map();
    for (const [name, bands] of Object.entries(facts.tools)) {
      const body = new THREE.Group();
      for (const [ends, colour] of bands) {
        const outline = ends.map(([height, radius]) => new THREE.Vector2(radius / 1000, height / 1000));
        const material = new THREE.MeshLambertMaterial({ color: colour, side: THREE.DoubleSide });
        body.add(new THREE.Mesh(new THREE.LatheGeometry(outline, 32), material));
      }
      inSetup.set(name, body);
      tool.add(body);
    }
    const trail = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: 0xcd3e00, depthTest: false }));
    trail.frustumCulled = false;
    tool.visible = trail.visible = false;
    scene.add(tool, trail);
    const slider = byId("space-time"), button = byId("space-play");
    const clock = (s) => [s / 3600, s / 60 % 60, s % 60].map((v) => String(Math.floor(v)).padStart(2, "0")).join(":");

    // The last point that is not later.
    const before = (s) => {
      let low = 0, high = count - 1;
      while (low < high) {
        const middle = (low + high + 1) >> 1;
        if (way[4 * middle] <= s) low = middle; else high = middle - 1;
      }
      return low;
    };
    const point = (k) => [way[4 * k + 1], way[4 * k + 2], way[4 * k + 3]];

    function show(s) {
      const k = before(s), n = Math.min(k + 1, count - 1);
      const share = way[4 * n] > way[4 * k] ? Math.min((s - way[4 * k]) / (way[4 * n] - way[4 * k]), 1) : 0;
      const from = point(k), to = point(n);
      const tip = from.map((c, i) => c + share * (to[i] - c));
      const [start, name, axis] = setups.findLast((setup) => setup[0] <= s + 1e-6) ?? setups[0];
      for (const [setup, body] of inSetup) body.visible = setup === name;
      tool.position.copy(inScene(tip));
      tool.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), turned(axis).normalize());
      const places = [];
      for (let i = Math.max(k - TRAIL, 0); i <= k; i++) if (way[4 * i] >= start) places.push(inScene(point(i)));
      places.push(inScene(tip));
      trail.geometry.dispose();
      trail.geometry = new THREE.BufferGeometry().setFromPoints(places);
      tool.visible = trail.visible = true;
      slider.setAttribute("aria-valuetext", `${clock(s)}, setup ${name}`);
      byId("space-clock").textContent = `${clock(s)} of ${clock(duration)}, ${name}`;
      place.dataset.tip = tip.map((c) => c.toFixed(2)).join(" ");
      draw();
    }

    let playing = null;
    const now = () => slider.value / MOVED * duration;
    function play(on) {
      if (playing !== null) cancelAnimationFrame(playing);
      playing = null;
      button.textContent = on ? "Pause" : "Play";
      button.setAttribute("aria-pressed", String(on));
      if (!on) return;
      if (now() >= duration) slider.value = 0;
      let last = performance.now();
      const step = (at) => {
        const s = Math.min(now() + (at - last) / 1000 * byId("space-speed").value, duration);
        last = at;
        slider.value = s / duration * MOVED;
        show(s);
        if (s < duration) playing = requestAnimationFrame(step); else play(false);
      };
      playing = requestAnimationFrame(step);
    }
    slider.addEventListener("input", () => show(now()));
    button.addEventListener("click", () => play(playing === null));
    byId("space-clock").textContent = `${clock(0)} of ${clock(duration)}, ${setups[0][1]}`;
  }

  // Nodes by what they are, with materials of their own: what is chosen looks different.
  function collect(root, lift, regions, lines) {
    // Lines follow the true surface, triangles cut across: lines are drawn that much nearer to the eye.
    const lifted = (shader) => {
      shader.vertexShader = shader.vertexShader.replace("#include <project_vertex>", `#include <project_vertex>
        mvPosition.xyz *= 1.0 - ${lift.toExponential(4)} / length(mvPosition.xyz);
        gl_Position = projectionMatrix * mvPosition;`);
    };
    // The side of the material is dull, and hatched as sections of material are in drawings.
    const stripe = (9 * Math.min(devicePixelRatio, 2)).toFixed(1);
    const hatchedBehind = (shader) => {
      shader.fragmentShader = shader.fragmentShader.replace("#include <color_fragment>", `#include <color_fragment>
        if (!gl_FrontFacing) {
          float off = abs(fract((gl_FragCoord.x + gl_FragCoord.y) / ${stripe}) - 0.5);
          vec3 dull = mix(diffuseColor.rgb, vec3(0.21, 0.11, 0.07), 0.72);
          diffuseColor.rgb = mix(dull, vec3(0.045, 0.022, 0.015), 0.75 - 0.75 * smoothstep(0.10, 0.22, off));
        }`);
    };
    root.traverse((object) => {
      let node = object;
      while (node && !node.userData.kind) node = node.parent;
      if (!node || !object.geometry) return;
      const info = { ...node.userData, colour: object.material.color.getHex() };
      object.userData.info = info;
      if (object.isLineSegments) {
        const opacity = { patches: 0.35, rapid: 0.8 }[info.kind] ?? 1;
        object.material = new THREE.LineBasicMaterial({ color: info.colour, opacity, transparent: opacity < 1 });
        object.material.onBeforeCompile = lifted;
        lines.push({ object, info });
      } else {
        object.material = new THREE.MeshLambertMaterial({ color: info.colour, side: THREE.DoubleSide });
        if (info.one_sided) object.material.onBeforeCompile = hatchedBehind;
        regions.push({ object, info });
      }
    });
  }

  // Which way the front of the triangle looks that was hit.
  function facing({ face, object }) {
    return face.normal.clone().transformDirection(object.matrixWorld);
  }

  // Points enough of every part to frame it.
  function samplesOf(parts) {
    const samples = [];
    for (const { object } of parts) {
      const places = object.geometry.attributes.position, step = Math.ceil(places.count / 300);
      for (let i = 0; i < places.count; i += step) {
        samples.push(new THREE.Vector3().fromBufferAttribute(places, i).applyMatrix4(object.matrixWorld));
      }
    }
    return samples;
  }

  function heat(geometry) {
    const scale = facts.heat.map((hex) => new THREE.Color(hex));
    const shares = geometry.attributes._scallop;
    const colours = new Uint16Array(3 * shares.count);
    for (let i = 0; i < shares.count; i++) {
      const c = scale[shares.getX(i)];
      colours.set([c.r * 65535, c.g * 65535, c.b * 65535], 3 * i);
    }
    return new THREE.BufferAttribute(colours, 3, true);
  }

  function lastNotAbove(pairs, index) {
    let low = 0, high = pairs.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (pairs[middle][0] <= index) low = middle; else high = middle - 1;
    }
    return low;
  }

  // Back to the coordinates of the model's file, mm.
  function modelPoint(p, { origin_mm: origin, axes }) {
    return [0, 1, 2].map((i) => (origin[i] + 1000 * (axes[0][i] * p.x + axes[1][i] * p.y + axes[2][i] * p.z)).toFixed(1));
  }

  start().catch((error) => say(`No 3-D view: ${error.message}. The picture is shown instead.`));
})();
