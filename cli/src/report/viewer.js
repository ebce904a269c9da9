(() => {
'use strict';
const root = document.getElementById('viewer');
if (!root) return;
const page = document.documentElement;
const find = s => root.querySelector(s);
const meta = JSON.parse(document.getElementById('viewer-data').textContent);
const canvas = find('canvas');
const fail = text => {
  find('.nogl').textContent = text;
  find('.nogl').hidden = false;
  find('.controls').hidden = canvas.hidden = true;
  page.dataset.viewer = 'unavailable';
};
page.dataset.errors = '0';
window.addEventListener('error', () => { page.dataset.errors = String(+page.dataset.errors + 1); });

// ---- Data ----
const decode = text => {
  const s = atob(text), out = new Uint8Array(s.length);
  for (let i = 0; i < s.length; i++) out[i] = s.charCodeAt(i);
  return out;
};
const blob = id => decode(document.getElementById('b-' + id).textContent);
const indices = (id, size) => {
  const b = blob(id);
  return size === 2 ? new Uint16Array(b.buffer) : new Uint32Array(b.buffer);
};
// x, y, z and 1 (or 0 for a missing point) of each point.
const positions = (id, box, count) => {
  const w = new Uint16Array(blob(id).buffer), out = new Float32Array(4 * count);
  for (let i = 0; i < count; i++) {
    if (w[3 * i] === 65535) continue;
    for (let k = 0; k < 3; k++) out[4 * i + k] = box.min[k] + box.step[k] * w[3 * i + k];
    out[4 * i + 3] = 1;
  }
  return out;
};
// Area-weighted normals; the fourth number is left for a point field.
const normals = (p, tri) => {
  const n = new Float32Array(p.length);
  for (let t = 0; t < tri.length; t += 3) {
    const a = 4 * tri[t], b = 4 * tri[t + 1], c = 4 * tri[t + 2];
    if (p[a + 3] * p[b + 3] * p[c + 3] === 0) continue;
    const ux = p[b] - p[a], uy = p[b + 1] - p[a + 1], uz = p[b + 2] - p[a + 2];
    const vx = p[c] - p[a], vy = p[c + 1] - p[a + 1], vz = p[c + 2] - p[a + 2];
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    for (const i of [a, b, c]) { n[i] += x; n[i + 1] += y; n[i + 2] += z; }
  }
  for (let i = 0; i < n.length; i += 4) {
    const l = Math.hypot(n[i], n[i + 1], n[i + 2]) || 1;
    n[i] /= l; n[i + 1] /= l; n[i + 2] /= l;
  }
  return n;
};

// ---- Drawing ----
const VERTEX = `#version 300 es
precision highp float; precision highp int; precision highp sampler2D; precision highp usampler2D;
uniform usampler2D topology; uniform sampler2D points, normals, triangleValue;
uniform mat4 world, screen; uniform int paint;
out vec3 normal, eye, corner; flat out float level; out float value; flat out uint panel;
ivec2 at(int i) { return ivec2(i & 2047, i >> 11); }
void main() {
  int t = gl_VertexID / 3, c = gl_VertexID - 3 * t;
  uvec4 tri = texelFetch(topology, at(t), 0);
  int i = int(c == 0 ? tri.x : c == 1 ? tri.y : tri.z);
  vec4 p = texelFetch(points, at(i), 0), n = texelFetch(normals, at(i), 0);
  float known = texelFetch(points, at(int(tri.x)), 0).w * texelFetch(points, at(int(tri.y)), 0).w
    * texelFetch(points, at(int(tri.z)), 0).w;
  vec4 v = world * vec4(p.xyz, 1.0);
  eye = v.xyz; normal = mat3(world) * n.xyz;
  corner = vec3(c == 0, c == 1, c == 2);
  level = paint == 2 ? texelFetch(triangleValue, at(t), 0).r : 0.0;
  value = n.w; panel = tri.w;
  gl_Position = known > 0.5 ? screen * v : vec4(2.0, 2.0, 2.0, 1.0);
}`;
const FRAGMENT = `#version 300 es
precision highp float; precision highp int;
uniform int paint; uniform bool wire; uniform vec3 rightSide, wrongSide; uniform sampler2D ramp, palette;
in vec3 normal, eye, corner; flat in float level; in float value; flat in uint panel;
out vec4 colour;
vec3 linear(vec3 c) { return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c)); }
vec3 display(vec3 c) { c = clamp(c, 0.0, 1.0); return mix(c * 12.92, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c)); }
void main() {
  vec3 look = normalize(-eye), n = normalize(normal + 1e-12);
  if (!gl_FrontFacing) n = -n;
  float nv = max(dot(n, look), 0.0);
  vec3 albedo = gl_FrontFacing ? rightSide : wrongSide;
  float contrast = 1.0;
  if (paint == 1) albedo = linear(texelFetch(palette, ivec2(int(panel) % textureSize(palette, 0).x, 0), 0).rgb) * (gl_FrontFacing ? 1.0 : 0.55);
  if (paint >= 2) {
    float t = paint == 2 ? level : value;
    albedo = t < -0.02 || t > 1.002 ? vec3(0.30) : linear(texture(ramp, vec2((clamp(t, 0.0, 1.0) * 255.0 + 0.5) / 256.0, 0.5)).rgb);
    contrast = 0.62;
  }
  float key = max((dot(n, vec3(-0.4494, 0.6492, 0.6136)) + 0.12) / 1.12, 0.0);
  float fill = max(dot(n, vec3(0.8264, 0.1102, 0.5522)), 0.0);
  float sky = 0.5 + 0.5 * n.y;
  vec3 light = vec3(1.04, 0.97, 0.87) * key * 0.88 + vec3(0.13, 0.16, 0.22) * fill + mix(vec3(0.20, 0.18, 0.17), vec3(0.30, 0.33, 0.38), sky);
  vec3 c = albedo * (1.0 - contrast + contrast * light) + pow(1.0 - nv, 4.0) * (0.35 + 0.65 * sky) * 0.16 * contrast;
  if (wire) {
    vec3 slope = max(fwidth(corner), 1e-6), w = corner / slope;
    // Lines fade where triangles are only a few pixels high.
    float high = 1.0 / max(slope.x, max(slope.y, slope.z));
    float line = 1.0 - smoothstep(0.3, 1.15, min(w.x, min(w.y, w.z)));
    c = mix(c, c * 0.35, 0.85 * line * smoothstep(1.5, 9.0, high));
  }
  colour = vec4(display(c), 1.0);
}`;
const GRID_VERTEX = `#version 300 es
precision highp float; uniform mat4 world, screen; uniform vec4 ground; out vec2 where;
void main() {
  vec2 q = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  where = q;
  gl_Position = screen * world * vec4(ground.x + q.x * ground.w, ground.y, ground.z + q.y * ground.w, 1.0);
}`;
const GRID_FRAGMENT = `#version 300 es
precision highp float; uniform vec4 ground; uniform float spacing; uniform vec3 ink; in vec2 where; out vec4 colour;
void main() {
  vec2 m = (ground.xz + where * ground.w) / spacing;
  vec2 width = max(fwidth(m), 1e-5), near = abs(fract(m - 0.5) - 0.5) / width;
  float line = 1.0 - min(min(near.x, near.y), 1.0);
  line *= 1.0 - smoothstep(0.25, 0.9, max(width.x, width.y));
  colour = vec4(ink, 0.34 * line * (1.0 - smoothstep(0.35, 1.0, length(where))));
}`;

const WIDE = 2048;
let gl, cloth, bodies, programs, lost = false;
const state = { yaw: 32, pitch: 22, distance: 1, centre: [0, 0, 0], frame: 0, colour: 'fabric', playing: false };
let radius = 1, ground = [0, 0, 0, 1], spacing = 0.1;

const compile = (vertex, fragment) => {
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(program));
  const uniforms = {};
  return { program, at: name => uniforms[name] ??= gl.getUniformLocation(program, name) };
};
// A table of `count` entries in rows of WIDE texels.
const table = (count, internal, format, type, channels, Kind) => {
  const rows = Math.max(1, Math.ceil(count / WIDE)), texture = gl.createTexture();
  const staging = new Kind(rows * WIDE * channels);
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  gl.texStorage2D(gl.TEXTURE_2D, 1, internal, WIDE, rows);
  return { texture, set(data) {
    staging.set(data);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, WIDE, rows, format, type, staging);
  } };
};
const ramp = (bytes, width, filter) => {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, filter);
  for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB8, width, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, bytes);
  return texture;
};
const surface = (tri, panel, points, triangles) => {
  const s = { tri, triangles, count: points,
    topology: table(triangles, gl.RGBA32UI, gl.RGBA_INTEGER, gl.UNSIGNED_INT, 4, Uint32Array),
    points: table(points, gl.RGBA32F, gl.RGBA, gl.FLOAT, 4, Float32Array),
    normals: table(points, gl.RGBA32F, gl.RGBA, gl.FLOAT, 4, Float32Array),
    values: table(1, gl.R32F, gl.RED, gl.FLOAT, 1, Float32Array) };
  const packed = new Uint32Array(4 * triangles);
  for (let t = 0; t < triangles; t++) {
    packed.set([tri[3 * t], tri[3 * t + 1], tri[3 * t + 2], panel ? panel[t] || 0 : 0], 4 * t);
  }
  s.topology.set(packed);
  s.move = p => { s.position = p; s.normal = normals(p, tri); s.points.set(p); s.normals.set(s.normal); };
  return s;
};

// Tubes around yarns: a centripetal Catmull-Rom spline through the embedded
// points, rings across it in a frame that turns no more than its tangent.
const tubes = (offsets, radii, panels, { sides, samples }) => {
  const yarns = radii.length;
  let rings = 0, triangles = 0;
  for (let y = 0; y < yarns; y++) {
    const n = (offsets[y + 1] - offsets[y] - 1) * samples;
    rings += n + 1; triangles += 2 * sides * n + 2 * (sides - 2);
  }
  const tri = new Uint32Array(3 * triangles), segment = new Uint32Array(triangles), panel = new Uint16Array(triangles);
  let t = 0, base = 0;
  for (let y = 0; y < yarns; y++) {
    const n = (offsets[y + 1] - offsets[y] - 1) * samples, end = base + n * sides;
    const add = (a, b, c, ring) => {
      tri[3 * t] = a; tri[3 * t + 1] = b; tri[3 * t + 2] = c;
      panel[t] = panels[y]; segment[t++] = offsets[y] + Math.floor(ring / samples);
    };
    for (let k = 1; k < sides - 1; k++) { add(base, base + k + 1, base + k, 0); add(end, end + k, end + k + 1, n - 1); }
    for (let r = 0; r < n; r++) for (let k = 0; k < sides; k++) {
      const a = base + r * sides, b = a + sides, l = (k + 1) % sides;
      add(a + k, a + l, b + k, r); add(b + k, a + l, b + l, r);
    }
    base += (n + 1) * sides;
  }
  const turn = Array.from({ length: sides }, (_, k) => [Math.cos(2 * Math.PI * k / sides), Math.sin(2 * Math.PI * k / sides)]);
  const unit = v => { const l = Math.hypot(...v); return l > 1e-30 ? v.map(x => x / l) : null; };
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const side = v => unit(Math.abs(v[0]) < 0.7 ? [0, v[2], -v[1]] : [-v[2], 0, v[0]]);
  const build = p => {
    const points = new Float32Array(4 * rings * sides), normals = new Float32Array(4 * rings * sides);
    let at = 0;
    for (let y = 0; y < yarns; y++) {
      const first = offsets[y], count = offsets[y + 1] - first, R = radii[y];
      const x = i => { const o = 4 * (first + i); return [p[o], p[o + 1], p[o + 2]]; };
      const chord = i => { const a = x(i), b = x(i + 1); return [b[0] - a[0], b[1] - a[1], b[2] - a[2]]; };
      const slope = i => {
        const a = i > 0 ? chord(i - 1) : null, b = i < count - 1 ? chord(i) : null;
        const u = a ? Math.sqrt(Math.hypot(...a)) : 0, w = b ? Math.sqrt(Math.hypot(...b)) : 0;
        if (u > 0 && w > 0) return a.map((v, k) => v / u - (v + b[k]) / (u + w) + b[k] / w);
        return u > 0 ? a.map(v => v / u) : w > 0 ? b.map(v => v / w) : [0, 0, 0];
      };
      let tangent = [1, 0, 0], across = [0, 1, 0], known = false;
      const ring = (c, d, there) => {
        const now = unit(d);
        if (now && !known) { tangent = now; across = side(now); known = true; }
        else if (now) {
          const cos = dot(tangent, now), f = dot(across, now) / (1 + cos);
          let next = 1 + cos > 1e-6 ? across.map((v, k) => v - f * (tangent[k] + now[k])) : across;
          const off = dot(next, now);
          next = unit(next.map((v, k) => v - off * now[k]));
          tangent = now; across = next || side(now);
        }
        const other = [tangent[1] * across[2] - tangent[2] * across[1], tangent[2] * across[0] - tangent[0] * across[2], tangent[0] * across[1] - tangent[1] * across[0]];
        for (const [cos, sin] of turn) {
          for (let k = 0; k < 3; k++) { const n = cos * across[k] + sin * other[k]; normals[at + k] = n; points[at + k] = c[k] + R * n; }
          points[at + 3] = there; at += 4;
        }
      };
      let m = slope(0);
      for (let i = 0; i < count - 1; i++) {
        const a = x(i), c = chord(i), next = slope(i + 1), d = Math.sqrt(Math.hypot(...c));
        const there = Math.min(p[4 * (first + i) + 3], p[4 * (first + i + 1) + 3]);
        for (let j = 0; j < samples; j++) {
          const s = j / samples, h = s * s * (3 - 2 * s), g = s * (1 - s) * (1 - s) * d, e = s * s * (1 - s) * d;
          const hh = 6 * s * (1 - s), gg = (1 - s) * (1 - 3 * s) * d, ee = s * (3 * s - 2) * d;
          ring([0, 1, 2].map(k => a[k] + c[k] * h + m[k] * g - next[k] * e), j ? [0, 1, 2].map(k => c[k] * hh + m[k] * gg + next[k] * ee) : m, there);
        }
        m = next;
      }
      ring(x(count - 1), m, p[4 * (first + count - 1) + 3]);
    }
    return { points, normals };
  };
  return { tri, segment, panel, triangles, count: rings * sides, build };
};

const setup = () => {
  gl = canvas.getContext('webgl2', { antialias: true, alpha: true, premultipliedAlpha: true });
  if (!gl) return false;
  programs = { cloth: compile(VERTEX, FRAGMENT), grid: compile(GRID_VERTEX, GRID_FRAGMENT) };
  gl.bindVertexArray(gl.createVertexArray());
  if (meta.yarns) {
    const t = tubes(new Uint32Array(blob('yarn-offsets').buffer), new Float32Array(blob('yarn-radii').buffer), new Uint16Array(blob('yarn-panels').buffer), meta.yarns);
    cloth = surface(t.tri, t.panel, t.count, t.triangles);
    cloth.segment = t.segment;
    cloth.move = p => {
      const { points, normals } = t.build(p);
      cloth.position = points; cloth.normal = normals; cloth.points.set(points); cloth.normals.set(normals);
    };
  } else cloth = surface(indices('topology', meta.index), meta.panels > 1 ? new Uint16Array(blob('panel').buffer) : null, meta.points, meta.triangles);
  cloth.values = table(cloth.triangles, gl.R32F, gl.RED, gl.FLOAT, 1, Float32Array);
  bodies = meta.bodies.map((b, i) => surface(indices('body' + i, b.index), null, b.points, b.triangles));
  programs.sequential = ramp(decode(meta.sequential), 256, gl.LINEAR);
  programs.diverging = ramp(decode(meta.diverging), 256, gl.LINEAR);
  const palette = decode(meta.palette);
  programs.palette = ramp(palette, palette.length / 3, gl.NEAREST);
  gl.enable(gl.DEPTH_TEST);
  gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  return true;
};
const level = b => b === 255 ? -1 : b / 254;
const showFrame = k => {
  state.frame = k;
  cloth.move(positions('frame' + k, meta.frames[k], meta.points));
  meta.bodies.forEach((b, i) => {
    const f = b.frames.length > 1 ? k : 0;
    if (bodies[i].shown !== f) { bodies[i].move(positions('body' + i + '-' + f, b.frames[f], b.points)); bodies[i].shown = f; }
  });
  showField();
  find('.time').value = k;
  find('.time').setAttribute('aria-valuetext', meta.frames[k].time.toPrecision(4) + ' seconds');
  dirty();
};
const field = () => state.colour.startsWith('field') ? meta.fields[+state.colour.slice(5)] : null;
const number = v => (v === 0 ? '0' : Math.abs(v) >= 1e5 || Math.abs(v) < 1e-3 ? v.toExponential(2) : String(+v.toPrecision(3))).replaceAll('-', '−');
const showField = () => {
  const f = field();
  if (f) {
    const bytes = blob(state.colour + '-' + (f.frames > 1 ? state.frame : 0));
    if (cloth.segment) cloth.values.set(Float32Array.from(cloth.segment, s => level(bytes[s])));
    else if (f.triangles) cloth.values.set(Float32Array.from(bytes, level));
    else {
      for (let i = 0; i < bytes.length; i++) cloth.normal[4 * i + 3] = bytes[i] === 255 ? 1e6 : level(bytes[i]);
      cloth.normals.set(cloth.normal);
    }
  }
  const fixed = f && f.frames === 1 && meta.frames.length > 1 && state.frame !== meta.frames.length - 1;
  find('.readout').textContent = 't = ' + meta.frames[state.frame].time.toPrecision(4) + ' s · frame ' + (state.frame + 1) + ' of ' + meta.frames.length
    + (fixed ? ' · colours of the last frame' : '');
};
const showKey = () => {
  const f = field(), key = find('.key');
  key.hidden = !f;
  if (!f) return;
  const bytes = decode(f.diverging ? meta.diverging : meta.sequential), stops = [];
  for (let i = 0; i <= 16; i++) { const k = 3 * Math.round(i * 255 / 16); stops.push(`rgb(${bytes[k]},${bytes[k + 1]},${bytes[k + 2]})`); }
  key.querySelector('.ramp').style.background = `linear-gradient(to right,${stops.join()})`;
  key.querySelector('.keyname').textContent = f.name + (f.unit && f.unit !== '1' ? ' [' + f.unit + ']' : '');
  key.querySelector('.low').textContent = number(f.low);
  key.querySelector('.high').textContent = number(f.high);
};

// Column-major matrices.
const matrices = aspect => {
  const a = state.yaw * Math.PI / 180, e = state.pitch * Math.PI / 180;
  const sa = Math.sin(a), ca = Math.cos(a), se = Math.sin(e), ce = Math.cos(e);
  const r = [ca, 0, -sa], u = [-sa * se, ce, -ca * se], f = [sa * ce, se, ca * ce];
  const dot = v => v[0] * state.centre[0] + v[1] * state.centre[1] + v[2] * state.centre[2];
  const world = [r[0], u[0], f[0], 0, r[1], u[1], f[1], 0, r[2], u[2], f[2], 0, -dot(r), -dot(u), -dot(f) - state.distance, 1];
  const focal = 1 / Math.tan(FIELD / 2), near = Math.max(state.distance * 0.01, state.distance - 30 * radius), far = state.distance + 60 * radius;
  const screen = [focal / aspect, 0, 0, 0, 0, focal, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0];
  return { world, screen, right: r, up: u };
};
const FIELD = 28 * Math.PI / 180;
const draw = () => {
  const scale = Math.min(window.devicePixelRatio || 1, 2);
  const w = Math.max(1, Math.round(canvas.clientWidth * scale)), h = Math.max(1, Math.round(canvas.clientHeight * scale));
  if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
  gl.viewport(0, 0, w, h);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  const { world, screen } = matrices(w / h);
  const p = programs.cloth, f = field();
  gl.useProgram(p.program);
  gl.uniformMatrix4fv(p.at('world'), false, world);
  gl.uniformMatrix4fv(p.at('screen'), false, screen);
  const one = (s, paint, right, wrong, wire) => {
    [s.topology.texture, s.points.texture, s.normals.texture, s.values.texture,
      f && f.diverging ? programs.diverging : programs.sequential, programs.palette].forEach((texture, i) => {
      gl.activeTexture(gl.TEXTURE0 + i);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.uniform1i(p.at(['topology', 'points', 'normals', 'triangleValue', 'ramp', 'palette'][i]), i);
    });
    gl.activeTexture(gl.TEXTURE0);
    gl.uniform1i(p.at('paint'), paint);
    gl.uniform1i(p.at('wire'), wire);
    gl.uniform3fv(p.at('rightSide'), right);
    gl.uniform3fv(p.at('wrongSide'), wrong);
    gl.drawArrays(gl.TRIANGLES, 0, 3 * s.triangles);
  };
  one(cloth, state.colour === 'panels' ? 1 : f ? (f.triangles ? 2 : 3) : 0, meta.rightSide, meta.wrongSide, find('.wire').checked);
  if (find('.body').checked) for (const b of bodies) one(b, 0, meta.body, meta.body, false);
  if (find('.grid').checked) {
    const g = programs.grid;
    gl.useProgram(g.program);
    gl.uniformMatrix4fv(g.at('world'), false, world);
    gl.uniformMatrix4fv(g.at('screen'), false, screen);
    gl.uniform4fv(g.at('ground'), ground);
    gl.uniform1f(g.at('spacing'), spacing);
    gl.uniform3fv(g.at('ink'), matchMedia('(prefers-color-scheme: dark)').matches ? [0.85, 0.88, 0.92] : [0.15, 0.17, 0.22]);
    gl.enable(gl.BLEND); gl.depthMask(false);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.disable(gl.BLEND); gl.depthMask(true);
  }
  if (page.dataset.viewer !== 'drawn') {
    const error = gl.getError();
    page.dataset.viewer = error ? 'error ' + error : 'drawn';
  }
  if (location.hash === '#selfcheck') {
    const pixels = new Uint8Array(4 * w * h);
    let covered = 0;
    gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    for (let i = 3; i < pixels.length; i += 4) covered += pixels[i] === 255;
    page.dataset.covered = (covered / (w * h)).toFixed(4);
  }
};
let waiting = false;
const dirty = () => {
  if (waiting || lost) return;
  waiting = true;
  requestAnimationFrame(() => { waiting = false; if (!lost) draw(); });
};

// ---- Camera ----
const reset = () => {
  // A box that a few strays cannot inflate: 1 % to 99 % per axis, then the body near it.
  const p = cloth.position, low = [0, 0, 0], high = [0, 0, 0];
  let floor = Infinity;
  for (let k = 0; k < 3; k++) {
    const c = [];
    for (let i = k; i < p.length; i += 4) if (p[i - k + 3]) c.push(p[i]);
    c.sort((a, b) => a - b);
    low[k] = c[Math.round(0.005 * (c.length - 1))] || 0;
    high[k] = c[Math.round(0.995 * (c.length - 1))] || 0;
    if (k === 1 && c.length) floor = Math.max(c[0], 2 * low[1] - high[1]);
  }
  const size = Math.max(high[0] - low[0], high[1] - low[1], high[2] - low[2]) || 0.1;
  if (floor === Infinity) floor = 0;
  for (const b of bodies) {
    for (let k = 0; k < 3; k++) {
      let a = Infinity, z = -Infinity;
      for (let i = k; i < b.position.length; i += 4) if (b.position[i - k + 3]) { a = Math.min(a, b.position[i]); z = Math.max(z, b.position[i]); }
      if (a > z) continue;
      if (k === 1) floor = Math.min(floor, Math.max(a, low[1] - 2 * size));
      low[k] = Math.min(low[k], Math.max(a, low[k] - 0.3 * size));
      high[k] = Math.max(high[k], Math.min(z, high[k] + 0.3 * size));
    }
  }
  state.centre = low.map((v, k) => 0.5 * (v + high[k]));
  radius = 0.5 * Math.hypot(...low.map((v, k) => high[k] - v)) || 0.1;
  const narrow = Math.min(1, (canvas.clientWidth || 1) / (canvas.clientHeight || 1));
  state.distance = 0.94 * radius / Math.sin(FIELD / 2) / narrow;
  state.yaw = 32; state.pitch = 22;
  ground = [state.centre[0], floor, state.centre[2], 3.2 * radius];
  spacing = 10 ** Math.round(Math.log10(0.35 * radius));
  find('.gridlabel').textContent = 'grid ' + (spacing < 1 ? number(spacing * 100) + ' cm' : number(spacing) + ' m');
  dirty();
};
const orbit = (dx, dy) => {
  state.yaw -= dx; state.pitch = Math.max(-89.9, Math.min(89.9, state.pitch + dy));
  dirty();
};
const pan = (dx, dy) => {
  const { right, up } = matrices(1), s = 2 * state.distance * Math.tan(FIELD / 2) / (canvas.clientHeight || 1);
  state.centre = state.centre.map((c, k) => c - dx * s * right[k] + dy * s * up[k]);
  dirty();
};
const zoom = factor => {
  state.distance = Math.max(0.02 * radius, Math.min(40 * radius, state.distance * factor));
  dirty();
};

// ---- Hands ----
const touches = new Map();
canvas.addEventListener('pointerdown', e => {
  canvas.focus({ preventScroll: true });
  canvas.setPointerCapture(e.pointerId);
  touches.set(e.pointerId, [e.clientX, e.clientY]);
});
canvas.addEventListener('pointermove', e => {
  const before = touches.get(e.pointerId);
  if (!before) return;
  const now = [e.clientX, e.clientY], dx = now[0] - before[0], dy = now[1] - before[1];
  if (touches.size === 2) {
    const other = [...touches].find(([id]) => id !== e.pointerId)[1];
    const span = p => Math.hypot(p[0] - other[0], p[1] - other[1]) || 1;
    zoom(span(before) / span(now));
    pan(dx / 2, dy / 2);
  } else if (e.shiftKey || e.buttons & 6) pan(dx, dy);
  else orbit(0.4 * dx, 0.4 * dy);
  touches.set(e.pointerId, now);
});
for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, e => touches.delete(e.pointerId));
canvas.addEventListener('contextmenu', e => e.preventDefault());
canvas.addEventListener('wheel', e => {
  // The page scrolls until the view has been chosen.
  if (document.activeElement !== canvas && !e.ctrlKey) return;
  e.preventDefault();
  zoom(Math.exp(Math.max(-60, Math.min(60, e.deltaY)) * 0.004));
}, { passive: false });
canvas.addEventListener('keydown', e => {
  if (e.ctrlKey || e.altKey || e.metaKey) return;
  const act = { ArrowLeft: () => e.shiftKey ? pan(-20, 0) : orbit(-6, 0), ArrowRight: () => e.shiftKey ? pan(20, 0) : orbit(6, 0),
    ArrowUp: () => e.shiftKey ? pan(0, -20) : orbit(0, -6), ArrowDown: () => e.shiftKey ? pan(0, 20) : orbit(0, 6),
    '+': () => zoom(0.87), '=': () => zoom(0.87), '-': () => zoom(1.15), ' ': play,
    ',': () => step(-1), '.': () => step(1), r: reset, R: reset,
    1: () => look('0,0'), 2: () => look('90,0'), 3: () => look('180,0'), 4: () => look('0,89.9') }[e.key];
  if (act) { e.preventDefault(); act(); }
});
const look = text => { [state.yaw, state.pitch] = text.split(',').map(Number); dirty(); };
for (const b of root.querySelectorAll('[data-view]')) b.addEventListener('click', () => look(b.dataset.view));
find('.reset').addEventListener('click', reset);
for (const c of ['.wire', '.body', '.grid']) find(c).addEventListener('change', dirty);
find('.colour').addEventListener('change', e => { state.colour = e.target.value; showField(); showKey(); dirty(); });

// ---- Time ----
const last = meta.frames.length - 1;
const step = d => { stop(); showFrame(Math.max(0, Math.min(last, state.frame + d))); };
const stop = () => { state.playing = false; find('.play').textContent = '▶'; };
// Real time, unless that is shorter than 2 s or longer than 20 s.
const play = () => {
  if (state.playing) return stop();
  if (last === 0) return;
  state.playing = true;
  find('.play').textContent = '❚❚';
  if (state.frame === last) showFrame(0);
  const t0 = meta.frames[0].time, span = meta.frames[last].time - t0;
  const rate = span > 0 ? span / Math.max(2, Math.min(20, span)) : 1;
  let before = null, t = meta.frames[state.frame].time;
  const tick = now => {
    if (!state.playing || lost) return;
    if (before !== null) t += Math.min(0.25, (now - before) / 1000) * rate;
    before = now;
    let k = state.frame;
    if (span > 0) while (k < last && meta.frames[k + 1].time <= t) k++;
    else k = Math.min(last, k + 1);
    if (k !== state.frame) showFrame(k);
    if (k === last) stop();
    else requestAnimationFrame(tick);
  };
  requestAnimationFrame(tick);
};
find('.play').addEventListener('click', play);
find('.time').addEventListener('input', e => { stop(); showFrame(+e.target.value); });

// ---- Start ----
canvas.addEventListener('webglcontextlost', e => { e.preventDefault(); lost = true; stop(); });
canvas.addEventListener('webglcontextrestored', () => { lost = false; setup(); showFrame(state.frame); });
try {
  if (!setup()) { fail('This browser offers no WebGL 2, which the 3D view needs. The pictures above show the same state.'); return; }
  const colours = [['fabric', 'fabric']];
  if (meta.panels > 1) colours.push(['panels', 'panels']);
  meta.fields.forEach((f, i) => colours.push(['field' + i, f.name + (f.unit && f.unit !== '1' ? ' [' + f.unit + ']' : '')]));
  for (const [value, text] of colours) find('.colour').append(new Option(text, value));
  if (meta.panels > 1) find('.colour').value = state.colour = 'panels';
  find('.time').max = last;
  find('.bodies').hidden = bodies.length === 0;
  find('.play').disabled = find('.time').disabled = last === 0;
  find('.controls').hidden = false;
  showFrame(last);
  reset();
  new ResizeObserver(dirty).observe(canvas);
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', dirty);
} catch (error) {
  fail('The 3D view could not be started: ' + error.message + '. The pictures above show the same state.');
  page.dataset.errors = String(+page.dataset.errors + 1);
}
})();
