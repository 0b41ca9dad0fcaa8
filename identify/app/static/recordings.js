// Recordings: files taken in, the table of their columns, what physics says, roles, faults, cuts.
import { finished, get, redraw, run, say, stateNow, upload } from "./app.js";
import { course, h, last, percent, put, region } from "./build.js";

const FIELDS = ["position", "velocity", "setpoint_position", "setpoint_velocity", "force", "current", "pressure",
  "pressure_2", "temperature"];
const UNITS = ["m", "mm", "um", "rad", "deg", "turn", "counts", "m/s", "mm/s", "rad/s", "deg/s", "rpm", "N", "N m", "A", "mA", "bar",
  "degC"];
const ROLES = ["training", "selection", "test"];
const proposals = {};  // by file: what is proposed, null while it is asked for, or an error

export const recordings = {
  id: "recordings", name: "Recordings", chosen: null, edits: {}, extra: {},
  build(section) {
    section.append(h("h2", {}, "Recordings"));
    this.drop = region(section);
    this.list = region(section);
    this.table = region(section);
    this.files = region(section);
    put(this.drop, 0, () => [dropZone()]);
  },
  update(state) {
    const jobs = state.jobs.filter(j => ["import", "check", "cut"].includes(j.words[0])).map(j => [j.number, j.state]);
    const open = state.files.filter(f => !f.taken).map(f => f.name);
    const check = last(state, "check");
    put(this.list, [state.recordings, check, proofs, signals, jobs], () => state.recordings.length ? listOf(state, check) : []);
    for (const r of state.recordings) { proofOf(state, r); signalsOf(r); }
    findingsOf(check);
    const there = state.files.find(f => f.name === this.chosen);
    if (!there || (there.taken && !this.again)) this.choose(open[0] ?? null, false);
    if (this.chosen && !(this.chosen in proposals)) propose(this.chosen);
    put(this.files, [open, this.chosen, jobs], () => open.length ? [
      h("h3", {}, "In the folder, not taken in yet"), h("div", { class: "row" }, ...open.map(name => h("button", {
        "aria-pressed": String(name === this.chosen), class: name === this.chosen ? "main" : "", onclick: () => this.choose(name),
      }, name)))] : []);
    put(this.table, [this.chosen, proposals[this.chosen] ?? null, this.edits, this.extra, open, jobs], () => this.chosen ? this.tableOf(state, open) : []);
  },
  /** again: whether it is a recording of which the map is to be changed. */
  choose(name, draw = true, again = false) {
    this.chosen = name;
    this.again = again;
    this.edits = {};
    this.extra = {};
    if (draw) redraw();
  },
  tableOf(state, open) {
    const found = proposals[this.chosen];
    if (!found) return [h("p", {}, `Reading ${this.chosen} ...`)];
    if (found.error) return [h("div", { class: "card warn" }, h("h3", {}, this.chosen), h("p", {}, found.error))];
    const rows = found.columns.map((c, k) => this.rowOf({ ...c, ...this.edits[c.column] }, k));
    const lacks = found.missing;
    const others = open.filter(n => n !== this.chosen && ending(n) === ending(this.chosen));
    const busy = state.jobs.some(j => j.words[0] === "import" && !j.ended);
    const first = h("button", { id: "import", class: others.length ? "" : "main", disabled: busy, onclick: () => this.take([this.chosen]) }, `Import ${this.chosen}`);
    const all = others.length ? h("button", { id: "import-all", class: "main", disabled: busy, onclick: () => this.take([this.chosen, ...others]) },
      `Import all ${others.length + 1} with this map`) : null;
    return [
      h("h3", {}, `${this.chosen}: what its columns are taken for`),
      h("div", { class: "scroll" }, h("table", {}, h("thead", {}, h("tr", {}, ...["Column", "Course", "Taken for", "Unit", "Sign", "How sure, and why"].map(t => h("th", { scope: "col" }, t)))),
        h("tbody", {}, ...rows))),
      h("datalist", { id: "units" }, ...UNITS.map(u => h("option", { value: u }))),
      lacks.length ? this.asking(found, lacks) : null,
      h("div", { class: "row" }, all, first, ending(this.chosen) === "mcap" ? h("button", { id: "take", disabled: busy,
        onclick: () => run("project", "take", ...[this.chosen, ...others].filter(n => ending(n) === "mcap")) },
      `Take ${others.length ? `all ${others.length + 1}` : "it"} in as ${others.length ? "they are" : "it is"}: logs of twin`) : null),
      h("p", { class: "soft" }, "Nothing is copied but what is imported; the files stay as they are."),
    ];
  },
  rowOf(c, k) {
    const change = given => { this.edits[c.column] = { ...this.edits[c.column], ...given }; redraw(); };
    return h("tr", {}, h("td", {}, c.column, h("div", { class: "soft" }, `${short(c.low)} to ${short(c.high)}`)),
      h("td", { class: "plot" }, course(c.course, c.column)),
      h("td", {}, h("select", { id: `field-${k}`, "aria-label": `what ${c.column} is`, onchange: e => change({ field: e.target.value || null }) },
        h("option", { value: "" }, "not used"), ...FIELDS.map(f => h("option", { value: f, selected: f === c.field }, f.replaceAll("_", " "))))),
      h("td", {}, c.field ? h("input", { id: `unit-${k}`, "aria-label": `unit of ${c.column}`, list: "units", value: c.unit ?? "", size: 7,
        onchange: e => change({ unit: e.target.value.trim() }) }) : ""),
      h("td", {}, c.field ? h("select", { id: `sign-${k}`, "aria-label": `sign of ${c.column}`, onchange: e => change({ sign: Number(e.target.value) }) },
        h("option", { value: 1 }, "+"), h("option", { value: -1, selected: c.sign === -1 }, "−")) : ""),
      h("td", {}, c.certainty ? h("b", { class: c.certainty === "sure" ? "good-text" : "warn-text" }, c.certainty) : null, c.assumed ? " (unit assumed)" : "",
        h("div", { class: "soft" }, this.edits[c.column] ? "as you say" : c.why)));
  },
  asking(found, lacks) {
    const used = found.columns.map(c => ({ ...c, ...this.edits[c.column] }));
    const axes = [...new Set(used.map(c => c.axis).filter(Boolean))];
    const asked = axes.flatMap(axis => {
      const own = used.filter(c => c.axis === axis && c.field);
      const counted = own.some(c => c.unit === "counts");
      const driven = own.some(c => c.field === "current") && !own.some(c => c.field === "force");
      return [
        ...(counted ? [["counts_per_turn", `Axis ${axis}: counts of the encoder for one turn`], ["counts_per_metre", "or for one metre"]] : []),
        ...(driven ? [["force_constant", `Axis ${axis}: force constant of the motor, N/A or N m/A`]] : []),
      ].map(([entry, label]) => this.field(`axes.${axis}.${entry}`, label));
    });
    return h("div", { class: "card warn" }, h("h3", {}, "What the file does not tell"),
      ...asked, h("details", {}, h("summary", {}, "In the words of the import"), h("ul", {}, ...lacks.map(l => h("li", {}, l)))));
  },
  field(entry, label) {
    return h("p", {}, h("label", { class: "field" }, label, h("input", { id: `f-${entry}`, inputmode: "decimal", size: 12,
      value: this.extra[entry] ?? "", onchange: e => { this.extra[entry] = e.target.value.trim(); } })));
  },
  entries() {
    const found = proposals[this.chosen], first = [], then = [];
    const axis = found.columns.find(c => c.axis)?.axis ?? "x";
    for (const c of found.columns) {
      const now = { ...c, ...this.edits[c.column] };
      if (!this.edits[c.column]) continue;
      const place = `axes.${c.axis ?? axis}`;
      if (c.field && now.field !== c.field) first.push(`${place}.${c.field}=`);
      if (!now.field) continue;
      if (now.field !== c.field) then.push(`${place}.${now.field}={column = ${JSON.stringify(c.column)}, unit = ${JSON.stringify(now.unit ?? "")}}`);
      else if (now.unit !== c.unit) then.push(`${place}.${now.field}.unit=${now.unit}`);
      if (now.sign === -1) then.push(`${place}.${now.field}.sign=-1`);
    }
    for (const [entry, value] of Object.entries(this.extra)) if (value) then.push(`${entry}=${value}`);
    return [...first, ...then];
  },
  async take(names) {
    const [first, ...rest] = names, sets = this.entries();
    const wanted = sets.length ? sets.flatMap(e => ["--set", e]) : ["--yes"];
    const old = this.again ? stateNow().recordings.find(r => r.sources.includes(first))?.map : null;
    if (!await finished("import", first, ...(old && sets.length ? ["--map", old] : []), ...wanted)) return;
    for (const file of Object.keys(signals)) delete signals[file];  // it may be another under its name
    this.choose(null);
    const made = (await get("/api/state")).recordings.find(r => r.sources.includes(first));
    for (const name of rest) if (made?.map) await run("import", name, "--map", made.map);
    await run("check");
  },
};

const ending = name => name.split(".").at(-1).toLowerCase();
const short = value => value === null ? "" : String(Number(Number(value).toPrecision(4)));

async function propose(name) {
  proposals[name] = null;
  try {
    const told = await get(`/api/proposal?file=${encodeURIComponent(name)}`);
    proposals[name] = told.columns ? told : { error: told.error ?? "nothing is proposed" };
  } catch (error) {
    proposals[name] = { error: error.message };
  }
  redraw();
}

function dropZone() {
  const input = h("input", { id: "files", type: "file", multiple: true, onchange: e => take([...e.target.files]).then(() => { e.target.value = ""; }) });
  const zone = h("div", { class: "drop" }, h("label", { for: "files" }, h("b", {}, "Drop recordings here"),
    " (CSV, MAT, TwinCAT, ROS 2, MCAP, Parquet, HDF5, TDMS), or a mechanism (MJCF, URDF). Three of different motions are best. "), input);
  return droppable(zone, data => take([...data.files]));
}

/** An element on which something is dropped; given: does something with it. */
function droppable(zone, given) {
  zone.ondragover = event => { event.preventDefault(); zone.classList.add("over"); };
  zone.ondragleave = () => zone.classList.remove("over");
  zone.ondrop = event => { event.preventDefault(); zone.classList.remove("over"); given(event.dataTransfer); };
  return zone;
}

async function take(files) {
  for (const file of files) {
    try {
      await upload(file);
    } catch (error) {
      say(error.message);
    }
  }
}

// --- what is taken in --------------------------------------------------------------------------------
const proofs = {}, faults = { file: null, logs: {} }, signals = {};  // signals: of the logs as they are
const DRAWN = ["position", "force", "current"];

function proofOf(state, recording) {
  if (recording.file in proofs) return;
  const made = state.answers.filter(a => a.command.split(" ")[1] === "import" && a.command.includes(recording.file)).at(-1);
  if (!made) return;
  proofs[recording.file] = {};
  get(`/api/answer?file=${encodeURIComponent(made.file)}`).then(a => { proofs[recording.file] = a; redraw(); }).catch(() => {});
}

function findingsOf(check) {
  if (!check || check.file === faults.file) return;
  faults.file = check.file;
  get(`/api/answer?file=${encodeURIComponent(check.file)}`).then(a => { faults.logs = a.logs ?? {}; proofs[check.file] = 1; redraw(); }).catch(() => {});
}

/** The recordings by what they are for, each to be dragged elsewhere; the table has the same for the keyboard. */
function rolesOf(state) {
  return h("div", { class: "roles" }, ...ROLES.map(role => {
    const own = state.recordings.filter(r => r.role === role);
    const zone = h("div", { id: `drop-${role}`, class: "role" }, h("b", {}, role),
      ...own.map(r => h("span", { class: "chip", draggable: "true", ondragstart: e => { e.dataTransfer.setData("text/plain", r.file); } }, r.sources[0] ?? r.file)));
    return droppable(zone, data => {
      const file = data.getData("text/plain");
      if (state.recordings.some(r => r.file === file && r.role !== role)) run("project", "role", file, "--to", role);
    });
  }));
}

function listOf(state, check) {
  return [state.recordings.length > 1 ? rolesOf(state) : null, h("div", { class: "scroll" }, h("table", { class: "taken" }, h("thead", {}, h("tr", {}, ...["Recording", "What it is for", "Course", "What physics says", "What the check says", ""].map(t => h("th", { scope: "col" }, t)))),
    h("tbody", {}, ...state.recordings.map((r, k) => h("tr", {},
      h("td", {}, h("b", {}, r.sources[0] ?? r.file), h("div", { class: "soft" }, r.sources.length ? r.file : "")),
      h("td", {}, h("select", { id: `role-${k}`, "aria-label": `role of ${r.file}`, onchange: e => run("project", "role", r.file, "--to", e.target.value) },
        ...ROLES.map(role => h("option", { value: role, selected: role === r.role }, role)))),
      h("td", { class: "plot" }, ...coursesOf(r)), h("td", {}, ...physicsOf(r)), h("td", {}, ...checkOf(r, check)),
      h("td", {}, h("div", { class: "row" }, r.sources.length === 1 ? h("button", { "aria-label": `Change the map of ${r.sources[0]}`,
        onclick: () => recordings.choose(r.sources[0], true, true) }, "Map") : null,
      h("button", { "aria-label": `Leave ${r.file} out`, onclick: () => run("project", "leave", r.file) }, "Leave out")))))))),
  h("p", { class: "soft" }, "Training recordings are fitted, selection recordings choose the effects, and test recordings decide nothing: they tell the error."),
  h("div", { class: "row" }, h("button", { id: "check", onclick: () => run("check") }, "Check them"),
    h("a", { class: "next", href: state.models.length ? "#diagnose" : "#model" }, state.models.length ? "Diagnose" : "Next: a first model"))];
}

function physicsOf(recording) {
  const found = proofs[recording.file]?.proofs ?? {};
  return Object.entries(found).map(([axis, p]) => h("div", {}, h("div", {}, `axis ${axis}: force explained to `, h("b", {}, percent(Math.max(p.explained ?? 0, 0)))),
    p.mass !== null && p.mass !== undefined ? h("div", { class: "soft" }, `moved ${short(p.mass)} ${p.mass_unit}`) : null,
    h("div", { class: "soft" }, p.both_ways === false ? "moves one way only, which tells no sign" :
      `with the sign reversed it would be ${percent(Math.max(p.explained_reversed ?? 0, 0))}`),
    (p.explained_reversed ?? 0) > (p.explained ?? 0) ? h("b", { class: "warn-text" }, "The sign is wrong: reverse force or position.") : null));
}

function checkOf(recording, check) {
  const found = faults.logs[recording.file];
  if (!check || !found) return [h("span", { class: "soft" }, "not checked")];
  if (!found.length) return [h("span", { class: "good-text" }, "fit for identification")];
  return found.map(f => h("details", {}, h("summary", { class: f.severity === "error" ? "warn-text" : "" }, `${f.severity}: ${f.fault.replaceAll("_", " ")}`),
    h("p", {}, `${f.what}; ${f.where}`), h("p", {}, f.remedy), cutOf(recording, f)));
}

/** The longer part of a recording, before or behind a fault, as a recording of its own. */
function cutOf(recording, fault) {
  if (fault.start === null) return null;
  const end = signals[recording.file]?.duration ?? 0, behind = fault.stop !== null && end - fault.stop > fault.start;
  const [first, last] = behind ? [fault.stop, end] : [0, fault.start];
  const from = h("input", { size: 6, "aria-label": "from, s", value: short(first) }), to = h("input", { size: 6, "aria-label": "to, s", value: short(last) });
  return h("div", { class: "row" }, "Keep from", from, "s to", to, "s",
    h("button", { onclick: () => run("cut", recording.file, "--from", from.value, "--to", to.value) }, "Cut here"));
}

/** The course of a recording, with the faults of the check as marks. */
function coursesOf(recording) {
  const log = signals[recording.file];
  return Object.entries(log?.axes ?? {}).flatMap(([axis, own]) => {
    const seen = (faults.logs[recording.file] ?? []).filter(f => f.axis === axis && f.start !== null);
    const marks = seen.map(f => [f.start, f.stop ?? log.duration].map(t => t / log.duration));
    return DRAWN.filter(name => own.channels[name]).slice(0, 2).map(name => h("div", { title: `${name} of axis ${axis} over ${short(log.duration)} s` },
      course(own.channels[name].course, `${name} of axis ${axis}, ${marks.length} faults marked`, marks)));
  });
}

function signalsOf(recording) {
  if (signals[recording.file]) return;
  signals[recording.file] = {};
  get(`/api/signals?file=${encodeURIComponent(recording.file)}`).then(a => { signals[recording.file] = Object.values(a.logs ?? {})[0] ?? {}; redraw(); }).catch(() => {});
}
