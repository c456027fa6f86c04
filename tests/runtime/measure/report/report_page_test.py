"""Checks report.html in a headless Chromium.

Usage: report_page_test.py WRITE_SAMPLE_REPORT AXE_JS [FOLDER_FOR_SCREENSHOTS]
Exit code 77 without Chromium.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
import unittest

from browser import Browser, find_chromium
from sample_report import HOSTILE, ao, png, sample

WRITER, AXE, SCREENSHOTS = "", "", None


def smallest(report, limit):
    """The smallest file within an AO error: what the page must answer."""
    fit = [p for p in report["points"] if p["status"] == "ok" and p["ao"]["mae"] <= limit]
    return min(fit, key=lambda p: p["bytes"]["file"]) if fit else None


class ReportPage(unittest.TestCase):
    """Each test loads the page anew."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="report-page-")
        cls.report = sample()
        pictures = os.path.join(cls.folder.name, "pictures")
        os.mkdir(pictures)
        for name, tint in (("float", 0), ("default", 1), ("bits-10", 40), ("difference", 90)):
            with open(os.path.join(pictures, f"{name}.png"), "wb") as file:
                file.write(png(32, 18, lambda x, y, t=tint: ((8 * x + t) % 256, 8 * x, 12 * y)))
        cls.page = cls.write(cls.report, "report")
        cls.browser = Browser(find_chromium())

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()
        cls.folder.cleanup()

    @classmethod
    def write(cls, report, name):
        """Writes NAME.html as `packtrace measure` does."""
        source, page = (os.path.join(cls.folder.name, f"{name}.{ending}") for ending in ("json", "html"))
        with open(source, "w", encoding="utf-8") as file:
            json.dump(report, file)
        subprocess.run([WRITER, source, page], check=True)
        return page

    def open(self, width=1280, height=900, dark=False, page=None):
        """Opens the page."""
        self.browser.open(page or self.page, width, height, dark)

    def js(self, expression):
        """Value of an expression in the page."""
        return self.browser.evaluate(expression)

    def frame(self):
        """Waits until the page was drawn again."""
        self.js("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def check_silence(self):
        """Neither messages nor requests other than the page and its data: pictures."""
        self.assertEqual(self.browser.console, [])
        other = [url for url in self.browser.requests if not url.startswith("data:image/png;base64,")]
        self.assertEqual([url.split("/")[-1] for url in other if url.startswith("file:")], [other[0].split("/")[-1]])
        self.assertEqual(len(other), 1, other)

    def test_opens_without_messages_and_requests(self):
        self.open()
        self.check_silence()
        self.assertLess(os.path.getsize(self.page), 2_000_000)

    def test_a_forbidden_script_and_request_would_be_noticed(self):
        self.open()
        self.js("""(() => { const s = document.createElement('script'); s.textContent = 'window.pwned = 3';
                   document.body.append(s); return fetch('https://example.org/').catch(() => 0); })()""")
        self.assertIsNone(self.js("window.pwned ?? null"), "the policy stops scripts that are not the page's own")
        self.assertIn("Content Security Policy", " ".join(self.browser.console))
        self.assertEqual([url for url in self.browser.requests if url.startswith("http")], [])

    def test_names_of_the_scene_stay_text(self):
        self.open()
        self.assertIsNone(self.js("window.pwned ?? null"))
        self.assertEqual(self.js("document.querySelectorAll('script').length"), 2)
        self.assertEqual(self.js("document.querySelectorAll('img[src=x]').length"), 0)
        self.assertEqual(self.js("document.querySelector('h1 .name').textContent"), HOSTILE)
        self.assertEqual(self.js("document.title"), f"{HOSTILE} – packtrace measure")
        for part in ("#point", "#pictures", "#all", "#how"):
            self.assertIn(HOSTILE, self.js(f"document.querySelector('{part}').textContent"), part)

    def test_every_plot_is_drawn(self):
        self.open()
        plots = json.loads(self.js("""JSON.stringify([...document.querySelectorAll('main svg')].map(svg => {
            const box = svg.getBoundingClientRect(), marks = [...svg.querySelectorAll('.mark, .bar')];
            return {name: svg.getAttribute('aria-label'), width: box.width, height: box.height, marks: marks.length,
                    bad: svg.outerHTML.includes('NaN') || svg.outerHTML.includes('Infinity'),
                    outside: marks.filter(m => { const b = m.getBoundingClientRect();
                      return b.left < box.left - 1 || b.right > box.right + 1 || b.top < box.top - 1 || b.bottom > box.bottom + 1; }).length};
            }))"""))
        # The noise scale, four fronts, streams, levels, the denoiser, the resolution and three histograms.
        self.assertEqual(len(plots), 12, [p["name"] for p in plots])
        for shown in plots:
            with self.subTest(shown["name"]):
                self.assertGreater(shown["width"], 150)
                self.assertGreater(shown["height"], 70)
                self.assertGreaterEqual(shown["marks"], 2)
                self.assertEqual(shown["outside"], 0)
                self.assertFalse(shown["bad"])
        measured = sum(p["status"] == "ok" for p in self.report["points"])
        self.assertEqual([p["marks"] for p in plots if "front" in p["name"]], [measured] * 4)

    def test_stream_labels_are_whole_or_hidden(self):
        for width in (360, 800, 1280):
            self.open(width, 900)
            labels = json.loads(self.js("""JSON.stringify([...document.querySelectorAll('.stream-strip b')].map(label => {
                const box = label.getBoundingClientRect(), part = label.parentElement.getBoundingClientRect();
                return {text: label.textContent, below: box.top >= part.bottom - 1, whole: box.left >= part.left - 1 && box.right <= part.right + 1};
                }))"""))
            self.assertGreater(len(labels), 3)
            self.assertTrue(any(not label["below"] for label in labels), width)
            for label in labels:
                self.assertTrue(label["below"] or label["whole"], (width, label))

    def test_pictures_without_occlusion_are_said(self):
        report = sample()
        self.assertEqual(self.js("document.querySelectorAll('#answers .warning').length"), 0)
        report["reference"]["noise_floor"] = ao(0)
        self.open(page=self.write(report, "open"))
        self.assertIn("no occlusion", self.js("document.querySelector('#answers .warning').textContent"))
        self.check_silence()

    def test_a_tile_without_a_surface_is_background(self):
        report = sample()
        report["tiles"][0]["geometry"] = None
        self.open(page=self.write(report, "background"))
        self.assertIn("background", self.js("document.querySelector('#pictures').textContent"))
        self.assertNotIn("(no name)", self.js("document.querySelector('main').textContent"))

    def test_every_plot_has_a_table(self):
        self.open()
        self.assertEqual(self.js("document.querySelectorAll('main figure svg').length"),
                         self.js("document.querySelectorAll('main figure .alternative tbody tr:first-child').length"))

    def test_the_slider_moves_the_answer(self):
        self.open()
        seen = set()
        self.js("document.getElementById('limit-slider').focus()")
        for key in ["PageUp"] * 4 + ["ArrowRight"] * 4:
            self.browser.key(key)
            limit = float(self.js("document.getElementById('limit').value"))
            best = smallest(self.report, limit)
            command = self.js("document.querySelector('#goals .goal:first-child code')?.textContent ?? null")
            self.assertEqual(command, best and best["commands"]["bake"], limit)
            seen.add(command)
        self.assertGreater(len(seen), 2)
        self.check_silence()

    def test_the_limit_starts_where_the_user_set_it(self):
        report = sample()
        report["settings"]["max_error"] = 0.0123
        self.open(page=self.write(report, "limit"))
        self.assertEqual(self.js("document.getElementById('limit').value"), "0.0123")
        self.assertEqual(self.js("document.querySelector('#goals code').textContent"), smallest(report, 0.0123)["commands"]["bake"])

    def test_the_field_moves_the_answer_and_refuses_nonsense(self):
        self.open()

        def type_limit(text):
            self.js(f"""(() => {{ const f = document.getElementById('limit'); f.value = {json.dumps(text)};
                        f.dispatchEvent(new Event('input', {{bubbles: true}})); }})()""")

        for limit in (0.02, 0.003, 0.0005, 0.00015):
            type_limit(str(limit))
            best = smallest(self.report, limit)
            self.assertEqual(self.js("document.querySelector('#goals code').textContent"), best["commands"]["bake"])
            self.assertIn(best["label"], self.js("document.getElementById('answer-1').textContent"))
        before = self.js("document.getElementById('answer-1').textContent")
        for text in ("", "-1", "abc", "Infinity"):
            type_limit(text)
            self.assertEqual(self.js("document.getElementById('limit').getAttribute('aria-invalid')"), "true", text)
            self.assertEqual(self.js("document.getElementById('answer-1').textContent"), before)
        type_limit("1e-9")
        self.assertIn("No measured point", self.js("document.getElementById('answer-1').textContent"))

    def test_the_first_screen_answers_five_questions(self):
        self.open(1280, 900)
        for i in range(1, 6):
            with self.subTest(question=i):
                box = json.loads(self.js(f"JSON.stringify(document.getElementById('answer-{i}').getBoundingClientRect())"))
                self.assertGreater(box["height"], 10)
                self.assertLessEqual(box["bottom"], 900)
        self.assertGreaterEqual(self.js("[...document.querySelectorAll('#answers .copy')].filter(b => b.getBoundingClientRect().bottom < 900).length"), 3)

    def test_bits_change_what_is_lost(self):
        self.open()
        before = self.js("document.getElementById('answer-2').textContent")
        self.js("document.getElementById('bits').focus()")
        self.browser.key("ArrowRight")
        self.assertNotEqual(self.js("document.getElementById('answer-2').textContent"), before)
        self.assertEqual(self.js("document.querySelectorAll('.crops img').length"), 9)

    def test_keys_move_between_points_and_select(self):
        self.open()
        self.js("document.querySelector('#trade .mark[tabindex=\"0\"]').focus()")
        first = self.js("document.activeElement.getAttribute('aria-label')")
        self.browser.key("ArrowRight")
        second = self.js("document.activeElement.getAttribute('aria-label')")
        self.assertNotEqual(first, second)
        self.browser.key("Enter", "\r")
        label = second.split(":")[0]
        self.assertIn(label, self.js("document.getElementById('chosen').textContent"))
        self.assertEqual(self.js("document.getElementById('point-choice').selectedOptions[0].textContent"), label)
        self.frame()
        self.assertEqual(self.js("document.querySelectorAll('#trade .halo').length"), 4)
        self.assertIn(label, self.js("document.activeElement.getAttribute('aria-label') || ''"), "the focus stays on the point")

    def test_hovering_shows_figures_and_command(self):
        self.open()
        self.js("document.documentElement.style.scrollBehavior = 'auto'; document.getElementById('trade').scrollIntoView()")
        box = json.loads(self.js("JSON.stringify(document.querySelector('#trade path.mark').getBoundingClientRect())"))
        self.browser.move_mouse(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        self.browser.wait_for("!document.getElementById('tip').hidden")
        text = self.js("document.getElementById('tip').textContent")
        for part in ("14 bits per coordinate", "# bits-14", "AO error", "M/s", "MB"):
            self.assertIn(part, text)

    def test_the_comparator_moves(self):
        self.open()
        clip = "getComputedStyle(document.querySelector('.stage .over')).clipPath"
        before = self.js(clip)
        self.js("document.getElementById('wipe').focus()")
        self.browser.key("ArrowLeft")
        self.assertNotEqual(self.js(clip), before)
        self.assertTrue(self.js("[...document.images].every(i => i.complete && i.naturalWidth > 0)"))
        self.assertEqual(self.js("document.querySelectorAll('.tiles img').length"), 12)

    def test_tables_sort(self):
        self.open()
        read = "JSON.stringify([...document.querySelectorAll('#all tbody')[0].rows].map(r => r.cells[2].textContent))"
        click = "[...document.querySelectorAll('#all .sort')].find(b => b.textContent === 'File').click()"
        self.js(click)
        sizes = sorted((p["bytes"]["file"] for p in self.report["points"] if p["status"] == "ok"), reverse=True)
        shown = json.loads(self.js(read))
        self.assertEqual([round(float(text.split("\u00a0")[0]), 3) for text in shown], [float(f"{s / 1e6:.3g}") for s in sizes])
        self.assertEqual(self.js("document.querySelector('#all [aria-sort]').getAttribute('aria-sort')"), "descending")
        self.js(click)
        self.assertEqual(json.loads(self.js(read)), shown[::-1])

    def test_the_theme_follows_the_system_and_the_button(self):
        background = "getComputedStyle(document.body).backgroundColor"
        self.open()
        light = self.js(background)
        self.js("document.getElementById('theme').click()")
        dark = self.js(background)
        self.assertNotEqual(light, dark)
        self.js("localStorage.clear()")
        self.open(dark=True)
        self.assertEqual(self.js(background), dark)

    def test_a_phone_needs_no_sideways_scrolling(self):
        self.open(390, 844)
        self.assertLessEqual(self.js("document.documentElement.scrollWidth"), 390)
        self.assertGreaterEqual(float(self.js("parseFloat(getComputedStyle(document.querySelector('.answer')).fontSize)")), 14)

    def test_it_prints(self):
        self.open()
        pdf = self.browser.call("Page.printToPDF", printBackground=True)["data"]
        self.assertTrue(pdf.startswith("JVBERi0"), "the signature of PDF files in base64")
        self.check_silence()

    def test_axe_finds_no_barrier(self):
        with open(AXE, encoding="utf-8") as file:
            axe = file.read()
        for width, height, dark in ((1280, 900, False), (1280, 900, True), (390, 844, False)):
            with self.subTest(width=width, dark=dark):
                self.open(width, height, dark)
                self.js("for (const d of document.querySelectorAll('details')) d.open = true")
                self.js(axe + "; 0")
                found = json.loads(self.js("axe.run().then(r => JSON.stringify({passes: r.passes.length, violations: "
                                           "r.violations.map(v => [v.id, v.nodes[0].html, v.nodes[0].failureSummary])}))"))
                self.assertEqual(found["violations"], [])
                self.assertGreater(found["passes"], 20)

    def test_reports_that_lack_parts_open_too(self):
        for name, report in (("empty", {}), ("failed", {"points": [self.report["points"][-1]], "scene": {"name": "x"}}),
                             ("single", {"points": self.report["points"][:1], "default_id": "default"}),
                             ("no-fronts", self.report | {"fronts": [], "lod": [], "convergence": [], "pictures": [], "tiles": [], "reference": None})):
            with self.subTest(name):
                self.open(page=self.write(report, name))
                self.check_silence()
                self.assertGreater(len(re.sub(r"\s", "", self.js("document.getElementById('main').textContent"))), 100)

    def test_zero_errors_are_drawn(self):
        report = sample()
        for p in report["points"][:3]:
            p["ao"] = ao(0.0)
        self.open(page=self.write(report, "zeros"))
        self.check_silence()
        self.assertFalse(self.js("[...document.querySelectorAll('main svg')].some(s => s.outerHTML.includes('NaN'))"))

    def test_missing_pictures_are_said(self):
        report = sample()
        report["pictures"][0]["packed"] = "pictures/none.png"
        self.open(page=self.write(report, "missing"))
        self.assertIn("1 picture", self.js("document.getElementById('left-out').textContent"))
        self.check_silence()

    def test_screenshots(self):
        if not SCREENSHOTS:
            self.skipTest("no folder for screenshots")
        for name, width, height, dark in (("light", 1280, 900, False), ("dark", 1280, 900, True), ("phone", 390, 844, False)):
            self.open(width, height, dark)
            self.browser.screenshot(os.path.join(SCREENSHOTS, f"{name}.png"))


if __name__ == "__main__":
    if not find_chromium():
        print("Skipped: no Chromium (Debian package chromium)")
        sys.exit(77)
    WRITER, AXE = sys.argv[1:3]
    SCREENSHOTS = sys.argv[3] if len(sys.argv) > 3 else None
    unittest.main(argv=sys.argv[:1])
