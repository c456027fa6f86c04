// three.js in headless Chromium draws the base colours of exports; silhouettes and colours are compared with
// packtrace's own picture.
import { spawn } from "node:child_process";
import fs from "node:fs";
import http from "node:http";
import os from "node:os";
import path from "node:path";
import { PNG } from "pngjs";
import { check, kFolder, run } from "./process.mjs";

const kWidth = 320, kHeight = 180;

/** Serves the page, three.js and the model; resolves with the picture that the page sends back. */
function draw(model) {
  const files = { "/page.html": path.join(kFolder, "page.html"), "/model.glb": model };
  const types = { ".html": "text/html", ".js": "text/javascript", ".wasm": "application/wasm", ".glb": "model/gltf-binary" };
  return new Promise((resolve, reject) => {
    let browser, timer;
    const profile = fs.mkdtempSync(path.join(os.tmpdir(), "packtrace_chromium_"));
    const finish = (error, png) => {
      clearTimeout(timer);
      server.close();
      server.closeAllConnections();
      browser.once("exit", () => {
        try {
          fs.rmSync(profile, { recursive: true, force: true, maxRetries: 10, retryDelay: 100 });
        } catch {
          // The browser's other processes may still write there.
        }
        if (error) reject(error);
        else resolve(png);
      });
      process.kill(-browser.pid, "SIGKILL"); // with its children
    };
    const server = http.createServer((request, response) => {
      const name = new URL(request.url, "http://localhost").pathname;
      if (request.method === "POST") {
        const chunks = [];
        request.on("data", (chunk) => chunks.push(chunk));
        request.on("end", () => {
          response.end();
          const body = Buffer.concat(chunks);
          if (name === "/picture") finish(null, PNG.sync.read(body));
          else finish(new Error(body.toString()));
        });
        return;
      }
      const inside = path.join(kFolder, "node_modules", path.normalize(name));
      const file = files[name] ?? (name.startsWith("/three/") ? inside : "");
      if (!file || !fs.existsSync(file)) return response.writeHead(404).end();
      response.setHeader("Content-Type", types[path.extname(file)] ?? "application/octet-stream");
      response.end(fs.readFileSync(file));
    });
    server.listen(0, "127.0.0.1", () => {
      browser = spawn("chromium", ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader", `--user-data-dir=${profile}`,
        `http://127.0.0.1:${server.address().port}/page.html?width=${kWidth}&height=${kHeight}`], { stdio: "ignore", detached: true });
      browser.once("error", reject);
      timer = setTimeout(() => finish(new Error("no picture within 120 s")), 120000);
    });
  });
}

/** Fraction of pixels that only one picture covers, and the mean difference of colours where both do. */
function compare(a, b) {
  let only = 0, both = 0, difference = 0;
  for (let i = 0; i < a.data.length; i += 4) {
    const in_a = a.data[i + 3] > 127, in_b = b.data[i + 3] > 127;
    if (in_a !== in_b) ++only;
    if (!in_a || !in_b) continue;
    ++both;
    for (let c = 0; c < 3; ++c) difference += Math.abs(a.data[i + c] - b.data[i + c]) / 3;
  }
  return { only: only / (a.data.length / 4), difference: difference / Math.max(both, 1), both: both / (a.data.length / 4) };
}

export async function drawWithThree(packtrace, work, names) {
  for (const name of names) {
    const own = path.join(work, `${name}.albedo.png`);
    run(packtrace, "render", path.join(work, `${name}.ptk`), "-o", own, "--aov", "albedo", "--size", `${kWidth}x${kHeight}`,
        "--background", "transparent", "--no-jitter", "--no-legend", "--spp", "1", "--force", "-q");
    const reference = PNG.sync.read(fs.readFileSync(own));
    for (const profile of ["portable", "web", "exchange"]) {
      const drawn = await draw(path.join(work, `${name}.${profile}.glb`));
      fs.writeFileSync(path.join(work, `${name}.${profile}.three.png`), PNG.sync.write(drawn));
      const result = compare(reference, drawn);
      const figures = `silhouettes differ at ${(100 * result.only).toFixed(2)} %, colours by ${result.difference.toFixed(2)} of 255`;
      console.log(`${name}, ${profile} in three.js: ${figures}`);
      check(result.both > 0.2, `${name}, ${profile} is visible in three.js`);
      check(result.only < 0.01, `${name}, ${profile}: silhouettes agree`, figures);
      check(result.difference < 4, `${name}, ${profile}: colours agree`, figures);
    }
  }
}
