// One point in detail, and the table of all points.

const knobNames = {normals: "Normals", uvs: "Texture coordinates", textures: "Textures", codec: "Codec", trees: "Stored trees", lod: "Levels", purpose: "Purpose", spp: "Samples per pixel", frames: "Frames", denoise: "Denoiser", lod_error_px: "LOD error, px", backend: "Tracer", ao_resolution: "AO resolution"};

function positionKnob(knob) {
  if (!knob || knob.kind === "default" || knob.value === null) return "chosen by bake";
  return {bits: `${knob.value} bits`, relative: `step ${plain(knob.value)} of the diagonal`, absolute: `step ${plain(knob.value)} units`, edge: `step ${plain(knob.value)} of the median edge`}[knob.kind] || String(knob.value);
}

const definitions = rows => el("dl", {}, rows.filter(([, v]) => v && v !== none).map(([k, v]) => el("div", {}, el("dt", {}, k), el("dd", {}, v))));

function facts(point) {
  const f = (path, text) => text(get(point, path));
  const knobs = get(point, "knobs") || {};
  return el("div", {class: "grid three facts"},
    el("div", {}, el("h3", {}, "Options"), definitions([["Positions", positionKnob(knobs.positions)], ...Object.entries(knobNames).filter(([key]) => knobs[key] !== null && knobs[key] !== undefined && knobs[key] !== false).map(([key, name]) => [name, knobs[key] === true ? "on" : String(knobs[key])])])),
    el("div", {}, el("h3", {}, "Accuracy"), definitions([
      ["AO error, mean", joined(f("ao.mae", figure), overNoise(get(point, "ao.mae")))], ["RMS", f("ao.rmse", figure)], ["99th percentile", f("ao.p99", figure)], ["PSNR", isNumber(get(point, "ao.psnr_db")) ? `${figure(point.ao.psnr_db)} dB` : none],
      ["SSIM", isNumber(get(point, "ao.ssim")) ? figure(point.ao.ssim, 5) : none], ["FLIP", f("ao.flip", figure)], ["Pixels that hit in one image", f("ao.mismatched_pixels", count)],
      ["Vertex error, largest", f("position.max", figure)], ["of the diagonal", f("position.max_of_diagonal", figure)], ["Finest grid step", f("position.grid_step", figure)],
      ["Distance to the source, RMS", f("distance.to_source.rms", figure)], ["Distance to the source, largest", f("distance.to_source.max", figure)], ["Distance from the source, largest", f("distance.to_packed.max", figure)], ["Normal error, largest", f("normal.max_degrees", degrees)], ["Normal error, mean", f("normal.mean_degrees", degrees)],
      ["Collapsed triangles", f("triangles.collapsed", count)]])),
    el("div", {}, el("h3", {}, "Cost"), definitions([
      ["File", f("bytes.file", bytes)], ["Bytes per triangle", f("bytes.per_triangle", figure)], ["Decoded", f("bytes.memory", bytes)], ["Resident while tracing", f("resident_bytes", bytes)],
      ["Peak, bake", f("peak_bytes.bake", bytes)], ["Peak, render", f("peak_bytes.render", bytes)], ["Import", f("seconds.import", seconds)], ["Bake", f("seconds.bake", seconds)], ["Open", f("seconds.open", seconds)], ["Trees at load", f("seconds.bvh", seconds)], ["First ray after", f("seconds.first_ray", seconds)],
      ["Camera rays", joined(f("mrays_per_s.camera", rate), isNumber(get(point, "speed_ratio.camera")) ? `${times(point.speed_ratio.camera)} Embree` : null)], ["AO rays", joined(f("mrays_per_s.ao", rate), isNumber(get(point, "speed_ratio.ao")) ? `${times(point.speed_ratio.ao)} Embree` : null)],
      ["AO per frame", isNumber(get(point, "ms_per_frame.ao")) ? `${figure(point.ms_per_frame.ao)} ms` : none]])));
}

const histogramTitles = {ao: "AO error: pixels, log", position: "Distance: samples, log", normal: "Normal error: samples, log"};

function histograms(point) {
  const plots = Object.entries(histogramTitles).map(([key, title]) => {
    const h = get(point, `histograms.${key}`);
    if (!h || list(h.counts).length === 0 || list(h.edges).length !== h.counts.length + 1) return null;
    const total = h.counts.reduce((a, b) => a + b, 0);
    const bins = h.counts.map((n, i) => ({i, n}));
    return plot(title, null, width => histogram(width, {edges: h.edges, counts: h.counts, unit: h.unit || "", label: `${title}: ${count(total)} in ${h.counts.length} bins from 0 to ${figure(h.edges.at(-1))} ${h.unit || ""}`}),
      table([{name: "From", value: b => h.edges[b.i], text: b => figure(h.edges[b.i])}, {name: "To", value: b => h.edges[b.i + 1], text: b => figure(h.edges[b.i + 1])}, {name: "Count", value: b => b.n, text: b => count(b.n)}], bins, {caption: `Histogram: ${title}`}));
  }).filter(Boolean);
  return plots.length ? el("div", {class: "grid three"}, plots) : el("p", {class: "muted"}, "This point has no histograms here; report.json may have them.");
}

function worstTable(rows, caption, sort) {
  const columns = [{name: "Geometry", value: g => g.name, cell: g => named(g.name), numeric: false}, {name: "Triangles", value: g => g.triangles, text: g => count(g.triangles)}, {name: "Bytes", value: g => g.bytes, text: g => bytes(g.bytes)},
    {name: "B/triangle", value: g => (g.triangles > 0 ? g.bytes / g.triangles : null), text: g => figure(g.triangles > 0 ? g.bytes / g.triangles : NaN)}, {name: "Distance", value: g => g.max_distance, text: g => figure(g.max_distance)}, {name: "Normal", value: g => g.max_normal_degrees, text: g => degrees(g.max_normal_degrees)}];
  return el("div", {}, el("h3", {}, caption), table(columns, rows, {caption, sort, descending: true}));
}

function pointSection() {
  const chooser = el("select", {id: "point-choice"}, points.map(p => el("option", {value: p.id}, p.status === "ok" ? p.label : `${p.label} (${p.status})`)));
  const body = el("div");
  chooser.addEventListener("change", () => select(points[chooser.selectedIndex]));
  let shown = null;
  onChange(() => {
    const point = state.selected;
    if (!point || point === shown) return;
    shown = point;
    chooser.selectedIndex = points.indexOf(point);
    const worst = get(point, "worst_geometries") || {};
    body.replaceChildren(...[
      point.status === "ok" ? null : el("p", {class: "warning"}, `This point ${point.status === "failed" ? "failed" : `ended: ${point.status}`} (${get(point, "error.stage") || "unknown stage"}): `, named(get(point, "error.message") || "no message")),
      el("div", {class: "grid two"}, el("div", {}, el("h3", {}, "Bake"), command(get(point, "commands.bake"), "Copy the bake command")), el("div", {}, el("h3", {}, "Render"), command(get(point, "commands.render"), "Copy the render command"))),
      ...(point.status === "ok" ? [facts(point), histograms(point)] : []),
      el("div", {class: "grid two"}, list(worst.by_error).length ? worstTable(worst.by_error, "Worst geometries by error", 4) : null, list(worst.by_bytes).length ? worstTable(worst.by_bytes, "Largest geometries by bytes", 2) : null)].filter(Boolean));
  });
  return el("section", {id: "point", "aria-labelledby": "point-title"}, el("h2", {id: "point-title"}, "One point in detail"),
    el("div", {class: "fields"}, el("label", {for: "point-choice"}, "Point"), chooser), body);
}

function allSection() {
  const columns = [{name: "Point", value: p => p.label, cell: p => [pointLink(p), p === base ? el("span", {class: "tag"}, "default") : "", get(p, "flags.knee") ? el("span", {class: "tag"}, "knee") : ""], numeric: false}, {name: "Group", value: p => p.group, numeric: false}];
  const add = (name, path, text) => columns.push({name, value: p => get(p, path), text: p => text(get(p, path))});
  add("File", "bytes.file", bytes);
  add("B/tri", "bytes.per_triangle", figure);
  add("AO error", "ao.mae", figure);
  add("× noise", "ao.noise_ratio", v => figure(v, 2));
  add("AO p99", "ao.p99", figure);
  add("Vertex error", "position.max", figure);
  add("Normal", "normal.max_degrees", degrees);
  add("First ray", "seconds.first_ray", seconds);
  add("AO rays", "mrays_per_s.ao", rate);
  add("vs Embree", "speed_ratio.ao", times);
  add("Resident", "resident_bytes", bytes);
  add("Bake", "seconds.bake", seconds);
  const failed = points.filter(p => p.status !== "ok");
  return el("section", {id: "all", "aria-labelledby": "all-title"}, el("h2", {id: "all-title"}, "All points"), table(columns, working, {caption: "All points that were measured", className: "wide-table"}),
    failed.length ? [el("h3", {}, "Not measured"), table([{name: "Point", value: p => p.label, cell: pointLink, numeric: false}, {name: "Status", value: p => p.status, numeric: false}, {name: "Stage", value: p => get(p, "error.stage"), numeric: false}, {name: "Exit code", value: p => get(p, "error.exit_code")}, {name: "Message", value: p => get(p, "error.message"), cell: p => named(get(p, "error.message")), numeric: false}], failed, {caption: "Points that failed"})] : null);
}
