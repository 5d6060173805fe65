// The frame that is shown, marked in the charts; a touch of a chart goes to its frame.

const SVG = "http://www.w3.org/2000/svg";

export class Cursors {
  constructor(root, sequence, go) {
    this.cursors = [];
    for (const figure of root.querySelectorAll("figure[data-cursor]")) {
      const svg = figure.querySelector("svg[data-area]");
      if (!svg) continue;
      const [left, top, width, height] = svg.dataset.area.split(" ").map(Number);
      const [low, high] = svg.dataset.x.split(" ").map(Number);
      // Of other kinds than seconds there are ids alone.
      const numbers = figure.dataset.cursor === "seconds" ? sequence.seconds : Float64Array.from(sequence.frameIds, Number);
      if (!(high > low)) continue;
      const line = document.createElementNS(SVG, "line");
      line.setAttribute("class", "cursor");
      line.setAttribute("y1", top);
      line.setAttribute("y2", top + height);
      svg.append(line);
      this.cursors.push({ line, place: (frame) => left + (width * (numbers[frame] - low)) / (high - low), left, width });
      svg.classList.add("touchable");
      svg.addEventListener("click", (event) => {
        const box = svg.getBoundingClientRect();
        const x = ((event.clientX - box.left) / box.width) * svg.viewBox.baseVal.width;
        const number = low + ((x - left) / width) * (high - low);
        go(nearest(numbers, number));
      });
    }
  }

  setFrame(frame) {
    for (const { line, place, left, width } of this.cursors) {
      const x = place(frame);
      const inside = x >= left - 1 && x <= left + width + 1;
      line.style.display = inside ? "" : "none";
      if (!inside) continue;
      line.setAttribute("x1", x);
      line.setAttribute("x2", x);
    }
  }
}

function nearest(numbers, number) {
  let best = 0;
  numbers.forEach((other, frame) => {
    if (Math.abs(other - number) < Math.abs(numbers[best] - number)) best = frame;
  });
  return best;
}
