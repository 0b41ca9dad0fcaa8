// Small pieces of the page: elements, regions that are drawn again only when their data change.

/** An element; texts are texts, whatever is in them. */
export function h(tag, given = {}, ...children) {
  const made = document.createElement(tag);
  for (const [key, value] of Object.entries(given)) {
    if (value === null || value === undefined || value === false) continue;
    if (key.startsWith("on") || key === "value" || key === "checked") made[key] = value;
    else made.setAttribute(key, value === true ? "" : value);
  }
  if (tag === "button") made.type ||= "button";
  made.append(...children.flat().filter(c => c !== null && c !== undefined));
  return made;
}

/** Fill a region anew where its data are others; what has the focus keeps it. */
export function put(region, data, make) {
  const key = JSON.stringify(data) ?? "";
  if (region.shownFor === key) return;
  const focus = region.contains(document.activeElement) ? document.activeElement.id : "";
  region.shownFor = key;
  region.replaceChildren(...make().flat().filter(c => c !== null && c !== undefined));
  if (focus) document.getElementById(focus)?.focus({ preventScroll: true });
}

/** A region of a screen. */
export function region(section, tag = "div") {
  const made = document.createElement(tag);
  section.append(made);
  return made;
}

/** What is marked on the page of a comparison is marked in the replay beside it. */
let marked = null;
addEventListener("message", event => {
  const shown = [...document.querySelectorAll("iframe")].map(f => f.contentWindow);
  if (event.data?.twin !== "marked" || !shown.includes(event.source)) return;
  marked = event.data;
  for (const other of shown) if (other !== event.source) other.postMessage(marked, "*");
});

/** Show a page of the project in a frame; the frame stays while the page is the same. */
export function frames(place, file, title) {
  put(place, file, () => file ? [h("iframe", {
    src: `/files/${file.split("/").map(encodeURIComponent).join("/")}`, title, sandbox: "allow-scripts allow-downloads",
    onload: event => { if (marked) event.target.contentWindow.postMessage(marked, "*"); },
  }), h("p", { class: "soft" }, h("a", { href: `/files/${file}?keep=1`, download: "" }, `Save ${file}`),
    " as one file, for a colleague without this program.")] : []);
}

const SVG = "http://www.w3.org/2000/svg";

/** A small plot of a column. marks: [from, to] of its length, 0 to 1, where something is wrong. */
export function course(values, name, marks = []) {
  const low = Math.min(...values), span = Math.max(...values) - low || 1;
  const steps = values.map((v, k) => `${(k / Math.max(values.length - 1, 1) * 102 + 1).toFixed(1)},` +
    `${(28 - (v - low) / span * 26).toFixed(1)}`);
  const made = document.createElementNS(SVG, "svg"), path = document.createElementNS(SVG, "path");
  made.setAttribute("class", "course");
  made.setAttribute("viewBox", "0 0 104 30");
  made.setAttribute("role", "img");
  made.setAttribute("aria-label", `course of ${name}`);
  path.setAttribute("d", `M${steps.join(" L")}`);
  for (const [from, to] of marks) {
    const mark = document.createElementNS(SVG, "rect"), width = Math.max(2, (to - from) * 102);
    const sides = { class: "mark", x: Math.min(1 + from * 102, 103 - width), y: 0, width, height: 30 };
    for (const [key, value] of Object.entries(sides)) mark.setAttribute(key, value);
    made.append(mark);
  }
  made.append(path);
  return made;
}

/** A bar with a name and a share between 0 and 1. */
export function bar(name, share) {
  const fill = h("i");
  fill.style.width = `${Math.max(0, Math.min(1, share)) * 100}%`;
  return h("div", { class: "bar" }, h("span", {}, name), h("span", {}, fill), h("span", {}, percent(share)));
}

export const percent = share => `${Math.round(100 * share)} %`;

/** The last answer of a command, about the present model where it is about one. */
export function last(state, kind, about = state.models.at(-1)?.file, fits = () => true) {
  return state.answers.filter(a => a.command.split(" ")[1] === kind && fits(a) &&
    (!a.model || !about || a.model === about)).at(-1);
}
