// The plots of the report. Each group of runs has linked plots over one time axis, and a track that marks the same
// instant. Data: `groups` of the JSON in #data, from `curves.plots`. Shared parts: `charts.js`.
(() => {
  const SLIP = "Slip angle of the axles";
  const BODY_STEP = 8; // instants from one body to the next in the limits of the track

  class Group {
    constructor(data) {
      this.data = data;
      this.plots = [];
      this.visible = data.runs.map(() => true);
      this.focus = null;
      this.time = Array.from({ length: data.samples }, (_, i) => data.start_s + i * data.step_s);
      this.box = element("div", { class: "plots" });
      const bar = element("div", { class: "toolbar" });
      document.querySelector(`#${data.anchor} .drawn`).replaceChildren(bar, this.box);
      this.toolbar(bar);
      if (data.track) this.track = new Track(this, data.track);
      for (const panel of data.panels) this.plots.push(this.panel(panel));
      if (data.zero.length) this.box.after(element("p", { class: "key quiet" }, zeroTold(data.zero)));
      new ResizeObserver(() => this.fit()).observe(this.box);
      this.zoom(null);
    }

    // Colour of a run; pale while the pointer is on another run.
    colour(run) {
      return paint[`run-${this.data.runs[run].place}`] + (this.focus == null || this.focus === run ? "" : "2e");
    }

    pointAtRun(run) {
      this.focus = run;
      for (const plot of this.plots) plot.redraw(false);
      if (this.track) this.track.redraw();
    }

    figure(title, shape, name) {
      const values = element("span", { class: "values" });
      const holder = element("div", { role: "img", "aria-label": name });
      this.box.append(element("figure", { class: `plot ${shape}` }, element("figcaption", {}, ...title, values), holder));
      return [holder, values];
    }

    toolbar(bar) {
      this.data.runs.forEach((run, i) => {
        const swatch = swatchOf(`var(--run-${run.place})`, dashed(run, 2));
        const button = element("button", { type: "button", "aria-pressed": "true" }, swatch, run.label);
        button.addEventListener("click", () => {
          this.visible[i] = !this.visible[i];
          button.setAttribute("aria-pressed", String(this.visible[i]));
          for (const plot of this.plots) {
            plot.panel.series.forEach((series, k) => { if (series.run === i) plot.setSeries(k + 1, { show: this.visible[i] }); });
          }
          if (this.track) this.track.redraw();
        });
        for (const [name, run] of [["mouseenter", i], ["focus", i], ["mouseleave", null], ["blur", null]]) {
          button.addEventListener(name, () => this.pointAtRun(run != null && this.visible[run] ? run : null));
        }
        bar.append(button);
      });
      this.player = new Player(this.data.samples - 1, this.data.step_s, this.data.start_s, (i) => this.pointAt(i));
      const reset = element("button", { type: "button", class: "reset" }, "Whole run");
      reset.addEventListener("click", () => { this.zoom(null); if (this.track) this.track.whole(); });
      const touch = matchMedia("(pointer: coarse)").matches;
      bar.append(reset, this.player.row, element("span", { class: "hint" }, touch ? "Pinch to zoom, slide to read values, tap a run to hide it." : "Drag to zoom, double-click for the whole run; point at a run to see it alone, click to hide it."));
      // The legend of a phone takes too much room to stay in sight; the player does.
      if (NARROW.matches) bar.after(this.player.row);
    }

    show(i) {
      this.player.tell(i);
      if (this.track) this.track.at(i);
    }

    panel(panel) {
      const { runs } = this.data;
      const title = [element("b", {}, panel.title), element("span", { class: "quiet" }, `${panel.unit}${panel.note ? ", " + panel.note : ""}`)];
      const [holder, values] = this.figure(title, "", `${panel.title} over time`), shaded = panel.title === SLIP && this.data.slip_limit_deg != null;
      if (shaded) holder.after(element("p", { class: "key quiet" }, this.slipTold(panel)));
      const lines = panel.series.map((series) => ({
        stroke: () => this.colour(series.run), points: { show: false }, gaps: wideGaps,
        width: series.dotted ? 1.2 : lineWidth(series.run), dash: series.dotted ? [1.5, 3] : dashed(runs[series.run], 1.5), cap: "butt",
      }));
      const plot = new uPlot({
        width: holder.clientWidth || 360, height: PLOT_HEIGHT, padding: [6, 18, 0, 0], legend: { show: false }, pxAlign: 0,
        cursor: { y: false, sync: { key: this.data.anchor }, drag: { x: true, y: false }, points: { size: 7 } },
        scales: { x: { time: false, range: (_, min, max) => [min, max] }, y: { range: (_, low, high) => padded(low, high, panel.min_span) } },
        axes: [axis(26, " s"), { ...axis(50), space: sideRoom }],
        series: [{}, ...lines],
        hooks: {
          drawAxes: [(u) => this.patches(u), ...(shaded ? [(u) => this.shade(u)] : [])], draw: [(u) => this.marks(u)],
          setScale: [(u, key) => { if (key === "x" && u === this.plots[0]) this.limit(u.scales.x); }],
          setCursor: [(u) => this.read(u, panel, values)],
        },
      }, [this.time, ...panel.series.map((series) => series.values)], holder);
      plot.panel = panel;
      touchable(plot, (range) => this.zoom(range));
      return plot;
    }

    read(u, panel, values) {
      const i = u.cursor.idx;
      values.replaceChildren();
      if (i == null || u.cursor.left < 0) { if (this.track && !this.player.held) this.track.at(null); return; }
      values.append(`${this.time[i].toFixed(2)} s`);
      panel.series.forEach((series) => {
        if (!this.visible[series.run] || (series.dotted && panel.series.length > MOST_TOLD)) return;
        values.append(" ", element("span", { style: `--run: var(--run-${this.data.runs[series.run].place})${series.dotted ? "; border-bottom-style: dotted" : ""}` }, shown(series.values[i])));
      });
      // While it plays, the places of the cars come from the clock.
      if (!this.player.playing) this.show(i);
    }

    // When the rear axle of each run is first beyond the slip angle of the largest side force.
    slipTold(panel) {
      const limit = this.data.slip_limit_deg, several = this.data.runs.length > 1;
      const beyond = panel.series.filter(({ dotted }) => !dotted).flatMap(({ run, values }) => {
        const at = values.findIndex((value) => value != null && Math.abs(value) > limit);
        return at < 0 ? [] : [`${several ? `${this.data.runs[run].name} ` : ""}from ${this.time[at].toFixed(2)} s`];
      });
      const most = `eyond ${limit.toFixed(1)} deg${beyond.length ? ":" : ","} more slip gives the rear tyres less side force.`;
      return beyond.length ? `Shaded, b${most} Rear axle beyond it: ${beyond.join(", ")}.` : `B${most} ${several ? "All rear axles stay" : "The rear axle stays"} below.`;
    }

    // Shade the times when a wheel of a run is on another friction than at the start: the darker, the more runs.
    patches(u) {
      const { ctx, bbox } = u, inside = (time) => Math.min(Math.max(u.valToPos(time, "x", true), bbox.left), bbox.left + bbox.width);
      ctx.save();
      ctx.fillStyle = paint.patch; ctx.globalAlpha = 1 / this.data.runs.length;
      for (const { patches_s } of this.data.runs) for (const [from, to] of patches_s) ctx.fillRect(inside(from), bbox.top, inside(to) - inside(from), bbox.height);
      ctx.restore();
    }

    shade(u) {
      const { ctx, bbox } = u, y = (value) => Math.min(Math.max(u.valToPos(value, "y", true), bbox.top), bbox.top + bbox.height);
      const limit = this.data.slip_limit_deg;
      ctx.save();
      ctx.fillStyle = paint.failed; ctx.globalAlpha = 0.12;
      ctx.fillRect(bbox.left, bbox.top, bbox.width, y(limit) - bbox.top);
      ctx.fillRect(bbox.left, y(-limit), bbox.width, bbox.top + bbox.height - y(-limit));
      ctx.restore();
    }

    marks(u) {
      const { ctx, bbox } = u;
      ctx.save();
      ctx.beginPath(); ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height); ctx.clip();
      ctx.strokeStyle = ctx.fillStyle = paint.quiet; ctx.lineWidth = devicePixelRatio;
      ctx.setLineDash([2 * devicePixelRatio, 3 * devicePixelRatio]);
      ctx.font = FONT.replace("12px", `${11 * devicePixelRatio}px`);
      ctx.textBaseline = "top"; ctx.textAlign = "left";
      const places = this.data.marks.map((mark) => u.valToPos(mark.time_s, "x", true)), free = [], gap = 3 * devicePixelRatio;
      for (const x of places) { ctx.beginPath(); ctx.moveTo(x, bbox.top); ctx.lineTo(x, bbox.top + bbox.height); ctx.stroke(); }
      ctx.strokeStyle = paint.paper; ctx.lineWidth = gap; ctx.setLineDash([]);
      for (const [k, { text }] of u.panel === this.data.panels[0] ? this.data.marks.entries() : []) {
        // Near the right end a text stands before its mark; one that would overlap another moves a line down.
        const width = ctx.measureText(text).width, after = places[k] + gap, left = after + width > bbox.left + bbox.width ? places[k] - gap - width : after;
        let row = 0;
        while (left < free[row]) row++;
        free[row] = left + width + 2 * gap;
        for (const ink of ["strokeText", "fillText"]) ctx[ink](text, left, bbox.top + 14 * devicePixelRatio * row);
      }
      ctx.restore();
    }

    zoom(range) {
      const whole = { min: this.time[0], max: this.time[this.time.length - 1] || 1 };
      for (const plot of this.plots) plot.setScale("x", range || whole);
    }

    limit({ min, max }) {
      const place = (time_s) => Math.min(Math.max((time_s - this.data.start_s) / (this.data.step_s || 1), 0), this.data.samples - 1);
      this.player.limit(Math.ceil(place(min) - 1e-6), Math.floor(place(max) + 1e-6));
    }

    pointAt(i) {
      const plot = this.plots[0];
      this.show(i);
      if (plot) plot.setCursor({ left: plot.valToPos(this.time[i], "x"), top: 1 }, true, true);
    }

    fit(width = null) {
      if (width != null) this.player.play(false);
      for (const plot of this.plots) {
        const room = width == null ? plot.root.parentElement.clientWidth : (width - PRINTED_GAP) / 2;
        if (room > 0 && room !== plot.width) plot.setSize({ width: room, height: width == null ? PLOT_HEIGHT : PRINTED_PLOT_HEIGHT });
      }
      if (this.track) this.track.fit(width);
    }

    repaint() { for (const plot of this.plots) plot.redraw(false); if (this.track) this.track.redraw(); }
  }

  // The road from above. uPlot gives axes and zoom; this class draws the content.
  class Track {
    constructor(group, data) {
      this.group = group;
      this.data = data;
      const note = this.note = element("span", { class: "quiet" });
      const title = [element("b", {}, "Track of the front axle centre"), note];
      const finite = (key) => [...(data.whole?.[key] ?? data.tracks.flatMap((track) => track[key])), ...this.bodies(key)].filter((value) => value != null);
      this.limits = data.view || { x: this.ends(finite("x")), y: this.ends(finite("y")) };
      // A course and a long track fill the width; a square track stands beside two plots.
      const span = ([low, high]) => high - low;
      this.tall = !data.view && span(this.limits.x) < 3 * span(this.limits.y);
      const [holder] = group.figure(title, this.tall ? "tall" : "wide", "Tracks from above, with lanes, cones and cars");
      const { x, y } = this.limits;
      this.plot = new uPlot({
        width: holder.clientWidth || 360, height: this.height(holder.clientWidth || 360), padding: [6, 18, 0, 0], legend: { show: false },
        cursor: { drag: { x: true, y: true, uni: 20 }, points: { show: false }, x: false, y: false },
        scales: { x: { time: false, range: (u) => this.range(u, "x") }, y: { range: (u) => this.range(u, "y") } },
        axes: [axis(26, " m"), { ...axis(50, " m"), space: sideRoom }],
        series: [{}, { show: true, paths: () => null, points: { show: false } }],
        hooks: {
          drawAxes: [(u) => this.draw(u)],
          setCursor: [(u) => this.nearest(u)],
          setScale: [() => this.place()],
        },
      }, [x, y], holder);
      const cars = this.plot.over.appendChild(document.createElementNS(SVG, "svg"));
      cars.setAttribute("class", "cars");
      this.cars = data.tracks.map((track) => ["car", "wheels"].map((part) => {
        const path = cars.appendChild(document.createElementNS(SVG, "path"));
        path.setAttribute("class", part);
        path.style.setProperty("--run", `var(--run-${group.data.runs[track.run].place})`);
        path.toggleAttribute("hidden", true);
        return path;
      }));
      touchable(this.plot, (range) => (range ? this.plot.setScale("x", range) : this.whole()));
    }

    // A track to one scale is no higher than it fills, unless it stands beside plots.
    height(width, printed = false) {
      const tall = 2 * PLOT_HEIGHT + PLOT_HEAD + PLOT_GAP, most = printed ? PRINTED_TRACK_HEIGHT : this.tall ? tall : TRACK_HEIGHT;
      if (this.tall && !printed && !NARROW.matches) return most;
      const { x, y } = this.limits, even = 32 + ((width - 64) * (y[1] - y[0])) / (x[1] - x[0]);
      return this.data.view ? Math.max(most, Math.min(printed ? most : tall, even)) : Math.min(most, Math.max(LEAST_TRACK_HEIGHT, even));
    }

    // Coordinates of the corners of the cars, at some instants: the plot shows whole cars.
    bodies(key) {
      const place = key === "x" ? 0 : 1;
      return this.data.tracks.filter(({ car }) => car).flatMap((track) => track.x.flatMap((x, i) =>
        (x == null || track.y[i] == null || track.yaw[i] == null || (i % BODY_STEP && i < track.x.length - 1) ? [] : carFromAbove(track, i)[0].map((corner) => corner[place]))));
    }

    ends(values) {
      let low = Infinity, high = -Infinity;
      for (const value of values) { low = Math.min(low, value); high = Math.max(high, value); }
      const margin = 0.04 * (high - low) + 1;
      return [low - margin, high + margin];
    }

    // A course is stretched sideways to fill its plot, and never squeezed; without one, both directions have the same scale.
    range(u, key) {
      const { x, y } = this.limits;
      const { width, height } = u.bbox;
      const along = (x[1] - x[0]) / width, beside = (y[1] - y[0]) / height, scale = Math.max(along, beside);
      if (!width || !height || (this.data.view && beside <= along)) return [...this.limits[key]];
      const [limits, pixels] = key === "x" ? [x, width] : [y, height];
      const middle = (limits[0] + limits[1]) / 2, half = (scale * pixels) / 2;
      return [middle - half, middle + half];
    }

    whole() {
      this.plot.batch(() => {
        for (const key of ["x", "y"]) {
          const [min, max] = this.range(this.plot, key);
          this.plot.setScale(key, { min, max });
        }
      });
    }

    redraw() { this.plot.redraw(false, false); this.place(); }

    fit(width) {
      const room = width == null ? this.plot.root.parentElement.clientWidth : width;
      if (room > 0 && room !== this.plot.width) { this.plot.setSize({ width: room, height: this.height(room, width != null) }); this.whole(); }
    }

    draw(u) {
      const { ctx, bbox } = u, dpr = devicePixelRatio;
      const px = (x) => u.valToPos(x, "x", true), py = (y) => u.valToPos(y, "y", true);
      const metre = (px(1) - px(0)), stretch = (py(0) - py(1)) / metre;
      // Stretched to a sliver, a car says less than the road that its body covers.
      const covers = stretch > MOST_STRETCH;
      const factors = this.data.tracks.find((track) => track.steer)?.car.factors;
      this.note.textContent = [
        ...(stretch > 1.05 ? [`lateral positions stretched ${stretch.toFixed(1)} times`] : stretch < 0.95 ? [`lateral positions squeezed to ${stretch.toFixed(2)} of their size`] : []),
        ...(covers ? ["shaded: width of the bodies"] : []),
        ...(this.data.patches.length ? [`blue: friction ${[...new Set(this.data.patches.map(({ mu }) => mu))].slice(0, 3).join(", ")}`] : []),
        ...new Set(this.data.obstacles.map(({ text }) => `bordered: ${text}`)),
        ...(factors ? [factors[0] === factors[2] ? `wheels turned ${factors[0]} times as far` : `front wheels turned ${factors[0]} times as far, rear wheels ${factors[2]} times`] : []),
      ].join(", ");
      ctx.save();
      ctx.beginPath(); ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height); ctx.clip();
      ctx.lineJoin = "round";
      ctx.fillStyle = paint.patch;
      for (const { corners } of this.data.patches) { ctx.beginPath(); for (const [x, y] of corners) ctx.lineTo(px(x), py(y)); ctx.fill(); }
      ctx.fillStyle = paint.lane; ctx.strokeStyle = paint.path; ctx.lineWidth = dpr;
      for (const { corners } of this.data.obstacles) { ctx.beginPath(); for (const [x, y] of corners) ctx.lineTo(px(x), py(y)); ctx.closePath(); ctx.fill(); ctx.stroke(); }
      for (const { x, y } of this.data.lanes) ctx.fillRect(px(x[0]), py(y[1]), px(x[1]) - px(x[0]), py(y[0]) - py(y[1]));
      const line = ({ x, y }, colour, width, dash) => {
        ctx.strokeStyle = colour; ctx.lineWidth = width * dpr; ctx.setLineDash(dash.map((length) => length * dpr));
        ctx.beginPath();
        let pen = false;
        for (let i = 0; i < x.length; i++) {
          if (x[i] == null || y[i] == null) { pen = false; continue; }
          if (pen) ctx.lineTo(px(x[i]), py(y[i])); else ctx.moveTo(px(x[i]), py(y[i]));
          pen = true;
        }
        ctx.stroke();
      };
      if (this.data.path) line(this.data.path, paint.path, 1.2, [2, 4]);
      for (const { run, x, y, ...track } of this.data.tracks) {
        if (!this.group.visible[run]) continue;
        const colour = this.group.colour(run), look = this.group.data.runs[run];
        line({ x, y }, colour, lineWidth(run), dashed(look, 1.5));
        if (covers && track.car) {
          const edge = (left) => x.flatMap((at, i) => (track.yaw[i] == null ? [] : [[at - left * Math.sin(track.yaw[i]), y[i] + left * Math.cos(track.yaw[i])]]));
          const half = track.car.width / 2;
          ctx.fillStyle = paint[`run-${look.place}`]; ctx.globalAlpha = 0.12;
          ctx.fill(new Path2D(this.outline([[...edge(half), ...edge(-half).reverse()]], true)));
          ctx.globalAlpha = 1;
          continue;
        }
        this.along({ x, y }, (i) => {
          if (!track.car || track.yaw[i] == null) return;
          ctx.setLineDash([]); ctx.lineWidth = dpr; ctx.strokeStyle = colour;
          ctx.stroke(new Path2D(this.outline(carFromAbove({ x, y, ...track }, i).slice(0, 1), true)));
        });
      }
      for (const [x, y, struck] of this.data.cones) {
        const r = this.data.cone_radius, wide = Math.max(r * metre, LEAST_CONE * dpr), high = Math.max(r * metre * stretch, LEAST_CONE * dpr);
        ctx.setLineDash([]);
        ctx.beginPath(); ctx.ellipse(px(x), py(y), wide, high, 0, 0, 2 * Math.PI);
        ctx.fillStyle = struck ? paint.struck : paint.cone; ctx.fill();
        if (!struck) continue;
        // A cone that a car hits is crossed out.
        const arm = 5 * dpr;
        ctx.strokeStyle = paint.struck; ctx.lineWidth = 1.6 * dpr;
        ctx.beginPath();
        for (const side of [-1, 1]) { ctx.moveTo(px(x) - arm, py(y) - side * arm); ctx.lineTo(px(x) + arm, py(y) + side * arm); }
        ctx.stroke();
      }
      ctx.restore();
    }

    // Instants at which cars are drawn, so far apart that they do not hide each other.
    along({ x, y }, draw) {
      const apart = CARS_APART * devicePixelRatio;
      let from = null;
      for (let i = 0; i < x.length; i++) {
        if (x[i] == null || y[i] == null) continue;
        const at = [this.plot.valToPos(x[i], "x", true), this.plot.valToPos(y[i], "y", true)];
        if (from && Math.hypot(at[0] - from[0], at[1] - from[1]) < apart) continue;
        from = at;
        draw(i);
      }
    }

    // Polygons as an SVG path, in pixels of the screen or of the canvas.
    outline(polygons, canvas) {
      const place = ([x, y]) => [this.plot.valToPos(x, "x", canvas), this.plot.valToPos(y, "y", canvas)].map((at) => at.toFixed(1)).join(" ");
      return polygons.map((corners) => `M${corners.map(place).join("L")}Z`).join("");
    }

    // Places of the cars at the instant under the cursor of the plots over time.
    at(i) { this.instant = i; this.place(); }

    place() {
      if (!this.cars) return;
      const i = this.instant;
      this.data.tracks.forEach((track, k) => {
        const there = i != null && track.x[i] != null && track.car && track.yaw[i] != null && this.group.visible[track.run];
        const [body, ...wheels] = there ? carFromAbove(track, i) : [[]];
        [[body], wheels].forEach((polygons, part) => {
          this.cars[k][part].toggleAttribute("hidden", !there);
          if (there) this.cars[k][part].setAttribute("d", this.outline(polygons, false));
        });
      });
    }

    // Conversely, the instant at which a car is nearest to the cursor.
    nearest(u) {
      const { left, top } = u.cursor;
      if (left == null || left < 0) return;
      let best = Infinity, found = null;
      for (const track of this.data.tracks) {
        if (!this.group.visible[track.run]) continue;
        for (let i = 0; i < track.x.length; i++) {
          if (track.x[i] == null) continue;
          const distance = Math.hypot(u.valToPos(track.x[i], "x") - left, u.valToPos(track.y[i], "y") - top);
          if (distance < best) { best = distance; found = i; }
        }
      }
      if (found != null) this.group.pointAt(found);
    }
  }

  drawn.push(...DATA.groups.map((data) => new Group(data)));
})();
