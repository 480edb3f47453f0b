// A remesh in three dimensions: loads its script, decodes it, and draws it with WebGL 2.

const kVertexShader = `#version 300 es
in vec3 a_position;
in vec3 a_normal;
in vec4 a_edge;
uniform mat3 u_turn;
uniform vec4 u_frame;
uniform vec3 u_middle;
uniform vec2 u_shift;
out vec3 v_normal;
out vec3 v_edge;
out float v_tint;
void main() {
  vec3 p = u_turn * (a_position - u_middle);
  v_normal = u_turn * a_normal;
  v_edge = a_edge.xyz;
  v_tint = a_edge.w;
  float away = u_frame.z - p.z;
  gl_Position = vec4(u_frame.x * p.x + u_shift.x * away, u_frame.y * p.y + u_shift.y * away,
                     (away - u_frame.z) / u_frame.w * away, away);
}`;

const kFragmentShader = `#version 300 es
precision highp float;
in vec3 v_normal;
in vec3 v_edge;
in float v_tint;
uniform float u_line;
uniform float u_edges;
out vec4 colour;
void main() {
  vec3 n = normalize(v_normal);
  bool inside = !gl_FrontFacing;
  n = inside ? -n : n;
  float light = 0.17 + 0.12 * n.y + 0.64 * max(0.0, dot(n, normalize(vec3(-0.5, 0.62, 0.6)))) +
      0.13 * max(0.0, dot(n, normalize(vec3(0.8, 0.1, 0.55))));
  light = sqrt(clamp(light * min(1.0, 0.5 + 0.85 * max(n.z, 0.0)), 0.0, 1.0));
  vec3 wide = max(fwidth(v_edge), vec3(1e-6));
  vec3 pixels = v_edge / wide;
  vec3 fade = clamp((1.0 / wide - 2.5) / 6.0, 0.0, 1.0);
  vec3 cover = fade * (1.0 - smoothstep(u_line - 0.6, u_line + 0.6, pixels));
  float line = 0.78 * u_edges * max(max(cover.x, cover.y), cover.z);
  vec3 bright = inside ? vec3(0.77, 0.63, 0.57)
      : mix(vec3(0.98, 0.965, 0.935), vec3(0.98, 0.77, 0.48), v_tint);
  colour = vec4(mix(vec3(0.118, 0.13, 0.165), bright, light * (1.0 - line)), 1.0);
}`;

/** What view scripts hold, see jobs/view_script.h. */
function decodeMesh(head) {
  const text = atob(head.data);
  let at = 0;
  const get = () => {
    let value = 0;
    for (let shift = 0; ; shift += 7) {
      const byte = text.charCodeAt(at++);
      value |= (byte & 127) << shift;
      if (byte < 128) return value;
      if (!(shift < 28)) throw new Error("The view's data are damaged.");
    }
  };
  let normals = null;
  if (head.normals) {
    const places = atob(head.normals);
    normals = new Float32Array(3 * head.vertices);
    for (let v = 0; v < head.vertices; ++v) {
      let x = (places.charCodeAt(2 * v) - 127.5) / 127, y = (places.charCodeAt(2 * v + 1) - 127.5) / 127;
      const z = 1 - Math.abs(x) - Math.abs(y);
      if (z < 0) [x, y] = [(1 - Math.abs(y)) * Math.sign(x), (1 - Math.abs(x)) * Math.sign(y)];
      normals.set([x, y, z], 3 * v);
    }
  }
  const positions = new Int32Array(3 * head.vertices);
  const corners = [];
  const begin = [0];
  let next = 0;
  let last = [0, 0, 0];
  for (const [degree, faces] of head.groups) {
    for (let f = 0; f < faces; ++f) {
      const first = corners.length;
      for (let k = 0; k < degree; ++k) {
        const code = get();
        let vertex = next - code;
        if (code === 0) {
          vertex = next++;
          const expected = degree === 4 && k === 3
            ? [0, 1, 2].map((i) => positions[3 * corners[first] + i] +
                positions[3 * corners[first + 2] + i] - positions[3 * corners[first + 1] + i])
            : last;
          for (let i = 0; i < 3; ++i) {
            const d = get();
            positions[3 * vertex + i] = expected[i] + (d & 1 ? -(d >> 1) - 1 : d >> 1);
          }
        }
        corners.push(vertex);
        last = [positions[3 * vertex], positions[3 * vertex + 1], positions[3 * vertex + 2]];
      }
      begin.push(corners.length);
    }
  }
  return { positions, corners, begin, normals };
}

/** Triangles for the graphics card: positions, normals, and which sides are edges of a face. */
function meshBuffers(mesh, quadsRule) {
  const { positions: p, corners, begin } = mesh;
  const faces = begin.length - 1;
  const area = new Float32Array(3 * faces);
  // Where a reduced mesh brings the normals of what it was, they are all of its relief.
  const given = mesh.normals !== null;
  const normal = mesh.normals || new Float32Array(p.length);
  const crossInto = (a, b, c, out) => {
    const ux = p[b] - p[a], uy = p[b + 1] - p[a + 1], uz = p[b + 2] - p[a + 2];
    const vx = p[c] - p[a], vy = p[c + 1] - p[a + 1], vz = p[c + 2] - p[a + 2];
    out[0] = uy * vz - uz * vy;
    out[1] = uz * vx - ux * vz;
    out[2] = ux * vy - uy * vx;
  };
  const cross = [0, 0, 0];
  let triangles = 0;
  for (let f = 0; f < faces; ++f) {
    for (let k = begin[f] + 1; k + 1 < begin[f + 1]; ++k) {
      crossInto(3 * corners[begin[f]], 3 * corners[k], 3 * corners[k + 1], cross);
      for (let i = 0; i < 3; ++i) area[3 * f + i] += cross[i];
      triangles += 1;
    }
    for (let k = begin[f]; k < begin[f + 1] && !given; ++k) {
      for (let i = 0; i < 3; ++i) normal[3 * corners[k] + i] += area[3 * f + i];
    }
  }
  const position = new Float32Array(9 * triangles);
  const normals = new Int8Array(12 * triangles);
  const edges = new Uint8Array(12 * triangles);
  let t = 0;
  for (let f = 0; f < faces; ++f) {
    const n = begin[f + 1] - begin[f];
    const a = [area[3 * f], area[3 * f + 1], area[3 * f + 2]];
    const size = Math.hypot(...a) || 1;
    for (let i = 0; i < 3; ++i) a[i] /= size;
    // Quads are cut where that folds them least.
    let apex = 0;
    if (n === 4) {
      const v = (k) => 3 * corners[begin[f] + k % 4];
      const worst = (k) => {
        crossInto(v(k), v(k + 1), v(k + 2), cross);
        const one = cross[0] * a[0] + cross[1] * a[1] + cross[2] * a[2];
        crossInto(v(k), v(k + 2), v(k + 3), cross);
        return Math.min(one, cross[0] * a[0] + cross[1] * a[1] + cross[2] * a[2]);
      };
      apex = worst(1) > worst(0) ? 1 : 0;
    }
    const tint = quadsRule && n !== 4 ? 255 : 0;
    for (let k = 0; k + 2 < n; ++k, ++t) {
      const place = [apex, (apex + k + 1) % n, (apex + k + 2) % n];
      // Side i lies opposite to corner i; 255 everywhere on a side that is none of the face.
      const drawn = [true, k + 3 === n, k === 0];
      for (let c = 0; c < 3; ++c) {
        const v = 3 * corners[begin[f] + place[c]];
        const length = Math.hypot(normal[v], normal[v + 1], normal[v + 2]) || 1;
        const agree = (normal[v] * a[0] + normal[v + 1] * a[1] + normal[v + 2] * a[2]) / length;
        const smooth = given ? 1 : Math.min(Math.max((agree - 0.7) / 0.2, 0), 1);
        for (let i = 0; i < 3; ++i) {
          position[9 * t + 3 * c + i] = p[v + i];
          normals[12 * t + 4 * c + i] =
            Math.round(127 * (smooth * normal[v + i] / length + (1 - smooth) * a[i]));
          edges[12 * t + 4 * c + i] = !drawn[i] || i === c ? 255 : 0;
        }
        edges[12 * t + 4 * c + 3] = tint;
      }
    }
  }
  return { position, normals, edges, vertices: 3 * triangles };
}

const pendingViews = new Map();
/** Called by view scripts. */
window.rattan_view = (head) => {
  const script = document.currentScript;
  const waiting = script && pendingViews.get(script.dataset.key);
  if (waiting) waiting(head);
};

/** The mesh of a view script. */
function loadView(address) {
  return new Promise((resolve, reject) => {
    const key = address + "#" + pendingViews.size + "." + performance.now();
    const script = el("script", { src: address, "data-key": key });
    const done = () => {
      pendingViews.delete(key);
      script.remove();
    };
    pendingViews.set(key, resolve);
    script.addEventListener("load", () => {
      done();
      reject(new Error("The file of this view holds none."));  // no effect if there was one
    });
    script.addEventListener("error", () => {
      done();
      reject(new Error("The file of this view cannot be read: " + decodeURIComponent(address)));
    });
    document.head.append(script);
  });
}

class View3d {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: true });
    if (!gl) throw new Error("This browser shows no WebGL 2, which 3D views need.");
    this.gl = gl;
    this.edges = true;
    this.count = 0;
    this.pointers = new Map();
    this.prepare();
    this.listen();
    new ResizeObserver(() => this.redraw()).observe(canvas);
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => {
      this.prepare();
      if (this.head) this.show(this.head);
    });
  }

  prepare() {
    const gl = this.gl;
    const program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, kVertexShader],
      [gl.FRAGMENT_SHADER, kFragmentShader]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    ["a_position", "a_normal", "a_edge"].forEach((name, k) => gl.bindAttribLocation(program, k, name));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
      throw new Error("The graphics driver refuses the 3D view.");
    }
    gl.useProgram(program);
    this.at = Object.fromEntries(["u_turn", "u_frame", "u_middle", "u_shift", "u_line", "u_edges"]
      .map((name) => [name, gl.getUniformLocation(program, name)]));
    this.buffers = [0, 1, 2].map(() => gl.createBuffer());
    gl.enable(gl.DEPTH_TEST);
  }

  show(head) {
    const gl = this.gl;
    const mesh = decodeMesh(head);
    const faces = mesh.begin.length - 1;
    const quads = head.groups.filter((g) => g[0] === 4).reduce((sum, g) => sum + g[1], 0);
    const b = meshBuffers(mesh, 2 * quads >= faces && faces === head.faces);
    [b.position, b.normals, b.edges].forEach((array, k) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[k]);
      gl.bufferData(gl.ARRAY_BUFFER, array, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(k);
      if (k === 0) gl.vertexAttribPointer(k, 3, gl.FLOAT, false, 12, 0);
      if (k === 1) gl.vertexAttribPointer(k, 3, gl.BYTE, true, 4, 0);
      if (k === 2) gl.vertexAttribPointer(k, 4, gl.UNSIGNED_BYTE, true, 4, 0);
    });
    this.count = b.vertices;
    this.shown = faces;
    if (this.edges !== (mesh.normals === null)) this.toggleEdges();  // a reduction's say little
    const p = mesh.positions;
    let square = 1;
    for (let i = 0; i < p.length; i += 3) {
      square = Math.max(square, p[i] * p[i] + p[i + 1] * p[i + 1] + p[i + 2] * p[i + 2]);
    }
    this.radius = Math.sqrt(square);
    this.head = head;
    this.points = p;
    this.reset();
  }

  reset() {
    this.turn = this.head.view.map((row) => [...row]);
    this.up = this.head.up;
    this.shift = [0, 0];
    this.zoom = 1;
    this.fit();
    this.redraw();
  }

  /** So that the picture is full, whatever the shape. */
  fit() {
    const [r, u, t] = this.turn;
    const far = 4 * this.radius;
    let wide = 1e-9, tall = 1e-9;
    const p = this.points;
    for (let i = 0; i < p.length; i += 3) {
      const away = far - (p[i] * t[0] + p[i + 1] * t[1] + p[i + 2] * t[2]);
      wide = Math.max(wide, Math.abs(p[i] * r[0] + p[i + 1] * r[1] + p[i + 2] * r[2]) / away);
      tall = Math.max(tall, Math.abs(p[i] * u[0] + p[i + 1] * u[1] + p[i + 2] * u[2]) / away);
    }
    this.slopes = [wide, tall];
  }

  orbit(dx, dy) {
    if (!this.head) return;
    const about = (axis, angle) => {
      const c = Math.cos(angle), s = Math.sin(angle);
      const [x, y, z] = axis;
      return (v) => {
        const d = (1 - c) * (x * v[0] + y * v[1] + z * v[2]);
        return [c * v[0] + s * (y * v[2] - z * v[1]) + d * x,
          c * v[1] + s * (z * v[0] - x * v[2]) + d * y,
          c * v[2] + s * (x * v[1] - y * v[0]) + d * z];
      };
    };
    let turned = this.turn.map(about(this.up, -dx));
    const tilted = turned.map(about(turned[0], -dy));
    const upright = (m) => m[1][0] * this.up[0] + m[1][1] * this.up[1] + m[1][2] * this.up[2];
    if (upright(tilted) > 0.03 || upright(tilted) > upright(turned)) turned = tilted;
    this.turn = turned;
    this.redraw();
  }

  magnify(factor) {
    const before = this.zoom;
    this.zoom = Math.min(Math.max(this.zoom * factor, 0.4), 60);
    this.shift = this.shift.map((s) => s * this.zoom / before);
    this.redraw();
  }

  /** In fractions of half the picture. */
  pan(dx, dy) {
    this.shift = [this.shift[0] + dx, this.shift[1] + dy];
    this.redraw();
  }

  listen() {
    const c = this.canvas;
    c.addEventListener("pointerdown", (event) => {
      c.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    });
    const gone = (event) => this.pointers.delete(event.pointerId);
    c.addEventListener("pointerup", gone);
    c.addEventListener("pointercancel", gone);
    c.addEventListener("pointermove", (event) => {
      const old = this.pointers.get(event.pointerId);
      if (!old) return;
      const now = [event.clientX, event.clientY];
      const dx = now[0] - old[0], dy = now[1] - old[1];
      const across = 2 / c.clientWidth, along = -2 / c.clientHeight;
      const others = [...this.pointers].filter(([id]) => id !== event.pointerId);
      this.pointers.set(event.pointerId, now);
      if (others.length > 0) {
        const other = others[0][1];
        const distance = (q) => Math.hypot(q[0] - other[0], q[1] - other[1]) || 1;
        this.magnify(distance(now) / distance(old));
        this.pan(dx * across / 2, dy * along / 2);
      } else if (event.shiftKey || event.buttons & 6) {
        this.pan(dx * across, dy * along);
      } else {
        this.orbit(dx * 0.009, dy * 0.009);
      }
    });
    c.addEventListener("contextmenu", (event) => event.preventDefault());
    c.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.magnify(Math.exp(-event.deltaY * (event.deltaMode === 1 ? 0.05 : 0.0015)));
    }, { passive: false });
    c.addEventListener("dblclick", () => this.reset());
    c.addEventListener("keydown", (event) => {
      const step = 0.12;
      const actions = {
        ArrowLeft: () => this.orbit(-step, 0), ArrowRight: () => this.orbit(step, 0),
        ArrowUp: () => this.orbit(0, -step), ArrowDown: () => this.orbit(0, step),
        "+": () => this.magnify(1.15), "=": () => this.magnify(1.15),
        "-": () => this.magnify(1 / 1.15), 0: () => this.reset(), e: () => this.toggleEdges() };
      const action = actions[event.key];
      if (action && !event.ctrlKey && !event.metaKey && !event.altKey) {
        event.preventDefault();
        action();
      }
    });
  }

  toggleEdges() {
    this.edges = !this.edges;
    this.canvas.dispatchEvent(new Event("edges"));
    this.redraw();
  }

  redraw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.draw();
    });
  }

  draw() {
    const { gl, canvas } = this;
    const density = Math.min(window.devicePixelRatio || 1, 2.5);
    const width = Math.round(canvas.clientWidth * density);
    const height = Math.round(canvas.clientHeight * density);
    if (!this.head || width === 0 || height === 0 || gl.isContextLost()) return;
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const scale = 0.92 * this.zoom *
      Math.min(width / this.slopes[0], height / this.slopes[1]);
    const [r, u, t] = this.turn;
    gl.uniformMatrix3fv(this.at.u_turn, false,
      [r[0], u[0], t[0], r[1], u[1], t[1], r[2], u[2], t[2]]);
    gl.uniform4f(this.at.u_frame, scale / width, scale / height, 4 * this.radius,
      1.05 * this.radius);
    gl.uniform3f(this.at.u_middle, 0, 0, 0);
    gl.uniform2f(this.at.u_shift, this.shift[0], this.shift[1]);
    gl.uniform1f(this.at.u_line, 0.48 * density);
    gl.uniform1f(this.at.u_edges, this.edges ? 1 : 0);
    gl.drawArrays(gl.TRIANGLES, 0, this.count);
    canvas.dataset.drawn = String(Number(canvas.dataset.drawn || 0) + 1);
  }
}
