// Looks at a page of `os report` as people do, in a headless browser.
//
//   node browse.mjs check PAGE.html     elements, keys, themes, phone, print, accessibility; fails at what is not so
//   node browse.mjs speed PAGE.html     time until it can be used, and of each picture while the scene is turned
//   node browse.mjs shots PAGE.html DIR pictures of it: light, dark, phone, paper
//
// OPEN_STRUCTURE_CHROMIUM names the browser. Packages are those of src/report/page.

import assert from "node:assert/strict";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

const here = path.dirname(fileURLToPath(import.meta.url));
const require = createRequire(path.join(here, "../../src/report/page/package.json"));
const { chromium } = require("playwright-core");

const [mode, file, folder] = process.argv.slice(2);
const address = pathToFileURL(path.resolve(file)).href;
const browser = await chromium.launch({
  executablePath: process.env.OPEN_STRUCTURE_CHROMIUM ?? "/usr/bin/chromium",
  args: [
    "--headless",
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    // Graphics in software, the same everywhere.
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
  ],
});

/** Opens the page; what it complains of and what it asks the network for is an error. */
async function opened(options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 }, ...options });
  // Beside other tests everything takes its time.
  context.setDefaultTimeout(180_000);
  const page = await context.newPage();
  const complaints = [];
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type()) && !/GPU stall due to ReadPixels/.test(message.text())) {
      complaints.push(message.text());
    }
  });
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("request", (request) => {
    if (!/^(file|data|blob):/.test(request.url())) complaints.push(`asks for ${request.url()}`);
  });
  const begun = performance.now();
  await page.goto(address);
  if (options.javaScriptEnabled !== false) {
    await page.waitForSelector(".sequence:not([hidden]) [data-ready]").catch((error) => {
      throw new Error(`the page does not start: ${complaints.join("; ") || error.message}`);
    });
  }
  page.opened = performance.now() - begun;
  page.complaints = complaints;
  return page;
}

async function closed(page) {
  assert.deepEqual(page.complaints, [], "the console is quiet");
  await page.context().close();
}

const settled = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

/** What a canvas shows, as text. */
const picture = async (page, selector) => {
  await settled(page);
  return page.locator(selector).evaluate((canvas) => canvas.toDataURL());
};

const checks = {
  async "every part is there"(page) {
    const parts = ["Scene and measurements", "Statistics", "Tracks and covisibility", "Trajectories", "Convergence", "Validation"];
    const shown = await page.locator(".sequence:not([hidden]) > section > h3").allTextContents();
    assert.deepEqual(shown, parts);
    for (const selector of ["main", "h1", "h2", "nav", ".tiles li", "svg.chart", "details table", ".badge", "canvas.scene", "canvas.frame"]) {
      assert.ok((await page.locator(selector).count()) > 0, selector);
    }
    assert.equal(await page.locator("html").getAttribute("lang"), "en");
    assert.equal(await page.locator("img.still").first().isVisible(), false, "the scene is drawn anew");
  },

  async "the slider moves the frame everywhere"(page) {
    const slider = page.locator(".slider").first();
    const before = [await picture(page, "canvas.scene >> nth=0"), await picture(page, "canvas.frame >> nth=0")];
    const cursor = page.locator(".chart .cursor").first();
    const place = await cursor.getAttribute("x1");
    await slider.focus();
    for (let step = 0; step < 3; step++) await page.keyboard.press("ArrowRight");
    assert.equal(await page.locator(".explorer").first().getAttribute("data-frame"), "3");
    assert.match(await page.locator(".where").first().textContent(), /^frame \S+ · .* s · \d+ points · \d+ segments$/);
    assert.notEqual(await cursor.getAttribute("x1"), place);
    assert.notEqual(await picture(page, "canvas.scene >> nth=0"), before[0]);
    assert.notEqual(await picture(page, "canvas.frame >> nth=0"), before[1]);
  },

  async "frames that share landmarks are gone to"(page) {
    const before = await page.locator(".explorer").first().getAttribute("data-frame");
    const first = page.locator(".sharing button").first();
    const name = (await first.textContent()).match(/^(frame \S+): \d+$/)[1];
    await first.click();
    assert.notEqual(await page.locator(".explorer").first().getAttribute("data-frame"), before);
    assert.ok((await page.locator(".where").first().textContent()).startsWith(`${name} ·`));
  },

  async "a chart is a way to a frame"(page) {
    const chart = page.locator("figure[data-cursor=frame] svg").first();
    await chart.scrollIntoViewIfNeeded();
    const box = await chart.boundingBox();
    await page.mouse.click(box.x + 0.9 * box.width, box.y + 0.4 * box.height);
    const last = Number(await page.locator(".slider").first().getAttribute("max"));
    const frame = Number(await page.locator(".explorer").first().getAttribute("data-frame"));
    assert.ok(frame > 0.75 * last, `frame ${frame} of ${last}`);
  },

  async "keys and hands turn the scene"(page) {
    const scene = page.locator("canvas.scene").first();
    await scene.scrollIntoViewIfNeeded();
    await scene.focus();
    let before = await picture(page, "canvas.scene >> nth=0");
    for (const key of ["ArrowLeft", "ArrowUp", "+", "-", "0"]) {
      await page.keyboard.press(key);
      const after = await picture(page, "canvas.scene >> nth=0");
      assert.notEqual(after, before, key);
      before = after;
    }
    const box = await scene.boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width / 2 + 60, box.y + box.height / 2 + 20, { steps: 4 });
    await page.mouse.up();
    assert.notEqual(await picture(page, "canvas.scene >> nth=0"), before, "dragging");
    for (const name of ["points", "group-0", "path-0"]) {
      const toggle = page.locator(`[data-show=${name}]`).first();
      before = await picture(page, "canvas.scene >> nth=0");
      await toggle.uncheck();
      assert.notEqual(await picture(page, "canvas.scene >> nth=0"), before, `${name} is hidden`);
      await toggle.check();
      assert.equal(await picture(page, "canvas.scene >> nth=0"), before, `${name} is shown again`);
    }
    const camera = page.locator("[data-do=camera]").first();
    await camera.click();
    assert.equal(await camera.getAttribute("aria-pressed"), "true");
    assert.notEqual(await picture(page, "canvas.scene >> nth=0"), before, "through the camera");
    await page.locator("[data-do=all]").first().click();
    assert.equal(await camera.getAttribute("aria-pressed"), "false");
  },

  async "a measurement tells its id"(page) {
    const frame = page.locator("canvas.frame").first();
    await frame.focus();
    await page.keyboard.press("ArrowRight");
    const words = await page.locator(".pointed").first().textContent();
    assert.match(words, /^(line|point) -?\d+: u -?[\d.]+, v -?[\d.]+ px/);
    const table = page.locator(".frame-table").first();
    await page.locator("details:has(> .frame-table) > summary").first().click();
    await table.locator("tbody tr").first().waitFor();
    await page.locator("details:has(> .frame-table) > summary").first().click();
  },

  async "it plays and stops"(page) {
    const play = page.locator(".play").first();
    const frame = () => page.locator(".explorer").first().getAttribute("data-frame");
    const before = await frame();
    await play.click();
    await page.waitForFunction((before) => document.querySelector(".explorer").dataset.frame !== before, before);
    await play.click();
    const stopped = await frame();
    await page.waitForTimeout(200);
    assert.equal(await frame(), stopped);
  },

  async "the theme is the system's until another is chosen"(page) {
    const paper = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
    const light = await paper();
    const scene = await picture(page, "canvas.scene >> nth=0");
    await page.emulateMedia({ colorScheme: "dark" });
    const dark = await paper();
    assert.notEqual(light, dark);
    await page.waitForTimeout(100);
    assert.notEqual(await picture(page, "canvas.scene >> nth=0"), scene, "the scene has other colours");
    await page.locator("#theme").click();
    assert.equal(await paper(), light);
    await page.locator("#theme").click();
    assert.equal(await paper(), dark);
    await page.locator("#theme").click();
    await page.emulateMedia({ colorScheme: "light" });
    assert.equal(await paper(), light);
  },

  async "every sequence can be picked"(page) {
    const picker = page.locator("#picker");
    if (!(await picker.count())) return;
    const count = await picker.locator("option").count();
    for (const place of [...Array(count).keys()].reverse()) {
      await picker.selectOption(String(place));
      await page.waitForSelector(`[data-explorer="${place}"][data-ready]`);
      assert.equal(await page.locator(".sequence:visible").count(), 1);
    }
  },
};

/** Violations of WCAG that axe finds, grave ones alone. */
async function accessible(page, what) {
  await page.evaluate(readFileSync(require.resolve("axe-core/axe.min.js"), "utf8"));
  const { violations } = await page.evaluate(() =>
    axe.run(document, { runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"] }),
  );
  const grave = violations.filter(({ impact }) => ["serious", "critical"].includes(impact));
  const told = grave.map(({ id, nodes }) => `${id}: ${nodes.slice(0, 3).map((node) => `${node.html.slice(0, 160)} ${node.failureSummary}`).join("\n")}`);
  assert.deepEqual(told, [], `accessible, ${what}`);
  console.log(`accessible, ${what}: ${violations.map(({ id, impact }) => `${id} (${impact})`).join(", ") || "nothing found"}`);
}

async function check() {
  const page = await opened();
  for (const [name, body] of Object.entries(checks)) {
    await body(page);
    console.log(name);
  }
  await accessible(page, "light");
  await page.emulateMedia({ colorScheme: "dark" });
  await accessible(page, "dark");
  await page.emulateMedia({ colorScheme: "light" });
  const pdf = await page.pdf({ format: "A4", printBackground: true });
  assert.equal(pdf.subarray(0, 5).toString(), "%PDF-");
  console.log(`prints: ${pdf.length} bytes`);
  await closed(page);

  const phone = await opened({ viewport: { width: 360, height: 740 }, deviceScaleFactor: 2, isMobile: true, hasTouch: true });
  await phone.evaluate(() => document.querySelectorAll("details").forEach((element) => (element.open = true)));
  const wide = await phone.evaluate(() => [document.documentElement.scrollWidth, window.innerWidth]);
  assert.ok(wide[0] <= 360 && wide[1] <= 360, `no scrolling to the side: ${wide}`);
  await accessible(phone, "phone");
  await phone.locator("canvas.frame").first().tap();
  await closed(phone);
  console.log("fits a phone");

  const plain = await opened({ javaScriptEnabled: false });
  assert.ok(await plain.locator("img.still, p.still").first().isVisible());
  assert.equal(await plain.locator(".transport").first().isVisible(), false);
  await closed(plain);
  console.log("is readable without scripts");
}

async function speed() {
  const page = await opened();
  const size = readFileSync(file).length;
  const scene = page.locator("canvas.scene").first();
  await scene.scrollIntoViewIfNeeded();
  const box = await scene.boundingBox();
  await page.evaluate(() => {
    window.times = [];
    let before = performance.now();
    const step = (now) => {
      window.times.push(now - before);
      before = now;
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  });
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  for (let step = 0; step < 120; step++) {
    await page.mouse.move(box.x + box.width / 2 + 2 * step - 120, box.y + box.height / 2 + 20 * Math.sin(step / 9));
  }
  await page.mouse.up();
  const turning = await page.evaluate(() => window.times.splice(0).sort((a, b) => a - b));
  await page.locator(".slider").first().focus();
  const begun = performance.now();
  for (let step = 0; step < 60; step++) await page.keyboard.press("ArrowRight");
  await settled(page);
  const slide = (performance.now() - begun) / 60;
  const at = (part) => turning[Math.floor(part * (turning.length - 1))];
  const found = {
    megabytes: size / 1e6,
    seconds_until_ready: page.opened / 1000,
    picture_median_ms: at(0.5),
    picture_95_percent_ms: at(0.95),
    pictures: turning.length,
    frame_step_ms: slide,
  };
  console.log(JSON.stringify(found));
  await closed(page);
}

async function shots() {
  mkdirSync(folder, { recursive: true });
  for (const colorScheme of ["light", "dark"]) {
    const page = await opened({ colorScheme, viewport: { width: 1360, height: 1000 } });
    await page.locator(".slider").first().evaluate((slider) => {
      slider.value = Math.floor(0.3 * slider.max);
      slider.dispatchEvent(new Event("input"));
    });
    await settled(page);
    await page.screenshot({ path: path.join(folder, `${colorScheme}.png`), fullPage: true });
    await page.locator(".explorer").first().screenshot({ path: path.join(folder, `${colorScheme}-explorer.png`) });
    if (colorScheme === "light") writeFileSync(path.join(folder, "paper.pdf"), await page.pdf({ format: "A4", printBackground: true }));
    await closed(page);
  }
  const phone = await opened({ viewport: { width: 360, height: 740 }, deviceScaleFactor: 2, isMobile: true, hasTouch: true });
  await phone.screenshot({ path: path.join(folder, "phone.png"), fullPage: true });
  await closed(phone);
}

try {
  await { check, speed, shots }[mode]();
} finally {
  await browser.close();
}
