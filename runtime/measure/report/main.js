// The page from top to bottom.

function themeButton() {
  const root = document.documentElement, dark = matchMedia("(prefers-color-scheme: dark)");
  let chosen = null;
  try { chosen = localStorage.getItem("packtrace-theme"); } catch { /* files may have no storage */ }
  const button = el("button", {type: "button", id: "theme"});
  const use = theme => {
    root.dataset.theme = theme;
    button.textContent = theme === "dark" ? "Light" : "Dark";
    button.setAttribute("aria-label", theme === "dark" ? "Use light colours" : "Use dark colours");
  };
  const current = () => chosen || (dark.matches ? "dark" : "light");
  button.addEventListener("click", () => {
    chosen = current() === "dark" ? "light" : "dark";
    try { localStorage.setItem("packtrace-theme", chosen); } catch { /* as above */ }
    use(chosen);
  });
  dark.addEventListener("change", () => use(current()));
  addEventListener("beforeprint", () => use("light"));
  addEventListener("afterprint", () => use(current()));
  use(current());
  return button;
}

function heading() {
  const scene = report.scene || {}, counts = report.counts || {};
  const links = [["answers", "Answers"], ["trade", "Trade-offs"], ["streams", "Bytes"], ["pictures", "Pictures"], ["levels", "Levels, denoiser, resolution"], ["extremes", "At the extremes"], ["point", "One point"], ["all", "All points"], ["how", "How it was measured"]].filter(([id]) => document.getElementById(id));
  document.getElementById("top").replaceChildren(
    el("div", {class: "title"}, el("h1", {}, named(scene.name || "scene"), el("span", {class: "muted"}, " packtrace measure")), themeButton()),
    el("p", {class: "muted"}, joined(`${count(scene.triangles)} triangles`, isNumber(scene.geometries) ? `${count(scene.geometries)} ${scene.geometries === 1 ? "geometry" : "geometries"}` : null, isNumber(counts.ok) ? `${count(counts.ok)} of ${count(counts.points)} points measured` : null, get(report, "settings.mode") ? `${report.settings.mode} mode` : null, isNumber(report.seconds) ? `in ${seconds(report.seconds)}` : null,
      isNumber(get(report, "settings.spp")) ? `${report.settings.width} × ${report.settings.height} pixels, ${report.settings.spp} samples` : null)),
    el("nav", {"aria-label": "Sections"}, links.map(([id, text]) => el("a", {href: `#${id}`}, text))));
}

function howSection() {
  const machine = report.machine || {}, scene = report.scene || {}, settings = report.settings || {}, program = report.program || {};
  const left = [...list(embedded.data_left_out)];
  if (embedded.pictures_missing > 0) left.push(`${embedded.pictures_missing} ${embedded.pictures_missing === 1 ? "picture" : "pictures"}`);
  const scaled = embedded.picture_scale < 1 ? `Pictures are reduced to ${embedded.picture_scale === 0.5 ? "a half" : "a quarter"} of their width and height. ` : "";
  return el("section", {id: "how", "aria-labelledby": "how-title"}, el("h2", {id: "how-title"}, "How it was measured"),
    command(report.command, "Copy the command of this report"),
    el("div", {class: "grid three facts"},
      el("div", {}, el("h3", {}, "Run"), definitions([["Program", joined(program.name, program.version).replace(" · ", " ")], ["Started", String(report.started || none).replace("T", " ").replace("Z", " UTC")], ["Time", seconds(report.seconds)], ["Points", isNumber(get(report, "counts.points")) ? `${count(report.counts.ok)} measured, ${count(report.counts.failed)} failed, ${count(report.counts.reused)} of earlier runs` : none]])),
      el("div", {}, el("h3", {}, "Machine"), definitions([["Processor", machine.cpu], ["Threads", isNumber(machine.threads) ? `${machine.threads} of ${machine.hardware_threads}` : none], ["Instructions", machine.isa], ["Memory", bytes(machine.memory_bytes)], ["System", machine.system]])),
      el("div", {}, el("h3", {}, "Scene"), definitions([["Path", scene.path ? named(scene.path) : none], ["Files", isNumber(scene.files) ? `${count(scene.files)}, ${bytes(scene.file_bytes)}` : none], ["As floats in memory", bytes(scene.float_bytes)], ["Placed triangles", count(scene.placed_triangles)], ["Materials", count(scene.materials)], ["Diagonal", isNumber(scene.diagonal) ? `${figure(scene.diagonal, 4)} units` : none], ["Median edge", isNumber(scene.median_edge) ? `${figure(scene.median_edge)} units` : none], ["AO radius", isNumber(settings.ao_radius) ? `${figure(settings.ao_radius)} units` : none]]))),
    el("ul", {class: "notes"},
      el("li", {}, "Ambient occlusion compares the packed file and packed tracer with the source floats and Embree: same seed and samples, no denoiser, so that what remains is the error of packing."),
      el("li", {}, "The noise floor is the error between two float images with different seeds."),
      el("li", {}, `Distances are sampled on both surfaces${isNumber(settings.distance_samples) ? ` at ${count(settings.distance_samples)} points each` : ""}, in world units.`),
      el("li", {}, `Rates are wall time within the process${settings.embree_beside_each_point ? "; Embree traces the same triangles right after each point" : ""}. Resident bytes are those of the file or decoded file, trees and caches.`),
      el("li", {}, "A point is on a front if no other is at least as good in both figures and better in one. The knee is the point of the front farthest below the line between its ends, on logarithmic axes."),
      scaled || left.length ? el("li", {id: "left-out"}, scaled, left.length ? `Left out to keep this file below ${bytes(embedded.max_bytes)}, or unreadable: ${left.join("; ")}. report.json and the folder pictures have all.` : "") : null));
}

document.getElementById("main").replaceChildren(...[answersSection, tradeSection, streamSection, pictureSection, levelSection, stabilitySection, pointSection, allSection, howSection].map(section => section()).filter(Boolean));
heading();
document.documentElement.dataset.ready = "yes";
