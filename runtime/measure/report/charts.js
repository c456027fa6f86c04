// Trade-offs, bytes by stream, levels of detail and the denoiser.

const frontTexts = {"bytes.file": bytes, resident_bytes: bytes, "mrays_per_s.ao": rate};
const frontTitles = {"bytes-error": "Size against error", "speed-error": "Speed against error", "memory-error": "Memory against error", "bytes-distance": "Size against distance"};

/// What a tooltip says about a point.
function pointTip(point, more = 0) {
  const line = (name, value) => (value && value !== none ? el("div", {class: "row"}, el("span", {}, name), el("b", {}, value)) : null);
  return [el("strong", {}, named(point.label)),
    line("file", joined(bytes(get(point, "bytes.file")), isNumber(get(point, "bytes.per_triangle")) ? `${figure(point.bytes.per_triangle)} B/triangle` : null)),
    line("AO error", joined(figure(get(point, "ao.mae")), overNoise(get(point, "ao.mae")))), line("distance, RMS", figure(get(point, "distance.to_source.rms"))),
    line("AO rays", rate(get(point, "mrays_per_s.ao"))), line("resident", bytes(get(point, "resident_bytes"))),
    code(get(point, "commands.bake") || ""), more > 0 ? el("div", {class: "muted"}, `and ${more} more at this place`) : null].filter(Boolean);
}

function frontPlot(front, width) {
  const height = 320, left = 62, bottom = 38, right = 16, top = 30;
  const shown = comparable.filter(p => isNumber(get(p, front.x)) && isNumber(get(p, front.y)));
  const svg = el("svg", {width, height, viewBox: `0 0 ${width} ${height}`, role: "group", "aria-label": `${frontTitles[front.name] || front.name}: ${shown.length} points, ${list(front.ids).length} on the front. Arrow keys move between points.`});
  const larger = front.x.startsWith("mrays"), xs = shown.map(p => get(p, front.x)), ys = shown.map(p => get(p, front.y)), ao = front.y === "ao.mae";
  const xLog = Math.min(...xs) > 0 && Math.max(...xs) / Math.min(...xs) > 2.5;
  const text = v => (front.x.startsWith("mrays") ? plain(v) : bytes(v, plain));
  const x = (xLog ? logScale : linearScale)(...padded(xs, xLog), left, width - right, text, width < 420 ? 4 : 6);
  const y = logScale(...padded([...ys, ...(ao && noise > 0 ? [noise] : [])], true), height - bottom, top, v => plain(v, 2));
  // A front is a staircase: between two of its points, the worse one still holds.
  const place = p => ({x: x.at(get(p, front.x)), y: y.at(get(p, front.y))});
  const ids = new Set(list(front.ids)), on = shown.filter(p => ids.has(p.id)).sort((a, b) => get(a, front.x) - get(b, front.x) || get(b, front.y) - get(a, front.y)).map(place);
  const corners = on.flatMap((p, i) => (i === 0 ? [p] : larger ? [{x: on[i - 1].x, y: p.y}, p] : [{x: p.x, y: on[i - 1].y}, p]));
  const spots = [...shown.map(place), ...along(corners)], ruled = [];
  frame(svg, width, height, x, y, {xTitle: `${front.x_label || front.x}${xLog ? ", log" : ""}${larger ? " (higher is better)" : ""}`, yTitle: `${front.y_label || front.y}, log`, left, bottom, right, top});
  if (state.metric && state.metric.path === front.y && state.limit > y.lo) {
    const at = Math.max(y.at(state.limit), top);
    svg.append(el("rect", {class: "within", x: left, y: at, width: width - right - left, height: height - bottom - at}));
    if (state.limit < y.hi) ruled.push(...drawRule(svg, {y: state.limit, text: "your error", className: "front"}, y, left, width - right, spots));
  }
  if (ao && noise > 0) ruled.push(...drawRule(svg, {y: noise, text: "noise floor", className: "noise"}, y, left, width - right, spots));
  if (corners.length > 1) svg.append(el("path", {class: "curve front", d: pathOf(corners)}));
  const marks = [], labels = [];
  const sorted = [...shown].sort((a, b) => ids.has(a.id) - ids.has(b.id) || (a === base) - (b === base) || get(a, front.x) - get(b, front.x));
  for (const point of sorted) {
    const mark = {x: x.at(get(point, front.x)), y: y.at(get(point, front.y)), data: point, node: null};
    const knee = point.id === front.knee_id;
    const className = `mark ${ids.has(point.id) ? "front" : "dominated"}${point === base ? " default" : ""}${knee ? " knee" : ""}`;
    if (point === state.selected) svg.append(el("circle", {class: "halo", cx: mark.x, cy: mark.y, r: 11}));
    const said = `${point.label}: ${front.x_label || front.x} ${text(get(point, front.x))}, ${front.y_label || front.y} ${figure(get(point, front.y))}${ids.has(point.id) ? ", on the front" : ", dominated"}${knee ? ", knee" : ""}${point === base ? ", default" : ""}`;
    mark.node = knee
      ? el("path", {class: className, role: "button", "aria-label": said, d: `M${mark.x} ${mark.y - 7}L${mark.x + 7} ${mark.y}L${mark.x} ${mark.y + 7}L${mark.x - 7} ${mark.y}Z`})
      : el("circle", {class: className, role: "button", "aria-label": said, cx: mark.x, cy: mark.y, r: point === base ? 6 : ids.has(point.id) ? 5 : 4});
    svg.append(mark.node);
    marks.push(mark);
    if (knee || point === base) labels.push({...mark, text: joined(knee ? "knee" : "", point === base ? "default" : ""), className: point === base ? "default" : "front"});
  }
  placeLabels(svg, labels, [...marks, ...along(corners), ...ruled], width, height);
  interactive(svg, [...marks].sort((a, b) => a.x - b.x), (mark, more) => pointTip(mark.data, more), select);
  return svg;
}

function tradeSection() {
  const order = ["bytes-error", "speed-error", "memory-error", "bytes-distance"];
  const fronts = list(report.fronts).filter(f => f && f.x && f.y).sort((a, b) => order.indexOf(a.name) - order.indexOf(b.name));
  const plots = fronts.map(front => plot(frontTitles[front.name] || front.name, null, width => frontPlot(front, width),
    table([{name: "Point", value: p => p.label, cell: pointLink, numeric: false}, {name: front.x_label || front.x, value: p => get(p, front.x), text: p => (frontTexts[front.x] || figure)(get(p, front.x))},
      {name: front.y_label || front.y, value: p => get(p, front.y), text: p => figure(get(p, front.y))}, {name: "Front", value: p => (list(front.ids).includes(p.id) ? "yes" : "no"), numeric: false}],
    comparable.filter(p => isNumber(get(p, front.x)) && isNumber(get(p, front.y))), {caption: `${frontTitles[front.name] || front.name}: all points`, sort: 1})));
  const chosen = el("div", {class: "chosen", id: "chosen"});
  let queued = false; // a slider may move several times per frame
  const redraw = () => {
    queued = false;
    for (const p of plots) p.redraw();
  };
  onChange(() => {
    if (!queued) requestAnimationFrame(redraw);
    queued = true;
    const point = state.selected;
    if (!point) return;
    chosen.replaceChildren(el("div", {}, el("span", {class: "muted"}, "Selected: "), pointLink(point), " ", el("span", {class: "muted"}, joined(bytes(get(point, "bytes.file")), `AO error ${figure(get(point, "ao.mae"))}`, rate(get(point, "mrays_per_s.ao"))))),
      command(get(point, "commands.bake"), "Copy the command of the selected point") || "");
  });
  return el("section", {id: "trade", "aria-labelledby": "trade-title"}, el("h2", {id: "trade-title"}, "Trade-offs"),
    el("p", {class: "legend"}, el("span", {class: "key front"}, "on the Pareto front"), el("span", {class: "key dominated"}, "dominated: another point is at least as good in both"), el("span", {class: "key knee"}, "knee"), el("span", {class: "key default"}, "default")),
    el("p", {class: "muted"}, "Lower is better on every vertical axis. Hover, or use the arrow keys, for figures and the command; click or press Enter to select a point in all plots and below."),
    chosen, el("div", {class: "grid two"}, plots));
}

// ---- Bytes by stream

const streamOrder = (() => {
  const totals = new Map();
  for (const p of working) for (const s of list(get(p, "bytes.streams"))) totals.set(s.name, (totals.get(s.name) || 0) + s.bytes);
  return [...totals].sort((a, b) => b[1] - a[1]).map(([name]) => name);
})();
const shownStreams = streamOrder.slice(0, 6);
const streamName = name => name === "other" ? "other" : String(name).replaceAll("_", " ").replace(/^lod\b/, "LOD").replace(/^./, c => c.toUpperCase());

/// Bytes of the streams that have a colour; the rest as "other".
function streamsOf(point) {
  const own = new Map(list(get(point, "bytes.streams")).map(s => [s.name, s.bytes]));
  const parts = shownStreams.map((name, i) => ({name, bytes: own.get(name) || 0, className: `s${i}`}));
  const rest = [...own].filter(([name]) => !shownStreams.includes(name)).reduce((sum, [, b]) => sum + b, 0);
  return [...parts, {name: "other", bytes: rest, className: "s6"}];
}

const streamLegend = () => el("p", {class: "legend"}, [...shownStreams, "other"].map((name, i) => el("span", {class: `key s${i}`}, streamName(name))));

/// The streams of one point as a single bar.
function streamStrip(point) {
  const total = get(point, "bytes.file") || 1, parts = streamsOf(point).filter(s => s.bytes > 0);
  return el("div", {class: "stream-strip", role: "img", "aria-label": parts.map(s => `${streamName(s.name)} ${figure(100 * s.bytes / total, 2)} %`).join(", ")},
    parts.map(s => el("span", {class: s.className, style: {width: `${100 * s.bytes / total}%`}}, el("i"), el("b", {}, streamName(s.name)), el("b", {}, `${Math.round(100 * s.bytes / total)}\u00a0%`))));
}

function streamPlot(width, rows) {
  const narrow = width < 560, rowHeight = narrow ? 40 : 26, left = narrow ? 4 : Math.min(330, 7.2 * Math.max(12, ...rows.map(p => p.label.length)) + 14), longest = narrow ? Math.floor(width / 7) : 44, right = 70, height = rows.length * rowHeight + 8;
  const most = Math.max(...rows.map(p => get(p, "bytes.file") || 0), 1), scale = (width - left - right) / most;
  const svg = el("svg", {width, height, viewBox: `0 0 ${width} ${height}`, role: "group", "aria-label": `Bytes by stream of ${rows.length} points; the table below has the figures`});
  rows.forEach((point, i) => {
    const y = i * rowHeight + (narrow ? 18 : 4), h = 18;
    let at = left;
    const label = point.label.length > longest ? `${point.label.slice(0, longest - 1)}…` : point.label;
    svg.append(el("text", {class: `row-label${point === base ? " default" : ""}`, x: narrow ? left : left - 10, y: narrow ? y - 5 : y + 13, "text-anchor": narrow ? "start" : "end"}, label));
    for (const s of streamsOf(point)) {
      if (s.bytes <= 0) continue;
      const w = s.bytes * scale, bar = el("rect", {class: `bar ${s.className}`, x: at, y, width: Math.max(w, 0.5), height: h});
      bar.addEventListener("pointermove", event => showTip([el("strong", {}, named(point.label)), el("div", {class: "row"}, el("span", {}, streamName(s.name)), el("b", {}, `${bytes(s.bytes)} (${figure(100 * s.bytes / point.bytes.file, 2)} %)`))], event.clientX, event.clientY));
      bar.addEventListener("pointerleave", hideTip);
      svg.append(bar);
      at += w;
    }
    svg.append(el("text", {x: at + 6, y: y + 13}, bytes(get(point, "bytes.file"))));
  });
  return svg;
}

function streamSection() {
  const sized = working.filter(p => isNumber(get(p, "bytes.file")));
  const front = new Set(list((list(report.fronts).find(f => f.name === "bytes-error") || {}).ids));
  const choices = [["Default and the front", p => p === base || front.has(p.id)],
    ...[...new Set(sized.map(p => p.group))].filter(g => !["default", "spp", "denoise", "resolution", "lod-error", "backend"].includes(g)).map(g => [`Default and ${g}`, p => p === base || p.group === g]),
    ["All points", () => true]];
  const chooser = el("select", {id: "stream-rows"}, choices.map(([name]) => el("option", {}, name)));
  const rows = () => sized.filter(choices[chooser.selectedIndex][1]).sort((a, b) => b.bytes.file - a.bytes.file);
  const box = plot(null, null, width => streamPlot(width, rows()),
    table([{name: "Point", value: p => p.label, cell: pointLink, numeric: false}, {name: "File", value: p => p.bytes.file, text: p => bytes(p.bytes.file)},
      ...[...shownStreams, "other"].map((name, i) => ({name: streamName(name), value: p => streamsOf(p)[i].bytes, text: p => bytes(streamsOf(p)[i].bytes)}))], sized, {caption: "Bytes by stream of all points", sort: 1, descending: true}));
  chooser.addEventListener("change", () => box.redraw());
  return el("section", {id: "streams", "aria-labelledby": "streams-title"}, el("h2", {id: "streams-title"}, "Bytes by stream"),
    el("div", {class: "fields"}, el("label", {for: "stream-rows"}, "Show"), chooser), streamLegend(), box);
}

// ---- Levels and denoiser

const tipRows = (title, rows) => [el("strong", {}, title), ...rows.filter(([, v]) => v && v !== none).map(([k, v]) => el("div", {class: "row"}, el("span", {}, `${k} `), el("b", {}, v)))];

function levelPlots() {
  const levels = list(report.lod).filter(l => isNumber(get(l, "ao.mae")) && isNumber(l.triangles));
  if (levels.length === 0) return [];
  const describe = l => tipRows(`${plain(l.error_px)} px`, [["triangles", count(l.triangles)], ["AO error", joined(figure(get(l, "ao.mae")), overNoise(get(l, "ao.mae")))], ["AO rays", rate(get(l, "mrays_per_s.ao"))], ["AO per frame", isNumber(get(l, "ms_per_frame.ao")) ? `${figure(l.ms_per_frame.ao)} ms` : none]]);
  const columns = [{name: "Error, px", value: l => l.error_px, text: l => plain(l.error_px)}, {name: "Triangles", value: l => l.triangles, text: l => count(l.triangles)},
    {name: "AO error", value: l => get(l, "ao.mae"), text: l => figure(get(l, "ao.mae"))}, {name: "× noise", value: l => get(l, "ao.noise_ratio"), text: l => figure(get(l, "ao.noise_ratio"), 2)},
    {name: "AO rays", value: l => get(l, "mrays_per_s.ao"), text: l => rate(get(l, "mrays_per_s.ao"))}];
  return [plot("Levels of detail: error against triangles", "The default file with levels, traced at each --lod-error (labels, pixels).", width => linePlot(width, {
    series: [{name: "levels", className: "front", points: levels.map(l => ({x: l.triangles, y: l.ao.mae, label: `${plain(l.error_px)} px`, data: l}))}],
    xLog: true, yLog: true, xText: v => shortCount(v), yText: v => plain(v, 2), xTitle: "triangles in use, log", yTitle: "AO error (MAE), log", describe,
    label: "AO error against triangles for each LOD error", rules: noise > 0 ? [{y: noise, text: "noise floor", className: "noise"}] : []}), table(columns, levels, {caption: "Levels of detail", sort: 0}))];
}

const shortCount = v => (v >= 1e9 ? `${plain(v / 1e9)} G` : v >= 1e6 ? `${plain(v / 1e6)} M` : v >= 1e3 ? `${plain(v / 1e3)} k` : plain(v));

function convergencePlots() {
  const steps = list(report.convergence).filter(s => isNumber(get(s, "noisy.mae")) && isNumber(get(s, "denoised.mae")));
  if (steps.length === 0) return [];
  const describe = ({step, kind}) => tipRows(`${count(step.frames)} ${step.frames === 1 ? "frame" : "frames"}, ${kind}`, [["AO error", joined(figure(get(step, `${kind}.mae`)), overNoise(get(step, `${kind}.mae`)))], ["SSIM", figure(get(step, `${kind}.ssim`))], ["denoiser", isNumber(get(step, "ms_per_frame.denoise")) && kind === "denoised" ? `${figure(step.ms_per_frame.denoise)} ms per frame` : none]]);
  const curve = (kind, className) => ({name: kind, className, points: steps.map((s, i) => ({x: s.frames, y: get(s, `${kind}.mae`), label: i === steps.length - 1 ? kind : null, data: {step: s, kind}}))});
  const columns = [{name: "Frames", value: s => s.frames, text: s => count(s.frames)}, {name: "Noisy, MAE", value: s => s.noisy.mae, text: s => figure(s.noisy.mae)}, {name: "Denoised, MAE", value: s => s.denoised.mae, text: s => figure(s.denoised.mae)},
    {name: "Denoised, SSIM", value: s => get(s, "denoised.ssim"), text: s => figure(get(s, "denoised.ssim"))}, {name: "Denoiser, ms", value: s => get(s, "ms_per_frame.denoise"), text: s => figure(get(s, "ms_per_frame.denoise"))}];
  return [plot("Denoiser: error against frames", `${get(steps[0], "spp") ?? 1} sample per pixel and frame, against the float reference.`, width => linePlot(width, {
    series: [curve("noisy", "dominated"), curve("denoised", "front")], xLog: true, yLog: true, xTicks: steps.map(s => s.frames), xText: count, yText: v => plain(v, 2),
    xTitle: "frames, log", yTitle: "AO error (MAE), log", describe, label: "AO error of noisy and denoised images against frames",
    rules: noise > 0 ? [{y: noise, text: `noise of ${get(report, "settings.spp")} samples`, className: "noise"}] : []}), table(columns, steps, {caption: "Convergence of the denoiser", sort: 0}))];
}

/// Error of full and quarter resolution against the rays that they need.
function resolutionPlots() {
  const rows = list(report.resolution).filter(r => isNumber(get(r, "ao.mae")) && r.rays > 0);
  if (rows.length === 0) return [];
  const describe = r => tipRows(`${r.ao_resolution} resolution, ${count(r.spp)} spp`, [["AO rays", shortCount(r.rays)], ["AO error", joined(figure(r.ao.mae), overNoise(r.ao.mae))], ["SSIM", figure(get(r, "ao.ssim"))], ["tracing", `${figure(get(r, "ms.ao"))} ms`], ["upsampling", r.ao_resolution === "quarter" ? `${figure(get(r, "ms.upsample"))} ms` : none]]);
  const curve = (kind, className) => ({name: kind, className, points: rows.filter(r => r.ao_resolution === kind).sort((a, b) => a.rays - b.rays).map((r, i, all) => ({x: r.rays, y: r.ao.mae, label: `${i + 1 < all.length ? "" : `${kind}, `}${r.spp} spp`, data: r}))});
  const columns = [{name: "Resolution", value: r => r.ao_resolution, numeric: false}, {name: "Samples", value: r => r.spp, text: r => count(r.spp)}, {name: "AO rays", value: r => r.rays, text: r => count(r.rays)},
    {name: "AO error", value: r => r.ao.mae, text: r => figure(r.ao.mae)}, {name: "RMS", value: r => get(r, "ao.rmse"), text: r => figure(get(r, "ao.rmse"))}, {name: "Tracing, ms", value: r => get(r, "ms.ao"), text: r => figure(get(r, "ms.ao"))}, {name: "Upsampling, ms", value: r => get(r, "ms.upsample"), text: r => figure(get(r, "ms.upsample"))}];
  return [plot("Occlusion at quarter resolution", "One frame without denoiser, against the float reference. Quarter resolution traces one of 2 × 2 pixels.", width => linePlot(width, {
    series: [curve("full", "dominated"), curve("quarter", "front")], xLog: true, yLog: true, xText: v => shortCount(v), yText: v => plain(v, 2), xTitle: "AO rays, log", yTitle: "AO error (MAE), log", describe,
    label: "AO error of full and quarter resolution against rays", rules: noise > 0 ? [{y: noise, text: `noise of ${get(report, "settings.spp")} samples`, className: "noise"}] : []}), table(columns, rows, {caption: "Occlusion at full and quarter resolution", sort: 2}))];
}

function stabilitySection() {
  const cases = list(report.stability);
  if (cases.length === 0) return null;
  const columns = [{name: "Scene", value: c => c.name, numeric: false}, {name: "Triangles", value: c => c.triangles, text: c => count(c.triangles)},
    {name: "Wrong hit or miss, pixels", value: c => c.wrong_pixels, text: c => count(c.wrong_pixels)}, {name: "Wrong depth, pixels", value: c => c.wrong_depths, text: c => count(c.wrong_depths)},
    {name: "AO error", value: c => c.ao_mae, text: c => figure(c.ao_mae)}, {name: "Self-intersections", value: c => c.self_intersections, text: c => count(c.self_intersections)},
    {name: "Leaks", value: c => c.leaks, text: c => count(c.leaks)}, {name: "Bake", value: c => (c.warned ? "warns" : ""), numeric: false}];
  return el("section", {id: "extremes", "aria-labelledby": "extremes-title"}, el("h2", {id: "extremes-title"}, "At the extremes"),
    el("p", {class: "muted"}, `Scenes of the program's own at extremes of size, place and shape, with default options. Each of ${count(cases[0].pixels)} pixels is compared with the source floats in extended precision; depths are wrong if they differ by more than 0.1 %. Occlusion rays of convex shapes must hit nothing, those within closed shapes must hit something.`),
    table(columns, cases, {caption: "Numerical stability"}));
}

function levelSection() {
  const plots = [...levelPlots(), ...convergencePlots(), ...resolutionPlots()];
  return plots.length === 0 ? null : el("section", {id: "levels", "aria-labelledby": "levels-title"}, el("h2", {id: "levels-title"}, "Levels of detail, denoiser and resolution"), el("div", {class: "grid two"}, plots));
}
