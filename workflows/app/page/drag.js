// Sensors of a drawing follow the pointer; where one is let go, its channel is told to the program.
(() => {
  let sensor = null;
  let toDrawing = null; // of the beginning: the drawing may be drawn anew meanwhile
  const point = (event) => new DOMPoint(event.clientX, event.clientY).matrixTransform(toDrawing);
  const angle = (at) => (Math.round((Math.atan2(at.x, -at.y) * 180) / Math.PI) + 360) % 360;
  document.addEventListener("pointerdown", (event) => {
    sensor = event.target.closest ? event.target.closest("g.sensor") : null;
    if (!sensor) return;
    event.preventDefault();
    toDrawing = sensor.ownerSVGElement.getScreenCTM().inverse();
  });
  document.addEventListener("pointermove", (event) => {
    if (!sensor) return;
    const at = point(event);
    if (sensor.classList.contains("housing")) {
      sensor.setAttribute("transform", `translate(${at.x} ${at.y})`);
      return;
    }
    const turn = angle(at);
    const text = sensor.querySelector("text");
    sensor.setAttribute("transform", `rotate(${turn})`);
    text.setAttribute("transform", `rotate(${-turn} 0 ${text.getAttribute("y")})`);
    text.textContent = `${sensor.dataset.name} ${turn}°`;
  });
  document.addEventListener("pointerup", (event) => {
    if (!sensor) return;
    const svg = sensor.ownerSVGElement;
    const at = point(event);
    let place = angle(at);
    if (sensor.classList.contains("housing")) {
      const distance = (c) => Math.hypot(c.cx.baseVal.value - at.x, c.cy.baseVal.value - at.y);
      const places = [...svg.querySelectorAll("circle.place")];
      place = places.sort((a, b) => distance(a) - distance(b))[0].dataset.place;
    }
    emitEvent("sensor_moved", { number: Number(sensor.dataset.number), place });
    sensor = null;
  });
})();
