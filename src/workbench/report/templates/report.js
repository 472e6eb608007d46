/* What the page adds where scripts run: tables that sort and filter, figures that open large, and one time slider per
   case that moves a marker through its plots and its drawing. Everything is readable without it; nothing is loaded and nothing is sent. */
"use strict";
(() => {
  const SVG = "http://www.w3.org/2000/svg";
  const make = (tag, attributes = {}, text = "") => {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    if (text) element.textContent = text;
    return element;
  };
  const draw = (tag, attributes, parent) => {
    const element = document.createElementNS(SVG, tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    parent.appendChild(element);
    return element;
  };
  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
  const short = (value) => {
    if (value === null || !Number.isFinite(value)) return "–";
    const size = Math.abs(value);
    return size !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(1) : String(Number(value.toPrecision(3)));
  };

  /* ---- what is folded ---- */
  const reveal = (element) => {
    for (let at = element; at; at = at.parentElement) if (at.tagName === "DETAILS") at.open = true;
  };
  const target = (address) => {
    try { return document.getElementById(decodeURIComponent(address.slice(1))); } catch { return null; }
  };
  const follow = (address) => {
    const element = address.length > 1 ? target(address) : null;
    if (!element) return;
    const own = element.querySelector(":scope > details.fold");
    if (own) own.open = true;
    reveal(element);
    element.scrollIntoView();
  };
  document.addEventListener("click", (event) => {
    const link = event.target.closest?.('a[href^="#"]');
    if (link) setTimeout(() => follow(link.getAttribute("href")));
  });
  let shut = [];
  window.addEventListener("beforeprint", () => {
    shut = [...document.querySelectorAll("details:not(.extra):not([open])")];
    for (const details of shut) details.open = true;
  });
  window.addEventListener("afterprint", () => { for (const details of shut) details.open = false; });
  const contents = document.querySelector("nav.contents ol");
  const folds = [...document.querySelectorAll("details.fold")];
  if (contents && folds.length) {
    const every = make("button", { type: "button", class: "every" }, "Open all");
    every.addEventListener("click", () => {
      const open = folds.some((fold) => !fold.open);
      for (const fold of folds) fold.open = open;
      every.textContent = open ? "Fold all" : "Open all";
    });
    contents.after(every);
  }

  /* ---- figures that open large ---- */
  const large = make("dialog", { class: "large", "aria-label": "Figure" });
  const close = make("button", { type: "button", class: "close" }, "Close");
  let [moved, stand] = [null, null];
  large.append(close);
  document.body.append(large);
  close.addEventListener("click", () => large.close());
  large.addEventListener("click", (event) => { if (event.target === large) large.close(); });
  large.addEventListener("close", () => {
    stand?.replaceWith(moved);
    moved?.querySelector(".enlarge")?.focus();
    [moved, stand] = [null, null];
  });
  for (const figure of document.querySelectorAll("figure")) {
    const told = figure.querySelector("figcaption")?.textContent.trim() ?? "";
    const button = make("button", { type: "button", class: "enlarge", title: "Show large", "aria-label": `Show large: ${told}` }, "⤢");
    button.addEventListener("click", () => {
      if (moved) return;
      // a place of the same height is kept, so that the page does not jump
      stand = make("div", { style: `height: ${figure.offsetHeight}px` });
      moved = figure;
      figure.replaceWith(stand);
      large.append(figure);
      large.showModal();
    });
    figure.append(button);
  }

  /* ---- tables ---- */
  const FILTER_FROM = 8;
  const keyOf = (cell) => {
    const value = cell.dataset.value;
    return value === undefined ? null : Number(value);
  };
  const compare = (a, b) => {
    const [x, y] = [keyOf(a), keyOf(b)];
    if (x !== null && y !== null) return (Number.isNaN(x) ? Infinity : x) - (Number.isNaN(y) ? Infinity : y) || 0;
    if (x !== null || y !== null) return x !== null ? -1 : 1;
    return a.textContent.localeCompare(b.textContent, "en", { numeric: true });
  };
  for (const table of document.querySelectorAll(".table table")) {
    const body = table.tBodies[0];
    const rows = [...body.rows];
    if (rows.length < 2) continue;
    const headings = [...table.tHead.rows[0].cells];
    headings.forEach((heading, column) => {
      const button = make("button", { type: "button", class: "sort" }, heading.textContent);
      heading.replaceChildren(button);
      button.addEventListener("click", () => {
        const state = heading.getAttribute("aria-sort");
        headings.forEach((other) => other.removeAttribute("aria-sort"));
        if (state === "ascending") {
          body.append(...rows); // third press: the order of the report
          return;
        }
        const turn = state === "descending" ? 1 : -1;
        heading.setAttribute("aria-sort", turn > 0 ? "ascending" : "descending");
        body.append(...[...rows].sort((a, b) => turn * compare(a.cells[column], b.cells[column])));
      });
    });
    if (rows.length < FILTER_FROM) continue;
    const wrapper = table.closest(".table");
    const label = make("label", { class: "filter" }, "Filter rows ");
    const field = make("input", { type: "search", autocomplete: "off", spellcheck: "false" });
    const told = make("output", { "aria-live": "polite" });
    label.append(field);
    const line = make("p", { class: "tools" });
    line.append(label, told);
    wrapper.insertBefore(line, wrapper.querySelector(".scroll"));
    field.addEventListener("input", () => {
      const words = field.value.toLowerCase().split(/\s+/).filter(Boolean);
      let shown = 0;
      for (const row of rows) {
        const text = row.textContent.toLowerCase();
        row.hidden = !words.every((word) => text.includes(word));
        shown += row.hidden ? 0 : 1;
      }
      told.textContent = words.length ? ` ${shown} of ${rows.length} rows` : "";
    });
  }

  /* ---- maps of a sweep over any two of its numbers ---- */
  const luminance = (colour) => [1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16) / 255)
    .map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4))
    .reduce((sum, c, k) => sum + c * [0.2126, 0.7152, 0.0722][k], 0);

  class Picker {
    constructor(place, number) {
      const told = JSON.parse(place.dataset.maps);
      this.keys = told.keys;
      this.maps = told.maps;
      this.shades = told.shades;
      const known = this.keys.map((key, k) => [k, key?.name]).filter(([, name]) => name !== undefined);
      const line = make("p");
      const choice = (label, options, chosen) => {
        const select = make("select");
        for (const [value, text] of options) select.append(make("option", { value }, text));
        select.value = chosen;
        select.addEventListener("change", () => this.show());
        const around = make("label", {}, `${label} `);
        around.append(select);
        line.append(around);
        return select;
      };
      this.what = choice("Error", [[2, "median of the designs"], [3, "largest of the designs"]], 2);
      this.across = choice("over", known, known[0][0]);
      this.down = choice("and", known, known[1][0]);
      this.title = make("p", { class: "shows", id: `picker-${number}`, "aria-live": "polite" });
      this.about = place.dataset.title;
      const box = make("div", { class: "scroll", tabindex: "0", role: "region", "aria-labelledby": `picker-${number}` });
      this.table = make("table", { "aria-labelledby": `picker-${number}` });
      box.append(this.table);
      place.append(make("h3", {}, "Any two numbers"), line, this.title, box);
      this.show();
    }

    show() {
      const [what, i, j] = [this.what, this.across, this.down].map((select) => Number(select.value));
      this.table.replaceChildren();
      const found = this.maps.find(([a, b]) => (a === i && b === j) || (a === j && b === i));
      if (!found) {
        this.title.textContent = "Choose two different numbers.";
        return;
      }
      const swapped = found[0] !== i;
      const [columns, rows] = [this.keys[i].bins, this.keys[j].bins];
      const at = (list, row, column) => list[swapped ? column * rows.length + row : row * columns.length + column];
      const known = [...found[2], ...found[3]].filter((value) => value > 0);
      const [low, high] = [Math.min(...known), Math.max(...known)];
      const head = make("tr");
      head.append(make("th", { scope: "col" }, `${this.keys[j].name} \\ ${this.keys[i].name}`));
      for (const text of columns) head.append(make("th", { scope: "col" }, text));
      const top = make("thead");
      top.append(head);
      const body = make("tbody");
      for (let row = rows.length - 1; row >= 0; row -= 1) {
        const line = make("tr");
        line.append(make("th", { scope: "row" }, rows[row]));
        columns.forEach((_, column) => {
          const value = at(found[what], row, column);
          const cell = make("td", {}, value === null ? "–" : `${value} %`);
          if (value !== null) {
            const share = high > low ? Math.log(Math.max(value, low) / low) / Math.log(high / low) : 0;
            const shade = this.shades[Math.round(share * (this.shades.length - 1))];
            cell.style.background = shade;
            cell.style.color = luminance(shade) > 0.18 ? "#010101" : "#fefefe";
            cell.append(make("small", {}, String(at(found[4], row, column))));
          }
          line.append(cell);
        });
        body.append(line);
      }
      this.table.append(top, body);
      const kind = what === 2 ? "Median" : "Largest";
      this.title.textContent = `${kind} error of ${this.about} over ${this.keys[i].name} (columns) and `
        + `${this.keys[j].name} (rows), with the number of designs below it.`;
    }
  }

  document.querySelectorAll(".picker").forEach((place, number) => new Picker(place, number + 1));

  /* ---- plots over time ---- */
  const parsePath = (d) => {
    const found = [];
    let [x, y] = [0, 0];
    for (const [, kind, told] of d.matchAll(/([Ml])([^A-Za-z]*)/g)) {
      const numbers = told.match(/-?(?:\d+\.?\d*|\.\d+)/g) ?? [];
      for (let k = 0; k + 1 < numbers.length; k += 2) {
        const [first, second] = [Number(numbers[k]), Number(numbers[k + 1])];
        [x, y] = kind === "M" ? [first, second] : [x + first, y + second];
        found.push([kind === "M" ? "M" : "L", x, y]);
      }
    }
    return found;
  };

  class Curve {
    constructor(label, path) {
      [this.label, this.path, this.read] = [label, path, null];
    }

    get points() { // read when they are first asked for: a page has hundreds of curves
      this.read ??= parsePath(this.path.getAttribute("d"));
      return this.read;
    }
  }

  class Panel {
    constructor(svg, told, number) {
      this.svg = svg;
      [this.left, this.top, this.right, this.bottom] = told.box;
      [this.start, this.stop] = told.x;
      [this.low, this.high] = told.y;
      this.isLog = told.log;
      this.name = told.name;
      this.group = svg.querySelector(`.wb-panel-${number}`);
      this.ticks = svg.querySelector(`.wb-times-${number}`);
      this.window = [this.start, this.stop];
      this.curves = told.curves.map((label, index) => {
        const path = svg.querySelector(`.wb-curve-${number}-${index} path`);
        return path ? new Curve(label, path) : null;
      }).filter(Boolean);
      this.uses = [...this.group.querySelectorAll("use")]
        .filter((use) => !use.closest('[class^="wb-times"]') && Number(use.getAttribute("x")) > this.left + 0.06)
        .map((use) => ({ use, x: Number(use.getAttribute("x"))}));
      this.moments = [...this.group.querySelectorAll(".wb-moment")];
      this.cursor = draw("line", { class: "cursor", y1: this.top, y2: this.bottom, visibility: "hidden" }, svg);
      this.dots = this.curves.map(() => draw("circle", { class: "dot", r: 2.6, visibility: "hidden" }, svg));
    }

    whole(time) { return this.left + (time - this.start) / (this.stop - this.start) * (this.right - this.left); }

    at(time) { return this.left + (time - this.window[0]) / (this.window[1] - this.window[0]) * (this.right - this.left); }

    time(x) { return this.window[0] + (x - this.left) / (this.right - this.left) * (this.window[1] - this.window[0]); }

    value(curve, time) {
      const x = this.whole(time);
      const { points } = curve;
      let [first, last] = [0, points.length - 1];
      if (last < 0 || x < points[0][1] - 0.3 || x > points[last][1] + 0.3) return null;
      while (last - first > 1) {
        const middle = (first + last) >> 1;
        if (points[middle][1] <= x) first = middle; else last = middle;
      }
      const [a, b] = [points[first], points[last]];
      const share = b[1] === a[1] ? 0 : clamp((x - a[1]) / (b[1] - a[1]), 0, 1);
      const y = a[2] + share * (b[2] - a[2]);
      const part = (this.bottom - y) / (this.bottom - this.top);
      if (!this.isLog) return { y, value: this.low + part * (this.high - this.low) };
      return { y, value: 10 ** (Math.log10(this.low) + part * Math.log10(this.high / this.low)) };
    }

    mark(time) {
      const x = this.at(time);
      const inside = time !== null && x >= this.left - 0.5 && x <= this.right + 0.5;
      this.cursor.setAttribute("visibility", inside ? "visible" : "hidden");
      this.cursor.setAttribute("x1", x.toFixed(2));
      this.cursor.setAttribute("x2", x.toFixed(2));
      const told = [];
      this.curves.forEach((curve, index) => {
        const found = inside ? this.value(curve, time) : null;
        const dot = this.dots[index];
        const within = found && found.y >= this.top - 1 && found.y <= this.bottom + 1;
        dot.setAttribute("visibility", within ? "visible" : "hidden");
        if (within) {
          dot.setAttribute("cx", x.toFixed(2));
          dot.setAttribute("cy", found.y.toFixed(2));
          dot.style.fill = getComputedStyle(curve.path).stroke;
          told.push(`${curve.label} ${short(found.value)}`);
        }
      });
      return told.length ? `${this.name}: ${told.join(", ")}` : "";
    }

    zoom(window) {
      this.window = window;
      const [start, stop] = window;
      const isWhole = start <= this.start && stop >= this.stop;
      const scale = (this.stop - this.start) / (stop - start);
      const shift = this.left - scale * (this.whole(start) - this.left);
      const moved = (x) => (isWhole ? x : shift + scale * (x - this.left));
      for (const { path, points } of this.curves) {
        path.setAttribute("d", points.map(([kind, x, y]) => `${kind} ${moved(x).toFixed(2)} ${y.toFixed(2)}`).join(" "));
      }
      for (const { use, x } of this.uses) {
        const place = moved(x);
        use.setAttribute("x", place.toFixed(2));
        use.style.display = place < this.left - 1 || place > this.right + 1 ? "none" : "";
      }
      for (const text of this.moments) text.style.display = isWhole ? "" : "none";
      if (this.ticks) this.ticks.style.display = isWhole ? "" : "none";
      this.marks?.remove();
      if (!isWhole) this.drawTicks(start, stop);
    }

    drawTicks(start, stop) {
      this.marks = draw("g", { class: "ticks", "aria-hidden": "true" }, this.svg);
      const rough = (stop - start) / 4;
      const decade = 10 ** Math.floor(Math.log10(rough));
      const step = decade * [1, 2, 5, 10].find((factor) => factor * decade >= rough);
      const labelled = this.isLowest;
      for (let k = Math.ceil(start / step); k * step <= stop + 1e-9; k += 1) {
        const x = this.at(k * step).toFixed(2);
        draw("line", { x1: x, x2: x, y1: this.top, y2: this.bottom }, this.marks);
        if (labelled) {
          const text = draw("text", { x, y: this.bottom + 12 }, this.marks);
          text.textContent = Number((k * step).toPrecision(6));
        }
      }
      if (labelled) {
        const text = draw("text", { x: (this.left + this.right) / 2, y: this.bottom + 24 }, this.marks);
        text.textContent = "time [s]";
      }
    }
  }

  /* ---- the drawing that moves ---- */
  class Mechanism {
    constructor(svg, told) {
      this.told = told;
      const sum = told.places[0].map(() => 0);
      const places = told.places.map((row) => row.map((step, k) => (sum[k] += step) / told.scale));
      this.views = told.views.map((rows) => places.map((place) => {
        const flat = [];
        for (let k = 0; k < place.length; k += 3) {
          for (const [a, b, c, d] of rows) flat.push(a * place[k] + b * place[k + 1] + c * place[k + 2] + d);
        }
        return flat;
      }));
      this.lines = told.views.map((_, view) => Object.entries(told.lines).map(
        ([kind, pairs]) => [svg.querySelector(`.wb-line-${view}-${kind} path`), pairs]));
      this.joints = told.views.map((_, view) => Object.entries(told.joints).map(
        ([kind, members]) => [[...svg.querySelectorAll(`.wb-joint-${view}-${kind} use`)], members]));
    }

    show(time) {
      const { t } = this.told;
      let [first, last] = [0, t.length - 1];
      while (last - first > 1) {
        const middle = (first + last) >> 1;
        if (t[middle] <= time) first = middle; else last = middle;
      }
      const share = last > first ? clamp((time - t[first]) / (t[last] - t[first]), 0, 1) : 0;
      this.views.forEach((frames, view) => {
        const at = (k) => [0, 1].map((side) => {
          const [a, b] = [frames[first][2 * k + side], frames[last][2 * k + side]];
          return (a + share * (b - a)).toFixed(2);
        });
        for (const [path, pairs] of this.lines[view]) {
          path?.setAttribute("d", pairs.map(([a, b]) => `M ${at(a).join(" ")} L ${at(b).join(" ")}`).join(" "));
        }
        for (const [uses, members] of this.joints[view]) {
          uses.forEach((use, k) => {
            const [x, y] = at(members[k]);
            use.setAttribute("x", x);
            use.setAttribute("y", y);
          });
        }
      });
    }
  }

  /* ---- rendered frames, on one sheet ---- */
  class Film {
    constructor(figure) {
      this.times = figure.dataset.film.split(" ").map(Number);
      this.columns = Number(figure.dataset.columns);
      this.rows = Math.ceil(this.times.length / this.columns);
      this.sheet = figure.querySelector("img");
    }

    show(time) {
      let nearest = 0;
      this.times.forEach((t, k) => {
        if (Math.abs(t - time) < Math.abs(this.times[nearest] - time)) nearest = k;
      });
      const [row, column] = [Math.floor(nearest / this.columns), nearest % this.columns];
      this.sheet.style.transform = `translate(${-100 * column / this.columns}%, ${-100 * row / this.rows}%)`;
    }
  }

  class Figure {
    constructor(figure, group) {
      this.svg = figure.querySelector("svg");
      const told = JSON.parse(this.svg?.dataset.panels ?? "[]");
      this.panels = told.map((panel, number) => new Panel(this.svg, panel, number));
      if (this.panels.length) this.panels.at(-1).isLowest = true;
      this.film = figure.dataset.film ? new Film(figure) : null;
      this.mechanism = figure.dataset.frames ? new Mechanism(this.svg, JSON.parse(figure.dataset.frames)) : null;
      if (!this.panels.length) return;
      this.readout = make("p", { class: "readout" });
      figure.querySelector(".drawing").after(this.readout);
      const timeAt = (event) => {
        const box = this.svg.getBoundingClientRect();
        const view = this.svg.viewBox.baseVal;
        return this.panels[0].time((event.clientX - box.left) / box.width * view.width);
      };
      this.svg.addEventListener("pointermove", (event) => this.show(group.limit(timeAt(event))));
      this.svg.addEventListener("pointerleave", () => this.show(group.shown));
      this.svg.addEventListener("click", (event) => group.set(timeAt(event)));
    }

    show(time) {
      this.mechanism?.show(time ?? 0);
      this.film?.show(time ?? 0);
      if (!this.panels.length) return;
      const told = this.panels.map((panel) => panel.mark(time)).filter(Boolean);
      this.readout.textContent = time === null ? "" : `t = ${short(time)} s · ${told.join(" · ")}`;
    }
  }

  class Case {
    constructor(article) {
      [this.start, this.stop, this.worst] = article.dataset.times.split(" ").map(Number);
      this.time = this.start;
      this.shown = null;
      this.window = [this.start, this.stop];
      this.figures = [...document.querySelectorAll("figure[data-case]")]
        .filter((figure) => figure.dataset.case === article.id && figure.querySelector("svg, .film"))
        .map((figure) => new Figure(figure, this));
      if (!this.figures.length || !(this.stop > this.start)) return;
      const bar = make("div", { class: "times", role: "group", "aria-label": `Time in ${article.id.slice(5)}` });
      const button = (text, label, act) => {
        const made = make("button", { type: "button", title: label, "aria-label": label }, text);
        made.addEventListener("click", act);
        bar.append(made);
        return made;
      };
      this.play = button("▶", "Play", () => this.toggle());
      this.slider = make("input", {
        type: "range", min: this.start, max: this.stop, step: (this.stop - this.start) / 1000, value: this.start,
        "aria-label": "Time",
      });
      this.clock = make("output");
      bar.append(this.slider, this.clock);
      button("worst", "Go to the worst moment", () => this.set(this.worst));
      if (this.figures.some((figure) => figure.panels.length)) {
        button("+", "Zoom in on the time", () => this.zoom(0.5));
        button("−", "Zoom out", () => this.zoom(2));
        button("⟲", "Show the whole time", () => this.zoom(Infinity));
      }
      this.slider.addEventListener("input", () => this.set(Number(this.slider.value)));
      article.querySelector("h4").before(bar);
      this.tell();
    }

    limit(time) { return clamp(time, this.start, this.stop); }

    set(time) {
      this.time = this.shown = this.limit(time);
      this.slider.value = this.time;
      this.tell();
      for (const figure of this.figures) figure.show(this.time);
    }

    tell() {
      this.clock.textContent = `${this.time.toFixed(this.stop - this.start < 2 ? 4 : 3)} s`;
      this.slider.setAttribute("aria-valuetext", this.clock.textContent);
    }

    zoom(factor) {
      const whole = this.stop - this.start;
      const width = Math.min(whole, (this.window[1] - this.window[0]) * factor);
      const first = clamp(this.time - width / 2, this.start, this.stop - width);
      this.window = [first, first + width];
      for (const figure of this.figures) {
        for (const panel of figure.panels) {
          panel.zoom(width >= whole ? [panel.start, panel.stop] : this.window);
        }
        figure.show(this.shown);
      }
    }

    toggle() {
      const playing = this.play.textContent !== "▶";
      this.play.textContent = playing ? "▶" : "❚❚";
      this.play.setAttribute("aria-label", playing ? "Play" : "Pause");
      this.play.title = playing ? "Play" : "Pause";
      if (playing) return;
      const span = this.stop - this.start;
      const rate = span / clamp(span, 6, 20); // short motions are slowed down, long ones sped up
      if (this.time >= this.stop - 1e-9) this.set(this.start);
      let before = null;
      const step = (now) => {
        if (this.play.textContent === "▶") return;
        if (before !== null) this.set(this.time + rate * (now - before) / 1000);
        before = now;
        if (this.time >= this.stop) this.toggle(); else requestAnimationFrame(step);
      };
      requestAnimationFrame(step);
    }
  }

  for (const article of document.querySelectorAll("article[data-times]")) new Case(article);
  follow(location.hash);
})();
