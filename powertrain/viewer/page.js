"use strict";
// The page of one or two runs. The numbers and the plotting library are packed (gzip, base64) in this file; nothing is fetched.
(async () => {
const $ = (selector, root = document) => root.querySelector(selector);
const page = JSON.parse($("#page").textContent);
const COLOURS = ["#2f7fc1", "#d9822b", "#4b8f4b", "#c0392b", "#8a63b5", "#1f9e9e", "#b5862f", "#d0619c", "#6b7785", "#5a6fd6"];
const PX = 62, WIDEST = 24, THINNEST = 1.5, MOST_WIDTH = 34, MOST_ROWS = 400;

async function unpacked(id) {
  const bytes = Uint8Array.from(atob($(id).textContent), c => c.charCodeAt(0));
  $(id).remove();
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}

function element(tag, text = "", attributes = {}) {
  const made = document.createElement(tag);
  made.textContent = text;
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}

function drawn(tag, attributes = {}, text = "") {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  if (text) made.textContent = text;
  return made;
}

function number(value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (value !== 0 && (Math.abs(value) < 1e-3 || Math.abs(value) >= 1e6)) return value.toExponential(digits - 1);
  return String(Number(value.toPrecision(digits)));
}

const unitText = unit => (unit === "1" ? "" : unit.replace(/([A-Za-z])(-?\d+)/g, (_, a, n) => a + [...n].map(c => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)]).join("")).replaceAll(".", "·"));
const power = value => (Math.abs(value) >= 1e6 ? `${(value / 1e6).toFixed(2)} MW` : Math.abs(value) >= 1e3 ? `${(value / 1e3).toFixed(1)} kW` : `${value.toFixed(0)} W`);
const energy = (value, most) => (Math.abs(value) < 1e-9 * most ? "0 J" : joules(value));
const joules = value => (Math.abs(value) >= 1e6 ? `${number(value / 1e6)} MJ` : Math.abs(value) >= 1e3 ? `${number(value / 1e3)} kJ` : `${number(value)} J`);
const colour = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// ---- curves -------------------------------------------------------------------------------------------------------------------------
let numbers;

function unfold(run) {
  const time = new Float64Array(numbers, run.time[0], run.time[1]);
  run.cache = new Map();
  run.curve = name => {
    if (!run.cache.has(name) && run.curves[name]) {
      const [places, values, unit, meaning, mode] = run.curves[name];
      const at = new Uint32Array(numbers, places[0], places[1]);
      run.cache.set(name, { t: Array.from(at, k => time[k]), y: Array.from(new Float32Array(numbers, values[0], values[1])), unit, meaning, mode });
    }
    return run.cache.get(name);
  };
}

// The value at a time: straight lines between samples; at an event the value after it; the ends hold.
function valueAt(curve, t) {
  const last = curve.t.length - 1;
  if (t >= curve.t[last]) return curve.y[last];
  let low = 0, high = last;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (curve.t[middle] <= t) low = middle; else high = middle;
  }
  const duration = curve.t[high] - curve.t[low];
  const share = duration > 0 ? Math.max(0, (t - curve.t[low]) / duration) : 0;
  return curve.y[low] + share * (curve.y[high] - curve.y[low]);
}

const sum = (run, names, t) => names.reduce((total, name) => total + valueAt(run.curve(name), t), 0);

// ---- the schematic ------------------------------------------------------------------------------------------------------------------
const flow = { run: null, path: "", lines: [], boxes: [], most: 1 };

function arrowPath([x0, y0], [x1, y1], bend) {
  const mx = (x0 + x1) / 2 + bend * (y1 - y0), my = (y0 + y1) / 2 + Math.abs(bend) * Math.abs(x1 - x0);
  return `M${x0 * PX},${y0 * PX}Q${mx * PX},${my * PX} ${x1 * PX},${y1 * PX}`;
}

function drawFlow() {
  const layout = flow.run.layouts[flow.path], room = $("#flow .drawing");
  room.textContent = "";
  if (!layout) return;
  const [width, height] = layout.size.map(x => x * PX);
  const svg = drawn("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": "Schematic with power flow" });
  svg.style.cssText = `width:100%;min-width:${Math.min(width, 0.62 * width + 120)}px;max-width:${1.25 * width}px;display:block;margin:auto`;
  svg.innerHTML = '<defs><marker id="head" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="7" markerHeight="7" orient="auto"><path d="M0,1L10,5L0,9z"/></marker></defs>';
  for (const [start, end, bend] of layout.arrows) svg.append(drawn("path", { class: "signal", d: arrowPath(start, end, bend) }));
  flow.lines = layout.lines.map(line => drawLine(svg, line));
  flow.boxes = layout.boxes.map(box => drawBox(svg, box)).filter(Boolean);
  for (const line of flow.lines) svg.append(line.label);
  room.append(svg);
  flow.most = largest(layout);
  moveFlow();
}

function drawLine(svg, [unit, sign, names, points]) {
  const found = page.kinds.find(kind => kind[0] === unit);
  const d = "M" + points.map(([x, y]) => `${x * PX},${y * PX}`).join("L");
  const band = drawn("path", { d, fill: "none", stroke: found[2], "stroke-linecap": "round", "data-powers": names.join(" ") });
  const pulse = drawn("path", { d, class: "pulse", "stroke-dasharray": "5 15" });
  const middle = points[points.length >> 1], before = points[(points.length >> 1) - 1];
  const angle = Math.atan2(middle[1] - before[1], middle[0] - before[0]) * 180 / Math.PI;
  const arrow = drawn("path", { d: "M-6,-7L8,0L-6,7z", fill: found[2] });
  const label = drawn("text", { class: "power", x: middle[0] * PX, y: middle[1] * PX, "font-size": 11 });
  svg.append(band, pulse, arrow);
  return { sign, names, band, pulse, arrow, label, angle, middle, offset: 0, direction: 0 };
}

function drawBox(svg, [title, kind, x, y, detail]) {
  const [w, h] = page.box, group = drawn("g", { transform: `translate(${x * PX},${y * PX})` });
  svg.append(group);
  if (!title) {
    group.append(drawn("circle", { r: 4, fill: colour("--soft") }));
    return null;
  }
  group.append(drawn("rect", { class: "box", x: -w * PX / 2, y: -h * PX / 2, width: w * PX, height: h * PX, rx: 6 }));
  group.append(drawn("text", { y: -3, "font-size": 14 }, title), drawn("text", { class: "kind", y: 14, "font-size": Math.min(10, 190 / kind.length) }, kind));
  if (!detail) return null;
  group.setAttribute("class", detail.inside ? "part inside" : "part");
  group.setAttribute("data-path", detail.path);
  const loss = drawn("rect", { class: "loss", y: h * PX / 2 + 2, x: -w * PX / 2, height: 5 });
  const stored = drawn("rect", { class: "stored", y: h * PX / 2 + 9, x: -w * PX / 2, height: 5 });
  const hint = drawn("title");
  group.append(loss, stored, hint);
  group.addEventListener("click", () => { $("#signals input").value = `${detail.path}.`; listSignals(); });
  if (detail.inside) group.addEventListener("dblclick", () => enter(detail.path));
  return { ...detail, loss: detail.loss, bars: { loss, stored }, hint, width: w * PX };
}

// The largest power on any line of the layout, the full width, looked for at evenly spaced times: a spike at an event does not count.
function largest(layout) {
  const [first, last] = flow.run.span, count = 500;
  let most = 1e-9;
  for (const [, , names] of layout.lines) for (let k = 0; k <= count; k++) most = Math.max(most, Math.abs(sum(flow.run, names, first + (last - first) * k / count)));
  return most;
}

function moveFlow() {
  const run = flow.run;
  for (const line of flow.lines) {
    const value = line.names.length ? line.sign * sum(run, line.names, now) : 0;
    const share = Math.abs(value) / flow.most, width = share > 1e-4 ? Math.max(THINNEST, Math.min(WIDEST * share, MOST_WIDTH)) : 1;
    line.direction = share > 1e-4 ? Math.sign(value) : 0;
    line.band.setAttribute("stroke-width", width);
    line.band.setAttribute("stroke-opacity", line.direction ? 0.9 : 0.35);
    line.pulse.setAttribute("stroke-width", line.direction ? width : 0);
    const size = Math.max(0.7, (width + 7) / 14);
    line.arrow.setAttribute("transform", `translate(${line.middle[0] * PX},${line.middle[1] * PX}) rotate(${line.angle + (line.direction < 0 ? 180 : 0)}) scale(${size})`);
    line.arrow.setAttribute("visibility", line.direction ? "visible" : "hidden");
    line.label.setAttribute("y", line.middle[1] * PX - Math.max(width / 2, 7 * size) - 5);
    line.label.textContent = share > 2e-3 ? power(Math.abs(value)) : "";
  }
  for (const box of flow.boxes) moveBox(box, run);
}

function moveBox(box, run) {
  const loss = box.loss && run.curve(box.loss) ? valueAt(run.curve(box.loss), now) : 0;
  const received = sum(run, box.powers, now), rest = received - loss;
  const length = value => Math.min(box.width, box.width * Math.abs(value) / flow.most);
  box.bars.loss.setAttribute("width", length(loss) > 0.5 ? length(loss) : 0);
  const storing = box.source ? 0 : rest;
  box.bars.stored.setAttribute("width", length(storing) > 0.5 ? length(storing) : 0);
  box.bars.stored.setAttribute("class", storing < 0 ? "stored released" : "stored");
  const balance = box.source ? `gives ${power(-rest)} more than it receives and loses` : storing < 0 ? `releases ${power(-storing)}` : `stores ${power(storing)}`;
  box.hint.textContent = `${box.path}\nloses ${power(loss)}\n${balance}${box.inside ? "\nDouble-click to look inside" : ""}`;
}

function enter(path) {
  flow.path = path;
  const place = $("#place");
  place.textContent = "";
  if (path) {
    const back = element("button", "← back");
    back.addEventListener("click", () => {
      const outer = path.split(".").slice(0, -1);
      while (outer.length && !flow.run.layouts[outer.join(".")]) outer.pop();
      enter(outer.join("."));
    });
    place.append(back, ` ${path}`);
  }
  drawFlow();
}

// ---- signals ------------------------------------------------------------------------------------------------------------------------
const selected = new Map();  // name -> colour

function toggle(name, on) {
  if (on) selected.set(name, COLOURS.find(c => ![...selected.values()].includes(c)) ?? COLOURS[selected.size % COLOURS.length]);
  else selected.delete(name);
  listSignals();
  drawSignals();
}

function matching(names, text) {
  const words = text.toLowerCase().split(/\s+/).filter(Boolean);
  return names.filter(name => words.every(word => name.toLowerCase().includes(word)));
}

function listSignals() {
  const run = page.runs[0], list = $("#signals .list"), text = $("#signals input").value;
  const everything = [...new Set(page.runs.flatMap(one => Object.keys(one.curves)))];
  const searched = everything.map(name => `${name} ${(run.curves[name] ?? page.runs.at(-1).curves[name])[3]}`);
  const found = matching(searched, text).map(line => line.slice(0, line.search(/ |$/)));
  const chosen = [...selected.keys()], rest = (text ? found : everything).filter(name => !selected.has(name));
  list.textContent = "";
  for (const name of [...chosen, ...rest.slice(0, MOST_ROWS)]) list.append(row(name));
  if (text && !found.length) list.append(element("p", "No signal has this name or description."));
  if (rest.length > MOST_ROWS) list.append(element("p", `${rest.length - MOST_ROWS} more: search for them`));
  showValues();
}

function row(name) {
  const [, , unit, meaning] = page.runs.map(run => run.curves[name]).find(Boolean);
  const label = element("label", "", { title: meaning, "data-name": name }), box = element("input", "", { type: "checkbox" });
  box.checked = selected.has(name);
  if (box.checked) box.style.accentColor = selected.get(name);
  box.addEventListener("change", () => toggle(name, box.checked));
  label.append(box, element("span", name), box.checked ? element("output") : element("small", unitText(unit)));
  return label;
}

function showValues() {
  for (const label of document.querySelectorAll("#signals .list label")) {
    const output = $("output", label), name = label.dataset.name;
    if (!output) continue;
    const found = page.runs.map(run => run.curve(name)).filter(Boolean);
    output.textContent = `${found.map(curve => said(curve, valueAt(curve, now))).join(" | ")} ${found[0].mode ? "" : unitText(found[0].unit)}`;
  }
}

const said = (curve, value) => (curve.mode && page.modes[curve.mode]?.[Math.round(value)]) || number(value, 4);

function drawSignals() {
  const chart = $("#signals .chart"), groups = new Map();
  for (const [name, hue] of selected) {
    for (const [k, run] of page.runs.entries()) {
      const curve = run.curve(name);
      if (!curve) continue;
      const group = curve.mode ? `mode:${curve.mode}` : curve.unit;
      if (!groups.has(group)) groups.set(group, []);
      groups.get(group).push(trace(name, run, curve, hue, k));
    }
  }
  const rows = groups.size || 1, layout = { ...plain(), height: 90 + 175 * rows, hovermode: "x unified", shapes: [cursor()] };
  layout.xaxis = { ...axis("Time [s]"), range: spanned() ?? span, anchor: rows > 1 ? `y${rows}` : "y" };
  const traces = [];
  [...groups].forEach(([group, members], k) => {
    const key = k ? `y${k + 1}` : "y", gap = 0.05, size = (1 - gap * (rows - 1)) / rows, top = 1 - k * (size + gap);
    layout[key.replace("y", "yaxis")] = { ...axis(group.startsWith("mode:") ? "Mode" : `[${unitText(group) || "1"}]`), ...ticks(group), domain: [Math.max(0, top - size), top] };
    for (const one of members) traces.push({ ...one, yaxis: key });
  });
  Plotly.react(chart, traces, layout, CONFIG);
}

function trace(name, run, curve, hue, k) {
  const shown = page.runs.length > 1 ? `${name}, ${run.name}` : name;
  return { x: curve.t, y: curve.y, name: shown, mode: "lines", line: { color: hue, width: 1.5, dash: k ? "dash" : "solid" }, hovertemplate: `%{y:.5g} ${unitText(curve.unit)}`, type: "scatter" };
}

function ticks(group) {
  const named = page.modes[group.slice(5)];
  return group.startsWith("mode:") && named ? { tickvals: Object.keys(named).map(Number), ticktext: Object.values(named) } : {};
}

function spanned() {
  const range = $("#signals .chart").layout?.xaxis?.range;
  return range ? [...range] : null;
}

const cursor = () => ({ type: "line", xref: "x", yref: "paper", x0: now, x1: now, y0: 0, y1: 1, line: { color: colour("--soft"), width: 1, dash: "dot" } });

// ---- plots --------------------------------------------------------------------------------------------------------------------------
const CONFIG = { displaylogo: false, responsive: true, modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] };
const plain = () => ({ paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: colour("--text"), size: 12 }, margin: { l: 62, r: 12, t: 30, b: 42 }, legend: { orientation: "h", y: 1.02, yanchor: "bottom", x: 0 }, showlegend: true, hoverlabel: { bgcolor: colour("--raised"), font: { color: colour("--text") } } });
const axis = title => ({ title: { text: title, standoff: 8 }, gridcolor: colour("--line"), zerolinecolor: colour("--line"), linecolor: colour("--line"), automargin: true });

function drawMaps() {
  const grid = $("#maps .grid"), run = flow.run;
  grid.textContent = "";
  $("#maps").hidden = !run.maps.length;
  const rooms = run.maps.map(() => grid.appendChild(element("div")));  // all of them first: each has its width then
  run.charts = run.maps.map((map, k) => drawMap(rooms[k], run, map));
}

function drawMap(box, run, map) {
  const [xn, xt, xs, xv] = map.x, [yn, yt, ys, yv] = map.y, x = run.curve(xn), y = run.curve(yn);
  const points = operatingPoints(x, y, run.span), least = Math.min(0, ...points[0]) * xs, dark = matchMedia("(prefers-color-scheme: dark)").matches;
  const low = least < 0 ? 1.05 * least : 0;
  const contours = { start: map.levels[0], end: map.levels.at(-1), size: (map.levels.at(-1) - map.levels[0]) / Math.max(1, map.levels.length - 1), coloring: "heatmap", showlabels: true, labelfont: { size: 10, color: colour("--text") } };
  const traces = [{ type: "contour", x: xv, y: yv, z: map.values, zmin: map.levels[0], zmax: map.levels.at(-1), contours, colorscale: "Viridis", opacity: dark ? 0.55 : 0.5, reversescale: map.reversed, line: { width: 0.7 }, colorbar: { thickness: 12, tickvals: map.levels }, hovertemplate: `%{x:.4g}, %{y:.4g}: %{z:.4g}<extra></extra>`, showlegend: false }];
  for (const [name, lx, ly] of map.limits) traces.push({ x: lx, y: ly, mode: "lines", name, line: { width: 1.6, dash: traces.length > 1 ? "dash" : "solid", color: colour("--text") }, hoverinfo: "name" });
  traces.push({ x: points[0].map(v => v * xs), y: points[1].map(v => v * ys), mode: "markers", name: "this run", marker: { size: 3.5, color: COLOURS[1], opacity: 0.45 }, hoverinfo: "skip" });
  const layout = { ...plain(), height: 400, title: { text: `${map.path}: ${map.title}`, font: { size: 13 }, y: 0.99, yanchor: "top" }, margin: { l: 62, r: 12, t: 66, b: 42 }, xaxis: { ...axis(xt), range: [low, xv.at(-1) * 1.02] }, yaxis: axis(yt), shapes: [spot(valueAt(x, now) * xs, valueAt(y, now) * ys)] };
  Plotly.react(box, traces, layout, CONFIG);
  return () => Plotly.relayout(box, { "shapes[0].xanchor": valueAt(x, now) * xs, "shapes[0].yanchor": valueAt(y, now) * ys });
}

// The point of the present time, of one size whatever the axes.
const spot = (x, y) => ({ type: "circle", xsizemode: "pixel", ysizemode: "pixel", xanchor: x, yanchor: y, x0: -7, x1: 7, y0: -7, y1: 7, fillcolor: COLOURS[3], line: { color: "#ffffff", width: 2 } });

function operatingPoints(x, y, [first, last]) {
  const count = 1500, times = Array.from({ length: count }, (_, k) => first + (last - first) * k / (count - 1));
  return [times.map(t => valueAt(x, t)), times.map(t => valueAt(y, t))];
}

// ---- tables -------------------------------------------------------------------------------------------------------------------------
function table(head, rows, right = []) {
  const made = element("table"), top = element("tr");
  head.forEach((text, k) => top.append(element("th", text, right.includes(k) ? { class: "n" } : {})));
  made.append(top);
  for (const { cells, ...attributes } of rows) {
    const line = element("tr", "", attributes);
    cells.forEach((text, k) => line.append(element("td", text, right.includes(k) ? { class: "n" } : {})));
    made.append(line);
  }
  return made;
}

function place(selector, content, show = true) {
  $(selector).hidden = !show;
  const room = $(`${selector} .wide`);
  room.textContent = "";
  room.append(content);
}

function drawResults() {
  const [one, other] = page.runs, rows = one.results.map(([what, value, unit]) => ({ what, unit, values: [value, other?.results.find(row => row[0] === what)?.[1]] }));
  if (!other) return place("#results", table(["Quantity", "Value", "Unit"], rows.map(r => ({ cells: [r.what, number(r.values[0]), unitText(r.unit)] })), [1]), rows.length > 0);
  const more = (page.differences.signals ?? []).map(([what, unit, a, b, most]) => ({ cells: [what, number(a), number(b), number(b - a, 3), number(most, 3), unitText(unit)] }));
  const head = ["Quantity", one.name, other.name, "Difference", "Largest difference", "Unit"];
  const results = rows.map(r => ({ cells: [r.what, number(r.values[0]), number(r.values[1]), number(r.values[1] - r.values[0], 3), "", unitText(r.unit)] }));
  place("#results", table(head, [...results, ...more], [1, 2, 3, 4]), results.length + more.length > 0);
}

function drawEnergy() {
  const runs = page.runs.filter(run => run.energy.length);
  $("#energy").hidden = !runs.length;
  if (!runs.length) return;
  const paths = [...new Set(runs.flatMap(run => run.energy.map(row => row[0])))], of = (run, path) => run.energy.find(row => row[0] === path);
  const most = Math.max(...runs.flatMap(run => run.energy.map(row => Math.max(...row.slice(2).map(Math.abs)))));
  const shown = paths.filter(path => runs.some(run => of(run, path)?.slice(2).some(value => Math.abs(value) > 2e-4 * most)));
  const rows = shown.map(path => ({ cells: [path ? "\u2003".repeat(path.split(".").length - 1) + path.split(".").at(-1) : "whole model", runs.map(run => of(run, path)).find(Boolean)[1], ...runs.flatMap(run => of(run, path)?.slice(2).map(value => energy(value, most)) ?? ["–", "–", "–"])] }));
  const several = runs.length > 1 ? runs.map(run => `, ${run.name}`) : [""];
  place("#energy", table(["Component", "Class", ...several.flatMap(s => [`Supplied${s}`, `Lost${s}`, `Stored${s}`])], rows, [2, 3, 4, 5, 6, 7]));
  $("#energy .wide").append(element("p", `Supplied by sources, lost, and change of stored energy over the run. Energy residual: ${runs.map(run => run.closure.toExponential(1)).join(" and ")} of the energy exchanged.`, { class: "caption" }));
  const top = shown.filter(path => path && !path.includes(".")).map(path => [path, ...runs.map(run => of(run, path)?.[3] ?? 0)]).filter(row => Math.max(...row.slice(1)) > 5e-4 * most).sort((a, b) => a[1] - b[1]);
  const traces = runs.map((run, k) => ({ type: "bar", orientation: "h", name: run.name, y: top.map(row => row[0]), x: top.map(row => row[k + 1] / 1e3), marker: { color: COLOURS[k ? 1 : 3] }, hovertemplate: "%{y}: %{x:.4g} kJ<extra></extra>" }));
  Plotly.react($("#energy .chart"), traces, { ...plain(), height: 110 + 26 * top.length * runs.length, showlegend: runs.length > 1, xaxis: axis("Lost [kJ]"), yaxis: axis("") }, CONFIG);
}

function drawEvents() {
  const several = page.runs.length > 1, text = $("#events input").value;
  const all = page.runs.flatMap(run => run.events.map(event => [...event, run.name])).sort((a, b) => a[0] - b[0]);
  const found = all.filter(event => matching([event[1]], text).length);
  const rows = found.slice(0, MOST_ROWS).map(([t, law, change, run]) => ({ "data-t": t, cells: [t.toFixed(4), law, change, ...(several ? [run] : [])] }));
  place("#events", table(["Time [s]", "Law", "Change", ...(several ? ["Run"] : [])], rows, [0]), all.length > 0);
  if (found.length > MOST_ROWS) $("#events .wide").append(element("p", `${found.length - MOST_ROWS} more events: filter by law`, { class: "caption" }));
}

function drawParameters() {
  const [one, other] = page.runs, text = $("#parameters input").value, others = new Map((other?.parameters ?? []).map(row => [row[0], row]));
  const names = [...new Map([...one.parameters, ...others.values()].map(row => [row[0], row])).values()];
  const found = names.filter(([name, , , meaning]) => matching([`${name} ${meaning}`], text).length);
  const own = new Map(one.parameters.map(row => [row[0], row[1]]));
  const rows = found.map(([name, value, unit, meaning]) => {
    const [a, b] = [own.get(name), others.get(name)?.[1]];
    return { class: other && a !== b ? "differs" : "same", cells: [name, number(other ? a : value, 7), ...(other ? [number(b, 7)] : []), unitText(unit), meaning] };
  });
  if (other) rows.sort((a, b) => (b.class === "differs") - (a.class === "differs"));
  place("#parameters", table(["Name", ...(other ? [one.name, other.name] : ["Value"]), "Unit", "Meaning"], rows, other ? [1, 2] : [1]), names.length > 0);
}

// ---- time ---------------------------------------------------------------------------------------------------------------------------
const span = [Math.min(...page.runs.map(run => run.span[0])), Math.max(...page.runs.map(run => run.span[1]))];
let now = span[0], playing = false, before = 0, drawnAt = 0;

function seek(t, chartsToo = true) {
  now = Math.min(span[1], Math.max(span[0], t));
  $("#slider").value = now;
  $("#clock").textContent = `${now.toFixed(span[1] - span[0] < 20 ? 3 : 1)} s`;
  moveFlow();
  if (!chartsToo) return;
  showValues();
  Plotly.relayout($("#signals .chart"), { "shapes[0].x0": now, "shapes[0].x1": now });
  for (const move of flow.run.charts) move();
}

function frame(stamp) {
  if (!playing) return;
  const passed = Math.min(0.2, Math.max(0, (stamp - before) / 1e3));  // a frame may be stamped before the click
  before = stamp;
  for (const line of flow.lines) {
    line.offset -= line.direction * passed * 60;
    line.pulse.setAttribute("stroke-dashoffset", line.offset);
  }
  const charts = stamp - drawnAt > 60;
  if (charts) drawnAt = stamp;
  seek(now + passed * Number($("#speed").value), charts);
  if (now >= span[1]) play(false);
  requestAnimationFrame(frame);
}

function play(on) {
  if (on && now >= span[1]) seek(span[0]);
  playing = on;
  $("#play").textContent = on ? "❚❚" : "▶";
  $("#play").setAttribute("aria-label", on ? "Pause" : "Play");
  before = performance.now();
  if (on) requestAnimationFrame(frame);
  else seek(now);
}

// ---- start --------------------------------------------------------------------------------------------------------------------------
function choose(k) {
  flow.run = page.runs[k];
  $("#flow").hidden = !flow.run.layouts[""];
  $("#which select").value = k;
  enter("");
  drawMaps();
}

function listen() {
  $("#play").addEventListener("click", () => play(!playing));
  $("#slider").addEventListener("input", event => seek(Number(event.target.value)));
  $("#wires").addEventListener("change", event => $("#flow .drawing").classList.toggle("bare", !event.target.checked));
  $("#signals input").addEventListener("input", listSignals);
  $("#events input").addEventListener("input", drawEvents);
  $("#parameters input").addEventListener("input", drawParameters);
  $("#events .wide").addEventListener("click", event => { const line = event.target.closest("tr[data-t]"); if (line) seek(Number(line.dataset.t)); });
  $("#which select").addEventListener("change", event => choose(Number(event.target.value)));
  $("#signals .chart").on("plotly_click", event => seek(event.points[0].x));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { drawSignals(); drawMaps(); drawEnergy(); drawFlow(); });
  document.addEventListener("keydown", event => {
    if (event.target.matches("input, select, button")) return;
    if (event.key === " ") { event.preventDefault(); play(!playing); }
    if (event.key === "ArrowRight") seek(now + (span[1] - span[0]) / 500);
    if (event.key === "ArrowLeft") seek(now - (span[1] - span[0]) / 500);
  });
}

function introduce() {
  $("#about").textContent = page.runs.map(run => `${page.runs.length > 1 ? `${run.name}: ` : ""}${number(run.span[0])} to ${number(run.span[1])} s, ${Object.keys(run.curves).length} signals, ${run.events.length} events`).join("; ");
  const problems = page.runs.filter(run => run.message);
  $("#problem").hidden = !problems.length;
  $("#problem").textContent = problems.map(run => `${run.name} ended early: ${run.message}`).join("\n");
  for (const [, name, hue] of page.kinds) {
    const key = element("span"), line = element("i");
    line.style.background = hue;
    key.append(line, name);
    $(".keys").append(key, " ");
  }
  $("#which").hidden = page.runs.length < 2;
  page.runs.forEach((run, k) => $("#which select").append(element("option", run.name, { value: k })));
  const slider = $("#slider");
  [slider.min, slider.max] = span;
  $("#speed").value = span[1] - span[0] > 300 ? "20" : span[1] - span[0] > 30 ? "5" : span[1] - span[0] > 5 ? "1" : "0.1";
}

try {
  numbers = await unpacked("#numbers");
  const library = document.createElement("script");
  library.textContent = new TextDecoder().decode(await unpacked("#library"));
  document.head.append(library);
  library.remove();
  for (const run of page.runs) unfold(run);
  for (const name of page.show) selected.set(name, COLOURS[selected.size % COLOURS.length]);
  $("main").hidden = $("#player").hidden = false;
  introduce();
  drawResults();
  choose(0);
  listSignals();
  drawSignals();
  drawEnergy();
  drawEvents();
  drawParameters();
  listen();
  const asked = /t=([\d.e+-]+)/.exec(location.hash);
  seek(asked ? Number(asked[1]) : span[0]);
  document.documentElement.dataset.ready = "yes";
} catch (error) {
  const note = element("p", `This page cannot be shown: ${error.message}. It needs a browser of 2023 or later (Chrome 80, Firefox 113, Safari 16.4).`, { class: "failed" });
  document.body.prepend(note);
  throw error;
}
})();
