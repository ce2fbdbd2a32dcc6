"use strict";
(function () {
  const charts = JSON.parse(document.getElementById("chart-data").textContent);
  const boxes = [...document.querySelectorAll(".chart > div")];
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const plain = (text) => text.replace(/&/g, "&amp;").replace(/</g, "&lt;");  // plotly interprets tags
  // Height of a line of the legend, of the margins above (with plotly's tool bar) and below the axes, and width of a
  // character, in pixels.
  const LINE = 18, ABOVE = 34, BELOW = 48, WIDE = 7.5;

  // Break the names in the title of a legend into lines of at most `most` characters.
  function broken(text, most) {
    return text.split(", ").reduce((lines, name) => {
      const longer = lines.length ? `${lines[lines.length - 1]}, ${name}` : name;
      return longer.length > most && lines.length ? [...lines, name] : [...lines.slice(0, -1), longer];
    }, []);
  }
  function traces(chart) {
    return chart.lines.map((line) => ({ type: "scatter", name: plain(line.label),
      mode: chart.joined ? "lines+markers" : "markers", x: line.x, y: line.y, line: { width: 1.6 }, marker: { size: 6 },
      hovertemplate: `%{x:.6~g}, %{y:.5~g}<extra>${chart.lines.length > 1 ? plain(line.label) : ""}</extra>` }));
  }
  function layout(chart, box) {
    const style = getComputedStyle(document.body), grid = style.getPropertyValue("--line").trim();
    const axis = (title) => ({ title: { text: plain(title), standoff: 8 }, gridcolor: grid, zerolinecolor: grid,
      linecolor: grid, automargin: true, exponentformat: "power", nticks: 7 });
    // The height of the legend: its title, and its entries in rows of equal width.
    const several = chart.lines.length > 1, longest = Math.max(...chart.lines.map((line) => line.label.length));
    const abreast = Math.max(1, Math.floor((box.clientWidth - 20) / (45 + WIDE * longest)));
    const title = broken(chart.legend, (box.clientWidth - 90) / WIDE);
    const legend = several ? LINE * (0.5 + title.length + Math.ceil(chart.lines.length / abreast)) : 0;
    return { height: 290 + ABOVE + legend, margin: { l: 60, r: 12, t: ABOVE, b: BELOW + legend },
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", showlegend: several,
      modebar: { bgcolor: "rgba(0,0,0,0)", color: style.color, activecolor: style.color },
      font: { color: style.color, size: 12, family: style.fontFamily }, xaxis: axis(chart.x), yaxis: axis(chart.y),
      legend: { orientation: "h", yref: "container", y: 0, yanchor: "bottom", x: 0,
        title: { text: title.map(plain).join("<br>"), side: "top" } } };
  }
  function draw() {
    return Promise.all(boxes.map((box, i) => Plotly.react(box, traces(charts[i]), layout(charts[i], box), {
      responsive: true, displaylogo: false,
      // sendChartToCloud would upload the chart.
      modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d", "sendChartToCloud"],
      toImageButtonOptions: { filename: charts[i].caption, scale: 2 } })));
  }
  dark.addEventListener("change", draw);
  draw().then(() => boxes.forEach((box) => { box.dataset.drawn = "yes"; }));
})();
