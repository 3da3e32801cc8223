// The drawing that a reader moves. Without scripts, and on paper, the page shows the drawing that stands still.
"use strict";
(() => {
  const ARRAYS = { float32: Float32Array, int32: Int32Array, int16: Int16Array, uint8: Uint8Array };
  const HINT = "Point at a joint for its width. A click on a curve or on the shares leads to that movement.";
  const REACH = 12; // pixels from the pointer to a joint

  async function unpack(packed) {
    const bytes = Uint8Array.from(atob(packed.data), (c) => c.charCodeAt(0));
    const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new ARRAYS[packed.type](await new Response(plain).arrayBuffer());
  }

  async function unpackWall(wall) {
    const names = Object.keys(wall).filter((name) => wall[name].data !== undefined);
    const arrays = await Promise.all(names.map((name) => unpack(wall[name])));
    const found = { ...wall };
    names.forEach((name, i) => { found[name] = arrays[i]; found[name + "Largest"] = wall[name].largest; });
    found.blocks = found.first.length - 1;
    found.joints = found.kind.length;
    found.steps = found.movement.length;
    return found;
  }

  class Explorer {
    constructor(figure, shared) {
      this.figure = figure;
      this.shared = shared;
      this.canvas = figure.querySelector("canvas");
      this.slider = figure.querySelector("input");
      this.choice = figure.querySelector("select");
      this.said = figure.querySelector(".said");
      this.joint = figure.querySelector(".joint");
      this.slider.addEventListener("input", () => this.draw());
      if (this.choice) this.choice.addEventListener("change", () => this.show(this.choice.selectedIndex));
      for (const kind of ["pointermove", "pointerdown"]) this.canvas.addEventListener(kind, (e) => this.point(e));
      this.canvas.addEventListener("pointerleave", () => { this.joint.textContent = HINT; });
      new ResizeObserver(() => this.draw()).observe(this.canvas.parentElement);
    }

    async show(which) {
      this.shared.walls[which] = this.wall = await unpackWall(this.shared.walls[which]);
      this.slider.max = this.wall.steps - 1;
      this.slider.value = this.wall.steps - 1;
      this.joint.textContent = HINT;
      this.frame();
      this.draw();
    }

    // the wall at the movement nearest to one that was clicked on
    go(movement) {
      const far = this.wall.movement.map((value) => Math.abs(value - movement));
      this.slider.value = far.indexOf(Math.min(...far));
      this.draw();
      this.figure.scrollIntoView({ block: "nearest" });
    }

    // displacement of a point that moves with a block, to first order where the rotation is small
    motion(block, x, y, step) {
      const w = this.wall, n = w.blocks, at = step * n + block, unit = w.movedLargest / this.shared.levels;
      const turn = w.turned[at] * w.turnedLargest / this.shared.levels;
      const armX = x - w.centre[2 * block], armY = y - w.centre[2 * block + 1];
      const large = Math.abs(turn) > 0.02, across = large ? Math.sin(turn) : turn, along = large ? Math.cos(turn) - 1 : 0;
      return [w.moved[2 * at] * unit + along * armX - across * armY, w.moved[2 * at + 1] * unit + across * armX + along * armY];
    }

    place(block, x, y, step) {
      if (block < 0) return [x, y];
      const [dx, dy] = this.motion(block, x, y, step);
      return [x + this.wall.factor * dx, y + this.wall.factor * dy];
    }

    // both faces of a joint: start and end on one side, end and start on the other
    faces(joint, step) {
      const w = this.wall, a = w.side[2 * joint], b = w.side[2 * joint + 1], e = w.end.subarray(4 * joint, 4 * joint + 4);
      const one = a >= 0 ? a : b, other = b >= 0 ? b : a;
      return [this.place(one, e[0], e[1], step), this.place(one, e[2], e[3], step),
        this.place(other, e[2], e[3], step), this.place(other, e[0], e[1], step)];
    }

    // a frame that holds the wall at every step
    frame() {
      const w = this.wall;
      let [left, right, low, high] = [Infinity, -Infinity, Infinity, -Infinity];
      for (const step of [0, w.steps - 1]) {
        for (let block = 0; block < w.blocks; block++) {
          for (let i = w.first[block]; i < w.first[block + 1]; i++) {
            const [x, y] = this.place(block, w.corner[2 * i], w.corner[2 * i + 1], step);
            left = Math.min(left, x); right = Math.max(right, x); low = Math.min(low, y); high = Math.max(high, y);
          }
        }
      }
      for (const [, , y] of w.labels) low = Math.min(low, y);
      const rim = 0.02 * (right - left), below = w.ground.length ? 0.06 * (high - low) : 0;
      this.box = [left - rim, right + rim, low - rim - below, high + rim];
    }

    draw() {
      if (!this.wall || !this.box) return;
      const w = this.wall, step = Number(this.slider.value), [left, right, low, high] = this.box;
      const wide = this.canvas.parentElement.clientWidth, ratio = window.devicePixelRatio || 1;
      this.scale = wide / (right - left);
      const tall = Math.round(this.scale * (high - low));
      Object.assign(this.canvas, { width: wide * ratio, height: tall * ratio });
      Object.assign(this.canvas.style, { width: `${wide}px`, height: `${tall}px` });
      const pen = this.canvas.getContext("2d");
      pen.scale(ratio, ratio);
      const on = ([x, y]) => [(x - left) * this.scale, tall - (y - low) * this.scale];
      this.on = on;
      const path = (points) => {
        pen.beginPath();
        points.forEach((point, i) => (i ? pen.lineTo(...on(point)) : pen.moveTo(...on(point))));
      };
      this.drawGround(pen, path, step);
      pen.lineWidth = 0.5;
      for (let block = 0; block < w.blocks; block++) {
        const points = [];
        for (let i = w.first[block]; i < w.first[block + 1]; i++) points.push(this.place(block, w.corner[2 * i], w.corner[2 * i + 1], step));
        path(points);
        pen.closePath();
        pen.fillStyle = w.footing[block] ? this.shared.footing : this.shared.bricks[(block * 7919) % this.shared.bricks.length];
        pen.strokeStyle = this.shared.edge;
        pen.fill();
        pen.stroke();
      }
      const order = [];
      for (let joint = 0; joint < w.joints; joint++) if (w.kind[joint] === 1 || this.width(joint, step) > 0.02) order.push(joint);
      order.sort((a, b) => this.width(a, step) - this.width(b, step));
      for (const joint of order) this.drawJoint(pen, path, joint, step);
      pen.font = "13px sans-serif";
      pen.fillStyle = "#000";
      for (const [name, x, y] of w.labels) pen.fillText(name, ...on([x, y]));
      this.said.textContent = `${w.said[step]} Displacements × ${w.factor}.`;
      this.slider.setAttribute("aria-valuetext", w.said[step]);
    }

    drawGround(pen, path, step) {
      const w = this.wall, count = w.ground.length / 2;
      if (count < 2) return;
      const top = [], unit = w.riseLargest / this.shared.levels * w.factor, depth = 0.05 * (this.box[3] - this.box[2]);
      for (let i = 0; i < count; i++) top.push([w.ground[2 * i], w.ground[2 * i + 1] + unit * w.rise[step * count + i]]);
      path([...top, ...top.slice().reverse().map(([x, y]) => [x, y - depth])]);
      pen.fillStyle = this.shared.footing;
      pen.fill();
    }

    width(joint, step) { // mm
      return 1e3 * this.wall.gap[step * this.wall.joints + joint] * this.wall.gapLargest / this.shared.levels;
    }

    category(width) {
      let found = 0;
      while (found < this.shared.limits.length && width > this.shared.limits[found]) found++;
      return found;
    }

    drawJoint(pen, path, joint, step) {
      const kind = this.wall.kind[joint], width = this.width(joint, step), faces = this.faces(joint, step);
      const colours = [this.shared.colours[this.category(width)], this.shared.dpc, this.shared.control, "#000"];
      pen.strokeStyle = colours[kind];
      if (kind === 0 || width > 0.02) {
        path(faces);
        pen.closePath();
        pen.fillStyle = "#fff";
        pen.fill();
        pen.globalAlpha = 0.45;
        pen.fillStyle = colours[kind];
        pen.fill();
        pen.globalAlpha = 1;
      }
      pen.lineWidth = kind ? 1 : 1.2 + 0.45 * this.category(width);
      for (const face of [[faces[0], faces[1]], [faces[2], faces[3]]]) { path(face); pen.stroke(); }
    }

    point(event) {
      if (!this.wall || !this.on) return;
      const area = this.canvas.getBoundingClientRect(), step = Number(this.slider.value);
      const x = event.clientX - area.left, y = event.clientY - area.top;
      let best = -1, least = REACH;
      for (let joint = 0; joint < this.wall.joints; joint++) {
        const faces = this.faces(joint, step), middle = (i, k) => this.on([(faces[i][0] + faces[k][0]) / 2, (faces[i][1] + faces[k][1]) / 2]);
        const [ax, ay] = middle(0, 3), [bx, by] = middle(1, 2), dx = bx - ax, dy = by - ay;
        const along = Math.max(0, Math.min(1, ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1)));
        const far = Math.hypot(x - ax - along * dx, y - ay - along * dy);
        // of two joints as near, the one that is open
        const counts = this.width(joint, step) > 0.02 ? far - 2 : far;
        if (counts < least) { least = counts; best = joint; }
      }
      this.joint.textContent = best < 0 ? HINT : this.words(best, step);
    }

    words(joint, step) {
      const w = this.wall, e = w.end.subarray(4 * joint, 4 * joint + 4), width = this.width(joint, step);
      const name = ["Joint", "Damp-proof course", "Control joint", "Footing"][w.kind[joint]];
      const where = `${name} at ${((e[0] + e[2]) / 2).toFixed(2)} m along, ${((e[1] + e[3]) / 2).toFixed(2)} m up`;
      if (width <= 0.02) return `${where}: closed.`;
      return `${where}: open by ${width.toPrecision(2)} mm${w.kind[joint] ? "" : `, as wide as category ${this.category(width)} has it`}.`;
    }
  }

  // pictures whose horizontal axis is the movement lead to the wall at the movement clicked on
  function link(explorer) {
    for (const picture of document.querySelectorAll("svg[data-from]")) {
      const data = picture.dataset;
      picture.style.cursor = "pointer";
      picture.addEventListener("click", (event) => {
        const area = picture.getBoundingClientRect();
        const share = ((event.clientX - area.left) / area.width - data.left) / (data.right - data.left);
        if (share < 0 || share > 1) return;
        const log = data.scale === "log", ends = [Number(data.from), Number(data.to)].map((v) => (log ? Math.log(v) : v));
        const value = ends[0] + share * (ends[1] - ends[0]);
        explorer.go(log ? Math.exp(value) : value);
      });
    }
  }

  if (typeof DecompressionStream === "undefined") return;
  for (const text of document.querySelectorAll("script.walls")) {
    requestAnimationFrame(() => setTimeout(async () => { // after the first paint
      const figure = text.closest("figure"), explorer = new Explorer(figure, JSON.parse(text.textContent));
      figure.querySelector(".explorer").hidden = false;
      figure.querySelector(".still").classList.add("replaced");
      await explorer.show(0);
      link(explorer);
      figure.dataset.ready = "yes";
    }));
  }
})();
