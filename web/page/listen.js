// The listening page: each sound is made by the module when it is first asked for, much faster than it sounds, and drawn.

import { json } from './names.js';
import { compiled, whySilent } from './sound.js';

/** Columns of a picture. */
const COLUMNS = 360;
const get = (id) => document.getElementById(id);
const tour = await json('tour.json').catch((error) => {
  get('trouble').textContent = `No sound: ${error.message}`;
  throw error;
});
const silent = whySilent();
if (silent) get('trouble').textContent = `No sound: ${silent}.`;
let module;
let context;
let playing;
/** Which of the clicks is the latest. */
let clicks = 0;

for (const { title, stops } of tour.chapters) {
  const chapter = document.createElement('section');
  const heading = document.createElement('h2');
  heading.textContent = title;
  chapter.append(heading, ...stops.map(card));
  get('chapters').append(chapter);
}

function card(stop) {
  const button = document.createElement('button');
  button.className = 'stop-card';
  button.setAttribute('aria-pressed', 'false');
  const [sign, words, picture, name, what] = ['i', 'span', 'canvas', 'b', 'small'].map((kind) => document.createElement(kind));
  sign.setAttribute('aria-hidden', 'true');
  name.textContent = stop.title;
  what.textContent = `${stop.words} ${(stop.samples / tour.rate).toFixed(0)} s.`;
  words.append(name, what);
  picture.setAttribute('aria-hidden', 'true');
  button.append(sign, words, picture);
  button.onclick = () => toggle(stop, button, picture).catch((error) => {
    button.classList.remove('making');
    get('trouble').textContent = `No sound: ${error.message}`;
  });
  return button;
}

async function toggle(stop, button, picture) {
  if (silent) return;
  // In the gesture: a browser lets a page sound only then.
  context ??= new AudioContext({ sampleRate: tour.rate });
  context.resume();
  const same = playing?.stop === stop || button.classList.contains('making');
  const click = (clicks += 1);
  end();
  document.querySelectorAll('.making').forEach((other) => other.classList.remove('making'));
  if (same) return;
  button.classList.add('making');
  stop.making ??= made(stop);
  try {
    stop.sound = await stop.making;
    get('trouble').textContent = '';
  } catch (error) {
    stop.making = undefined;
    throw error;
  }
  // Another one has been asked for meanwhile, or this one again to stop it.
  if (click !== clicks) return;
  button.classList.remove('making');
  const source = new AudioBufferSourceNode(context, { buffer: stop.sound });
  source.connect(context.destination);
  const own = (playing = { stop, button, source, began: context.currentTime });
  source.onended = () => playing === own && end();
  source.start();
  button.setAttribute('aria-pressed', 'true');
  follow(own, picture);
}

function end() {
  if (!playing) return;
  const { source, button } = playing;
  playing = null;
  source.stop();
  button.setAttribute('aria-pressed', 'false');
}

/** The sound, by the module in an audio worklet that need not wait for time to pass. */
async function made({ samples, messages }) {
  module ??= await compiled('chalumeau.wasm');
  const offline = new OfflineAudioContext(2, samples, tour.rate);
  await offline.audioWorklet.addModule('worklet.js');
  const processorOptions = { module, instrument: 0, score: { score: messages } };
  const node = new AudioWorkletNode(offline, 'chalumeau', { outputChannelCount: [2], processorOptions });
  node.connect(offline.destination);
  return offline.startRendering();
}

/** Draws the sound, and how much of it has been heard. */
function follow(own, canvas) {
  const ratio = devicePixelRatio || 1;
  [canvas.width, canvas.height] = [ratio * canvas.clientWidth, ratio * canvas.clientHeight];
  const g = canvas.getContext('2d');
  const samples = own.stop.sound.getChannelData(0);
  const step = Math.ceil(samples.length / COLUMNS);
  own.stop.peaks ??= Array.from({ length: COLUMNS }, (_, n) => samples.subarray(n * step, (n + 1) * step).reduce((most, x) => Math.max(most, Math.abs(x)), 0));
  const style = getComputedStyle(document.documentElement);
  const [heard, ahead] = ['--breath', '--quiet'].map((name) => style.getPropertyValue(name));
  const draw = () => {
    const share = playing === own ? (context.currentTime - own.began) / own.stop.sound.duration : 0;
    g.clearRect(0, 0, canvas.width, canvas.height);
    own.stop.peaks.forEach((peak, n) => {
      const height = Math.max(1, peak * canvas.height);
      g.fillStyle = n / COLUMNS < share ? heard : ahead;
      g.fillRect((n * canvas.width) / COLUMNS, (canvas.height - height) / 2, Math.max(1, canvas.width / COLUMNS - 0.5), height);
    });
    if (playing === own) requestAnimationFrame(draw);
  };
  draw();
}

/** For tests. */
globalThis.listen = { tour, made, playing: () => playing?.stop.title };
