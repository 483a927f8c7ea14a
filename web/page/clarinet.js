// The clarinet on its stage, drawn from the instrument file: true places and sizes along the bore. The body is drawn somewhat
// thicker than it is, and the outer shape is plausible: the file knows the bore and the depth of the holes, but not the wood.
// A short clarinet is drawn short; one that is longer than the usual ones is slender, and has neck and bell of metal. Finger holes
// are in front, with pads that stand open, and plates where no finger tip covers the hole; closed keys are on the upper edge. As the
// editor draws it.

import { clamp } from './names.js';

/** Thickness of the wood where no hole gives it, and at the rim of the bell, m; length of a mouthpiece's beak, m. */
const [WALL, RIM, BEAK] = [7e-3, 2.5e-3, 0.055];
/** The body is at least this thick over its length, and over the height of the stage; most that its thickness is exaggerated. */
const [LEAST_THICKNESS, LEAST_OF_HEIGHT, MOST_EXAGGERATED] = [0.056, 0.085, 2.2];
/** Length of the usual clarinets, which fill the stage, and from which length on neck and bell are of metal, m. */
const [USUAL, METAL] = [0.64, 0.9];
/** On a stage narrower than this, pixels, a short one fills it, too. */
const NARROW = 420;
/** The widest hole that a finger tip covers, m of the radius. */
const UNDER_FINGER = 6e-3;
/** Most that the size of a hole is exaggerated: holes are neighbours along the bore. */
const MOST_OF_HOLE = 1.7;
/** How far a finger lifts, and the time in which it does, s: about that of a slur. */
const [LIFT, FINGER_S] = [9, 0.03];
/** Level at which the picture's light begins, and where it is full, dBFS. */
const [DIM_DB, BRIGHT_DB] = [-50, -14];
/** Vibrations of the reed that the picture shows in a second, as a stroboscope would. */
const SLOWED_HZ = 1.5;
/** Light over a cylinder from its upper edge to its lower edge: 1 is the colour itself. */
const LIGHT = [[-1, 0.62], [-0.8, 0.98], [-0.5, 1.32], [-0.3, 1.16], [0, 0.96], [0.4, 0.76], [0.8, 0.56], [1, 0.46]];

/** Line of the caption, below the buttons, pixels. */
const CAPTION_Y = 62;
/** What the wave is, the room that the name of the note takes beside it, and the stage that is too narrow for it, pixels. */
const [CAPTION, NOTE_WIDTH, LEAST_CAPTIONED] = ['sound pressure in the bore', 90, 480];

const rgb = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));
const lit = (colour, light) => colour.map((x) => Math.round(light > 1 ? x + (255 - x) * Math.min(1, light - 1) : x * light));
const mix = (a, b, share) => a.map((x, n) => Math.round(x + share * (b[n] - x)));
const css = (colour, alpha = 1) => `rgb(${colour.join(' ')} / ${alpha})`;
/** Instrument files write `THUMB`. */
const isThumb = ({ name }) => name.toLowerCase() === 'thumb';

export class ClarinetDrawing {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext('2d');
    this.body = document.createElement('canvas');
    this.openings = [];
    this.wave = new Float32Array(64);
    this.loudness = 0;
    this.breath = 0;
    this.fingering = -1;
    this.chosen = null;
    this.touches = [];
    this.isDrawing = false;
    this.before = 0;
    new ResizeObserver(() => this.rebuild()).observe(canvas);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.rebuild());
  }

  setInstrument(file) {
    this.file = file;
    const wave = (text) => Float32Array.from({ length: 64 }, (_, n) => parseInt(text.slice(2 * n, 2 * n + 2), 16) / 255);
    this.waves = file.fingerings.map((fingering) => wave(fingering.wave));
    this.fingering = Math.min(this.fingering, file.fingerings.length - 1);
    this.openings = this.wanted();
    this.rebuild();
  }

  /** What sounds now: index of the fingering, level in dBFS, breath 0..1. */
  follow(fingering, level, breath) {
    const loudness = clamp((level - DIM_DB) / (BRIGHT_DB - DIM_DB), 0, 1);
    // At rest nothing is drawn again.
    if (fingering === this.fingering && loudness === this.loudness && breath === this.breath) return;
    Object.assign(this, { fingering, loudness, breath });
    this.wake();
  }

  /** Places that fingers of the user touch: pixels, and the name of the note there. */
  touch(touches) {
    this.touches = touches;
    this.wake();
  }

  /** The holes where they are now, and which one is chosen to be moved. */
  setHoles(holes, chosen) {
    if (!this.file) return;
    this.file = { ...this.file, holes };
    this.chosen = chosen;
    this.wake();
  }

  /** Where a hole is drawn, pixels. */
  place(hole) {
    if (hole.kind === 'key') return [this.x(hole.x), this.axis - this.outside(hole.x) - 4];
    return [this.x(hole.x), this.axis + (isThumb(hole) ? 0.8 * this.outside(hole.x) : 0)];
  }

  /** The hole nearest to a point, within so many pixels; null for none. */
  holeAt(x, y, near) {
    const far = this.file.holes.map((hole) => Math.hypot(...this.place(hole).map((at, n) => at - [x, y][n])));
    const nearest = far.indexOf(Math.min(...far));
    return far[nearest] <= near ? nearest : null;
  }

  wanted() {
    const open = this.file.fingerings[this.fingering]?.open;
    return this.file.holes.map((hole, n) => (open ? Number(open[n]) : hole.kind === 'key' ? 0 : 1));
  }

  wake() {
    if (!this.isDrawing && this.file) {
      this.isDrawing = true;
      requestAnimationFrame((time) => this.frame(time));
    }
  }

  frame(time) {
    const step = clamp((time - this.before) / 1000, 0, 0.1);
    this.before = time;
    const share = 1 - Math.exp(-step / FINGER_S);
    let moves = this.loudness > 0 || this.breath > 0;
    this.wanted().forEach((open, n) => {
      const left = open - this.openings[n];
      this.openings[n] += Math.abs(left) < 0.02 ? left : share * left;
      moves ||= left !== 0;
    });
    const wave = this.waves[this.fingering];
    if (wave) this.wave.forEach((x, n) => (this.wave[n] += 2 * share / (1 + share) * (wave[n] - x)));
    this.isDrawing = false;
    this.draw(time / 1000);
    if (moves) this.wake();
  }

  /** Sizes, colours, and everything that stands still. */
  rebuild() {
    const ratio = Math.min(2, devicePixelRatio || 1);
    [this.width, this.height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    if (!this.file || this.width < 10 || this.height < 10) return;
    for (const canvas of [this.canvas, this.body]) {
      canvas.width = Math.round(ratio * this.width);
      canvas.height = Math.round(ratio * this.height);
      canvas.getContext('2d').setTransform(ratio, 0, 0, ratio, 0, 0);
    }
    const style = getComputedStyle(document.documentElement);
    this.c = Object.fromEntries(
      ['wood', 'metal', 'ebony', 'cane', 'skin', 'breath', 'quiet', 'accent'].map((name) => [name, rgb(style.getPropertyValue(`--${name}`).trim())]),
    );
    const file = this.file;
    const depths = file.holes.map((hole) => hole.chimney).sort((a, b) => a - b);
    this.wall = clamp(depths[depths.length >> 1] ?? WALL, 4e-3, 9e-3);
    // An instrument file may have none.
    this.lastHole = Math.max(0, ...file.holes.map((hole) => hole.x));
    this.widest = Math.max(...file.bore.map(([, , , a, b]) => Math.max(a, b))) + RIM;
    const margin = clamp(0.03 * this.width, 14, 40);
    const share = this.width < NARROW ? 1 : Math.min(1, file.length / USUAL);
    this.scale = (share * (this.width - 2 * margin)) / file.length;
    this.left = (this.width - this.scale * file.length) / 2;
    const thin = (2 * (file.radius + this.wall)) / file.length;
    const least = Math.max(LEAST_THICKNESS, (LEAST_OF_HEIGHT * this.height) / this.width) * Math.cbrt(Math.min(1, USUAL / file.length));
    const exaggerated = clamp(least / thin, 1, MOST_EXAGGERATED);
    this.across = Math.min(this.scale * exaggerated, (0.25 * this.height) / this.widest);
    this.axis = 0.64 * this.height;
    this.middle = this.outside(0.5 * file.length);
    this.thickness = 2 * this.across * (file.radius + this.wall);
    this.mouthpiece = this.mouthpieceEnd();
    [this.neck, this.bell] = this.metal();
    this.drawBody(this.body.getContext('2d'));
    this.wake();
  }

  x(metres) {
    return this.left + this.scale * metres;
  }

  boreRadius(metres) {
    // At a joint the upper part counts, as in the core.
    const segment = this.file.bore.find(([, , to]) => metres <= to) ?? this.file.bore.at(-1);
    const [, from, to, a, b] = segment;
    return a + (b - a) * clamp((metres - from) / Math.max(1e-9, to - from), 0, 1);
  }

  /** Radius of the outside, pixels. */
  outside(metres) {
    const beak = clamp(metres / BEAK, 0.12, 1);
    const way = clamp((metres - this.lastHole) / Math.max(1e-6, this.file.length - this.lastHole), 0, 1);
    const wall = this.wall + (RIM - this.wall) * Math.sqrt(way);
    return this.across * beak * (this.boreRadius(Math.min(metres, this.file.length - 1e-9)) + wall);
  }

  mouthpieceEnd() {
    const first = this.file.bore[0][0];
    const own = this.file.bore.findIndex(([part]) => part !== first);
    return Math.min(0.18, this.file.bore[Math.max(0, own - 1)][2]);
  }

  /** Where the neck of metal ends and the bell of metal begins, m. The neck is the part below the mouthpiece, unless it has holes. */
  metal() {
    const { bore, holes, length } = this.file;
    if (length < METAL) return [this.mouthpiece, length];
    const isFree = (from, to) => holes.every((hole) => hole.x < from || hole.x >= to);
    const neck = bore.findLast(([part]) => part === bore.find(([, , to]) => to > this.mouthpiece + 1e-6)?.[0])?.[2] ?? this.mouthpiece;
    const bell = bore.find(([part]) => part === bore.at(-1)[0])[1];
    return [isFree(this.mouthpiece, neck) ? neck : this.mouthpiece, isFree(bell, length) ? bell : length];
  }

  /** A stretch of a round body, lit from above. */
  turned(g, x, width, axis, radius, colour) {
    const light = g.createLinearGradient(0, axis - radius, 0, axis + radius);
    LIGHT.forEach(([height, share]) => light.addColorStop((height + 1) / 2, css(lit(colour, share))));
    g.fillStyle = light;
    g.fillRect(x, axis - radius, width, 2 * radius);
  }

  band(g, x, half, radius, axis = this.axis) {
    this.turned(g, x - half, 2 * half, axis, radius, this.c.metal);
  }

  drawBody(g) {
    const { file, c, axis } = this;
    g.clearRect(0, 0, this.width, this.height);
    const end = this.x(file.length);
    // The shadow on the floor.
    g.save();
    g.translate((this.left + end) / 2, Math.min(this.height - 14, axis + 1.9 * this.thickness + 10));
    g.scale(1, 0.07);
    const half = 0.53 * (end - this.left);
    const shadow = g.createRadialGradient(0, 0, 0, 0, 0, half);
    shadow.addColorStop(0, 'rgb(0 0 0 / .2)');
    shadow.addColorStop(1, 'rgb(0 0 0 / 0)');
    g.fillStyle = shadow;
    g.fillRect(-half, -half, 2 * half, 2 * half);
    g.restore();
    // The body, column by column.
    const ebonite = mix(c.ebony, c.wood, 0.35);
    const colour = (metres) => (metres < this.mouthpiece ? ebonite : metres < this.neck || metres > this.bell ? c.metal : c.wood);
    for (let x = this.left; x < end; x += 1) {
      const metres = (x - this.left) / this.scale;
      this.turned(g, x, Math.min(1.5, end - x), axis, this.outside(metres), colour(metres));
    }
    // The bell's opening.
    const out = this.across * this.widest;
    this.ellipse(g, end, axis, 0.17 * out, out, css(c.metal));
    this.ellipse(g, end + 0.5, axis, 0.13 * out, 0.94 * out, css(lit(c.ebony, 0.7)));
    this.ring(g, end, axis, 0.17 * out, out, css(lit(c.metal, 1.4)));
    // Rings at the joints, and the ligature.
    file.bore.forEach(([part, , to], n) => {
      const next = file.bore[n + 1];
      if (next && next[0] !== part) this.band(g, this.x(to), 3.5, this.outside(to) + 3);
    });
    for (const share of [0.52, 0.64, 0.76]) {
      const place = share * this.mouthpiece;
      this.band(g, this.x(place), clamp(0.004 * this.scale, 1.5, 3), this.outside(place) + 2.5);
    }
    this.rods(g);
  }

  /** The rods that carry the keys: one along each part that has some. */
  rods(g) {
    for (const part of new Set(this.file.bore.map(([name]) => name))) {
      const own = this.file.bore.filter(([name]) => name === part);
      const [from, to] = [own[0][1], own.at(-1)[2]];
      const places = this.file.holes.filter((hole) => hole.kind === 'key' && hole.x >= from && hole.x < to).map((hole) => hole.x);
      if (places.length < 2) continue;
      const [first, last] = [Math.min(...places), Math.max(...places)];
      const y = this.axis - this.outside((first + last) / 2) - 5;
      this.turned(g, this.x(first) - 8, this.x(last) - this.x(first) + 16, y, 2, this.c.metal);
      for (const x of [this.x(first) - 8, this.x(last) + 8]) this.band(g, x, 2.5, 4, y + 1);
    }
  }

  ellipse(g, x, y, rx, ry, fill) {
    g.beginPath();
    g.ellipse(x, y, Math.max(0, rx), Math.max(0, ry), 0, 0, 2 * Math.PI);
    g.fillStyle = fill;
    g.fill();
  }

  ring(g, x, y, rx, ry, stroke, width = 1) {
    g.beginPath();
    g.ellipse(x, y, rx, ry, 0, 0, 2 * Math.PI);
    g.strokeStyle = stroke;
    g.lineWidth = width;
    g.stroke();
  }

  glow(g, x, y, radius, colour, alpha) {
    const light = g.createRadialGradient(x, y, 0, x, y, radius);
    light.addColorStop(0, css(colour, alpha));
    light.addColorStop(1, css(colour, 0));
    g.fillStyle = light;
    g.fillRect(x - radius, y - radius, 2 * radius, 2 * radius);
  }

  draw(seconds) {
    const g = this.context;
    g.clearRect(0, 0, this.width, this.height);
    this.drawWave(g);
    g.drawImage(this.body, 0, 0, this.width, this.height);
    this.drawReed(g, seconds);
    const flows = this.flows();
    // Pads before fingers: a finger lies on its ring.
    const order = this.file.holes.map((_, n) => n).sort((a, b) => Number(this.file.holes[a].kind === 'finger') - Number(this.file.holes[b].kind === 'finger'));
    for (const n of order) this.drawHole(g, this.file.holes[n], this.openings[n], this.loudness * flows[n]);
    const chosen = this.file.holes[this.chosen];
    if (chosen) this.drawChosen(g, chosen);
    this.drawTouches(g);
  }

  drawChosen(g, hole) {
    const [x, y] = this.place(hole);
    this.ring(g, x, y, 17, 17, css(this.c.accent), 2.5);
    g.beginPath();
    for (const side of [-1, 1]) {
      g.moveTo(x + 21 * side, y - 5);
      g.lineTo(x + 27 * side, y);
      g.lineTo(x + 21 * side, y + 5);
    }
    g.strokeStyle = css(this.c.accent);
    g.lineWidth = 2.5;
    g.stroke();
  }

  /** Flow through each open hole over the largest: the pressure drives the hole's air, whose mass over its area goes as one over the radius. */
  flows() {
    const flows = this.file.holes.map((hole, n) => {
      const at = Math.round((63 * hole.x) / this.file.length);
      return this.openings[n] * hole.r * this.wave[clamp(at, 0, 63)];
    });
    const most = Math.max(1e-9, ...flows);
    return flows.map((flow) => flow / most);
  }

  /** The sound pressure over the body, higher and lighter when it is loud. */
  drawWave(g) {
    // Straight, so that only pressure bends the line: above the keys and above the bell.
    const foot = this.axis - Math.max(this.middle + 22, this.across * this.widest + 4);
    const room = foot - 16;
    if (room < 20 || this.loudness <= 0) return;
    const height = room * (0.25 + 0.7 * this.loudness);
    const x = (n) => this.x((this.file.length * n) / 63);
    const line = new Path2D();
    this.wave.forEach((share, n) => line[n ? 'lineTo' : 'moveTo'](x(n), foot - share * height));
    const area = new Path2D(line);
    area.lineTo(x(63), foot);
    area.lineTo(x(0), foot);
    const light = g.createLinearGradient(0, foot - height, 0, foot);
    light.addColorStop(0, css(this.c.breath, 0.42 * this.loudness));
    light.addColorStop(1, css(this.c.breath, 0.03));
    g.fillStyle = light;
    g.fill(area);
    g.strokeStyle = css(this.c.breath, 0.35 + 0.65 * this.loudness);
    g.lineWidth = 2;
    g.lineJoin = 'round';
    g.stroke(line);
    g.font = '12px system-ui, sans-serif';
    // Not under the name of the note, and below the buttons.
    if (room > CAPTION_Y + 56 && this.width > LEAST_CAPTIONED && this.left + 2 + g.measureText(CAPTION).width < this.width - NOTE_WIDTH) {
      g.fillStyle = css(this.c.breath);
      g.fillText(CAPTION, this.left + 2, CAPTION_Y);
    }
  }

  /** The reed on the lower side of the mouthpiece; its tip moves. */
  drawReed(g, seconds) {
    const swing = this.loudness > 0 ? 0.5 + 0.5 * Math.cos(2 * Math.PI * SLOWED_HZ * seconds) : 1;
    const opening = 1 - this.loudness * (1 - swing);
    const end = 0.78 * this.mouthpiece;
    const lower = (metres) => this.axis + this.outside(metres) + 1.5;
    const tip = [this.x(0) - 1, this.axis + this.outside(0) + 1 + 3.5 * opening];
    const [middle, heel] = [0.4 * end, end].map((metres) => [this.x(metres), lower(metres)]);
    const light = g.createLinearGradient(0, tip[1], 0, heel[1] + 0.16 * this.thickness);
    light.addColorStop(0, css(lit(this.c.cane, 1.1)));
    light.addColorStop(1, css(lit(this.c.cane, 0.78)));
    g.fillStyle = light;
    g.beginPath();
    g.moveTo(...tip);
    g.lineTo(...middle);
    g.lineTo(...heel);
    g.lineTo(heel[0], heel[1] + 0.16 * this.thickness);
    g.lineTo(middle[0], middle[1] + 0.1 * this.thickness);
    g.lineTo(tip[0], tip[1] + 1.5);
    g.fill();
    if (this.breath > 0.01) this.glow(g, this.x(0), this.axis + 2, 10 + 12 * this.breath, this.c.breath, 0.8 * Math.min(1, 0.25 + this.breath));
  }

  drawHole(g, hole, opening, flow) {
    const { c } = this;
    const half = clamp(Math.min(this.across, MOST_OF_HOLE * this.scale) * hole.r, 2.5, 0.42 * this.thickness);
    const air = mix(lit(c.ebony, 0.6), c.breath, 0.85 * flow);
    const x = this.x(hole.x);
    const edge = css(lit(c.metal, 0.6));
    if (hole.kind === 'key') {
      const [, y] = this.place(hole);
      if (flow > 0.02) this.glow(g, x, y + 4, half + 14 * flow, c.breath, 0.6 * flow);
      if (opening > 0.05) this.ellipse(g, x, y + 4, half, 2, css(air));
      this.plate(g, x, y - 0.7 * LIFT * opening, half + 3, 4.5, c.metal, edge);
      return;
    }
    // The thumb is behind: its hole looks round the lower edge.
    const [, y] = this.place(hole);
    if (flow > 0.02) this.glow(g, x, y, half + 14 * flow, c.breath, 0.6 * flow);
    if (hole.kind === 'pad') {
      this.ellipse(g, x, y, half + 1, half + 1, css(air));
      this.ring(g, x, y, half + 1, half + 1, css(lit(c.metal, 0.8)), 1.5);
      this.plate(g, x, y - LIFT * opening, half + 3, (half + 3) * (1 - 0.45 * opening), c.metal, edge);
      return;
    }
    this.ellipse(g, x, y, half + 3, half + 3, css(lit(c.metal, 0.85)));
    this.ellipse(g, x, y, half, half, css(air));
    this.ring(g, x, y, half, half, edge);
    const hasPlate = hole.r > UNDER_FINGER;
    if (hasPlate) this.plate(g, x, y - LIFT * opening, half + 2, (half + 2) * (1 - 0.45 * opening), c.metal, edge);
    if (opening < 0.99) this.finger(g, x, y - LIFT * opening, hasPlate ? 0.7 * half : half, 1 - 0.8 * opening);
  }

  /** A round plate seen from above, with a light towards its upper left. */
  plate(g, x, y, rx, ry, colour, edge) {
    this.ellipse(g, x, y, rx, ry, css(lit(colour, 0.72)));
    this.ellipse(g, x - 0.1 * rx, y - 0.1 * ry, 0.8 * rx, 0.8 * ry, css(colour));
    this.ellipse(g, x - 0.26 * rx, y - 0.26 * ry, 0.42 * rx, 0.42 * ry, css(lit(colour, 1.28)));
    this.ring(g, x, y, rx, ry, edge);
  }

  finger(g, x, y, half, presence) {
    const [rx, ry] = [half + 5, half + 3];
    const skin = (light) => css(lit(this.c.skin, light), presence);
    this.ellipse(g, x, y + 2, rx, ry, `rgb(0 0 0 / ${0.28 * presence})`);
    this.ellipse(g, x, y, rx, ry, skin(0.86));
    this.ellipse(g, x, y - 1, 0.82 * rx, 0.82 * ry, skin(1));
    this.ellipse(g, x, y - 0.28 * ry, 0.55 * rx, 0.42 * ry, skin(1.16));
  }

  drawTouches(g) {
    for (const { x, y, name } of this.touches) {
      g.strokeStyle = css(this.c.accent, 0.7);
      g.lineWidth = 1.5;
      g.setLineDash([3, 5]);
      g.beginPath();
      g.moveTo(x, 0);
      g.lineTo(x, this.height);
      g.stroke();
      g.setLineDash([]);
      this.glow(g, x, y, 34, this.c.accent, 0.45);
      g.fillStyle = css(this.c.accent);
      g.font = '600 15px system-ui, sans-serif';
      g.textAlign = x > this.width - 60 ? 'right' : 'left';
      g.fillText(name, x + (x > this.width - 60 ? -12 : 12), clamp(y - 30, 20, this.height - 10));
      g.textAlign = 'left';
    }
  }
}
