"use strict";
// The panel beside the picture: entry, slider, animation, legend, switches of the surfaces.
function turnable(viewer, view) {
  const made = (tag, parent, text, attributes) => {
    const element = document.createElement(tag);
    if (text) element.textContent = text;
    Object.assign(element, attributes || {});
    parent.appendChild(element);
    return element;
  };
  const panel = made("details", document.body, "", { id: "panel", open: innerWidth > 700 });
  made("summary", panel, view.title);
  made("p", panel, view.words);

  const choice = made("select", made("label", panel, "shown "), "", { id: "entry" });
  view.entries.forEach((entry, number) => made("option", choice, entry.name, { value: number }));
  choice.value = view.first;

  const control = view.control;
  const row = made("label", panel, control.name + " ");
  const slider = made("input", row, "", {
    id: "slider", type: "range", min: control.low, max: control.high,
    step: (control.high - control.low) / 200, value: control.start,
  });
  slider.value = control.start;
  const reading = made("output", row);
  const play = made("button", panel, "play", { id: "play", type: "button" });
  const words = made("p", panel, "", { id: "words" });

  const legend = made("div", panel, "", { id: "legend" });
  const legendName = made("p", legend);
  made("div", legend, "", { className: "bar" }).style.background =
    "linear-gradient(to right, " + view.shades.join(", ") + ")";
  const ends = made("p", legend, "", { className: "ends" });
  const low = made("span", ends), middle = made("span", ends, "0"), high = made("span", ends);

  const surfaces = made("fieldset", panel, "", { id: "switches" });
  made("legend", surfaces, "drawn");
  view.switches.forEach((part) => {
    const label = made("label", surfaces);
    const box = made("input", label, "", { type: "checkbox", checked: true });
    made("i", label).style.background = part.colour;
    made("span", label, part.name.replaceAll("_", " "));
    box.addEventListener("change", () => {
      const json = viewer.getWorld().ObjectsListJson[part.id];
      json.visible = box.checked;
      viewer.reload(json, { visible: box.checked });
    });
  });

  // A window that is higher than wide looks from farther.
  function look() {
    const box = document.getElementById("canvasTarget").getBoundingClientRect();
    const farther = Math.max(1, 0.85 * box.height / box.width);
    const [eye, target, up] = [0, 3, 6].map((first) => view.camera.slice(first, first + 3));
    viewer.setCamera([...eye.map((x, k) => target[k] + farther * (x - target[k])), ...target, ...up]);
  }

  // One change at a time: the viewer answers with a promise, and the last wish waits for it.
  let busy = false, wish = null, looked = false;
  function draw(time) {
    if (busy) { wish = time; return; }
    busy = true;
    Promise.resolve(viewer.setTime(time)).then(() => {
      busy = false;
      // Once more: the viewer knows what is beyond its edges only after the first picture.
      if (!looked) { looked = true; look(); }
      document.body.dataset.time = time;
      if (wish !== null) { const next = wish; wish = null; draw(next); }
    });
  }
  function show() {
    const entry = view.entries[choice.value];
    draw(entry.start + Number(slider.value) - control.low);
    reading.textContent = Number(slider.value).toFixed(control.unit ? 0 : 2) + " " + control.unit;
    words.textContent = entry.words;
    legend.hidden = !entry.legend;
    legendName.textContent = entry.legend;
    low.textContent = "\u2212" + entry.limit;
    high.textContent = "+" + entry.limit;
  }
  let playing = false, phase = 0, last = 0;
  function step(now) {
    if (!playing) return;
    // A vibration swings to and fro, a turn goes round; both in four seconds.
    phase = (phase + (now - last) / 4000) % 1;
    last = now;
    const share = control.unit ? phase : 0.5 + 0.5 * Math.sin(2 * Math.PI * phase);
    slider.value = control.low + share * (control.high - control.low);
    show();
    requestAnimationFrame(step);
  }
  play.addEventListener("click", () => {
    playing = !playing;
    play.textContent = playing ? "stop" : "play";
    phase = control.unit ? (slider.value - control.low) / (control.high - control.low) : 0.25;
    last = performance.now();
    requestAnimationFrame(step);
  });
  choice.addEventListener("change", show);
  slider.addEventListener("input", show);
  look();
  show();
  document.body.dataset.ready = "true";
}
