// The screens, left to right as the work goes.
import { get, run, stateNow } from "./app.js";
import { bar, frames, h, last, percent, put, region } from "./build.js";
import { recordings } from "./recordings.js";

const known = {};  // answers by file, which never change

/** An answer of the project; redrawn when it has come. */
function answer(file, then) {
  if (!file) return null;
  if (!(file in known)) {
    known[file] = null;
    get(`/api/answer?file=${encodeURIComponent(file)}`).then(a => { known[file] = a; then(); }).catch(() => {});
  }
  return known[file];
}

let catalogue = null;
function effects(then) {
  if (catalogue === null) {
    catalogue = [];
    get("/api/effects").then(a => { catalogue = a.effects; then(); }).catch(() => { catalogue = null; });
  }
  return catalogue;
}

/** What an effect is, in a line; nothing of what is none, or before the catalogue has come. */
function meaning(name) {
  const known = catalogue?.find(e => e.name === name?.replace(/_\d+$/, ""));
  return known ? h("p", { class: "soft" }, known.summary) : null;
}

/** Whether a command of this kind runs or waits. */
const busy = (state, kind) => state.jobs.some(j => ["running", "waiting"].includes(j.state) && j.words[0] === kind);

function button(text, kind, words, state, lead = false, screen = "do") {
  return h("button", { id: `${screen}-${words.join("-").replace(/\W/g, "-")}`, class: lead ? "main" : "",
    disabled: busy(state, kind), onclick: () => run(...words) }, busy(state, kind) ? "Runs ..." : text);
}

const ofExperiment = answer => answer.command.startsWith("twin view experiments/");
const replay = (place, state) =>
  frames(place, last(state, "view", undefined, a => !ofExperiment(a))?.page, "The machine in 3D, as measured and as modelled");
const needsModel = () => h("p", {}, "There is no model yet. ", h("a", { href: "#model" }, "Propose a first model"), ".");
const jobsOf = (state, kind) => state.jobs.filter(j => j.words[0] === kind).map(j => [j.number, j.state]);

// --- Model -------------------------------------------------------------------------------------------
const model = {
  id: "model", name: "Model", values: {}, filter: "",
  build(section) {
    section.append(h("h2", {}, "Model"));
    this.top = region(section);
    this.view = region(section);
    this.cards = region(section);
    this.gallery = region(section);
  },
  update(state) {
    const file = state.models.at(-1)?.file;
    put(this.top, [file, state.recordings.length, state.mechanisms, jobsOf(state, "new"), jobsOf(state, "view"),
      jobsOf(state, "fit")], () => file ? [
      h("div", { class: "row" }, h("b", {}, file), button("Fit its values", "fit", ["fit"], state),
        button("Show it move in 3D", "view", ["view"], state),
        h("a", { class: "next", href: "#diagnose" }, "Diagnose: what does it lack?")),
    ] : this.first(state));
    if (file && !this.values[file]) {
      get(`/api/model?file=${encodeURIComponent(file)}`).then(m => { this.values[file] = m; this.update(stateNow()); }).catch(() => {});
    }
    const listed = file ? effects(() => this.update(stateNow())) : [];
    put(this.cards, [this.values[file] ?? null, listed.length, jobsOf(state, "remove"), jobsOf(state, "add")],
      () => this.values[file] ? cardsOf(this.values[file], state) : []);
    replay(this.view, state);
    put(this.gallery, [file, listed.length, this.filter, jobsOf(state, "add")], () => listed.length ? galleryOf(this, state, listed) : []);
  },
  first(state) {
    if (!state.recordings.length) return [h("p", {}, "There is no recording yet. ", h("a", { href: "#recordings" }, "Take recordings in"), ".")];
    const mjcf = h("select", { id: "mjcf", "aria-label": "Mechanism" }, h("option", { value: "" }, "axes of their own"),
      ...state.mechanisms.map(m => h("option", { value: m }, m)));
    const mass = h("input", { id: "mass", size: 8, placeholder: "from the logs" });
    return [
      h("p", {}, "The first model has mass, friction and a constant force, read off the recordings. What it lacks is what the diagnosis then finds."),
      h("div", { class: "row" }, h("label", {}, "Mechanism", mjcf),
        h("label", {}, "Moved mass where it is known, kg or x=2.5", mass)),
      h("button", { id: "new", class: "main", disabled: busy(state, "new"), onclick: () => run("new",
        ...(mjcf.value ? ["--mjcf", mjcf.value] : []), ...(mass.value.trim() ? ["--mass", mass.value.trim()] : [])) },
      "Propose a first model"),
      state.mechanisms.length ? null : h("p", { class: "soft" }, "Of an arm: drop its MJCF or URDF file (.xml, .urdf) among the recordings; its joints are then the axes."),
    ];
  },
};

function cardsOf(found, state) {
  return Object.entries(found.axes).flatMap(([axis, table]) => [h("h3", {}, `Axis ${axis}`), h("div", { class: "cards" },
    card("Axis", table.values, null),
    ...table.effects.map(e => card(e.name, e.values, e.fixed, switchOf(state, axis, e.name, true))),
    ...takenOut(state, axis).filter(name => !table.effects.some(e => e.name === name)).map(name => h("div", { class: "card soft" },
      h("h3", {}, name, switchOf(state, axis, name, false)), h("p", {}, "Taken out; the ledger tells the error with it and without."))))]);
}

/** Effects that were taken out of an axis and not added again. */
function takenOut(state, axis) {
  const out = new Set();
  for (const m of state.models) {
    if (m.removed && m.errors[0]?.axis === axis) out.add(m.removed);
    for (const name of m.change) out.delete(name);
  }
  return [...out];
}

function switchOf(state, axis, name, on) {
  return h("button", { class: "switch", role: "switch", "aria-checked": String(on), "aria-label": `${name} of axis ${axis}`,
    disabled: busy(state, "remove") || busy(state, "add"), title: on ? "Take it out and fit the others" : "Add it again and fit",
    onclick: () => switched(state, axis, name, on) }, on ? "on" : "off");
}

/** Of what was taken out last the model before is the one with it. */
function switched(state, axis, name, on) {
  const last = state.models.at(-1);
  if (on) run("remove", name, "--axis", axis);
  else if (last.removed === name && last.errors[0]?.axis === axis) run("undo");
  else run("add", name, "--axis", axis);
}

function card(name, values, fixed, toggle = null) {
  return h("div", { class: "card" }, h("h3", {}, name, toggle), meaning(name), h("table", {}, h("tbody", {}, ...values.map(v => h("tr", {},
    h("td", { title: v.meaning }, fixed === null ? v.name.replaceAll("_", " ") : v.meaning || v.name), h("td", {}, h("b", {}, v.shown),
      v.band ? h("div", { class: "soft" }, `90 %: ${v.band[0]} to ${v.band[1]}`) : null,
      fixed?.includes(v.name) ? h("div", { class: "soft" }, "held") : null))))));
}

function galleryOf(screen, state, listed) {
  const wanted = screen.filter.toLowerCase();
  const fitting = listed.filter(e => `${e.name} ${e.summary}`.toLowerCase().includes(wanted));
  return [h("details", { open: screen.open, ontoggle: event => { screen.open = event.target.open; } },
    h("summary", {}, `Add an effect by hand (${listed.length} in the catalogue)`),
    h("div", { class: "row" }, h("label", {}, "Search", h("input", { id: "filter", value: screen.filter, type: "search",
      oninput: event => { screen.filter = event.target.value; screen.update(stateNow()); } }))),
    h("div", { class: "cards" }, ...fitting.map(e => h("div", { class: "card" }, h("h3", {}, e.name), h("p", {}, e.summary),
      h("p", { class: "soft" }, e.equation), h("p", { class: "soft" }, `Seen by: ${e.excited_by}`),
      h("button", { disabled: busy(state, "add"), "aria-label": `Add ${e.name}`, onclick: () => run("add", e.name) }, "Add")))))];
}

// --- Compare -----------------------------------------------------------------------------------------
const compare = {
  id: "compare", name: "Compare",
  build(section) {
    section.append(h("h2", {}, "Compare model and machine"));
    this.top = region(section);
    this.page = region(section);
    this.view = region(section);
  },
  update(state) {
    put(this.top, [state.models.length, jobsOf(state, "compare"), jobsOf(state, "view")], () => state.models.length ? [
      h("p", {}, "Where the force of the model differs from that of the machine, on the test logs: by time, position, speed and direction. What is marked there is marked in the replay, where that is shown."),
      h("div", { class: "row" }, button("Compare the present model", "compare", ["compare"], state, true),
        button("Show it move in 3D", "view", ["view"], state, false, "compare"))] : [needsModel()]);
    frames(this.page, last(state, "compare")?.page, "Comparison of model and machine");
    replay(this.view, state);
  },
};

// --- Diagnose ----------------------------------------------------------------------------------------
const STATES = { confirmed: "proved", tied: "tied with another", conditional: "proved with others" };
const diagnose = {
  id: "diagnose", name: "Diagnose", asked: "",
  build(section) {
    section.append(h("h2", {}, "Diagnose: what does the model lack?"));
    this.top = region(section);
    this.live = region(section);
    this.answer = region(section);
    this.why = region(section);
    this.page = region(section);
  },
  update(state) {
    const job = state.jobs.find(j => j.words[0] === "diagnose" && j.state === "running");
    put(this.top, [state.models.length, jobsOf(state, "diagnose")], () => state.models.length ? [
      button("Find what is missing", "diagnose", ["diagnose"], state, true)] : [needsModel()]);
    put(this.live, job?.progress ?? null, () => job ? liveOf(job.progress ?? "begins") : []);
    const entry = last(state, "diagnose"), found = answer(entry?.file, () => this.update(stateNow()));
    const listed = found ? effects(() => this.update(stateNow())) : [];
    const old = entry ? null : state.answers.filter(a => a.command.split(" ")[1] === "diagnose").at(-1);
    put(this.answer, [found ? entry.file : null, old?.file, listed.length, jobsOf(state, "add")], () => found ? answerOf(found, state) :
      old ? [sinceThen(state, old)] : []);
    put(this.why, [found ? entry.file : null, listed.length, this.asked, jobsOf(state, "add")], () => listed.length ? whyOf(this, state, found, listed) : []);
    frames(this.page, (entry ?? old)?.page, "The diagnosis with its evidence");
  },
};

/** What the present model is, where the last diagnosis was of one before it. */
function sinceThen(state, old) {
  const now = state.ledger.at(-1);
  return h("div", { class: "card lead" }, h("h3", {}, `${now.file} = ${now.made}`), ...now.errors.map(e => h("p", {}, e.told)),
    h("p", { class: "soft" }, `It was not diagnosed yet: the page below is about ${old.model}.`), h("a", { class: "next", href: "#compare" }, "Compare it with the machine"));
}

function liveOf(progress) {
  const [where, ahead] = progress.split("; ahead: ");
  const leading = (ahead ?? "").replace(/ \(.*$/, "").split(", ").map(t => /^(.*) (\d+) %$/.exec(t)).filter(Boolean);
  return [h("div", { class: "card lead", "aria-live": "polite" }, h("p", {}, where), leading.length ?
    h("h3", {}, "Likely so far, by what each alone would explain") : null,
  ...leading.map(([, name, share]) => bar(name, share / 100)))];
}

function axesOf(found) {
  const axes = Object.values(found.axes ?? {});
  return axes.length ? axes : [found];
}

function answerOf(found, state) {
  const axes = axesOf(found);
  const bodies = found.bodies ?? [], recording = found.recording;
  const all = [...bodies.map(b => `body ${b.body}`), ...axes.flatMap(a => a.findings.filter(f => f.kind === "missing").map(f => f.effect))];
  return [recording ? h("div", { class: "card warn" }, h("h3", {}, "The recording"), h("p", {}, recording.said)) : null, ...bodies.map(bodyOf), ...axes.map(a => h("div", { class: "card lead" }, h("h3", {}, `Axis ${a.axis}: ${a.explanation}`),
    h("div", { class: "cards" }, ...a.findings.map(f => findingOf(f, a.axis, state)))),
  ), all.length ? button(all.length > 1 ? `Add all ${all.length}` : `Add ${all[0]}`, "add", ["add", "--found"], state, true) : null, all.length > 1 ? h("span", { class: "soft" }, " fits all of them together") : null];
}

function bodyOf(b) {
  const names = [b.body, ...b.ambiguous_with].join(" or ");
  return h("div", { class: "card lead" }, h("h3", {}, `Body ${names}: another inertia than in the file`),
    h("p", {}, `${percent(b.confidence)} of such answers were right; it changes the torques of ${b.axes.join(", ")}`), bar("explains of the error", b.part),
    h("table", {}, h("tbody", {}, ...Object.entries(b.parameters).map(([name, p]) => h("tr", {}, h("td", {}, name),
      h("td", {}, `${short(p.more)} ± ${short(p.band_90)} ${p.unit} more`))))),
    b.not_told.length ? h("p", { class: "soft" }, `These joints do not tell its ${b.not_told.join(", ")}.`) : null,
    b.disagreeing.length ? h("p", { class: "warn-text" }, `The logs ${b.disagreeing.join(", ")} tell another change.`) : null);
}

function findingOf(f, axis, state) {
  const parts = [h("h3", {}, f.effect ?? f.kind), meaning(f.effect), h("p", {}, STATES[f.state] ?? f.state ?? "",
    f.confidence ? `; of answers as well supported ${percent(f.confidence)} were right on machines whose lack is known` : "")];
  if (f.explains !== null) parts.push(bar("of the squared error", f.explains));
  if (f.control !== null && f.control !== undefined) parts.push(bar("shifted in time, by chance", f.control));
  if (f.indistinguishable_from?.length) parts.push(h("p", { class: "warn-text" }, `The logs cannot tell it from ${f.indistinguishable_from.join(", ")}.`));
  if (f.effect && f.kind === "missing") parts.push(h("button", { disabled: busy(state, "add"), "aria-label": `Add ${f.effect}`,
    onclick: () => run("add", f.effect, "--axis", axis) }, "Add this one"));
  return h("div", { class: "card" }, ...parts);
}

function whyOf(screen, state, found, listed) {
  const chosen = screen.asked;
  const names = listed.map(e => e.name);
  const select = h("select", { id: "why", onchange: event => { screen.asked = event.target.value; screen.update(stateNow()); } },
    h("option", { value: "" }, "choose an effect"), ...names.map(n => h("option", { value: n, selected: n === chosen }, n)));
  const told = chosen ? axesOf(found).map(a => h("div", { class: "card" }, h("h3", {}, `${chosen} on axis ${a.axis}`),
    ...reasonsOf(a, chosen, listed.find(e => e.name === chosen)),
    h("button", { disabled: busy(state, "add"), onclick: () => run("add", chosen, "--axis", a.axis) }, "Try it: fit the model with it"))) : [];
  return [h("div", { class: "row" }, h("label", {}, "Why not", select)), ...told];
}

function reasonsOf(axis, name, effect) {
  const tried = axis.ranking.find(c => c.effect === name), skipped = axis.not_tried.find(n => (n.effect ?? n) === name);
  if (axis.findings.some(f => f.effect === name)) return [h("p", {}, "It is part of the answer.")];
  if (tried) return [
    bar("takes of what was left", tried.part ?? 0),
    h("p", {}, tried.why_not ?? (tried.supported ? "The logs support it beside the model as it was; another explains more." : "The logs do not support it.")),
    tried.holdout_error_after === null ? null : h("p", { class: "soft" },
      `selection error ${short(tried.holdout_error_before)} -> ${short(tried.holdout_error_after)} ${tried.unit}`),
    h("p", { class: "soft" }, `What would show it: ${effect.excited_by}`)];
  return [h("p", {}, skipped?.why ?? skipped?.reason ?? "It is in the model already, or the axis cannot have it."),
    h("p", { class: "soft" }, `What would show it: ${effect.excited_by}`)];
}

const short = value => value === null ? "" : Number(value).toPrecision(3);

// --- Experiment --------------------------------------------------------------------------------------
const experiment = {
  id: "experiment", name: "Experiment",
  build(section) {
    section.append(h("h2", {}, "The next experiment"));
    this.top = region(section);
    this.answer = region(section);
    this.made = region(section);
    this.view = region(section);
  },
  update(state) {
    put(this.top, [state.models.length, jobsOf(state, "plan")], () => state.models.length ? [
      h("p", {}, "The motion that decides best between what the recordings cannot tell apart."),
      button("Plan it", "plan", ["plan"], state, true)] : [needsModel()]);
    const entry = last(state, "plan"), found = answer(entry?.file, () => this.update(stateNow()));
    put(this.answer, [found ? entry.file : null], () => found ? planOf(found) : []);
    const file = state.experiments.at(-1)?.file;
    put(this.made, [file, jobsOf(state, "simulate"), state.runs], () => file ? experimentOf(file, state) : []);
    frames(this.view, state.answers.filter(ofExperiment).at(-1)?.page, "The experiment on the twin");
  },
};

function planOf(found) {
  return [h("div", { class: `card ${found.decides ? "lead" : "warn"}` },
    h("h3", {}, found.decides ? found.between.length > 1 ? `Decides between ${found.between.join(" and ")}` : "Shows what the recordings do not" : "No experiment decides"),
    ...Object.entries(found.excited_by ?? {}).map(([name, why]) => h("p", {}, `${name}: ${why}`)),
    found.missing_motion ? h("p", {}, found.missing_motion) : null)];
}

function experimentOf(file, state) {
  const stem = file.replace(/\.toml$/, "");
  const formats = [["csv", "CSV"], ["yaml", "ROS 2"], ["st", "TwinCAT"]];
  return [h("div", { class: "row" }, h("b", {}, file),
    ...formats.map(([ending, name]) => button(`Write for ${name}`, "simulate", ["simulate", file, "--setpoints", `${stem}-run.${ending}`], state)),
    button("Run it on the twin", "simulate", ["simulate", file], state)),
  h("ul", {}, ...state.runs.map(r => h("li", {}, h("a", { href: `/files/${r}?keep=1`, download: "" }, r), " ",
    r.endsWith(".mcap") ? button("Show in 3D", "view", ["view", r, state.models.at(-1).file, "--html", `answers/${r.split("/").at(-1)}.html`], state) : null)))];
}

// --- Take along --------------------------------------------------------------------------------------
const FORMATS = [["c", "C for a controller"], ["csv", "feedforward table, CSV"], ["twincat", "TwinCAT (Structured Text)"], ["ros2_control", "ROS 2 control"],
  ["fmu", "FMU for Simulink and others"], ["mjcf", "MuJoCo"]];
const along = {
  id: "along", name: "Take along",
  build(section) {
    section.append(h("h2", {}, "Take along"));
    this.top = region(section);
    this.made = region(section);
    this.worth = region(section);
  },
  update(state) {
    put(this.top, [state.models.at(-1)?.file, jobsOf(state, "export"), jobsOf(state, "feedforward"), jobsOf(state, "frf")], () => state.models.length ? [
      h("p", {}, `${state.models.at(-1).file} as`),
      h("div", { class: "row" }, ...FORMATS.map(([key, name]) => button(name, "export", ["export", "--to", key], state))),
      h("div", { class: "row" }, button("What is it worth as feedforward?", "feedforward", ["feedforward"], state),
        button("Frequency response of the logs", "frf", ["frf"], state))] : [needsModel()]);
    put(this.made, [state.exports, state.answers.length], () => [
      state.exports.length ? h("h3", {}, "Exported") : null,
      h("ul", {}, ...state.exports.flatMap(e => e.files.map(f => h("li", {}, h("a", { href: `/files/${f}?keep=1`, download: "" }, f))))),
      h("h3", {}, "Reports, one file each"),
      h("ul", {}, ...state.answers.filter(a => a.page).map(a => h("li", {}, h("a", { href: `/files/${a.page}?keep=1`, download: "" }, a.page),
        h("span", { class: "soft" }, ` ${a.model ?? ""}`))))]);
    const jobs = state.jobs.filter(j => ["feedforward", "frf"].includes(j.words[0]) && j.state === "done");
    put(this.worth, jobs.map(j => j.number), () => jobs.slice(0, 2).map(j => h("div", { class: "card" }, h("h3", {}, j.command),
      h("pre", { tabindex: 0 }, [j.text, j.code === 0 ? "" : j.remarks.at(-1)].filter(Boolean).join("\n")))));
  },
};

// --- Fleet -------------------------------------------------------------------------------------------
const fleet = {
  id: "fleet", name: "Fleet", there: state => state.stores.length > 0,
  build(section) {
    section.append(h("h2", {}, "Fleet"));
    this.top = region(section);
    this.page = region(section);
  },
  update(state) {
    put(this.top, [state.stores, jobsOf(state, "fleet")], () => state.stores.map(store => h("div", { class: "row" }, h("b", {}, store),
      button("Which machines changed?", "fleet", ["fleet", "report", "--store", store, "--out", `answers/${store}-fleet.html`], state, true))));
    const done = state.jobs.find(j => j.words[0] === "fleet" && j.state === "done" && j.code !== 2);
    frames(this.page, done ? done.words.at(-1) : null, "The machines and their alarms");
  },
};

export const screens = [recordings, model, compare, diagnose, experiment, along, fleet];
