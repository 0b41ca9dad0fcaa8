// The page as a function of the project's state: each click asks the server to run a command.
import { screens } from "./screens.js";
import { frames, h, put } from "./build.js";

const page = { state: null, screen: null, sections: {}, says: null };
const byId = id => document.getElementById(id);

async function ask(path, given, method) {
  const sent = given === undefined ? {} : {
    method: method ?? "POST", body: given instanceof Blob ? given : JSON.stringify(given),
  };
  const answer = await fetch(path, sent);
  const told = answer.status === 204 ? null : await answer.json().catch(() => ({}));
  if (!answer.ok) throw new Error(told.error ?? `the server says ${answer.status}`);
  return told;
}

/** Queue a command; its number. What is refused is said where jobs are. */
export async function run(...words) {
  try {
    const { number } = await ask("/api/run", { words });
    page.says = null;
    return number;
  } catch (error) {
    say(error.message);
    return null;
  }
}

/** Queue a command and wait for its end: whether it ended well. */
export async function finished(...words) {
  const number = await run(...words);
  if (number === null) return false;
  for (;;) {
    const job = page.state.jobs.find(j => j.number === number);
    if (job?.ended) return job.code === 0;
    await new Promise(done => setTimeout(done, 100));
  }
}

export const stateNow = () => page.state;
export const get = path => ask(path);
export const upload = file => ask(`/api/upload/${encodeURIComponent(file.name)}`, file, "PUT");

export function say(text) {
  page.says = text;
  showJob();
}

function showJob() {
  const { jobs, worker } = page.state ?? { jobs: [], worker: null };
  const running = jobs.find(j => j.state === "running");
  const waiting = jobs.filter(j => j.state === "waiting");
  const last = jobs.find(j => j.ended);
  put(byId("job"), [page.says, running, waiting, last, worker], () => {
    const rows = [];
    if (page.says) rows.push(h("div", { class: "bad" }, h("span", {}, page.says),
      h("button", { onclick: () => say(null) }, "Close")));
    if (running) rows.push(h("div", {}, h("span", {}, h("b", {}, running.command), " ",
      running.progress?.replace(/; ahead: [^(]*/, " ") ?? "begins"), h("button", { id: "stop", onclick: () => stop(running) }, "Stop")));
    else if (last) rows.push(ended(last));
    if (!running && worker) rows.push(h("div", {}, h("span", {}, `outside this page runs: ${worker}`)));
    for (const job of waiting) rows.push(h("div", {}, h("span", {}, `waits: ${job.command}`),
      h("button", { onclick: () => stop(job) }, "Take out")));
    return rows;
  });
}

function ended(job) {
  const why = job.remarks.at(-1) ?? job.text.split("\n").find(line => line) ?? "";
  const took = job.begun ? `${Math.max(1, Math.round(job.ended - job.begun))} s` : "";
  if (job.state === "killed") return h("div", { class: "bad" }, h("span", {}, h("b", {}, job.command),
    " was killed; nothing of it is half written. Run it again."));
  if (job.state === "stopped") return h("div", { class: "bad" }, h("span", {}, h("b", {}, job.command),
    " was stopped; the project is as it was before. ", job.remarks.find(r => r.startsWith("stopped; "))?.slice(9) ?? ""));
  if (job.code === 0) return h("div", { class: "good" }, h("span", {}, h("b", {}, job.command), ` done, ${took}`),
    said(job));
  return h("div", { class: "bad" }, h("span", {}, h("b", {}, job.command), " ", why), said(job));
}

function said(job) {
  const text = [job.text.trim(), ...job.remarks].filter(Boolean).join("\n");
  return text ? h("button", { onclick: () => show(job.command, text) }, "What it said") : null;
}

function show(title, text) {
  const box = h("dialog", { "aria-label": title }, h("h2", {}, title), h("pre", { tabindex: 0 }, text),
    h("form", { method: "dialog" }, h("button", { class: "main" }, "Close")));
  box.querySelector("form").onsubmit = event => { event.preventDefault(); box.close(); box.remove(); };
  document.body.append(box);
  box.showModal();
}

const stop = job => ask("/api/stop", { number: job.number }).catch(error => say(error.message));

function showLedger(state) {
  put(byId("ledger"), [state.ledger, state.error], () => [
    state.error ? h("p", { class: "warn-text" }, state.error) : null,
    state.ledger.length ? null : h("p", { class: "soft" }, "No model yet."),
    h("ol", { class: "ledger" }, ...state.ledger.map(entry => h("li", {}, h("b", {}, entry.file),
      h("span", { class: "soft" }, `= ${entry.made}`),
      ...telling(entry.errors).map(e => h("div", {}, several(entry) ? `${e.axis}: ` : "", e.told))))),
  ]);
}

const several = entry => new Set(entry.errors.map(e => e.axis)).size > 1;
// Of several axes the logs on which least was decided: those come first.
const telling = errors => several({ errors }) ? errors.filter((e, k) => errors.findIndex(o => o.axis === e.axis) === k) : errors;
let shownAs = "history";

function showCommands(state) {
  const text = shownAs === "history" ? state.history.join("\n") : state.python;
  put(byId("which"), [shownAs], () => [
    ...[["history", "Shell"], ["python", "Python"]].map(([key, name]) => h("button", {
      id: `as-${key}`, "aria-pressed": String(shownAs === key),
      class: shownAs === key ? "main" : "", onclick: () => { shownAs = key; showCommands(page.state); },
    }, name)),
    h("button", { id: "copy", onclick: () => copy(byId("commands").textContent) }, "Copy"),
  ]);
  put(byId("commands"), text, () => [text]);
}

async function copy(text) {
  await navigator.clipboard.writeText(text);
  byId("copy").textContent = "Copied";
  setTimeout(() => { byId("copy").textContent = "Copy"; }, 1500);
}

function showScreen() {
  const known = screens.filter(s => s.there?.(page.state) ?? true);
  const wanted = location.hash.slice(1);
  const chosen = known.find(s => s.id === wanted) ?? known[0];
  put(byId("screens"), [known.map(s => s.id), chosen.id], () => known.map(s => h("a", {
    href: `#${s.id}`, "aria-current": s === chosen ? "page" : null,
  }, s.name)));
  for (const s of known) {
    if (!page.sections[s.id]) {
      page.sections[s.id] = h("section", { "aria-label": s.name });
      byId("main").append(page.sections[s.id]);
      s.build(page.sections[s.id]);
    }
    page.sections[s.id].hidden = s !== chosen;
  }
  document.title = `${chosen.name}: ${page.state.name}`;
  chosen.update(page.state);
}

/** Draw again what depends on what the user has chosen on a screen. */
export function redraw() {
  if (page.state) showScreen();
}

function showAll() {
  const state = page.state;
  put(byId("name"), state.name, () => [state.name]);
  byId("undo").disabled = state.history.length < 2;
  showJob();
  showLedger(state);
  showCommands(state);
  showScreen();
}

async function follow() {
  let since = "";
  for (;;) {
    try {
      const told = await ask(`/api/state?since=${since}`);
      if (told) {
        page.state = told;
        since = told.signature;
        if (page.lost) say(null);
        page.lost = false;
        showAll();
      }
    } catch (error) {
      page.lost = true;
      say(`the server does not answer (${error.message}); begin it again with twin app`);
      await new Promise(done => setTimeout(done, 1500));
    }
  }
}

byId("undo").onclick = () => run("undo");
addEventListener("hashchange", () => { redraw(); byId("main").focus({ preventScroll: true }); });
addEventListener("dragover", event => event.preventDefault());
addEventListener("drop", event => event.preventDefault());
follow();
