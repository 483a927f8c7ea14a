// Moving tone holes: drag one along the bore, or give its place and width. The instrument keeps its tuning, so that what a moved
// hole does is heard. Heard at once as the grid of the bore has it, and exactly when the fit is done.

import { clamp } from './names.js';

/** Steps that can be undone. */
const KEPT = 100;
/** Nothing has moved for so long: the fit begins, ms. */
const REST_MS = 350;
/** Time between two instruments while a hole is dragged: each costs the audio thread some 20 ms, ms. */
const EACH_MS = 200;
/** How much wider a hole becomes where the pointer goes up by a pixel with Shift held, m of the radius. */
const WIDER_M = 0.05e-3;
/** The pointer takes a hole that is so near, pixels. */
const NEAR = 26;
const HINT = matchMedia('(hover: none)').matches
  ? 'Drag a hole along the bore. Its width is the second number.'
  : 'Drag a hole along the bore. With Shift, up makes it wider.';
/** Least and largest radius, and the least distance between two holes, m. */
const [NARROWEST, WIDEST, APART] = [5e-4, 0.02, 1e-4];
const get = (id) => document.getElementById(id);
const bytes = (text) => new TextEncoder().encode(text);

export class Holes {
  /** `on` gets { isOpen }, and { opened: instrument } when a file has been opened. */
  constructor(engine, workshop, drawing, drag, say, on) {
    Object.assign(this, { engine, workshop, drawing, drag, say, on, moved: [], undo: [], chosen: null, held: null, version: 0 });
    this.canvas = get('clarinet');
    get('holes').onclick = () => this.show(!this.isOpen);
    get('hole-done').onclick = () => this.show(false);
    // The computer's keys are for playing again after a choice or a number.
    get('hole').onchange = () => {
      this.choose(Number(get('hole').value));
      get('hole').blur();
    };
    for (const id of ['hole-place', 'hole-width']) {
      get(id).onchange = () => this.read();
      get(id).onkeydown = ({ key, target }) => key === 'Enter' && target.blur();
    }
    get('hole-undo').onclick = () => this.undo.length > 0 && this.put(this.undo.pop());
    get('hole-back').onclick = () => this.change([]);
    get('hole-save').onclick = () => this.save();
    get('hole-open').onclick = () => get('hole-file').click();
    get('hole-file').onchange = () => this.open();
    this.canvas.addEventListener('pointerdown', (event) => this.isOpen && this.down(event));
    this.canvas.addEventListener('pointermove', (event) => this.held && this.move(event));
    for (const type of ['pointerup', 'pointercancel', 'lostpointercapture']) this.canvas.addEventListener(type, () => (this.held = null));
  }

  /** Another instrument: `built` is what the page knows of it, `base` what a question to the workshop names it by. */
  setInstrument(built, base) {
    Object.assign(this, { built, base, moved: [], undo: [], chosen: null, held: null, version: this.version + 1 });
    clearTimeout(this.fitting);
    this.workshop.long?.end();
    get('hole').replaceChildren(...built.holes.map(({ name, says }, at) => new Option(says || name.replaceAll('_', ' '), at)));
    this.state(HINT);
    this.choose(null);
  }

  /** What the sound depends on, for other questions. */
  question() {
    return { rate: this.engine.context.sampleRate, ...this.base, moved: this.moved };
  }

  get holes() {
    return this.built.holes.map((hole) => {
      const moved = this.moved.find(({ name }) => name === hole.name);
      return moved ? { ...hole, x: moved.x_m, r: moved.radius_m } : hole;
    });
  }

  show(isOpen) {
    this.isOpen = isOpen;
    this.drag.isOff = isOpen;
    get('holes').setAttribute('aria-pressed', isOpen);
    get('hole-panel').hidden = !isOpen;
    if (isOpen && this.chosen === null && this.built.holes.length > 0) {
      this.choose(Math.max(0, this.built.holes.findIndex(({ kind }) => kind === 'finger')));
    }
    this.draw();
    this.on({ isOpen });
  }

  choose(hole) {
    this.chosen = hole;
    if (hole !== null) get('hole').value = hole;
    this.draw();
  }

  /** `all` also writes the field that has the focus. */
  draw(all = false) {
    this.drawing.setHoles(this.holes, this.isOpen ? this.chosen : null);
    const hole = this.holes[this.chosen];
    if (hole && (all || document.activeElement !== get('hole-place'))) get('hole-place').value = (1e3 * hole.x).toFixed(1);
    if (hole && (all || document.activeElement !== get('hole-width'))) get('hole-width').value = (2e3 * hole.r).toFixed(1);
    const built = this.built?.holes[this.chosen];
    if (built) {
      get('hole-place').title = `As built: ${(1e3 * built.x).toFixed(1)} mm`;
      get('hole-width').title = `As built: ${(2e3 * built.r).toFixed(1)} mm`;
    }
    get('hole-undo').disabled = this.undo.length === 0;
    get('hole-back').disabled = get('hole-save').disabled = this.moved.length === 0;
  }

  down(event) {
    const box = this.canvas.getBoundingClientRect();
    const hole = this.drawing.holeAt(event.clientX - box.left, event.clientY - box.top, NEAR);
    if (hole === null) return;
    event.preventDefault();
    this.canvas.setPointerCapture(event.pointerId);
    this.remember();
    this.choose(hole);
    this.held = { x: event.clientX, y: event.clientY, hole: this.holes[hole] };
  }

  move(event) {
    const { x, y, hole } = this.held;
    const wide = event.shiftKey;
    this.set(hole.x + (wide ? 0 : (event.clientX - x) / this.drawing.scale), hole.r + (wide ? WIDER_M * (y - event.clientY) : 0));
  }

  read() {
    const [place, width] = ['hole-place', 'hole-width'].map((id) => Number(get(id).value));
    if (this.chosen === null) return;
    const said = this.outside('place', place, this.room()) ?? this.outside('width', width, [2 * NARROWEST, 2 * WIDEST]);
    if (said) {
      this.draw(true);
      this.state(said);
      return;
    }
    this.remember();
    // Full precision stays where the number was not touched.
    const { x, r } = this.holes[this.chosen];
    this.set(Math.abs(1e3 * x - place) < 0.051 ? x : place / 1e3, Math.abs(2e3 * r - width) < 0.051 ? r : width / 2e3);
  }

  /** Between which places the chosen hole can be, m. */
  room() {
    const { holes } = this;
    return [(holes[this.chosen - 1]?.x ?? 0) + APART, (holes[this.chosen + 1]?.x ?? this.built.length) - APART];
  }

  /** What to say where a number, mm, is not in a range, m. */
  outside(what, number, range) {
    const [least, most] = [Math.ceil(1e4 * range[0] - 1e-6) / 10, Math.floor(1e4 * range[1] + 1e-6) / 10];
    if (number >= least && number <= most) return undefined;
    return `The ${what} must lie between ${least.toFixed(1)} and ${most.toFixed(1)} mm.`;
  }

  remember() {
    this.undo.push(this.moved);
    if (this.undo.length > KEPT) this.undo.shift();
  }

  change(moved) {
    this.remember();
    this.put(moved);
  }

  /** The chosen hole at a place and with a radius, m, as far as there is room between its neighbours. */
  set(x, r) {
    const { name } = this.holes[this.chosen];
    const moved = { name, x_m: clamp(x, ...this.room()), radius_m: clamp(r, NARROWEST, WIDEST) };
    this.put([...this.moved.filter((other) => other.name !== name), moved]);
  }

  put(moved) {
    this.moved = moved;
    this.version += 1;
    this.draw();
    clearTimeout(this.fitting);
    if (moved.length === 0) {
      this.workshop.long?.end();
      this.state('As built');
      this.on({ built: true });
    } else {
      this.hearAtOnce();
      this.fitting = setTimeout(() => this.hearFitted(), REST_MS);
    }
    this.on({ moved });
  }

  /** One question at a time, and the latest wins. */
  async hearAtOnce() {
    if (this.isAsking) {
      this.isStale = true;
      return;
    }
    this.isAsking = true;
    try {
      const { version, base } = this;
      const told = await this.workshop.ask({ do: 'move', ...this.question() });
      // Heard though the hole has gone on, but not where it has been put back or the instrument is another.
      if (this.moved.length > 0 && base === this.base) this.take(told, false, version === this.version);
    } catch (error) {
      this.say(`The hole cannot be there: ${error.message}`);
    }
    await new Promise((later) => setTimeout(later, EACH_MS));
    this.isAsking = false;
    if (this.isStale) {
      this.isStale = false;
      this.hearAtOnce();
    }
  }

  async hearFitted() {
    const { version, base } = this;
    this.state('Fitting the bore …');
    try {
      const told = await this.workshop.askLong({ do: 'move', fit: true, ...this.question() });
      if (version === this.version && base === this.base) this.take(told, true, true);
    } catch (error) {
      this.say(`The bore could not be fitted: ${error.message}`);
    }
  }

  take({ file, prepared, holes }, isFitted, isLatest) {
    // The fit was quicker than the answer before it.
    if (!isFitted && isLatest && this.fittedVersion === this.version) return;
    if (isFitted) this.fittedVersion = this.version;
    this.file = file;
    this.engine.send({ prepared: { file: bytes(file), prepared: bytes(prepared) } });
    this.on({ heard: { isFitted, file, prepared } });
    if (!isLatest) return;
    // Where there is no room for it, it stands elsewhere than asked.
    this.moved = this.moved.map((moved) => {
      const { x, r } = holes.find(({ name }) => name === moved.name);
      return { ...moved, x_m: x, radius_m: r };
    });
    this.draw();
    this.state(isFitted ? 'Exact' : 'Right to some 10 cents; fitting the bore …');
  }

  /** What a worker has prepared does not fit the sound. */
  refuse() {
    this.state('The moved holes are not heard. Reload the page to try again.');
  }

  state(text) {
    get('hole-state').textContent = text;
  }

  save() {
    if (!this.file) return;
    const link = document.createElement('a');
    link.href = URL.createObjectURL(new Blob([this.file], { type: 'application/toml' }));
    link.download = `${this.built.id ?? 'instrument'}_holes_moved.toml`;
    link.click();
    URL.revokeObjectURL(link.href);
  }

  async open() {
    const [file] = get('hole-file').files;
    get('hole-file').value = '';
    if (!file) return;
    const text = await file.text();
    this.state('Preparing the instrument; one of your own takes minutes …');
    try {
      const told = await this.workshop.askApart({ do: 'open', rate: this.question().rate, text });
      this.state('');
      this.on({ opened: told });
    } catch (error) {
      this.state('');
      this.say(`${file.name} is not opened: ${error.message}`);
    }
  }
}
