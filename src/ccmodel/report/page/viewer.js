// The interactive viewer: time series, residuals and loops of one recording with its models.
//
// The data of each recording is a text on the page (packed in viewer.py), which is unpacked when the recording is chosen.
// The plotting library is a text as well, and runs from the moment the viewer comes into view: the page opens as fast
// with 200 recordings as with one.
(() => {
  "use strict";
  const element = id => document.getElementById(id);
  const settings = JSON.parse(element("viewer-settings").textContent);
  const RECORDED = "recording";
  // Colours of Okabe and Ito, and a dash for each model, so that colour is not the only difference.
  const STYLES = {
    calibrated: { color: "#0072B2", dash: "solid" },
    extended: { color: "#D55E00", dash: "solid" },
    nearest: { color: "#B0508C", dash: "dash" },
    estimated: { color: "#6e7781", dash: "dot" },
  };
  const OTHER_STYLES = [{ color: "#009E73", dash: "dashdot" }, { color: "#8a6d00", dash: "longdash" }];
  const PALE = "#b9cfe0";
  const SHADES = ["#e9e9e9", "#fff2cc", "#ffffff", "#dff0ea"];
  const ROW_HEIGHT = 150;
  const LOOP_HEIGHT = 300;
  const NARROW = 640; // px: below, one panel stands under the other

  let run = null; // the chosen recording, unpacked
  let hidden = null; // names of models that are switched off
  let at = 0; // sample of the chosen time
  let linking = false; // a zoom or hover that this script caused itself

  const inflated = async id => {
    const bytes = Uint8Array.from(atob(element(id).textContent), c => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  };

  // Inverse of `packed` in viewer.py.
  const unpacked = bytes => {
    const length = new DataView(bytes.buffer).getUint32(0, true);
    const header = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
    const series = [];
    let offset = 4 + length;
    for (const row of header.series) {
      if (row.same_as !== undefined) {
        series.push(series[row.same_as]);
        continue;
      }
      const values = new Float64Array(header.count);
      for (let i = 0, level = 0; i < header.count; i++) {
        level = (level + bytes[offset + i] + 256 * bytes[offset + header.count + i]) & 0xffff;
        values[i] = level === settings.missing ? NaN : row.low + level * row.step;
      }
      offset += 2 * header.count;
      series.push(values);
    }
    const sets = {};
    header.series.forEach((row, k) => { (sets[row.set] ??= {})[row.channel] = series[k]; });
    const time = sets[""].time_s;
    delete sets[""];
    return { time, sets, phases: header.phases, phasesOf: header.phases_of, count: header.count };
  };

  const models = () => Object.keys(run.sets).filter(name => name !== RECORDED);
  // An earlier model with the same values, as the extended model of a batch for which nothing was named.
  const sameAs = set => models().slice(0, models().indexOf(set)).find(other =>
    Object.entries(run.sets[set]).every(([channel, values]) => run.sets[other][channel] === values));
  const shown = () => models().filter(name => !hidden.has(name) && !sameAs(name));
  const nameOf = set => (set === "nearest" ? "nearest (not accepted)" : set);
  const styleOf = set => STYLES[set] ?? OTHER_STYLES[models().filter(m => !STYLES[m]).indexOf(set) % OTHER_STYLES.length];
  const scaled = (values, channel) => Array.from(values, v => v * settings.channels[channel].scale);
  const axisTitle = channel => `${settings.channels[channel].symbol} (${settings.channels[channel].unit})`;
  // Four digits of the largest value of the channel, so that the digits stay in place under a moving pointer.
  const text = (value, channel) => {
    if (!Number.isFinite(value)) return "–";
    const largest = run.sets[RECORDED][channel].reduce((most, v) => Math.max(most, Math.abs(v)), 0) * settings.channels[channel].scale;
    return value.toFixed(Math.max(0, Math.min(6, 3 - Math.floor(Math.log10(largest || 1)))));
  };

  const panels = () => settings.panels.filter(channel =>
    run.sets[RECORDED][channel] && (element("viewer-tensions").checked || !settings.tensions.includes(channel)));

  const residual = (set, channel) => {
    const [model, recorded] = [run.sets[set][channel], run.sets[RECORDED][channel]];
    return scaled(model.map((value, i) => value - recorded[i]), channel);
  };

  const recordedLine = { color: PALE, width: 6 };
  const lineOf = set => ({ ...styleOf(set), width: 1.5 });
  const base = { mode: "lines", type: "scatter", hoverinfo: "none", showlegend: false };

  // Height of a panel, and distance from one to the next, as shares of a figure with so many rows.
  const rowsOf = (count, gap = 0.16) => [(1 - gap) / (count - gap), 1 / (count - gap)];

  // Time series on the left and residuals on the right; on a narrow screen, residuals below their channel.
  const seriesFigure = width => {
    const narrow = width < NARROW;
    const channels = panels();
    const count = channels.length * (narrow ? 2 : 1);
    const [height, step] = rowsOf(count);
    const time = Array.from(run.time);
    const data = [];
    const layout = {
      ...layoutBase(), height: count * ROW_HEIGHT + 40, hovermode: "x", hoverdistance: -1, spikedistance: -1,
      xaxis: timeAxis(narrow ? [0, 1] : [0, 0.47]), annotations: [],
    };
    if (!narrow) layout.xaxis2 = { ...timeAxis([0.55, 1]), matches: "x" };
    channels.forEach((channel, k) => {
      const rows = narrow ? [2 * k, 2 * k + 1] : [k, k];
      const names = [2 * k + 1, 2 * k + 2].map(n => (n === 1 ? "" : n));
      const columns = narrow ? ["x", "x"] : ["x", "x2"];
      names.forEach((name, side) => {
        const top = 1 - rows[side] * step;
        layout[`yaxis${name}`] = {
          domain: [Math.max(0, top - height), top], anchor: columns[side], automargin: true, zeroline: side === 1,
          zerolinecolor: "#666", gridcolor: "#e6e6e6", nticks: 5,
          title: { text: (side ? "Δ " : "") + axisTitle(channel), font: { size: 11 }, standoff: 4 },
        };
      });
      const [y, r] = names.map(name => `y${name}`);
      if (!models().some(set => run.sets[set][channel])) {
        const middle = 1 - rows[1] * step - height / 2;
        layout.annotations.push({ text: models().length ? "given to the model" : "no model", xref: `${columns[1]} domain`, yref: "paper", x: 0.5, y: middle, showarrow: false, font: { color: "#57606a" } });
      }
      data.push({ ...base, name: RECORDED, x: time, y: scaled(run.sets[RECORDED][channel], channel), xaxis: columns[0], yaxis: y, line: recordedLine });
      for (const set of shown()) {
        if (!run.sets[set][channel]) continue;
        data.push({ ...base, name: set, x: time, y: scaled(run.sets[set][channel], channel), xaxis: columns[0], yaxis: y, line: lineOf(set) });
        data.push({ ...base, name: set, x: time, y: residual(set, channel), xaxis: columns[1], yaxis: r, line: lineOf(set) });
      }
    });
    layout.shapes = shades(narrow ? ["x"] : ["x", "x2"]);
    return { data, layout };
  };

  const layoutBase = () => ({
    margin: { l: 62, r: 12, t: 12, b: 42 }, paper_bgcolor: "#fff", plot_bgcolor: "#fff", showlegend: false,
    font: { family: "system-ui, sans-serif", size: 12, color: "#1f2328" }, dragmode: "zoom",
  });
  const timeAxis = domain => ({
    domain, anchor: "free", position: 0, title: { text: "time (s)", standoff: 4 }, gridcolor: "#e6e6e6", zeroline: false,
    showspikes: true, spikemode: "across", spikesnap: "cursor", spikethickness: 1, spikedash: "solid", spikecolor: "#444",
    range: [run.time[0], run.time[run.count - 1]],
  });

  const shades = axes => axes.flatMap(axis => run.phases
    .filter(([, , phase]) => SHADES[phase] !== "#ffffff")
    .map(([from, to, phase]) => ({
      type: "rect", xref: axis, yref: "paper", x0: from, x1: to, y0: 0, y1: 1, line: { width: 0 },
      fillcolor: SHADES[phase], layer: "below",
    })));

  // Loops of the samples between two times.
  const loopsFigure = (width, [from, to]) => {
    const has = channel => run.sets[RECORDED][channel];
    const loops = settings.loops.filter(([x, y]) => has(x) && has(y));
    const columns = width < NARROW ? 1 : Math.min(2, loops.length);
    const rows = Math.ceil(loops.length / columns);
    const keep = [...run.time.keys()].filter(i => run.time[i] >= from && run.time[i] <= to);
    const picked = (set, channel) => {
      const values = run.sets[set][channel] ?? run.sets[RECORDED][channel];
      return keep.map(i => values[i] * settings.channels[channel].scale);
    };
    const data = [];
    const layout = { ...layoutBase(), height: rows * LOOP_HEIGHT + 30, hovermode: "closest", hoverdistance: 40 };
    loops.forEach(([x, y], k) => {
      const name = k === 0 ? "" : k + 1;
      const [row, column] = [Math.floor(k / columns), k % columns];
      const wide = 1 / columns;
      const [height, step] = rowsOf(rows, 0.2);
      const title = channel => ({ text: axisTitle(channel), font: { size: 11 }, standoff: 4 });
      layout[`xaxis${name}`] = { domain: [column * wide + (column ? 0.06 : 0), (column + 1) * wide - 0.02], anchor: `y${name}`, title: title(x), gridcolor: "#e6e6e6", zeroline: false };
      layout[`yaxis${name}`] = { domain: [Math.max(0, 1 - row * step - height), 1 - row * step], anchor: `x${name}`, title: title(y), gridcolor: "#e6e6e6", zeroline: false };
      const axes = { xaxis: `x${name}`, yaxis: `y${name}`, customdata: keep };
      data.push({ ...base, ...axes, name: RECORDED, x: picked(RECORDED, x), y: picked(RECORDED, y), line: recordedLine });
      for (const set of shown()) {
        // An input of the model is not a result of it; where both are given to it, there is no loop to compare.
        if (!run.sets[set][x] && !run.sets[set][y]) continue;
        data.push({ ...base, ...axes, name: set, x: picked(set, x), y: picked(set, y), line: lineOf(set) });
      }
      data.push({ ...base, ...axes, mode: "markers", name: "chosen time", customdata: null, x: [], y: [], marker: { size: 10, color: "#000", symbol: "circle-open", line: { width: 2 } } });
    });
    return { data, layout, loops };
  };

  const CONFIG = { displaylogo: false, responsive: true, modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] };
  let loopMarkers = [];

  const draw = async () => {
    const [series, loops] = [element("viewer-series"), element("viewer-loops")];
    const range = zoomed();
    const first = seriesFigure(series.clientWidth);
    if (range) first.layout.xaxis.range = range;
    await Plotly.react(series, first.data, first.layout, CONFIG);
    if (!series.dataset.linked) {
      series.dataset.linked = "yes";
      series.on("plotly_hover", event => choose(nearestSample(event.xvals ? event.xvals[0] : event.points[0].x), "series"));
      series.on("plotly_relayout", change => {
        if (!linking && Object.keys(change).some(key => /^xaxis\d*\.(range|autorange)/.test(key))) drawLoops();
      });
    }
    await drawLoops();
    if (!loops.dataset.linked) {
      loops.dataset.linked = "yes";
      loops.on("plotly_hover", event => {
        const point = event.points[0];
        if (point.customdata !== undefined && point.customdata !== null) choose(point.customdata, "loops");
      });
    }
    choose(at, "");
  };

  const zoomed = () => {
    const axis = element("viewer-series")._fullLayout?.xaxis;
    return run.drawn && axis ? [...axis.range] : null;
  };

  const drawLoops = async () => {
    const div = element("viewer-loops");
    const figure = loopsFigure(div.clientWidth, zoomed() ?? [run.time[0], run.time[run.count - 1]]);
    div.hidden = figure.loops.length === 0;
    loopMarkers = figure.loops.map(([x, y], k) => ({ x, y, trace: figure.data.flatMap((t, i) => (t.name === "chosen time" ? [i] : []))[k] }));
    await Plotly.react(div, figure.data, figure.layout, CONFIG);
    mark();
  };

  const nearestSample = time => {
    let [low, high] = [0, run.count - 1];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (run.time[middle] <= time) low = middle; else high = middle;
    }
    return time - run.time[low] < run.time[high] - time ? low : high;
  };

  // The chosen time: values in the table, a ring in each loop, a line in the time series.
  let pending = false;
  const choose = (sample, from) => {
    at = Math.max(0, Math.min(run.count - 1, sample));
    element("viewer-time").value = at;
    element("viewer-at").textContent = `${run.time[at].toFixed(3)} s`;
    readout();
    if (pending) return;
    pending = true;
    requestAnimationFrame(() => {
      pending = false;
      mark();
      if (from !== "series" && from !== "") line();
    });
  };

  const mark = () => {
    if (!loopMarkers.length) return;
    const value = channel => [run.sets[RECORDED][channel][at] * settings.channels[channel].scale];
    Plotly.restyle(element("viewer-loops"), { x: loopMarkers.map(m => value(m.x)), y: loopMarkers.map(m => value(m.y)) }, loopMarkers.map(m => m.trace));
  };

  const line = () => {
    const series = element("viewer-series");
    const axes = series._fullLayout.xaxis2 ? ["x", "x2"] : ["x"];
    const lines = axes.map(axis => ({ type: "line", xref: axis, yref: "paper", x0: run.time[at], x1: run.time[at], y0: 0, y1: 1, line: { color: "#444", width: 1 } }));
    linking = true;
    Plotly.relayout(series, { shapes: [...shades(axes), ...lines] }).then(() => { linking = false; });
  };

  const cell = (tag, content, attributes = {}) => {
    const made = document.createElement(tag);
    made.textContent = content;
    Object.assign(made, attributes);
    return made;
  };

  const readout = () => {
    const [head, body] = [element("viewer-readout").tHead, element("viewer-readout").tBodies[0]];
    const header = document.createElement("tr");
    header.append(cell("th", "channel", { scope: "col", className: "t" }), cell("th", RECORDED, { scope: "col" }),
      ...shown().map(set => cell("th", nameOf(set), { scope: "col" })), cell("th", "unit", { scope: "col", className: "t" }));
    head.replaceChildren(header);
    body.replaceChildren(...[settings.input, ...panels()].filter(c => run.sets[RECORDED][c]).map(channel => {
      const row = document.createElement("tr");
      const value = set => text((run.sets[set][channel]?.[at] ?? NaN) * settings.channels[channel].scale, channel);
      row.append(cell("th", settings.channels[channel].label, { scope: "row", className: "t" }), cell("td", value(RECORDED)),
        ...shown().map(set => cell("td", value(set))), cell("td", settings.channels[channel].unit, { className: "t" }));
      return row;
    }));
  };

  const listModels = () => {
    const fields = element("viewer-sets");
    const legend = fields.querySelector("legend");
    const recorded = document.createElement("span");
    const swatch = cell("span", "", { className: "swatch" });
    swatch.style.background = PALE;
    recorded.append(swatch, RECORDED);
    fields.replaceChildren(legend, recorded, ...models().map(set => {
      const label = document.createElement("label");
      const same = sameAs(set);
      const box = cell("input", "", { type: "checkbox", checked: !hidden.has(set) && !same, disabled: Boolean(same), value: set });
      box.addEventListener("change", () => {
        if (box.checked) hidden.delete(set); else hidden.add(set);
        draw();
      });
      const sample = cell("span", "", { className: "line" });
      sample.style.borderTopColor = styleOf(set).color;
      sample.style.borderTopStyle = { solid: "solid", dot: "dotted" }[styleOf(set).dash] ?? "dashed";
      label.append(box, " ", sample, nameOf(set) + (same ? `: the same as ${nameOf(same)}` : ""));
      return label;
    }));
  };

  const listPhases = () => {
    const there = settings.phases.map((name, k) => [name, SHADES[k], run.phases.some(([, , phase]) => phase === k)]);
    element("viewer-phases").replaceChildren(...there.filter(([, , is]) => is).map(([name, shade]) => {
      const item = document.createElement("li");
      const swatch = cell("span", "", { className: "swatch" });
      swatch.style.cssText += `background:${shade};border:1px solid #999`;
      item.append(swatch, name);
      return item;
    }));
    if (run.phasesOf) element("viewer-phases").prepend(cell("li", `Phases of the model "${nameOf(run.phasesOf)}":`, {}));
  };

  const chooseRun = async number => {
    element("viewer-state").textContent = "Reading the recording …";
    run = unpacked(await inflated(`viewer-run-${number}`));
    // The batch's own estimates and fits are of interest once a diagnosis has calibrated the model; until then they are all there is.
    hidden ??= new Set(run.sets.calibrated ? models().filter(set => !["calibrated", "extended", "nearest"].includes(set)) : ["estimated"]);
    at = run.count >> 1;
    Object.assign(element("viewer-time"), { max: run.count - 1, value: at });
    listModels();
    listPhases();
    await draw();
    run.drawn = true;
    const chosen = element("viewer-run").selectedOptions[0];
    element("viewer-state").textContent = `Shown: ${chosen.parentElement.label}, ${chosen.textContent}.`
      + (models().length ? "" : " No model could be run on it.");
    element("viewer-box").dataset.shown = number;
  };

  const start = async () => {
    if (typeof DecompressionStream === "undefined") {
      element("viewer-state").textContent = "This browser is too old for the viewer; the static figures below show the same recordings.";
      return;
    }
    element("viewer-state").textContent = "Starting …";
    const library = document.createElement("script");
    library.textContent = new TextDecoder().decode(await inflated("viewer-library"));
    document.head.append(library);
    const chooser = element("viewer-run");
    chooser.addEventListener("change", () => chooseRun(chooser.value));
    element("viewer-tensions").addEventListener("change", draw);
    element("viewer-time").addEventListener("input", event => choose(Number(event.target.value), "slider"));
    element("viewer-reset").addEventListener("click", () => { run.drawn = false; draw().then(() => { run.drawn = true; }); });
    matchMedia(`(max-width: ${NARROW}px)`).addEventListener("change", draw);
    await chooseRun(chooser.value);
  };

  // A link of a card chooses the first recording of its batch.
  document.addEventListener("click", event => {
    const link = event.target.closest("a[data-batch]");
    const group = link && [...element("viewer-run").children].find(one => one.dataset.batch === link.dataset.batch);
    if (!group) return;
    element("viewer-run").value = group.children[0].value;
    element("viewer-run").dispatchEvent(new Event("change"));
  });

  new IntersectionObserver((entries, observer) => {
    if (!entries.some(entry => entry.isIntersecting)) return;
    observer.disconnect();
    start();
  }, { rootMargin: "300px" }).observe(element("viewer-box"));
})();
