// The page: brings sound, hands and pictures together.

import { ClarinetDrawing } from './clarinet.js';
import { Control } from './controls.js';
import { Drag } from './drag.js';
import { Engine } from './engine.js';
import { Hands } from './hands.js';
import { Hint } from './hint.js';
import { Holes } from './holes.js';
import { Keyboard } from './keyboard.js';
import { Knob } from './knob.js';
import { KnobPanel } from './knob-panel.js';
import { Meter } from './meter.js';
import { Midi } from './midi.js';
import { Kept } from './kept.js';
import { json, noteName } from './names.js';
import { leaveAfterPointer } from './pointers.js';
import { Presets } from './presets.js';
import { Typing } from './typing.js';
import { Update } from './update.js';
import { Workshop } from './workshop.js';

/** Below this level nothing is heard, dBFS. */
const SILENT_DB = -66;
/** Range of the output's level, dBFS to full scale. */
const LEVEL_DB = 48;
/** Time of silence after which the sound is switched off until the next gesture, s: a page at rest costs nothing. */
const REST_S = 120;
/** Time in which a browser that allows it has switched the sound on, ms. */
const WAKE_MS = 700;
const KNOB = 'the knob';
/** Controllers of MIDI that blow. */
const BLOWING = ['CC2', 'CC11', 'channel pressure', 'the note'];
const LOADING = 'Loading …';
/** Without a mouse, a browser switches the sound on when the first finger is lifted. */
const HAS_MOUSE = !matchMedia('(hover: none)').matches;
const IDLE = `Press a key, or drag across the clarinet.${HAS_MOUSE ? '' : ' Slide up to play louder.'} To blow, press Blow.`;
const CHOOSE = 'Choose a note: press a key, or drag across the clarinet.';

/** Least time between two notes that a screen reader is told, ms. */
const ANNOUNCED_MS = 500;

const get = (id) => document.getElementById(id);
const hint = new Hint(get('hint'), usual, () => (room?.calibrating ? 'Measuring the room for two seconds. Please be quiet …' : ''));
let values = [];
/** The sound is there; it should be on and is not. */
let [isPrepared, isLate, waking, isTouching] = [false, false, 0, false];
/** What the microphone hears, and where the breath comes from, by the latest picture; whether anything has been played. */
let [room, origin, hasPlayed] = [null, '', false];
const data = await json('data.json').catch((error) => {
  fail(error);
  throw error;
});
const drawing = new ClarinetDrawing(get('clarinet'));
const meter = new Meter(data.dynamics, data.struck);
const engine = new Engine(hear);
const hands = new Hands((message) => engine.send(message));
const keyboard = new Keyboard(get('keyboard'), hands, (breath) => breathe(breath, 'piano'), ([below, above]) => {
  [get('lower').disabled, get('higher').disabled] = [!below, !above];
});
const drag = new Drag(get('clarinet'), hands, (breath) => breathe(breath, 'clarinet'), (touches) => {
  drawing.touch(touches.map(({ x, y, note }) => ({ x, y, name: noteName(note + instrument.transposition) })));
});
const typing = new Typing(hands, (breath) => breathe(breath, 'letters'), (said) => {
  if (said.letters) keyboard.setLetters(said.letters);
  if (said.help) tellKeys(said.help);
  if (said.outside !== undefined) {
    const end = said.outside < typing.first ? ['begins', typing.first] : ['ends', typing.last];
    say(`${instrument.name} ${end[0]} at ${noteName(end[1] + instrument.transposition)}, written.`);
  }
  if (said.base) keyboard.show(said.base);
  if (said.breath !== undefined) meter.mark(said.breath);
  if (said.start) {
    begin();
    takeBreath();
  }
  if (said.silence) {
    breaths.clear();
    hands.silence();
    knob.stop();
  }
}, () => meter.isPhysical ? [0, 1] : data.struck.dynamic);
const controls = data.controls.map((of) => new Control(of, (place, value) => {
  values[place] = value;
  engine.send({ set: [place, value] });
  knob.update();
  change();
}));
get('controls').append(...controls.map((control) => control.element));
const presets = new Presets(data.presets, choose);
const workshop = new Workshop();
const holes = new Holes(engine, workshop, drawing, drag, data.holes, say, follow);
const knob = new KnobPanel(engine, workshop, () => ({ ...holes.question(), values }), say, (plays) => {
  hands.blow(plays || blowing, instrument.transposition);
});
values = [...data.defaults];
let instrument = data.instruments[0];
/** The breath of each part of the page that blows, the latest last, where no device and no key does. */
const breaths = new Map();
let [blowing, isOpening] = [false, false];
let isRestoring = false;

data.instruments.forEach(({ name }, at) => get('instrument').append(new Option(name, at)));
get('instrument').onchange = (event) => {
  setInstrument(Number(event.target.value));
  change();
  leaveAfterPointer(event.target);
};
setInstrument(0);
get('about').onclick = () => {
  letGo();
  get('help').showModal();
};
get('help').onclick = ({ target }) => target === get('help') && get('help').close();
get('help-controls').append(...controls.flatMap((control) => control.explained()));
get('lower').onclick = () => keyboard.shift(-1);
get('higher').onclick = () => keyboard.shift(1);
get('volume').oninput = (event) => {
  engine.setVolume(event.target.value / 100);
  // Alone: another tab may have kept another preset meanwhile.
  Kept.keepVolume(Number(event.target.value));
};
get('volume').onchange = (event) => leaveAfterPointer(event.target);
restore();
engine.setVolume(get('volume').value / 100);
hint.tell();

for (const type of ['pointerdown', 'pointerup', 'keydown']) addEventListener(type, begin, { capture: true });
addEventListener('pointerdown', ({ pointerType }) => (isTouching = pointerType === 'touch'), { capture: true });
for (const type of ['pointerup', 'pointercancel']) addEventListener(type, () => (isTouching = false), { capture: true });
// What comes up elsewhere is not told.
addEventListener('blur', letGo);
addEventListener('pagehide', hide);
document.addEventListener('visibilitychange', () => document.hidden && hide());

function letGo() {
  [typing, drag, keyboard].forEach((part) => part.end());
  holes.held = null;
}

/** Which letters play, as this keyboard has them. */
function tellKeys({ first, last, down, up }) {
  [['key-first', first], ['key-last', last], ['key-down', down], ['key-up', up]].forEach(([id, letter]) => (get(id).textContent = letter));
  get('keyboard').setAttribute('aria-label', `Clarinet. The keys from ${first} to ${last} play, ${down} and ${up} change the octave, the arrows up and down the breath; Escape is silence.`);
}

/** A page that nobody sees holds no key. */
function hide() {
  letGo();
  if (!blowing) hands.releaseAll();
}

/** A control, the instrument or a hole has changed: it may no longer be the preset's, or be so again. */
function change() {
  tellPreset();
  keep();
}

/** Whether the page is the preset's. */
function tellPreset() {
  if (isOther()) presets.change();
  else presets.show();
}

/** Whether the page has something else than the preset. */
function isOther() {
  const preset = presets.all[presets.at];
  // A hand does not find the last digit again.
  const isSame = ({ place, min, max, default: usual }) => Math.abs(values[place] - (preset.values[place] ?? usual)) < 1e-3 * (max - min);
  return instrument !== data.instruments[preset.instrument] || holes.moved.length > 0 || !data.controls.every(isSame);
}

/** Keeps what the next visit shall find. */
function keep() {
  if (isRestoring) return;
  Kept.write({
    preset: presets.all[presets.at].name,
    // What a preset says is its own: another version may say something else.
    ...(isOther() && {
      instrument: instrument.own ? undefined : instrument.id,
      controls: Object.fromEntries(data.controls.map(({ id, place }) => [id, values[place]])),
      moved: instrument.own ? [] : holes.moved,
    }),
    volume: Number(get('volume').value),
  });
}

function restore() {
  const kept = Kept.read(data);
  isRestoring = true;
  if (kept.volume !== undefined) get('volume').value = kept.volume;
  if (kept.preset !== undefined) presets.go(kept.preset);
  if (kept.instrument !== undefined) setInstrument(kept.instrument);
  kept.controls.forEach(([control, value]) => {
    values[control.place] = value;
    engine.send({ set: [control.place, value] });
    controls[data.controls.indexOf(control)].show(value);
  });
  if (kept.moved.length > 0) holes.put(kept.moved);
  isRestoring = false;
  tellPreset();
}

function begin() {
  lastHeard = performance.now();
  // Whether it helps is told in a while.
  isLate = false;
  engine.start().catch(fail);
  watch();
}

/** Says so where the sound should be on and the browser does not switch it on. */
function watch() {
  clearTimeout(waking);
  const isOff = () => engine.wanted && !engine.isRunning;
  if (isOff()) {
    waking = setTimeout(() => {
      isLate = isOff();
      hint.tell();
    }, WAKE_MS);
  } else isLate = false;
  hint.tell();
}

function fail(error) {
  hint.fail(error);
}

function say(text) {
  hint.say(text);
}

/** What the player can do. */
function usual() {
  if (!isPrepared) return LOADING;
  if (isLate) {
    if (isTouching) return 'Lift your finger: then the sound is on.';
    return navigator.userActivation?.hasBeenActive === false
      ? `${HAS_MOUSE ? 'Click' : 'Tap'} once to switch the sound on.`
      : `The browser does not switch the sound on. ${HAS_MOUSE ? 'Click' : 'Tap'} once; if that does not help, is there a loudspeaker?`;
  }
  if ((room || knob.plays) && !hands.hasNote) return CHOOSE;
  if (room) return 'Blow at the microphone as if to cool a spoon, with headphones on. A key or a drag chooses the note.';
  if (knob.plays) return 'Turn the knob to blow. A key or a drag chooses the note.';
  return hasPlayed || holes.isOpen ? '' : IDLE;
}

/** Breath of hands on the screen or of arrow keys; null when they let go: then another part that still blows does. The microphone's
 * breath stays what it is. */
function breathe(breath, part) {
  const blew = breaths.delete(part);
  if (breath !== null) breaths.set(part, breath);
  if (blowing || (breath === null && !blew)) return;
  engine.send({ breath: [...breaths.values()].at(-1) ?? null });
  midi.isTaken = true;
}

/** A key of the computer sounds though a wind controller was found, if nobody blows it. */
function takeBreath() {
  if (!midi.isTaken && BLOWING.includes(origin) && midi.rests(origin)) midi.take();
}

function setInstrument(at) {
  hands.releaseAll();
  const before = instrument;
  instrument = data.instruments[at];
  if (engine.instrument !== at) {
    engine.instrument = at;
    send(instrument);
  }
  get('instrument').value = at;
  const sounding = (fingering) => fingering.written - instrument.transposition;
  const all = instrument.fingerings.map(sounding);
  const silent = new Set(instrument.fingerings.filter((fingering) => !fingering.speaks).map(sounding));
  const [first, last] = [Math.min(...all), Math.max(...all)];
  keyboard.setRange(first, last, silent);
  typing.setRange(first, last);
  drag.notes = [...new Set(all)].sort((a, b) => a - b).filter((note) => !silent.has(note));
  // What is blown stays the written note, as far as this instrument has it.
  const far = (note, other) => Math.abs(note - other);
  hands.refinger((note) => {
    const wanted = note + before.transposition - instrument.transposition;
    return drag.notes.reduce((a, b) => (far(b, wanted) < far(a, wanted) ? b : a), drag.notes[0] ?? wanted);
  });
  drawing.setInstrument(instrument);
  holes.setInstrument(instrument, instrument.own ?? { instrument: at });
  knob.update();
}

/** An instrument of the page's, or one that has been opened. */
function send({ own }) {
  if (own) engine.send({ prepared: { file: new TextEncoder().encode(own.file), prepared: new TextEncoder().encode(own.prepared) } });
  else engine.send({ instrument: engine.instrument });
}

/** What happens to the holes. */
function follow(said) {
  if (said.built) send(instrument);
  if (said.moved) {
    knob.update();
    change();
  }
  if (said.heard) dispatchEvent(new CustomEvent('moved', { detail: said.heard }));
  if (said.opened) open(said.opened);
}

function open({ instrument: at, moved, name, file, prepared, drawn }) {
  if (drawn) {
    at = data.instruments.length;
    data.instruments.push({ ...drawn, own: { file, prepared } });
    get('instrument').append(new Option(drawn.name, at));
  }
  setInstrument(at);
  if (moved?.length > 0) holes.change(moved);
  else send(instrument);
  change();
  say(`Opened: ${drawn?.name ?? name}`);
}

function choose(preset) {
  const at = preset.instrument;
  // As the preset has it, and as it was built.
  if (data.instruments[at] !== instrument) setInstrument(at);
  else holes.reset();
  values = data.defaults.map((value, place) => preset.values[place] ?? value);
  engine.send({ values, wheel: preset.wheel, bend: preset.bend, breathFrom: preset.breathFrom });
  controls.forEach((control) => control.show(values[control.of.place]));
  meter.setPhysical(values[data.breathResponse] === 1);
  knob.update();
  presets.show();
  keep();
}

/** What the worklet tells. */
function hear(message) {
  if ('state' in message) {
    watch();
    // What stands still moves no picture.
    if (!engine.isRunning) drawing.follow(drawing.fingering, -120, 0);
  }
  if (message.failed) fail(message.failed);
  if (message.taken === false) holes.refuse();
  if (message.microphoneGone && blowing) {
    toggleMicrophone();
    say('The microphone was disconnected.');
  }
  knob.hear(message);
  if ('blowing' in message) get('microphone').classList.toggle('blowing', message.blowing);
  if (message.picture) draw(message.picture, message.microphone);
  dispatchEvent(new CustomEvent('chalumeau', { detail: message }));
}

let announced = 0;
let lastHeard = performance.now();

function draw(numbers, heard) {
  hint.pass();
  const picture = Object.fromEntries(data.picture.map((name, at) => [name, numbers[at]]));
  const level = 20 * Math.log10(picture.level + 1e-9);
  const sounds = level > SILENT_DB;
  const note = picture.sounding;
  const peak = 20 * Math.log10(picture.peak * (engine.gain ?? 1) + 1e-9);
  [room, origin] = [heard, data.origins[picture.origin]];
  hasPlayed ||= hands.held.size > 0 || sounds;
  get('level').style.transform = `translateY(${(100 * Math.min(1, Math.max(0, -peak / LEVEL_DB))).toFixed(1)}%)`;
  if (sounds || blowing || knob.isConnected || hands.held.size > 0) lastHeard = performance.now();
  else if (performance.now() - lastHeard > 1000 * REST_S) engine.rest();
  const has = note >= 0 && (sounds || picture.key >= 0);
  drawing.follow(has || sounds ? picture.fingering : drawing.fingering, sounds ? level : -120, Math.min(1, picture.mouth / 4));
  keyboard.mark(has && sounds ? note : undefined);
  if (has) {
    const written = noteName(note + instrument.transposition);
    get('written').textContent = written;
    announce(sounds ? written : '');
    get('sounding').textContent = instrument.transposition === 0 ? 'written and sounding' : `written · sounds ${noteName(note)}`;
  }
  get('written').classList.toggle('quiet', !sounds);
  knob.follow(origin === KNOB);
  meter.follow(picture.dynamic, picture.gamma, picture.mouth);
  meter.say(breathing());
  hint.tell();
}

/** Tells a screen reader the note, not oftener than twice a second. */
function announce(text) {
  if (!text || get('announced').textContent === text || performance.now() - announced < ANNOUNCED_MS) return;
  announced = performance.now();
  get('announced').textContent = text;
}

/** Where the breath comes from. */
function breathing() {
  if (room) return room.calibrating ? 'Microphone' : 'Breath: microphone';
  if (breaths.size > 0) return `Breath: ${[...breaths.keys()].at(-1) === 'letters' ? 'arrow keys' : 'mouse or finger'}`;
  return origin && !(midi.isTaken && BLOWING.includes(origin)) ? `Breath: ${origin}` : 'Breath: keys';
}

async function toggleMicrophone() {
  const button = get('microphone');
  if (isOpening) return;
  if (blowing) {
    blowing = false;
    engine.closeMicrophone();
    // A finger may have stayed.
    if (breaths.size > 0) engine.send({ breath: [...breaths.values()].at(-1) });
    hands.blow(knob.plays, instrument.transposition);
  } else {
    isOpening = true;
    try {
      begin();
      await engine.openMicrophone();
    } catch (error) {
      say(isForbidden(error) ? 'The microphone is blocked for this page. Allow it in the browser’s settings for this site, then press Blow again.' : error.name === 'NotFoundError' ? 'No microphone was found. Plug one in, and press Blow again.' : `No microphone: ${error.message}`);
      return;
    } finally {
      isOpening = false;
    }
    blowing = true;
    hands.blow(true, instrument.transposition);
  }
  button.setAttribute('aria-pressed', blowing);
  button.classList.remove('blowing');
}

/** By the user, or by the site or the address that the page has. */
function isForbidden({ name }) {
  return name === 'NotAllowedError' || name === 'SecurityError';
}

get('microphone').onclick = toggleMicrophone;
if (!navigator.mediaDevices?.getUserMedia) get('microphone').hidden = true;

const midi = new Midi(hands, (message) => engine.send(message), ({ inputs, message, gone }) => {
  // Forgets what has been found; any device may be found anew.
  if (gone) [data.breathFromKeys, presets.all[presets.at].breathFrom].forEach((breathFrom) => engine.send({ breathFrom }));
  if (inputs) {
    get('midi').setAttribute('aria-pressed', inputs.length > 0);
    get('midi').title = inputs.length > 0 ? inputs.join(', ') : 'No MIDI device is connected.';
    say(inputs.length > 0 ? `MIDI: ${inputs.join(', ')}` : 'No MIDI device is connected. Plug one in; it is found by itself.');
  }
  if (message) begin();
});
const openMidi = () => midi.open().catch((error) => say(isForbidden(error) ? 'MIDI is blocked for this page. Allow it in the browser’s settings for this site, then press MIDI again.' : `No MIDI: ${error.message}`));
get('midi').onclick = () => {
  if (get('midi').getAttribute('aria-pressed') !== 'true') return openMidi();
  midi.close();
  get('midi').setAttribute('aria-pressed', 'false');
  get('midi').title = '';
};
get('midi').hidden = !Midi.isHere;
// A telephone has no serial port.
get('knob').hidden = !HAS_MOUSE && !Knob.isHere;
// Where it has been allowed before, nobody needs to ask again.
navigator.permissions?.query({ name: 'midi' }).then(({ state }) => state === 'granted' && Midi.isHere && openMidi(), () => {});

const update = new Update(() => (get('update').hidden = false));
get('update').onclick = () => update.take();

/** For tests. */
globalThis.chalumeau = { engine, hands, holes, knob };
engine.prepared.then(() => {
  isPrepared = true;
  watch();
}, () => {});
engine.prepare().catch(fail);
