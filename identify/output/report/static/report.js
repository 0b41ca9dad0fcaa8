/* The plots of a report. Data are in the page: "signals" (of each axis, explored here) and the
   charts' own specifications. Time plots share one range, of which the other plots show the part. */
"use strict";
(() => {
const INK = "#1b2a38", SOFT = "#5b6875", GRID = "#e3e8ed", FLOOR = "rgba(120,135,150,.22)";
const BEFORE = "#2f6db3", AFTER = "#b4530f", MEASURED = "#7b8794", MARK = "#c2185b";
const COLORS = ["#2e7d32", "#8e24aa", "#00838f", "#c2185b", "#8a5a00", "#3949ab", "#5d4037", "#00695c"];
const RAMP = ["#e6edf4", "#b5d0e8", "#7fb0d8", "#4a8ac2", "#2660a0", "#123a70", "#071a3a"];
const $ = id => document.getElementById(id);
const data = JSON.parse($("signals")?.textContent || "[]");
const digits = v => v == null ? "–" : String(+v.toPrecision(4)).replace("-", "−");
const withUnit = unit => (u, v) => v == null ? "–" : `${digits(v)} ${unit}`;
const label = s => `${s.label} (${s.unit || "1"})`;
const extent = values => {
  let low = Infinity, high = -Infinity;
  for (const v of values) if (v != null) { if (v < low) low = v; if (v > high) high = v; }
  return low > high ? [0, 1] : [low, high];
};
// A few spikes would leave nothing to be seen of all else: then the range is three times that of 90 % of the values.
const usual = values => {
  const known = values.filter(v => v != null), every = Math.ceil(known.length / 20000);
  if (!known.length) return [0, 1];
  const sorted = Float64Array.from(known.filter((v, i) => i % every === 0)).sort(), at = p => sorted[Math.round(p * (sorted.length - 1))];
  const [first, last] = extent(known), [low, high] = [0.05, 0.95].map(at), width = high - low;
  return width > 0 && last - first > 5 * width ? [Math.max(first, low - width), Math.min(last, high + width)] : [first, last];
};
const within = (v, [low, high]) => v >= low && v <= high;
const padded = (low, high) => {
  const more = 0.05 * (high - low) || Math.abs(low) || 1;
  return [low - more, high + more];
};

// --- plots of any kind ---------------------------------------------------------------------

function plot(place, options, values) {
  place.replaceChildren();
  const axis = (name, more) => ({label: name, stroke: INK, grid: {stroke: GRID, width: 1},
    ticks: {stroke: GRID}, font: "12px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif",
    labelSize: 20, ...more});
  const dense = values[0].length > 8000;  // then of each pixel the least and the most are drawn
  const u = new uPlot({
    width: Math.max(place.clientWidth, 200), pxAlign: dense, ...options, series: [options.x, ...options.series],
    scales: {x: {time: false}, ...options.scales},
    hooks: {...options.hooks, draw: [...options.hooks?.draw ?? [], u => u.repaint?.()]},
    axes: [axis(options.labels[0], {size: 32, ...(options.labels[0] ? {} : {label: null}), ...(options.days ? {values: options.days} : {})}), axis(options.labels[1], {size: 62, ...(options.scales?.y?.distr ? {values: (u, at) => at.map(v => v == null ? "" : digits(v))} : {})})],
  }, values, place);
  if (!place.watch) {
    place.watch = new ResizeObserver(() => place.shown.setSize({width: Math.max(place.clientWidth, 200), height: place.shown.height}));
    place.watch.observe(place);
  }
  place.shown = u;
  if (options.marks) {  // on a sheet above, as the plot below stays while they change
    u.sheet = u.ctx.canvas.cloneNode();
    u.ctx.canvas.after(u.sheet);
    u.marks = u.sheet.getContext("2d");
    u.repaint = () => {
      u.sheet.width = u.ctx.canvas.width, u.sheet.height = u.ctx.canvas.height;
      u.sheet.style.cssText = `${u.ctx.canvas.style.cssText}; position: absolute; left: 0; top: 0; pointer-events: none`;
      options.marks(u, u.marks);
    };
  }
  return u;
}
// Dots of a plot, at most so many on a pixel that more would show no more.
function dots(u, ctx, x, y, indices, size, most = 4) {
  const {left: l, top: t, width: w, height: h} = u.bbox, {min: x0, max: x1} = u.scales.x, {min: y0, max: y1} = u.scales.y;
  const [sx, sy] = [w / (x1 - x0), h / (y1 - y0)], taken = new Uint8Array((Math.ceil(w) + 1) * (Math.ceil(h) + 1)), row = Math.ceil(w) + 1;
  for (const i of indices) {
    if (x[i] == null || y[i] == null) continue;
    const px = (x[i] - x0) * sx, py = (y1 - y[i]) * sy;
    if (!(px >= 0 && px <= w && py >= 0 && py <= h) || taken[Math.floor(py) * row + Math.floor(px)]++ >= most) continue;
    ctx.fillRect(l + px - size / 2, t + py - size / 2, size, size);
  }
}
function* between(a, b) { for (let i = a; i < b; i++) yield i; }
const line = (name, color, unit, more) => ({label: name, stroke: color, width: 1.25,
  points: {show: false}, value: withUnit(unit), ...more});

function rectangle(u, left, right, low, high, color, ctx = u.ctx) {
  const [x0, x1] = [left, right].map(v => v == null ? null : u.valToPos(v, "x", true));
  const {left: l, top: t, width: w, height: h} = u.bbox;
  const [y0, y1] = [low, high].map((v, i) => v == null ? t + (1 - i) * h : u.valToPos(v, "y", true));
  const a = Math.max(x0 ?? l, l), b = Math.min(x1 ?? l + w, l + w);
  const c = Math.max(y1, t), d = Math.min(y0, t + h);
  ctx.fillStyle = color;
  if (b > a && d > c) ctx.fillRect(a, c, b - a, d - c);
}

// --- signals of an axis --------------------------------------------------------------------

class Axis {
  constructor(given) {
    Object.assign(this, given);
    this.decoded = new Map();
    const gaps = this.integers(given.index), x = this.x = [], regular = this.regular = [];
    let at = 0, index = 0, start = 0;
    for (const log of this.logs) {
      log.begin = start;
      for (let i = 0; i < log.count; i++) {
        index += gaps[at++];
        x.push(start + log.start + (index - log.first) * log.step);
        regular.push(index % this.every === 0);
      }
      start = log.end = x[x.length - 1] + log.step;
      x.push(start), regular.push(false);
    }
  }
  integers(text) { return new Int16Array(Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer); }
  of(name) { return this.signals.find(s => s.name === name); }
  values(name) {  // in the printed unit; null where unknown, and between logs
    if (!this.decoded.has(name)) {
      const s = this.of(name), q = this.integers(s.data), out = [];
      let at = 0;
      for (const log of this.logs) {
        for (let i = 0; i < log.count; i++, at++)
          out.push(q[at] === -32768 ? null : (s.middle + s.scale * Math.sinh(q[at] * s.step)) / s.size);
        out.push(null);
      }
      this.decoded.set(name, out);
    }
    return this.decoded.get(name);
  }
  logAt(x) { return this.logs.find(log => x < log.end) || this.logs[this.logs.length - 1]; }
}

if (data.length) {
  let axis, plots = [], range = null, waiting = false, busy = false;
  let marked = null;  // 1 for each of the axis' test functions that is marked; null where none is
  const axes = data.map(given => new Axis(given));
  const choices = (id, pairs, chosen) => {
    const select = $(id);
    select.replaceChildren(...pairs.map(([value, text]) => new Option(text, value, false, value === chosen)));
    select.closest("label").hidden = pairs.length < 2;
  };
  const names = list => list.map(name => [name, axis.of(name).label]);
  const series = () => [  // force plot: name, label, color
    ["to_explain", MEASURED, 3], ["model_before", BEFORE, 1.5],
    ...(axis.of("after") ? [["model_after", AFTER, 1.5]] : []),
    ...axis.effects.map((name, i) => [name, COLORS[i % COLORS.length], 1.5]),
  ];
  const difference = (a, b) => a.map((v, i) => v == null || b[i] == null ? null : v - b[i]);
  function shown(name) {  // what the model makes is what is to be explained less what is left
    if (!name.startsWith("model_")) return axis.values(name);
    const left = axis.of(name.slice(6)), to = axis.of("to_explain"), factor = left.size / to.size;
    return difference(axis.values("to_explain"), axis.values(left.name).map(v => v == null ? null : v * factor));
  }
  const title = name => name.startsWith("model_") ? axis.texts[name] : axis.of(name).label;

  function choose(name) {
    axis = axes.find(a => a.name === name);
    range = marked = null;
    told();
    choices("axis", axes.map(a => [a.name, a.name]), name);
    choices("show", [["residual", axis.texts.residual], ["force", axis.texts.force], ...names(axis.effects)], "residual");
    choices("against", [["time", "Time"], ...names(axis.coordinates)], axis.against);
    choices("log", [["", "all logs"], ...axis.logs.map((log, i) => [String(i), log.title])], "");
    const second = axis.coordinates.find(c => c !== axis.against && c === (axis.against === "velocity" ? "position" : "velocity"));
    choices("map-x", names(axis.coordinates), axis.against === "time" ? "position" : axis.against);
    choices("map-y", names(axis.coordinates), second || axis.coordinates[0]);
    choices("map-of", names(axis.residuals), axis.residuals[0]);
    toggles();
    times();
    follow();
  }

  function toggles() {
    $("toggles").replaceChildren(...series().map(([name, color], i) => {
      const box = document.createElement("input"), mark = document.createElement("i"), text = document.createElement("label");
      box.type = "checkbox", box.checked = i < series().length - axis.effects.length;
      mark.style.background = color;
      box.addEventListener("change", () => plots[0].setSeries(i + 1, {show: box.checked}));
      text.append(box, mark, title(name));
      return text;
    }));
  }

  function times() {
    plots = [];
    const to = axis.of("to_explain"), left = axis.of("before"), x = axis.x;
    const boxes = [...$("toggles").querySelectorAll("input")];
    const common = {
      x: {label: "Time", value: (u, v) => v == null ? "–" : `${digits(v - axis.logAt(v).begin)} s of ${axis.logAt(v).title}`},
      cursor: {sync: {key: "time", setSeries: false}, drag: {x: true, y: false, setScale: !$("mark").checked}, points: {size: 6}},
      marks: stripes,
    };
    const hooks = {
      setSelect: [u => dragged(u, ([low, high]) => i => axis.x[i] >= low && axis.x[i] <= high)],
      setScale: [(u, key) => key === "x" && !busy && zoomed(u.scales.x.min, u.scales.x.max)],
      draw: [u => axis.logs.slice(1).forEach(log => {
        const at = u.valToPos(log.begin, "x", true);
        if (at < u.bbox.left || at > u.bbox.left + u.bbox.width) return;
        u.ctx.fillStyle = SOFT, u.ctx.fillRect(at, u.bbox.top, 1, u.bbox.height);
      })],
    };
    plots.push(plot($("forces"), {...common, hooks, height: 260, labels: ["", `${axis.texts.force} (${to.unit})`],
      series: series().map(([name, color, width], i) => line(title(name), color, to.unit, {width, show: boxes[i].checked}))},
      [x, ...series().map(([name]) => shown(name))]));
    const band = {drawClear: [u => rectangle(u, null, null, -axis.floor, axis.floor, FLOOR)]};
    const [least, most] = usual(axis.residuals.flatMap(name => axis.values(name)));
    plots.push(plot($("left"), {...common, hooks: {...hooks, ...band}, height: 230, labels: ["", `${axis.texts.residual} (${left.unit})`],
      scales: {y: {range: (u, low, high) => {
        const view = u.scales.x, all = view.min == null || view.min <= x[0] && view.max >= x[x.length - 1];
        return padded(Math.min(Math.max(low ?? 0, all ? least : -Infinity), -axis.floor), Math.max(Math.min(high ?? 0, all ? most : Infinity), axis.floor));
      }}},
      series: axis.residuals.map((name, i) => line(title(name), [BEFORE, AFTER][i], left.unit))},
      [x, ...axis.residuals.map(name => axis.values(name))]));
    motion(common, hooks);
  }
  function motion(common, hooks) {
    const against = $("against").value;  // a phase turns too often to be read over time
    const name = against === "time" || against.endsWith("_phase") ? "position" : against, s = axis.of(name);
    plots[2] = plot($("motion"), {...common, hooks, height: 240, labels: ["Time (s), log after log", label(s)],
      series: [line(s.label, INK, s.unit)]}, [axis.x, axis.values(name)]);
    plots[2].again = () => motion(common, hooks);
  }

  // --- test functions marked in one plot, and so in all -------------------------------------

  function dragged(u, of) {  // of: ranges of x and y -> index -> whether it is in them
    const {left, top, width, height} = u.select;
    if (!$("mark").checked || busy || !(width > 0)) return;
    const tall = height > 0 && height < u.over.clientHeight;
    const along = [u.posToVal(left, "x"), u.posToVal(left + width, "x")];
    const across = tall ? [u.posToVal(top + height, "y"), u.posToVal(top, "y")] : [-Infinity, Infinity];
    u.setSelect({left: 0, top: 0, width: 0, height: 0}, false);
    mark(of(along, across));
  }
  function mark(accepts) {
    const [a, b] = part(), left = axis.values("before");
    marked = new Uint8Array(axis.x.length);
    for (let i = a; i < b; i++) marked[i] = left[i] != null && accepts(i) ? 1 : 0;
    if (!marked.includes(1)) marked = null;
    told();
  }
  function largest() {  // the twentieth of the test functions in view that err most
    const [a, b] = part(), left = axis.values("before");
    const sizes = left.slice(a, b).filter(v => v != null).map(Math.abs).sort((u, v) => u - v);
    const least = sizes[Math.floor(0.95 * sizes.length)];
    mark(i => Math.abs(left[i]) >= least);
  }
  function told() {  // what is marked, in words and in every plot
    const left = axis.values("before"), sum = i => left[i] == null ? 0 : left[i] * left[i];
    let count = 0, all = 0, error = 0, whole = 0, first = null, last = null;
    for (let i = 0; i < left.length; i++) {
      if (left[i] == null) continue;
      all++, whole += sum(i);
      if (marked?.[i]) count++, error += sum(i), first ??= axis.x[i], last = axis.x[i];
    }
    const at = v => `${digits(v - axis.logAt(v).begin)} s of ${axis.logAt(v).title}`;
    $("mark-none").disabled = !count;
    $("mark-note").textContent = count ? `Marked in all plots: ${count} test functions, ${digits(100 * count / all)} % of all, with `
      + `${digits(100 * error / whole)} % of the squared ${title("before")}, from ${at(first)} to ${at(last)}.` : "";
    for (const place of [$("forces"), $("left"), $("motion"), $("coordinate"), $("map-plot")]) place.shown?.repaint();
    if (parent !== window) parent.postMessage({twin: "marked", spans: [...spans()]}, "*");  // to the replay beside it
  }
  function* spans() {  // of each log, from which second to which
    for (let i = 0; marked && i < axis.x.length; i++) {
      if (!marked[i]) continue;
      const first = i, log = axis.logAt(axis.x[i]);
      while (marked[i + 1]) i++;
      yield {log: log.name, from: axis.x[first] - log.begin - log.step / 2, to: axis.x[i] - log.begin + log.step / 2};
    }
  }
  function* those(a, b) { for (let i = a; marked && i < b; i++) if (marked[i]) yield i; }
  function stripes(u, ctx) {
    if (!marked) return;
    const x = axis.x, [low, high] = [u.scales.x.min, u.scales.x.max], least = (high - low) / u.bbox.width;
    for (let i = 0; i < x.length; i++) {
      if (!marked[i] || x[i] > high) continue;
      const first = i;
      while (marked[i + 1]) i++;
      if (x[i] >= low) rectangle(u, x[first] - least, x[i] + least, null, null, "rgba(194,24,91,.30)", ctx);
    }
  }

  function zoomed(low, high) {
    const all = [axis.x[0], axis.x[axis.x.length - 1]];
    if (low == null || low === range?.[0] && high === range?.[1]) return;
    range = [Math.max(low, all[0]), Math.min(high, all[1])];
    if (range[0] === all[0] && range[1] === all[1]) $("log").value = "";
    busy = true;
    for (const u of plots) u.batch(() => u.setScale("x", {min: range[0], max: range[1]}));
    busy = false;
    follow();
  }
  function zoom(what) {
    const [first, last] = [axis.x[0], axis.x[axis.x.length - 1]], [a, b] = range || [first, last];
    const width = (b - a) * ({in: 0.5, out: 2}[what] || 1), shift = {left: -0.5, right: 0.5}[what] || 0;
    const centre = Math.min(Math.max((a + b) / 2 + shift * width, first + width / 2), last - width / 2);
    if (what === "all" || width >= last - first) zoomed(first, last);
    else zoomed(centre - width / 2, centre + width / 2);
  }
  function follow() {  // the plots that show the part in time that is in view, once a frame
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; coordinate(); map(); });
  }
  function part() {  // indices in view, and a sentence about them
    const x = axis.x, [low, high] = range || [x[0], x[x.length - 1]];
    let a = x.findIndex(v => v >= low), b = x.length;
    while (b > a && x[b - 1] > high) b--;
    const whole = a === 0 && b === x.length;
    const logs = [...new Set([low, high].map(v => axis.logAt(v).title))].join(" to ");
    return [Math.max(a, 0), b, whole ? "all logs" : `the ${digits(high - low)} s in view, of ${logs}`];
  }

  // --- any signal against any coordinate ---------------------------------------------------

  function means(x, y, a, b, low, high, accepts) {
    const bins = Math.min(Math.max(Math.floor((b - a) / (25 * axis.every)), 20), 140);
    const sum = new Float64Array(bins), count = new Uint32Array(bins), width = (high - low) / bins || 1;
    for (let i = a; i < b; i++)
      if (axis.regular[i] && x[i] != null && y[i] != null && accepts(i)) {
        const k = Math.min(Math.floor((x[i] - low) / width), bins - 1);
        sum[k] += y[i], count[k]++;
      }
    const at = Array.from(sum, (_, k) => low + (k + 0.5) * width);
    return [at, Array.from(sum, (v, k) => count[k] >= 4 ? v / count[k] : null)];
  }

  function coordinate() {
    const what = $("show").value, against = $("against").value, [a, b, where] = part();
    const x = against === "time" ? axis.x : axis.values(against), along = against === "time" ? {label: "Time, log after log", unit: "s"} : axis.of(against);
    const group = what === "residual" ? axis.residuals.map((n, i) => [n, [BEFORE, AFTER][i]])
      : what === "force" ? series().slice(0, series().length - axis.effects.length) : series().filter(s => s[0] === what);
    const unit = axis.of(what === "residual" ? "before" : "to_explain").unit;
    const values_of = group.map(([name]) => shown(name)), speed = axis.values("velocity");
    const xs = x.slice(a, b), [low, high] = extent(xs), every = values_of.flatMap(d => d.slice(a, b)), reach = usual(every), ends = extent(every);
    const floor = what === "residual" ? axis.floor : 0;
    const sides = $("apart").checked ? [["forwards", i => speed[i] > 0, []], ["backwards", i => speed[i] < 0, [6, 4]]] : [["", () => true, []]];
    const lines = [], values = [];
    let at;
    group.forEach(([name, color], g) => sides.forEach(([side, accepts, dash]) => {
      let mean;
      [at, mean] = means(x, values_of[g], a, b, low, high, accepts);
      values.push([null, ...mean, null]);
      lines.push(line(`mean ${title(name)}${side && ", " + side}`, color, unit, {width: 2.25, dash, spanGaps: false}));
    }));
    const middle = extent(values.flat()), bounds = padded(Math.min(reach[0], middle[0], -floor), Math.max(reach[1], middle[1], floor));
    const beyond = every.filter(v => v != null && (v < bounds[0] || v > bounds[1])).length;
    const u = plot($("coordinate"), {
      height: 390, labels: [label(along), `${what === "residual" ? axis.texts.residual : axis.texts.force} (${unit})`],
      x: {label: along.label, value: withUnit(along.unit)}, series: lines, cursor: {drag: {x: true, y: true, uni: 12, setScale: !$("mark").checked}},
      scales: {y: {range: () => bounds}},
      marks: (u, ctx) => {
        ctx.fillStyle = MARK, ctx.globalAlpha = 0.8;
        values_of.forEach(own => dots(u, ctx, x, own, those(a, b), b - a > 8000 ? 4 : 6, 1));
      },
      hooks: {setSelect: [u => dragged(u, (along, across) => i => within(x[i], along) && values_of.some(d => d[i] != null && within(d[i], across)))],
        drawClear: [u => {
        if (floor) rectangle(u, null, null, -floor, floor, FLOOR);
        const size = b - a > 8000 ? 2 : 3, ctx = u.ctx;
        group.forEach(([, color], g) => {
          ctx.fillStyle = color, ctx.globalAlpha = b - a > 8000 ? 0.25 : 0.4;
          dots(u, ctx, x, values_of[g], between(a, b), size);
        });
        ctx.globalAlpha = 1;
      }]},
    }, [[low, ...at, high === low ? low + 1 : high], ...values]);
    $("coordinate-note").textContent = `Dots: single test functions of ${where}; lines: their means. `
      + (floor ? `Grey: ${axis.texts.band}.` : "")
      + (beyond ? ` ${beyond} dots are beyond, from ${digits(ends[0])} to ${digits(ends[1])} ${unit}; over time, a part that is chosen shows its own.` : "")
      + (axis.every > 1 ? ` Of every ${axis.every} test functions one and the extremes are shown.` : "");
    return u;
  }

  // --- map of the error over two coordinates -----------------------------------------------

  function map() {
    const [nx, ny, of] = ["map-x", "map-y", "map-of"].map(id => $(id).value), [a, b, where] = part();
    const x = axis.values(nx), y = axis.values(ny), left = axis.values(of), unit = axis.of(of).unit;
    const [x0, x1] = extent(x.slice(a, b)), [y0, y1] = extent(y.slice(a, b)), columns = 48, rows = 28;
    const dx = (x1 - x0) / columns || 1, dy = (y1 - y0) / rows || 1;
    const square = new Float64Array(columns * rows), count = new Uint32Array(columns * rows);
    const cell = (u, v) => Math.min(Math.floor((v - y0) / dy), rows - 1) * columns + Math.min(Math.floor((u - x0) / dx), columns - 1);
    for (let i = a; i < b; i++)
      if (axis.regular[i] && x[i] != null && y[i] != null && left[i] != null) {
        const k = cell(x[i], y[i]);
        square[k] += left[i] * left[i], count[k]++;
      }
    const error = Array.from(square, (s, k) => count[k] ? Math.sqrt(s / count[k]) : null);
    const top = Math.max(extent(error)[1], axis.floor * 1.01), steps = RAMP.length - 1;
    const color = v => RAMP[v <= axis.floor ? 0 : Math.min(1 + Math.floor(steps * Math.log(v / axis.floor) / Math.log(top / axis.floor)), steps)];
    plot($("map-plot"), {
      height: 320, labels: [label(axis.of(nx)), label(axis.of(ny))], legend: {show: false},
      x: {}, series: [{stroke: "transparent"}], cursor: {drag: {x: true, y: true, uni: 12, setScale: !$("mark").checked}},
      scales: {y: {range: () => [y0, y0 + rows * dy]}},
      marks: (u, ctx) => {
        const cells = new Set();
        for (const i of those(a, b)) if (x[i] != null && y[i] != null) cells.add(cell(x[i], y[i]));
        ctx.strokeStyle = MARK, ctx.lineWidth = 2;
        for (const k of cells) {
          const [i, j] = [k % columns, Math.floor(k / columns)], px = v => u.valToPos(v, "x", true), py = v => u.valToPos(v, "y", true);
          ctx.strokeRect(px(x0 + i * dx), py(y0 + (j + 1) * dy), px(x0 + dx) - px(x0), py(y0) - py(y0 + dy));
        }
      },
      hooks: {
        draw: [u => error.forEach((v, k) => {
          const i = k % columns, j = Math.floor(k / columns);
          if (v != null) rectangle(u, x0 + i * dx, x0 + (i + 1) * dx, y0 + j * dy, y0 + (j + 1) * dy, color(v));
        })],
        setSelect: [u => dragged(u, (along, across) => i => x[i] != null && y[i] != null && within(x[i], along) && within(y[i], across))],
        setCursor: [u => {
          const at = [u.posToVal(u.cursor.left, "x"), u.posToVal(u.cursor.top, "y")], k = cell(...at);
          $("map-value").textContent = u.cursor.left >= 0 && count[k]
            ? `${axis.of(nx).label} ${digits(at[0])} ${axis.of(nx).unit}, ${axis.of(ny).label.toLowerCase()} ${digits(at[1])} ${axis.of(ny).unit}: ${digits(error[k])} ${unit} RMS, ${count[k]} test functions` : "Point at a cell to read it.";
        }],
      },
    }, [[x0, x0 + columns * dx], [null, null]]);
    $("map-scale").replaceChildren(...RAMP.map(c => Object.assign(document.createElement("i"), {style: `background:${c}`})));
    $("map-note").textContent = `RMS of ${where}: from the noise floor ${axis.texts.floor} and less (lightest) to ${digits(top)} ${unit} (darkest), in equal ratios.`;
  }

  const on = (id, job) => $(id).addEventListener("change", job);
  on("mark", () => {
    for (const place of [$("forces"), $("left"), $("motion"), $("coordinate"), $("map-plot")]) place.shown.cursor.drag.setScale = !$("mark").checked;
  });
  $("mark-largest").addEventListener("click", largest);
  $("mark-none").addEventListener("click", () => { marked = null; told(); });
  on("axis", () => choose($("axis").value));
  on("show", coordinate), on("apart", coordinate);
  on("against", () => { plots[2].again(); if (range) plots[2].setScale("x", {min: range[0], max: range[1]}); coordinate(); });
  ["map-x", "map-y", "map-of"].forEach(id => on(id, map));
  on("log", () => { const log = axis.logs[$("log").value], kept = $("log").value; log ? zoomed(log.begin, log.end) : zoom("all"); $("log").value = kept; });
  document.querySelectorAll("[data-zoom]").forEach(button => button.addEventListener("click", () => zoom(button.dataset.zoom)));
  $("time").addEventListener("keydown", event => {
    const what = {ArrowLeft: "left", ArrowRight: "right", "+": "in", "=": "in", "-": "out", 0: "all", Escape: "all"}[event.key];
    if (what && !["SELECT", "INPUT"].includes(event.target.tagName)) { event.preventDefault(); zoom(what); }
  });
  choose(data[0].name);
}

// --- small charts --------------------------------------------------------------------------

for (const place of document.querySelectorAll("[data-chart]")) {
  const spec = JSON.parse(place.dataset.chart), kinds = {
    line: {}, dash: {dash: [7, 5]}, steps: {paths: uPlot.paths.stepped({align: 1, alignGaps: 1})},
    stems: {paths: uPlot.paths.bars({size: [0.15, 8, 2], align: 0}), fill: BEFORE},
  };
  const other = Object.fromEntries(spec.bands), upper = new Set(Object.values(other));  // of each lower edge its upper
  const edges = (u, v, of, i) => v == null ? "–" : `${digits(v)} to ${digits(u.data[other[of]][i])}`;
  const log = on => on ? {distr: 3} : {}, day = v => v == null ? "–" : new Date(v * 1e3).toISOString().slice(0, 10);
  plot(place, {
    height: 240, labels: [spec.x.label, spec.y.label], x: {label: spec.x.label, value: (u, v) => spec.x.dates ? day(v) : digits(v)},
    ...(spec.x.dates ? {days: (u, at) => at.map(v => day(v).slice(5))} : {}), tzDate: v => uPlot.tzDate(new Date(v * 1e3), "Etc/UTC"),
    scales: {x: {time: !!spec.x.dates, ...log(spec.x.log)}, y: log(spec.y.log)}, bands: spec.bands.map(b => ({series: b, fill: "rgba(47,109,179,.18)"})),
    series: spec.series.map((s, i) => line(s.label, {before: BEFORE, after: AFTER, ink: INK, soft: MEASURED}[s.color], "", {...kinds[s.kind],
      ...(s.kind === "band" ? {width: 0.5, class: upper.has(i + 1) ? "edge" : null, value: edges} : {width: 1.5})})),
    cursor: {drag: {x: true, y: false}},
  }, [spec.x.values, ...spec.series.map(s => s.values)]);
}

// --- commands to copy ----------------------------------------------------------------------

for (const button of document.querySelectorAll("[data-copy]"))
  button.addEventListener("click", async () => {
    const code = button.parentElement.querySelector("code");
    try { await navigator.clipboard.writeText(code.textContent); }
    catch { getSelection().selectAllChildren(code); document.execCommand("copy"); }
    button.textContent = "Copied";
  });
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach(d => { d.open = true; }));
})();
