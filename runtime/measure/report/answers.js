// What the page has in common, and the first screen: five questions with figures and commands.

const points = list(report.points), byId = new Map(points.map(p => [p.id, p]));
const working = points.filter(p => p.status === "ok");
const comparable = working.filter(p => typeof get(p, "flags.dominated") === "boolean"); // those that fronts compare
const base = byId.get(report.default_id) || comparable[0] || working[0] || null;
const noise = get(report, "reference.noise_floor.mae");
const ofBase = path => (base ? get(base, path) : null);

/// What may be limited. `ao` errors compare with the noise floor.
const metrics = [
  {path: "ao.mae", name: "AO error, mean", text: figure, ao: true},
  {path: "ao.p99", name: "AO error, 99th percentile", text: figure},
  {path: "position.max", name: "largest vertex error, world units", text: figure},
  {path: "distance.to_source.rms", name: "RMS distance to the source, world units", text: figure},
  {path: "normal.max_degrees", name: "largest normal error, degrees", text: degrees},
].filter(m => comparable.some(p => isNumber(get(p, m.path))));

const state = {metric: metrics[0] || null, limit: 0, selected: base, listeners: []};
const onChange = listener => { state.listeners.push(listener); listener(); };
const changed = () => { for (const listener of state.listeners) listener(); };
function select(point) {
  state.selected = point;
  changed();
  announce(`Selected: ${point.label}`);
}

const within = point => state.metric && isNumber(get(point, state.metric.path)) && get(point, state.metric.path) <= state.limit;
/// The best point within the limit: by the figure, then by bytes, then by error.
function best(path, larger) {
  const sign = larger ? -1 : 1, keys = p => [sign * get(p, path), get(p, "bytes.file") ?? Infinity, get(p, "ao.mae") ?? Infinity];
  const fit = comparable.filter(p => within(p) && isNumber(get(p, path)));
  return fit.reduce((a, p) => (a === null || keys(p).reduce((d, k, i) => d || k - keys(a)[i], 0) < 0 ? p : a), null);
}

/// The geometry that a tile shows; none where the float picture shows no surface at all.
const placeName = tile => (tile.geometry === null ? el("span", {}, "background") : named(tile.geometry));

const overNoise = mae => (isNumber(mae) && isNumber(noise) && noise > 0 ? `${figure(mae / noise, 2)}\u00a0×\u00a0noise` : null);
const joined = (...parts) => parts.filter(p => p && p !== none).join(" · ");

/// A name that moves the detail view to a point.
const pointLink = point => el("button", {type: "button", class: "link", click: () => { select(point); document.getElementById("point").scrollIntoView(); }}, named(point.label));

const goals = [
  {name: "Smallest file", path: "bytes.file", text: bytes, extra: p => isNumber(get(p, "bytes.per_triangle")) ? `${figure(p.bytes.per_triangle)} bytes per triangle` : null},
  {name: "Fastest", path: "mrays_per_s.ao", larger: true, text: rate, extra: p => isNumber(get(p, "speed_ratio.ao")) ? `AO rays; ${times(p.speed_ratio.ao)} Embree` : "AO rays"},
  {name: "Least memory", path: "resident_bytes", text: bytes, extra: () => "resident while tracing"},
];

function goalCard(goal) {
  const point = best(goal.path, goal.larger);
  if (!point) return el("div", {class: "goal"}, el("h3", {}, goal.name), el("p", {class: "big none"}, none), el("p", {}, "No measured point has so small an error."));
  const value = get(point, goal.path), delta = change(value, ofBase(goal.path));
  return el("div", {class: "goal"}, el("h3", {}, goal.name),
    el("p", {class: "big"}, goal.text(value), el("span", {class: "delta"}, point === base ? "the default" : delta === "same" ? "as the default" : delta === none ? "" : `${delta} vs default`)),
    el("p", {}, pointLink(point), el("br"), el("span", {class: "muted"}, joined(goal.extra(point), `error ${figure(get(point, state.metric.path))}`, state.metric.ao ? overNoise(get(point, "ao.mae")) : null))),
    command(get(point, "commands.bake"), `Copy the command for: ${goal.name}`));
}

/// Two significant digits, not below the value, so that a limit made from an error includes it.
function roundedUp(value) {
  if (!(value > 0)) return 0;
  const unit = 10 ** (Math.floor(Math.log10(value)) - 1);
  return Number((Math.ceil(value / unit - 1e-9) * unit).toPrecision(2));
}

/// The field and slider for the limit. The strip marks the error of each point.
function limitControl() {
  const field = el("input", {id: "limit", type: "text", inputmode: "decimal", autocomplete: "off", spellcheck: "false", "aria-describedby": "limit-note"});
  const slider = el("input", {id: "limit-slider", type: "range", min: 0, max: 1000, step: 1, "aria-label": "Largest error, logarithmic"});
  const strip = el("div", {class: "strip", "aria-hidden": "true"});
  const note = el("p", {id: "limit-note", class: "muted"});
  const chips = el("div", {class: "chips", role: "group", "aria-label": "Common limits"});
  let range = [1e-6, 1];
  const share = v => Math.log(v / range[0]) / Math.log(range[1] / range[0]);

  function set(value, from) {
    if (!isNumber(value) || value < 0) {
      field.setAttribute("aria-invalid", "true");
      note.textContent = "Type a number that is not negative, such as 0.001 or 1e-4.";
      return;
    }
    field.removeAttribute("aria-invalid");
    state.limit = value;
    if (from !== field) field.value = String(Number(value.toPrecision(3)));
    if (from !== slider) slider.value = String(value > 0 ? Math.round(1000 * Math.min(1, Math.max(0, share(value)))) : 0);
    slider.setAttribute("aria-valuetext", state.metric.text(value));
    const fit = comparable.filter(within).length;
    note.textContent = joined(`${fit} of ${comparable.length} points within it`, state.metric.ao ? overNoise(value) : null);
    changed();
  }
  function useMetric() {
    const values = comparable.map(p => get(p, state.metric.path)).filter(isNumber), positive = values.filter(v => v > 0);
    if (state.metric.ao && noise > 0) positive.push(noise);
    range = positive.length ? [Math.min(...positive) / 1.6, Math.max(...positive) * 1.6] : [1e-6, 1];
    strip.replaceChildren(...values.map(v => el("i", {style: {left: `${100 * share(Math.max(v, range[0]))}%`}})));
    if (state.metric.ao && noise > 0) strip.append(el("b", {style: {left: `${100 * share(noise)}%`}}, "noise"));
    const own = ofBase(state.metric.path), sorted = [...positive].sort((a, b) => a - b);
    const choices = [
      ["the default's error", own],
      ...(state.metric.ao && noise > 0 ? [["a tenth of the noise", noise / 10], ["the noise", noise]] : [["median of the points", sorted[sorted.length >> 1]]]),
    ].filter(([, v]) => isNumber(v)).map(([text, v]) => [text, roundedUp(v)]);
    chips.replaceChildren(...choices.map(([text, v]) => el("button", {type: "button", click: () => set(v, null)}, text)));
    const asked = state.metric.path === "ao.mae" ? get(report, "settings.max_error") : null;
    set(isNumber(asked) ? asked : (choices[1] || choices[0] || [0, sorted[0] || 0])[1], null);
  }
  slider.addEventListener("input", () => set(Number((range[0] * (range[1] / range[0]) ** (slider.value / 1000)).toPrecision(2)), slider));
  field.addEventListener("input", () => set(field.value.trim() === "" ? NaN : Number(field.value.trim().replace(",", ".")), field));
  const chooser = el("select", {id: "metric", change: () => { state.metric = metrics[chooser.selectedIndex]; useMetric(); }}, metrics.map(m => el("option", {}, m.name)));
  useMetric();
  return el("div", {class: "limit"},
    el("div", {class: "fields"},
      el("label", {for: "limit"}, "Largest error I accept"), field,
      el("label", {for: "metric"}, "measured as"), chooser),
    el("div", {class: "slide"}, slider, strip),
    el("div", {class: "fields"}, chips, note));
}

function questionOne() {
  const blind = isNumber(noise) && noise === 0 ? el("p", {class: "warning"}, "The pictures show no occlusion, so its error says nothing about this scene. Measure with another ", el("code", {}, "--camera"), ", or choose the largest vertex error below.") : null;
  const results = el("div", {class: "goals", id: "goals"}), sentence = el("p", {class: "answer", id: "answer-1", "aria-live": "polite"});
  const card = el("section", {class: "card wide", "aria-labelledby": "q1"}, el("h2", {id: "q1"}, "What is the smallest, fastest or leanest file within my error, and which command makes it?"));
  if (!state.metric) {
    card.append(el("p", {}, unbroken(get(report, "answers.0.text") || "No point was measured completely.")), command(get(report, "answers.0.command")) || "");
    return card;
  }
  card.append(...[blind, limitControl(), sentence, results].filter(Boolean));
  onChange(() => {
    const [small, fast, lean] = goals.map(g => best(g.path, g.larger));
    const says = (point, path, text) => [text(get(point, path)), " (", named(point.label), ")"];
    sentence.replaceChildren(...(small
      ? ["The smallest is ", ...says(small, "bytes.file", bytes),
        ...(fast ? ["; the fastest traces ", ...says(fast, "mrays_per_s.ao", v => `${figure(v)} M AO rays/s`)] : []),
        ...(lean ? ["; the leanest holds ", ...says(lean, "resident_bytes", bytes)] : []), "."]
      : ["No measured point has so small an error. Finer steps, such as ", el("code", {}, "--position-bits 22"), ", come closest."]));
    results.replaceChildren(...goals.map(goalCard));
  });
  return card;
}

const bitPoints = working.filter(p => p.group === "positions" && get(p, "knobs.positions.kind") === "bits").sort((a, b) => a.knobs.positions.value - b.knobs.positions.value);

/// The worst tiles of a point, as float, packed and difference.
function cropRow(tiles) {
  return tiles.map(tile => el("li", {}, ["float", "packed", "difference"].map(kind =>
    pictureOf(tile[kind], `${kind} crop at ${tile.x}, ${tile.y}`) || el("span", {class: "hole"})),
    el("span", {class: "where"}, placeName(tile), el("span", {class: "muted"}, ` error ${figure(tile.mae, 2)}, at most ${figure(tile.max, 2)}`))));
}

function questionTwo() {
  const text = el("p", {class: "answer", id: "answer-2", "aria-live": "polite"}), crops = el("ul", {class: "crops"});
  const card = el("section", {class: "card", "aria-labelledby": "q2"}, el("h2", {id: "q2"}, "What do I lose at N bits, and where?"));
  if (bitPoints.length === 0) {
    card.append(el("p", {class: "answer"}, unbroken(get(report, "answers.1.text") || "No point varies the bits alone.")));
    return card;
  }
  const start = Math.max(0, bitPoints.findIndex(p => list(report.tiles).some(t => t.point_id === p.id)));
  const slider = el("input", {id: "bits", type: "range", min: 0, max: bitPoints.length - 1, step: 1, value: start}), out = el("output", {for: "bits"});
  function show() {
    const point = bitPoints[slider.value], bits = point.knobs.positions.value;
    out.textContent = `${bits} bits`;
    slider.setAttribute("aria-valuetext", out.textContent);
    const worst = get(point, "worst_geometries.by_error.0");
    text.replaceChildren(`At ${bits} bits per coordinate the AO error is ${figure(get(point, "ao.mae"))}`, overNoise(get(point, "ao.mae")) ? ` (${overNoise(get(point, "ao.mae"))})` : "",
      `, vertices move by up to ${figure(get(point, "position.max"))} units, and the file takes ${bytes(get(point, "bytes.file"))} (${change(get(point, "bytes.file"), ofBase("bytes.file"))}).`,
      ...(worst ? [" Worst geometry: ", named(worst.name), "."] : []));
    const all = list(report.tiles), ids = [...new Set(all.map(t => t.point_id))];
    const bitsOf = id => get(byId.get(id), "knobs.positions.value") ?? Infinity;
    const near = ids.sort((a, b) => Math.abs(bitsOf(a) - bits) - Math.abs(bitsOf(b) - bits))[0];
    const tiles = all.filter(t => t.point_id === near && pictureOf(t.packed, "")).slice(0, 3);
    crops.replaceChildren(...(tiles.length ? [el("li", {class: "heads", "aria-hidden": "true"}, ["float", "packed", "difference"].map(k => el("span", {}, k)),
      el("span", {class: "where"}, near === point.id ? "worst tiles" : `worst tiles of ${get(byId.get(near), "label") || near}`)), ...cropRow(tiles)] : []));
  }
  slider.addEventListener("input", show);
  show();
  card.append(el("div", {class: "fields line"}, el("label", {for: "bits"}, "Position bits"), slider, out), text, crops);
  return card;
}

/// What each stream could save within the limit: the smallest point of a group that changes that stream alone.
function savings() {
  const groups = [["positions", ["positions", "grid-step"]], ["normals", ["normals"]], ["trees", ["trees"]], ["all streams", ["codec"]], ["uv", ["uv"]]];
  return groups.map(([stream, names]) => {
    const fit = comparable.filter(p => names.includes(p.group) && within(p) && get(p, "bytes.file") < ofBase("bytes.file"));
    const point = fit.reduce((a, p) => (a === null || p.bytes.file < a.bytes.file ? p : a), null);
    return point && {stream, point, saved: point.bytes.file - ofBase("bytes.file"), error: get(point, "ao.mae") - ofBase("ao.mae")};
  }).filter(Boolean).sort((a, b) => a.saved - b.saved);
}

function questionThree() {
  const rows = el("div"), says = el("p", {class: "answer", id: "answer-3"});
  onChange(() => {
    const found = base ? savings() : [], own = found.length && found[0].stream === "all streams" ? found[1] : null;
    const streams = list(ofBase("bytes.streams")), largest = streams[0];
    const share = largest && ofBase("bytes.file") ? `${streamName(largest.name)} take ${Math.round(100 * largest.bytes / ofBase("bytes.file"))} % of the default file. ` : "";
    says.replaceChildren(share, ...(found.length ? ["Within your error, ", named(found[0].point.label), ` saves most: ${bytes(found[0].saved)}.`, ...(own ? [" Of single streams, cut ", el("strong", {}, own.stream), " with ", named(own.point.label), `: ${bytes(own.saved)}.`] : [])] : ["Within your error, no single change saves bytes."]));
    rows.replaceChildren(...(found.length ? [miniTable(["change", "bytes", "AO error"], found.slice(0, 3).map(f => [pointLink(f.point), bytes(f.saved), Math.abs(f.error) < 1e-9 ? "same" : signed(f.error, v => figure(v, 2))]), "Bytes that one change saves within the error"), command(get(found[0].point, "commands.bake"))] : []));
  });
  return el("section", {class: "card", "aria-labelledby": "q3"}, el("h2", {id: "q3"}, "Which stream is worth cutting next?"), says, base ? streamStrip(base) : null, rows);
}

const miniTable = (heads, rows, caption) => scroller(caption, el("table", {class: "mini"}, el("caption", {class: "quiet"}, caption),
  el("thead", {}, el("tr", {}, heads.map((h, i) => el("th", {scope: "col", class: i > 0 ? "number" : null}, h)))),
  el("tbody", {}, rows.map(r => el("tr", {}, r.map((c, i) => el(i === 0 ? "th" : "td", {scope: i === 0 ? "row" : null, class: i > 0 ? "number" : null}, c)))))));

/// Errors on one axis, with the noise floor at 1.
function noiseScale(width) {
  const height = 92, small = best("bytes.file", false), svg = el("svg", {width, height, viewBox: `0 0 ${width} ${height}`, role: "img"});
  const items = [{name: "default", v: ofBase("ao.mae"), className: "default"}, small && small !== base ? {name: "smallest", v: get(small, "ao.mae"), className: "front"} : null]
    .filter(i => i && isNumber(i.v)).map(i => ({...i, v: i.v / noise}));
  const positive = items.map(i => i.v).filter(v => v > 0);
  const lo = Math.min(0.1, ...positive) / 2, hi = Math.max(3, ...positive) * 2, x = logScale(lo, hi, 6, width - 6, v => figure(v, 1)), y = 46;
  svg.setAttribute("aria-label", items.map(i => `${i.name}: ${figure(i.v, 2)} times the noise`).join("; "));
  svg.append(el("rect", {class: "above", x: x.at(1), y: y - 8, width: width - 6 - x.at(1), height: 16}), el("line", {class: "axis", x1: 6, x2: width - 6, y1: y, y2: y}),
    el("line", {class: "rule noise", x1: x.at(1), x2: x.at(1), y1: y - 12, y2: y + 12}), el("text", {class: "label rule noise", x: x.at(1), y: y - 18, "text-anchor": "middle"}, "1 = noise"));
  items.forEach((item, i) => {
    const at = x.at(Math.max(item.v, lo)), end = at > width / 2 ? "end" : "start";
    svg.append(el("circle", {class: `mark ${item.className}`, cx: at, cy: y, r: 5}), el("text", {class: `label ${item.className}`, x: Math.max(at + (end === "end" ? 6 : -6), 2), y: i ? y + 36 : y + 20, "text-anchor": end}, `${item.name} ${figure(item.v, 2)}`));
  });
  return svg;
}

function questionFour() {
  const says = el("p", {class: "answer", id: "answer-4"}), holder = el("div", {class: "plot small"});
  const mae = ofBase("ao.mae"), spp = get(report, "settings.spp");
  const ratio = isNumber(mae) && noise > 0 ? mae / noise : null;
  says.textContent = ratio === null ? unbroken(get(report, "answers.3.text") || "The noise floor was not measured.")
    : `${ratio < 0.5 ? "No" : ratio < 1.5 ? "About the same" : "Yes"}: the default's AO error of ${figure(mae)} is ${figure(ratio, 2)} times the noise of ${spp} samples per pixel (${figure(noise)}).` +
      (ratio < 0.5 && ratio > 0 ? ` Samples would have to grow ${figure((1 / ratio) ** 2, 2)} times before it shows.` : "");
  const card = el("section", {class: "card", "aria-labelledby": "q4"}, el("h2", {id: "q4"}, "Is the error above sampling noise?"), says, holder);
  if (ratio !== null) {
    const draw = () => { if (holder.clientWidth) holder.replaceChildren(noiseScale(Math.floor(holder.clientWidth))); };
    state.listeners.push(draw);
    let width = 0;
    new ResizeObserver(() => { if (holder.clientWidth !== width) { width = holder.clientWidth; draw(); } }).observe(holder);
    const above = comparable.filter(p => get(p, "ao.mae") > noise).length;
    card.append(el("p", {class: "muted"}, `${above === 0 ? "None" : above} of ${comparable.length} points ${above < 2 ? "is" : "are"} above the noise. Both images share their samples, so the error is that of packing alone.`));
  }
  return card;
}

function questionFive() {
  const rows = working.filter(p => ["codec", "trees", "lod"].includes(p.group)).map(p => [pointLink(p),
    change(get(p, "bytes.file"), ofBase("bytes.file")),
    isNumber(get(p, "seconds.first_ray")) && isNumber(ofBase("seconds.first_ray")) ? signed(p.seconds.first_ray - ofBase("seconds.first_ray"), v => (Math.abs(v) < 5e-4 ? "0 s" : v < 0 ? `−${seconds(-v)}` : seconds(v))).replace("+0 s", "0 s") : none,
    isNumber(get(p, "speed_ratio.ao")) && isNumber(ofBase("speed_ratio.ao")) ? change(get(p, "speed_ratio.ao"), ofBase("speed_ratio.ao")) : change(get(p, "mrays_per_s.ao"), ofBase("mrays_per_s.ao"))]);
  return el("section", {class: "card", "aria-labelledby": "q5"}, el("h2", {id: "q5"}, "What do codec, trees and levels cost?"),
    el("p", {class: "answer", id: "answer-5"}, unbroken(get(report, "answers.4.text") || "Against the default:")),
    rows.length ? miniTable(["change", "bytes", "first ray", "rays/s"], rows, "Bytes, time to the first ray and AO rays a second against the default") : null,
    base ? el("p", {class: "muted"}, joined(`default: ${bytes(ofBase("bytes.file"))}`, `first ray after ${seconds(ofBase("seconds.first_ray"))}`, `${rate(ofBase("mrays_per_s.ao"))} AO rays`)) : null);
}

const answersSection = () => el("section", {id: "answers", "aria-label": "Answers"}, questionOne(), el("div", {class: "cards"}, questionTwo(), questionThree(), questionFour(), questionFive()));
