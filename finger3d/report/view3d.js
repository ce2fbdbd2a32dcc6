"use strict";
(function () {
  const data = JSON.parse(document.getElementById("view-data").textContent);
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const rest = new Float32Array(bytes(data.rest)), moved = new Float32Array(bytes(data.moved));
  const pressure = new Float32Array(bytes(data.pressure)), status = new Uint8Array(bytes(data.status));
  const border = new Uint8Array(bytes(data.border));
  const body = new Uint32Array(bytes(data.body)), contact = new Uint32Array(bytes(data.contact));
  const n = data.vertices, names = ["open", "stick", "slip"];
  const stage = document.getElementById("view-stage"), field = document.getElementById("view-field");
  const slider = document.getElementById("view-step"), label = document.getElementById("view-label");
  const gauges = document.getElementById("view-gauges"), thing = document.getElementById("view-object");
  const objectPoints = new Float32Array(bytes(data.objectPoints)), objectFaces = new Uint32Array(bytes(data.objectFaces));
  const show = (kind, on) => document.querySelectorAll(`.key .${kind}`).forEach((e) => { e.hidden = !on; });

  // Split each contact triangle into six by the places on its sides where the status changes: one part at each corner
  // with its status, and three around their centre with the status of most corners, as in finger.png.
  const edges = new Map(), parents = [], six = { i: [], j: [], k: [] }, owner = [];
  for (let v = 0; v < n; v++) parents.push([v]);
  const weights = Array(n).fill(() => [1]);  // of the parents at a step
  const cut = (a, b, side) => {
    const name = Math.min(a, b) * n + Math.max(a, b);
    if (!edges.has(name)) {
      edges.set(name, parents.length);
      parents.push([a, b]);
      weights.push((s) => { const share = border[s * contact.length + side] / 255; return [1 - share, share]; });
    }
    return edges.get(name);
  };
  for (let t = 0; t < contact.length; t += 3) {
    const corners = contact.slice(t, t + 3), [a, b, c] = corners;
    const on = [cut(a, b, t), cut(b, c, t + 1), cut(c, a, t + 2)], [ab, bc, ca] = on, centre = parents.length;
    parents.push([a, b, c]);
    weights.push((s) => [a, b, c].map((v) =>
      on.reduce((sum, p) => sum + (parents[p].includes(v) ? weights[p](s)[parents[p].indexOf(v)] : 0), 0) / 3));
    for (const [p, q, r, own] of [[a, ab, ca, [a]], [b, bc, ab, [b]], [c, ca, bc, [c]],
      [ca, ab, centre, [a, b, c]], [ab, bc, centre, [b, c, a]], [bc, ca, centre, [c, a, b]]]) {
      six.i.push(p); six.j.push(q); six.k.push(r); owner.push(own);
    }
  }
  // Status of a part: of its corner, or of most corners; where all differ, of the one beside it, which is named first.
  const stateOf = (s, t) => {
    const [one, two, three] = owner[t].map((v) => status[s * n + v]);
    return two !== undefined && two === three ? two : one;
  };
  const sides = { i: [], j: [], k: [] };
  for (let t = 0; t < body.length; t += 3) {
    sides.i.push(body[t]); sides.j.push(body[t + 1]); sides.k.push(body[t + 2]);
  }
  const shift = (s, v) => Math.hypot(...[0, 1, 2].map((a) => moved[3 * (s * n + v) + a] - rest[3 * v + a]));
  const steps = data.labels.length;
  let highest = 0, farthest = 0;
  for (let s = 0; s < steps; s++) for (let v = 0; v < n; v++) {
    highest = Math.max(highest, pressure[s * n + v]); farthest = Math.max(farthest, shift(s, v));
  }
  // Distance of gauges and of their labels in front of the face, relative to the extent of the body, and its direction.
  const LINE = 0.012, NAME = 0.1, FROM = [-0.32, 0.55, 0.77];
  const extent = Math.max(...[0, 1, 2].map((a) => {
    const at = rest.filter((v, p) => p % 3 === a);
    return at.reduce((x, y) => Math.max(x, y)) - at.reduce((x, y) => Math.min(x, y));
  }));
  // Coordinates of the object's points at every step.
  const placed = data.objectPoses.map((pose) => Float32Array.from(objectPoints, (_, p) => {
    const from = p - p % 3, row = pose[p % 3];
    return row[3] + row[0] * objectPoints[from] + row[1] * objectPoints[from + 1] + row[2] * objectPoints[from + 2];
  }));

  // On a narrow screen the colour bar is below the body, and the camera is farther away.
  const narrow = () => stage.clientWidth < 600;
  const scale = (title, top) => ({ cmin: 0, cmax: top || 1, colorscale: "Viridis", showscale: true,
    colorbar: narrow() ? { title: { text: title, side: "top" }, thickness: 12, len: 0.9, orientation: "h", y: -0.02 }
      : { title: { text: title, side: "right" }, thickness: 14, len: 0.8 } });
  const light = { ambient: 0.85, diffuse: 0.35, specular: 0.02, roughness: 0.9, fresnel: 0.0 };

  function traces(s, what) {
    const share = weights.map((of) => of(s));
    const mean = (p, of) => parents[p].reduce((sum, v, k) => sum + share[p][k] * of(v), 0);
    const all = parents.map((_, p) => p), corners = all.slice(0, n);
    const at = (a) => (p) => mean(p, (v) => moved[3 * (s * n + v) + a]);
    const place = (list) => ({ x: list.map(at(0)), y: list.map(at(1)), z: list.map(at(2)) });
    const far = (list) => list.map((p) => mean(p, (v) => shift(s, v)));
    const base = { type: "mesh3d", flatshading: false, lighting: light, lightposition: { x: -2e4, y: 8e4, z: 5e4 } };
    const side = { ...base, ...place(corners), ...sides, hoverinfo: "skip", color: "#d9d6cf" };
    const press = all.map((p) => mean(p, (v) => pressure[s * n + v]));
    const states = parents.map((vs) => [...new Set(vs.map((v) => names[status[s * n + v]]))].join(" / "));
    const text = all.map((p) => `${states[p]}<br>pressure ${press[p].toPrecision(3)} MPa`
      + `<br>moved ${mean(p, (v) => shift(s, v)).toPrecision(3)} mm`);
    const only = (keep) => {
      const on = owner.map((_, t) => t).filter((t) => keep(stateOf(s, t)));
      return { i: on.map((t) => six.i[t]), j: on.map((t) => six.j[t]), k: on.map((t) => six.k[t]) };
    };
    const face = { ...base, ...place(all), ...six, text,
      hovertemplate: "x %{x:.2f}, y %{y:.2f}, z %{z:.2f} mm<br>%{text}<extra></extra>" };
    if (what === "status") Object.assign(face, { intensitymode: "cell", intensity: owner.map((_, t) => stateOf(s, t)),
      cmin: -0.5, cmax: 2.5, showscale: false, colorscale: [[0, "#c4c4c4"], [1 / 3, "#c4c4c4"], [1 / 3, "#1f3f77"],
        [2 / 3, "#1f3f77"], [2 / 3, "#f28e2b"], [1, "#f28e2b"]] });
    const open = { ...face, ...only((state) => state === 0), color: "#c4c4c4" };
    if (what === "pressure") Object.assign(face, only((state) => state !== 0),
      { intensity: press, ...scale("contact pressure (MPa)", highest) });
    if (what === "moved") {
      Object.assign(face, { intensity: far(all), ...scale("displacement (mm)", farthest) });
      Object.assign(side, { intensity: far(corners), ...scale("", farthest), showscale: false });
    }
    const tint = window.matchMedia("(prefers-color-scheme: dark)").matches ? "#e0408f" : "#b0006a";
    const before = (points, share) => Object.fromEntries(["x", "y", "z"].map((name, a) =>
      [name, points.map((p) => p[a] + share * extent * FROM[a])]));
    // A name is lowered until it is clear of the others; sizes of text relative to the extent of the body.
    const placedNames = [], [across, down] = narrow() ? [0.6, 0.09] : [0.3, 0.045];
    const nameOf = (middle) => {
      const at = [...middle], apart = (o, a) => Math.abs(o[a] - at[a]) / extent;
      while (placedNames.some((o) => apart(o, 0) < across && apart(o, 1) < down)) at[1] -= 0.1 * down * extent;
      placedNames.push(at);
      return at;
    };
    const lines = !gauges.checked ? [] : data.gauges[s].flatMap((line, g) => {
      const mark = { type: "scatter3d", hoverinfo: "skip", textfont: { color: tint, size: 13 } };
      return [
        { ...mark, mode: "lines+markers", ...before(line, LINE), line: { color: tint, width: 6 },
          marker: { color: tint, size: [0, 5, 0], line: { width: 0 } } },
        { ...mark, mode: "text", ...before([nameOf(line[1])], NAME), text: [data.gaugeLabels[g]],
          textposition: "bottom center" },
      ];
    });
    const object = { ...base, hoverinfo: "skip", color: "#7fa7c9", opacity: 0.3, x: [], y: [], z: [], i: [], j: [], k: [] };
    placed[s].forEach((value, p) => object["xyz"[p % 3]].push(value));
    for (let f = 0; f < objectFaces.length; f += 3) {
      object.i.push(objectFaces[f]); object.j.push(objectFaces[f + 1]); object.k.push(objectFaces[f + 2]);
    }
    const shown = thing.checked && object.i.length ? [object] : [];
    return [...lines, side, face, ...(what === "pressure" ? [open] : []), ...shown];
  }

  // The axes are the same for all steps, so that the motion of the finger is visible. Along an axis they hold the object
  // where it is no longer than the body; a longer one, such as a plane, is cut.
  const bounds = (lists, a) => lists.reduce(([low, high], list) => {
    for (let p = a; p < list.length; p += 3) { low = Math.min(low, list[p]); high = Math.max(high, list[p]); }
    return [low, high];
  }, [Infinity, -Infinity]);
  const range = [0, 1, 2].map((a) => {
    const [low, high] = bounds([rest, moved], a), [bottom, top] = bounds(placed, a);
    const room = 0.02 * (high - low), name = data.gaugeLabels.length ? NAME * extent * FROM[a] : 0;
    const whole = top - bottom <= extent;  // without an object both are infinite, and change nothing
    return [Math.min(low - Math.max(room, -name), whole ? bottom : low),
      Math.max(high + Math.max(room, name), whole ? top : high)];
  });
  // Distance of the camera at which the projected width and height of the body fit into the stage.
  const size = range.map(([low, high]) => high - low), cube = Math.cbrt(size[0] * size[1] * size[2]);
  const wide = 0.92 * size[0] + 0.38 * size[2], high = 0.84 * size[1] + 0.5 * size[2] + 0.17 * size[0];
  const room = narrow() ? 2.1 : 1.8;  // titles of axes take a larger share of a narrow screen
  const back = Math.max(1.5 * high, room * wide * stage.clientHeight / stage.clientWidth) / cube;
  const eye = { x: -0.35 * back, y: 0.6 * back, z: 0.85 * back };
  function layout() {
    const style = getComputedStyle(document.body), ink = style.color, line = style.getPropertyValue("--line").trim();
    const axis = (a) => ({ title: { text: "xyz"[a] + " (mm)" }, range: range[a], gridcolor: line, zerolinecolor: line,
      showbackground: false, nticks: narrow() ? 4 : 6, showspikes: false });
    return { margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "rgba(0,0,0,0)", font: { color: ink, size: 12 },
      uirevision: "keep", showlegend: false,
      scene: { xaxis: axis(0), yaxis: axis(1), zaxis: axis(2), dragmode: "orbit",
        // "data" would take the aspect from the data, which the ranges cut
        aspectmode: "manual", aspectratio: { x: size[0] / cube, y: size[1] / cube, z: size[2] / cube },
        camera: { up: { x: 0, y: 1, z: 0 }, center: { x: 0, y: narrow() ? -0.12 : 0, z: 0 }, eye: eye } } };
  }
  const config = { responsive: true, displaylogo: false, displayModeBar: false };
  function draw() {
    const s = Number(slider.value);
    label.textContent = data.labels[s];
    show("zone", field.value === "status");
    show("open", field.value !== "moved");
    return Plotly.react(stage, traces(s, field.value), layout(), config);
  }
  field.addEventListener("change", draw);
  slider.addEventListener("input", draw);
  gauges.addEventListener("change", draw);
  thing.addEventListener("change", draw);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  draw().then(() => { stage.dataset.drawn = "yes"; });
})();
