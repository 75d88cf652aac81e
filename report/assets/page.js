"use strict";
// Unpacks plotly.js and draws the charts of a page (chart.rs says what they hold) when they come into view.
(() => {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const coarse = matchMedia("(pointer: coarse)");
  // Okabe and Ito's colours, lighter on dark ground.
  const themes = {
    light: {
      ink: "#1d2126", soft: "#59616b", paper: "#ffffff", grid: "#e6e9ed", zero: "#aab2bc", shade: "rgba(213,94,0,.16)",
      measured: "#555b63", commanded: "#555b63", model: "#d55e00", after: "#0072b2", mean_after: "#0072b2", one_step: "#c0588f", reference: "#008f6b", residual: "#7d3f98",
      points: "rgba(85,91,99,.28)", mean: "#d55e00", dots: "#d55e00", dots_after: "#0072b2", series: ["#0072b2", "#c98300", "#008f6b", "#c0588f"],
    },
    dark: {
      ink: "#e4e7eb", soft: "#a3abb5", paper: "#1c2025", grid: "#2c3239", zero: "#5a636e", shade: "rgba(255,157,77,.22)",
      measured: "#b9c0c9", commanded: "#b9c0c9", model: "#ff9d4d", after: "#6bb7f0", mean_after: "#6bb7f0", one_step: "#e79ac4", reference: "#3dd6a3", residual: "#cf9ae8",
      points: "rgba(185,192,201,.28)", mean: "#ff9d4d", dots: "#ff9d4d", dots_after: "#6bb7f0", series: ["#6bb7f0", "#f0c04a", "#3dd6a3", "#e79ac4"],
    },
  };
  const dashes = ["solid", "dot", "dash", "dashdot"];
  const title = 34, bottom = 40; // as in chart.rs
  const font = "system-ui, sans-serif";

  function traces(chart, theme) {
    const out = [];
    chart.panels.forEach((panel, at) => {
      const yaxis = at ? `y${at + 1}` : "y";
      let series = 0;
      for (const trace of panel.traces) {
        const nth = trace.role === "series" ? series++ % 4 : 0;
        const color = trace.role === "series" ? theme.series[nth] : theme[trace.role];
        const x = trace.x ?? chart.times;
        const common = { x, yaxis, xaxis: "x", entry: trace.role + trace.name, visible: !trace.hidden };
        const dots = trace.role === "dots" || trace.role === "dots_after";
        const mean = dots || trace.role === "mean" || trace.role === "mean_after";
        if (trace.spread && !mean) {
          // A polygon for each stretch without a gap: filling towards the trace before closes across gaps.
          const band = { ...common, x: [], y: [], mode: "lines", line: { width: 0 }, hoverinfo: "skip", fill: "toself", fillcolor: theme.shade };
          const known = k => k < trace.y.length && trace.y[k] !== null && trace.spread[k] !== null;
          for (let from = 0; from < trace.y.length; from += 1) {
            if (!known(from)) continue;
            let to = from;
            while (known(to)) to += 1;
            for (let k = from; k < to; k += 1) { band.x.push(x[k]); band.y.push(trace.y[k] - trace.spread[k]); }
            for (let k = to - 1; k >= from; k -= 1) { band.x.push(x[k]); band.y.push(trace.y[k] + trace.spread[k]); }
            band.x.push(null); band.y.push(null);
            from = to;
          }
          out.push(band);
        }
        const drawn = { ...common, y: trace.y, name: escape(panel.of ? `${panel.of}, ${trace.name}` : trace.name), label: trace.name, color };
        if (trace.role === "points") {
          Object.assign(drawn, { type: "scatter", mode: "markers", marker: { color, size: 3 }, hoverinfo: "skip" });
        } else {
          // Two models on top of what was measured: that must show from beneath.
          const beneath = trace.role === "measured" && panel.traces.some(t => t.role === "after");
          const width = beneath ? 5 : trace.role === "measured" ? 1.3 : 1.7;
          if (beneath) drawn.opacity = 0.4;
          drawn.mode = dots ? "markers" : mean ? "lines+markers" : "lines";
          drawn.line = { color, width, dash: trace.role === "commanded" ? "dot" : dashes[nth], shape: trace.step ? "hv" : "linear" };
          drawn.marker = { color, size: 6 };
          drawn.hovertemplate = "%{y:.5~g}";
        }
        if (mean) {
          drawn.error_y = { type: "data", array: trace.spread, color, thickness: 1, width: 3 };
          drawn.hovertemplate = "%{y:.3~g} ± %{error_y.array:.2~g}<extra></extra>";
        }
        out.push(drawn);
      }
    });
    return out;
  }

  function layout(chart, theme) {
    const height = chart.panels.reduce((sum, p) => sum + p.height + title, 0);
    const top = chart.events ? 22 : 0;
    const out = {
      height: height + top + bottom, margin: { l: 52, r: 12, t: top, b: bottom }, showlegend: false,
      paper_bgcolor: theme.paper, plot_bgcolor: theme.paper, font: { family: font, size: 12, color: theme.soft },
      dragmode: coarse.matches ? false : "zoom", hovermode: "x unified", hoversubplots: "axis", annotations: [], shapes: [],
      hoverlabel: { bgcolor: theme.paper, bordercolor: theme.zero, font: { color: theme.ink, family: font, size: 12 } },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: theme.soft, activecolor: theme.ink },
      xaxis: {
        gridcolor: theme.grid, linecolor: theme.zero, zeroline: false, ...(chart.x_range && { range: chart.x_range }), anchor: chart.panels.length > 1 ? `y${chart.panels.length}` : "y",
        ...(!chart.small && { title: { text: escape(chart.x_title), standoff: 4 } }), hoverformat: ".5~g", ticks: "outside", ticklen: 3, tickcolor: theme.zero,
        showspikes: true, spikethickness: 1, spikedash: "dot", spikecolor: theme.zero, spikemode: "across",
      },
    };
    if (chart.small) {
      // Names can be as long as a small chart is wide: from its right edge to the left.
      out.annotations.push({
        text: escape(chart.x_title), xref: "paper", yref: "paper", x: 1, y: 0, xanchor: "right", yanchor: "top", showarrow: false,
        font: { size: 11, color: theme.soft }, xshift: 8, yshift: -21,
      });
    }
    let from = 0;
    chart.panels.forEach((panel, at) => {
      const high = 1 - (from + title) / height, low = 1 - (from + title + panel.height) / height;
      from += panel.height + title;
      const axis = at ? `yaxis${at + 1}` : "yaxis";
      out[axis] = {
        domain: [Math.max(low, 0), high], gridcolor: theme.grid, zerolinecolor: theme.zero, zerolinewidth: 1, nticks: panel.height > 150 ? 7 : 4,
        anchor: "x", ticks: "", automargin: true, ...(panel.range && { range: panel.range }),
      };
      out.annotations.push({
        text: escape(panel.title), xref: "paper", yref: "paper", x: 0, y: high, xanchor: "left", yanchor: "bottom", showarrow: false,
        font: { size: 13, color: theme.ink }, xshift: -44, yshift: 6,
      });
      for (const [x0, x1] of panel.shaded ?? []) {
        out.shapes.push({ type: "rect", x0, x1, yref: `${at ? `y${at + 1}` : "y"} domain`, y0: 0, y1: 1, fillcolor: theme.shade, line: { width: 0 }, layer: "below" });
      }
    });
    (chart.events ?? []).forEach((x, at) => {
      chart.panels.forEach((_, k) => out.shapes.push({
        type: "line", x0: x, x1: x, yref: `${k ? `y${k + 1}` : "y"} domain`, y0: 0, y1: 1, line: { color: theme.soft, width: 1, dash: "dash" },
      }));
      out.annotations.push({ text: String(at + 1), x, yref: "paper", y: 1, yanchor: "bottom", showarrow: false, font: { size: 11, color: theme.ink } });
    });
    return out;
  }

  // Plotly reads a little HTML in titles: names shall be taken literally.
  const escape = text => text.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;");

  function legend(div, drawn) {
    const entries = new Map();
    drawn.forEach((trace, k) => {
      const entry = entries.get(trace.entry) ?? { traces: [] };
      entry.traces.push(k);
      if (trace.label !== undefined) Object.assign(entry, { trace });
      entries.set(trace.entry, entry);
    });
    const box = div.parentElement.querySelector(".legend");
    if (!box) return;
    box.replaceChildren();
    if (div.chart.x_range) {
      const button = document.createElement("button");
      button.type = "button";
      button.className = "all";
      button.append("show the whole run");
      button.onclick = () => {
        const all = button.textContent === "show the whole run";
        button.textContent = all ? "show the worst stretch" : "show the whole run";
        Plotly.relayout(div, all ? { "xaxis.autorange": true } : { "xaxis.range": [...div.chart.x_range] });
      };
      box.append(button);
    }
    for (const { traces, trace } of entries.values()) {
      const button = document.createElement("button");
      button.type = "button";
      button.setAttribute("aria-pressed", String(trace.visible));
      const dash = { dot: "2 3", dash: "7 4", dashdot: "7 3 2 3" }[trace.line?.dash] ?? "";
      button.innerHTML = trace.mode === "markers"
        ? `<svg width="12" height="10"><circle cx="6" cy="5" r="3" fill="${trace.color}"/></svg>`
        : `<svg width="22" height="10"><path d="M1 5H21" stroke="${trace.color}" stroke-width="3" stroke-dasharray="${dash}"/></svg>`;
      button.append(trace.label);
      button.onclick = () => {
        const visible = button.getAttribute("aria-pressed") !== "true";
        button.setAttribute("aria-pressed", String(visible));
        Plotly.restyle(div, { visible }, traces);
      };
      box.append(button);
    }
  }

  // gzip in base64, as packed.rs makes it.
  async function unpacked(element) {
    const bytes = Uint8Array.from(atob(element.textContent), letter => letter.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
  }

  async function load() {
    const script = document.createElement("script");
    script.textContent = await unpacked(document.getElementById("library"));
    document.head.append(script);
    return Plotly;
  }

  async function draw(div) {
    div.drawn = true;
    div.chart ??= JSON.parse(await unpacked(div.querySelector("script")));
    await library;
    const theme = dark.matches ? themes.dark : themes.light;
    const drawn = traces(div.chart, theme);
    const config = {
      responsive: true, doubleClick: "autosize", displaylogo: false, displayModeBar: div.chart.small ? false : coarse.matches ? true : "hover",
      modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"], showSendToCloud: false, plotlyServerURL: "",
    };
    await Plotly.react(div, drawn, layout(div.chart, theme), config);
    legend(div, drawn);
  }

  function trouble(error) {
    const box = document.getElementById("trouble");
    box.textContent = typeof DecompressionStream === "undefined"
      ? "The charts are missing: this browser cannot unpack them. Chrome from version 80, Firefox from 113 and Safari from 16.4 can."
      : `The charts are missing: ${error}`;
    box.hidden = false;
    throw error;
  }

  const show = div => draw(div).catch(trouble);
  const library = load();
  library.catch(trouble);

  const seen = new IntersectionObserver(entries => {
    for (const entry of entries) {
      if (entry.isIntersecting && !entry.target.drawn) show(entry.target);
    }
  }, { rootMargin: "400px" });
  const charts = [...document.querySelectorAll(".chart")];
  charts.forEach(div => seen.observe(div));
  dark.addEventListener("change", () => charts.filter(div => div.drawn).forEach(show));

  const runs = [...document.querySelectorAll(".run")];
  const buttons = [...document.querySelectorAll("button[data-run]")];
  const choose = at => {
    runs.forEach((run, k) => { run.hidden = k !== at; });
    buttons.forEach((button, k) => button.setAttribute("aria-pressed", String(k === at)));
    runs[at].querySelectorAll(".chart").forEach(div => { if (!div.drawn) show(div); });
  };
  buttons.forEach((button, at) => { button.onclick = () => choose(at); });
  if (runs.length) choose(0);
})();
