// Bundles the page's code and style into dist/, or with --check holds dist/ against what would be written.
import { readFile, writeFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import path from "node:path";
import { build } from "esbuild";

const here = path.dirname(fileURLToPath(import.meta.url));

const shared = {
  absWorkingDir: here,
  bundle: true,
  minify: true,
  write: false,
  charset: "utf8",
  legalComments: "inline",
  target: ["chrome123", "firefox120", "safari17.5"],
};

const twgl = await readFile(path.join(here, "node_modules/twgl.js/LICENSE.md"), "utf8");
const outputs = {
  "dist/report.js": await build({
    ...shared,
    entryPoints: ["src/main.js"],
    format: "iife",
    banner: { js: `/*! With twgl.js: ${twgl.trim().replaceAll("*/", "* /")} */` },
  }),
  "dist/report.css": await build({ ...shared, entryPoints: ["src/style.css"] }),
};

let differs = false;
for (const [name, result] of Object.entries(outputs)) {
  const text = result.outputFiles[0].text;
  if (/<\/(script|style)|<!--/i.test(text)) {
    throw new Error(`${name}: holds what would end the element that it stands in`);
  }
  const file = path.join(here, name);
  if (process.argv.includes("--check")) {
    const there = await readFile(file, "utf8").catch(() => "");
    if (there !== text) {
      differs = true;
      console.error(`${name}: is not what its sources make; run npm run build in src/report/page`);
    }
  } else {
    await writeFile(file, text);
    console.log(`${name}: ${text.length} characters`);
  }
}
process.exitCode = differs ? 1 : 0;
