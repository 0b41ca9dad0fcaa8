"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const at = (id) => document.getElementById(id);
const FINE = 32, GHOST = [0.08, 0.42, 1.0, 0.55], MARK = [1.0, 0.45, 0.05, 1.0], CHOSEN = [0.76, 0.09, 0.36, 1.0];

// Signals: 16 bits a value, NaN where there is none.
const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
const values = (s) =>
  Float32Array.from(new Int16Array(bytes(s.steps)), (k) =>
    k === -32768 ? NaN : s.middle + s.size * k);
for (const axis of data.axes) {
  axis.measured = new Float32Array(bytes(axis.measured));
  axis.large = axis.measured.some((v) => Math.abs(v) >= 1); // is told in whole units
  for (const name of ["setpoint", "modelled"]) axis[name] = values(axis[name]); // less measured
  for (const force of axis.forces) {
    force.values = values(force.values);
    force.most = force.values.reduce((m, v) => Math.max(m, Math.abs(v)), 0);
  }
  axis.mostForce = Math.max(...axis.forces.map((f) => f.most), 1e-300);
  for (const strip of axis.strips) [strip.low, strip.high] = [values(strip.low), values(strip.high)];
}
const strips = data.axes.flatMap((axis) => axis.strips.map((s) => ({ ...s, axis: axis.name })));
const duration = Math.max(data.frames - 1, 1) / data.rate;

function quantity(value, unit) {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return `0 ${unit.replace(" ", "·")}`;
  const size = Math.abs(value);
  const [step, prefix] = [[1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"]].find(
    ([s]) => size >= 0.5 * s) || [1e-9, "n"];
  return `${(value / step).toPrecision(3).replace("-", "−")} ${prefix}${unit.replace(" ", "·")}`;
}

// Matrices: 16 numbers, column by column.
function times(a, b) {
  const c = new Float32Array(16);
  for (let i = 0; i < 4; i++)
    for (let j = 0; j < 4; j++)
      for (let k = 0; k < 4; k++) c[4 * j + i] += a[4 * k + i] * b[4 * j + k];
  return c;
}
const moved = (m, p, w = 1) =>
  [0, 1, 2].map((i) => m[i] * p[0] + m[4 + i] * p[1] + m[8 + i] * p[2] + w * m[12 + i]);
const minus = (a, b) => a.map((v, i) => v - b[i]);
const cross = (a, b) => [0, 1, 2].map((i) => a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const unit = (a) => a.map((v) => v / (Math.hypot(...a) || 1));

/** Where a link stands: each axis moves what follows it by its screw, from rest. */
function placed(link, position) {
  let m = Float32Array.of(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1);
  for (const joint of data.links[link]) {
    const by = joint.axes.reduce((sum, [axis, ratio]) => sum + ratio * position(data.axes[axis]), -joint.zero);
    const [x, y, z] = joint.along;
    if (!joint.hinge) {
      m = times(m, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, by * x, by * y, by * z, 1]);
      continue;
    }
    const c = Math.cos(by), s = Math.sin(by), d = 1 - c;
    const r = [x * x * d + c, y * x * d + z * s, z * x * d - y * s, 0, x * y * d - z * s, y * y * d + c,
      z * y * d + x * s, 0, x * z * d + y * s, y * z * d - x * s, z * z * d + c, 0, 0, 0, 0, 1];
    const shift = minus(joint.through, moved(r, joint.through));
    m = times(m, [...r.slice(0, 12), ...shift, 1]);
  }
  return m;
}

// Shapes as triangles: corners with normals, in the frame of the geom.
function turned(profile) {
  const out = [], on = (p, i) => {
    const a = (2 * Math.PI * i) / FINE, [c, s] = [Math.cos(a), Math.sin(a)];
    return [[p[0] * c, p[0] * s, p[1]], [p[2] * c, p[2] * s, p[3]]];
  };
  for (const [p, q] of profile)
    for (let i = 0; i < FINE; i++)
      for (const [end, k] of [[p, i], [p, i + 1], [q, i + 1], [p, i], [q, i + 1], [q, i]]) out.push(on(end, k));
  return out;
}
const arc = (r, z, from) =>
  [...Array(8)].map((_, i) => [i, i + 1].map((k) => {
    const a = from + (k * Math.PI) / 16;
    return [r * Math.cos(a), z + r * Math.sin(a), Math.cos(a), Math.sin(a)];
  }));
const flat = (corners, normal) => [0, 1, 2, 0, 2, 3].map((i) => [corners[i], normal]);
const shapes = {
  box: ([x, y, z]) => [0, 1, 2].flatMap((i) => [-1, 1].flatMap((sign) => {
    const [j, k] = [(i + 1) % 3, (i + 2) % 3], half = [x, y, z];
    const corner = (a, b) => { const p = [0, 0, 0]; p[i] = sign * half[i]; p[j] = a * half[j]; p[k] = b * half[k]; return p; };
    const normal = [0, 0, 0]; normal[i] = sign;
    return flat([corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)], normal);
  })),
  cylinder: ([r, h]) => turned([[[0, -h, 0, -1], [r, -h, 0, -1]], [[r, -h, 1, 0], [r, h, 1, 0]],
    [[r, h, 0, 1], [0, h, 0, 1]]]),
  capsule: ([r, h]) => turned([...arc(r, -h, -Math.PI / 2), [[r, -h, 1, 0], [r, h, 1, 0]], ...arc(r, h, 0)]),
  ellipsoid: ([x, y, z]) => turned([...arc(1, 0, -Math.PI / 2), ...arc(1, 0, 0)]).map(([p]) => {
    const size = [x, y || x, z || x];
    return [p.map((v, i) => v * size[i]), unit(p.map((v, i) => v / size[i]))];
  }),
  plane: ([x, y]) => {
    const [a, b] = [x || 4 * data.extent, y || 4 * data.extent];
    return flat([[-a, -b, 0], [a, -b, 0], [a, b, 0], [-a, b, 0]], [0, 0, 1]);
  },
  mesh: (_, { mesh }) => {
    const { low, size, grid, faces } = data.meshes[mesh], g = new Uint16Array(bytes(grid)), out = [];
    const f = new Uint32Array(bytes(faces)), corner = (k) => low.map((v, i) => v + size * g[3 * k + i]);
    for (let i = 0; i < f.length; i += 3) {
      const [a, b, c] = [corner(f[i]), corner(f[i + 1]), corner(f[i + 2])];
      const normal = unit(cross(minus(b, a), minus(c, a)));
      out.push([a, normal], [b, normal], [c, normal]);
    }
    return out;
  },
};

// WebGL: one buffer for what moves together.
const canvas = at("scene");
const gl = canvas.getContext("webgl", { antialias: true, preserveDrawingBuffer: true });
if (!gl) at("failed").hidden = false;
const program = gl && linked(at("vertex").textContent, at("fragment").textContent);
const place = (name) => gl.getUniformLocation(program, name);
const buffers = gl ? data.links.map((_, link) => buffer(data.geoms.filter((g) => g.link === link))) : [];
const ball = gl && buffer([{ shape: "ellipsoid", size: [0.012 * data.extent], at: [0, 0, 0],
  turned: [1, 0, 0, 0, 1, 0, 0, 0, 1], rgb: [1, 1, 1] }]);

function linked(...sources) {
  const made = gl.createProgram();
  sources.forEach((source, i) => {
    const shader = gl.createShader(i ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  });
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  return made;
}

function buffer(geoms) {
  const numbers = [];
  for (const geom of geoms) {
    const t = geom.turned, m = [t[0], t[3], t[6], 0, t[1], t[4], t[7], 0, t[2], t[5], t[8], 0, ...geom.at, 1];
    for (const [p, n] of shapes[geom.shape](geom.size, geom)) numbers.push(...moved(m, p), ...moved(m, n, 0), ...geom.rgb);
  }
  const made = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, made);
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers), gl.STATIC_DRAW);
  return { made, count: numbers.length / 9 };
}

function drawBuffer({ made, count }, model, tint) {
  if (!count) return;
  gl.bindBuffer(gl.ARRAY_BUFFER, made);
  ["place", "normal", "colour"].forEach((name, i) => {
    const where = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(where);
    gl.vertexAttribPointer(where, 3, gl.FLOAT, false, 36, 12 * i);
  });
  gl.uniformMatrix4fv(place("model"), false, model);
  gl.uniform4fv(place("tint"), tint);
  gl.drawArrays(gl.TRIANGLES, 0, count);
}

// Camera: it goes around a point.
const camera = {};
function home() {
  const away = minus(data.eye, data.centre), far = 1.12 * Math.hypot(...away);
  Object.assign(camera, { centre: [...data.centre], far, turn: Math.atan2(away[1], away[0]), rise: Math.atan2(away[2], Math.hypot(away[0], away[1])) });
}
function eyes() {
  const { turn, rise, far, centre } = camera;
  const back = [Math.cos(rise) * Math.cos(turn), Math.cos(rise) * Math.sin(turn), Math.sin(rise)];
  const right = [-Math.sin(turn), Math.cos(turn), 0], up = cross(back, right);
  return { back, right, up, eye: centre.map((v, i) => v + far * back[i]) };
}
function projection() {
  const { back, right, up, eye } = eyes(), wide = canvas.width / canvas.height;
  // A narrow page sees as much from side to side as a square one.
  const f = Math.min(1, wide) / Math.tan((data.fovy * Math.PI) / 360), near = 0.02 * camera.far, end = 20 * data.extent + camera.far;
  const rows = [right, up, back], look = [0, 1, 2].flatMap((i) => [...rows.map((r) => r[i]), 0]);
  const view = [...look, ...rows.map((r) => -dot(r, eye)), 1];
  return times([f / wide, 0, 0, 0, 0, f, 0, 0, 0, 0, (end + near) / (near - end), -1, 0, 0, (2 * end * near) / (near - end), 0], view);
}

// What is shown now.
const state = { time: 0, playing: false, speed: data.speed, gain: data.gain, ghost: true, from: 0, to: duration, chosen: [] };
const frame = () => Math.min(Math.round(state.time * data.rate), data.frames - 1);
const standing = {
  measured: (axis) => axis.measured[frame()],
  modelled: (axis) => axis.measured[frame()] + state.gain * (axis.modelled[frame()] || 0),
  setpoint: (axis) => axis.measured[frame()] + state.gain * (axis.setpoint[frame()] || 0),
};

function drawScene() {
  if (!gl) return;
  fit(canvas);
  gl.viewport(0, 0, canvas.width, canvas.height);
  gl.clearColor(0.80, 0.83, 0.86, 1);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.enable(gl.DEPTH_TEST);
  gl.depthFunc(gl.LEQUAL);
  gl.useProgram(program);
  gl.uniformMatrix4fv(place("view"), false, projection());
  gl.uniform3fv(place("eye"), eyes().eye);
  gl.uniform3fv(place("centre"), data.centre);
  gl.uniform1f(place("extent"), data.extent);
  buffers.forEach((b, link) => drawBuffer(b, placed(link, standing.measured), [0, 0, 0, 0]));
  data.marks.forEach(({ axis, link, at }) => {
    const spot = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, ...at, 1];
    drawBuffer(ball, times(placed(link, standing.measured), spot), [0, 0, 0, 0]);
    if (Number.isFinite(data.axes[axis].setpoint[frame()])) drawBuffer(ball, times(placed(link, standing.setpoint), spot), MARK);
  });
  drawChosen();
  if (!state.ghost || !data.axes.some((axis) => Number.isFinite(axis.modelled[frame()]))) return;
  gl.enable(gl.POLYGON_OFFSET_FILL); // where the ghost is where the machine is, the machine is seen
  gl.polygonOffset(1, 1);
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  for (const seen of [false, true]) { // its depth first, so that only its surface is seen
    gl.colorMask(seen, seen, seen, seen);
    buffers.forEach((b, link) => {
      if (data.links[link].length) drawBuffer(b, placed(link, standing.modelled), GHOST);
    });
  }
  gl.disable(gl.BLEND);
  gl.disable(gl.POLYGON_OFFSET_FILL);
}

/** Where the machine was at the instants that are marked on the page of the comparison. */
function drawChosen() {
  const most = 200, frames = state.chosen.flatMap(([from, to]) => {
    const [first, last] = [from, to].map((t) => Math.min(Math.max(Math.round(t * data.rate), 0), data.frames - 1));
    return [...Array(last - first + 1)].map((_, i) => first + i);
  });
  const every = Math.ceil(frames.length / most) || 1, sites = data.marks.length ? data.marks : [{ link: data.links.length - 1, at: [0, 0, 0] }];
  for (let i = 0; i < frames.length; i += every)
    for (const { link, at } of sites) {
      const spot = [0.6, 0, 0, 0, 0, 0.6, 0, 0, 0, 0, 0.6, 0, ...at, 1];
      drawBuffer(ball, times(placed(link, (axis) => axis.measured[frames[i]]), spot), CHOSEN);
    }
}

function fit(target) {
  const dense = window.devicePixelRatio || 1;
  const [w, h] = [target.clientWidth, target.clientHeight].map((v) => Math.max(Math.round(v * dense), 1));
  if (target.width !== w || target.height !== h) Object.assign(target, { width: w, height: h });
  return dense;
}

// Strips: the whole range of each signal within a column of pixels.
const chart = at("chart"), TALL = 76;
chart.style.height = `${TALL * strips.length + 20}px`;
function drawChart() {
  const dense = fit(chart), g = chart.getContext("2d"), wide = chart.width;
  g.clearRect(0, 0, wide, chart.height);
  const column = (t) => ((t - state.from) / (state.to - state.from)) * wide;
  g.font = `${12 * dense}px system-ui, sans-serif`;
  g.fillStyle = "rgba(194,24,91,.30)";
  for (const [from, to] of state.chosen) g.fillRect(column(from) - dense, 0, column(to) - column(from) + 2 * dense, chart.height - 18 * dense);
  strips.forEach((strip, i) => {
    const top = i * TALL * dense, tall = (TALL - 26) * dense, base = top + 20 * dense;
    const first = Math.max(Math.floor(state.from * data.rate), 0), last = Math.min(Math.ceil(state.to * data.rate), data.frames - 1);
    let most = 1e-300;
    for (let k = first; k <= last; k++) for (const v of [strip.low[k], strip.high[k]]) if (Math.abs(v) > most) most = Math.abs(v);
    const y = (v) => base + tall * (0.5 - (0.48 * v) / most);
    g.strokeStyle = "#dfe4e9"; g.lineWidth = dense;
    g.beginPath(); g.moveTo(0, y(0)); g.lineTo(wide, y(0)); g.stroke();
    g.strokeStyle = i % 2 ? "#2f6db3" : "#b4541a";
    g.beginPath();
    for (let k = first; k <= last; k++) {
      const x = column(k / data.rate);
      if (Number.isFinite(strip.low[k])) { g.moveTo(x, y(strip.low[k]) + dense / 2); g.lineTo(x, y(strip.high[k]) - dense / 2); }
      if (k < last && Number.isFinite(strip.high[k] + strip.low[k + 1])) { g.moveTo(x, y(strip.high[k])); g.lineTo(column((k + 1) / data.rate), y(strip.low[k + 1])); }
    }
    g.stroke();
    const now = [strip.low[frame()], strip.high[frame()]].map((v) => quantity(v, strip.unit));
    g.fillStyle = "#1b2a38";
    g.fillText(`${strip.axis}: ${strip.label}, here ${now[0]} to ${now[1]}`, 2 * dense, top + 13 * dense);
    g.textAlign = "right"; g.fillStyle = "#5b6875";
    g.fillText(`±${quantity(most, strip.unit)}`, wide - 2 * dense, top + 13 * dense);
    g.textAlign = "left";
  });
  g.fillStyle = "#5b6875";
  g.fillText(`${(data.start + state.from).toFixed(2)} s`, 2 * dense, chart.height - 5 * dense);
  g.textAlign = "right";
  g.fillText(`${(data.start + state.to).toFixed(2)} s`, wide - 2 * dense, chart.height - 5 * dense);
  g.textAlign = "left"; g.fillStyle = "#1b2a38";
  g.fillRect(column(state.time) - dense / 2, 0, 1.5 * dense, chart.height - 18 * dense);
}

// The panel beside the scene.
const html = (text) => text.replace(/[&<>]/g, (c) => `&#${c.charCodeAt(0)};`).replaceAll("_", "_<wbr>");
for (const axis of data.axes) {
  const bars = axis.forces.map((f) => `<dt>${html(f.name)}</dt><dd><i></i></dd><dd></dd>`).join("");
  const part = document.createElement("section");
  part.innerHTML = `<h2>Axis ${html(axis.name)}</h2><table><tbody><tr><th>measured<td><tr><th class="mark">setpoint - measured<td><tr${data.horizon ? "" : " hidden"}><th class="ghost">model - measured<td></table>` +
    (bars && `<h3>${axis.bars}</h3><dl>${bars}</dl>`);
  at("panel").append(part);
  axis.cells = part.querySelectorAll("td");
  axis.bars = [...part.querySelectorAll("i")].map((bar) => [bar, bar.parentNode.nextSibling]);
}
function drawPanel() {
  for (const axis of data.axes) {
    const k = frame(), far = (v) => (Number.isFinite(v) ? `${v < 0 ? "" : "+"}${quantity(v, axis.unit)}` : "–");
    const [step, prefix] = axis.large ? [1, ""] : [1e-3, "m"];
    axis.cells[0].textContent = `${(axis.measured[k] / step).toFixed(3).replace(/^-(0\.0+)$/, "$1").replace("-", "−")} ${prefix}${axis.unit}`;
    axis.cells[1].textContent = far(axis.setpoint[k]);
    axis.cells[2].textContent = far(axis.modelled[k]);
    axis.forces.forEach((force, i) => {
      const v = force.values[k], [bar, text] = axis.bars[i], long = (50 * Math.abs(v)) / axis.mostForce;
      bar.style.cssText = `width:${long}%;left:${v < 0 ? 50 - long : 50}%`;
      text.textContent = quantity(v, axis.force);
    });
  }
  at("time").textContent = `${(data.start + state.time).toFixed(2)} s`;
  at("scrub").value = state.time / duration;
  at("play").textContent = state.playing ? "Pause" : "Play";
}

function draw() { drawScene(); drawChart(); drawPanel(); }
function seek(time) { state.time = Math.min(Math.max(time, 0), duration); draw(); }
let before = null;
function tick(now) {
  if (!state.playing) { before = null; return; }
  seek(state.time + (before === null ? 0 : ((now - before) / 1000) * state.speed));
  before = now;
  if (state.time >= duration) play(false);
  else requestAnimationFrame(tick);
}
function play(on) {
  if (on && state.time >= duration) state.time = 0;
  state.playing = on;
  if (on) requestAnimationFrame(tick);
  draw();
}

// Controls.
at("play").onclick = () => play(!state.playing);
at("scrub").oninput = (e) => seek(e.target.value * duration);
at("ghost").onchange = (e) => { state.ghost = e.target.checked; draw(); };
function choices(id, numbers, name, words) {
  const all = [...new Set([...numbers, data[name]])].sort((a, b) => a - b);
  at(id).append(...all.map((n) => new Option(words(n), n, false, n === data[name])));
  at(id).onchange = (e) => { state[name] = Number(e.target.value); draw(); };
}
choices("speed", [0.1, 0.25, 0.5, 1, 2, 5, 10], "speed", (n) => `${n} ×`);
choices("gain", [1, 10, 100, 1e3, 1e4, 1e5], "gain", (n) => (n === 1 ? "true size" : `${n.toLocaleString("en")} ×`));
at("home").onclick = () => { home(); [state.from, state.to] = [0, duration]; draw(); };
addEventListener("keydown", (e) => {
  if (["SELECT", "INPUT", "BUTTON"].includes(e.target.tagName) && e.key === " ") return;
  const step = { ArrowLeft: -1, ArrowRight: 1 }[e.key];
  if (e.key === " ") play(!state.playing);
  else if (step && e.target.tagName !== "SELECT") seek(state.time + (step * (e.shiftKey ? 60 : 1)) / data.rate);
  else return;
  e.preventDefault();
});
function dragged(target, begin, go) {
  target.onpointerdown = (e) => { target.setPointerCapture(e.pointerId); begin(e); };
  target.onpointermove = (e) => { if (target.hasPointerCapture(e.pointerId)) go(e); };
}
dragged(canvas, () => {}, (e) => {
  const { right, up } = eyes(), step = camera.far / 900;
  if (e.shiftKey || e.buttons === 2) camera.centre = camera.centre.map((v, i) => v + step * (up[i] * e.movementY - right[i] * e.movementX));
  else {
    camera.turn -= e.movementX / 200;
    camera.rise = Math.min(Math.max(camera.rise + e.movementY / 200, -1.55), 1.55);
  }
  drawScene();
});
canvas.oncontextmenu = (e) => e.preventDefault();
canvas.addEventListener("wheel", (e) => { e.preventDefault(); camera.far *= Math.exp(e.deltaY / 900); drawScene(); }, { passive: false });
const instant = (e) => state.from + (e.offsetX / chart.clientWidth) * (state.to - state.from);
dragged(chart, (e) => seek(instant(e)), (e) => seek(instant(e)));
chart.addEventListener("wheel", (e) => { // zoom in time about the pointer
  e.preventDefault();
  const t = instant(e), by = Math.exp(e.deltaY / 500);
  state.from = Math.max(t + (state.from - t) * by, 0);
  state.to = Math.min(Math.max(t + (state.to - t) * by, state.from + 4 / data.rate), duration);
  draw();
}, { passive: false });
addEventListener("resize", draw);
const stem = (name) => name.replace(/^.*\//, "").replace(/\.mcap$/, "");
addEventListener("message", (e) => { // what is marked on the page of a comparison, in `twin app`
  if (e.source !== parent || e.data?.twin !== "marked") return;
  const own = e.data.spans.filter((s) => stem(s.log) === stem(data.log)).map((s) => [s.from - data.start, s.to - data.start]);
  state.chosen = own.filter(([from, to]) => to >= 0 && from <= duration);
  if (state.chosen.length) seek(state.chosen[0][0]);
  else draw();
});
home();
draw();
