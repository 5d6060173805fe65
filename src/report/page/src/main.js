// Starts the page: theme, picker of the sequence, explorers when they are first seen.

import { Explorer } from "./explorer.js";
import { startTheme } from "./theme.js";

const theme = document.getElementById("theme");
const picker = document.getElementById("picker");
const articles = [...document.querySelectorAll(".sequence")];
const started = new Set();

for (const element of document.querySelectorAll(".controls .needs-script")) element.hidden = false;
startTheme(theme);

function show(place) {
  articles.forEach((article, other) => (article.hidden = other !== place));
  const article = articles[place];
  if (!article || started.has(place)) return;
  started.add(place);
  new Explorer(article.querySelector(".explorer"));
}

/** The place of the sequence that the address points into. */
function named() {
  const target = location.hash && document.getElementById(location.hash.slice(1));
  return target ? articles.findIndex((article) => article.contains(target)) : -1;
}

picker?.addEventListener("change", () => show(Number(picker.value)));
addEventListener("hashchange", () => {
  const place = named();
  if (place < 0) return;
  if (picker) picker.value = place;
  show(place);
});
const first = Math.max(0, named());
if (picker) picker.value = first;
show(first);
