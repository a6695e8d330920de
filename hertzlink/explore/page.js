"use strict";
const sliders = JSON.parse(document.getElementById("setup").textContent);
const token = new URLSearchParams(location.search).get("token");
const byId = (id) => document.getElementById(id);
const values = new Map();
let shown = null, kept = null, running = false, wanted = false;

function made(name, attributes = {}, ...inner) {
  const one = document.createElement(name);
  Object.assign(one, attributes);
  one.append(...inner);
  return one;
}

function control(slider, i) {
  const id = "value" + i, name = made("label", { htmlFor: id }, slider.label);
  const box = made("div", { className: "value" });
  let set;
  if (slider.choices.length) {
    const choice = made("select", { id }, ...slider.choices.map((one) => made("option", { value: one }, one)));
    set = (text) => { choice.value = text; values.set(slider.name, text); };
    choice.oninput = () => { values.set(slider.name, choice.value); ask(); };
    box.append(made("div", { className: "head" }, name, choice));
  } else {
    const limits = { min: slider.low, max: slider.high };
    const number = made("input", { type: "number", id, ...limits, step: slider.whole ? "1" : "any" });
    // The range starts at a whole step, so that the steps are round numbers; its ends are those of the slider.
    const range = made("input", { type: "range", ...limits, step: slider.step });
    range.setAttribute("aria-label", slider.label + (slider.unit ? ", " + slider.unit : ""));
    set = (text) => { number.value = range.value = text; values.set(slider.name, text); };
    range.oninput = () => { number.value = range.value; values.set(slider.name, range.value); ask(); };
    number.oninput = () => {
      if (number.value !== "") range.value = number.value;
      values.set(slider.name, number.value);
      ask();
    };
    box.append(made("div", { className: "head" }, name, number, made("span", { className: "unit" }, slider.unit)), range,
      made("div", { className: "ends" }, made("span", {}, slider.low), made("span", {}, slider.high)));
  }
  set(slider.start);
  slider.set = set;
  return box;
}

// One request at a time; of those that wait only the last values count.
async function ask() {
  wanted = true;
  if (running) return;
  running = true;
  curve.at += 1;
  while (wanted) {
    wanted = false;
    byId("took").textContent = "computing …";
    await once();
  }
  running = false;
  sketch();
}

async function once() {
  try {
    const reply = await asked("/answer");
    if (reply.status === 403) throw new Error("hertzlink was restarted: open the address that it printed");
    const answer = await reply.json();
    if (!reply.ok) throw new Error(answer.error);
    shown = answer;
    show(answer);
  } catch (error) {
    const lost = error instanceof TypeError;
    fail(lost ? "hertzlink does not answer: look at its terminal, or restart it" : error.message);
  }
}

function fail(message) {
  byId("message").textContent = message;
  byId("took").textContent = "";
  for (const id of ["trace", "waves"]) byId(id).classList.add("stale");
}

function show(answer) {
  byId("message").textContent = "";
  for (const id of ["trace", "waves"]) byId(id).classList.remove("stale");
  byId("waves").replaceChildren(...Object.entries(answer.waves).map(row));
  byId("warnings").replaceChildren(...answer.warnings.map((one) => made("li", {}, one)));
  byId("warnings").hidden = !answer.warnings.length;
  byId("took").textContent = `computed in ${Math.round(1e3 * answer.took)} ms`;
  draw();
}

function row([name, wave]) {
  const head = made("th", { scope: "row" }, name);
  if (wave.reason) return made("tr", {}, head, made("td", { className: "none", colSpan: 3 }, "none: " + wave.reason));
  const ratio = wave.amplitude_ratio === undefined ? "" : wave.amplitude_ratio.toFixed(4);
  const flight = wave.time_of_flight === undefined ? "" : (1e6 * wave.time_of_flight).toFixed(2) + " µs";
  return made("tr", {}, head, ...[ratio, flight, wave.amplitude.toPrecision(4) + " N"].map((one) => made("td", {}, one)));
}

function ticks(low, high, count) {
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((one) => one * power >= rough);
  const first = Math.ceil(low / step), last = Math.floor(high / step + 1e-9);
  return Array.from({ length: Math.max(0, last - first + 1) }, (_, i) => +((first + i) * step).toPrecision(12));
}

// Axes from (low, least) to (far, most) on an empty drawing; returns how to place points, and how to add parts.
function axes(svg, low, far, least, most, across, up) {
  const width = svg.clientWidth, height = svg.clientHeight, left = 52, right = 24, top = 26, bottom = 44, parts = [];
  if (!width || !height) return null;
  const x = (value) => left + (width - left - right) * (value - low) / (far - low);
  const y = (value) => height - bottom - (height - top - bottom) * (value - least) / (most - least);
  const part = (name, attributes, text) => {
    const one = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) one.setAttribute(key, value);
    if (text !== undefined) one.textContent = text;
    parts.push(one);
  };
  for (const value of ticks(low, far, width / 110)) {
    part("line", { class: "grid", x1: x(value), x2: x(value), y1: top, y2: height - bottom });
    part("text", { x: x(value), y: height - bottom + 17, "text-anchor": "middle" }, value);
  }
  for (const value of ticks(least, most, height / 60)) {
    part("line", { class: "grid", x1: left, x2: width - right, y1: y(value), y2: y(value) });
    part("text", { x: left - 7, y: y(value) + 4, "text-anchor": "end" }, value);
  }
  part("text", { x: width - right, y: height - 8, "text-anchor": "end" }, across);
  part("text", { x: 4, y: 14 }, up);
  return { x, y, part, width, finish: () => svg.replaceChildren(...parts) };
}

function draw() {
  if (!shown) return;
  const svg = byId("trace"), all = kept ? [shown, kept] : [shown], forces = all.flatMap((one) => one.force);
  const far = 1e6 * Math.max(...all.map((one) => one.until));
  const least = Math.min(0, ...forces), most = 1.1 * Math.max(1e-12, ...forces);
  const up = `force at bead ${shown.sensor}, N` + (kept ? "; dashed: the curve that was kept" : "");
  const at = axes(svg, 0, far, least, most, "time, µs", up);
  if (!at) return;
  const { x, y, part, width } = at;
  const line = (one) => one.time.map((time, i) => x(1e6 * time).toFixed(1) + "," + y(one.force[i]).toFixed(1)).join(" ");
  if (kept) part("polyline", { class: "kept", points: line(kept) });
  part("polyline", { class: "curve", points: line(shown) });
  for (const [name, wave] of Object.entries(shown.waves)) {
    if (wave.reason) continue;
    const place = x(1e6 * wave.arrival), high = y(wave.amplitude);
    part("circle", { class: "peak", cx: place, cy: high, r: 4 });
    const end = place > width - 90 ? "end" : "start";
    part("text", { x: place + (end === "end" ? -8 : 8), y: high - 6, "text-anchor": end }, name);
  }
  const words = Object.entries(shown.waves).filter(([, wave]) => wave.amplitude_ratio !== undefined)
    .map(([name, wave]) => `${name} wave AR ${wave.amplitude_ratio.toFixed(3)}`);
  svg.setAttribute("aria-label", [`Force at bead ${shown.sensor} over time`, ...words].join("; "));
  at.finish();
}

const asked = (place, changes = {}) =>
  fetch(place + "?" + new URLSearchParams([...new Map([...values, ...Object.entries(changes)]), ["token", token]]), { cache: "no-store" });

async function sketch() {
  const reply = await asked("/sketch").catch(() => null);
  if (reply && reply.ok && !running) byId("sketch").src = "data:image/svg+xml," + encodeURIComponent((await reply.json()).svg);
}

// AR at eleven values of a slider, the others as they are; a value that is moved meanwhile ends it.
const curve = { slider: null, points: [], at: 0 };

async function over() {
  const slider = sliders[byId("along").value], round = ++curve.at, count = 11;
  Object.assign(curve, { slider, points: [] });
  const low = +slider.low, span = +slider.high - low;
  const places = Array.from({ length: count }, (_, i) => low + span * i / (count - 1));
  for (const place of new Set(slider.whole ? places.map(Math.round) : places.map((one) => +one.toPrecision(9)))) {
    const reply = await asked("/answer", { [slider.name]: String(Math.min(place, +slider.high)) }).catch(() => null);
    if (round !== curve.at) return;
    if (reply && reply.ok) curve.points.push([place, (await reply.json()).waves.primary.amplitude_ratio]);
    drawCurve();
  }
}

function drawCurve() {
  const { slider, points } = curve, known = points.filter(([, ratio]) => ratio !== undefined);
  if (!slider || !points.length) return;
  byId("curve").classList.remove("empty");
  const most = 1.1 * Math.max(0.1, ...known.map(([, ratio]) => ratio));
  const across = slider.label + (slider.unit ? ", " + slider.unit : "");
  const at = axes(byId("curve"), +slider.low, +slider.high, 0, most, across, "AR of the primary wave");
  if (!at) return;
  at.part("polyline", { class: "curve", points: known.map(([x, y]) => at.x(x) + "," + at.y(y)).join(" ") });
  for (const [x, y] of known) at.part("circle", { class: "peak", cx: at.x(x), cy: at.y(y), r: 3 });
  at.finish();
}

async function save() {
  const reply = await asked("/case").catch(() => null), answer = reply ? await reply.json() : { error: "hertzlink does not answer" };
  if (!reply || !reply.ok) return fail(answer.error);
  const file = URL.createObjectURL(new Blob([answer.case], { type: "application/toml" }));
  made("a", { href: file, download: "case.toml" }).click();
  setTimeout(() => URL.revokeObjectURL(file), 1e3);
}

byId("keep").onclick = () => {
  kept = kept ? null : shown;
  byId("keep").textContent = kept ? "Remove the kept curve" : "Keep this curve";
  draw();
};
byId("reset").onclick = () => { sliders.forEach((one) => one.set(one.start)); ask(); };
byId("sliders").onsubmit = (event) => event.preventDefault();
byId("sliders").append(...sliders.map(control));
byId("export").onclick = save;
byId("over").onclick = over;
byId("along").append(...sliders.flatMap((one, i) => one.choices.length ? [] : [made("option", { value: i }, one.label)]));
new ResizeObserver(draw).observe(byId("trace"));
new ResizeObserver(drawCurve).observe(byId("curve"));
ask();
